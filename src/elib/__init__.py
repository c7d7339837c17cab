"""Drive an e-puck robot, real or virtual, from Python.

The public names are in ``__init__.pyi``. The module of a name is imported when the name is first used, so that ``import
elib`` and ``elib --version`` are fast.
"""

from __future__ import annotations

import importlib
import os
import re

__version__ = "0.1.0"

_HIDDEN = {"open", "run"}
"""Names that ``from elib import *`` leaves out: one would hide a built-in function, the other is too common."""
# By the loader, because elib may lie in a zip archive.
_NAMES = __spec__.loader.get_data(os.path.join(os.path.dirname(__file__), "__init__.pyi")).decode()
_HOME = {name: module for module, name in re.findall(r"^from (\S+) import (\w+) as", _NAMES, re.MULTILINE)}


def __getattr__(name: str) -> object:
    if name == "__all__":
        return sorted({"__version__", *_HOME} - _HIDDEN)
    if name not in _HOME:
        raise AttributeError(f"module 'elib' has no attribute {name!r}")
    value = globals()[name] = getattr(importlib.import_module(_HOME[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
