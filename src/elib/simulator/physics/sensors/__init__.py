"""What a robot perceives of the world: one law a module, computed only when read."""

from __future__ import annotations

from collections.abc import Iterable

from elib.base.errors import ArgumentError
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.records import SENSORS, Records
from elib.simulator.physics.sensors.acceleration import read as read_acceleration
from elib.simulator.physics.sensors.ambient_light import read as read_ambient_light
from elib.simulator.physics.sensors.distance import read as read_distance
from elib.simulator.physics.sensors.ground import read as read_ground
from elib.simulator.physics.sensors.microphones import read as read_microphones
from elib.simulator.physics.sensors.proximity import read as read_proximity
from elib.simulator.physics.sensors.rotation import read as read_rotation


def chosen(sensors: Iterable[str]) -> int:
    """Return a number that says which sensors are to be read: a bit for each, in the order of ``SENSORS``.

    Raises:
        ArgumentError: There is no such sensor.
    """
    found = 0
    for name in sensors:
        if name not in SENSORS:
            raise ArgumentError(f"there is no sensor {name!r}", hint=f"choose from {', '.join(SENSORS)}")
        found |= 1 << SENSORS.index(name)
    return found


PROXIMITY, AMBIENT_LIGHT, GROUND, MICROPHONES, DISTANCE, ACCELERATION, ROTATION = (1 << k for k in range(len(SENSORS)))


@kernel
def sense(world: Records, i: int, sensors: int) -> None:
    """Let robot *i* read its sensors: ``sense(world, i, chosen(["proximity"]))``."""
    if sensors & PROXIMITY:
        read_proximity(world, i)
    if sensors & AMBIENT_LIGHT:
        read_ambient_light(world, i)
    if sensors & GROUND:
        read_ground(world, i)
    if sensors & MICROPHONES:
        read_microphones(world, i)
    if sensors & DISTANCE:
        read_distance(world, i)
    if sensors & ACCELERATION:
        read_acceleration(world, i)
    if sensors & ROTATION:
        read_rotation(world, i)
