"""Drive an e-puck robot, real or virtual, from Python. The public names are in ``__init__.pyi``."""

from __future__ import annotations

from elib.base.lazy import names_of

__version__ = "0.1.0"

__getattr__, _homes = names_of(__spec__, __file__)
# ``from elib import *`` leaves two out: one would hide a built-in function, the other is too common.
__all__ = sorted({"__version__", *_homes} - {"open", "run"})


def __dir__() -> list[str]:
    return sorted({*globals(), *_homes})
