"""A look behind the world's face: robots put anywhere, and the lengths of single rays."""

import math
import random

from elib.physics import Wall
from elib.physics import layout as at
from elib.physics.sensors import infrared, proximity
from elib.physics.sensors.rays import HITS, STRIDE


def put(world, robot, x, y, heading=0.0):
    """Put a robot at any place, whether or not it is free, at rest there."""
    record = {
        at.X: x,
        at.BEFORE_X: x,
        at.Y: y,
        at.BEFORE_Y: y,
        at.HEADING_X: math.cos(heading),
        at.BEFORE_HEADING_X: math.cos(heading),
        at.HEADING_Y: math.sin(heading),
        at.BEFORE_HEADING_Y: math.sin(heading),
        at.LAST_STEP_X: 0.0,
        at.LAST_STEP_Y: 0.0,
    }
    for key, value in record.items():
        world._state.robots[robot * at.ROBOT + key] = value
    world._state.regrid()


def set_tick(world, tick):
    world._state.numbers[at.TICK] = tick


def ray_lengths(world, robot=0):
    """Return how far each ray of each infrared sensor goes, m."""
    state = world._state
    state.engine.bare(infrared.look)(robot, *state.solid, state.scratch)
    rays = world.scene.model.rays
    return [
        float(state.scratch[STRIDE * k + sensor]) if state.scratch[HITS + sensor] else state.profile.reach
        for sensor in range(proximity.COUNT)
        for k in range(rays)
    ]


def heading_length(world, robot=0):
    r = robot * at.ROBOT
    return math.hypot(world._state.robots[r + at.HEADING_X], world._state.robots[r + at.HEADING_Y])


def clearance(scene, x, y):
    """Return the distance to the nearest fixed surface, m; below 0 inside a block or outside the arena."""
    nearest = min(x, scene.width - x, y, scene.depth - y)
    for wall in (*scene.walls, *(side for box in scene.boxes for side in box.sides)):
        nearest = min(nearest, to_segment(x, y, wall))
    for post in scene.cylinders:
        nearest = min(nearest, math.hypot(x - post.x, y - post.y) - post.radius)
    for box in scene.boxes:
        turn = complex(math.cos(-box.angle), math.sin(-box.angle)) * complex(x - box.x, y - box.y)
        if abs(turn.real) < box.width / 2 and abs(turn.imag) < box.depth / 2:
            return -1.0
    return nearest


def segments(count, side, seed, length=0.2, margin=0.2):
    """Return walls of one length anywhere in a square, their first ends off its edge by a margin, m."""
    chance = random.Random(seed)
    walls = []
    for _ in range(count):
        x, y = chance.uniform(margin, side - margin), chance.uniform(margin, side - margin)
        angle = chance.uniform(0, math.tau)
        walls.append(Wall(x, y, x + length * math.cos(angle), y + length * math.sin(angle)))
    return tuple(walls)


def to_segment(x, y, wall):
    along = complex(wall.x2 - wall.x1, wall.y2 - wall.y1)
    here = complex(x - wall.x1, y - wall.y1)
    part = min(max((here * along.conjugate()).real / abs(along) ** 2, 0.0), 1.0)
    return abs(here - part * along)
