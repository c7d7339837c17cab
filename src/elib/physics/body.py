"""The e-puck's body as numbers, and how far one specimen may differ from the next.

Sources are gathered in the project's robot model: e-puck.org, the thesis of 2011 (T), the firmware, and the
models of Enki, Webots and ARGoS.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from elib.body import AXLE, WHEEL_DIAMETER
from elib.errors import ArgumentError

__all__ = ["AXLE", "HEIGHT", "MASS", "RADIUS", "SENSOR_RADIUS", "WHEEL_DIAMETER", "EpuckModel"]

RADIUS = 0.037
"""Collision radius, m. Webots and Enki agree; the printed 35 mm leaves out the ring."""

HEIGHT = 0.050
"""Height of the body, m (Webots gives 45..50 mm, without extensions)."""

MASS = 0.150
"""kg (Webots, Enki; without the wheels' 10 g). The e-puck2 weighs 20 g less."""

SENSOR_RADIUS = 0.035
"""Distance of the infrared sensors from the axis, m: on the edge of the base plate (Player, epuck_ros2)."""


@dataclass(frozen=True, slots=True)
class EpuckModel:
    """What makes the robots of a world: sensor profile, noise and the spread between specimens.

    By default the drive is exact, so a program's path can be computed by hand; the infrared sensors are
    noisy, because a program that works only without noise does not work. Spreads are drawn once a robot
    from the world's seed.

    Attributes:
        profile: Response of the infrared sensors, a name in :data:`~elib.physics.sensors.proximity.PROFILES`.
        rays: Of each infrared sensor, 1, 3 or 5: the more, the softer the edges of things.
        sensor_noise: Factor on the noise of every sensor, 0..10; 0 switches it off.
        gain_spread: Standard deviation of each infrared sensor's gain around 1, 0..0.3.
        offset_spread: Standard deviation of what each infrared sensor reads in the open, counts, 0..200: what
            ``calibrate_proximity()`` is for.
        ambient: What the infrared sensors read in the room's light, counts, 0..4095, higher is darker.
        motor_noise: Standard deviation of each wheel's travel in each tick, relative, 0..0.3.
        wheel_spread: Standard deviation of each wheel's radius around nominal, relative, 0..0.1. Real
            robots: 0.003 to 0.005, since T reached 10 cm to less than 1 mm.
        axle_spread: Standard deviation of the axle around nominal, relative, 0..0.1.
        ground_module: The robots carry the ground sensor module.
        generation: Whose step motors they have, 1 or 2 (e-puck2), where a speed is set in steps/s.
        lens: Through which their cameras look, a name in :data:`~elib.physics.sensors.optics.LENSES`.
    """

    profile: str = "enki"
    rays: int = 3
    sensor_noise: float = 1.0
    gain_spread: float = 0.0
    offset_spread: float = 0.0
    ambient: float = 3750.0
    motor_noise: float = 0.0
    wheel_spread: float = 0.0
    axle_spread: float = 0.0
    ground_module: bool = False
    generation: int = 1
    lens: str = "epucklib"

    def __post_init__(self) -> None:
        for name, high in _LIMITS.items():
            value = getattr(self, name)
            if not (math.isfinite(value) and 0 <= value <= high):
                raise ArgumentError(f"{name} is {value}; it must be from 0 to {high}")
        if self.rays not in (1, 3, 5):
            raise ArgumentError(f"rays is {self.rays}; it must be 1, 3 or 5")
        if self.generation not in (1, 2):
            raise ArgumentError(f"generation is {self.generation}; it must be 1 or 2")


_LIMITS = {
    "sensor_noise": 10,
    "gain_spread": 0.3,
    "offset_spread": 200,
    "ambient": 4095,
    "motor_noise": 0.3,
    "wheel_spread": 0.1,
    "axle_spread": 0.1,
}
