"""Bull, billiard and go-to-light from random places.

Places are the world's, not what the robot believes. Times are simulated.
"""

from __future__ import annotations

import math
from importlib.resources import files
from pathlib import Path

import pytest
from story_rig import drawn

from elib.base.files import WORLDS as FOLDER
from elib.base.pose import Pose
from elib.behaviours import RunContext, RunResult, find, play
from elib.robot.aio import Epuck
from elib.simulator.emulator.simulation import Simulation
from elib.simulator.physics.geometry import Box
from elib.simulator.physics.world import World
from elib.testing.inside import transport_of
from lanes import short

STARTS = drawn(10, "starts")
"""Seeds that draw where the robot starts, and the noise of its sensors."""
BLUETOOTH = "latency=0.03"
"""The keys of a link like that of 2011, on which a reading took 60 ms (wire-protocol.md, 5.13)."""
SAMPLE = 1 / 8
"""s between two looks at the world."""
MOVED = 0.002
"""m by which a box must be elsewhere to have been hit."""


def without(name: str, *things: str) -> str:
    """Return a world of the gallery as a file, less the things whose tables contain one of these words."""
    head, *tables = (files("elib") / FOLDER / f"{name}.toml").read_text(encoding="utf-8").split("\n[[")
    return "\n[[".join([head, *(table for table in tables if not any(thing in table for thing in things))])


ONE_RED_BOX = without("red-boxes", "robot]]", '"red 2"', '"red 3"')
"""One red box to find, among boxes of other colours that hide it; without a start, so that the seed draws one."""
LIGHT = without("light", "robot]]")
"""The gallery's two lamps, screen and post."""
TABLE = without("billiard", "robot]]")


FEW_OR_ALL = [
    pytest.param(STARTS[:2], id="two"),
    pytest.param(STARTS, id="ten", marks=pytest.mark.long),
]


class Observer:
    """Watches the world during a run, and ends the run when it has seen enough.

    Attributes:
        start: Where the robot started.
        path: Length of its way so far, m.
        longest: Longest touch so far, s.
    """

    def __init__(self, *, hit: str = "") -> None:
        self.path = self.longest = self._touch = 0.0
        self._hit = hit

    def __call__(self, run: RunContext, robots: tuple[Epuck, ...]) -> None:
        """Begin to watch."""
        transport = transport_of(robots[0])
        self._run = run
        self.simulation: Simulation = transport.simulation
        self.start = self._place = self.world.pose(0)
        self._box = self._box_now()
        self.simulation.loop.call_soon_threadsafe(self._look)

    @property
    def world(self) -> World:
        """The robot's world."""
        assert self.simulation.world is not None
        return self.simulation.world

    @property
    def place(self) -> Pose:
        """Where the robot stands."""
        return self.world.pose(0)

    def _box_now(self) -> Box | None:
        return next((box for box in self.world.snapshot().boxes if box.name == self._hit), None)

    def _look(self) -> None:
        self.simulation.catch_up()
        before, self._place = self._place, self.place
        self.path += math.hypot(self._place.x - before.x, self._place.y - before.y)
        self._touch = self._touch + SAMPLE if self.world.touching(0) else 0.0
        self.longest = max(self.longest, self._touch)
        box = self._box_now()
        if box and self._box and math.hypot(box.x - self._box.x, box.y - self._box.y) > MOVED:
            self._run.finish("hit")
        if not self._run.reason:
            self.simulation.loop.call_later(SAMPLE, self._look)

    def stands(self) -> bool:
        """Return whether the robot keeps its place when time goes on."""
        before = self.place
        self.world.run(64)
        return self.place == before


@pytest.fixture
def run(tmp_path: Path) -> Runner:
    """Run a behaviour in a world, from the place that a seed draws."""
    return Runner(tmp_path)


class Runner:
    """Opens a virtual robot in a world of its own file, and plays."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __call__(
        self,
        name: str,
        world: str,
        seed: int,
        observer: Observer,
        *,
        seconds: float,
    ) -> RunResult:
        """Return the result."""
        path = self._folder / "world.toml"
        path.write_text(world, encoding="utf-8")
        url = f"sim://{path}?speed=max&robots=1&seed={seed}&{BLUETOOTH}"
        return play(find(name), url, seconds=seconds, seed=seed, watch=observer)


def states(outcome: RunResult) -> list[str]:
    return [name for _, name in outcome.states]


@pytest.mark.parametrize("starts", FEW_OR_ALL)
def test_the_bull_finds_and_hits_the_red_box_from_random_starts(run: Runner, starts: list[int]) -> None:
    times = []
    for seed in starts:
        outcome = run("bull", ONE_RED_BOX, seed, Observer(hit="red 1"), seconds=300)
        assert outcome.reason == "hit", f"seed {seed}: {outcome.states}"
        assert states(outcome)[-1] == "charging"
        times.append(outcome.duration)
    assert sorted(times)[len(times) // 2] < 31, "half of them see it in their first look around"


@pytest.mark.parametrize("minutes", short([1, 10], 1))
def test_billiard_runs_for_minutes_without_a_touch_of_more_than_a_second(run: Runner, minutes: int) -> None:
    observer = Observer()
    outcome = run("billiard", TABLE, 1, observer, seconds=60 * minutes)
    assert observer.longest < 1
    assert observer.path > 1.5 * minutes
    assert states(outcome).count("rebounding") > 1.5 * minutes
    assert outcome.reason == "time"
    assert observer.stands()


@pytest.mark.parametrize("starts", FEW_OR_ALL)
def test_go_to_light_ends_within_five_centimetres_of_the_bright_lamp_from_random_starts(
    run: Runner, starts: list[int]
) -> None:
    for seed in starts:
        observer = Observer()
        outcome = run("go-to-light", LIGHT, seed, observer, seconds=120)
        (lamp,) = (lamp for lamp in observer.world.snapshot().lights if lamp.name == "bright")
        distance = math.hypot(observer.place.x - lamp.x, observer.place.y - lamp.y)
        assert distance < 0.05, f"seed {seed} from {observer.start}: {outcome.states}"
        assert states(outcome)[-1] == "arrived"
        assert outcome.reason == "done"
        assert observer.stands()


@pytest.mark.parametrize("seeds", [[123], pytest.param(drawn(10, "overhead"), marks=pytest.mark.long)], ids=len)
def test_go_to_light_says_that_a_light_is_overhead_only_where_one_is(run: Runner, seeds: list[int]) -> None:
    for seed in seeds:  # 123 once stopped beside the dim lamp
        observer = Observer()
        outcome = run("go-to-light", LIGHT, seed, observer, seconds=120)
        nearest = min(
            math.hypot(observer.place.x - lamp.x, observer.place.y - lamp.y)
            for lamp in observer.world.snapshot().lights
        )
        assert ("the light is overhead" in outcome.messages) == (outcome.reason == "done")
        assert outcome.reason != "done" or nearest < 0.05, f"seed {seed}: {nearest:.3f} m beside it"
