"""Exact motion: distances and angles by the world's own measure, over good links and bad ones, and how motions end."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

import elib
from elib.base.errors import ArgumentError, LinkLost, MotionBusy, MotionInterrupted, ReplyTimeout
from elib.base.pose import Pose
from elib.base.timebase import new_loop
from elib.link.protocol.profiles import PROFILES
from elib.robot.aio import Epuck
from elib.robot.blocking import BlockingEpuck
from elib.robot.runner import run_on
from elib.testing import link_of, simulation_of, with_faults
from lanes import each_once, short
from shared import inside, with_fault

FIELD = "sim://arena?speed=max&quality=ideal"
BLUETOOTH = "&latency=0.03&jitter=0.015"
STEP = 1.3e-4
"""m, one motor step."""


def standing(robot: Epuck) -> Pose:
    """Return where the robot stands in its world."""
    simulation = simulation_of(robot)
    simulation.catch_up()
    return simulation.world.pose(0)  # type: ignore[no-any-return]


def moved(before: Pose, after: Pose) -> float:
    return math.dist((before.x, before.y), (after.x, after.y))


def turned(before: Pose, after: Pose) -> float:
    return math.degrees(math.remainder(after.heading - before.heading, math.tau))


async def stands(robot: Epuck) -> bool:
    before = await robot.encoders()
    await robot.sleep(1.0)
    return await robot.encoders() == before


def on(url: str, main: Callable[[Epuck], Awaitable[None]]) -> None:
    run_on(url, main)


@pytest.mark.parametrize(
    ("firmware", "link"), each_once(PROFILES, ["", BLUETOOTH, "&latency=0.2", "&loss=0.05&latency=0.03"])
)
def test_ten_centimetres_are_ten_centimetres_within_a_millimetre_over_every_link(link: str, firmware: str) -> None:
    async def main(robot: Epuck) -> None:
        before = standing(robot)
        pose = await robot.drive(0.10)
        assert moved(before, standing(robot)) == pytest.approx(0.10, abs=0.0003)
        assert pose.x == pytest.approx(0.10, abs=STEP)
        assert await stands(robot)

    on(f"{FIELD}&firmware={firmware}{link}", main)


@pytest.mark.parametrize("seed", short(range(5), 0, 1))
def test_a_square_closes_within_two_millimetres_and_a_degree_over_bluetooth(seed: int) -> None:
    async def main(robot: Epuck) -> None:
        before = standing(robot)
        for _ in range(4):
            await robot.drive(0.15)
            await robot.turn(-math.pi / 2)
        after = standing(robot)
        assert moved(before, after) < 0.002
        assert abs(turned(before, after)) < 1.0

    on(f"{FIELD}{BLUETOOTH}&seed={seed}", main)


@inside(elib.open, FIELD)
async def test_backwards_and_to_the_right_are_negative(robot: Epuck) -> None:
    before = standing(robot)
    assert (await robot.drive(-0.05)).x == pytest.approx(-0.05, abs=STEP)
    await robot.turn(math.radians(-45))
    assert turned(before, standing(robot)) == pytest.approx(-45, abs=0.3)


@inside(elib.open, FIELD)
async def test_many_small_turns_add_up_because_what_one_rounds_off_the_next_makes_good(robot: Epuck) -> None:
    before = standing(robot)
    for _ in range(20):
        await robot.turn(math.radians(4.5))
    assert turned(before, standing(robot)) == pytest.approx(90, abs=0.5)


@inside(elib.open, FIELD + BLUETOOTH)
async def test_a_place_is_reached_with_the_heading_asked_for(robot: Epuck) -> None:
    pose = await robot.go_to(0.12, -0.08, math.pi / 2)
    assert math.dist((pose.x, pose.y), (0.12, -0.08)) < 0.001
    assert pose.heading == pytest.approx(math.pi / 2, abs=math.radians(0.5))
    assert not math.isnan(pose.time)
    assert await robot.go_to(0.12, -0.08) == pose  # it is there already: nothing moves


@inside(elib.open, FIELD)
async def test_odometry_can_be_put_to_a_known_place_and_follows_every_reading_of_the_counters(robot: Epuck) -> None:
    await robot.set_pose(1.0, 2.0, math.pi)
    await robot.set_velocity(0.05)
    for _ in range(10):
        await robot.sleep(0.2)
        await robot.encoders()  # odometry sees every reading, also this one
    await robot.stop()
    pose = await robot.pose()
    assert pose.x == pytest.approx(1.0 - 0.1, abs=0.005)
    assert pose.y == pytest.approx(2.0, abs=0.001)


@pytest.mark.parametrize("broken", ["D", "D,100", "D,x,y", "P,7", "P,"])
@inside(elib.open, FIELD)
async def test_odometry_follows_speeds_and_counters_that_are_set_as_text(robot: Epuck, broken: str) -> None:
    await robot.pose()
    await robot.text(broken)
    await robot.text("D,500,500")
    await robot.sleep(2.0)
    await robot.text("D,0,0")
    assert (await robot.pose()).x == pytest.approx(0.129, abs=0.006)
    await robot.text("P,2000,2000")
    assert (await robot.pose()).x == pytest.approx(0.129, abs=0.006)


@inside(elib.open, FIELD)
async def test_counters_that_are_set_or_wrap_do_not_move_the_pose(robot: Epuck) -> None:
    await robot.pose()
    await robot.set_encoders(32760, -32760)
    await robot.turn(math.radians(-30))  # the left counter wraps upwards, the right one downwards
    await robot.set_encoders(5, 5)
    pose = await robot.pose()
    assert (pose.x, pose.y) == pytest.approx((0, 0), abs=1e-6)
    assert math.degrees(pose.heading) == pytest.approx(-30, abs=0.3)


@inside(elib.open, FIELD)
async def test_a_reset_between_two_readings_counts_from_nothing(robot: Epuck) -> None:
    await robot.drive(0.1)
    await robot.reset()
    await robot.drive(0.05)
    assert (await robot.pose()).x == pytest.approx(0.15, abs=2 * STEP)


@inside(elib.open, FIELD)
async def test_velocity_and_turn_rate_become_wheel_speeds(robot: Epuck) -> None:
    await robot.set_velocity(0.0644, 1.0)
    left, right = await robot.speed()
    assert (left + right) / 2 == pytest.approx(0.5, abs=0.001)
    assert (right - left) * 0.1288 / 0.053 == pytest.approx(1.0, abs=0.01)
    with pytest.raises(ArgumentError, match="asks a wheel for"):
        await robot.set_velocity(0.12, 3.0)


@inside(elib.open, FIELD + BLUETOOTH)
async def test_a_motion_that_is_cancelled_leaves_the_robot_standing(robot: Epuck) -> None:
    task = asyncio.create_task(robot.drive(0.5))
    await robot.sleep(1.0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert await stands(robot)
    assert 0.01 < (await robot.pose()).x < 0.2
    await robot.drive(0.01)  # and the next one has the wheels


@inside(elib.open, FIELD)
async def test_a_second_motion_is_refused_while_one_is_under_way(robot: Epuck) -> None:
    task = asyncio.create_task(robot.drive(0.1))
    await robot.sleep(0.5)
    with pytest.raises(MotionBusy, match=r"turn\(1\): drive\(0.1\) is still under way"):
        await robot.turn(1)
    with pytest.raises(MotionBusy):
        await robot.set_velocity(0.05)
    assert (await task).x == pytest.approx(0.1, abs=STEP)


@pytest.mark.parametrize("meddle", ["stop", "set_speed"])
@inside(elib.open, FIELD)
async def test_another_call_for_the_wheels_ends_a_motion_and_is_obeyed(robot: Epuck, meddle: str) -> None:
    task = asyncio.create_task(robot.drive(0.2))
    await robot.sleep(0.5)
    await (robot.stop() if meddle == "stop" else robot.set_speed(-0.2, -0.2))
    with pytest.raises(MotionInterrupted, match=rf"drive\(0.2\) was ended by {meddle}\(\)"):
        await task
    assert await stands(robot) == (meddle == "stop")


@inside(elib.open, FIELD + BLUETOOTH)
async def test_the_pose_can_be_asked_for_while_a_motion_is_under_way_and_when_it_was_ended(robot: Epuck) -> None:
    task = asyncio.create_task(robot.drive(0.2))
    await robot.sleep(1.0)
    assert 0.02 < (await robot.pose()).x < 0.1
    await robot.stop()
    assert 0.02 < (await robot.pose()).x < 0.1
    with pytest.raises(MotionInterrupted):
        await task


@inside(elib.open, FIELD + BLUETOOTH)
async def test_the_first_pose_survives_a_lost_answer_whatever_time_it_is(robot: Epuck) -> None:
    await robot.sleep(1000)
    link = link_of(robot)
    link._loss = 1.0
    asking = asyncio.create_task(robot.pose())
    await robot.sleep(0.2)
    link._loss = 0.0
    assert (await asking).x == 0.0


@inside(elib.open, FIELD + BLUETOOTH)
async def test_a_time_of_its_own_ends_a_motion_that_takes_longer_and_the_robot_stands(robot: Epuck) -> None:
    with pytest.raises(ReplyTimeout):
        await robot.within(1.0).drive(1.0)
    assert await stands(robot)


@inside(elib.open, "sim://arena?speed=max&quality=ideal&loss=0.05&seed=3&latency=0.03")
async def test_a_lost_answer_costs_a_motion_with_a_time_of_its_own_no_more_than_another_one(robot: Epuck) -> None:
    began = robot.time
    await robot.within(20).turn(-1.75)
    assert robot.time - began < 8


@pytest.mark.parametrize("firmware", PROFILES)
def test_a_motion_that_takes_too_long_says_what_was_asked_what_was_driven_and_that_the_robot_stands(
    firmware: str,
) -> None:
    async def main(robot: Epuck) -> None:
        with pytest.raises(ReplyTimeout) as caught:
            await robot.within(5).drive(5)
        driven = (await robot.pose()).x
        assert caught.value.message == f"drive(5) did not end within 5 s: {driven:.2f} m driven; the robot stands"
        assert caught.value.request == "drive(5)"
        assert await stands(robot)
        with pytest.raises(
            ReplyTimeout, match=r"^turn\(3\) did not end within 1 s: \d\.\d\d rad turned; the robot stands$"
        ):
            await robot.within(1).turn(3)
        with pytest.raises(ReplyTimeout, match=r"^drive\(0.1\) did not end within 0 s: nothing driven; "):
            await robot.within(0).drive(0.1, speed=0.01)

    on(f"{FIELD}&firmware={firmware}", main)


@inside(elib.open, FIELD)
async def test_a_motion_whose_robot_cannot_be_heard_does_not_say_that_it_stands(robot: Epuck) -> None:
    driving = asyncio.create_task(robot.within(3).drive(5))
    await robot.sleep(1.0)
    link_of(robot)._loss = 1.0
    with pytest.raises((ReplyTimeout, LinkLost)) as caught:
        await driving
    assert "the robot stands" not in str(caught.value)
    assert "encoders() did not end" not in str(caught.value)


@inside(elib.open, FIELD + "&latency=0.2")
async def test_a_pose_that_cannot_be_read_in_time_names_the_call_and_its_time(robot: Epuck) -> None:
    with pytest.raises(ReplyTimeout, match=r"^pose\(\) did not end within 0.1 s: the step counters could not be read"):
        await robot.within(0.1).pose()


@pytest.mark.parametrize("degrees", [19, 90, -180, 360.0])
@inside(elib.open, FIELD)
async def test_more_than_three_turns_are_refused_and_degrees_are_suspected(robot: Epuck, degrees: float) -> None:
    before = robot.statistics.count
    for call, ways in ((robot.turn, ()), (robot.go_to, (0.1, 0.0)), (robot.set_pose, (0.0, 0.0))):
        with pytest.raises(ArgumentError, match="must be a number from -18") as caught:
            call(*ways, degrees)  # the call itself, before it is awaited
        assert caught.value.hint.startswith(f"did you mean math.radians({degrees:g})?")
    assert robot.statistics.count == before


@pytest.mark.parametrize("firmware", PROFILES)
def test_a_number_in_another_unit_is_refused_and_told_so_before_anything_is_sent(firmware: str) -> None:
    async def main(robot: Epuck) -> None:
        before = robot.statistics.count
        for call, hint in (
            (lambda: robot.drive(40), "did you mean 0.4 (40 cm) or 0.04 (40 mm)? for 40 m write elib.really(40)"),
            (lambda: robot.drive(200), "did you mean 2 (200 cm) or 0.2 (200 mm)?"),
            (lambda: robot.drive(0.1, speed=5), "did you mean 0.05 (5 cm/s) or 0.005 (5 mm/s)?"),
            (lambda: robot.go_to(30, 0.2), "did you mean 0.3 (30 cm) or 0.03 (30 mm)? for 30 m write elib.really(30)"),
            (lambda: robot.set_pose(0, 30), "did you mean 0.3 (30 cm) or 0.03 (30 mm)? for 30 m write elib.really(30)"),
            (lambda: robot.set_velocity(0.05, 45), "did you mean math.radians(45)?"),
            (lambda: robot.drive("10cm"), "did you mean 0.1, without quotes?"),  # type: ignore[arg-type]
            (lambda: robot.set_speed(500, 500), "did you mean 0.5 (500 steps/s)?"),
            (lambda: robot.set_speed(6.2, 6.2), "did you mean 0.9868 (6.2 rad/s)?"),
            (lambda: robot.sleep(5000), "did you mean 5 (5000 ms)? for 5000 s write elib.really(5000)"),
        ):
            with pytest.raises(ArgumentError) as caught:
                await call()
            assert caught.value.hint == hint
        with pytest.raises(ArgumentError, match=r"did you mean 5 \(5000 ms\)\?"):
            robot.within(5000)
        assert robot.statistics.count == before

    on(f"{FIELD}&firmware={firmware}", main)


def test_an_unusual_number_that_is_really_meant_is_taken_up_to_what_the_robot_can() -> None:
    async def main(robot: Epuck) -> None:
        began = robot.time
        await robot.sleep(elib.really(5000))
        assert robot.time - began == pytest.approx(5000)
        await robot.set_pose(elib.really(30), elib.really(-20))
        pose = await robot.go_to(elib.really(30.05), elib.really(-20))
        assert (pose.x, pose.y) == pytest.approx((30.05, -20), abs=0.001)
        with pytest.raises(ArgumentError, match=r"distance is 101\.0 m") as caught:
            await robot.drive(elib.really(101))
        assert caught.value.hint == "did you mean 1.01 (101 cm) or 0.101 (101 mm)?"
        with pytest.raises(ArgumentError, match=r"elib\.really\(\) takes a number, not '40'"):
            elib.really("40")  # type: ignore[arg-type]  # that is the mistake

    on(FIELD, main)


@pytest.mark.parametrize("firmware", PROFILES)
def test_a_speed_that_is_to_be_clipped_is_the_fastest_of_the_firmware(firmware: str) -> None:
    async def main(robot: Epuck) -> None:
        most = 1.1 if firmware == "epuck2" else 1.0
        await robot.set_speed(1.7, -math.inf, clip=True)
        assert await robot.speed() == (most, -most)
        await robot.set_speed(0.2, -0.3, clip=True)
        assert await robot.speed() == (0.2, -0.3)
        for wrong in (math.nan, "fast"):
            with pytest.raises(ArgumentError, match="left is"):
                await robot.set_speed(wrong, 0.0, clip=True)  # type: ignore[arg-type]

    on(f"{FIELD}&firmware={firmware}", main)


@inside(elib.open, FIELD)
async def test_three_turns_are_three_turns(robot: Epuck) -> None:
    await robot.turn(6 * math.pi)
    left, right = await robot.encoders()
    assert right - left == pytest.approx(6 * math.pi * 0.053 / 0.1288 * 1000, abs=2)


@inside(elib.open, FIELD)
async def test_a_pose_can_be_gone_to_and_x_without_y_is_refused(robot: Epuck) -> None:
    pose = await robot.go_to(Pose(0.05, 0.02, 1.0))
    assert (pose.x, pose.y, pose.heading) == pytest.approx((0.05, 0.02, 1.0), abs=0.005)
    with pytest.raises(ArgumentError, match="needs y as well"):
        await robot.go_to(0.1)
    with pytest.raises(ArgumentError, match="takes either a pose"):
        await robot.go_to(pose, 0.1)


def test_of_two_motions_the_one_that_began_first_drives() -> None:
    with elib.connect(FIELD) as robot:
        first = robot.begin.drive(0.05)
        with pytest.raises(MotionBusy, match=r"drive\(0.1\): drive\(0.05\) is still under way"):
            robot.drive(0.1)
        assert first.end().x == pytest.approx(0.05, abs=STEP)
        first, second = robot.begin.turn(0.2), robot.begin.turn(0.4)
        assert isinstance(second.exception(), MotionBusy)
        assert first.end().heading == pytest.approx(0.2, abs=0.01)
        first = robot.begin.drive(0.05)
        with pytest.raises(MotionBusy, match="set_velocity"):
            robot.set_velocity(0.05)
        first.end()


@inside(elib.open, FIELD)
async def test_a_motion_that_nobody_will_run_gives_the_wheels_back(robot: Epuck) -> None:
    never = robot.drive(0.5)
    never.close()
    cancelled = asyncio.create_task(robot.drive(0.5))
    cancelled.cancel()
    await asyncio.wait([cancelled])
    with pytest.raises(ArgumentError):
        await robot.drive(math.nan)
    assert (await robot.drive(0.05)).x == pytest.approx(0.05, abs=STEP)


def test_calls_for_the_wheels_count_in_the_order_in_which_they_were_made() -> None:
    with elib.connect(FIELD) as robot:
        driving = robot.begin.drive(0.3)
        robot.set_speed(0.1, 0.1)
        with pytest.raises(MotionInterrupted, match=r"drive\(0.3\) was ended by set_speed\(\)"):
            driving.end()
        setting = robot.begin.set_speed(0.2, 0.2)
        robot.drive(0.05)  # the speed that was set before it does not end it
        setting.end()
        assert blocking_stands(robot)


@inside(elib.open, FIELD)
async def test_impossible_numbers_are_refused_before_anything_is_sent(robot: Epuck) -> None:
    before = robot.statistics.count
    for call, values, named in (
        (robot.drive, (math.nan,), {}),
        (robot.drive, (0.1,), {"speed": 1.0}),
        (robot.turn, (math.inf,), {}),
        (robot.turn, (1,), {"turn_rate": 0}),
        (robot.go_to, (0.1, "x"), {}),
    ):
        with pytest.raises(ArgumentError, match="must be a number from"):
            call(*values, **named)
    assert robot.statistics.count == before


@inside(elib.open, FIELD)
async def test_on_a_link_that_loses_everything_a_motion_is_given_up_in_bounded_time(robot: Epuck) -> None:
    link_of(robot)._loss = 1.0
    began = robot.time
    with pytest.raises((LinkLost, ReplyTimeout)):
        await robot.drive(0.1)
    assert robot.time - began < 30


def test_the_other_styles_move_too_and_a_pending_motion_can_be_cancelled() -> None:
    with elib.connect(FIELD) as robot:
        assert robot.drive(0.02).x == pytest.approx(0.02, abs=STEP)
        assert robot.begin.turn(0.5).end().heading == pytest.approx(0.5, abs=0.005)
        pending = robot.begin.drive(0.5)
        robot.sleep(0.5)
        assert pending.cancel()
        for _ in range(2):
            with pytest.raises(elib.CallCancelled, match=r"begin\.drive was cancelled\nhint: .*the robot is open"):
                pending.end()
        assert pending.cancel()
        robot.sleep(0.2)
        assert blocking_stands(robot)
        ended = robot.begin.selector()
        ended.end()
        assert not ended.cancel()
        assert ended.end().position == 3
        found: list[Pose] = []
        robot.callback(lambda pose, _: found.append(pose)).drive(0.01)
        for _ in range(40):
            robot.sleep(0.1)
        assert len(found) == 1


def blocking_stands(robot: BlockingEpuck) -> bool:
    before = robot.encoders()
    robot.sleep(1.0)
    return robot.encoders() == before


@pytest.mark.parametrize(("firmware", "moment"), each_once(["btcom-1.1.3", "asercom-1.2.2", "epuck2"], [0.5, 1.0, 1.5]))
def test_a_robot_that_restarts_in_the_middle_of_a_turn_turns_on(firmware: str, moment: float, tmp_path: Path) -> None:
    reset = f'kind = "reset"\nat = {moment}\n'

    async def main() -> None:
        async with elib.reconnecting(with_fault(tmp_path, reset, f"{FIELD}&firmware={firmware}&latency=0.03")) as robot:
            before = standing(robot)
            await robot.turn(math.pi)
            assert robot.time < 25
            assert abs(turned(before, standing(robot))) == pytest.approx(180, abs=25)  # what was not counted is lost

    with asyncio.Runner(loop_factory=lambda: new_loop("max")) as runner:
        runner.run(main())


@inside(elib.open, with_faults("half-answers", FIELD))
async def test_garbled_answers_delay_a_motion_and_do_not_end_it(robot: Epuck) -> None:
    before = standing(robot)
    await robot.drive(0.05)
    assert moved(before, standing(robot)) == pytest.approx(0.05, abs=0.001)


@inside(elib.open, FIELD)
async def test_a_drive_back_to_where_the_counters_were_0_is_not_taken_for_a_restart(robot: Epuck) -> None:
    await robot.pose()
    await robot.set_speed(0.2, 0.2)
    await robot.sleep(2.5)
    assert (await robot.pose()).x > 0.05
    await robot.set_speed(-0.2, -0.2)
    await robot.sleep(2.5)
    await robot.stop()
    assert (await robot.pose()).x == pytest.approx(0, abs=0.002)


@inside(elib.open, FIELD)
async def test_counters_that_were_set_without_an_answer_move_no_pose(robot: Epuck) -> None:
    await robot.pose()
    link = link_of(robot)
    link._loss = 1.0
    with pytest.raises(ReplyTimeout):
        await robot.within(0.2).set_encoders(5000, 5000)
    link._loss = 0.0
    assert (await robot.pose()).x == pytest.approx(0, abs=0.001)


@inside(elib.open, "sim://arena?speed=max&quality=ideal&latency=0.2")
async def test_a_stop_that_was_never_sent_ends_no_motion(robot: Epuck) -> None:
    task = asyncio.create_task(robot.drive(0.1))
    await robot.sleep(0.2)
    with pytest.raises(ReplyTimeout):
        await robot.within(0.001).stop()
    assert (await task).x == pytest.approx(0.1, abs=STEP)
    assert await stands(robot)


def test_a_motion_that_ends_in_a_gap_does_not_go_on_after_it(tmp_path: Path) -> None:
    async def main() -> None:
        url = with_fault(tmp_path, 'kind = "cut"\nat = 1.5\nfor = 4\n', FIELD + BLUETOOTH)
        async with elib.reconnecting(url, keep_speed=True) as robot:
            with pytest.raises(ReplyTimeout):
                await robot.within(3).drive(0.4)
            await robot.sleep(6)
            assert await stands(robot)

    with asyncio.Runner(loop_factory=lambda: new_loop("max")) as runner:
        runner.run(main())
