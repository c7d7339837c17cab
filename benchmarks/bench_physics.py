"""How fast the interpreted physics runs, as ratios measured in one run.

The floor is the interpreter's own pace: one thousand additions in a loop. The peer is the same reading written for
NumPy, every ray against every wall at once. Work: a walled square with 10 robots a square metre, ticks of 1/32 s,
8 infrared sensors of 3 rays with noise, Braitenberg drive, motor noise of 5 %.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable

import numpy as np

from elib.physics import EpuckModel, Scene, World
from elib.physics.body import RADIUS, SENSOR_RADIUS
from elib.physics.scene import flat_walls
from elib.physics.sensors import proximity
from elib.physics.sensors.rays import cast

TICK = 1 / 32
ROUNDS = 7


def cost(work: Callable[[], object], repeats: int) -> float:
    """Return the CPU time of one call, s: the best of several rounds, because a shared machine only ever adds."""
    best = math.inf
    for _ in range(ROUNDS):
        start = time.process_time()
        for _ in range(repeats):
            work()
        best = min(best, (time.process_time() - start) / repeats)
    return best


def thousand_additions() -> int:
    total = 0
    for k in range(1000):
        total += k
    return total


def crowd(robots: int) -> World:
    side = math.sqrt(robots / 10)
    return World(Scene(side, side, step=TICK, model=EpuckModel(motor_noise=0.05)), robots=robots, seed=1)


def braitenberg(world: World) -> None:
    for robot in range(world.robots):
        near = world.proximity(robot)
        left = 0.08 + 4e-5 * (near[0] + near[1]) - 8e-5 * (near[6] + near[7])
        right = 0.08 + 4e-5 * (near[6] + near[7]) - 8e-5 * (near[0] + near[1])
        world.drive(robot, max(-0.12, min(0.12, left)), max(-0.12, min(0.12, right)))
    world.step()


class BruteForce:
    """The rays of one robot against all walls at once, in NumPy."""

    def __init__(self, world: World) -> None:
        walls = (*world.scene.edge, *world.scene.surfaces)
        self.ends = np.array([(wall.x1, wall.y1) for wall in walls])[:, None, :]
        self.spans = np.array([(wall.x2 - wall.x1, wall.y2 - wall.y1) for wall in walls])[:, None, :]
        fan = proximity.FAN
        self.places = np.repeat(np.stack((fan.place_x, fan.place_y), axis=1), proximity.RAYS, axis=0)
        self.rays = np.stack((fan.ray_x, fan.ray_y), axis=1)
        self.reach = proximity.profile(world.scene.model.profile).reach

    def cast(self, x: float, y: float, heading: float) -> np.ndarray:
        turn = np.array(((math.cos(heading), math.sin(heading)), (-math.sin(heading), math.cos(heading))))
        offset = self.ends - ((x, y) + self.places @ turn)
        ray = self.rays @ turn
        crossing = ray[:, 0] * self.spans[..., 1] - ray[:, 1] * self.spans[..., 0]
        crossing[crossing == 0.0] = 1e-300
        distance = (offset[..., 0] * self.spans[..., 1] - offset[..., 1] * self.spans[..., 0]) / crossing
        part = (offset[..., 0] * ray[:, 1] - offset[..., 1] * ray[:, 0]) / crossing
        met = (distance > 0) & (part >= 0) & (part <= 1)
        return np.minimum(np.where(met, distance, self.reach).min(axis=0), self.reach)


def mean_over_places(world: World, work: Callable[[], object], places: int = 40) -> float:
    """Return the mean cost of *work* while the robot wanders: near walls it costs more."""
    total = 0.0
    for _ in range(places):
        for _ in range(15):
            braitenberg(world)
        total += cost(work, 30)
    return total / places


def main() -> None:
    print(f"Python {sys.version.split()[0]}\n\n{'work':44}{'us':>9}{'per second':>13}{'x real time':>13}{'x floor':>9}")

    def row(name: str, seconds: float, robots: int | None = None) -> None:
        floor = cost(thousand_additions, 200)  # Beside each row: a shared machine changes its pace by the minute.
        count = robots or 1
        pace = f"{TICK / seconds:13,.0f}" if robots else " " * 13
        print(f"{name:44}{seconds * 1e6 / count:9.1f}{count / seconds:13,.0f}{pace}{seconds / count / floor:9.2f}")

    row("floor: 1000 additions", cost(thousand_additions, 200))
    bare = crowd(1)
    bare.drive(0, 0.05, 0.06)
    row("tick, 1 robot, nothing read", cost(bare.step, 2000), 1)
    for robots in (1, 10):
        world = crowd(robots)
        total = mean_over_places(world, lambda world=world: braitenberg(world))
        row(f"robot-step, {robots} robots, 8 x 3 rays, controller", total, robots)

    world = crowd(1)
    brute = BruteForce(world)
    fan = proximity.FAN
    fixed = (fan.place_x, fan.place_y, fan.ray_x, fan.ray_y, fan.spread, brute.reach, SENSOR_RADIUS)
    walls, distances = flat_walls(world.scene.edge), [0.0] * len(fan.ray_x)

    def ours(x: float, y: float, heading: float) -> list[float]:
        cast(0, [x], [y], math.cos(heading), math.sin(heading), [RADIUS], walls, [], *fixed, distances)
        return distances

    places = [(0.04 + 0.024 * (k % 10), 0.04 + 0.06 * (k // 10), 0.4 * k) for k in range(40)]
    for place in places:
        if not np.abs(brute.cast(*place) - ours(*place)).max() < 1e-12:
            sys.exit(f"the two ray casts disagree at {place}")
    row("24 rays, 4 walls", cost(lambda: [ours(*place) for place in places], 5) / len(places))
    row("24 rays, 4 walls, NumPy all at once", cost(lambda: [brute.cast(*place) for place in places], 5) / len(places))

    arena = World.load("arena", robots=2)
    right = [8 * k - 156.0 for k in range(40)]
    row("picture of 40 x 40 pixels in the arena", cost(lambda: arena.picture(0, right, right), 20))


if __name__ == "__main__":
    main()
