"""A behaviour from nothing: the robot it needs is opened, it is performed, and the robot is closed."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping

from elib.behaviours._run.behaviour import (
    Behaviour,
    RunResult,
    Style,
    check_duration,
    run_behaviour,
    run_behaviour_blocking,
)
from elib.behaviours._run.context import SEED, RunContext
from elib.robot.aio import Epuck, make_robot
from elib.robot.blocking import connect_robot
from elib.robot.reconnect import Policy
from elib.robot.running import run_coroutine
from elib.swarms.swarm import swarm
from elib.transport import open_transport, speed_of


def play(
    what: Behaviour,
    url: str | None = None,
    *,
    seconds: float | None = None,
    options: Mapping[str, object] | None = None,
    seed: int = SEED,
    watch: Callable[[RunContext, tuple[Epuck, ...]], object] | None = None,
    watchdog: bool = False,
) -> RunResult:
    """Open the robot, or robots, that *what* needs, let it behave, stop it and close.

    Args:
        what: The behaviour.
        url: The robot; the behaviour's own world if None, or if a ``sim://`` names none.
        seconds: Robot time after which it ends; None for as long as it likes.
        options: Values for the behaviour's options.
        seed: Of the behaviour's chance.
        watch: Called once before it begins, with the run and the open robots: to listen, or to end it by
            ``run.finish(reason)`` from any thread.
        watchdog: Let a small process stop the robots when this program dies or freezes.

    Returns:
        How it went.

    Raises:
        ArgumentError: An argument or option is wrong; nothing was opened.
        ElibError: The robot could not be reached, was lost, or did not confirm that it stopped.
    """
    what.check(options or {})
    check_duration(seconds)
    url = what.at_home(url)
    policy = Policy() if what.reconnects else None

    def run_of(clock: Callable[[], float], robots: tuple[Epuck, ...]) -> RunContext:
        run = RunContext(clock, seconds=seconds, seed=seed)
        if watch is not None:
            watch(run, robots)
        return run

    if what.style is Style.BLOCKING:
        with connect_robot(_robot(url, policy, watchdog)) as blocking:
            run = run_of(lambda: blocking.time, (blocking.robot,))
            return run_behaviour_blocking(what, blocking, run=run, options=options)

    async def whole() -> RunResult:
        clock = asyncio.get_running_loop().time
        match what.style:
            case Style.SWARM:
                async with swarm(url, reconnecting=what.reconnects, watchdog=watchdog) as robots:
                    return await run_behaviour(what, robots, run=run_of(clock, tuple(robots)), options=options)
            case Style.BYTES:
                transport = await open_transport(url)
                try:
                    return await run_behaviour(what, transport, run=run_of(clock, ()), options=options)
                finally:
                    await transport.close()
            case _:
                async with _robot(url, policy, watchdog) as robot:
                    return await run_behaviour(what, robot, run=run_of(clock, (robot,)), options=options)

    return run_coroutine(whole, speed_of(url))


def _robot(url: str, policy: Policy | None, watchdog: bool) -> Epuck:
    return make_robot(url, name=None, keep_moving=False, firmware=None, mounting=None, policy=policy, watchdog=watchdog)
