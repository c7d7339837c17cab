"""The direction of a sound, from the volumes of three or four microphones."""

from __future__ import annotations

import math
import statistics

import pytest

from elib.base.body import MICROPHONE_DIRECTIONS
from elib.base.pose import Pose
from elib.link.protocol.values import Microphones, locate_sound
from elib.simulator.physics import EpuckModel, Scene, World
from elib.simulator.physics.fittings import Sound


def volumes(bearing: float, count: int, *, volume: float = 100.0, contrast: float = 40.0) -> list[float]:
    """Return volumes of microphones that follow the cosine of the direction exactly."""
    return [volume + contrast * math.cos(math.radians(bearing) - facing) for facing in MICROPHONE_DIRECTIONS[:count]]


@pytest.mark.parametrize("count", [3, 4])
@pytest.mark.parametrize("bearing", [-170, -90, -20, 0, 45, 120])
def test_a_plain_wave_is_located_exactly(bearing: float, count: int) -> None:
    sound = locate_sound(volumes(bearing, count))
    assert math.degrees(sound.bearing) == pytest.approx(bearing)
    assert sound.volume == pytest.approx(100)


def test_the_loudest_side_is_the_side_of_the_sound() -> None:
    assert locate_sound((200, 100, 100)).bearing < 0  # right
    assert locate_sound((100, 200, 100)).bearing > 0  # left
    assert abs(locate_sound((100, 100, 200)).bearing) > math.radians(170)  # rear


def test_neither_the_noise_of_the_room_nor_the_loudness_changes_the_direction() -> None:
    quiet = locate_sound(volumes(60, 3, volume=50, contrast=10))
    for more in (12, 500):
        assert locate_sound(
            [10 * each + more for each in volumes(60, 3, volume=50, contrast=10)]
        ).bearing == pytest.approx(quiet.bearing)


def heard(
    angle: float, distance: float, count: int, *, seed: int, heading: float = 0.0, quality: str = "ideal"
) -> Microphones:
    """Return what a virtual robot hears of a loud source at an angle, rad, and a distance, m."""
    source = Sound(3 + distance * math.cos(heading + angle), 3 + distance * math.sin(heading + angle), 2000)
    world = World(
        Scene(6, 6, starts=(Pose(3, 3, heading),), sounds=(source,), model=EpuckModel(quality=quality)), seed=seed
    )
    world.step()
    return Microphones(counts=tuple(world.microphones(0)[:count]))


@pytest.mark.parametrize(("distance", "silent"), [(0.1, 0.02), (0.2, 0.1), (0.5, 0.45), (1.0, 0.6)])
@pytest.mark.parametrize("count", [3, 4])
def test_a_typical_robots_directions_are_right_to_the_error_that_they_state(
    distance: float, silent: float, count: int
) -> None:
    errors, stated = [], []
    for k in range(108):
        angle = math.radians(10 * k)
        found = heard(angle, distance, count, seed=k, heading=k, quality="typical")
        if found.direction is not None:
            errors.append(math.remainder(found.direction - angle, math.tau))
            stated.append(found.direction_error)
    assert math.hypot(*errors) == pytest.approx(math.hypot(*stated), rel=0.5)
    assert math.degrees(math.hypot(*errors)) / math.sqrt(len(errors)) < 30
    assert len(errors) >= 108 * (1 - silent)


def test_three_microphones_and_a_far_sound_tell_less() -> None:
    def error(distance: float, count: int) -> float:
        return statistics.median(heard(k, distance, count, seed=k).direction_error for k in range(50))

    assert error(0.1, 4) < error(0.2, 4) < error(0.5, 4) < error(1.0, 4)
    assert error(0.5, 4) < error(0.5, 3)


@pytest.mark.parametrize("count", [3, 4])
def test_left_is_positive_and_ahead_is_zero(count: int) -> None:
    for angle in (0.0, 0.5, -0.5, 2.0, -2.0):
        assert heard(angle, 0.2, count, seed=1).direction == pytest.approx(angle, abs=math.radians(25))


def test_what_is_too_quiet_has_no_direction() -> None:
    assert Microphones(counts=(12, 29, 11)).direction is None
    assert Microphones(counts=(12, 30, 11)).direction is not None
    assert Microphones(counts=(0, 0, 0, 0)).direction is None
    assert Microphones(counts=(12, 29, 11)).direction_error == math.inf


def test_what_is_equal_all_around_has_no_direction() -> None:
    assert Microphones(counts=(500, 500, 500)).direction is None
    assert Microphones(counts=(500, 510, 505, 495)).direction is None
    assert Microphones(counts=(4095,) * 4).direction is None
    assert Microphones(counts=(500, 510, 505, 495)).direction_error > 0.5


def test_two_microphones_have_no_direction() -> None:
    assert Microphones(counts=(100, 900)).direction is None
    assert Microphones().direction is None


def test_the_noise_of_a_quiet_room_never_has_a_direction() -> None:
    for seed in range(20):
        world = World(Scene(2, 2, starts=(Pose(1, 1),), model=EpuckModel()), seed=seed)
        for _ in range(50):
            world.step()
            assert Microphones(counts=tuple(world.microphones(0))).direction is None, f"seed {seed}"
