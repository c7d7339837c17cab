"""The actions of et: each class in a file of this package is one."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Iterator

from elib.records.et.action import Action


def actions() -> dict[str, type[Action]]:
    """Return all actions by name, in the order of their files' names."""
    found: dict[str, type[Action]] = {}
    for module in sorted(pkgutil.iter_modules(__path__), key=lambda each: each.name):
        found |= {kind.__name__: kind for kind in _actions_in(f"{__name__}.{module.name}")}
    return found


def _actions_in(module: str) -> Iterator[type[Action]]:
    for name, kind in vars(importlib.import_module(module)).items():
        is_own = isinstance(kind, type) and issubclass(kind, Action) and kind.__module__ == module
        if is_own and not name.startswith("_") and not inspect.isabstract(kind):
            yield kind
