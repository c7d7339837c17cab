"""Infrared readings without what the sensors read in the open, and the distances and scans that follow from them."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Final

from elib.base.body import SENSOR_DIRECTIONS, SENSOR_RADIUS
from elib.base.curves import interpolated
from elib.base.infrared import FITTED_SPREAD, GAIN_SPREAD, NINE_IN_TEN, wall_distance, wall_error
from elib.base.pose import Pose
from elib.base.timeofflight import AGE, PLACE, deviation, unbiased
from elib.link.protocol.values import Distance, FieldInfo, Numbers, Proximity, Reading, Role

MAX_OPEN_AIR: Final = 1500.0
"""Counts that a sensor reads in the open at most: real ones read 70 to 570 (measured-robots: infrared.open_offset).
More is something near, 1 cm away, even if the robot has never read less."""

SMOOTHING: Final = 0.2
"""Weight of the newest reading in the mean whose least value counts: the least single reading would be three deviations
of the noise too low."""


class OpenAir:
    """Takes off each infrared reading what that sensor reads in the open: the least that it has read so far.

    No two sensors of real robots read the same in the open, and none reads 0. ``calibrate_proximity()`` makes a robot
    take that off by itself, but needs seconds and an empty place around it. This learns while the robot drives. Where
    it starts near something, it takes that for the open until it has been elsewhere, and sees only what is nearer.

    Example:
        >>> open_air = OpenAir()
        >>> open_air(Proximity(200, 90, 310, 150, 120, 480, 260, 210)).front_right
        0
        >>> open_air(Proximity(650, 90, 310, 150, 120, 480, 260, 230)).front_right
        450
    """

    def __init__(self) -> None:
        self._mean: list[float] = []
        self._least = [MAX_OPEN_AIR] * len(Proximity())

    def __call__(self, near: Proximity) -> Proximity:
        """Return *near* without what its sensors read in the open, 0 or more."""
        self._mean = [mean + SMOOTHING * (now - mean) for mean, now in zip(self._mean or near, near, strict=True)]
        self._least = [min(pair) for pair in zip(self._least, self._mean, strict=True)]
        return Proximity(
            *(max(now - round(least), 0) for now, least in zip(near, self._least, strict=True)),
            time=near.time,
            origin=near.origin,
        )


_METRES = {"info": FieldInfo(unit="m", low=0, high=0.06, span=0.01, form=".3f")}
_BESIDE = {"info": FieldInfo(role=Role.CONVERTED, unit="m", label="time of flight", low=0, high=2, form=".3f")}
_ERROR = {"info": FieldInfo(role=Role.CONSTANT, unit="m")}


@dataclass(frozen=True, slots=True, eq=False)
class Distances(Numbers[float]):
    """Eight distances, m, clockwise from the front right; infinite (``math.inf``) where nothing is seen within 5.7 cm.

    Each is that of a wall which the sensor faces. Something narrower or aslant is nearer than it says.

    Attributes:
        errors: By how much each may be wrong, m: nine times in ten it is less. Infinite where nothing is seen.
        tof: Distance from the time-of-flight sensor to what is straight ahead, without the sensor's usual error, m.
            Infinite where it sees nothing; nan where the robot has no such sensor.
        tof_error: By how much that may be wrong, m, in the same way.
    """

    front_right: float = field(default=math.inf, metadata=_METRES)
    diagonal_right: float = field(default=math.inf, metadata=_METRES)
    right: float = field(default=math.inf, metadata=_METRES)
    rear_right: float = field(default=math.inf, metadata=_METRES)
    rear_left: float = field(default=math.inf, metadata=_METRES)
    left: float = field(default=math.inf, metadata=_METRES)
    diagonal_left: float = field(default=math.inf, metadata=_METRES)
    front_left: float = field(default=math.inf, metadata=_METRES)
    errors: tuple[float, ...] = field(default=(math.inf,) * 8, kw_only=True, repr=False, metadata=_ERROR)
    tof: float = field(default=math.nan, kw_only=True, metadata=_BESIDE)
    tof_error: float = field(default=math.nan, kw_only=True, repr=False, metadata=_ERROR)

    @property
    def ahead(self) -> float:
        """The least of the four sensors in front, m."""
        return min(self.front_left, self.front_right, self.diagonal_left, self.diagonal_right)

    @property
    def nearest(self) -> float:
        """The least of all, m."""
        return min(self)


def distances(
    above: Proximity, *, gains: Sequence[float] | None = None, reflectance: float = 1.0, flight: Distance | None = None
) -> Distances:
    """Return the distances that readings mean, by the usual curve of real sensors.

    Args:
        above: Readings of the infrared sensors without the open air.
        gains: Factor of each sensor on the usual curve; None if they are not known.
        reflectance: What the things around send back, beside a white wall, as in the file of a world.
        flight: The reading of the time-of-flight sensor, if there is one.
    """
    spread = GAIN_SPREAD if gains is None else FITTED_SPREAD
    pairs = list(zip(above, (1.0,) * len(above) if gains is None else gains, strict=True))
    tof = math.nan if flight is None else max(0.0, unbiased(flight.metres)) if flight < math.inf else math.inf
    return Distances(
        *(reflectance * wall_distance(*pair) for pair in pairs),
        errors=tuple(reflectance * wall_error(*pair, spread) for pair in pairs),
        tof=tof,
        tof_error=NINE_IN_TEN * deviation(tof) if tof < math.inf else tof,
        time=above.time,
        origin=above.origin,
    )


RAYS: Final = 36
"""Directions of a scan: ten degrees apart, a third of the width of what an infrared sensor sees."""

MEDIAN_ERROR: Final = 1.25
"""Error of the median of several sensors, in units of that of their mean."""


@dataclass(frozen=True, slots=True)
class Scan(Reading):
    """What is around the robot, by a turn on the spot: a ring of ranges from the middle of the robot.

    Attributes:
        pose: Where it was, by odometry.
        directions: Where the sensors looked, rad in the coordinates of odometry, rising from -pi.
        ranges: How far away something is there, m, from :attr:`pose`; infinite where nothing is seen, nan where the
            sensors did not look, because the link is too slow.
        errors: By how much each range may be wrong, m: nine times in ten it is less.
    """

    pose: Pose
    directions: tuple[float, ...]
    ranges: tuple[float, ...]
    errors: tuple[float, ...]

    @property
    def points(self) -> list[tuple[float, float]]:
        """The places that are seen, x and y, m, in the coordinates of odometry."""
        x, y = self.pose.x, self.pose.y
        seen = zip(self.directions, self.ranges, strict=True)
        return [(x + r * math.cos(angle), y + r * math.sin(angle)) for angle, r in seen if math.isfinite(r)]


def scan(pose: Pose, headings: Sequence[tuple[float, float]], looks: Iterable[Distances]) -> Scan:
    """Return what a robot saw that turned on the spot: each range is the median of all sensors that looked there.

    The median is what a glitch of one sensor does not change, and eight gains miss less than one.

    Args:
        pose: Where it stood.
        headings: Its headings on the way, each with its time: s and rad.
        looks: What it saw meanwhile.
    """
    directions = [math.tau * (k + 0.5) / RAYS - math.pi for k in range(RAYS)]
    near: list[list[tuple[float, float, int]]] = [[] for _ in directions]
    far: list[list[tuple[float, float, int]]] = [[] for _ in directions]
    for seen in looks:
        heading, earlier = (interpolated(headings, time) for time in (seen.time, seen.time - AGE))
        for sensor, (angle, metres, error) in enumerate(zip(SENSOR_DIRECTIONS, seen, seen.errors, strict=True)):
            near[_ray(heading + angle)].append((SENSOR_RADIUS + metres, error, sensor))
        if not math.isnan(seen.tof):
            far[_ray(earlier)].append((PLACE[0] + seen.tof, seen.tof_error, 0))
    found = [
        min(map(_middle, filter(None, two)), key=itemgetter(1), default=(math.nan, math.nan))
        for two in zip(near, far, strict=True)
    ]
    ranges = tuple(each[0] for each in found)
    errors = tuple(math.hypot(each[1], _slope(ranges, k)) for k, each in enumerate(found))
    return Scan(pose, tuple(directions), ranges, errors, time=pose.time)


def _slope(ranges: Sequence[float], k: int) -> float:
    """Return by how much ranges change from one direction to the next: sensors see more widely than one is."""
    sides = (abs(ranges[k] - ranges[(k + side) % RAYS]) for side in (-1, 1))
    seen = [each for each in sides if math.isfinite(each)]
    return statistics.fmean(seen) if seen else 0.0


def _ray(angle: float) -> int:
    return math.floor((angle + math.pi) / math.tau * RAYS) % RAYS


def _middle(seen: list[tuple[float, float, int]]) -> tuple[float, float]:
    """Return the median of ranges, and its error."""
    middle = statistics.median_high([each[0] for each in seen])
    if middle == math.inf:
        return middle, middle
    error = statistics.fmean(each[1] for each in seen if each[1] < math.inf)
    sensors = len({each[2] for each in seen})
    return middle, error * min(1.0, MEDIAN_ERROR / math.sqrt(sensors))
