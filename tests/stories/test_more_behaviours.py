"""Vehicles, walls, lines, balls, sounds and swarms: from places that chance chose, and in bad weather.

Places are the world's, not what the robots believe. Times are simulated.
"""

from __future__ import annotations

import asyncio
import math
import random
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import combinations, pairwise
from pathlib import Path
from statistics import mean, median

import pytest

from elib.behaviours.frame import Outcome, find
from elib.behaviours.playing import play
from elib.behaviours.stage import Stage
from elib.emulator.sim import SimTransport, Simulation
from elib.errors import ArgumentError
from elib.physics import Sound, Stripe, World
from elib.physics.body import RADIUS
from elib.pose import Pose
from elib.robot.aio import Epuck

SAMPLE = 0.25
"""s between two looks at the world."""

Change = Callable[[World, random.Random], object]


@dataclass(slots=True)
class Run:
    """What a test saw of a performance.

    Attributes:
        outcome: How it went.
        simulation: The robots' world, and the links to them.
        poses: Where all robots stood, every :data:`SAMPLE`.
        touches: Whether the first robot touched something then.
        counts: How many commands all robots had been given then.
        seen: What ``look`` returned then.
    """

    outcome: Outcome | None = None
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
) -> Run:
    """Let a behaviour perform.

    Args:
        name: Of the behaviour.
        url: World and weather.
        seed: Of the noise, of the behaviour's chance, and of what is drawn by changes.
        seconds: How long.
        at: What is changed in the world, and when, s; 0 is before the behaviour begins.
        look: What is wanted of the world at each sample.
        until: It ends when *look* returns less.
        options: Of the behaviour.
    """
    found, chance, watchers = Run(), random.Random(seed), []
    changes = sorted((at or {}).items())

    def watch(stage: Stage, robots: tuple[Epuck, ...]) -> None:
        transport = robots[0].session.transport
        assert isinstance(transport, SimTransport)
        found.simulation = transport.simulation

        async def observe() -> None:
            while True:
                transport.simulation.catch_up()
                while changes and stage.time >= changes[0][0]:
                    changes.pop(0)[1](found.world, chance)
                found.poses.append(found.world.poses)
                found.touches.append(found.world.touching(0))
                found.counts.append(sum(robot.statistics.count for robot in robots))
                found.seen.append(look(found.world) if look else 0.0)
                if found.seen[-1] < until:
                    stage.finish("there")
                await asyncio.sleep(SAMPLE)

        while changes and changes[0][0] == 0:
            changes.pop(0)[1](found.world, chance)
        watchers.append(asyncio.get_running_loop().create_task(observe()))

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
    gaps += [from_segment(pose, (wall.x1, wall.y1), (wall.x2, wall.y2)) for wall in scene.surfaces]
    gaps += [math.dist((pose.x, pose.y), (disc.x, disc.y)) - disc.radius for disc in scene.cylinders]
    return min(gaps) - RADIUS


def from_segment(pose: Pose, start: Sequence[float], end: Sequence[float]) -> float:
    """Return how far a place is from a straight line between two others, m."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    share = max(0.0, min(1.0, ((pose.x - start[0]) * dx + (pose.y - start[1]) * dy) / (dx * dx + dy * dy)))
    return math.dist((pose.x, pose.y), (start[0] + share * dx, start[1] + share * dy))


def bearing(world: World, x: float, y: float) -> float:
    """Return where a place lies from where the first robot looks, degrees, positive to the left."""
    pose = world.pose(0)
    return math.degrees(math.remainder(math.atan2(y - pose.y, x - pose.x) - pose.heading, math.tau))


# -- Braitenberg's vehicles --


ONE_LAMP = """
[arena]
size = [1.4, 1.4]

[[light]]
position = [0.7, 0.7]
intensity = 1.5

[[robot]]
position = [0.2, 0.2]
"""


def from_lamp(world: World) -> float:
    """Return the distance from the lamp, m."""
    return math.dist((world.pose(0).x, world.pose(0).y), (0.7, 0.7))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_aggression_runs_the_lamp_down_love_stays_by_it_and_fear_and_explorer_leave_it(
    seed: int, tmp_path: Path
) -> None:
    room = tmp_path / "lamp.toml"
    room.write_text(ONE_LAMP)
    runs = {}
    for vehicle in ("aggression", "fear", "love", "explorer"):
        options: dict[str, object] = {"vehicle": vehicle}
        runs[vehicle] = run(
            "braitenberg", str(room), seed, seconds=30, at={0: anywhere}, look=from_lamp, options=options
        )
        assert runs[vehicle].longest_touch < 1
    assert min(runs["aggression"].seen) < 0.03
    late = {vehicle: each.seen[each.after(20) :] for vehicle, each in runs.items()}
    assert max(late["love"]) < 0.6
    assert max(late["love"]) - min(late["love"]) < 0.02
    assert runs["love"].states[-1] == "resting"
    assert mean(late["fear"]) > mean(late["love"]) + 0.1
    assert mean(late["explorer"]) > mean(late["love"]) + 0.1
    assert runs["explorer"].path > 1.3 * max(runs["fear"].path, runs["love"].path)


# -- walls --


@pytest.mark.slow
@pytest.mark.parametrize(
    ("world", "side", "seed"), [("maze", "right", 1), ("corridor", "left", 2), ("arena", "right", 3)]
)
def test_from_any_place_it_finds_a_wall_and_keeps_its_distance_round_every_corner(
    world: str, side: str, seed: int
) -> None:
    seen = run("wall-following", world, seed, seconds=60, at={0: anywhere}, look=clearance, options={"side": side})
    assert seen.outcome is not None
    found = next(time for time, name in seen.outcome.states if name == "following")
    assert found < 20
    along = sorted(seen.seen[seen.after(found + 3) :])
    assert 0.025 < median(along) < 0.042  # flat walls hold it at 3 cm, round things further off
    assert along[len(along) // 20] > 0.008
    assert along[-1] < 0.06
    assert seen.longest_touch < 0.5
    assert seen.path > 2.0


@pytest.mark.slow
@pytest.mark.parametrize("side", ["left", "right"])
def test_with_either_hand_on_the_wall_it_comes_to_the_golden_square_of_the_maze(side: str) -> None:
    def from_gold(world: World) -> float:
        return math.dist((world.pose(0).x, world.pose(0).y), (1.3, 1.3))

    options = {"side": side, "cruise": 0.5}
    seen = run("wall-following", "maze", 1, seconds=300, look=from_gold, until=0.1, options=options)
    assert seen.outcome is not None
    assert seen.outcome.reason == "there"


# -- a line --


def points(world: World) -> Sequence[tuple[float, float]]:
    (stripe,) = world.scene.paint
    assert isinstance(stripe, Stripe)
    return stripe.points


def on_the_line(world: World, chance: random.Random) -> None:
    """Put the robot somewhere on the line, along it in either direction."""
    here, there = chance.choice(list(pairwise(points(world))))
    along = math.atan2(there[1] - here[1], there[0] - here[0]) + chance.choice((0, math.pi))
    world.move_robot(0, Pose(*here, along + chance.uniform(-0.3, 0.3)))


def aside(world: World, chance: random.Random) -> None:
    """Push the robot 4 cm aside, and turn it."""
    pose, to_side = world.pose(0), chance.choice((-1, 1)) * math.pi / 2
    x, y = pose.x + 0.04 * math.cos(pose.heading + to_side), pose.y + 0.04 * math.sin(pose.heading + to_side)
    world.move_robot(0, Pose(x, y, pose.heading + chance.uniform(-1.5, 1.5)))


def from_line(world: World) -> float:
    """Return how far the middle ground sensor is from the line, m."""
    pose = world.pose(0)
    sensor = Pose(pose.x + 0.03 * math.cos(pose.heading), pose.y + 0.03 * math.sin(pose.heading))
    return min(from_segment(sensor, *piece) for piece in pairwise(points(world)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_it_stays_on_the_line_for_a_whole_lap(seed: int) -> None:
    seen = run("line-following", "line", seed, seconds=52, at={0: on_the_line}, look=from_line)
    assert max(seen.seen[seen.after(1) :]) < 0.008
    assert seen.states == ["following"]
    length = sum(math.dist(*piece) for piece in pairwise(points(seen.world)))
    assert seen.path > length


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 4])
def test_pushed_off_the_line_it_finds_it_again(seed: int) -> None:
    seen = run("line-following", "line", seed, seconds=40, at={0: on_the_line, 5: aside}, look=from_line)
    assert max(seen.seen[seen.after(5) : seen.after(6)]) > 0.01
    assert "sweeping" in seen.states
    assert max(seen.seen[seen.after(35) :]) < 0.01


# -- a ball --


def ball_anywhere(world: World, chance: random.Random) -> None:
    """Put the robot somewhere, and the ball somewhere else."""
    anywhere(world, chance)
    with suppress(ArgumentError):  # it stays where it is if somebody stands there
        world.move_cylinder(0, chance.uniform(0.3, 1.4), chance.uniform(0.2, 0.8))


def from_ball(world: World) -> float:
    """Return the distance from the camera to the middle of the ball, m."""
    pose, ball = world.pose(0), world.snapshot().cylinders[0]
    eye = pose.x + 0.03 * math.cos(pose.heading), pose.y + 0.03 * math.sin(pose.heading)
    return math.dist(eye, (ball.x, ball.y))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 2])
def test_it_finds_the_ball_and_stands_before_it_at_the_set_distance(seed: int) -> None:
    seen = run("follow-ball", "soccer", seed, seconds=40, at={0: ball_anywhere}, look=from_ball)
    assert max(seen.seen[seen.after(35) :]) < 0.16
    assert min(seen.seen[seen.after(35) :]) > 0.14
    ball = seen.world.snapshot().cylinders[0]
    assert abs(bearing(seen.world, ball.x, ball.y)) < 3


@pytest.mark.slow
def test_it_follows_a_ball_that_rolls_round_in_a_circle() -> None:
    def roll(time: float) -> Change:
        return lambda world, _: world.move_cylinder(
            0, 0.85 + 0.25 * math.cos(0.12 * time), 0.5 + 0.25 * math.sin(0.12 * time)
        )

    at: dict[float, Change] = {0: lambda world, _: world.move_robot(0, Pose(0.4, 0.5, 2.0))}
    at |= {time / 4: roll(time / 4) for time in range(1, 160)}
    seen = run("follow-ball", "soccer", 1, seconds=40, at=at, look=from_ball)
    assert all(0.1 < distance < 0.25 for distance in seen.seen[seen.after(15) :])
    assert seen.path > 0.6


# -- sounds --


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "firmware"), [(1, "asercom-1.2.2"), (2, "btcom-1.1.3"), (3, "epuck2")])
def test_it_turns_towards_the_beeper_and_stays_so(seed: int, firmware: str) -> None:
    seen = run("locate-clap", f"beeper?firmware={firmware}", seed, seconds=10, at={0: anywhere})
    source = seen.world.scene.sounds[0]
    assert seen.states[-1] == "facing"
    assert abs(bearing(seen.world, source.x, source.y)) < 15


@pytest.mark.slow
def test_it_turns_to_each_clap_and_says_when_it_is_quiet() -> None:
    def clap(x: float, y: float) -> Change:
        return lambda world, _: world.set_sound(0, Sound(x, y, 3000))

    def quiet(world: World, _: object) -> None:
        world.set_sound(0, Sound(0.6, 0.4, 0))

    places = {8.0: (0.2, 0.7), 14.0: (1.0, 0.2), 20.0: (0.7, 0.8)}
    at: dict[float, Change] = {0: quiet}
    at |= {time: clap(*place) for time, place in places.items()}
    at |= {time + 0.3: quiet for time in places}
    seen = run("locate-clap", "beeper", 1, seconds=25, at=at)
    assert seen.outcome is not None
    assert seen.outcome.lines[0].startswith("nothing to hear")
    for time, (x, y) in places.items():
        (pose,) = seen.poses[seen.after(time + 4)]
        assert abs(math.remainder(math.atan2(y - pose.y, x - pose.x) - pose.heading, math.tau)) < math.radians(12)


# -- swarms --


def spread(poses: Sequence[Pose]) -> float:
    """Return the mean distance from the middle of all, m."""
    x, y = mean(pose.x for pose in poses), mean(pose.y for pose in poses)
    return mean(math.dist((pose.x, pose.y), (x, y)) for pose in poses)


def closest(poses: Sequence[Pose]) -> float:
    """Return the smallest distance between two, m."""
    return min(math.dist((a.x, a.y), (b.x, b.y)) for a, b in combinations(poses, 2))


def clustered(path: Path, seed: int) -> Path:
    """Write a world of ten robots that stand close together somewhere in a room of a square metre."""
    chance = random.Random(seed)
    x, y = chance.uniform(0.15, 0.5), chance.uniform(0.15, 0.6)
    text = "[arena]\nsize = [1.0, 1.0]\n\n[simulation]\nstep = 0.03125\n"
    for k in range(10):
        place = [round(start + 0.085 * n + chance.uniform(-0.004, 0.004), 4) for start, n in ((x, k % 4), (y, k // 4))]
        text += f"\n[[robot]]\nposition = {place}\nheading = {chance.uniform(-180, 180):.1f}\n"
    path.write_text(text)
    return path


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 7])
def test_ten_robots_halve_their_mean_distance_from_the_middle_and_stay_together(seed: int) -> None:
    seen = run("aggregation", "crowd?robots=10", seed, seconds=40)
    together = [spread(poses) for poses in seen.poses]
    assert max(together[seen.after(30) :]) < together[0] / 2


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_ten_robots_double_the_smallest_distance_between_them(seed: int, tmp_path: Path) -> None:
    seen = run("dispersion", str(clustered(tmp_path / "cluster.toml", seed)), seed, seconds=60)
    apart = [closest(poses) for poses in seen.poses]
    assert apart[0] < 0.086
    assert median(apart[seen.after(30) :]) > 2 * apart[0]


# -- all of them --

HOME = {
    "braitenberg": "light",
    "wall-following": "maze",
    "line-following": "line",
    "follow-ball": "soccer",
    "locate-clap": "beeper",
    "dispersion": "crowd?robots=2",
    "aggregation": "crowd?robots=2",
}
"""Where they are tried; swarms are small here, since each of their robots has weather of its own."""


@pytest.mark.slow
@pytest.mark.parametrize("name", HOME)
def test_the_same_seed_gives_the_same_run_to_the_last_bit_and_another_seed_another(name: str) -> None:
    runs = [run(name, HOME[name], seed, seconds=5) for seed in (7, 7, 8)]
    digests = [(each.world.hash(), each.outcome.states if each.outcome else ()) for each in runs]
    assert digests[0] == digests[1]
    assert digests[0][0] != digests[2][0]


BROKEN = """description = "gone for three seconds, and later it restarts"

[[fault]]
kind = "cut"
from = 40
until = 43

[[fault]]
kind = "reset"
at = 80
"""


@pytest.mark.slow
@pytest.mark.parametrize("weather", ["loss", "late", "broken"])
@pytest.mark.parametrize("name", HOME)
def test_two_minutes_of_bad_weather_are_lived_through_and_the_robots_stand_at_the_end(
    name: str, weather: str, tmp_path: Path
) -> None:
    script = tmp_path / "weather.toml"
    script.write_text(BROKEN)
    keys = {"loss": "loss=0.05", "late": "latency=0.2", "broken": f"fault={script}"}[weather]
    joint = "&" if "?" in HOME[name] else "?"
    seen = run(name, f"{HOME[name]}{joint}{keys}", 4, seconds=120)
    assert seen.outcome is not None
    assert seen.outcome.statistics is not None
    assert seen.simulation is not None
    assert seen.outcome.reason == "time"
    assert seen.outcome.duration == pytest.approx(120, abs=5)
    assert seen.counts[-1] - seen.counts[seen.after(90)] > 20, "it goes on"
    if weather == "loss":
        assert seen.outcome.statistics.lost > 20
    elif weather == "late":
        assert seen.outcome.statistics.median > 0.4
    else:
        assert all((each.counts.cuts, each.counts.resets) == (1, 1) for each in seen.simulation.weather)
    assert seen.stands()
