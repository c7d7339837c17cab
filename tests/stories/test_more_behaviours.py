"""Vehicles, walls, lines, balls, sounds and swarms, from random places.

Places are the world's, not what the robots believe. Times are simulated.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from statistics import mean, median

import pytest
from story_rig import Change, anywhere, ball_elsewhere, clearance, closest, drawn, drawn_quick, from_ball, run

from elib.base.pose import Pose
from elib.simulator.physics import Sound, Stripe, World
from elib.simulator.physics.geometry import segment_distance
from lanes import short


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


@pytest.mark.parametrize("seed", drawn_quick(2, "lamp"))
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
    assert max(late["love"]) - min(late["love"]) < 0.03
    assert runs["love"].states[-1] == "resting"
    assert mean(late["fear"]) > mean(late["love"]) + 0.05
    assert mean(late["explorer"]) > mean(late["love"]) + 0.05
    assert runs["explorer"].path > 1.3 * max(runs["fear"].path, runs["love"].path)


# -- walls --


@pytest.mark.parametrize(
    ("world", "side"),
    [
        ("maze", "right"),
        pytest.param("corridor", "left", marks=pytest.mark.long),
        pytest.param("arena", "right", marks=pytest.mark.long),
    ],
)
def test_from_any_place_it_finds_a_wall_and_keeps_its_distance_round_every_corner(world: str, side: str) -> None:
    seen = run(
        "wall-following",
        world,
        drawn(1, world)[0],
        seconds=60,
        at={0: anywhere},
        look=clearance,
        options={"side": side},
    )
    assert seen.outcome is not None
    found = next(time for time, name in seen.outcome.states if name == "following")
    assert found < 20
    along = sorted(seen.seen[seen.after(found + 3) :])
    assert 0.025 < median(along) < 0.042  # 3 cm, give or take what its sensors' gains are off
    assert along[len(along) // 20] > 0.008
    assert along[-1] < 0.06
    assert seen.longest_touch < 0.5
    assert seen.path > 2.0


@pytest.mark.long
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
    return min(segment_distance(sensor.x, sensor.y, *start, *end) for start, end in pairwise(points(world)))


@pytest.mark.parametrize("seed", drawn_quick(2, "lap"))
def test_it_stays_on_the_line_for_a_whole_lap(seed: int) -> None:
    seen = run("line-following", "line", seed, seconds=56, at={0: on_the_line}, look=from_line)
    assert max(seen.seen[seen.after(6) :]) < 0.008
    assert seen.states == ["calibrating", "following"]
    length = sum(math.dist(*piece) for piece in pairwise(points(seen.world)))
    assert seen.path > length


REAL = [
    (quality, firmware, link, seed)
    for quality in ("typical", "bad", "ideal")
    for firmware in ("asercom-1.2.2", "epuck2", "epuck2-wifi")
    for link in ("", "&fault=flaky-bluetooth")
    for seed in drawn(2, quality + firmware)
]


@pytest.mark.parametrize(
    ("quality", "firmware", "link", "seed"),
    short(REAL, REAL[0]),
)
def test_whatever_its_sensors_read_over_black_a_robot_learns_it_and_stays_on_the_line(
    quality: str, firmware: str, link: str, seed: int
) -> None:
    url = f"line?firmware={firmware}&quality={quality}{link}"
    seen = run("line-following", url, seed, seconds=30, at={0: on_the_line}, look=from_line)
    late = seen.seen[seen.after(12) :]  # over a bad link the look to both sides takes up to 11 s
    assert sum(distance < 0.02 for distance in late) > 0.95 * len(late)
    assert seen.states[0] == "calibrating"
    assert seen.path > 0.4


@pytest.mark.parametrize("seed", drawn_quick(2, "push"))
def test_pushed_off_the_line_it_finds_it_again(seed: int) -> None:
    seen = run("line-following", "line", seed, seconds=60, at={0: on_the_line, 8: aside}, look=from_line)
    assert max(seen.seen[seen.after(8) : seen.after(9)]) > 0.01
    assert "sweeping" in seen.states
    assert max(seen.seen[seen.after(50) :]) < 0.01


# -- a ball --


@pytest.mark.parametrize("seed", drawn_quick(3, "ball"))
def test_it_finds_the_ball_and_stands_before_it_at_the_set_distance(seed: int) -> None:
    seen = run("follow-ball", "soccer", seed, seconds=40, at={0: ball_elsewhere}, look=from_ball)
    assert max(seen.seen[seen.after(35) :]) < 0.16
    assert min(seen.seen[seen.after(35) :]) > 0.14
    ball = seen.world.snapshot().cylinders[0]
    assert abs(bearing(seen.world, ball.x, ball.y)) < 3


@pytest.mark.parametrize("seed", drawn_quick(3, "circle"))
def test_it_follows_a_ball_that_rolls_round_in_a_circle(seed: int) -> None:
    def roll(time: float) -> Change:
        return lambda world, _: world.move_cylinder(
            0, 0.85 + 0.25 * math.cos(0.12 * time), 0.5 + 0.25 * math.sin(0.12 * time)
        )

    at: dict[float, Change] = {0: lambda world, _: world.move_robot(0, Pose(0.4, 0.5, 2.0))}
    at |= {time / 4: roll(time / 4) for time in range(1, 160)}
    seen = run("follow-ball", "soccer", seed, seconds=40, at=at, look=from_ball)
    assert all(0.1 < distance < 0.25 for distance in seen.seen[seen.after(15) :])
    assert seen.path > 0.6


# -- sounds --

FIRMWARES = ("asercom-1.2.2", "btcom-1.1.3", "btcom-2.0", "epuck2")


def near_the_beeper(world: World, chance: random.Random) -> None:
    """Put the robot where its microphones can tell directions: a fifth of a metre away."""
    source, away = world.scene.sounds[0], chance.uniform(-math.pi, math.pi)
    place = source.x + 0.2 * math.cos(away), source.y + 0.2 * math.sin(away)
    world.move_robot(0, Pose(*place, chance.uniform(-math.pi, math.pi)))


@pytest.mark.parametrize(("seed", "firmware"), list(zip(drawn(4, "beeper"), FIRMWARES, strict=True)))
def test_it_turns_towards_a_beeper_beside_it_and_stays_so(seed: int, firmware: str) -> None:
    seen = run("locate-clap", f"beeper?firmware={firmware}", seed, seconds=20, at={0: near_the_beeper})
    source = seen.world.scene.sounds[0]
    assert seen.states[-1] == "facing"
    assert abs(bearing(seen.world, source.x, source.y)) < 25


def test_it_turns_to_each_clap_and_says_when_it_is_quiet() -> None:
    def clap(x: float, y: float) -> Change:
        return lambda world, _: world.set_sound(0, Sound(x, y, 3000))

    def quiet(world: World, _: object) -> None:
        world.set_sound(0, Sound(0.6, 0.4, 0))

    places = {8.0: (0.2, 0.6), 14.0: (0.7, 0.2), 20.0: (0.5, 0.6)}
    at: dict[float, Change] = {0: quiet}
    at |= {time: clap(*place) for time, place in places.items()}
    at |= {time + 0.3: quiet for time in places}
    seen = run("locate-clap", "beeper?firmware=epuck2", 1, seconds=25, at=at)
    assert seen.outcome is not None
    assert seen.outcome.messages[0].startswith("no sound")
    assert "unclear" not in seen.states
    for time, (x, y) in places.items():
        (pose,) = seen.poses[seen.after(time + 4)]
        assert abs(math.remainder(math.atan2(y - pose.y, x - pose.x) - pose.heading, math.tau)) < math.radians(25)


def test_of_a_sound_that_the_microphones_do_not_decide_it_says_so() -> None:
    def place(world: World, _: object) -> None:
        world.move_robot(0, Pose(0.1, 0.1, 0.3))
        world.set_sound(0, Sound(1.1, 0.4, 4000))  # Three microphones, a metre away.

    seen = run("locate-clap", "beeper?quality=ideal", 1, seconds=8, at={0: place})
    assert seen.outcome is not None
    assert "the microphones do not tell from where: go nearer" in seen.outcome.messages[0]
    assert "unclear" in seen.states


@pytest.mark.long
@pytest.mark.parametrize("firmware", ["asercom-1.2.2", "epuck2"])
def test_typical_robots_face_the_beeper_to_25_degrees_or_say_that_they_cannot_tell(
    firmware: str,
) -> None:
    errors = []
    for seed in drawn(10, "typical beeper"):
        seen = run("locate-clap", f"beeper?firmware={firmware}", seed, seconds=12, at={0: anywhere})
        # The last state alone is not asked: where the error is about that limit, it may be unclear once more.
        if "facing" in seen.states:
            source = seen.world.scene.sounds[0]
            errors.append(bearing(seen.world, source.x, source.y))
        else:
            assert seen.states[-1] == "unclear"
    assert math.hypot(*errors) / math.sqrt(len(errors)) < 25
    assert len(errors) >= 5


# -- swarms --


def spread(poses: Sequence[Pose]) -> float:
    """Return the mean distance from the middle of all, m."""
    x, y = mean(pose.x for pose in poses), mean(pose.y for pose in poses)
    return mean(math.dist((pose.x, pose.y), (x, y)) for pose in poses)


def clustered(path: Path, robots: int, seed: int) -> Path:
    """Write a world of robots that stand close together somewhere in a room of a square metre."""
    chance = random.Random(seed)
    x, y = chance.uniform(0.15, 0.5), chance.uniform(0.15, 0.6)
    text = "[arena]\nsize = [1.0, 1.0]\n\n[simulation]\nstep = 0.03125\n"
    for k in range(robots):
        place = [round(start + 0.085 * n + chance.uniform(-0.004, 0.004), 4) for start, n in ((x, k % 4), (y, k // 4))]
        text += f"\n[[robot]]\nposition = {place}\nheading = {chance.uniform(-180, 180):.1f}\n"
    path.write_text(text)
    return path


# Three may also stay where they are, as two that see each other do; with the second seed they come together.
@pytest.mark.parametrize(("robots", "seed"), [(3, 1), pytest.param(10, 0, marks=pytest.mark.long)])
def test_robots_halve_their_mean_distance_from_the_middle_and_stay_together(robots: int, seed: int) -> None:
    seen = run("aggregation", f"crowd?robots={robots}", drawn(2, "aggregation")[seed], seconds=4 * robots)
    together = [spread(poses) for poses in seen.poses]
    assert max(together[seen.after(3 * robots) :]) < together[0] / 2


@pytest.mark.parametrize("robots", short([4, 10], 4))
def test_robots_double_the_smallest_distance_between_them(robots: int, tmp_path: Path) -> None:
    (seed,) = drawn(1, "cluster")
    seen = run("dispersion", str(clustered(tmp_path / "cluster.toml", robots, seed)), seed, seconds=60)
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
    "dispersion": "crowd?robots=3",
    "aggregation": "crowd?robots=3",
    "flocking": "crowd?robots=3&firmware=epuck2",
    "go-to-light": "light",
    "billiard": "billiard",
    "bull": "red-boxes",
}
"""Worlds in which the behaviours are tried. Three robots are a swarm."""


@pytest.mark.parametrize("name", short(HOME, "dispersion"))
def test_the_same_seed_gives_the_same_run_to_the_last_bit_and_another_seed_another(name: str) -> None:
    first, other = drawn(2, name)
    runs = [run(name, HOME[name], seed, seconds=5) for seed in (first, first, other)]
    digests = [(each.world.hash(), each.outcome.states if each.outcome else ()) for each in runs]
    assert digests[0] == digests[1]
    assert digests[0][0] != digests[2][0]
