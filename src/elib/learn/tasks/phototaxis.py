"""Go to a lamp and stay there, by the light that the infrared sensors read with their emitters off."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from elib.learn.rooms import ROBOTS, room
from elib.physics import Cylinder, Light, Scene
from elib.physics.records import Records
from elib.physics.task import Task

DARK: Final = 3750.0
"""What a sensor reads in a normal room without a lamp, counts (docs/reference/e-puck.md, 4)."""

LAMPS = ((0.20, 0.25), (1.20, 0.30), (0.25, 1.15), (1.15, 1.20), (0.70, 0.20), (0.75, 0.80), (0.15, 0.70), (1.25, 0.75))
"""Where the lamp is, m: one place in each room."""


def reward(world: Records, i: int) -> float:
    """Return how bright the brightest sensor sees the lamp, 0..1.

    0 is the room's own light. 1 is as bright as can be: the lamp stands right before a sensor.
    """
    brightest = DARK
    for s in range(8):
        brightest = min(brightest, 1.0 * world.views[i].ambient_light[s])
    return 1.0 - brightest / DARK


def lit(x: float, y: float) -> Scene:
    """Return a room with a lamp at (x, y), m, whose light falls to 1/e within 35 cm.

    The lamp stands on a foot lower than the infrared sensors: a robot can touch it, but not drive over it.
    """
    return replace(
        room(0, width=1.4, depth=1.4),
        name="lamp",
        lights=(Light(x, y, height=0.04, intensity=0.7, name="lamp"),),
        cylinders=(Cylinder(x, y, 0.02, height=0.03, name="foot"),),
    )


TASK = Task(
    name="phototaxis",
    summary="Go to a lamp and stay there.",
    source="Braitenberg 1984, Vehicles, MIT Press (the behaviour, vehicle 2b); the reward is what the robot's own "
    "sensors read",
    scenes=tuple(lit(x, y) for x, y in LAMPS),
    sensors=("ambient_light",),
    reward=reward,
    reward_sensors=("ambient_light",),
    fitness="mean",
    solved=0.5,
    seconds=60.0,
    top_speed=0.1,
    randomisation=ROBOTS,
    on_board=True,
)
