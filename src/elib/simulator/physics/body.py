"""The e-puck's body as numbers, and how far one specimen may differ from the next.

Sources are gathered in e-puck.md: e-puck.org, the thesis of 2011 (T), the firmware, and the
models of Enki, Webots and ARGoS.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Final

from elib.base.body import AXLE, RADIUS, SENSOR_RADIUS, WHEEL_DIAMETER
from elib.base.infrared import ROOM_READING
from elib.base.rules import Choice, Number, Text, check
from elib.simulator.physics.profiles import Profile

__all__ = ["AXLE", "GRAVITY", "HEIGHT", "MASS", "RADIUS", "SENSOR_RADIUS", "WHEEL_DIAMETER", "EpuckModel"]

HEIGHT = 0.050
"""Height of the body, m (Webots gives 45..50 mm, without extensions)."""

MASS = 0.150
"""kg (Webots, Enki; without the wheels' 10 g). The e-puck2 weighs 20 g less."""

GRAVITY = 9.81
"""m/s2. It holds the robot's wheels, and all that it pushes, to the floor."""


Ambient = Annotated[float, Number(0, 4095, "counts")]
"""What the infrared sensors read in the room's light."""

QUALITIES: Final = {"ideal": 0.0, "good": 0.5, "typical": 1.0, "bad": 2.0}
"""How good robots are: the factor on every spread that was measured between real robots, and on what only real robots
do, such as noise while they drive. Each sensor's file states its figures at 1, the typical robot."""

BY_QUALITY: Final = -1.0
"""Stands for a spread that the world does not give: the robots' quality does."""

Quality = Annotated[str, Choice(tuple(QUALITIES))]
Noise = Annotated[float, Number(0, 10)]
GainSpread = Annotated[float, Number(0, 0.5, example="0.05")]
OffsetSpread = Annotated[float, Number(0, 300, "counts", example="20")]
MotorNoise = Annotated[float, Number(0, 0.3, example="0.01")]
DriveSpread = Annotated[float, Number(0, 0.1, example="0.004")]


@dataclass(frozen=True, slots=True)
class ProfileRule(Text):
    """The name of a response profile, or one of its own."""

    def accept(self, value: object) -> Any:
        """Return *value*."""
        return value if isinstance(value, Profile) else Text.accept(self, value)


@dataclass(frozen=True, slots=True)
class EpuckModel:
    """What makes the robots of a world: sensor profile, noise and the spread between specimens.

    By default the drive is exact, so a program's path can be computed by hand; the infrared sensors are
    noisy, because a program that works only without noise does not work. Spreads are drawn once a robot
    from the world's seed.

    Attributes:
        quality: How good the robots are, a name in :data:`QUALITIES`: ``ideal`` ones are all alike; the faults of the
            others are drawn by the seed, so that two robots differ as two real ones do.
        profile: Whose response the infrared sensors have, a name in
            :data:`~elib.simulator.physics.profiles.PROFILES`: ``measured`` is that of real robots, the others were
            published; or a response of their own.
        rays: The number of rays of each infrared sensor, 1, 3 or 5: the more, the softer the edges of things.
        sensor_noise: Factor on the noise of every sensor, 0..10; 0 switches it off.
        gain_spread: Standard deviation of each infrared sensor's gain around 1, 0..0.5; None: by the quality, 0.17 for
            typical robots.
        offset_spread: Standard deviation of what each infrared sensor reads in the open, counts, 0..300; the mean of
            that is 5/3 of it. It is what ``calibrate_proximity()`` is for. None: by the quality, 120 for typical
            robots.
        ambient: What the infrared sensors read in the room's light, counts, 0..4095; higher is darker.
        motor_noise: Standard deviation of each wheel's travel in each tick, relative, 0..0.3.
        wheel_spread: Standard deviation of each wheel's radius around nominal, relative, 0..0.1; None: by the quality,
            0.005 for typical robots.
        axle_spread: Standard deviation of the axle around nominal, relative, 0..0.1; None: by the quality, 0.007 for
            typical robots.
        ground_module: The robots carry the ground sensor module.
        generation: Whose step motors and camera they have, 1 or 2 (e-puck2), where a firmware does not say it.
        lens: Whose published field of view their cameras have, a name in :data:`~elib.simulator.physics.optics.LENSES`.
    """

    quality: Quality = "typical"
    profile: Annotated[str | Profile, ProfileRule()] = "measured"
    rays: Annotated[int, Choice((1, 3, 5))] = 3
    sensor_noise: Noise = 1.0
    gain_spread: GainSpread | None = None
    offset_spread: OffsetSpread | None = None
    ambient: Ambient = ROOM_READING
    motor_noise: MotorNoise = 0.0
    wheel_spread: DriveSpread | None = None
    axle_spread: DriveSpread | None = None
    ground_module: bool = False
    generation: Annotated[int, Choice((1, 2))] = 1
    lens: Annotated[str, Text()] = "measured"

    def __post_init__(self) -> None:
        check(self)

    @property
    def spread(self) -> float:
        """Factor on all that tells real robots from ideal ones: that of the quality."""
        return QUALITIES[self.quality]

    def given(self, name: str) -> float:
        """Return the number of this name as the kernels take it: :data:`BY_QUALITY` where it is None."""
        value: float | None = getattr(self, name)
        return BY_QUALITY if value is None else value
