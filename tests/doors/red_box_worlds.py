"""The world ``red-boxes`` with one red box and everything placed at random, and whether a robot found that box."""

from __future__ import annotations

import math
from dataclasses import replace
from random import Random

from elib.simulator.physics import Pose, Scene
from elib.simulator.physics.geometry import Box
from elib.simulator.worlds.writer import written_scene

RED = "red 1"
REACH = {"robot": 0.045}
"""m around the middle of a thing that nothing else may enter; half a diagonal for things that are not listed."""
ROOM = 0.09
"""m that stay free between two things: a robot of 7.4 cm gets through."""
WALL = 0.06
"""m between a thing and the wall."""


def random_placement(seed: int) -> Scene:
    """Return the scene of a seed: a robot, the first red box, and the four things of other colours, all at random."""
    chance = Random(f"red boxes {seed}")
    scene = Scene.load("red-boxes")
    taken: list[tuple[float, float, float]] = []

    def place(reach: float) -> tuple[float, float]:
        while True:
            margin = WALL + reach
            x, y = chance.uniform(margin, scene.width - margin), chance.uniform(margin, scene.depth - margin)
            if all(math.hypot(x - other[0], y - other[1]) > reach + other[2] + ROOM for other in taken):
                taken.append((x, y, reach))
                return x, y

    boxes = []
    for box in scene.boxes:
        if not box.name.startswith("red") or box.name == RED:
            x, y = place(math.hypot(box.width, box.depth) / 2)
            boxes.append(replace(box, x=x, y=y, angle=chance.uniform(-math.pi, math.pi)))
    cylinders = []
    for cylinder in scene.cylinders:
        x, y = place(cylinder.radius)
        cylinders.append(replace(cylinder, x=x, y=y))
    start = Pose(*place(REACH["robot"]), chance.uniform(-math.pi, math.pi))
    return replace(scene, boxes=tuple(boxes), cylinders=tuple(cylinders), starts=(start,), seed=seed)


def written_placement(seed: int) -> str:
    """Return the text of the world file of a seed."""
    return written_scene(random_placement(seed), f"The placement {seed} of red-boxes, with one red box.")


def gap(box: Box, x: float, y: float) -> float:
    """Return the distance from a point to a box, m; 0 within it."""
    cos, sin = math.cos(box.angle), math.sin(box.angle)
    along = abs((x - box.x) * cos + (y - box.y) * sin) - box.width / 2
    across = abs((y - box.y) * cos - (x - box.x) * sin) - box.depth / 2
    return math.hypot(max(along, 0.0), max(across, 0.0))
