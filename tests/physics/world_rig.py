"""Worlds put into any state by hand, and values of their records that have no public name."""

import math
import random
from functools import lru_cache

import pytest

from elib.physics import Wall, profiles
from elib.physics.engine import engine_named
from elib.physics.floor import floor_of
from elib.physics.raycast import cast
from elib.physics.senses import Senses
from elib.physics.sensors.proximity import look
from elib.physics.state import State

ENGINES = ("interpreted", "compiled")


class Room:
    """A scene laid out with its robots where they start, whether or not they are free there, and its sensors."""

    def __init__(self, scene, seed=0, engine="interpreted"):
        if engine == "compiled":
            pytest.importorskip("numba")
        self.state = State(scene, scene.starts, seed, engine_named(engine), floor_of(scene))
        self.robots = self.state.world.robots
        self.senses = Senses(self.state)

    def at_tick(self, tick):
        self.state.world.setting[0].tick = tick
        return self

    def read(self, sensor, robot=0):
        """Return what a sensor reads, as a list of numbers."""
        return self.senses.reading(sensor, robot)


room_of = lru_cache(maxsize=64)(Room)
"""One for each scene: for tests that change nothing but the tick, or what they set each time."""


def put(world, robot, x, y, heading=0.0):
    """Put a robot at any place, whether or not it is free, at rest there."""
    here = world._state.world.robots[robot]
    here.x = here.before_x = x
    here.y = here.before_y = y
    here.heading_x = here.before_heading_x = math.cos(heading)
    here.heading_y = here.before_heading_y = math.sin(heading)
    here.last_step_x = here.last_step_y = 0.0
    world._state.list_near()


def set_tick(world, tick):
    world._state.world.setting[0].tick = tick


def ray_lengths(world, robot=0):
    """Return how far each ray of each infrared sensor goes, m, in the order of the profiles' shares."""
    records = world._state.world
    look(records, robot)
    scratch, rays = records.scratch[records.robots[robot].lane], world.scene.model.rays
    found = []
    for s in range(profiles.COUNT):
        if scratch.clearance[s] > 0.0:  # Left out: the ray meets nothing.
            found += [records.fans[0].reach] * rays
            continue
        place = scratch.place_x[s], scratch.place_y[s], scratch.axis_x[s], scratch.axis_y[s]
        fans = [cast(records, scratch, *place, fan)[:3] for fan in records.fans[: records.setting[0].infrared_fans]]
        found += [fans[0][0], *(length for _, *pair in fans for length in pair)][:rays]
    return found


def heading_length(world, robot=0):
    here = world._state.world.robots[robot]
    return math.hypot(here.heading_x, here.heading_y)


def clearance(scene, x, y):
    """Return the distance to the nearest fixed surface, m; below 0 inside a block or outside the arena."""
    solids = (*scene.walls, *scene.boxes, *scene.cylinders)
    return min(x, scene.width - x, y, scene.depth - y, *(solid.distance(x, y) for solid in solids))


def segments(count, side, seed, length=0.2, margin=0.2):
    """Return walls of one length anywhere in a square, their first ends off its edge by a margin, m."""
    chance = random.Random(seed)
    walls = []
    for _ in range(count):
        x, y = chance.uniform(margin, side - margin), chance.uniform(margin, side - margin)
        angle = chance.uniform(0, math.tau)
        walls.append(Wall(x, y, x + length * math.cos(angle), y + length * math.sin(angle)))
    return tuple(walls)
