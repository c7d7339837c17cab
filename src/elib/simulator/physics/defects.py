"""What is broken in a robot: its sensors, its camera, its wheels and its clock.

Each number that a robot reads, and each thing that it drives by, has a place of its own. A number whose sensor is
broken reads

    factor * what it would read + shift + noise * a normal number,

which says everything from a dead sensor to a noisy one. It is applied in front of the converter, so that a reading
stays in its range, and the same way in both engines. A robot with nothing broken is asked for nothing but their count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Final

from elib.base.errors import ArgumentError
from elib.base.rules import Choice, Mistake, Number, check, shown
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.noise import DEFECT, gauss, tick_key
from elib.simulator.physics.records import Robot, Setting

_FIRST = (0, 8, 16, 21, 25, 26, 29, 32, 35, 36, 38)
PROXIMITY_AT, AMBIENT_LIGHT_AT, GROUND_AT, MICROPHONES_AT, DISTANCE_AT, ACCELEROMETER_AT = _FIRST[:6]
GYROSCOPE_AT, MAGNETOMETER_AT, CAMERA_AT, WHEEL_AT, CLOCK_AT = _FIRST[6:]
"""Where the numbers of each part begin."""

SENSORS = (
    *("proximity", "ambient_light", "ground", "microphones"),
    *("distance", "accelerometer", "gyroscope", "magnetometer"),
)
"""The sensors that can break, by the names of the commands that read them."""

PARTS = {
    name: range(*ends)
    for name, ends in zip((*SENSORS, "camera", "wheel", "clock"), pairwise((*_FIRST, CLOCK_AT + 1)), strict=True)
}
"""All that can break, and where its numbers are."""

MAX_CLOCK: Final = 1.3
"""How fast clocks go at most, however many are broken: no motor then turns a wheel too far in the longest tick."""

FACTORS = {"wheel": (0.0, 1.0), "clock": (0.1, MAX_CLOCK)}
"""The factors of what can only be slower or faster."""

Factor = Annotated[float, Number(0, 100)]
Amount = Annotated[float, Number(-1e5, 1e5)]
Deviation = Annotated[float, Number(0, 1e5)]


@dataclass(frozen=True, slots=True)
class Defect:
    """A part of a robot that is broken. Of a broken sensor nothing tells but its readings.

    Shift, noise and what it is stuck at have the unit of the readings of a :class:`~elib.simulator.physics.World`:
    counts, m, m/s2, rad/s, microtesla; of the camera 0..255 of each colour.

    Attributes:
        of: The part: a sensor by the command that reads it, ``camera``, ``wheel`` or ``clock``.
        numbers: Which of its numbers, from 0, such as ``(0, 7)``; the left wheel is 0. Empty for all.
        factor: How much is left of a reading, or of a wheel's way; how fast the clock goes.
        shift: What is added to a reading.
        noise: Standard deviation of the noise that is added.
        stuck: What it reads whatever there is, without factor and shift; None if it is not stuck.

    Raises:
        ArgumentError: There is no such part or number, or a part cannot break like this.
    """

    of: Annotated[str, Choice((*PARTS,))]
    numbers: tuple[int, ...] = ()
    factor: Factor = 1.0
    shift: Amount = 0.0
    noise: Deviation = 0.0
    stuck: Amount | None = None

    def __post_init__(self) -> None:
        check(self)
        there = range(len(PARTS[self.of]))
        for number in self.numbers:
            if number not in there:
                raise Mistake(f"has {shown(number)}; those of {self.of} are 0 to {there[-1]}", path=("numbers",))
        if self.of in FACTORS:
            if (self.shift, self.noise, self.stuck) != (0.0, 0.0, None):
                raise ArgumentError(f"a {self.of} can only be slower or faster", hint="give only a factor, such as 0.5")
            Number(*FACTORS[self.of]).require(self.factor, "factor", f"the {self.of}'s ")

    @property
    def row(self) -> tuple[float, float, float, float]:
        """What kernels take: a bit for each number that is broken, factor, shift and noise."""
        places = PARTS[self.of]
        bits = sum(1 << places[number] for number in self.numbers or range(len(places)))
        factor, shift = (self.factor, self.shift) if self.stuck is None else (0.0, self.stuck)
        return float(bits), factor, shift, self.noise

    def __str__(self) -> str:
        """What is broken, in words."""
        dead = "dead" if self.factor == 0.0 else f"x {self.factor:g}"
        said = [f"stuck at {self.stuck:g}" if self.stuck is not None else "", dead if self.factor != 1.0 else ""]
        said += [f"{self.shift:+g}" if self.shift else "", f"± {self.noise:g}" if self.noise else ""]
        return " ".join([self.of, *map(str, self.numbers), *filter(None, said)])


@kernel
def damage(robot: Robot, row: Sequence[float]) -> None:
    """Break what :attr:`Defect.row` says, on top of what is broken already. A wheel then is as if it were smaller."""
    for n in range(4):
        robot.defect[4 * robot.defects + n] = row[n]
    robot.defects += 1
    if (int(row[0]) >> WHEEL_AT) & 1:
        robot.left_scale *= row[1]
    if (int(row[0]) >> WHEEL_AT) & 2:
        robot.right_scale *= row[1]


@kernel
def spoiled(setting: Setting, robot: Robot, n: int, value: float) -> float:
    """Return what number *n* of a robot reads instead of *value*."""
    for k in range(robot.defects):
        if (int(robot.defect[4 * k]) >> n) & 1:
            value = robot.defect[4 * k + 1] * value + robot.defect[4 * k + 2]
            value += robot.defect[4 * k + 3] * gauss(tick_key(robot.key, setting.tick), DEFECT * (k + 1) + n)
    return value


@kernel
def spoiled_counts(setting: Setting, robot: Robot, n: int, counts: int) -> int:
    """Return what number *n*, of 12 bits, reads instead of *counts*."""
    return int(min(max(spoiled(setting, robot, n, 1.0 * counts), 0.0), 4095.0) + 0.5)


@kernel
def left_of(robot: Robot, n: int) -> float:
    """Return the factor on number *n* of a robot: 1 if it is not broken."""
    factor = 1.0
    for k in range(robot.defects):
        if (int(robot.defect[4 * k]) >> n) & 1:
            factor *= robot.defect[4 * k + 1]
    return factor


@kernel
def pace(robot: Robot) -> float:
    """Return how fast the robot's clock goes, which times its motors: 1 if it is not broken."""
    return min(left_of(robot, CLOCK_AT), MAX_CLOCK)
