"""What is noted of one run of a program, tick by tick, and what the goals say of it.

It needs no process, no socket and no clock: only the simulation in which the program drives its robots.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from os import PathLike
from typing import TYPE_CHECKING, Literal

from elib.lab.goal import GoalResult, Trace, Zone, judge
from elib.lab.goals import Lit, Maps, Outdoes
from elib.lab.labfile import Lab, Variant, stripes_of, things_of
from elib.lab.printed import Patch
from elib.simulator.drawing import draw
from elib.simulator.drawing.top import Look
from elib.simulator.physics import Pose, Snapshot

if TYPE_CHECKING:
    from elib.simulator.emulator.simulation import Simulation

AFTERWARDS = 1.0
"""s of robot time for which the world goes on after the program's end."""

Ending = Literal["ended", "failed", "time", "wall", "broke"]
End = tuple[Ending, str, int | None]
"""How a run ended: in a word, why, and the exit code of a program that has ended."""


@dataclass(frozen=True, slots=True)
class VariantResult:
    """What became of a program in one variant."""

    variant: Variant
    goals: tuple[GoalResult, ...]  # what became of each goal
    # "ended" by itself, "failed" with an exit code or a signal, "time" or "wall" when the robot's or the wall clock's
    # time was over, "broke" the link's rules
    ending: Ending
    why: str  # the same in words; empty for "ended"
    exit_code: int | None  # the exit code, if the program ended
    time: float  # robot time at the program's end, s
    paths: tuple[tuple[Pose, ...], ...]  # where each robot was, a pose for each tick
    snapshot: Snapshot  # the world at the end
    zones: tuple[Zone, ...]  # the zones of the variant
    patches: tuple[Patch, ...]  # the parts of the map that the program printed, if a goal is about that
    requests: Counter[str]  # how often each command was sent, if a goal asks for that
    output: str  # what the program printed
    transcript: str  # a digest of all that went over the link: equal runs have equal digests

    @property
    def passed(self) -> bool:
        """Whether all goals hold."""
        return all(each.holds for each in self.goals)

    @property
    def opened_robot(self) -> bool:
        """Whether the program opened a robot, which takes robot time."""
        return self.time > 0

    def draw(self, path: str | PathLike[str] | None = None, *, size: int = 900) -> str | None:
        """Draw the paths and the printed map in the world, as .svg or .png; without a path the SVG text is returned."""
        caption = f"{self.variant.name} · {self.time:.1f} s" + (" · orange: its map" if self.patches else "")
        look = Look(trails=self.paths, caption=caption, size=size, zones=self.zones, patches=self.patches)
        return draw(self.snapshot, path, **look)


def end_by(code: int) -> End:
    """Return how a run ended whose program has ended with an exit code, -N if signal N ended it."""
    if code == 0:
        return "ended", "", code
    return "failed", f"signal {-code} ended it" if code < 0 else f"it ended with exit code {code}", code


class Tracer:
    """Notes from now on what all robots of a simulation do, at each tick, on its event loop."""

    def __init__(self, lab: Lab, variant: Variant, simulation: Simulation) -> None:
        assert simulation.world is not None
        self._lab, self._variant = lab, variant
        self._simulation, self._world = simulation, simulation.world
        self._poses: list[list[Pose]] = []
        self._touching: list[list[bool]] = []
        self._lit: list[list[int]] = []
        self._lasted = [0.0] * self._world.robots
        self._wants_lamps = any(isinstance(goal, Lit) for goal in lab.goals)
        self._wants_energy = any(isinstance(goal, Outdoes) for goal in lab.goals)
        self._note()

    def so_far(self) -> tuple[GoalResult, ...]:
        """Return what the goals say of a run that goes on, without what its program has sent and printed."""
        return judge(self._lab.goals, self._trace(self._world.snapshot()))

    def over(self, code: int) -> tuple[GoalResult, ...]:
        """Return the same of a run whose program has ended now, with an exit code."""
        return self.judged(end_by(code), self._simulation.time, Counter(), "", "").goals

    def judged(
        self, end: End, time: float, requests: Counter[str], output: str, transcript: str, player: int = 0
    ) -> VariantResult:
        """Return what became of a run that is over; the arguments are those of the result, and whose it is."""
        ending, why, code = end
        self._world.run_to(self._simulation.time)
        snapshot = self._world.snapshot()
        trace = replace(
            self._trace(snapshot, player),
            requests=requests,
            output=output,
            time=time,
            has_ended=ending in ("ended", "failed"),
            exit_code=code,
        )
        goals = judge(self._lab.goals, trace, why if ending in ("wall", "broke") else "")
        paths, zones = tuple(zip(*self._poses, strict=True)), tuple(self._lab.zones_of(self._variant).values())
        patches = tuple(patch for goal in self._lab.goals if isinstance(goal, Maps) for patch in goal.patches(trace))
        return VariantResult(
            self._variant, goals, ending, why, code, time, paths, snapshot, zones, patches, requests, output, transcript
        )

    def _note(self) -> None:
        """Note what every robot does in this tick, and come again at the next."""
        world, simulation = self._world, self._simulation
        world.run_to(simulation.time)
        self._poses.append([world.pose(robot) for robot in range(world.robots)])
        self._touching.append([world.touching(robot) for robot in range(world.robots)])
        if self._wants_lamps:
            rings = [robot.lamps.ring for robot in world.snapshot().robots]
            self._lit.append([sum(1 << led for led, colour in enumerate(ring) if any(colour)) for ring in rings])
        if self._wants_energy:
            for robot in range(world.robots):
                self._lasted[robot] += world.scene.step * (world.energy(robot) > 0)
        # Between two ticks: on a tick itself a reading could come before or after it.
        simulation.loop.call_at(simulation.origin + (world.tick + 1.5) * world.scene.step, self._note)

    def _trace(self, snapshot: Snapshot, player: int = 0) -> Trace:
        """Return what the world knows of what happened until now."""
        world, scene = self._world, self._world.scene
        own, other = self._lab.share(world.robots, player), self._lab.share(world.robots, 1 - player)
        earned = [(each.score, lasted, each.energy) for each, lasted in zip(snapshot.robots, self._lasted, strict=True)]
        return Trace(
            step=scene.step,
            poses=[[(pose.x, pose.y, pose.heading) for pose in row[own]] for row in self._poses],
            touching=[row[own] for row in self._touching],
            lit=[row[own] for row in self._lit],
            speeds=[world.wheel_speeds(robot) for robot in range(world.robots)][own],
            earned=earned[own],
            rivals=earned[other],
            others=[[(pose.x, pose.y, pose.heading) for pose in row[other]] for row in self._poses],
            things=things_of(snapshot),
            zones=self._lab.zones_of(self._variant, scene),
            stripes=stripes_of(scene),
            surfaces=[(wall.x1, wall.y1, wall.x2, wall.y2) for wall in (*scene.edge, *scene.surfaces)],
            time=self._simulation.time,
            has_ended=False,
            exit_code=None,
        )
