"""How well a robot knows where it is, comes where it is told to, and maps where it never was: in the world ``maze``,
and in ``arena``, where walls are far from each other.

Robots are typical ones, drawn by a seed each, and so are the places where they are put. Whether a robot is right is
asked of the world. Robot time is simulated: a minute of it takes some seconds.
"""

from __future__ import annotations

import asyncio
import math
import random
import statistics
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np
from harness import Table, Tables, quick, run

import elib
from elib.base.body import AXLE, WHEEL_CIRCUMFERENCE
from elib.base.errors import ArgumentError, ElibError
from elib.base.pose import Pose
from elib.behaviours import OpenAir
from elib.behaviours.avoid import STANDING
from elib.behaviours.explore import draw
from elib.behaviours.wall_following import follow, sees_wall
from elib.link.protocol.distances import distances
from elib.maps.grid import KNOWN
from elib.simulator.physics import World
from elib.testing import simulated, simulation_of

WORLD, WIDE = "maze", "arena"
ROOM = 0.008
"""m around a robot where it is put."""
NEAR, ASIDE = 0.03, math.radians(10)
"""m and rad within which a robot knows where it is."""
LIMIT = 60.0
"""s of robot time to find that out."""
SPIN = 0.3
"""rev/s of the wheels while the robot turns round first."""
TURN_RATE = 2 * SPIN * WHEEL_CIRCUMFERENCE / AXLE
CIRCLE = 9.0
"""s without a wall after which it drives straight on: it has been round a whole circle then, and sees nothing on it."""
ROUND = 7.0
"""rad: round once, and a bit."""
GOAL = 1.3, 1.3
"""The golden square, m."""


# -- what all share ----------------------------------------------------------------------------------------------------


def url(firmware: str, fault: str, seed: int, world: str = WORLD) -> str:
    """Return the URL of a drawn robot."""
    return f"sim://{world}?speed=max&quality=typical&seed={seed}&firmware={firmware}" + (
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
    found: dict[str, float] = {"took": math.inf, "said": 0.0, "untrue": 0.0, "wrong": 0.0, "load": 0.0}

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
            at, was_sure, wall_at = began, False, began

            async def step(view: elib.Epuck) -> bool:
                nonlocal wheels, turned, began, first, used, looks, at, was_sure, wall_at
                before, wheels = wheels, STANDING
                near = open_air(await view.proximity())
                pose = await view.pose()
                start = time.thread_time()  # while it turns round first, what it reads in the open is not known yet
                estimate = localiser.update(pose, None if turned < ROUND else distances(near))
                used += time.thread_time() - start
                looks += 1
                if estimate.is_sure:
                    real = truth(robot)
                    right = is_right(estimate.pose, real)
                    found["said"] += not was_sure
                    found["untrue"] += not was_sure and not right
                    if is_kidnapped and math.isinf(first):
                        if right:
                            first, began = robot.time, robot.time
                            place(world, chance)
                    elif right:
                        found["took"] = min(found["took"], robot.time - began)
                    else:
                        found["wrong"] += 1
                gap, at, was_sure = robot.time - at, robot.time, estimate.is_sure
                if turned < ROUND or sees_wall(near):
                    wall_at = at
                if turned < ROUND:
                    turned += gap * TURN_RATE
                    wheels = elib.Wheels(-SPIN, SPIN)
                else:
                    wheels = follow(near, before, cruise=min(0.4, 0.08 / gap), is_lost=at - wall_at > CIRCLE)
                await view.set_speed(*wheels)
                return robot.time - began > LIMIT * (1 + (is_kidnapped and math.isinf(first)))

            await elib.react(robot, step, period=0.1)
            found["looks"], found["load"] = looks, 100 * used / looks / 0.1

    simulated(main)()
    return found


# -- ways --------------------------------------------------------------------------------------------------------------


def go(link: str, seed: int) -> dict[str, float]:
    """Drive from the world's start to its goal, all through the maze."""
    found: dict[str, float] = {"touches": 0.0, "took": math.inf, "error": math.inf, "within": math.nan}

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
            found["within"] = math.dist((real.x, real.y), (pose.x, pose.y)) <= pose.uncertainty

    simulated(main)()
    return found


# -- maps --------------------------------------------------------------------------------------------------------------


def explore(link: str, seed: int, world_name: str = WORLD, seconds: float = 300.0) -> dict[str, float]:
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
            found["took"] = ended
            found.update(compared(grid, elib.Grid.of_world(world_name), believed, real))

    simulated(main)()
    return found


def compared(grid: elib.Grid, real: elib.Grid, believed: Pose, true: Pose) -> dict[str, float]:
    """Return the shares of the squares within the arena that are right, wrong and not known.

    The map is laid over the world's by where the robot stands on both, and then as it fits best, turned by up to 6
    degrees and moved by up to 6 cm: where its coordinates begin is not told by the arena. A square is right if what it
    says stands within 1 cm: walls are thinner than a square.
    """
    is_wall, is_free = real.clearance(0.03) <= 0.0101, real.clearance(0.03) > 0
    rows, columns = np.indices(real.odds.shape)
    best = {"right": 0.0, "wrong": 0.0, "unknown": 1.0}
    x, y = columns * real.cell + real.x, rows * real.cell + real.y
    for turn in np.radians(np.arange(-6, 6.5, 0.5)):
        for right in np.arange(-0.06, 0.065, 0.01):
            for up in np.arange(-0.06, 0.065, 0.01):
                from_x, from_y, angle = x - true.x, y - true.y, believed.heading - true.heading + turn
                there_x = believed.x + from_x * np.cos(angle) - from_y * np.sin(angle) + right
                there_y = believed.y + from_y * np.cos(angle) + from_x * np.sin(angle) + up
                column = np.rint((there_x - grid.x) / grid.cell).astype(int)
                row = np.rint((there_y - grid.y) / grid.cell).astype(int)
                is_on = (row >= 0) & (row < grid.odds.shape[0]) & (column >= 0) & (column < grid.odds.shape[1])
                odds = np.where(is_on, grid.odds[np.where(is_on, row, 0), np.where(is_on, column, 0)], 0.0)
                is_right = ((odds > KNOWN) & is_wall) | ((odds < -KNOWN) & is_free)
                if is_right.mean() > best["right"]:
                    unknown = np.abs(odds) <= KNOWN
                    best = {
                        "right": float(is_right.mean()),
                        "wrong": float((~is_right & ~unknown).mean()),
                        "unknown": float(unknown.mean()),
                    }
    return best


# -- all of it ---------------------------------------------------------------------------------------------------------

LINKS = tuple(
    (firmware, fault) for firmware in ("asercom-1.2.2", "btcom-1.1.3", "epuck2") for fault in ("", "flaky-bluetooth")
)
LINKS += (("epuck2-wifi", ""),)
"""Firmwares and links. The script of faults is one of Bluetooth."""


@quick(robots=2, maps=1, wide=0)
def measured(
    robots: int = 50, maps: int = 10, wide: int = 2, seed: int = 40, processes: int = 2, only: str = ""
) -> Tables:
    """Let drawn robots find where they are, drive through the maze, and draw it.

    Args:
        robots: How many find their place, are put elsewhere, and drive through the maze, of each firmware and link.
        maps: How many draw a map; over the link without faults.
        wide: How many of them draw one of the wide room, too.
        seed: What the robots' own seeds are drawn by.
        processes: How many work at once.
        only: One firmware, and behind a comma its faults, if any.
    """
    seeds = random.Random(seed).sample(range(10**6), max(robots, maps))
    for firmware, fault in LINKS:
        if only in ("", f"{firmware},{fault}".strip(",")):
            with ProcessPoolExecutor(processes) as pool:
                tables = _table(pool, firmware, fault, seeds[:robots], [] if fault else seeds[:maps], wide)
            yield f"{firmware}{f', {fault}' if fault else ''}", tables


def _table(
    pool: ProcessPoolExecutor, firmware: str, fault: str, seeds: list[int], drawing: list[int], wide: int
) -> Table:
    links = [url(firmware, fault, each) for each in seeds]
    found = list(pool.map(locate, links, seeds))
    moved = list(pool.map(partial(locate, is_kidnapped=True), links, seeds))
    driven = list(pool.map(go, links, seeds))
    drawn = {
        world: list(
            pool.map(partial(explore, world_name=world), [url(firmware, fault, each, world) for each in of], of)
        )
        for world, of in ((WORLD, drawing), (WIDE, drawing[:wide]))
    }

    def median(rows: list[dict[str, float]], name: str) -> float:
        return statistics.median(row[name] for row in rows)

    def share(rows: list[dict[str, float]]) -> float:
        return sum(100 * row["wrong"] for row in rows) / sum(row["looks"] for row in rows)

    table: dict[str, dict[str, float | str]] = {
        name: {
            "robots": len(rows),
            "good": sum(row["took"] < LIMIT for row in rows),
            "median s": median(rows, "took"),
            "said sure": sum(row["said"] for row in rows),
            "untrue": sum(row["untrue"] for row in rows),
            "wrongly sure %": share(rows),
            "load %": statistics.mean(row["load"] for row in rows),
        }
        for name, rows in (("place found", found), ("found again", moved))
    }
    table["maze driven"] = {
        "robots": len(driven),
        "good": sum(row["touches"] == 0 and row["error"] < NEAR for row in driven),
        "median s": median(driven, "took"),
        "touched": sum(row["touches"] > 0 for row in driven),
        "off cm": 100 * median(driven, "error"),
        "within what it says": sum(row["within"] == 1 for row in driven),
    }
    for world, rows in drawn.items():
        if rows:
            table[f"map of {world} drawn"] = {
                "robots": len(rows),
                "good": sum(row["right"] >= 0.95 for row in rows),
                "right %": 100 * median(rows, "right"),
                "wrong %": 100 * median(rows, "wrong"),
            }
    return table


if __name__ == "__main__":
    run(__doc__, measured)
