"""Helpers for tests of programs that drive e-pucks: virtual robots, simulated time, faults of the link.

It stands on ``robot`` and ``simulator``. Begin with ``simulated_time.py`` and ``faults.py``; ``plugin.py`` gives them
to pytest as fixtures.
"""

from __future__ import annotations

from elib.base.lazy import names_of

# pytest loads this package in every run, even if no test uses elib.
__getattr__, _homes = names_of(__spec__, __file__)
__all__ = list(_homes)
