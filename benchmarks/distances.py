"""How often ``distances()`` and ``scan()`` are as near to the truth as they say: nine times in ten is what they say.

Each robot is drawn from its seed, as typical ones are: no two sensors of it see a wall alike, and none reads 0 in the
open. It stands in a square, first in the middle, then with one sensor after another square to a wall.
"""

from __future__ import annotations

import math
import random
import statistics
from collections import defaultdict

from harness import Tables, quick, run

import elib
from elib.base.body import SENSOR_RADIUS
from elib.link.protocol.profiles import FIRMWARES
from elib.simulator.physics.profiles import AXES, BEARINGS
from elib.testing import world_of

SIDE = 1.0
"""m of the square."""
FACING = math.radians(15)
"""A wall is square to a ray of a scan up to here."""
AWAY = 0.4, 0.45
"""m from a wall at which the time-of-flight sensor looks."""


class Errors:
    """Errors of distances, and what was said of them."""

    def __init__(self) -> None:
        self._all: list[tuple[float, float]] = []
        self._unseen = 0

    def note(self, found: float, error: float, true: float) -> None:
        """Note one; what is not seen has no error."""
        if math.isfinite(found):
            self._all.append((abs(found - true), error))
        else:
            self._unseen += 1

    def row(self) -> dict[str, float]:
        """Return the figures of all."""
        if not self._all:
            return {}
        return {
            "seen": len(self._all),
            "not seen": self._unseen,
            "inside, %": 100 * statistics.fmean(off <= said for off, said in self._all),
            "median error, mm": 1000 * statistics.median(off for off, _ in self._all),
            "said, mm": 1000 * statistics.median(said for _, said in self._all),
        }


def before_a_wall(sensor: int, distance: float, y: float) -> elib.Pose:
    """Return where a sensor looks straight at the left wall, *distance* m away."""
    heading = math.pi - math.atan2(AXES[sensor][1], AXES[sensor][0])
    x = distance - SENSOR_RADIUS * math.cos(heading + math.radians(BEARINGS[sensor]))
    return elib.Pose(x, y, heading)


def to_the_wall(pose: elib.Pose, direction: float) -> tuple[float, float]:
    """Return how far the walls are in a direction, m, and how far from square they stand to it, rad."""
    ways = []
    for place, part, square in ((pose.x, math.cos(direction), 0.0), (pose.y, math.sin(direction), math.pi / 2)):
        way = ((SIDE if part > 0 else 0.0) - place) / part
        aslant = abs(math.remainder(direction - square, math.pi))
        ways.append((way, aslant))
    return min(ways)


@quick(robots=1)
def measure(*, robots: int = 50, walls: int = 6, seed: int = 1) -> Tables:
    """Look at walls.

    Args:
        robots: How many, of each firmware.
        walls: Distances at which each sensor looks, 1 to 6 cm.
        seed: Of the first robot.
    """
    single: defaultdict[str, Errors] = defaultdict(Errors)
    scans: defaultdict[str, Errors] = defaultdict(Errors)
    for place, firmware in enumerate(FIRMWARES):
        for number in range(seed + place * robots, seed + (place + 1) * robots):
            drawn = random.Random(number)
            with elib.connect(f"sim://square?speed=max&quality=typical&firmware={firmware}&seed={number}") as robot:
                world = world_of(robot)
                gains = world._state.world.robots[0].gain
                for _ in range(20):
                    robot.distances()
                for sensor in range(8):
                    for _ in range(walls):
                        true = drawn.uniform(0.01, 0.06)
                        world.move_robot(0, before_a_wall(sensor, true, drawn.uniform(0.3, 0.7)))
                        robot.sleep(0.1)
                        near = robot.distances()
                        single[firmware].note(near[sensor], near.errors[sensor], true)
                        single[f"{100 * true:.0f} cm"].note(near[sensor], near.errors[sensor], true)
                        near = robot.distances(gains=gains)
                        single["with its gains"].note(near[sensor], near.errors[sensor], true)
                away = drawn.uniform(*AWAY)
                world.move_robot(0, elib.Pose(away, 0.5, math.pi))
                robot.sleep(0.3)
                near = robot.distances()
                single["time of flight"].note(near.tof, near.tof_error, away - 0.034)
                pose = elib.Pose(drawn.uniform(0.045, 0.085), drawn.uniform(0.045, 0.3), drawn.uniform(-3, 3))
                world.move_robot(0, pose)
                robot.set_pose(pose.x, pose.y, pose.heading)
                scan = robot.scan()
                for direction, found, error in zip(scan.directions, scan.ranges, scan.errors, strict=True):
                    true, aslant = to_the_wall(pose, direction)
                    kind = "square" if aslant < FACING else "aslant"
                    if true < 0.095:
                        scans[f"{firmware}, {kind}"].note(found, error, true)
                    elif firmware == "epuck2":
                        scans[f"time of flight, {kind}"].note(found, error, true)
    yield "distances of walls that a sensor faces", {name: each.row() for name, each in sorted(single.items())}
    yield "ranges of scans within reach", {name: each.row() for name, each in sorted(scans.items())}


if __name__ == "__main__":
    run(__doc__, measure)
