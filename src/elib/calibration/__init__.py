"""Compare a recorded robot with the simulator, fit a profile that makes the simulated robot more like it; a compass."""

from elib.calibration.comparison import Comparison, Run, compare, run_of
from elib.calibration.compass import Compass, calibrate_compass, fit_compass
from elib.calibration.fit import Fitted, fit_robot
from elib.calibration.scores import Parity, Score, parity

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
