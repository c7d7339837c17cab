"""What is broken in a robot: its sensors, its camera, its wheels and its clock.

Each number that a robot reads, and each thing that it drives by, has a place in three rows of its record. A number
whose sensor is broken reads

    factor * what it would read + shift + noise * a normal number,

which says everything from a dead sensor to a drifting one. It is applied in front of the converter, so that a reading
stays in its range, and the same way in both engines. A robot with nothing broken is asked for nothing but one flag.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from types import MappingProxyType
from typing import Annotated, Final

from elib.base.errors import ArgumentError
from elib.base.rules import Choice, Mistake, Number, check, shown
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.noise import DEFECT, gauss, tick_key
from elib.simulator.physics.records import BREAKABLE, Robot, Setting

PROXIMITY_AT: Final = 0
AMBIENT_LIGHT_AT: Final = 8
GROUND_AT: Final = 16
MICROPHONES_AT: Final = 21
DISTANCE_AT: Final = 25
ACCELEROMETER_AT: Final = 26
GYROSCOPE_AT: Final = 29
MAGNETOMETER_AT: Final = 32
CAMERA_AT: Final = 35
WHEELS_AT: Final = 36
CLOCK_AT: Final = 38
"""Where the numbers of each part begin in the rows."""

SENSORS = MappingProxyType(
    {
        "proximity": range(PROXIMITY_AT, AMBIENT_LIGHT_AT),
        "ambient_light": range(AMBIENT_LIGHT_AT, GROUND_AT),
        "ground": range(GROUND_AT, MICROPHONES_AT),
        "microphones": range(MICROPHONES_AT, DISTANCE_AT),
        "distance": range(DISTANCE_AT, ACCELEROMETER_AT),
        "accelerometer": range(ACCELEROMETER_AT, GYROSCOPE_AT),
        "gyroscope": range(GYROSCOPE_AT, MAGNETOMETER_AT),
        "magnetometer": range(MAGNETOMETER_AT, CAMERA_AT),
    }
)
"""The sensors that can break, by the names of the commands that read them, and where their numbers are in the rows."""

PARTS = MappingProxyType(
    {
        **SENSORS,
        "camera": range(CAMERA_AT, WHEELS_AT),
        "wheels": range(WHEELS_AT, CLOCK_AT),
        "clock": range(CLOCK_AT, BREAKABLE),
    }
)
"""All that can break."""

LEAST_CLOCK, FASTEST_CLOCK = 0.1, 2.0
"""How slow and how fast a broken clock goes at most: no motor then turns a wheel too far in a tick."""

Factor = Annotated[float, Number(0, 100)]
Amount = Annotated[float, Number(-1e5, 1e5)]
Deviation = Annotated[float, Number(0, 1e5)]


@dataclass(frozen=True, slots=True)
class Defect:
    """A part of a robot that is broken. Of a broken sensor nothing tells but its readings.

    Shift, noise and the value at which a sensor is stuck have the unit of the sensor's readings in a
    :class:`~elib.simulator.physics.World`: counts, m, m/s2, rad/s, microtesla; of the camera 0..255 of each colour.

    Attributes:
        of: The part: a sensor by the command that reads it, ``camera``, ``wheels`` or ``clock``.
        numbers: Which of its numbers, from 0, such as the two front sensors ``(0, 7)``; the left wheel is 0. Empty for
            all.
        factor: What is left of a reading; how much a wheel rolls of what its motor turns; how fast the clock goes.
        shift: What is added to a reading.
        noise: Standard deviation of the noise that is added.
        stuck: What it reads whatever it is shown; None if it is not stuck.

    Raises:
        ArgumentError: There is no such part or number, or a part cannot break like this.
    """

    of: Annotated[str, Choice(tuple(PARTS))]
    numbers: tuple[int, ...] = ()
    factor: Factor = 1.0
    shift: Amount = 0.0
    noise: Deviation = 0.0
    stuck: Amount | None = None

    def __post_init__(self) -> None:
        check(self)
        most = len(PARTS[self.of]) - 1
        for number in self.numbers:
            if number not in range(most + 1):
                raise Mistake(f"has {shown(number)}; those of {self.of} are 0 to {most}", path=("numbers",))
        if self.of in ("wheels", "clock") and (self.shift or self.noise or self.stuck is not None):
            raise ArgumentError(f"{self.of} can only be slower or faster", hint="give a factor alone, such as 0.5")
        if self.of == "clock" and not LEAST_CLOCK <= self.factor <= FASTEST_CLOCK:
            raise ArgumentError(
                f"the clock goes {self.factor:g} times as fast as it should",
                hint=f"give a factor from {LEAST_CLOCK:g} to {FASTEST_CLOCK:g}",
            )
        if self.stuck is not None and (self.factor, self.shift) != (1.0, 0.0):
            raise ArgumentError("what is stuck has neither factor nor shift", hint="give stuck alone, or with noise")

    @property
    def row(self) -> tuple[float, float, float, float]:
        """What kernels take: a bit for each number that is broken, factor, shift and noise."""
        places = PARTS[self.of]
        bits = sum(1 << places[number] for number in self.numbers or range(len(places)))
        factor, shift = (self.factor, self.shift) if self.stuck is None else (0.0, self.stuck)
        return float(bits), factor, shift, self.noise

    def __str__(self) -> str:
        which = " ".join([self.of, *map(str, self.numbers)])
        how = [f"stuck at {self.stuck:g}"] if self.stuck is not None else []
        if self.factor != 1.0:
            how.append("dead" if self.factor == 0.0 else f"x {self.factor:g}")
        how += [f"{self.shift:+g}"] if self.shift else []
        return " ".join([which, *how, *([f"± {self.noise:g}"] if self.noise else [])])


@kernel
def damage(robot: Robot, row: Sequence[float]) -> None:
    """Break what :attr:`Defect.row` says, on top of what is broken already."""
    if robot.is_broken == 0:
        robot.is_broken = 1
        for n in range(BREAKABLE):
            robot.broken_factor[n] = 1.0
            robot.broken_shift[n] = 0.0
            robot.broken_noise[n] = 0.0
    bits = int(row[0])
    for n in range(BREAKABLE):
        if (bits >> n) & 1:
            before = row[1] * robot.broken_noise[n]
            robot.broken_factor[n] *= row[1]
            robot.broken_shift[n] = row[1] * robot.broken_shift[n] + row[2]
            robot.broken_noise[n] = sqrt(before * before + row[3] * row[3])


@kernel
def spoiled(setting: Setting, robot: Robot, n: int, value: float) -> float:
    """Return what number *n* of a robot reads instead of *value*."""
    if robot.is_broken == 0:
        return value
    value = robot.broken_factor[n] * value + robot.broken_shift[n]
    if robot.broken_noise[n] > 0.0:
        value += robot.broken_noise[n] * gauss(tick_key(robot.key, setting.tick), DEFECT + n)
    return value


@kernel
def pace(robot: Robot) -> float:
    """Return how fast the robot's clock goes, which times its motors: 1 if it is not broken."""
    return robot.broken_factor[CLOCK_AT] if robot.is_broken else 1.0
