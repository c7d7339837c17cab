"""Robot and simulator compared: a profile that makes the simulated robot more like yours, a fork of a recording, plots.

It stands on ``records``, ``robot`` and ``simulator``. Begin with ``comparison.py``, then ``fit.py``. ``fork.py`` goes
on from any moment of a recording, ``compass.py`` calibrates a compass, and ``drive.py`` draws what a robot did.
"""

from elib.studies.comparison import Comparison, Run, compare, run_of
from elib.studies.compass import Compass, calibrate_compass, fit_compass
from elib.studies.fit import Fitted, fit_robot
from elib.studies.scores import Parity, Score, parity

__all__ = [
    "Comparison",
    "Compass",
    "Fitted",
    "Parity",
    "Run",
    "Score",
    "calibrate_compass",
    "compare",
    "fit_compass",
    "fit_robot",
    "parity",
    "run_of",
]
