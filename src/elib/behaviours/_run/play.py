"""Run a behaviour: on a robot that is open, or by URL; the robot is stopped at the end, whatever ended it."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import cast

from elib.base.errors import ArgumentError, ElibError, LinkError, LinkLost
from elib.base.rules import DURATION
from elib.behaviours._run.behaviour import Behaviour, BehaviourStyle, find
from elib.behaviours._run.context import DEFAULT_SEED, RunContext
from elib.link.session.statistics import LinkStats, merged
from elib.link.transport import Transport, open_transport, parse_url, speed_of
from elib.robot.aio import Epuck
from elib.robot.blocking import BlockingEpuck, connect_robot
from elib.robot.link import Link, LinkSettings
from elib.robot.reconnect import Policy
from elib.robot.running import run_coroutine
from elib.robot.substitute import choose_robot, choose_robots
from elib.robot.swarms.swarm import Swarm

log = logging.getLogger("elib")

STOPPING_TIME = 7.5
"""s that the robot has to confirm its stop at a behaviour's end. ``stop()`` sends it again meanwhile, because an answer
may be lost, and there is time for a resync of three probes before."""
STOP_COMMAND = b"D,0,0\r"
"""The bytes that are sent over a raw line at the end; every firmware understands them."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """How the run of a behaviour went.

    Attributes:
        duration: Robot time that it took, s.
        was_limited: The run was ended from outside: its time was over, or the user ended it.
        statistics: LinkStats of the link since the robot was opened, of all robots together; None for a raw line.
        reason: Why the run ended: ``done`` by itself, ``time``, ``enter``, or the word given to ``run.finish``.
        states: When each state was entered, s since the run began, and its name.
        messages: What the behaviour told the user.
    """

    duration: float
    was_limited: bool
    statistics: LinkStats | None
    reason: str = "done"
    states: tuple[tuple[float, str], ...] = ()
    messages: tuple[str, ...] = ()


def play(
    what: Behaviour,
    url: str | None = None,
    *,
    seconds: float | None = None,
    options: Mapping[str, object] | None = None,
    seed: int = DEFAULT_SEED,
    watch: Callable[[RunContext, tuple[Epuck, ...]], object] | None = None,
    watchdog: bool | None = None,
) -> RunResult:
    """Open the robot, or robots, that a behaviour needs, run it, stop the robot and close it.

    Args:
        what: The behaviour.
        url: URL of the robot; a ``sim://`` without a world is a virtual one in the behaviour's own world, and so is
            None, unless the environment variable ``ELIB_ROBOT`` names the robot.
        seconds: Robot time after which the run ends; None for no limit.
        options: Values for the behaviour's options.
        seed: Seed of ``run.random``.
        watch: Called once before the run, with its RunContext and the open robots: to add listeners, or to keep what
            ends the run by ``run.finish(reason)`` from any thread.
        watchdog: Let a small process stop the robots when this program dies or freezes; unless given, only ``elib run``
            does.

    Raises:
        ArgumentError: *what* is no behaviour, or an argument or option is wrong; nothing was opened.
        ElibError: The robot could not be reached, was lost, or did not confirm that it stopped.

    Example:
        >>> from elib.behaviours.avoid import wander
        >>> elib.play(wander, "sim://?speed=max", seconds=5).reason
        'time'
    """
    _check_behaviour(what)
    what.check(options or {})
    check_duration(seconds)
    is_swarm = what.style is BehaviourStyle.SWARM
    urls = choose_robots([url] if url else [], [what.url]) if is_swarm else [choose_robot(url, what.url)]
    urls = [what.resolve_url(each) for each in urls]
    url = urls[0]
    settings = LinkSettings(policy=Policy() if what.reconnects else None, watchdog=watchdog)

    def one_robot() -> Epuck:
        return Epuck(Link(url, settings=settings))

    def context(clock: Callable[[], float], robots: tuple[Epuck, ...]) -> RunContext:
        run = RunContext(clock, seconds=seconds, seed=seed)
        if watch is not None:
            watch(run, robots)
        return run

    if what.style is BehaviourStyle.BLOCKING:
        with connect_robot(one_robot()) as blocking:
            run = context(lambda: blocking.time, (blocking.robot,))
            return run_behaviour_blocking(what, blocking, run=run, options=options)

    async def open_and_run() -> RunResult:
        clock = asyncio.get_running_loop().time
        match what.style:
            case BehaviourStyle.SWARM:
                async with Swarm(tuple(map(parse_url, urls)), None, settings) as robots:  # swarm() would choose again
                    return await run_behaviour(what, robots, run=context(clock, tuple(robots)), options=options)
            case BehaviourStyle.BYTES:
                transport = await open_transport(url)
                try:
                    return await run_behaviour(what, transport, run=context(clock, ()), options=options)
                finally:
                    await transport.close()
            case _:
                async with one_robot() as robot:
                    return await run_behaviour(what, robot, run=context(clock, (robot,)), options=options)

    return run_coroutine(open_and_run, speed_of(url))


async def run_behaviour(
    what: Behaviour,
    robot: Epuck | Swarm | Transport,
    *,
    seconds: float | None = None,
    options: Mapping[str, object] | None = None,
    run: RunContext | None = None,
) -> RunResult:
    """Run a behaviour on a robot that is open until its time is over, it ends, or this call is cancelled; then stop.

    Args:
        what: The behaviour; not one in the blocking style.
        robot: The open robot, swarm or transport.
        seconds: Robot time after which the run ends; None for no limit.
        options: Values for the behaviour's options.
        run: The context to run in, with a time of its own; a new one by default.

    Raises:
        ArgumentError: *seconds* is not positive and finite, or an option is wrong; nothing was sent.
        ElibError: The behaviour did not handle an error, or the robot did not confirm that it stopped.
    """
    check_duration(seconds)
    chosen = what.check(options or {})
    loop = asyncio.get_running_loop()
    run = RunContext(loop.time, seconds=seconds) if run is None else run
    run.listeners += [each.events.add for each in _robots(robot)]
    limit = asyncio.timeout(run.time_left)

    def expire() -> None:
        # A run may be finished from any thread, and even after the loop has ended.
        with contextlib.suppress(RuntimeError):
            loop.call_soon_threadsafe(_expire, limit)

    try:
        async with limit:
            run.on_finish(expire)
            await cast("Awaitable[object]", what.function(robot, *([run] if what.takes_run else []), **chosen))
    except BaseException as error:
        # A TimeoutError may also come from the robot, through the behaviour.
        if not (isinstance(error, TimeoutError) and limit.expired()):
            run.finish("error" if isinstance(error, Exception) else "interrupt")
            # The error that ended the behaviour says more than a stop that could not be confirmed.
            try:
                await _stop(robot)
            except ElibError:
                raise _still_moving(what, error) from error
            raise
        run.finish("time")
    result = _result(run, [each.statistics for each in _robots(robot)])
    try:
        await _stop(robot)
    except ElibError as error:
        raise _still_moving(what, error) from error
    return result


def run_behaviour_blocking(
    what: Behaviour,
    robot: BlockingEpuck,
    *,
    seconds: float | None = None,
    options: Mapping[str, object] | None = None,
    run: RunContext | None = None,
) -> RunResult:
    """Do the same as :func:`run_behaviour` for a behaviour in the blocking style, in this thread."""
    check_duration(seconds)
    chosen = what.check(options or {})
    run = RunContext(lambda: robot.time, seconds=seconds) if run is None else run
    run.listeners.append(robot.events.add)
    try:
        what.function(robot, *([run] if what.takes_run else []), **chosen)
        run.finish("time" if run.is_over else "done")
    except BaseException as error:
        run.finish("error" if isinstance(error, Exception) else "interrupt")  # so that no callback drives on
        try:
            _stop_blocking(robot)
        except ElibError:
            raise _still_moving(what, error) from error
        raise
    result = _result(run, [robot.statistics])
    try:
        _stop_blocking(robot)
    except ElibError as error:
        raise _still_moving(what, error) from error
    return result


def check_duration(seconds: float | None) -> None:
    """Check the time that a run is given.

    Raises:
        ArgumentError: The time is not positive and finite.
    """
    if seconds is not None:
        DURATION.require(seconds, "the time to run for")


def _expire(limit: asyncio.Timeout) -> None:
    # The block may have ended meanwhile.
    with contextlib.suppress(RuntimeError):
        limit.reschedule(asyncio.get_running_loop().time())


def _robots(robot: Epuck | Swarm | Transport) -> tuple[Epuck, ...]:
    if isinstance(robot, Swarm):
        return tuple(robot)
    return (robot,) if isinstance(robot, Epuck) else ()


async def _stop(robot: Epuck | Swarm | Transport) -> None:
    if isinstance(robot, Swarm):
        await asyncio.gather(*map(_stop, robot))
        return
    with _ignoring_replays(robot):
        if isinstance(robot, Epuck):
            await robot.within(STOPPING_TIME).stop()
        else:
            await robot.write(STOP_COMMAND)


def _stop_blocking(robot: BlockingEpuck) -> None:
    with _ignoring_replays(robot.robot):
        robot.within(STOPPING_TIME).stop()


@contextlib.contextmanager
def _ignoring_replays(robot: Epuck | Transport) -> Iterator[None]:
    """Ignore errors of a replayed robot: it has no wheels, and its recording may lack this stop."""
    try:
        yield
    except ElibError:
        origin = robot.context.origin if isinstance(robot, Epuck) else robot.origin
        if origin != "replay":
            raise


def _result(run: RunContext, statistics: list[LinkStats]) -> RunResult:
    reason = run.reason or "done"
    links = merged(statistics) if statistics else None
    return RunResult(run.time, reason != "done", links, reason, run.states, run.messages)


def _still_moving(what: Behaviour, error: BaseException) -> ElibError | BaseException:
    """Return *error* with the warning that the robot may still be moving; one that is not ours is logged instead."""
    warning = f"{what.name} ended, but the robot did not confirm that it stands: it may still be moving"
    if isinstance(error, LinkError):
        return type(error)(f"{error.message}; {warning}", hint=error.hint or "switch it off, or catch it")
    if isinstance(error, ElibError):
        return LinkLost(f"{warning} ({error.message})", hint="switch it off, or catch it")
    log.warning(warning)  # Ctrl-C, a signal or a defect of the behaviour: its own error says more
    return error


def _check_behaviour(what: object) -> None:
    if isinstance(what, Behaviour):
        return
    hint = "write @elib.behaviour before its function" if callable(what) else ""
    if isinstance(what, str):
        function = find(what).function
        hint = f"write: from {function.__module__} import {function.__name__}; elib.play({function.__name__})"
    raise ArgumentError(f"elib.play() takes a behaviour, not {what!r}", hint=hint)
