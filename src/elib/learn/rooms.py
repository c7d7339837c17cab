"""What the tasks share: the length of their ticks, rooms with obstacles, and how far robots differ."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from typing import Final

from elib.simulator.physics import Box, Cylinder, Pose, Scene
from elib.simulator.physics.geometry import Solid
from elib.simulator.physics.records import Records, Robot
from elib.simulator.physics.task import Randomisation

STEP = 1 / 40
"""s. Four ticks make the period of 0.1 s in which the controllers of all tasks decide."""

WIDTH: Final = 0.074
"""m. The width of a robot: that far apart are the middles of two that touch."""

TOP_SPEED: Final = 0.1
"""m/s of a wheel, in the tasks that reward speed. Of a Khepera in the paper of avoid: 0.08 m/s."""

FULL_SCALE: Final = 4095.0
"""What an infrared sensor reads at most, counts."""

GAP = 0.13
"""m. Least way between two obstacles: a robot passes and can turn round."""

ROBOTS = Randomisation(
    spread=(0.5, 1.5),  # From good robots to poorer ones than typical: gains, wheels, axles (measured-robots.md).
    motor_noise=(0.0, 0.03),  # Enki's factor of 0.95 to 1.05 has a deviation of 0.03 (docs/reference/e-puck.md, 1).
    sensor_noise=(0.5, 1.5),  # Around the noise of a standing robot, 3 counts and 1 % (3).
    offset_spread=(0.0, 20.0),  # What is left after a calibration: the noise of a least reading, and drift.
    ambient=(3600.0, 3900.0),  # Around the 3790 of a normal room (4).
    latency=(0.0, 0.1),  # Two commands take 0.09 s over Bluetooth (docs/reference/wire-protocol.md, 5.13).
)
"""How far robots differ: drawn once an episode."""


def distance(x1: float, y1: float, x2: float, y2: float) -> float:
    """Return the distance of two points, for rewards: also compiled."""
    dx = x2 - x1
    dy = y2 - y1
    return math.sqrt(dx * dx + dy * dy)


def forward_speed(robot: Robot) -> float:
    """Return how fast a robot drives forward, as a part of its top speed, -1..1: the mean of its wheels."""
    return min(max(0.5 * (robot.left_speed + robot.right_speed) / TOP_SPEED, -1.0), 1.0)


def nearness(world: Records, i: int) -> float:
    """Return the highest of a robot's eight infrared readings as a part of the full scale, 0..1."""
    highest = 0
    for s in range(8):
        highest = max(highest, world.views[i].proximity[s])
    return highest / FULL_SCALE


def gallery(name: str) -> Scene:
    """Return a world that comes with elib, with the tick of the tasks and without starts."""
    return replace(Scene.load(name), step=STEP, starts=())


def room(seed: int, *, width: float = 1.0, depth: float = 1.0, posts: int = 0, boxes: int = 0) -> Scene:
    """Return a room, m, with round posts and boxes at places that the seed chooses."""
    draw = random.Random(seed)
    solids: list[tuple[Solid, float]] = []  # Each with the radius of the circle around it.
    while len(solids) < posts + boxes:
        x, y = (round(draw.uniform(0.0, side), 3) for side in (width, depth))
        if len(solids) < posts:
            reach = round(draw.uniform(0.03, 0.06), 3)
            solid: Solid = Cylinder(x, y, reach)
        else:
            sides = round(draw.uniform(0.06, 0.2), 3), round(draw.uniform(0.06, 0.1), 3)
            reach = math.sqrt(sides[0] ** 2 + sides[1] ** 2) / 2
            solid = Box(x, y, *sides, angle=round(draw.uniform(0.0, math.pi), 3))
        far = reach + GAP
        is_inside = far <= x <= width - far and far <= y <= depth - far
        if is_inside and all(other.distance(x, y) >= far for other, _ in solids):
            solids.append((solid, reach))
    cylinders = tuple(solid for solid, _ in solids if isinstance(solid, Cylinder))
    blocks = tuple(solid for solid, _ in solids if isinstance(solid, Box))
    return Scene(width, depth, step=STEP, name=f"room {seed}", cylinders=cylinders, boxes=blocks)


def cluster(seed: int, robots: int, x: float, y: float) -> tuple[Pose, ...]:
    """Return starts in rows of three around (x, y), a hand's breadth apart, with headings that the seed chooses."""
    draw = random.Random(seed)
    return tuple(
        Pose(x + 0.09 * (k % 3 - 1), y + 0.09 * (k // 3 - 1), round(draw.uniform(-math.pi, math.pi), 3))
        for k in range(robots)
    )
