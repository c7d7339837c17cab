"""A behaviour played in a simulated world, and where that left the robot: by the world, not by odometry."""

from __future__ import annotations

import math
from dataclasses import dataclass

from elib.base.pose import Pose
from elib.behaviours import RunContext, RunResult, find, play
from elib.robot.aio import Epuck
from elib.simulator.emulator.simulation import Simulation
from elib.testing import simulation_of


@dataclass(slots=True)
class Played:
    """The result of a run, and the poses of its robot before and after.

    Attributes:
        outcome: The result that play() returned.
        before: Where the robot stood at the start.
        after: Where it stood at the end.
        hash: Hash of the world at the end.
    """

    outcome: RunResult
    before: Pose
    after: Pose
    hash: str

    @property
    def way(self) -> float:
        """Distance in a straight line from its start to its end, m."""
        return math.dist((self.before.x, self.before.y), (self.after.x, self.after.y))

    @property
    def rotation(self) -> float:
        """Angle from its heading at the start to that at the end, degrees."""
        return math.degrees(math.remainder(self.after.heading - self.before.heading, math.tau))

    @property
    def names(self) -> list[str]:
        """The states it was in, in order."""
        return [name for _, name in self.outcome.states]


def played(name: str, url: str, seconds: float | None = None, **options: object) -> Played:
    """Play a behaviour on a virtual robot."""
    found: list[tuple[Simulation, Pose]] = []

    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        simulation = simulation_of(robots[0])
        simulation.catch_up()
        found.append((simulation, simulation.world.pose(0)))

    outcome = play(find(name), url, seconds=seconds, options=options, watch=watch)
    simulation, before = found[0]
    assert simulation.world is not None
    return Played(outcome, before, simulation.world.pose(0), simulation.world.hash())
