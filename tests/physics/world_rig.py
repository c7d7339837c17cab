"""Worlds put into any state by hand, values of their records that have no public name, and what is compiled for tests.

Compiling is what costs most here. So the quick tests of the compiled engine share three sets of compiled code, which
the fixtures of ``conftest.py`` compile once: worlds in one thread with all sensors, readings in two threads, and
episodes that are steered. A control function and a reward are compiled in each process, in a moment. All else (walls,
robots, rays, noise, parameters, seeds, numbers of worlds) is data.
"""

import enum
import math
import random
from functools import lru_cache

import numpy as np
import pytest

from elib.simulator.physics import (
    Box,
    Controller,
    Cylinder,
    Episodes,
    EpuckModel,
    Light,
    Scene,
    Sound,
    Task,
    Wall,
    World,
    assembly,
    profiles,
)
from elib.simulator.physics import records as kinds
from elib.simulator.physics.engine import engine_named
from elib.simulator.physics.floor import floor_of
from elib.simulator.physics.raycast import cast
from elib.simulator.physics.records import SENSORS
from elib.simulator.physics.senses import Senses
from elib.simulator.physics.sensors.proximity import look
from elib.simulator.physics.simulation import braitenberg
from elib.simulator.physics.state import State

IDEAL = EpuckModel(quality="ideal")
"""Robots without faults, for tests of a law: what they read and do is all that the law says."""

ENGINES = ("interpreted", "compiled")
BUSY = Scene(
    1.0,
    1.0,
    walls=(Wall(0.5, 0.1, 0.5, 0.4), Wall(0.1, 0.7, 0.3, 0.6)),
    boxes=(Box(0.75, 0.75, 0.12, 0.08, 0.5), Box(0.3, 0.4, 0.08, 0.08, is_pushable=True)),
    cylinders=(Cylinder(0.75, 0.3, 0.05), Cylinder(0.5, 0.6, 0.04, is_pushable=True)),
    lights=(Light(0.2, 0.9),),
    sounds=(Sound(0.1, 0.1, 500),),
    model=EpuckModel(
        motor_noise=0.05,
        wheel_spread=0.01,
        axle_spread=0.01,
        gain_spread=0.05,
        offset_spread=5.0,
        ground_module=True,
        quality="ideal",
    ),
)
"""A world with one of everything."""


WEIGHTS = np.linspace(0.5, -0.5, 8)
SCALES = (0.5, (1.0, 2.0))


class Mode(enum.IntEnum):
    CAREFUL = 3


def squash(x, gain=2.0):
    return math.tanh(gain * x)


def scaled(factor):
    def scale(x):
        return factor * x + SCALES[1][1]

    return scale


eased = scaled(0.25)


def sense(robot):
    """Bear the name of a kernel, as any helper of a control function may."""
    near = 0.0
    for i in range(8):
        near += WEIGHTS[i] * robot.proximity[i]
    return near / 1000


def general(robot, parameters, memory):
    """Drive as Braitenberg's vehicles do by the first 18 parameters, and add a share, the next one, of all else.

    It uses every kind of thing that a control function may use.
    """
    before = robot.left  # Wheels stand before each decision.
    braitenberg(robot, parameters, memory)
    share = parameters[18]
    memory[0] = squash(0.9 * memory[0] + parameters[19] * sense(robot))
    memory[1] += math.sin(robot.time) + math.exp(-memory[0]) + math.sqrt(robot.time)
    robot.left += before + share * (200 * memory[0] + robot.number * Mode.CAREFUL + eased(parameters[19]))
    robot.right += before - share * 200 * memory[0]
    robot.fitness += (robot.left + robot.right) / 1000 * (1 - max(robot.proximity[0], robot.proximity[7]) / 4095)


def vehicle(*weights, share=0.0, gain=0.8, **more):
    """Return the controller of most tests: a Braitenberg vehicle, and more with a *share*."""
    return Controller(general, [*Controller.braitenberg(*weights, **more).parameters, share, gain], memory=2)


def driven(world, i):
    """Earn what the robot drove in the tick, m, less what it senses."""
    robot = world.robots[i]
    dx = robot.x - robot.before_x
    dy = robot.y - robot.before_y
    return math.sqrt(dx * dx + dy * dy) - world.views[i].proximity[0] / 4095000.0


def task(*scenes, **more):
    """Return a task in these scenes."""
    given = {"reward_sensors": ("proximity",), "fitness": "sum", "seconds": 2.0}
    return Task("test", "Do what the test says.", scenes, **{"reward": driven, **given, **more})


def compile_worlds():
    """Compile worlds in one thread, and their sensors."""
    world = World(BUSY, robots=2, engine="compiled")
    world.run(1, vehicle())
    world.run(1)
    world.snapshot(beams=True)
    world.readings("proximity")
    for sensor in SENSORS:
        getattr(world, sensor)(0)


def compile_threads():
    """Compile readings in two threads."""
    World(BUSY, robots=2, engine="compiled", threads=2).readings("proximity")


def compile_episodes():
    """Compile steered episodes."""
    Episodes(task(BUSY, seconds=0.25, period=1 / 64)).step([[[0.0, 0.0]]])


def everything(world):
    """Return all that changes in a world while it runs, to the last bit."""
    parts = {"robots": kinds.Robot, "views": kinds.SensorView, "things": kinds.Thing}
    return {
        f"{part}.{name}": world._state.engine.column(kind, getattr(world._state.world, part), name).tobytes()
        for part, kind in parts.items()
        for name in kind.__dataclass_fields__
        if name != "lane"  # In which thread it is sensed.
    }


class Room:
    """A scene laid out with its robots where they start, whether or not they are free there, and its sensors."""

    def __init__(self, scene, seed=0, engine="interpreted"):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(assembly, "MIN_CELL", 0.5)  # Laid out in a moment; other tests have the usual cells.
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
    found = [[] for _ in range(profiles.COUNT)]
    for k, fan in enumerate(records.fans[: records.setting[0].infrared_fans]):
        cast(records, scratch, profiles.COUNT, fan)
        for s, lengths in enumerate(found):
            lengths += [scratch.ahead[s], scratch.left[s], scratch.right[s]][k > 0 :]
    return [length for lengths in found for length in lengths[:rays]]


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
