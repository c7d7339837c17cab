"""The pose of a robot: its place and heading, in a simulated world or by its odometry."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from elib.base.body import AXLE, METRES_PER_STEP
from elib.base.errors import ArgumentError

PROMISED, PROMISED_HEADING = 0.01, math.radians(3)
"""m and rad: a pose that may be further off shows that where it is printed."""


@dataclass(frozen=True, slots=True)
class Pose:
    """The place of a robot and the direction in which it looks.

    Attributes:
        x: Along the width of the arena, or straight ahead from where odometry began, m.
        y: Along the depth of the arena, or to the left from where odometry began, m.
        heading: Direction of travel from the x axis, positive to the left, rad, -pi..pi.
        time: When the robot was there, s on its clock; nan if unknown. It is not compared.
        uncertainty: By how much the place may be wrong, m: 19 times in 20 it is nearer. That real wheels differ by half
            a percent is in it. Odometry knows neither slip nor a hand that lifts the robot. It is not compared.
        heading_uncertainty: By how much the heading may be wrong, rad, in the same way.
    """

    x: float
    y: float
    heading: float = 0.0
    time: float = field(default=math.nan, compare=False, repr=False, kw_only=True)
    uncertainty: float = field(default=0.0, compare=False, kw_only=True)
    heading_uncertainty: float = field(default=0.0, compare=False, kw_only=True)

    def __post_init__(self) -> None:
        if not (type(self.x) is type(self.y) is type(self.heading) is float):
            for name in ("x", "y", "heading"):
                value = getattr(self, name)
                if type(value) not in (float, int):  # A narrow float of NumPy would make all results as narrow.
                    object.__setattr__(self, name, float(value))
        if not (math.isfinite(self.x) and math.isfinite(self.y) and math.isfinite(self.heading)):
            raise ArgumentError(f"the pose ({self.x}, {self.y}, {self.heading}) is not finite")

    @property
    def is_uncertain(self) -> bool:
        """Whether it may be wrong by more than 1 cm or 3 degrees."""
        return self.uncertainty > PROMISED or self.heading_uncertainty > PROMISED_HEADING

    def __repr__(self) -> str:
        place = f"x={self.x!r}, y={self.y!r}, heading={self.heading!r}"
        if self.is_uncertain:
            place += f", uncertainty={self.uncertainty:.2g}, heading_uncertainty={self.heading_uncertainty:.2g}"
        return f"{type(self).__name__}({place})"


def apart(one: Pose, other: Pose) -> float:
    """Return how far two places are from each other, m."""
    return math.dist((one.x, one.y), (other.x, other.y))


def bearing(pose: Pose, x: float, y: float) -> float:
    """Return the direction of a place as a robot sees it, rad from straight ahead, positive to the left."""
    return math.remainder(math.atan2(y - pose.y, x - pose.x) - pose.heading, math.tau)


def advanced(pose: Pose, left: float, right: float, time: float = math.nan) -> Pose:
    """Return the pose of a robot after *left* and *right* motor steps of its nominal wheels, which make an arc.

    Args:
        pose: The pose before.
        left: Steps of the left wheel.
        right: Steps of the right wheel.
        time: The time of the new pose, s.
    """
    way = METRES_PER_STEP * (left + right) / 2
    turn = METRES_PER_STEP * (right - left) / AXLE
    # The chord of an arc points half the turn away from the old heading, and is a little shorter than the arc.
    chord = way if abs(turn) < 1e-9 else way * math.sin(turn / 2) / (turn / 2)
    return Pose(
        pose.x + chord * math.cos(pose.heading + turn / 2),
        pose.y + chord * math.sin(pose.heading + turn / 2),
        math.remainder(pose.heading + turn, math.tau),
        time=time,
    )
