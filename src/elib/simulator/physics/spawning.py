"""How robots begin: where they stand, and how each specimen differs from the next."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from elib.base.body import AXLE_SPREAD, WHEEL_SPREAD
from elib.simulator.physics.body import AXLE, RADIUS
from elib.simulator.physics.engine import kernel
from elib.simulator.physics.noise import AXLE_LENGTH, WHEEL, gauss, numbered_key, spread_between
from elib.simulator.physics.records import Records, Robot, Setting
from elib.simulator.physics.sensors.ground import vary_ground
from elib.simulator.physics.sensors.proximity import vary_infrared

FOREVER: Final = math.inf

SLOT: Final = 1 / 256
"""s. An e-puck1 samples its infrared sensors pair by pair, each pair 64 times a second (wire-protocol.md, 5)."""


@kernel
def spawn(world: Records, starts: Sequence[Sequence[float]], seed_key: int) -> None:
    """Put every robot to its start, as if nothing had happened yet.

    Args:
        world: All records.
        starts: x, y, m, cosine and sine of the heading of each robot.
        seed_key: What :func:`~elib.simulator.physics.noise.seed_key` makes of the seed.
    """
    setting = world.setting[0]
    setting.tick = 0
    setting.key = seed_key
    for i in range(len(world.robots)):
        robot = world.robots[i]
        stand(robot, starts[i][0], starts[i][1], starts[i][2], starts[i][3])
        robot.left_speed = 0.0
        robot.right_speed = 0.0
        robot.left_travel = 0.0
        robot.right_travel = 0.0
        robot.covered = 0.0
        robot.left_steps = 0.0
        robot.right_steps = 0.0
        robot.volume = 0.0
        robot.silent_from = FOREVER
        robot.frequency = 0.0
        robot.touched = -1
        robot.energy = robot.full
        robot.was_told = 0
        robot.score = 0.0
        robot.zones = 0
        robot.digest = 0
        robot.seen = -1
        robot.defects = 0
        robot.slot = SLOT
        robot.radius = RADIUS
        robot.key = numbered_key(seed_key, i)
        vary(setting, robot)
        world.views[i].number = i


@kernel
def stand(robot: Robot, x: float, y: float, heading_x: float, heading_y: float) -> None:
    """Put a robot somewhere, as if it had been there for a while."""
    robot.x = x
    robot.y = y
    robot.heading_x = heading_x
    robot.heading_y = heading_y
    robot.before_x = x
    robot.before_y = y
    robot.before_heading_x = heading_x
    robot.before_heading_y = heading_y
    robot.last_step_x = 0.0
    robot.last_step_y = 0.0


@kernel
def vary(setting: Setting, robot: Robot) -> None:
    """Draw what this specimen differs in."""
    key = robot.key
    wheels = spread_between(setting.spread, setting.wheel_spread, WHEEL_SPREAD)
    axle = spread_between(setting.spread, setting.axle_spread, AXLE_SPREAD)
    robot.left_scale = 1.0 + wheels * gauss(key, WHEEL)
    robot.right_scale = 1.0 + wheels * gauss(key, WHEEL + 1)
    robot.axle = AXLE * (1.0 + axle * gauss(key, AXLE_LENGTH))
    vary_infrared(setting, robot)
    vary_ground(setting, robot)
