"""Where a robot stands and where it looks: in a simulated world, or by its own odometry."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from elib.body import AXLE, METRES_PER_STEP
from elib.errors import ArgumentError


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a robot stands and where it looks.

    Attributes:
        x: Along the arena's width, or straight ahead of where odometry began, m.
        y: Along the arena's depth, or to the left of there, m.
        heading: Direction of travel from the x axis, positive to the left, rad, -pi..pi.
        time: When it stood there, s on the robot's clock; nan where that is not known. Takes no part in equality.
    """

    x: float
    y: float
    heading: float = 0.0
    time: float = field(default=math.nan, compare=False, repr=False, kw_only=True)

    def __post_init__(self) -> None:
        if not (type(self.x) is type(self.y) is type(self.heading) is float):
            for name in ("x", "y", "heading"):
                value = getattr(self, name)
                if type(value) not in (float, int):  # A narrow float of NumPy would make all that follows as narrow.
                    object.__setattr__(self, name, float(value))
        if not (math.isfinite(self.x) and math.isfinite(self.y) and math.isfinite(self.heading)):
            raise ArgumentError(f"the pose ({self.x}, {self.y}, {self.heading}) is not finite")


def advanced(pose: Pose, left: float, right: float, time: float = math.nan) -> Pose:
    """Return where a robot stands after *left* and *right* motor steps of its nominal wheels: at the end of an arc.

    Args:
        pose: Where it stood before.
        left: Steps of the left wheel.
        right: Steps of the right wheel.
        time: Time of the new pose, s.
    """
    way = METRES_PER_STEP * (left + right) / 2
    turn = METRES_PER_STEP * (right - left) / AXLE
    # The chord of an arc points half the turn away from where the robot looked, and is a little shorter than the arc.
    chord = way if abs(turn) < 1e-9 else way * math.sin(turn / 2) / (turn / 2)
    return Pose(
        pose.x + chord * math.cos(pose.heading + turn / 2),
        pose.y + chord * math.sin(pose.heading + turn / 2),
        math.remainder(pose.heading + turn, math.tau),
        time=time,
    )
