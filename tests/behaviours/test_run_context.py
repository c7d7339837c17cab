"""The context of a run: names for states, messages, random numbers and the end; and runs in every style."""

from __future__ import annotations

import asyncio
import threading
from dataclasses import replace

import pytest

from elib.base.errors import ArgumentError, LinkError, ReplyTimeout
from elib.behaviours import Behaviour, RunContext, StateChanged, behaviour, find, play, react, run_behaviour
from elib.behaviours._run.loop import MAX_TIMEOUT, MIN_TIMEOUT, ROUND_TRIPS, AdaptiveTimeout
from elib.link.protocol.quantities import WheelSpeed
from elib.link.transport import Transport
from elib.robot.aio import Epuck
from elib.robot.blocking import BlockingEpuck
from elib.robot.runner import run_on
from elib.robot.swarms.swarm import Swarm
from elib.testing.inside import transport_of

SIM = "sim://square?speed=max"


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def made(loop: object, **changes: object) -> Behaviour:
    return replace(behaviour(loop), **changes)  # type: ignore[arg-type]


async def spin(robot: Epuck, run: RunContext, *, speed: WheelSpeed = 0.5) -> None:
    """Spin for ever."""
    run.state("spinning")
    await robot.set_speed(speed, -speed)
    await robot.sleep(3600)


def test_a_state_entered_twice_in_a_row_is_one_change_with_its_time() -> None:
    clock = Clock()
    run = RunContext(clock)
    run.state("searching")
    clock.now += 2
    run.state("searching")
    run.state("charging")
    assert run.states == ((0.0, "searching"), (2.0, "charging"))
    assert run.current_state == "charging"


def test_a_run_is_over_when_its_time_is_and_says_why() -> None:
    clock = Clock()
    run = RunContext(clock, seconds=5)
    assert not run.is_over
    assert run.time_left == 5
    clock.now += 5
    assert run.is_over
    assert run.reason == "time"
    assert run.time_left == 0


def test_the_first_reason_to_end_counts() -> None:
    run = RunContext(Clock())
    called: list[int] = []
    run.finish("enter")
    run.finish("time")
    run.on_finish(lambda: called.append(1))
    assert run.reason == "enter"
    assert called == [1]


def test_random_numbers_are_the_same_for_the_same_seed() -> None:
    assert RunContext(Clock(), seed=3).random.random() == RunContext(Clock(), seed=3).random.random()
    assert RunContext(Clock(), seed=3).random.random() != RunContext(Clock(), seed=4).random.random()


def test_a_behaviour_without_a_robot_to_run_on_is_refused() -> None:
    async def lost(wheel: int) -> None: ...

    with pytest.raises(TypeError, match="first parameter must be annotated as one of Epuck, BlockingEpuck, Swarm"):
        behaviour(lost)


def test_a_blocking_behaviour_is_a_plain_function_and_an_async_one_is_not() -> None:
    async def wrong(robot: BlockingEpuck) -> None: ...

    def wrong_too(robot: Epuck) -> None: ...

    with pytest.raises(TypeError, match="on BlockingEpuck must be a plain function"):
        behaviour(wrong)
    with pytest.raises(TypeError, match="on Epuck must be a coroutine function"):
        behaviour(wrong_too)


def test_states_are_events_of_the_robot_and_are_in_the_result() -> None:
    async def main(robot: Epuck) -> None:
        outcome = await run_behaviour(made(spin), robot, seconds=2)
        assert [name for _, name in outcome.states] == ["spinning"]
        assert outcome.reason == "time"
        assert [event.state for event in robot.events.recent if isinstance(event, StateChanged)] == ["spinning"]

    run_on(SIM, main)


def test_a_call_of_finish_from_another_thread_ends_a_run_at_once() -> None:
    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        threading.Timer(0.1, run.finish, ["enter"]).start()

    outcome = play(made(spin), "sim://square?speed=100", watch=watch)
    assert outcome.reason == "enter"
    assert outcome.was_limited


def test_a_blocking_behaviour_runs_until_its_time_is_over_and_the_robot_stands() -> None:
    told: list[tuple[int, int]] = []

    def roll(robot: BlockingEpuck, run: RunContext) -> None:
        """Roll."""
        run.state("rolling")
        robot.set_speed(0.2, 0.2)
        while not run.is_over:
            robot.sleep(0.5)
        told.append(robot.encoders().numbers)  # type: ignore[arg-type]

    outcome = play(made(roll), SIM, seconds=3)
    assert outcome.reason == "time"
    assert outcome.duration == pytest.approx(3, abs=0.5)
    assert outcome.states[0][1] == "rolling"
    assert told[0][0] > 500


def test_a_blocking_behaviour_that_returns_is_done() -> None:
    def blink(robot: BlockingEpuck) -> None:
        """Blink."""
        robot.set_led(8, 1)

    outcome = play(made(blink), SIM, seconds=3)
    assert (outcome.reason, outcome.was_limited) == ("done", False)


def test_a_swarm_runs_as_one_and_its_counts_add_up() -> None:
    async def roll(robots: Swarm, run: RunContext) -> None:
        """Roll."""
        run.say(f"{len(robots)} robots")
        await robots.all.set_speed(0.1, 0.1)

    outcome = play(made(roll, world="crowd?robots=4&speed=max"))
    assert outcome.messages == ("4 robots",)
    assert outcome.statistics is not None
    assert outcome.statistics.count == 4


def test_a_behaviour_on_raw_bytes_runs_without_a_session_and_the_robot_is_stopped_at_the_end() -> None:
    seen: list[str] = []

    async def shout(line: Transport, run: RunContext) -> None:
        """Shout."""
        await line.write(b"d,100,100\r")
        seen.append(line.origin)

    outcome = play(made(shout), SIM)
    assert seen == ["simulator"]
    assert outcome.statistics is None


def test_a_link_that_dies_tells_that_the_robot_may_still_be_moving() -> None:
    async def main(robot: Epuck) -> None:
        async def drive(robot: Epuck) -> None:
            """Drive."""
            await robot.set_speed(0.5, 0.5)
            await robot.session.transport.close()
            await robot.proximity()

        with pytest.raises(LinkError, match="may still be moving"):
            await run_behaviour(made(drive), robot)

    run_on(SIM, main)


def test_a_run_that_is_cancelled_says_that_a_silent_robot_may_still_be_moving(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def main(robot: Epuck) -> None:
        async def drive(robot: Epuck) -> None:
            """Drive."""
            await robot.set_speed(0.5, 0.5)
            transport_of(robot).robot.link.silence()
            await asyncio.sleep(100)  # clock: simulated

        running = asyncio.ensure_future(run_behaviour(made(drive), robot))
        await asyncio.sleep(0.5)  # clock: simulated
        running.cancel()
        with pytest.raises(asyncio.CancelledError):
            await running

    run_on(SIM, main)
    assert caplog.text.count("did not confirm that it stands: it may still be moving") == 1


def test_reacting_stands_still_after_a_lost_answer_and_goes_on() -> None:
    speeds: list[tuple[float, float]] = []
    counts = [0]

    async def main(robot: Epuck) -> None:
        async def step(view: Epuck) -> None:
            counts[0] += 1
            if counts[0] == 3:
                raise ReplyTimeout("lost")
            await view.set_speed(0.1, 0.1)

        async def loop(robot: Epuck) -> None:
            """Go."""
            robot.trace(lambda _, event: speeds.append(event.request.numbers) if hasattr(event, "value") else None)
            await react(robot, step)

        await run_behaviour(made(loop), robot, seconds=2)

    run_on(SIM, main)
    assert (0, 0) in speeds
    assert counts[0] > 10


def test_reacting_goes_on_over_a_link_slower_than_its_timeout() -> None:
    outcome = play(find("avoid"), "sim://arena?speed=max&latency=0.2", seconds=60)
    assert outcome.statistics is not None
    assert outcome.statistics.count > 60


def test_a_defect_in_a_behaviour_is_shown_as_it_is_and_the_robot_stands() -> None:
    def wrong(robot: BlockingEpuck) -> None:
        """Go wrong."""
        robot.set_speed(0.1, 7.0)

    async def wrong_too(robot: Epuck) -> None:
        """Go wrong."""
        await robot.set_speed(0.1, 7.0)

    for loop in (wrong, wrong_too):
        with pytest.raises(ArgumentError, match=r"right is 7.0 rev/s"):
            play(made(loop), SIM)


def test_the_timeout_fits_the_link_and_grows_only_with_answers_lost_in_a_row() -> None:
    timeout = AdaptiveTimeout()
    assert timeout.seconds == MIN_TIMEOUT
    timeout.answered(0.4)
    assert timeout.seconds == pytest.approx(ROUND_TRIPS * 0.4)
    timeout.answered(0.01)
    for _ in range(50):  # one in two is lost, for ever
        timeout.missed()
        assert timeout.seconds == pytest.approx(2 * MIN_TIMEOUT)
        timeout.answered(0.01)
    for _ in range(10_000):
        timeout.missed()
    assert timeout.seconds == MAX_TIMEOUT


def test_a_lost_answer_is_not_taken_for_the_end_of_the_time_and_leaves_the_robot_standing() -> None:
    async def main(robot: Epuck) -> None:
        async def hasty(robot: Epuck) -> None:
            """Drive, and give up at once."""
            await robot.set_speed(0.5, 0.5)
            await robot.within(0).proximity()

        with pytest.raises(ReplyTimeout):
            await run_behaviour(made(hasty), robot, seconds=60)
        before = await robot.encoders()
        await robot.sleep(1)
        assert await robot.encoders() == before

    run_on(SIM, main)


def test_a_run_is_over_after_an_error_so_that_no_callback_drives_on() -> None:
    runs: list[RunContext] = []

    def wrong(robot: BlockingEpuck, run: RunContext) -> None:
        """Go wrong."""
        runs.append(run)
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        play(made(wrong), SIM)
    assert runs[0].is_over
    assert runs[0].reason == "error"
