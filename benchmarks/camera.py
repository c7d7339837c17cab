"""How many pictures a second one thread takes: 40 x 40 at zoom 8, among 10 robots and 20 walls on a square metre.

The ten robots of twenty rooms take them in turn, through the public ``World``: one picture a call, and the pictures of
all robots of a room in one call. It measures CPU time, which other programs hardly change, and prints the median of
several rounds.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import statistics
import time
from collections.abc import Callable

from elib.simulator.physics import Colour, Scene, Wall, World
from elib.simulator.physics.geometry import unit

ROOMS, ROBOTS, WALLS, SIZE, LENGTH = 20, 10, 20, 1.0, 0.2
ROUNDS = 9
ROUND = 0.3
"""About how long one round lasts, s."""

RIGHT = tuple(8 * (k - 19.5) for k in range(40))
UP = tuple(-offset for offset in RIGHT)


def scene(draw: random.Random) -> Scene:
    """Return a walled square metre with walls anywhere."""
    walls = []
    for _ in range(WALLS):
        x, y = draw.uniform(0.1, SIZE - 0.1), draw.uniform(0.1, SIZE - 0.1)
        cosine, sine = unit(draw.uniform(0, math.pi))
        colour = Colour(draw.randrange(60, 240), draw.randrange(60, 240), draw.randrange(60, 240))
        dx, dy = cosine * LENGTH / 2, sine * LENGTH / 2
        walls.append(Wall(x - dx, y - dy, x + dx, y + dy, colour=colour))
    return Scene(SIZE, SIZE, walls=tuple(walls), seed=draw.randrange(1 << 32))


def one_by_one(world: World) -> None:
    for robot in range(ROBOTS):
        world.picture(robot, RIGHT, UP)


def in_one_call(world: World) -> None:
    world.pictures(None, RIGHT, UP)


def rate(take: Callable[[World], None], worlds: list[World]) -> int:
    """Return how many pictures a second of CPU time are taken."""

    def seconds() -> float:
        start = time.process_time()
        for world in worlds:
            take(world)
        return time.process_time() - start

    seconds()
    turns = max(1, round(ROUND / seconds()))
    return round(
        statistics.median(ROOMS * ROBOTS * turns / sum(seconds() for _ in range(turns)) for _ in range(ROUNDS))
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="the figures as one line of JSON, last")
    options = parser.parse_args()
    draw = random.Random(1)
    worlds = [World(scene(draw), robots=ROBOTS) for _ in range(ROOMS)]
    figures = {take.__name__: rate(take, worlds) for take in (one_by_one, in_one_call)}
    for name, figure in figures.items():
        print(f"{name.replace('_', ' ')}: {figure:,} pictures of 40 x 40 a second, {1e6 / figure:.1f} us each")
    if options.json:
        print(json.dumps({"frames_per_s": figures["one_by_one"], "frames_per_s_in_one_call": figures["in_one_call"]}))


if __name__ == "__main__":
    main()
