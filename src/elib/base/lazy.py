"""Packages whose names are imported when they are first used, so that importing the package is fast."""

from __future__ import annotations

import importlib
import os
import re
from collections.abc import Callable
from importlib.machinery import ModuleSpec


def names_of(spec: ModuleSpec, file: str) -> tuple[Callable[[str], object], dict[str, str]]:
    """Return ``__getattr__`` for a package, and the module of each of its public names.

    The names are in the stub beside the package, ``__init__.pyi``, which type checkers read too.

    Args:
        spec: The package's ``__spec__``.
        file: Its ``__file__``.
    """
    # By the loader, because elib may lie in a zip archive.
    stub = spec.loader.get_data(os.path.join(os.path.dirname(file), "__init__.pyi"))  # type: ignore[union-attr]
    homes = {name: module for module, name in re.findall(r"^from (\S+) import (\w+) as", stub.decode(), re.MULTILINE)}

    def getattribute(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {spec.name!r} has no attribute {name!r}")
        return getattr(importlib.import_module(homes[name]), name)

    return getattribute, homes
