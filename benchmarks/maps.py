"""How well a robot knows where it is, comes where it is told to, and maps where it never was: in the world ``maze``.

Robots are typical ones, drawn by a seed each, and so are the places where they are put. Whether a robot is right is
asked of the world. Robot time is simulated: a minute of it takes some seconds.
"""

from __future__ import annotations

import asyncio
import asyncio
import math
import os
import random
import statistics
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np
from harness import Table, Tables, quick, run

import elib
from elib.base.errors import ArgumentError, ElibError
from elib.base.pose import Pose
from elib.behaviours import OpenAir, find, play
from elib.behaviours.avoid import STANDING
from elib.behaviours.explore import draw
from elib.behaviours.wall_following import follow
from elib.link.protocol.distances import distances
from elib.simulator.physics import World
from elib.testing import simulated, simulation_of

WORLD = "maze"
ROOM = 0.008
"""m around a robot where it is put."""
NEAR, ASIDE = 0.03, math.radians(10)
"""m and rad within which a robot knows where it is."""
LIMIT = 60.0
"""s of robot time to find that out."""
GOAL = 1.3, 1.3
"""The golden square, m."""


# -- what all share ----------------------------------------------------------------------------------------------------


def url(firmware: str, fault: str, seed: int) -> str:
    """Return the URL of a drawn robot."""
    return f"sim://{WORLD}?speed=max&quality=typical&seed={seed}&firmware={firmware}" + (
        f"&fault={fault}" if fault else ""
    )


def place(world: World, chance: random.Random) -> None:
    """Put the robot anywhere with some room around it."""
    room = elib.Grid.of_world(world).clearance(0.06)
    while True:
        x, y = chance.uniform(0.05, world.scene.width - 0.05), chance.uniform(0.05, world.scene.depth - 0.05)
        if room[round(y * 100), round(x * 100)] > 0.037 + ROOM:
            try:
                world.move_robot(0, Pose(x, y, chance.uniform(-math.pi, math.pi)))
            except ArgumentError:
                continue
            return


def truth(robot: elib.Epuck) -> Pose:
    """Return where the robot is."""
    simulation = simulation_of(robot)
    simulation.catch_up()
    assert simulation.world is not None
    return simulation.world.pose(0)


def is_right(found: Pose, real: Pose) -> bool:
    """Return whether a pose is right."""
    off = abs(math.remainder(found.heading - real.heading, math.tau))
    return math.dist((found.x, found.y), (real.x, real.y)) < NEAR and off < ASIDE


# -- where am I --------------------------------------------------------------------------------------------------------


def locate(link: str, seed: int, is_kidnapped: bool = False) -> dict[str, float]:
    """Follow walls from an unknown place until the place is known; when kidnapped, from another place once more."""
    found: dict[str, float] = {"took": math.inf, "wrong": 0.0, "load": 0.0, "error": math.nan}

    async def main() -> None:
        chance = random.Random(seed)
        async with elib.open(link) as robot:
            world = simulation_of(robot).world
            assert world is not None
            place(world, chance)
            grid = elib.Grid.of_world(WORLD)
            localiser = elib.Localiser(grid, seed=seed)
            open_air, wheels, turned = OpenAir(), STANDING, 0.0
            began, first, used, looks = robot.time, math.inf, 0.0, 0
            at = began

            async def step(view: elib.Epuck) -> bool:
                nonlocal wheels, turned, began, first, used, looks, at
                before, wheels = wheels, STANDING
                near = open_air(await view.proximity())
                pose = await view.pose()
                start = time.thread_time()
                estimate = localiser.update(pose, distances(near))
                used += time.thread_time() - start
                looks += 1
                if estimate.is_sure and robot.time - began > 5:
                    real = truth(robot)
                    right = is_right(estimate.pose, real)
                    if is_kidnapped and math.isinf(first):
                        if right:
                            first, began = robot.time, robot.time
                            place(world, chance)
                    elif right:
                        found["took"] = min(found["took"], robot.time - began)
                        found["error"] = math.dist((estimate.pose.x, estimate.pose.y), (real.x, real.y))
                    else:
                        found["wrong"] += 1
                gap, at = robot.time - at, robot.time
                if turned < 7:
                    turned += gap * 1.5
                    wheels = elib.Wheels(-0.3, 0.3)
                else:
                    wheels = follow(near, before, cruise=min(0.4, 0.08 / gap))
                await view.set_speed(*wheels)
                return robot.time - began > LIMIT * (1 + (is_kidnapped and math.isinf(first)))

            await elib.react(robot, step, period=0.1)
            found["looks"], found["load"] = looks, 100 * used / looks / 0.1

    simulated(main)()
    return found


# -- ways --------------------------------------------------------------------------------------------------------------


def go(link: str, seed: int) -> dict[str, float]:
    """Drive from the world's start to its goal, all through the maze."""
    found: dict[str, float] = {"touches": 0.0, "took": math.inf, "error": math.inf, "believed": math.inf}

    async def main() -> None:
        async with elib.open(link) as robot:
            world = simulation_of(robot).world
            assert world is not None

            def look() -> None:
                found["touches"] += world.touching(0)

            world.follow(look)
            start, began = truth(robot), robot.time
            await robot.set_pose(start.x, start.y, start.heading)
            try:
                pose = await robot.go_to(*GOAL, map=elib.Grid.of_world(WORLD))
            except ElibError as error:
                print(seed, error)
                return
            real = truth(robot)
            found["took"] = robot.time - began
            found["error"] = math.dist((real.x, real.y), GOAL)
            found["believed"] = math.dist((real.x, real.y), (pose.x, pose.y))

    simulated(main)()
    return found


# -- maps --------------------------------------------------------------------------------------------------------------


def explore(link: str, seed: int, seconds: float = 300.0) -> dict[str, float]:
    """Draw a map from nothing, and compare it with the world's."""
    found: dict[str, float] = {}

    async def main() -> None:
        async with elib.open(link) as robot:
            world = simulation_of(robot).world
            assert world is not None
            start, began = truth(robot), robot.time
            await robot.set_pose(start.x, start.y, start.heading)
            grid, ended = elib.Grid(), math.inf
            try:
                async with asyncio.timeout(seconds):
                    await draw(robot, grid)
                    ended = robot.time - began
            except (TimeoutError, ElibError) as error:
                if isinstance(error, ElibError):
                    print(seed, error)
            real = truth(robot)
            believed = robot.motion.odometry.pose
            found["error"] = math.dist((believed.x, believed.y), (real.x, real.y))
            found["took"] = ended
            found.update(compared(grid, elib.Grid.of_world(WORLD)))
            grid.save(f"/tmp/w/maps/explored-{seed}.png")

    simulated(main)()
    return found


def compared(grid: elib.Grid, real: elib.Grid) -> dict[str, float]:
    """Return the shares of the squares within the arena that are right, wrong and not known.

    A square is right if what it says stands within 1 cm: walls are thinner than a square.
    """
    rows, columns = real.odds.shape
    row, column = grid.square(real.x, real.y)
    part = np.zeros((rows, columns), np.float32)
    for up in range(rows):
        for aside in range(columns):
            if grid.has(row + up, column + aside):
                part[up, aside] = grid.odds[row + up, column + aside]
    ours = elib.Grid()
    ours.odds = part
    near = real.clearance(0.03) <= 0.0101
    free = real.clearance(0.03) > 0
    right = (ours.occupied & near) | (ours.free & free)
    return {"right": float(right.mean()), "wrong": float((~right & ~ours.unknown).mean()), "unknown": float(ours.unknown.mean())}
