"""Leaving and stopping a robot: whether its wheels stand, how soon, and whether the messages about it are true."""

import asyncio
import logging
import math
import os
import random
from collections.abc import Callable, Coroutine
from itertools import product

import pytest

import elib
from elib.base.errors import ElibError, LinkLost, ReplyTimeout
from elib.link.protocol.profiles import PROFILES
from elib.robot.polling import polls, sensor_polls
from elib.simulator.emulator.simulation import VirtualRobot
from elib.testing import simulated
from elib.testing.inside import transport_of
from lanes import short
from shared import inside

FIRMWARES = sorted(PROFILES)
LATENCIES = (0.0, 0.02, 0.1, 0.25)
"""s each way."""
STANDING_TIME = 0.35
"""s, and the way to the robot, after which its wheels stand when it was told to stop."""
DRAWS = int(os.environ.get("ELIB_DRAWS", "1"))
"""Moments that the long form tries for each link; set ELIB_DRAWS for more of them."""
CHATTER = b"\x1b[0m~ who is there? \xf3\x00"


def virtual(robot: elib.Epuck) -> VirtualRobot:
    return transport_of(robot).robot


def is_driving(robot: VirtualRobot) -> bool:
    return any(motor.speed for motor in robot.emulator.firmware.motors)


def url(firmware: str, latency: float = 0.0, **keys: object) -> str:
    more = "".join(f"&{key}={value}" for key, value in keys.items())
    return f"sim://square?speed=max&firmware={firmware}&latency={latency}{more}"


async def until_it_stands(robot: VirtualRobot) -> float:
    """Return when the wheels stand, s on the loop's clock; give up after 20 s."""
    clock = asyncio.get_running_loop().time
    end = clock() + 20
    while is_driving(robot) and clock() < end:  # noqa: ASYNC110  # motors tell nobody that they stand
        await asyncio.sleep(0.001)  # clock: simulated
    return clock()


async def make_noise(robot: VirtualRobot, chance: random.Random) -> None:
    while True:
        robot.link.inject_noise(CHATTER[: chance.randint(1, len(CHATTER))] + b"\r\n" * chance.randint(0, 1))
        await asyncio.sleep(chance.uniform(0.005, 0.1))  # clock: simulated


async def drive_and_look(robot: elib.Epuck) -> None:
    while True:
        try:
            await robot.within(0.5).set_speed(0.3, 0.2)
            await robot.within(0.3).proximity()
        except ElibError:
            await asyncio.sleep(0.05)  # clock: simulated


async def go_far(robot: elib.Epuck) -> None:
    await robot.drive(5.0)


@simulated
async def time_to_stand(
    firmware: str,
    trouble: str,
    program: Callable[[elib.Epuck], Coroutine[object, object, None]],
    latency: float,
    chance: random.Random,
) -> float:
    """Drive, leave the robot, and return after how long its wheels stood, without the way to the robot, s."""
    robot = elib.open(url(firmware, latency))
    await robot
    there = virtual(robot)
    driver = asyncio.ensure_future(program(robot))
    await asyncio.sleep(1 + chance.random())
    noise = asyncio.ensure_future(make_noise(there, chance) if trouble == "noise" else asyncio.sleep(0))
    if trouble == "answers lost":
        there.link.silence()
    await asyncio.sleep(2 * chance.random())
    if robot.session.error is not None:
        return 0.0  # given up before: the stop went out then
    began = asyncio.get_running_loop().time()
    driver.cancel()

    async def leave() -> None:
        await asyncio.wait([driver])  # as at the end of a block
        await robot.close()

    leaving = asyncio.ensure_future(leave())
    stood = await until_it_stands(there)
    assert not is_driving(there)
    await leaving
    noise.cancel()
    return stood - began - latency


TROUBLES = ("none", "answers lost", "noise")
DRIVERS = (drive_and_look, go_far)


@pytest.mark.parametrize("index", range(len(FIRMWARES)), ids=FIRMWARES)
def test_a_stop_reaches_the_robot_in_time_whatever_the_answers_are_like(index: int) -> None:
    for turn, latency in enumerate(LATENCIES):  # each firmware, trouble, program and latency meets each of the others
        trouble, program = TROUBLES[(index + turn) % 3], DRIVERS[(index // 2 + turn) % 2]
        took = time_to_stand(FIRMWARES[index], trouble, program, latency, random.Random(index))
        assert took <= STANDING_TIME, (trouble, program.__name__, latency)


@pytest.mark.long
@pytest.mark.parametrize("trouble", TROUBLES)
@pytest.mark.parametrize("firmware", FIRMWARES)
def test_a_stop_reaches_the_robot_in_time_in_every_combination(firmware: str, trouble: str) -> None:
    chance = random.Random(f"{firmware} {trouble}")
    for program, latency, _ in product(DRIVERS, LATENCIES, range(DRAWS)):
        assert time_to_stand(firmware, trouble, program, latency, chance) <= STANDING_TIME, (program.__name__, latency)


@pytest.mark.parametrize("latency", [0.3, 0.45])
@pytest.mark.parametrize("firmware", FIRMWARES)
@simulated
async def test_a_slow_line_is_not_said_to_have_left_the_stop_unconfirmed(
    firmware: str, latency: float, caplog: pytest.LogCaptureFixture
) -> None:
    async with elib.open(url(firmware, latency)) as robot:
        await robot.within(3).set_speed(0.2, 0.2)
        looking = asyncio.ensure_future(robot.within(5).proximity())
        await asyncio.sleep(0.1)
        there = virtual(robot)
    assert not is_driving(there)
    await asyncio.gather(looking, return_exceptions=True)
    assert caplog.text == ""


@pytest.mark.parametrize("firmware", FIRMWARES)
@simulated
async def test_a_stop_that_is_not_confirmed_on_leaving_is_said(firmware: str, caplog: pytest.LogCaptureFixture) -> None:
    async with elib.open(url(firmware), name="walle") as robot:
        await robot.set_speed(0.2, 0.2)
        there = virtual(robot)
        there.link.silence()
    assert not is_driving(there)
    assert [record.levelno for record in caplog.records] == [logging.WARNING]
    assert "walle did not confirm that it stands: it may still be moving" in caplog.text


@simulated
async def test_leaving_a_robot_whose_link_was_lost_says_that_it_may_be_moving(caplog: pytest.LogCaptureFixture) -> None:
    async with elib.open(url("btcom-2.0")) as robot:
        await robot.set_speed(0.2, 0.2)
        virtual(robot).link.cut()
        with pytest.raises(LinkLost):
            await robot.proximity()
    await robot.close()
    assert caplog.text.count("it may still be moving") == 1


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_a_program_that_closes_a_robot_can_ask_why_it_did_not_confirm_its_stop(
    firmware: str, caplog: pytest.LogCaptureFixture
) -> None:
    @simulated
    async def story(is_silent: bool) -> ElibError | None:
        robot = await elib.open(url(firmware))
        await robot.set_speed(0.2, 0.2)
        if is_silent:
            virtual(robot).link.silence()
        error = await robot.stop_and_close()
        assert await robot.stop_and_close() is None
        return error

    def blocking(is_silent: bool) -> ElibError | None:
        robot = elib.connect(url(firmware))
        robot.set_speed(0.2, 0.2)
        if is_silent:
            virtual(robot.robot).link.silence()
        error = robot.stop_and_close()
        assert robot.stop_and_close() is None
        assert "closed" in repr(robot)
        return error

    for ended in (story, blocking):
        assert isinstance(ended(True), ReplyTimeout)
        assert ended(False) is None
    assert caplog.text == ""


def test_a_program_whose_own_stop_failed_is_not_told_twice(caplog: pytest.LogCaptureFixture) -> None:
    with elib.connect(url("btcom-2.0")) as robot:
        robot.set_speed(0.2, 0.2)
        virtual(robot.robot).link.silence()
        with pytest.raises(ReplyTimeout):
            robot.stop()
    assert caplog.text == ""


def test_leaving_a_robot_that_confirms_its_stop_says_nothing(caplog: pytest.LogCaptureFixture) -> None:
    with elib.connect(url("btcom-2.0")) as robot:
        robot.set_speed(0.2, 0.2)
    with elib.connect(url("btcom-2.0"), keep_moving=True) as robot:
        robot.set_speed(0.2, 0.2)
    assert caplog.text == ""


def test_one_answer_that_was_held_up_for_long_does_not_make_leaving_a_silent_robot_long() -> None:
    with elib.connect(url("btcom-2.0")) as robot:
        virtual(robot.robot).link.delay_next_reply(30)
        robot.within(60).proximity()
        virtual(robot.robot).link.silence()
        began = robot.time
    assert robot.time - began < 5


def test_one_answer_that_was_held_up_for_long_does_not_hide_that_the_robot_is_gone() -> None:
    with elib.connect(url("btcom-2.0")) as robot:
        virtual(robot.robot).link.delay_next_reply(30)
        robot.within(60).proximity()
        virtual(robot.robot).link.silence()
        began = robot.time
        with pytest.raises(ReplyTimeout):
            robot.proximity()
        with pytest.raises(LinkLost):
            robot.within(60).proximity()
        assert robot.time - began < 20


@simulated
async def test_where_the_last_stop_is_lost_on_its_way_a_second_one_is_sent_without_waiting_for_an_answer() -> None:
    robot = elib.open(url("asercom-1.2.2"))
    await robot
    there = virtual(robot)
    await robot.set_speed(0.3, 0.3)
    line = robot.session._line  # type: ignore[attr-defined]
    send, lost = line.send_nowait, []

    def lose_the_first(data: bytes) -> bool:
        if data.endswith(b"S\r") and not lost:
            lost.append(data)
            return True
        return bool(send(data))

    line.send_nowait = lose_the_first
    await robot.close()
    assert lost
    await until_it_stands(there)
    assert not is_driving(there)


@inside(elib.open, url("btcom-2.0", 0.02))
async def test_a_stop_that_was_garbled_on_its_way_is_sent_again_until_it_is_confirmed(robot: elib.Epuck) -> None:
    await robot.set_speed(0.3, 0.3)
    line = robot.session._line  # type: ignore[attr-defined]
    send, garbled = line.send_nowait, []

    def garble_the_first(data: bytes) -> bool:
        if data.endswith(b"S\r") and not garbled:
            garbled.append(data)
            data = data.replace(b"S", b"\x7f")
        return bool(send(data))

    line.send_nowait = garble_the_first
    await robot.stop()
    assert garbled
    assert not is_driving(virtual(robot))


# -- asking again ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("firmware", FIRMWARES)
@simulated
async def test_a_reading_whose_answer_is_lost_is_asked_again_within_its_time(firmware: str) -> None:
    async with elib.open(url(firmware, 0.01)) as robot:
        for name in ("proximity", "selector", "version", "encoders"):
            virtual(robot).link.lose_next_reply()
            began = robot.time
            assert await getattr(robot.within(3, tries=3), name)() is not None
            assert 1 < robot.time - began < 1.6


@pytest.mark.parametrize("firmware", FIRMWARES)
@simulated
async def test_a_lost_answer_of_several_readings_or_of_a_part_of_them_is_asked_for_again(firmware: str) -> None:
    async with elib.open(url(firmware, 0.01)) as robot:
        for poll in (*sensor_polls(robot.context), *polls(["proximity"], robot.context)):
            virtual(robot).link.lose_next_reply()
            answer = await robot.within(6, tries=3).execute(poll.request, 1.0)
            assert poll.readings(answer).keys() >= {*poll.names}


@pytest.mark.parametrize("firmware", [*FIRMWARES, "epuck2-wifi"])
@simulated
async def test_a_view_for_quick_commands_gives_them_its_time_and_motions_their_own_on_every_link(firmware: str) -> None:
    async with elib.open(f"sim://square?speed=max&firmware={firmware}&latency=0.01") as robot:
        view = robot.within(0.3, quick_only=True)
        before = await robot.pose()
        after = await view.drive(0.05)
        assert math.dist((before.x, before.y), (after.x, after.y)) == pytest.approx(0.05, abs=0.002)
        virtual(robot).link.silence()
        for ask in (view.proximity, view.distances, view.encoders):
            began = robot.time
            with pytest.raises(ReplyTimeout, match=r"within 0\.3 s"):
                await ask()
            assert robot.time - began == pytest.approx(0.3)


@inside(elib.open, url("btcom-2.0"))
async def test_a_reading_never_answered_ends_at_its_deadline_and_says_how_often_it_was_tried(
    robot: elib.Epuck,
) -> None:
    virtual(robot).link.silence()
    began = robot.time
    with pytest.raises(ReplyTimeout, match=r"proximity\(\) did not end within 1.5 s, though it was tried 3 times"):
        await robot.within(1.5, tries=3).proximity()
    assert robot.time - began == pytest.approx(1.5)


@simulated
async def test_a_call_that_acts_is_never_sent_twice() -> None:
    sent: list[bytes] = []
    async with elib.open(url("btcom-2.0")) as robot:
        robot.trace(lambda _, event: sent.append(getattr(event, "data", b"")))
        calls = (lambda r: r.set_led(1, elib.LedAction.TOGGLE), lambda r: r.set_speed(0.1, 0.1), lambda r: r.text("N"))
        for call in calls:
            virtual(robot).link.lose_next_reply()
            sent.clear()
            with pytest.raises(ReplyTimeout):
                await call(robot.within(1.5, tries=3))
            assert len([data for data in sent if data]) == 1
            await robot.speed()


def test_the_blocking_styles_ask_again_too() -> None:
    with elib.connect(url("btcom-2.0")) as robot:
        there = virtual(robot.robot)
        there.link.lose_next_reply()
        assert robot.within(2, tries=2).selector() is not None
        there.link.lose_next_reply()
        assert robot.begin.within(2, tries=2).selector().end() is not None
        there.link.lose_next_reply()
        assert robot.within(2, tries=2).sensors().selector is not None


UNDER_WAY: list[tuple[str, tuple[object, ...]]] = [
    ("encoders", ()),
    ("proximity", ()),
    ("ambient_light", ()),
    ("version", ()),
    ("camera", ()),
    ("microphones", ()),
    ("help_text", ()),
    ("image", ()),
    ("sensors", ()),
    ("pose", ()),
    ("stop", ()),
    ("calibrate_proximity", ()),
    ("text", ("V",)),
    ("set_speed", (0.2, -0.2)),
    ("set_encoders", (5, 6)),
    ("set_body_led", (1,)),
    ("set_camera", (20, 20, 8, "grey")),
]


@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize("draws", short([40, 400], 40))
def test_leaving_at_any_moment_of_any_call_on_a_clean_link_gives_no_false_alarm(firmware: str, draws: int) -> None:
    @simulated
    async def story(draw: random.Random) -> None:
        (name, args), latency = draw.choice(UNDER_WAY), draw.choice([0.0, 0.0, 0.005, 0.03, 0.08])
        moment = 2 * latency * draw.random() + draw.choice(
            [draw.uniform(0, 0.004), draw.uniform(0, 0.02), draw.random()]
        )
        robot = await elib.open(url(firmware, latency))
        await robot.set_speed(0.2, -0.2)
        calls = [asyncio.ensure_future(getattr(robot.within(8), name)(*args)) for _ in range(draw.choice([1, 1, 2]))]
        await asyncio.sleep(moment)
        if draw.random() < 0.8:
            for call in calls:
                call.cancel()
        there = virtual(robot)
        unconfirmed = await robot.stop_and_close()
        await asyncio.gather(*calls, return_exceptions=True)
        assert unconfirmed is None, f"{moment:.5f} s after {name}{args}, {latency} s each way: {unconfirmed}"
        assert not is_driving(there)

    for seed in range(draws):
        story(random.Random(f"{firmware} {seed}"))


@pytest.mark.parametrize("firmware", FIRMWARES)
@simulated
async def test_a_reading_that_is_cancelled_delays_the_next_call_by_no_lost_question(firmware: str) -> None:
    async with elib.open(url(firmware)) as robot:
        for row in ("encoders", "proximity", "version", "help_text"):
            reading = asyncio.ensure_future(getattr(robot, row)())
            await asyncio.sleep(0.0005)
            reading.cancel()
            began = robot.time
            await robot.selector()
            assert robot.time - began < 0.3  # a question that is lost costs half a second


@pytest.mark.parametrize("tries", [0, -1, 1.5, True, 101, "3"])
def test_an_impossible_number_of_tries_is_refused(tries: int) -> None:
    with pytest.raises(elib.ArgumentError, match="tries is"):
        elib.open(url("btcom-2.0")).within(1, tries=tries)
