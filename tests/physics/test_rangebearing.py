"""Range and bearing: who hears whom, what hides them, noise and loss, and that nothing depends on who asks when."""

from __future__ import annotations

import math
import statistics

import pytest

from elib.base.errors import ArgumentError
from elib.simulator.physics import Box, Cylinder, EpuckModel, Pose, Scene, Wall, World
from elib.simulator.physics.rangebearing import BEARING_DEVIATION, DISTANCE_DEVIATION, HEIGHT, PERIOD, REACH, loss

QUIET = EpuckModel(sensor_noise=0, quality="ideal")
STARTED = 8
"""Ticks of 1/64 s after which every board has sent its first message."""


def world(*starts: Pose, ticks: int = STARTED, seed: int = 1, engine="interpreted", **things) -> World:
    made = World(Scene(6, 6, starts=starts, **{"model": QUIET, **things}), seed=seed, engine=engine)
    made.run(ticks)
    return made


def pair(distance: float = 0.4, **things) -> World:
    """Return a world with two robots, the second one to the right of the first on the map."""
    return world(Pose(3, 3), Pose(3 + distance, 3), **things)


# Distance and direction.


@pytest.mark.parametrize("heading", [0.0, 1.0, -2.5])
@pytest.mark.parametrize("angle", [0.0, 1.5, 3.0, -1.0])
def test_the_other_one_is_where_it_stands_as_seen_from_the_robot(heading: float, angle: float) -> None:
    direction = heading + angle
    other = Pose(3 + 0.5 * math.cos(direction), 3 + 0.5 * math.sin(direction), 0.7)
    (heard,) = world(Pose(3, 3, heading), other).neighbours(0)
    assert heard.distance == 0.5
    assert heard.bearing == pytest.approx(angle, abs=0.0001)
    assert heard.message == b""


def test_nobody_hears_itself_or_farther_than_the_reach() -> None:
    assert world(Pose(3, 3)).neighbours(0) == []
    assert len(pair(REACH - 0.001).neighbours(0)) == 1
    assert pair(REACH + 0.001).neighbours(0) == []


def test_the_nearest_one_is_first() -> None:
    heard = world(Pose(3, 3), Pose(3.5, 3), Pose(3, 3.2), Pose(2.7, 3)).neighbours(0)
    assert [each.distance for each in heard] == [0.2, 0.3, 0.5]


def test_of_more_than_five_the_others_are_lost_and_it_is_not_always_the_same_ones() -> None:
    ring = [Pose(3 + 0.5 * math.cos(k), 3 + 0.5 * math.sin(k)) for k in range(6)]
    around = world(Pose(3, 3), *ring)
    missing = set()
    for _ in range(60):
        heard = [round(each.bearing % math.tau) for each in around.neighbours(0)]
        assert len(heard) == 5
        missing |= set(range(6)) - set(heard)
        around.run(3)
    assert missing == set(range(6))


# What hides.


@pytest.mark.parametrize(
    "things",
    [
        {"walls": (Wall(3.2, 2.9, 3.2, 3.1),)},
        {"walls": (Wall(3.2, 3.1, 3.2, 2.9, height=HEIGHT),)},
        {"walls": (Wall(3.1, 2.9, 3.3, 3.1),)},
        {"boxes": (Box(3.2, 3.0, 0.06, 0.06),)},
        {"boxes": (Box(3.2, 3.0, 0.06, 0.06, mass=0.1),)},
        {"cylinders": (Cylinder(3.2, 3.02, 0.03),)},
    ],
)
def test_what_stands_between_two_robots_hides_them_from_each_other(things) -> None:
    hidden = pair(**things)
    assert hidden.neighbours(0) == hidden.neighbours(1) == []


@pytest.mark.parametrize(
    "things",
    [
        {"walls": (Wall(3.2, 3.01, 3.2, 3.2),)},
        {"walls": (Wall(3.2, 2.9, 3.2, 3.1, height=HEIGHT - 0.001),)},
        {"walls": (Wall(3.1, 3.1, 3.3, 3.1),)},
        {"walls": (Wall(3.5, 2.9, 3.5, 3.1), Wall(2.9, 2.9, 2.9, 3.1))},
        {"boxes": (Box(3.2, 3.0, 0.06, 0.06, height=0.05),)},
        {"cylinders": (Cylinder(3.2, 3.04, 0.03), Cylinder(3.2, 2.97, 0.02, height=0.03))},
    ],
)
def test_what_stands_aside_behind_or_is_low_hides_nobody(things) -> None:
    seen = pair(**things)
    assert len(seen.neighbours(0)) == len(seen.neighbours(1)) == 1


def test_a_robot_between_two_others_hides_them() -> None:
    row = world(Pose(3, 3), Pose(3.2, 3.03), Pose(3.4, 3))
    assert [each.distance for each in row.neighbours(0)] == [pytest.approx(math.hypot(0.2, 0.03), abs=0.001)]
    assert len(row.neighbours(1)) == 2


# Messages and time.


def test_a_message_is_heard_with_the_next_one_that_the_board_sends_and_until_it_is_replaced() -> None:
    talk = pair(ticks=64)
    talk.send_message(1, b"\x01abc")
    (before,) = talk.neighbours(0)
    assert before.message == b""
    assert talk.time - PERIOD <= before.time <= talk.time
    talk.run(7)
    (after,) = talk.neighbours(0)
    assert after.message == b"\x01abc"
    assert 1.0 < after.time <= talk.time
    talk.run(640)
    assert talk.neighbours(0)[0].message == b"\x01abc"
    talk.send_message(1, b"")
    talk.run(7)
    assert talk.neighbours(0)[0].message == b""
    assert talk.neighbours(1)[0].message == b""


def test_of_many_messages_within_a_period_the_last_one_before_the_board_sends_is_heard() -> None:
    talk, heard = pair(ticks=64), set()
    for k in range(200):
        talk.send_message(1, bytes([k]))
        (other,) = talk.neighbours(0)
        # Told in the tick before it was sent: one a tick.
        if other.message:
            assert other.message == bytes([math.ceil((other.time - 1.0) * 64) - 1])
            heard.add(other.message)
        talk.step()
    assert len(heard) == pytest.approx(200 / 6.4, abs=1)


def test_a_message_has_four_bytes_at_most() -> None:
    talk = pair()
    talk.send_message(0, b"1234")
    with pytest.raises(ArgumentError, match="the message has 5 bytes; a robot sends at most 4"):
        talk.send_message(0, b"12345")
    with pytest.raises(ArgumentError, match="it must be bytes"):
        talk.send_message(0, "text")  # type: ignore[arg-type]  # that is the mistake
    with pytest.raises(ArgumentError, match="there is no robot 2"):
        talk.send_message(2, b"")
    with pytest.raises(ArgumentError, match="there is no robot -1"):
        talk.neighbours(-1)


def test_boards_send_ten_times_a_second_each_at_its_own_time() -> None:
    three = world(Pose(3, 3), Pose(3.3, 3), Pose(3, 3.3))
    times: list[set[float]] = [set(), set()]
    for _ in range(640):
        three.step()
        for each in three.neighbours(0):
            times[each.bearing > 1].add(round(each.time, 6))
    assert [len(each) for each in times] == [pytest.approx(100, abs=1)] * 2
    assert not times[0] & times[1]


# Noise and loss.


def test_the_loss_grows_with_the_distance_to_everything() -> None:
    assert [round(loss(distance), 2) for distance in (0.0, 0.4, 0.6, 0.8, 2.0)] == [0.05, 0.11, 0.35, 1.0, 1.0]


@pytest.mark.parametrize("distance", [0.1, 0.4, 0.6, 0.7])
def test_so_many_messages_are_lost_and_the_others_are_that_noisy(distance: float) -> None:
    noisy, heard = pair(distance, model=EpuckModel(quality="ideal")), []
    count = 1500
    for _ in range(count):
        noisy.run(7)
        heard += noisy.neighbours(0)
    assert 1 - len(heard) / count == pytest.approx(loss(distance), abs=0.04)
    assert statistics.fmean(each.distance for each in heard) == pytest.approx(distance, rel=0.02)
    assert statistics.stdev(each.distance for each in heard) == pytest.approx(DISTANCE_DEVIATION * distance, rel=0.1)
    assert statistics.fmean(each.bearing for each in heard) == pytest.approx(0, abs=0.015)
    assert statistics.stdev(each.bearing for each in heard) == pytest.approx(BEARING_DEVIATION, rel=0.1)


# Determinism.


def crowd(seed: int = 3, engine="interpreted") -> World:
    starts = [Pose(3 + 0.2 * (k % 4), 3 + 0.2 * (k // 4), k) for k in range(12)]
    things = {"model": EpuckModel(quality="ideal"), "cylinders": (Cylinder(3.1, 3.1, 0.02), Cylinder(3.5, 3.3, 0.02))}
    made = world(*starts, seed=seed, engine=engine, ticks=0, **things)
    for k in range(12):
        made.set_step_rates(k, 100 + 20 * k, 150)
        made.send_message(k, bytes([k]))
    return made


def all_heard(made: World, order) -> list[object]:
    return [heard for _, heard in sorted((robot, made.neighbours(robot)) for robot in order)]


def test_what_is_heard_does_not_depend_on_who_asks_when_how_often_or_in_which_order() -> None:
    asked, rarely, backwards = crowd(), crowd(), crowd()
    for tick in range(100):
        for made in (asked, rarely, backwards):
            made.step()
        all_heard(asked, range(12))
        if tick % 50 == 49:
            told = all_heard(asked, range(12))
            assert all_heard(rarely, range(12)) == told
            assert all_heard(backwards, reversed(range(12))) == told
    assert asked.hash() == rarely.hash()


def test_another_seed_gives_other_noise_and_a_reset_the_same_again() -> None:
    one, other = crowd(seed=3), crowd(seed=4)
    one.run(100)
    other.run(100)
    before = all_heard(one, range(12))
    assert before != all_heard(other, range(12))
    one.reset()
    assert one.neighbours(0) == []
    for k in range(12):
        one.set_step_rates(k, 100 + 20 * k, 150)
        one.send_message(k, bytes([k]))
    one.run(100)
    assert all_heard(one, range(12)) == before


@pytest.mark.long
def test_compiled_the_same_is_heard() -> None:
    plain, compiled = crowd(), crowd(engine="compiled")
    for _ in range(10):
        plain.run(13)
        compiled.run(13)
        assert all_heard(compiled, range(12)) == all_heard(plain, range(12))
