"""Robot and simulator compared: a profile that makes the simulated robot more like yours, a fork of a recording, plots.

It stands on ``records``, ``robot`` and ``simulator``. Begin with ``comparison.py``, then ``fit.py``. ``fork.py`` goes
on from any moment of a recording, ``compass.py`` calibrates a compass, and ``drive.py`` draws what a robot did.
"""

from __future__ import annotations

from elib.base.lazy import names_of

# `elib run` needs `drive` and nothing else of it, and must start fast.
__getattr__, _homes = names_of(__spec__, __file__)
__all__ = list(_homes)
