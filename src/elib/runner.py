"""``elib.run(main)``: open the robot the user asks for, run an async program on it, stop it."""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import signal
import sys
from collections.abc import Awaitable, Callable, Sequence
from typing import NoReturn, TypeVar

from elib.errors import ArgumentError, ElibError
from elib.robot.aio import Epuck, Link
from elib.timebase import new_loop
from elib.transport import speed_of

T = TypeVar("T")

DEFAULT_URL = "sim://"
ROBOT_FAILED, WRONG_USAGE = 1, 2
"""Exit codes: the robot or its link failed; the call was wrong."""


def run(main: Callable[[Epuck], Awaitable[T]], *, robot: str | None = None, argv: Sequence[str] | None = None) -> T:
    """Run ``async def main(robot)`` on a robot and return its result; the robot is stopped whatever happens.

    Args:
        main: A coroutine function that takes the open robot.
        robot: URL of the robot. If None, what ``--robot URL`` on the command line says, else ``sim://``.
        argv: Command line to read; the program's own unless given.

    Raises:
        SystemExit: The robot failed (1), the call was wrong (2), or Ctrl-C ended it (130); the reason is on stderr.
            Only where the URL came from the command line: with *robot* given, errors come as they are.
    """
    if not (inspect.iscoroutinefunction(main) or inspect.iscoroutinefunction(type(main).__call__)):
        raise ArgumentError("elib.run() takes a coroutine function", hint="async def main(robot): ...")
    if robot is not None:
        return run_on(robot, main)
    try:
        return run_on(
            _robot_option(sys.argv[1:] if argv is None else argv, inspect.getdoc(sys.modules.get("__main__"))), main
        )
    except ArgumentError as error:
        _complain(error, WRONG_USAGE)
    except ElibError as error:
        _complain(error, ROBOT_FAILED)
    except KeyboardInterrupt:
        raise SystemExit(128 + signal.SIGINT) from None


def run_on(url: str, main: Callable[[Epuck], Awaitable[T]], *, keep_moving: bool = False) -> T:
    """Open *url* on a loop of its speed, run *main* and close; errors come as they are.

    Args:
        url: The robot.
        main: A coroutine function that takes the open robot.
        keep_moving: Leave the wheels turning when *main* ends by itself. Ctrl-C and SIGTERM stop them all the same.
    """

    async def whole() -> T:
        link = Link(url, url, keep_moving, None, None)
        async with Epuck(link) as robot:
            try:
                return await main(robot)
            except asyncio.CancelledError:
                link.keep_moving = False
                raise

    loop = new_loop(speed_of(url))
    with asyncio.Runner(loop_factory=lambda: loop) as runner:
        return runner.run(whole())


def _robot_option(arguments: Sequence[str], description: str | None) -> str:
    import argparse

    parser = argparse.ArgumentParser(description=description)
    parser.add_argument(
        "--robot", metavar="URL", default=DEFAULT_URL, help=f"the robot to drive (default: {DEFAULT_URL})"
    )
    with contextlib.suppress(argparse.ArgumentError):
        return str(parser.parse_known_args(arguments)[0].robot)
    return DEFAULT_URL


def _complain(error: ElibError, code: int) -> NoReturn:
    print(f"error: {error}", file=sys.stderr)
    raise SystemExit(code) from error
