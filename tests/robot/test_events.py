"""``robot.events``: what happens on the link without a call."""

import asyncio

import pytest

import elib
from elib.base.errors import ArgumentError, LinkError, ReplyTimeout
from elib.robot.events import CAPACITY, Events, LateAnswer, LinkBack, LinkDown, RobotEvent, UnexpectedReset
from elib.testing import link_of, simulated
from shared import GREETING, inside


def url(**keys: object) -> str:
    return "sim://square?speed=max" + "".join(f"&{key}={value}" for key, value in keys.items())


async def happened(robot: elib.Epuck) -> list[RobotEvent]:
    return [event async for event in robot.events.within(0)]


@inside(elib.open, url())
async def test_a_robot_that_restarts_is_noted_and_one_told_to_is_not(robot: elib.Epuck) -> None:
    assert robot.events.recent == ()
    await robot.reset()
    assert await happened(robot) == []
    before = robot.time
    link_of(robot).inject_noise(GREETING)
    await robot.sleep(1)
    (event,) = await happened(robot)
    assert isinstance(event, UnexpectedReset)
    assert before <= event.time < robot.time


@inside(elib.open, url())
async def test_an_answer_that_comes_late_is_noted_with_its_call(robot: elib.Epuck) -> None:
    assert robot.events.dropped == 0
    link_of(robot).delay_next_reply(0.5)
    with pytest.raises(ReplyTimeout):
        await robot.within(0.1).proximity()
    await robot.sleep(1)
    await robot.selector()
    (event,) = await happened(robot)
    assert isinstance(event, LateAnswer)
    assert event.request == "proximity()"
    assert event.dropped > 10


@inside(elib.open, url())
async def test_an_answer_that_comes_during_the_resync_is_noted_without_the_probes_own(robot: elib.Epuck) -> None:
    assert robot.events.recent == ()
    link_of(robot).delay_next_reply(0.3)
    with pytest.raises(ReplyTimeout):
        await robot.within(0.1).speed()
    await robot.selector()  # at once: the late answer comes between the probe and its answer
    (event,) = await happened(robot)
    assert isinstance(event, LateAnswer)
    assert event.dropped == len("e,0,0")


@inside(elib.open, url())
async def test_an_answer_that_never_comes_is_not_late(robot: elib.Epuck) -> None:
    assert robot.events.recent == ()
    link_of(robot).lose_next_reply()
    with pytest.raises(ReplyTimeout):
        await robot.within(0.1).proximity()
    await robot.selector()
    assert robot.statistics.resyncs == 1
    assert await happened(robot) == []


@inside(elib.open, url())
async def test_a_cancelled_call_whose_successor_is_answered_leaves_no_late_answer(robot: elib.Epuck) -> None:
    assert robot.events.recent == ()
    first = asyncio.create_task(robot.proximity())
    older = asyncio.create_task(robot.set_speed(0.1, 0.1))
    newer = asyncio.create_task(robot.set_speed(0.2, 0.2))
    await first
    older.cancel()
    await newer
    await robot.speed()
    assert await happened(robot) == []


@inside(elib.open, url())
async def test_a_lost_link_is_the_last_event(robot: elib.Epuck) -> None:
    events = robot.events

    async def read() -> list[RobotEvent]:
        return [event async for event in events]

    reading = asyncio.create_task(read())
    await robot.selector()
    link_of(robot).cut()
    await robot.sleep(0.1)
    with pytest.raises(LinkError):
        await robot.selector()
    (event,) = await reading
    assert isinstance(event, LinkDown)
    assert isinstance(event.error, LinkError)


@simulated
async def test_closing_the_robot_ends_an_iteration_quietly() -> None:
    async with elib.open(url()) as robot:
        events = robot.events

        async def count() -> int:
            return len([event async for event in events])

        counting = asyncio.create_task(count())
        await robot.sleep(1)
    assert await counting == 0


@inside(elib.reconnecting, url())
async def test_a_reconnecting_robot_tells_of_the_gap_and_goes_on(robot: elib.Epuck) -> None:
    assert robot.events.recent == ()
    await robot.selector()
    link_of(robot).cut()
    await robot.within(10).selector()
    down, back = await happened(robot)
    assert isinstance(down, LinkDown)
    assert isinstance(back, LinkBack)
    assert back.attempts >= 1
    assert back.time - down.time == pytest.approx(back.gap)


@simulated
async def test_an_iteration_begins_with_what_is_kept_and_any_number_go_on() -> None:
    events = Events()
    for time in range(3):
        events.add(UnexpectedReset(time=float(time)))
    first, second = aiter(events), aiter(events)
    assert [(await anext(first)).time for _ in range(3)] == [0, 1, 2]
    assert (await anext(second)).time == 0
    events.close()
    assert [event.time async for event in second] == [1, 2]
    with pytest.raises(StopAsyncIteration):
        await anext(first)


@simulated
async def test_old_events_are_dropped_and_counted() -> None:
    events = Events()
    slow = events.within(0)
    events.add(UnexpectedReset(time=-1.0))
    assert (await anext(slow)).time == -1
    for time in range(CAPACITY + 9):
        events.add(UnexpectedReset(time=float(time)))
    assert len(events.recent) == CAPACITY
    assert events.dropped == 10
    assert (await anext(slow)).time == 9
    assert slow.dropped == 9  # type: ignore[attr-defined]
    assert len([event async for event in slow]) == CAPACITY - 1


@simulated
async def test_waiting_for_an_event_ends_after_a_time_if_one_is_given() -> None:
    events = Events()
    loop = asyncio.get_running_loop()
    assert [event async for event in events.within(2.5)] == []
    assert loop.time() == 2.5
    with pytest.raises(ArgumentError, match="a number from 0 to 3600 s"):
        events.within(float("inf"))


def test_a_blocking_program_reads_events_with_a_bound() -> None:
    with elib.connect(url()) as robot:
        assert robot.events.recent == ()
        link_of(robot._robot).inject_noise(GREETING)
        (event,) = robot.events.within(5)
        assert isinstance(event, UnexpectedReset)
        assert robot.events.recent == (event,)
        assert robot.events.dropped == 0
        for again in robot.events:
            assert again is event
            break


def test_an_iteration_of_blocking_code_ends_after_what_has_happened_when_its_robot_is_closed() -> None:
    robot = elib.connect(url())
    notes = [RobotEvent(time=time) for time in (1.0, 2.0, 3.0)]
    iteration = iter(robot.events)
    for note in notes:
        robot.events.add(note)
    assert next(iteration) is notes[0]
    robot.close()
    assert list(iteration) == notes[1:]
    assert list(robot.events) == notes
