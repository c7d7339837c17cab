"""``elib agent``: a Model Context Protocol server, through which an agent drives robots within limits."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError, Unsupported
from elib.base.extras import check_web, install
from elib.base.files import guide
from elib.base.rules import PORT_NUMBER
from elib.cli.arguments import option
from elib.cli.serving import listening, port_option
from elib.link.transport import parse_url, speed_of
from elib.robot.running import run_coroutine

WORLD = "sim://red-boxes"
"""The virtual robot that an agent gets where no URL is named: there are boxes of several colours to look for."""
PORT = 8710
"""The first port to try for HTTP; the next ones follow."""
VIRTUAL = ("sim", "replay")
REAL_FENCE, VIRTUAL_FENCE = 0.5, 2.0
"""m: a table for real robots; the arenas of the virtual ones are smaller than that."""


def agent(
    *urls: Annotated[str, Cli(help=f"sim://maze, serial:///dev/rfcomm0 with --allow-real, ... (default: {WORLD})")],
    allow_real: Annotated[bool, option("--allow-real", "Let the agent drive robots that are not virtual.")] = False,
    fence: Annotated[
        float | None,
        option(
            "--fence M",
            f"Circle around each robot's start that it may not leave, m (default: {VIRTUAL_FENCE:g}, with a real "
            f"robot {REAL_FENCE:g}).",
        ),
    ] = None,
    speed: Annotated[float, option("--speed M/S", "Top speed of each wheel, m/s.")] = 0.1,
    calls: Annotated[int, option("--calls N", "Calls that may reach a robot.")] = 500,
    driving: Annotated[float, option("--driving S", "Seconds of driving, all robots together.")] = 600.0,
    http: Annotated[bool, option("--http", "Serve HTTP at --port instead of standard input and output.")] = False,
    port: Annotated[int | None, PORT_NUMBER, port_option(PORT)] = None,
    view: Annotated[bool, option("--view", "Show the robots in the browser, with Stop for a person.")] = False,
    log: Annotated[Path | None, option("--log FILE", "Append a line of JSON for each call to FILE.")] = None,
) -> None:
    """Let an agent drive robots by the Model Context Protocol, within a fence, a speed limit and a budget.

    The agent's program starts this command and speaks to it by standard input and output. Its robot is a virtual one
    unless --allow-real is given. Whatever ends the agent, its robots stop.

    For example:
        elib agent
        elib agent sim://maze --view
        elib agent serial:///dev/rfcomm0 --allow-real --fence 0.3
    """
    check_web()
    try:
        import mcp  # noqa: F401
    except ImportError:
        raise Unsupported(
            "an agent's door needs the package mcp, which is not installed", hint=install("agent")
        ) from None
    from elib.doors.agent.limits import Limits

    urls = urls or (WORLD,)
    real = [url for url in urls if parse_url(url).scheme not in VIRTUAL]
    if real and not allow_real:
        raise ArgumentError(
            f"{real[0]} is not a virtual robot, and an agent gets a real one only with --allow-real",
            hint=f"stand beside the robot, and read {guide('agent')} first",
        )
    if port is not None and not http:
        raise ArgumentError("--port belongs to --http", hint=f"elib agent --http --port {port}")
    wide = REAL_FENCE if real else VIRTUAL_FENCE
    limits = Limits(wide if fence is None else fence, speed, calls, driving)
    speeds = {speed_of(url) for url in urls}
    if len(speeds) > 1 or "max" in speeds:
        raise ArgumentError("an agent's robots share one clock, which cannot jump", hint="use speed=10, or no speed")
    from elib.doors.agent.pipes import standard_pipes
    from elib.doors.agent.server import opened, serve_pipes, served
    from elib.doors.robots import hold_open

    with contextlib.ExitStack() as stack:
        try:
            file = None if log is None else stack.enter_context(log.open("a", encoding="utf-8"))
        except OSError as error:
            raise ArgumentError(f"--log {log} cannot be written: {error.strerror}", hint="name another file") from None
        stack.enter_context(contextlib.suppress(KeyboardInterrupt))

        @contextlib.asynccontextmanager
        async def by_http(bound: socket.socket) -> AsyncIterator[None]:
            async with opened(urls, limits, file=file, view=view) as door, served(door, bound):
                yield

        async def by_pipes(source: int, target: int) -> None:
            async with opened(urls, limits, file=file, view=view) as door:
                await serve_pipes(door, source, target)

        if http:
            address = stack.enter_context(listening(port=port, first=PORT))
            run_coroutine(lambda: hold_open(by_http(address.socket)), speeds.pop())
        else:
            pipes = stack.enter_context(standard_pipes())
            stack.enter_context(contextlib.suppress(SystemExit))  # SIGTERM is its usual end, as for other servers
            run_coroutine(lambda: by_pipes(*pipes), speeds.pop())
