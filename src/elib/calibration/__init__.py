"""Compare a recorded robot with the simulator, and fit a profile that makes the simulated robot more like it."""

from elib.calibration.comparison import Comparison, Run, compare, run_of
from elib.calibration.fit import Fitted, fit_robot
from elib.calibration.scores import Parity, Score, parity

__all__ = ["Comparison", "Fitted", "Parity", "Run", "Score", "compare", "fit_robot", "parity", "run_of"]
