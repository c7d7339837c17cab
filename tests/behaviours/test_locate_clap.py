"""Locating a sound: its direction from three or four volumes, and what the behaviour says of it."""

from __future__ import annotations

import math
import random

import pytest

from elib.behaviours import RunContext, find, play
from elib.behaviours.locate_clap import FACING, locate
from elib.physics import Sound as Source
from elib.physics import World
from elib.pose import Pose
from elib.robot.aio import Epuck
from elib.testing.inside import transport_of


def volumes(bearing: float, count: int, *, volume: float = 100.0, contrast: float = 40.0) -> list[float]:
    """Return volumes of microphones that follow the cosine of the direction exactly."""
    return [volume + contrast * math.cos(math.radians(bearing) - facing) for facing in FACING[:count]]


@pytest.mark.parametrize("count", [3, 4])
@pytest.mark.parametrize("bearing", [-170, -90, -20, 0, 45, 120])
def test_a_plain_wave_is_located_exactly(bearing: float, count: int) -> None:
    sound = locate(volumes(bearing, count))
    assert math.degrees(sound.bearing) == pytest.approx(bearing)
    assert sound.volume == pytest.approx(100)


def test_the_loudest_side_is_the_side_of_the_sound() -> None:
    assert locate((200, 100, 100)).bearing < 0  # right
    assert locate((100, 200, 100)).bearing > 0  # left
    assert abs(locate((100, 100, 200)).bearing) > math.radians(170)  # rear


def test_neither_the_noise_of_the_room_nor_the_loudness_changes_the_direction() -> None:
    quiet = locate(volumes(60, 3, volume=50, contrast=10))
    for more in (12, 500):
        assert locate([10 * each + more for each in volumes(60, 3, volume=50, contrast=10)]).bearing == pytest.approx(
            quiet.bearing
        )


@pytest.mark.parametrize(("count", "worst"), [(3, 12), (4, 7)])
def test_in_the_simulated_room_it_is_right_to_some_degrees_from_two_decimetres_on(count: int, worst: float) -> None:
    world = World.load("beeper", seed=5)
    source, chance = world.scene.sounds[0], random.Random(5)
    for _ in range(40):
        angle, distance = chance.uniform(-math.pi, math.pi), chance.uniform(0.2, 0.24)
        pose = Pose(source.x + distance * math.cos(angle), source.y + distance * math.sin(angle), chance.uniform(-3, 3))
        if not (0.04 < pose.x < world.scene.width - 0.04 and 0.04 < pose.y < world.scene.depth - 0.04):
            continue
        world.move_robot(0, pose)
        world.step()
        truth = math.atan2(source.y - pose.y, source.x - pose.x) - pose.heading
        found = locate(world.microphones(0)[:count])
        assert abs(math.degrees(math.remainder(found.bearing - truth, math.tau))) < worst


def test_in_a_quiet_room_it_says_once_that_there_is_nothing_to_hear() -> None:
    outcome = play(find("locate-clap"), "sim://square?speed=max", seconds=20)
    assert outcome.messages == (outcome.messages[0],)
    assert outcome.messages[0].startswith("no sound: ")
    assert [name for _, name in outcome.states] == ["listening"]


def test_a_sound_below_the_threshold_is_ignored() -> None:
    outcome = play(find("locate-clap"), "sim://beeper?speed=max", seconds=8, options={"threshold": 1000})
    assert "a sound has 1000 or more" in outcome.messages[0]


def test_it_says_what_it_heard_and_where_before_it_turns_there() -> None:
    outcome = play(find("locate-clap"), "sim://beeper?speed=max", seconds=8)
    assert [name for _, name in outcome.states] == ["listening", "turning", "facing"]
    assert "degrees to the" in outcome.messages[0]


def test_the_gallerys_beeper_beeps_all_the_time_and_is_heard_everywhere() -> None:
    world = World.load("beeper", seed=1)
    source = world.scene.sounds[0]
    assert isinstance(source, Source)
    for x, y in ((0.05, 0.05), (1.15, 0.05), (0.05, 0.85), (1.15, 0.85)):
        world.move_robot(0, Pose(x, y))
        world.step()
        assert max(world.microphones(0)) > 60


def test_beside_the_source_where_its_direction_is_inexact_it_still_comes_to_rest() -> None:
    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        transport = transport_of(robots[0])
        assert transport.simulation.world is not None
        source = transport.simulation.world.scene.sounds[0]
        transport.simulation.world.move_robot(0, Pose(source.x - 0.05, source.y, 2.0))

    outcome = play(find("locate-clap"), "sim://beeper?speed=max", seconds=20, watch=watch)
    assert outcome.states[-1][1] == "facing"
    assert outcome.states[-1][0] < 8
