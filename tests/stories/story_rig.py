"""What stories share: a behaviour runs in a random world, and the world is watched meanwhile."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import combinations, pairwise

from elib.base.body import LENS
from elib.base.errors import ArgumentError
from elib.base.pose import Pose
from elib.behaviours import RunContext, RunResult, find, play
from elib.robot.aio import Epuck
from elib.simulator.emulator.simulation import Simulation
from elib.simulator.physics import World
from elib.simulator.physics.body import RADIUS
from elib.testing.inside import transport_of
from lanes import short

SAMPLE = 0.25
"""s between two looks at the world."""

MOVED = 0.002
"""m by which a box must be elsewhere to have been hit."""

Change = Callable[[World, random.Random], object]


def drawn(count: int, what: str) -> list[int]:
    """Return so many seeds, drawn for *what* and not picked."""
    chance = random.Random(what)
    return [chance.randrange(10**6) for _ in range(count)]


def drawn_quick(count: int, what: str) -> list[object]:
    """Return so many seeds as the cases of a test; all but the first are long forms."""
    first, *more = drawn(count, what)
    return short([first, *more], first)


@dataclass(slots=True)
class Run:
    """What a test saw of a run.

    Attributes:
        outcome: The result; None if it ended in an error.
        run: The context of the run.
        simulation: The robots' world, and the links to them.
        poses: Where all robots stood, every :data:`SAMPLE`.
        touches: Whether the first robot touched something then.
        counts: How many commands all robots had been given then.
        seen: What *look* returned then.
    """

    outcome: RunResult | None = None
    run: RunContext | None = None
    simulation: Simulation | None = None
    poses: list[list[Pose]] = field(default_factory=list)
    touches: list[bool] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    seen: list[float] = field(default_factory=list)

    @property
    def world(self) -> World:
        """The robots' world."""
        assert self.simulation is not None
        assert self.simulation.world is not None
        return self.simulation.world

    @property
    def states(self) -> list[str]:
        """The states it was in, in order."""
        assert self.outcome is not None
        return [name for _, name in self.outcome.states]

    @property
    def path(self) -> float:
        """Length of the first robot's way, m."""
        places = [(poses[0].x, poses[0].y) for poses in self.poses]
        return sum(math.dist(*step) for step in pairwise(places))

    @property
    def longest_touch(self) -> float:
        """Longest time that the first robot touched something without a break, s."""
        longest = touch = 0
        for is_touching in self.touches:
            touch = touch + 1 if is_touching else 0
            longest = max(longest, touch)
        return longest * SAMPLE

    def after(self, seconds: float) -> int:
        """Return the place of the first sample after *seconds*."""
        return int(seconds / SAMPLE) + 1

    def stands(self) -> bool:
        """Return whether all robots keep their places when time goes on."""
        self.world.run(4)  # the tick in which they were stopped comes to its end
        before = self.world.poses
        self.world.run(64)
        return self.world.poses == before


def run(
    name: str,
    url: str,
    seed: int,
    *,
    seconds: float,
    at: dict[float, Change] | None = None,
    look: Callable[[World], float] | None = None,
    until: float = -math.inf,
    options: dict[str, object] | None = None,
    found: Run | None = None,
) -> Run:
    """Run a behaviour and watch the world.

    Args:
        name: Name of the behaviour.
        url: World and link faults.
        seed: Seed of the noise, of the behaviour's random numbers, and of what changes draw.
        seconds: Duration of the run.
        at: What is changed in the world, and when, s; 0 is before the behaviour begins.
        look: Function that is called with the world at each sample.
        until: The run ends when *look* returns less.
        options: Options of the behaviour.
        found: Filled during the run, for a caller that wants what was seen before an error.
    """
    found = Run() if found is None else found
    chance = random.Random(seed)
    changes = sorted((at or {}).items())

    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        found.run = run
        if not robots:  # a raw line: nobody knows its world
            return
        transport = transport_of(robots[0])
        simulation = found.simulation = transport.simulation

        def observe() -> None:
            simulation.catch_up()
            while changes and run.time >= changes[0][0]:
                changes.pop(0)[1](found.world, chance)
            found.poses.append(found.world.poses)
            found.touches.append(found.world.touching(0))
            found.counts.append(sum(robot.statistics.count for robot in robots))
            found.seen.append(look(found.world) if look else 0.0)
            if found.seen[-1] < until:
                run.finish("there")
            if not run.reason:
                simulation.loop.call_later(SAMPLE, observe)

        while changes and changes[0][0] == 0:
            changes.pop(0)[1](found.world, chance)
        simulation.loop.call_soon_threadsafe(observe)

    joint = "&" if "?" in url else "?"
    found.outcome = play(
        find(name), f"sim://{url}{joint}speed=max&seed={seed}", seconds=seconds, options=options, seed=seed, watch=watch
    )
    return found


def anywhere(world: World, chance: random.Random) -> None:
    """Put the first robot somewhere with a little room around it."""
    while True:
        x, y = chance.uniform(0.05, world.scene.width - 0.05), chance.uniform(0.05, world.scene.depth - 0.05)
        try:
            world.move_robot(0, Pose(x, y, chance.uniform(-math.pi, math.pi)))
        except ArgumentError:
            continue
        if clearance(world) > 0.01:
            return


def clearance(world: World) -> float:
    """Return how far the first robot's body is from the nearest wall or cylinder, m."""
    scene, pose = world.scene, world.pose(0)
    gaps = [pose.x, pose.y, scene.width - pose.x, scene.depth - pose.y]
    gaps += [wall.distance(pose.x, pose.y) for wall in scene.surfaces]
    gaps += [math.dist((pose.x, pose.y), (disc.x, disc.y)) - disc.radius for disc in scene.cylinders]
    return min(gaps) - RADIUS


def closest(poses: Sequence[Pose]) -> float:
    """Return the smallest distance between two, m."""
    return min(math.dist((a.x, a.y), (b.x, b.y)) for a, b in combinations(poses, 2))


def from_ball(world: World) -> float:
    """Return the distance from the camera to the middle of the ball, m."""
    pose, ball = world.pose(0), world.snapshot().cylinders[0]
    return math.dist((pose.x + LENS * math.cos(pose.heading), pose.y + LENS * math.sin(pose.heading)), (ball.x, ball.y))


def ball_elsewhere(world: World, chance: random.Random) -> None:
    """Put the robot somewhere, and the ball somewhere else."""
    anywhere(world, chance)
    with suppress(ArgumentError):  # it stays where it is if somebody stands there
        world.move_cylinder(0, chance.uniform(0.3, 1.4), chance.uniform(0.2, 0.8))


def red_at_rest(world: World) -> float:
    """Return 0 if a red box was pushed, otherwise 1."""
    before = {box.name: box for box in world.scene.boxes}
    moved = (
        math.dist((box.x, box.y), (before[box.name].x, before[box.name].y))
        for box in world.snapshot().boxes
        if "red" in box.name
    )
    return float(max(moved) < MOVED)
