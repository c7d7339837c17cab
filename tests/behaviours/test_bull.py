"""The bull: what it does with a picture and with its infrared readings."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import pytest
from readings import NAMES, near

from elib.base.errors import ReplyTimeout
from elib.base.pose import Pose
from elib.behaviours import RunContext, find, run_behaviour_blocking
from elib.behaviours.avoid import STANDING
from elib.behaviours.bull import BLOCKED, CROWDED, STEERING, VIEW, Bull, aim, charge, wander, way_out
from elib.link.protocol.colours import Blob
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.values import Proximity, Wheels
from elib.robot.blocking import BlockingEpuck, connect
from elib.testing.inside import transport_of

RED, WHITE = b"\xf8\x00", b"\xff\xff"


def picture(left: int, right: int) -> Blob | None:
    """Return what a picture says whose columns from *left* up to *right* are red, the others white."""
    row = WHITE * left + RED * (right - left) + WHITE * (40 - right)
    return Image(CameraMode.COLOUR, 40, 40, row * 40).find("red")


def seen_at(direction: float) -> Blob:
    """Return a red area; 1 is at the left edge of the picture, -1 at the right one."""
    return Blob(320, 0.0, 20.0, 0, 8, 0.2, direction * VIEW / 2, 0.1)


def left(state: Callable[[BlockingEpuck, RunContext], str | None], robot: BlockingEpuck, run: RunContext) -> str:
    """Do steps of a state until one names another; return that name."""
    while (then := state(robot, run)) is None:
        pass
    return then


def test_no_red_gives_nothing_to_aim_at() -> None:
    assert aim(None) is None
    assert aim(picture(0, 1)) is None  # 0.025 of it


@pytest.mark.parametrize(("left", "right", "side"), [(0, 8, 1), (32, 40, -1)])
def test_the_bull_turns_towards_red_on_either_side(left: int, right: int, side: int) -> None:
    turn = aim(picture(left, right))
    assert turn is not None
    assert math.copysign(1, turn) == side
    assert abs(turn) < VIEW / 2


def test_red_in_the_middle_needs_no_turn() -> None:
    assert aim(picture(10, 31)) == pytest.approx(0, abs=0.01)


def test_the_share_of_red_that_is_enough_is_an_option() -> None:
    # 2011 asked for more than 0.3 of the picture.
    assert aim(picture(10, 21), red=0.3) is None
    assert aim(picture(10, 23), red=0.3) is not None


def test_a_charge_bends_towards_the_red_and_its_faster_wheel_keeps_the_speed() -> None:
    assert charge(seen_at(0.0), speed=0.4) == pytest.approx(Wheels(0.4, 0.4))
    assert charge(seen_at(1.0), speed=0.4) == pytest.approx(Wheels(0.4 * (1 - STEERING), 0.4))
    assert charge(seen_at(-1.0), speed=0.4) == pytest.approx(Wheels(0.4, 0.4 * (1 - STEERING)))
    bends = [(w := charge(seen_at(direction))).left - w.right for direction in (1.0, 0.4, 0.0, -0.6, -1.0)]
    assert all(a < b for a, b in pairwise(bends))


def test_a_free_bull_wanders_at_the_speeds_of_2011() -> None:
    assert wander(near(), 0.0, 0.0) == Wheels(0.1, 0.1)
    assert tuple(wander(near(), 0.3, 0.9) or ()) == pytest.approx((0.2, 0.4))


@pytest.mark.parametrize("sensor", ["front_left", "front_right", "diagonal_left", "diagonal_right"])
def test_something_in_front_ends_wandering_on(sensor: str) -> None:
    assert wander(near(**{sensor: BLOCKED + 1}), 0.5, 0.5) is None


@pytest.mark.parametrize("sensor", ["left", "right", "rear_left", "rear_right"])
def test_something_beside_or_behind_does_not(sensor: str) -> None:
    assert wander(near(**{sensor: 3000}), 0.5, 0.5) is not None


@pytest.mark.parametrize("free", NAMES)
def test_the_way_out_is_where_the_sensor_sees_least(free: str) -> None:
    counts = dict.fromkeys(NAMES, 450) | {free: 100}
    turn = way_out(near(**counts))
    assert turn is not None
    assert (turn < 0) == free.endswith("right")  # positive is to the left


@pytest.mark.parametrize(("wall", "turn"), [("front_right", 150), ("front_left", -150), ("left", -90), ("right", 90)])
def test_with_room_all_around_it_turns_its_back_on_what_it_met(wall: str, turn: float) -> None:
    found = way_out(near(**{wall: 1500}))
    assert found is not None
    assert math.degrees(found) == pytest.approx(turn, abs=20)


def test_the_noise_of_what_sees_nothing_does_not_choose_the_way() -> None:
    quiet = way_out(near(front_right=1500))
    assert way_out(near(front_right=1500, rear_left=22, left=12, diagonal_left=3, rear_right=18)) == quiet


def test_with_no_room_on_any_side_there_is_no_way_out() -> None:
    assert way_out(near(**dict.fromkeys(NAMES, CROWDED))) is None
    assert way_out(near(**dict.fromkeys(NAMES, CROWDED) | {"left": CROWDED - 20})) == pytest.approx(math.pi / 2)


def test_after_an_avoidance_it_wanders_on_and_looks_around_again() -> None:
    # The bull of 2011 stopped for ever here.
    with connect("sim://square?speed=max&latency=0.02") as robot:
        transport = transport_of(robot)
        assert transport.simulation.world is not None
        transport.simulation.world.move_robot(0, Pose(0.5, 0.05, -math.pi / 2))  # nose to the wall
        bull, run = Bull(0.4, 0.04), RunContext(lambda: robot.time)
        assert left(bull.wandering, robot, run) == "avoiding"
        assert left(bull.avoiding, robot, run) == "wandering"
        assert left(bull.wandering, robot, run) == "searching"


def test_stuck_it_stands_until_there_is_a_way_out() -> None:
    readings = [near(**dict.fromkeys(NAMES, 2000)), near(**dict.fromkeys(NAMES, 2000)), near()]
    speeds: list[tuple[float, float]] = []

    class FewReadings:
        def proximity(self) -> Proximity:
            return readings.pop(0)

        def set_speed(self, left: float, right: float) -> None:
            speeds.append((left, right))

        def sleep(self, seconds: float) -> None: ...

    bull, robot = Bull(0.4, 0.04), FewReadings()
    assert [bull.stuck(robot) for _ in range(3)] == [None, None, "wandering"]  # type: ignore[arg-type]
    assert set(speeds) == {(0.0, 0.0)}


def test_a_charge_that_was_not_answered_takes_no_picture_and_goes_on_from_a_stand() -> None:
    with connect("sim://red-boxes?speed=max&latency=0.02") as robot:
        bull, run = Bull(0.4, 0.04), RunContext(lambda: robot.time)
        run.enter(bull.waking(robot, run))
        assert left(bull.searching, robot, run) == "charging"
        while robot.speed() == STANDING:
            bull.charging(robot, run)
        with pytest.raises(ReplyTimeout):
            bull.charging(robot.within(0.01, quick_only=True), run)
        answers = robot.statistics.count
        robot.sleep(2)
        assert robot.statistics.count == answers
        bull.charging(robot, run)
        assert robot.speed() == STANDING
        bull.charging(robot, run)
        assert robot.speed() != STANDING


def test_a_camera_that_was_set_otherwise_meanwhile_is_set_again() -> None:
    with connect("sim://red-boxes?speed=max&latency=0.02") as robot:
        meddle = robot.begin(lambda _: robot.set_camera(20, 20, 8, CameraMode.GREY))
        meddle.sleep(2)
        run_behaviour_blocking(find("bull"), robot, seconds=8)
        assert robot.camera().mode == CameraMode.COLOUR
