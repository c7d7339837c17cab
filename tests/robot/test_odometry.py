"""Odometry: where a robot is by its wheels though nothing was read on the way, and how sure that is."""

from __future__ import annotations

import contextlib
import math
import random
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import elib
from elib.base.body import AXLE, METRES_PER_STEP
from elib.base.errors import LinkLost, RemoteProtocolError, ReplyTimeout
from elib.base.pose import Pose, advanced
from elib.link.protocol.profiles import PROFILES
from elib.robot.aio import Epuck
from elib.robot.blocking import BlockingEpuck
from elib.robot.reckoning import MAX_CHANGES, UNKNOWN, Change, Moment, Pair, Reckoning
from elib.robot.runner import run_on
from elib.testing import link_of, simulation_of, with_faults, world_of
from lanes import few_and_many, short
from shared import with_fault

FIELD = "[arena]\nsize = [40.0, 40.0]\n[[robot]]\nposition = [20.0, 20.0]\nheading = 0\n"
FLAKY = "flaky-bluetooth"
STEP = METRES_PER_STEP / AXLE
"""rad by which a step of one wheel turns the robot."""
REAL = Reckoning.spreads
firmwares = pytest.mark.parametrize("firmware", PROFILES)
with_each_counter = pytest.mark.parametrize("firmware", short(PROFILES, "asercom-1.2.2", "epuck2"))
"""In the quick lane one firmware whose counters have 16 bits, and one whose have more."""


@pytest.fixture(autouse=True)
def nominal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let odometry take the wheels for nominal, as they are here: what it states is then of the commands alone."""
    monkeypatch.setattr(Reckoning, "spreads", (0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def field(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("worlds") / "field.toml"
    path.write_text(FIELD)
    return f"sim://{path}?speed=max&quality=ideal"


def off(robot: BlockingEpuck, pose: Pose) -> tuple[float, float]:
    """Return by how much a pose is wrong, m and rad; the robot stands, and began at the middle of the field."""
    robot.sleep(0.1)
    simulation_of(robot).catch_up()
    true = world_of(robot).pose(0)
    return math.dist((true.x - 20, true.y - 20), (pose.x, pose.y)), abs(
        math.remainder(true.heading - pose.heading, math.tau)
    )


def confirmed(robot: BlockingEpuck, left: float, right: float) -> None:
    """Set the speeds, again until that is confirmed: over a bad link a program must."""
    for _ in range(9):
        with contextlib.suppress(ReplyTimeout, RemoteProtocolError):
            robot.set_speed(left, right)
            return
    pytest.fail("the robot never answered")


speeds = st.floats(-1, 1, allow_subnormal=False)
legs = st.lists(st.tuples(speeds, speeds, st.floats(0.1, 3)), min_size=10, max_size=10)


@few_and_many(1, 3)
@pytest.mark.parametrize("watched", [(), ("proximity",)], ids=["unwatched", "watched"])
@pytest.mark.parametrize("script", short(["", FLAKY], FLAKY))
@firmwares
def test_ten_drawn_legs_with_nothing_read_in_between_end_within_a_centimetre_and_three_degrees(
    field: str, firmware: str, script: str, watched: tuple[str, ...], examples: int
) -> None:
    @settings(max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck))
    @given(drawn=legs, seed=st.integers(0, 9999))
    def drive(drawn: list[tuple[float, float, float]], seed: int) -> None:
        url = f"{field}&firmware={firmware}&seed={seed}"
        with elib.connect(with_faults(script, url) if script else url) as robot:
            snapshots = robot.watch(*watched) if watched else None
            if snapshots is not None:
                next(snapshots)
            for left, right, seconds in drawn:
                confirmed(robot, left, right)
                robot.sleep(seconds)
            confirmed(robot, 0, 0)
            pose = robot.within(5, tries=5).pose()
            place, heading = off(robot, pose)
            assert place < max(0.01, 1.2 * pose.uncertainty)  # where it may be more, it says so
            assert heading < max(math.radians(3), 1.2 * pose.heading_uncertainty)

    drive()


@firmwares
def test_odometry_begins_when_the_robot_is_opened(field: str, firmware: str) -> None:
    with elib.connect(f"{field}&firmware={firmware}") as robot:
        robot.set_speed(0.5, 0.5)
        robot.sleep(2)
        assert robot.pose().x == pytest.approx(0.129, abs=0.001)
        assert str(robot.pose()).count("uncertainty") == 0


def test_three_legs_that_nobody_watched_lead_home(field: str) -> None:
    with elib.connect(field) as robot:
        for _ in range(3):
            robot.set_speed(0.5, 0.5)
            robot.sleep(3)
            robot.set_speed(-0.25, 0.25)
            robot.sleep(0.86)
        assert math.dist((0, 0), (robot.go_to(0, 0).x, robot.pose().y)) < 0.001
        assert off(robot, Pose(0, 0, robot.pose().heading))[0] < 0.01


@with_each_counter
def test_counters_that_wrapped_unread_are_told_apart_by_speed_and_time(field: str, firmware: str) -> None:
    with elib.connect(f"{field}&firmware={firmware}") as robot:
        for speed, seconds in ((1, 33), (-0.5, 150)):
            robot.set_speed(speed, speed)
            robot.sleep(seconds)
        robot.stop()
        pose = robot.pose()
        assert -5.6 < pose.x < -5.2
        assert off(robot, pose)[0] < 0.001


@firmwares
def test_a_watch_without_the_counters_leaves_none_of_a_long_way_out(field: str, firmware: str) -> None:
    with elib.connect(f"{field}&firmware={firmware}") as robot, robot.watch("proximity", "accelerometer", rate=1):
        robot.set_speed(1, 1)
        robot.sleep(35)
        robot.stop()
        robot.sleep(2)
        assert robot.pose().x > 4.4
        assert off(robot, robot.pose())[0] < 0.001


@firmwares
def test_a_restart_that_nobody_noticed_makes_the_pose_uncertain_and_says_so(
    field: str, firmware: str, tmp_path: Path
) -> None:
    reset = 'kind = "reset"\nat = 3\n'
    with elib.connect(with_fault(tmp_path, reset, f"{field}&firmware={firmware}")) as robot:
        robot.set_speed(0.5, 0.4)
        robot.sleep(10)
        pose = robot.pose()
        place, heading = off(robot, pose)
        assert place + pose.uncertainty > 0.02
        assert place < pose.uncertainty < 0.5
        assert heading < pose.heading_uncertainty
        assert "uncertainty" in str(pose)
        robot.set_pose(0, 0)
        assert robot.pose().uncertainty < 0.001


@few_and_many(2, 6)
@with_each_counter
def test_a_restart_on_the_way_is_never_hidden_by_a_small_uncertainty(
    field: str, firmware: str, examples: int, tmp_path: Path
) -> None:
    wrong = []
    for seed in range(4, 4 + examples):
        rng = random.Random(seed)
        reset = f'kind = "reset"\nat = {rng.uniform(1, 6)}\n'
        with elib.connect(with_fault(tmp_path, reset, f"{field}&firmware={firmware}&seed={seed}")) as robot:
            try:
                for _ in range(6):
                    confirmed(robot, rng.uniform(-0.6, 0.6), rng.uniform(-0.6, 0.6))
                    robot.sleep(rng.uniform(0.3, 2))
                confirmed(robot, 0, 0)
            except LinkLost:
                continue  # the robot was away for too long: that is no wrong pose
            pose = robot.within(5, tries=5).pose()
            place, heading = off(robot, pose)
            if place > 1.5 * pose.uncertainty + 0.002 or heading > 1.5 * pose.heading_uncertainty + STEP:
                wrong.append((seed, place, heading, pose))
    assert len(wrong) <= examples // 20, wrong


@with_each_counter
def test_readings_on_the_way_do_not_add_up_to_an_uncertainty(field: str, firmware: str) -> None:
    with elib.connect(f"{field}&firmware={firmware}") as robot:
        pose = robot.pose()
        for _ in range(8):
            robot.drive(0.1)
            pose = robot.turn(math.pi / 2)
        place, heading = off(robot, pose)
        assert place < pose.uncertainty + 0.001 < 0.002
        assert heading <= 1.001 * STEP <= pose.heading_uncertainty < 1.6 * STEP


@pytest.mark.parametrize("is_done", [True, False])
def test_the_counters_tell_whether_an_unconfirmed_speed_was_taken(field: str, is_done: bool) -> None:
    async def main(robot: Epuck) -> None:
        await robot.set_speed(0.3, 0.3)
        await robot.sleep(1)
        link = link_of(robot)
        with pytest.MonkeyPatch.context() as patch:
            if is_done:
                link.lose_next_reply()
            else:
                patch.setattr(link, "_hand_to_robot", lambda time, data: None)
            with pytest.raises(ReplyTimeout):
                await robot.within(0.2).set_speed(0.3, -0.1)
        await robot.sleep(2)
        await robot.stop()
        await robot.sleep(0.1)
        pose = await robot.pose()
        simulation_of(robot).catch_up()
        true = world_of(robot).pose(0)
        assert math.dist((true.x - 20, true.y - 20), (pose.x, pose.y)) < 0.01
        assert pose.heading == pytest.approx(true.heading, abs=0.02)
        assert (abs(pose.heading) > 1) is is_done

    run_on(field, main)


def test_a_reconnecting_robot_knows_its_place_after_a_gap(field: str) -> None:
    with elib.reconnecting(with_faults("walks-out-of-range", field)) as robot:
        robot.set_speed(0.3, 0.25)
        robot.sleep(40)  # the link is gone from 25 to 35 s, and the robot drives on
        robot.within(20).stop()
        pose = robot.pose()
        place, heading = off(robot, pose)
        assert place < 0.01
        assert heading < math.radians(3)


# -- the reckoning alone -----------------------------------------------------------------------------------------------


def at(time: float, early: float = 0.0, late: float = 0.0) -> Moment:
    return Moment(time - early, time, time + late)


@pytest.mark.parametrize(("early", "late", "variance"), [(0, 0, 0), (0.3, 0.3, 0.03), (0, 0.6, 0.12), (0.6, 0, 0.12)])
def test_a_moment_is_as_unsure_as_the_time_in_which_it_may_lie_is_long(
    early: float, late: float, variance: float
) -> None:
    assert at(1.0, early, late).variance == pytest.approx(variance)


def begun() -> Reckoning:
    reckoning = Reckoning(Pose(0, 0), 0.0)
    reckoning.read((0, 0), at(0), 16, 0.0)
    return reckoning


@given(st.lists(st.floats(0.01, 5.0), min_size=1, max_size=8), st.integers(-800, 800), st.integers(-800, 800))
def test_a_robot_that_is_read_where_it_stands_is_where_it_was(pauses: list[float], left: int, right: int) -> None:
    reckoned, in_full = (Reckoning(Pose(1, 2, 0.5), 0) for _ in range(2))
    in_full._stands = lambda counters: False  # type: ignore[method-assign]  # as if each reading were a surprise
    time = 0.0
    for k, pause in enumerate([1.0, *pauses]):
        time += pause
        for each in (reckoned, in_full):
            if not k:
                each.change(Change(Moment(0.1, 0.1, 0.2), (float(left), float(right))))
                each.change(Change(Moment(1.1, 1.1, 1.2), (0.0, 0.0)))
            each.read((left, right), Moment(time + 0.3, time + 0.31, time + 0.33), 16, time + 0.33)
        assert (reckoned.left, reckoned.right) == (in_full.left, in_full.right)
        for name in ("x", "y", "heading", "uncertainty", "heading_uncertainty", "time"):
            assert getattr(reckoned.pose, name) == pytest.approx(getattr(in_full.pose, name), rel=1e-9, abs=1e-12), name


def test_a_change_that_came_late_is_moved_until_the_wheels_make_the_steps_that_were_counted() -> None:
    reckoning = begun()
    reckoning.change(Change(at(1.0), (500.0, 500.0)))
    reckoning.change(Change(at(3.0, 0, 0.4), (-250.0, 250.0)))  # it came 0.3 s later
    reckoning.change(Change(at(4.3), (0.0, 0.0)))
    reckoning.read((1150 - 250, 1150 + 250), at(5.0), 16, 5.0)
    assert reckoning.pose.x == pytest.approx(1150 * METRES_PER_STEP, abs=0.0002)
    assert reckoning.pose.y == pytest.approx(0.0, abs=0.0002)
    assert reckoning.pose.heading == pytest.approx(500 * METRES_PER_STEP / AXLE)
    assert reckoning.pose.uncertainty < 0.01
    assert (reckoning.left, reckoning.right) == (900, 1400)


@pytest.mark.parametrize(("bits", "seconds"), [(16, 33), (16, 3600), (31, 3600)])
def test_speed_and_time_settle_how_often_a_counter_wrapped(bits: int, seconds: int) -> None:
    reckoning = begun()
    reckoning.change(Change(at(0.0), (1000.0, 1000.0)))
    shown = (1000 * seconds + 2 ** (bits - 1)) % 2**bits - 2 ** (bits - 1)
    reckoning.read((shown, shown), at(seconds), bits, seconds)
    assert reckoning.left == 1000 * seconds


def test_what_speed_and_time_do_not_settle_is_stated() -> None:
    reckoning = begun()
    reckoning.change(Change(at(0.0), UNKNOWN))  # speeds that the firmware chooses itself
    reckoning.read((200, 200), at(100.0), 16, 100.0)
    assert reckoning.pose.uncertainty > 10
    assert reckoning.pose.heading_uncertainty == math.pi


@pytest.mark.parametrize("told", [(0.0, 0.0), (300.0, 300.0), UNKNOWN])
def test_what_something_else_drove_is_counted_and_its_path_is_uncertain(told: Pair) -> None:
    reckoning = begun()
    reckoning.change(Change(at(0.0), told))
    reckoning.read((800, 500), at(1.0), 16, 1.0)
    assert (reckoning.left, reckoning.right) == (800, 500)
    assert 0.05 < reckoning.pose.uncertainty < 0.2
    assert reckoning.pose.heading_uncertainty == pytest.approx(STEP)


def test_a_restart_that_the_counters_show_is_placed_between_the_readings() -> None:
    reckoning = begun()
    reckoning.change(Change(at(0.0), (500.0, 500.0)))
    reckoning.read((1000, 1000), at(2.0), 16, 2.0)
    reckoning.read((0, 0), at(6.0), 16, 6.0)
    assert reckoning.restarts == 1
    assert 0.12 < reckoning.pose.x < 0.39
    assert reckoning.pose.x - 1000 * METRES_PER_STEP < reckoning.pose.uncertainty


@pytest.mark.parametrize("readings", [1, 100])
def test_an_uncertain_heading_makes_the_way_behind_it_uncertain_however_often_it_is_read(readings: int) -> None:
    reckoning = begun()
    reckoning.change(Change(at(0.0), (-100.0, 100.0)))
    reckoning.change(Change(at(2.0, 1.0, 1.0), (0.0, 0.0), (0.0, 0.0)))
    reckoning.read((0, 0), at(4.0), 16, 4.0)
    turned = reckoning.pose.heading_uncertainty
    assert turned > 200 * STEP
    reckoning.change(Change(at(4.0), (500.0, 500.0)))
    for i in range(1, readings + 1):
        steps = 5000 * i // readings
        reckoning.read((steps, steps), at(4 + steps / 500), 16, 4 + steps / 500)
    assert reckoning.pose.heading_uncertainty == pytest.approx(turned)
    assert reckoning.pose.uncertainty == pytest.approx(5000 * METRES_PER_STEP * turned, rel=0.05)


def test_what_two_explanations_fit_stays_open_until_a_later_reading() -> None:
    reckoning = begun()
    reckoning.change(Change(at(1.0), (400.0, 400.0)))
    reckoning.change(Change(at(2.0, 0, 0.5), (400.0, -400.0), None, is_sure=False))
    reckoning.read((404, 398), at(2.005), 16, 2.005)
    reckoning.read((804, -2), at(3.005), 16, 3.005)
    assert (reckoning.left, reckoning.right) == (804, -2)
    assert reckoning.pose.heading_uncertainty < 0.1


def test_ten_thousand_changes_between_two_readings_need_no_more_room_than_a_thousand() -> None:
    reckoning, twin, rng = begun(), begun(), random.Random(1)
    left = right = 0.0
    for i in range(10_000):
        speeds = 300 + rng.uniform(-50, 50), 300 + rng.uniform(-50, 50)
        for each in (reckoning, twin):
            each.change(Change(at(i / 100), speeds))
        left, right = left + speeds[0] / 100, right + speeds[1] / 100
        twin.read((round(left) % 65536, round(right) % 65536), at((i + 1) / 100), 16, 0.0)
        assert len(reckoning._changes) <= MAX_CHANGES
    counters = ((round(left) + 32768) % 65536 - 32768, (round(right) + 32768) % 65536 - 32768)
    reckoning.read(counters, at(100.0), 16, 100.0)
    assert math.dist((reckoning.pose.x, reckoning.pose.y), (twin.pose.x, twin.pose.y)) < 0.02


# -- wheels that are not nominal ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("wheel", [0, 1, 2])
def test_the_stated_uncertainty_is_by_how_much_another_wheel_or_axle_leads_elsewhere(
    wheel: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The path of a robot whose left wheel, right wheel or axle is a thousandth larger, beside what is stated."""
    drawn = random.Random(f"wheels {wheel}")
    part = 0.001
    monkeypatch.setattr(Reckoning, "spreads", tuple(part * (k == wheel) for k in range(3)))
    reckoning, time, steps, true = begun(), 0.0, [0, 0], Pose(0, 0)
    for _ in range(20):
        rates, seconds = (drawn.randint(-800, 800), drawn.randint(-800, 800)), drawn.randint(1, 5)
        reckoning.change(Change(at(time), (float(rates[0]), float(rates[1]))))
        time += seconds
        steps = [count + rate * seconds for count, rate in zip(steps, rates, strict=True)]
        reckoning.read(tuple((each + 32768) % 65536 - 32768 for each in steps), at(time), 16, time)
        left, right = (rate * seconds * (1 + part * (k == wheel)) for k, rate in enumerate(rates))
        mean, half = (left + right) / 2, (right - left) / 2 / (1 + part * (wheel == 2))
        true = advanced(true, mean - half, mean + half)
    pose = reckoning.pose
    place, heading = (
        math.dist((true.x, true.y), (pose.x, pose.y)),
        math.remainder(true.heading - pose.heading, math.tau),
    )
    assert pose.uncertainty == pytest.approx(2 * place, rel=0.1, abs=0.001)
    assert pose.heading_uncertainty == pytest.approx(2 * abs(heading), rel=0.05, abs=2 * STEP)


@few_and_many(4, 12)
def test_typical_robots_are_where_their_poses_say_19_times_in_20(
    field: str, examples: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Reckoning, "spreads", REAL)
    drawn, wrong = random.Random("typical"), []
    for k in range(examples):
        keys = f"&firmware={drawn.choice(list(PROFILES))}&seed={drawn.getrandbits(30)}"
        with elib.connect(field.replace("ideal", "typical") + keys) as robot:
            for _ in range(8):
                robot.drive(drawn.uniform(0.05, 0.5))
                robot.turn(drawn.uniform(-3, 3))
            pose = robot.pose()
            place, heading = off(robot, pose)
            if place > pose.uncertainty or heading > pose.heading_uncertainty:
                wrong.append((k, place, heading, pose))
            assert pose.uncertainty < 1.5
    assert len(wrong) <= 1 + examples // 20, wrong
