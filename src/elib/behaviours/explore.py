"""Explore an unknown arena: drive to the nearest place from which something new is seen, and draw a map."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

from elib.base.body import WHEEL_CIRCUMFERENCE
from elib.base.errors import NoWay
from elib.base.pose import Pose, apart
from elib.behaviours import Quantity, RunContext, behaviour
from elib.behaviours.avoid import STANDING
from elib.behaviours.wall_following import follow, sees_wall, wall_distance
from elib.robot.aio import Epuck

if TYPE_CHECKING:
    from elib.maps.grid import Grid
    from elib.robot.ways import Guide

Pace = Annotated[float, Quantity("pace", "m/s", 0.02, 0.12, scale=1e6)]

TURN_RATE = 1.5
"""rad/s."""
MAX_LOOSE = 1.5
"""m without a wall after which it looks for what is unknown instead."""
AROUND, HOME = 0.6, 0.05
"""m that it has driven at least when it is back, and from where it began then."""
DOUBT, BACK = 0.05, 0.3
"""m of uncertainty from which it goes back to a wall that it knows, and m that it then drives along that."""
MAX_ISLANDS, OFF = 4, 0.15
"""How many things it goes round before it comes to the wall round all of them, and m that it drives off each."""
STRETCH, NEAR = 0.10, 0.055
"""m along a wall that tell its direction, and from it."""
STRAIGHT, SLANTED = 0.06, 0.35
"""rad: how exactly it does, and from where a wall does not stand at right angles to the others."""
MAX_CRUISE = 0.62
"""rev/s along walls, 8 cm/s: nearly 1 cm from one look to the next. Round the outside of a corner it is slower."""
Number = Annotated[int, Quantity("number", "", 0, 999)]
TELLS = 30.0
"""s of robot time between two lines that say how far it is."""
AMISS = 0.05
"""Share of looks that contradict the map from which on it says so: where the map was right, at most 1 in 100 did."""


async def draw(
    robot: Epuck, grid: Grid, *, pace: float = 0.08, say: Callable[[str], object] = lambda text: None
) -> None:
    """Draw a map of all that the robot can come to, in the coordinates of its odometry; the robot then stands.

    Args:
        robot: The robot.
        grid: The map; what it knows already is not looked at again.
        pace: The fastest speed, m/s.
        say: Takes a line now and then, and one at the end if the map contradicts itself.
    """
    from elib.maps.ways import frontier, is_seen  # here: they need NumPy
    from elib.robot.ways import Guide

    given_up: list[tuple[float, float]] = []
    async with robot.motion.under_way(robot, "explore"):
        guide = await asyncio.to_thread(Guide, robot, grid, pace, TURN_RATE, draws=True)
        telling = asyncio.create_task(_tell(guide, say))
        try:
            await guide.look_round()
            straight, cruise = Straight(), min(pace / WHEEL_CIRCUMFERENCE, MAX_CRUISE)
            for _ in range(MAX_ISLANDS):
                if not await _along_walls(guide, straight, cruise, say):
                    break
                here = guide.estimate.pose
                with contextlib.suppress(NoWay):
                    await guide.drive_to((here.x - OFF * math.sin(here.heading), here.y + OFF * math.cos(here.heading)))
            while (
                goal := await asyncio.to_thread(
                    frontier, grid, (guide.estimate.pose.x, guide.estimate.pose.y), given_up
                )
            ) is not None:
                with contextlib.suppress(NoWay):
                    await guide.drive_to(goal, functools.partial(is_seen, grid, goal))
                if not is_seen(grid, goal):
                    given_up.append(goal)
                here = guide.estimate.pose
                if here.uncertainty > DOUBT and straight.places:
                    wall = min(straight.places, key=lambda place: math.dist(place, (here.x, here.y)))
                    with contextlib.suppress(NoWay):
                        await guide.drive_to(wall)
                    await _along_walls(guide, straight, cruise, say, BACK)
        finally:
            telling.cancel()
            guide.hand_over()
            if guide.amiss > AMISS * guide.looks:
                say(
                    f"The map is not to be relied on: {100 * guide.amiss / guide.looks:.0f} % of the looks contradict "
                    "it. Was the robot lifted, or did something move? Draw it again, and begin beside a long wall."
                )


async def _tell(guide: Guide, say: Callable[[str], object]) -> None:
    """Say now and then how far it is."""
    while True:
        await asyncio.sleep(TELLS)
        known = int((~guide.known.unknown).sum())
        say(f"{known * guide.known.cell**2:.2f} m² known, {guide.driven:.1f} m driven")


async def _along_walls(
    guide: Guide, straight: Straight, cruise: float, say: Callable[[str], object], far: float = math.inf
) -> bool:
    """Follow the wall on the right until the robot is where it was, or has found none, or for *far* m.

    Return whether it went round something that stands in the room: it then has turned right, all in all.
    """
    wheels, driven, loose, turned = STANDING, 0.0, 0.0, 0.0
    first: Pose | None = None
    before = guide.estimate.pose
    while loose < MAX_LOOSE and (
        first is None or driven < min(AROUND, far) or (driven < far and apart(first, before) > HOME)
    ):
        await guide.look()
        here = guide.estimate.pose
        way, turn, before = apart(here, before), here.heading - before.heading, here
        turned += math.remainder(turn, math.tau)
        driven, loose = driven + way, 0.0 if sees_wall(guide.near) else loose + way
        direction, heading = straight.direction, straight(here, wall_distance(guide.near.right))
        is_new = straight.direction != direction
        if is_new:  # what was drawn before may be turned against it
            if direction is not None:
                say("Most walls stand at another angle than it thought: it draws the map again.")
            guide.known.odds[:] = 0
            straight.places.clear()
            await asyncio.to_thread(guide.localiser.renew)
        if is_new or (first is None and not loose):
            first, driven, turned = here, 0.0, 0.0
        if heading is not None:
            straight.places.append((here.x, here.y))
            guide.localiser.turn_to(heading, STRAIGHT)
        wheels = follow(guide.near, wheels, cruise=cruise, is_lost=first is None)
        await guide.roll(wheels)
    return first is not None and turned < 0


class Straight:
    """Tells the heading beside a wall, if that stands at right angles to most of the walls so far.

    Attributes:
        direction: That of most walls, rad, without whole right angles; None before the first one.
        places: Where the robot was beside them, m.
    """

    def __init__(self) -> None:
        self.direction: float | None = None
        self.places: list[tuple[float, float]] = []
        self._looks: list[tuple[Pose, float]] = []
        self._lengths: dict[float, float] = {}  # m of walls in each direction; slanted things have their own

    def __call__(self, pose: Pose, distance: float) -> float | None:
        """Return the heading at *pose*, rad; None if the last stretch was not straight along a wall.

        Args:
            pose: Where the robot thinks to be.
            distance: How far the wall beside it is, m.
        """
        step = apart(self._looks[-1][0], pose) if self._looks else 0.0
        self._looks.append((pose, distance))
        while apart(self._looks[0][0], pose) > STRETCH:
            del self._looks[0]
        beside = [seen for _, seen in self._looks]
        turned = [math.remainder(each.heading - pose.heading, math.tau) for each, _ in self._looks]
        way = apart(self._looks[0][0], pose)
        if way < 0.8 * STRETCH or max(beside) > NEAR or max(beside) - min(beside) > 0.006:
            return None
        if max(turned) - min(turned) > 0.2:
            return None
        # Along the wall it came nearer or went away by this angle; the headings on the way were about as much aside.
        aside = math.atan2(beside[-1] - beside[0], way)
        wall = pose.heading + sum(turned) / len(turned) - aside
        known = min(self._lengths, key=lambda each: abs(math.remainder(wall - each, math.tau / 4)), default=wall)
        if abs(math.remainder(wall - known, math.tau / 4)) > SLANTED:
            known = wall
        self._lengths[known] = self._lengths.get(known, STRETCH) + step
        self.direction = max(self._lengths, key=self._lengths.__getitem__)
        return None if known != self.direction else pose.heading - math.remainder(wall - known, math.tau / 4)


@behaviour(world="maze", group="vehicles")
async def explore(robot: Epuck, run: RunContext, *, pace: Pace = 0.08, number: Number = 0) -> None:
    """Explore an unknown arena and leave a map of it, explored.png and explored.toml; earlier ones are replaced.

    First it follows the wall on the right, once round, then it drives to what is still unknown. If it went round
    something that stands in the room, it looks for the walls of the room first. Most walls are taken to stand at right
    angles: that keeps the map straight, though no robot's wheels are alike. Where it has seen no wall for long, it goes
    back to one before it drives on. Every 30 s it says how much it knows, and at the end whether the map contradicts
    itself.

    Args:
        robot: The robot to drive.
        run: The run.
        pace: The fastest speed.
        number: Behind the name of the files: 7 leaves explored7.png; 0 leaves explored.png.
    """
    from elib.maps.grid import Grid

    grid = Grid()
    run.state("exploring")
    try:
        await draw(robot, grid, pace=pace, say=run.say)
    finally:
        if grid.odds.size:
            file = f"explored{number or ''}.png"
            grid.save(file)
            run.say(f"{grid}: {file}")
