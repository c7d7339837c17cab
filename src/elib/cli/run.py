"""``elib run``: one of the behaviours that come with elib, on any robot."""

from __future__ import annotations

import asyncio
import inspect
import math
from collections.abc import Callable, Mapping
from typing import Annotated

from cyclopts import App
from cyclopts import Parameter as Cli

from elib.behaviours import Behaviour, behaviours, find, perform
from elib.cli.arguments import RobotUrl, Seconds, check_duration, number_from, rule
from elib.cli.live import Watcher, beside, period_of
from elib.cli.terminal import LiveLine, say, table
from elib.errors import ArgumentError
from elib.protocol.table import Parameter
from elib.robot.aio import Epuck
from elib.robot.statistics import Statistics
from elib.runner import DEFAULT_URL, run_on
from elib.transport import parse_url, speed_of

OVERVIEW = """Let a robot behave until the time is over or you press Ctrl-C; it is stopped at the end.

`elib run --list` says what there is."""


def build() -> App:
    """Return the parser of ``elib run``; every behaviour is a sub-command with its options."""
    app = App(help=OVERVIEW)

    @app.default
    def choose(
        behaviour: Annotated[str | None, Cli(show=False)] = None,
        /,
        *,
        listed: Annotated[bool, Cli(name="--list", negative="", help="List the behaviours.")] = False,
    ) -> None:
        if behaviour is not None:
            find(behaviour)  # says what may have been meant: had it been there, its own command would run
        if listed:
            print(table([(each.name, each.summary) for each in behaviours().values()], indent=0))
            return
        raise ArgumentError("elib run needs the name of a behaviour", hint="elib run --list says what there is")

    for what in behaviours().values():
        app.command(_command(what), name=what.name, help=what.doc)
    return app


def run(what: Behaviour, *, robot: str, seconds: float | None, options: Mapping[str, object]) -> None:
    """Perform a behaviour and sum it up.

    Raises:
        ArgumentError: The command line is wrong; nothing was sent.
        ElibError: The robot could not be reached, or was lost.
    """
    what.check(options)
    check_duration(seconds)
    parse_url(robot)
    watcher = Watcher()
    line = LiveLine()

    async def main(epuck: Epuck) -> None:
        watcher.attach(epuck)
        if line.is_shown:
            say(f"{what.name} on {epuck.name} ({epuck.firmware}); Ctrl-C stops it")
        try:
            async with beside(_display(watcher, line, period_of(speed_of(robot)))):
                outcome = await perform(what, epuck, seconds=seconds, options=options)
                watcher.finish(outcome.duration)
        finally:
            watcher.finish()

    try:
        run_on(robot, main)
    finally:
        line.clear()
        if watcher.statistics is not None:
            say(table(summary_rows(watcher.duration, watcher.statistics), indent=0))


def summary_rows(duration: float, statistics: Statistics) -> list[tuple[str, str]]:
    """Return what is said at the end of every performance, as label and text."""
    return [
        ("robot time", f"{duration:.1f} s"),
        ("commands", f"{statistics.count} answered, {statistics.lost} answers lost"),
        ("round trip", f"median {_milliseconds(statistics.median)}, 99 % below {_milliseconds(statistics.p99)}"),
    ]


def _milliseconds(seconds: float) -> str:
    return "unknown" if math.isnan(seconds) else f"{seconds * 1000:.1f} ms"


async def _display(watcher: Watcher, line: LiveLine, period: float) -> None:
    while line.is_shown:
        line.show(watcher.parts())
        await asyncio.sleep(period)


def _command(what: Behaviour) -> Callable[..., None]:
    """Return a function whose signature is the behaviour's, as the parser wants it."""

    def command(*, robot: str = DEFAULT_URL, seconds: float | None = None, **texts: str) -> None:
        run(
            what,
            robot=robot,
            seconds=seconds,
            options={name: number_from(text) for name, text in texts.items()},
        )

    typed = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
        for name, default, annotation in (
            ("robot", DEFAULT_URL, RobotUrl),
            ("seconds", None, Seconds),
            *((option.name, str(option.default), _option(option)) for option in what.options),
        )
    ]
    command.__annotations__ = {item.name: item.annotation for item in typed}
    setattr(command, "__signature__", inspect.Signature(typed))  # noqa: B010  # functions declare no such attribute
    return command


def _option(option: Parameter) -> object:
    return Annotated[str, Cli(metavar=option.name[:1].upper(), help=rule(option.quantity))]
