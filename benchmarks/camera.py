"""How many pictures a second one thread takes: 40 x 40 at zoom 8, among 10 robots and 20 walls on a square metre.

Each picture is taken from another place: by the ten robots of twenty rooms in turn, through the public ``World``. CPU
time, so that a shared machine disturbs little; the median of several rounds.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import statistics
import time

from elib.physics import Colour, Scene, Wall, World
from elib.physics.geometry import unit

ROOMS, ROBOTS, WALLS, SIZE, LENGTH = 20, 10, 20, 1.0, 0.2
ROUNDS = 9
ROUND = 0.3
"""About how long one round lasts, s."""


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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--engine", choices=("interpreted", "compiled"), default="interpreted")
    parser.add_argument("--json", action="store_true", help="the figure as one line of JSON, last")
    options = parser.parse_args()
    draw = random.Random(1)
    worlds = [World(scene(draw), robots=ROBOTS, engine=options.engine) for _ in range(ROOMS)]
    right = tuple(8 * (k - 19.5) for k in range(40))
    up = tuple(-offset for offset in right)

    def pictures() -> float:
        """Return the CPU time of a picture from each robot, s."""
        start = time.process_time()
        for world in worlds:
            for robot in range(ROBOTS):
                world.picture(robot, right, up)
        return time.process_time() - start

    pictures()
    turns = max(1, round(ROUND / pictures()))
    rates = [ROOMS * ROBOTS * turns / sum(pictures() for _ in range(turns)) for _ in range(ROUNDS)]
    figure = round(statistics.median(rates))
    print(f"{options.engine}: {figure:,} pictures of 40 x 40 a second, {1e6 / figure:.1f} us each")
    if options.json:
        print(json.dumps({"frames_per_s": figure}))


if __name__ == "__main__":
    main()
