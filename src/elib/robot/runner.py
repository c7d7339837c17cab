"""``elib.run(main)``: open the robot that the command line names, run an async program on it, and stop it."""

from __future__ import annotations

import asyncio
import inspect
import os
import sys
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar, get_args

from elib.base.errors import ArgumentError, ElibError
from elib.base.exits import INTERRUPTED, complain
from elib.link.transport import parse_url, speed_of
from elib.records.log import Log, Vocabulary
from elib.robot.aio import Epuck
from elib.robot.link import Link, LinkSettings
from elib.robot.running import run_coroutine
from elib.robot.substitute import DEFAULT_URL, VARIABLE, choose_robot, choose_robots

if TYPE_CHECKING:  # most programs record nothing
    from elib.records.recorder import Recorder

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Records:
    """The files in which a program keeps its run."""

    log: str | None = None  # a file that gets a line for each call and outcome, or None
    record: str | None = None  # a file, `.mcap`, that gets everything that happens on the link, or None
    log_names: Vocabulary = "python"  # how the log names commands

    def check(self) -> None:
        """Check the files before the robot is opened.

        Raises:
            ArgumentError: The recording exists, its name does not end in ``.mcap``, or there is no folder for a file.
            Unsupported: The package mcap is not installed.
        """
        for what, name in (("log", self.log), ("recording", self.record)):
            if name is not None and not Path(name).parent.is_dir():
                raise ArgumentError(f"there is no folder {str(Path(name).parent)!r} for the {what} {name!r}")
        if self.record is not None:
            from elib.records.recorder import check_new

            check_new(self.record)

    def begin(self, robot: Epuck) -> list[Log | Recorder]:
        """Begin to keep what happens on an open robot, in its event loop, until the robot is closed.

        Raises:
            ArgumentError: A file cannot be written.
        """
        begun: list[Log | Recorder] = []
        try:
            if self.log is not None:
                begun.append(robot.log(self.log, names=self.log_names))
            if self.record is not None:
                begun.append(robot.record(self.record))
        except OSError as error:
            raise unwritable(error) from None
        return begun


def unwritable(error: OSError) -> ArgumentError:
    """Return the error about a file that the user named and that cannot be written."""
    return ArgumentError(
        f"{error.filename} cannot be written: {error.strerror}", hint="does its folder exist, and is it yours?"
    )


NOTHING = Records()


def run(
    main: Callable[[Epuck], Awaitable[T]],
    *,
    robot: str | None = None,
    default: str = DEFAULT_URL,
    argv: Sequence[str] | None = None,
    watchdog: bool | None = None,
) -> T:
    """Run ``async def main(robot)`` on a robot and return its result; the robot is always stopped at the end.

    Without *robot* the command line of the program is read: ``URL`` or ``--robot URL`` names the robot, and ``--log
    FILE`` and ``--record FILE.mcap`` keep what happens, as :meth:`Epuck.log` and :meth:`Epuck.record` do. Any other
    argument is an error. A program with options of its own reads them first and passes on the rest::

        options, rest = parser.parse_known_args()
        elib.run(main, argv=rest)

    Args:
        main: A coroutine function that takes the open robot.
        robot: URL of the robot; the command line is not read.
        default: URL of the robot if neither the command line nor the environment variable ``ELIB_ROBOT`` names one.
        argv: Command line to read; the program's own unless given.
        watchdog: Let a small process stop the robot when this program dies, or freezes for half a second; unless
            given, only ``elib run`` does.

    Raises:
        SystemExit: The robot failed (1), the call was wrong (2), or Ctrl-C ended it (130); the reason is on stderr.
            Only if the command line was read: with *robot*, errors are raised as they are.

    Example:
        >>> async def main(robot):
        ...     await robot.drive(0.1)
        ...     return await robot.encoders()
        >>> elib.run(main, robot="sim://square?speed=max")
        Steps(left=776, right=776)
    """
    if not (inspect.iscoroutinefunction(main) or inspect.iscoroutinefunction(type(main).__call__)):
        raise ArgumentError("elib.run() takes a coroutine function", hint="async def main(robot): ...")
    if robot is not None:
        return run_on(choose_robot(robot), main, watchdog=watchdog)
    try:
        urls, records = _options(argv, [default])
        url = choose_robot(urls[0] if urls else None, default)
        return run_on(url, main, records=records, watchdog=watchdog)
    except ElibError as error:
        raise SystemExit(complain(error)) from error
    except KeyboardInterrupt:
        raise SystemExit(INTERRUPTED) from None


def robot_url(default: str = DEFAULT_URL, *, argv: Sequence[str] | None = None) -> str:
    """Return the URL of the robot that the command line names, as ``URL`` or ``--robot URL``.

    For programs that open their robot themselves: ``elib.connect(elib.robot_url())``. :func:`elib.run` does it by
    itself.

    Args:
        default: URL if neither the command line nor the environment variable ``ELIB_ROBOT`` names one.
        argv: Command line to read; the program's own unless given.

    Raises:
        SystemExit: The command line holds other arguments (2); the reason is on stderr.

    Example:
        >>> elib.robot_url("sim://?speed=max", argv=["serial:///dev/rfcomm0"])
        'serial:///dev/rfcomm0'
        >>> elib.robot_url("sim://?speed=max", argv=[])
        'sim://?speed=max'
    """
    urls, _ = _options(argv, [default], keeps_records=False)
    return _chosen(urls, [default])[0]


def robot_urls(*defaults: str, argv: Sequence[str] | None = None) -> list[str]:
    """Return the URLs of all robots that the command line names, each as ``URL`` or ``--robot URL``.

    For programs that drive several: ``elib.swarm(elib.robot_urls("sim://crowd?robots=8"))``.

    Args:
        defaults: URLs if neither the command line nor the environment variable ``ELIB_ROBOT`` names any.
        argv: Command line to read; the program's own unless given.

    Raises:
        SystemExit: The command line holds other arguments (2); the reason is on stderr.
    """
    urls, _ = _options(argv, defaults, keeps_records=False, several=True)
    return _chosen(urls, defaults)


def _chosen(urls: Sequence[str], defaults: Sequence[str]) -> list[str]:
    try:
        return choose_robots(urls, defaults)
    except ElibError as error:
        raise SystemExit(complain(error)) from error


def run_on(
    url: str,
    main: Callable[[Epuck], Awaitable[T]],
    *,
    keep_moving: bool = False,
    records: Records = NOTHING,
    watchdog: bool | None = None,
) -> T:
    """Open *url* on a loop of its speed, run *main* and close the robot.

    Args:
        url: The robot.
        main: A coroutine function that takes the open robot.
        keep_moving: Do not stop the wheels when *main* ends by itself. Ctrl-C and SIGTERM stop them anyway.
        records: The files in which the run is kept.
        watchdog: Let a small process stop the robot when this program dies or freezes.

    Raises:
        ElibError: The robot failed, or a log or recording could not be written.
    """
    parse_url(url)  # the robot is named before the files are
    records.check()
    link = Link(url, settings=LinkSettings(keep_moving=keep_moving, watchdog=watchdog))

    async def whole() -> T:
        async with Epuck(link) as robot:
            try:
                kept = records.begin(robot)
                result = await main(robot)
            except asyncio.CancelledError:
                link.keep_moving = False
                raise
        for each in kept:  # they ended with the robot; closing them reports what could not be written
            each.close()
        return result

    return run_coroutine(whole, speed_of(url))


def _options(
    argv: Sequence[str] | None, defaults: Sequence[str], *, keeps_records: bool = True, several: bool = False
) -> tuple[list[str], Records]:
    """Return what the command line names: URLs and records; an unknown argument ends the program, with the reason."""
    import argparse

    if argv is None:
        argv = [] if _is_in_ipython() else sys.argv[1:]
    parser = argparse.ArgumentParser(description=inspect.getdoc(sys.modules.get("__main__")))
    default = os.environ.get(VARIABLE) or " ".join(defaults)
    what = f"{'the robots' if several else 'the robot'} to drive (default: {default})"
    parser.add_argument("urls", metavar="URL", nargs="*" if several else "?", help=what.replace("%", "%%"))
    parser.add_argument("--robot", metavar="URL", action="append", default=[], help="the same")
    options = ["--robot", "--help"]
    if keeps_records:
        parser.add_argument("--log", metavar="FILE", help="append a line for each call and outcome to this file")
        what = "how the log names commands (default: python)"
        parser.add_argument("--log-names", choices=get_args(Vocabulary), default="python", help=what)
        parser.add_argument("--record", metavar="FILE.mcap", help="record everything that happens on the link")
        options += ["--log", "--log-names", "--record"]
    found, unknown = parser.parse_known_args(argv)
    if unknown:
        near = get_close_matches(unknown[0].partition("=")[0], options, 1)
        meant = f"; did you mean {near[0]}?" if near else ""
        parser.error(f"{unknown[0]} is not an argument of this program{meant}")
    alone = [found.urls] if isinstance(found.urls, str) else found.urls or []
    urls = [*alone, *found.robot]
    if len(urls) > 1 and not several:
        parser.error(f"this program drives one robot, not {' and '.join(urls)}")
    try:
        for url in urls:
            parse_url(url)
    except ArgumentError as error:
        raise SystemExit(complain(error)) from error
    return urls, Records(found.log, found.record, found.log_names) if keeps_records else NOTHING


def _is_in_ipython() -> bool:
    """Return whether the code was typed into IPython or a notebook, whose command line is not that of the program."""
    return "IPython" in sys.modules and not hasattr(sys.modules["__main__"], "__file__")
