"""Readings for the tests of controllers: counts of chosen sensors, and a room with one lamp."""

from __future__ import annotations

import math
from dataclasses import replace

from elib.base.infrared import ROOM_READING
from elib.base.pose import Pose
from elib.link.protocol.values import AmbientLight, Proximity
from elib.simulator.physics import Light, Scene, World

NAMES = "front_right diagonal_right right rear_right rear_left left diagonal_left front_left".split()
NOTHING = Proximity(*[0] * 8)
DARK = round(ROOM_READING)
"""Counts of a sensor for ambient light in the dark."""


def near(**counts: int) -> Proximity:
    """Return a reading with these counts; the other sensors see nothing."""
    return Proximity(*(counts.get(name, 0) for name in NAMES))


def ideal(name: str, seed: int) -> World:
    """Return a world of the gallery with robots without faults."""
    scene = Scene.load(name)
    return World(replace(scene, model=replace(scene.model, quality="ideal")), seed=seed)


def lamp_at(direction: float, distance: float = 0.4) -> AmbientLight:
    """Return what a robot reads with a lamp in that direction, degrees to the left, and distance, m."""
    world = ideal("light", seed=1)
    angle = math.radians(direction)
    world.set_light(0, Light(0.45 + distance * math.cos(angle), 0.6 + distance * math.sin(angle), 0.12, 2.0))
    world.set_light(1, Light(0.0, 0.0, intensity=0.0))
    world.move_robot(0, Pose(0.45, 0.6))
    world.step()
    return AmbientLight(*world.ambient_light(0))


def degrees(angle: float | None) -> float:
    """Return an angle, which there must be, in degrees."""
    assert angle is not None
    return math.degrees(angle)
