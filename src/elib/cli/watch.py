"""``elib watch``: show what the robot senses, in a live table, or as a line for each snapshot."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter as Cli

from elib.cli.arguments import RobotUrl, Seconds, option
from elib.cli.board import Board
from elib.cli.live import beside, period_of
from elib.cli.recordoptions import NOTHING_KEPT, Kept
from elib.cli.terminal import DIM, has_colour, is_live, print_json
from elib.link.protocol import words as readings
from elib.link.transport import speed_of
from elib.robot import snapshot as snapshots
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.robot.snapshot import Snapshot
from elib.robot.substitute import DEFAULT_URL
from elib.robot.telemetry import Watch

if TYPE_CHECKING:
    from rich.text import Text

RATE = 5.0
"""Hz by default: as fast as a person reads."""

Names = Annotated[str, Cli(metavar="NAMES", help="Readings: proximity, battery, image, ... (default: all but image).")]
Rate = Annotated[float, option("--rate HZ", "Snapshots a second, 0.001 to 1000.")]


def watch(
    *names: Names,
    robot: RobotUrl = DEFAULT_URL,
    rate: Rate = RATE,
    seconds: Seconds = None,
    once: Annotated[bool, option("--once", "Show one snapshot, then end.")] = False,
    json: Annotated[bool, option("--json", "Print a line of JSON for each snapshot.")] = False,
    records: Kept = NOTHING_KEPT,
) -> None:
    """Show what the robot senses until Ctrl-C: a live table on a terminal, else a line for each snapshot.

    Without NAMES it shows every reading that the robot has, except `image`. The robot is not told to do anything.

    For example:
        elib watch --robot serial:///dev/rfcomm0
        elib watch proximity ground --rate 10
        elib watch battery --once --json
    """
    wanted = chosen(names, rate)

    async def main(epuck: Epuck) -> None:
        limit = asyncio.timeout(seconds)
        try:
            async with limit, epuck.watch(*wanted, rate=rate) as stream:
                if once or json or not is_live(sys.stdout):
                    await _print(stream, epuck, once=once, json=json)
                else:
                    await _show(stream, epuck, period_of(speed_of(robot)))
        except TimeoutError:
            if not limit.expired():
                raise

    run_on(robot, main, keep_moving=True, records=records)


def chosen(names: Sequence[str], rate: float) -> list[str]:
    """Return the names of readings as elib writes them, checked like the *rate*, Hz."""
    snapshots.period_of(rate)
    wanted = [name.replace("-", "_") for name in names]
    snapshots.check_names(wanted)
    return wanted


async def _print(stream: Watch, robot: Epuck, *, once: bool, json: bool) -> None:
    async for snapshot in stream:
        if json:
            print_json(to_json(snapshot))
        elif once:
            board = Board(title(robot))
            board.take(snapshot)
            for text, _ in board.lines(robot.time)[:-1]:
                print(text)
        else:
            print(to_line(snapshot), flush=True)
        if once:
            return


async def _show(stream: Watch, robot: Epuck, frame: float) -> None:
    """Draw the table again and again, also while no snapshot comes: one sees that readings grow stale."""
    from rich.console import Console
    from rich.live import Live

    board = Board(title(robot))
    console = Console(highlight=False, no_color=not has_colour(sys.stdout))
    with Live(console=console, auto_refresh=False, vertical_overflow="crop") as live:

        def draw() -> None:
            live.update(_text(board.lines(robot.time, robot.statistics)), refresh=True)

        async def keep_drawing() -> None:
            while True:
                draw()
                await asyncio.sleep(frame)

        async with beside(keep_drawing()):
            async for snapshot in stream:
                board.take(snapshot)
        draw()


def _text(lines: Sequence[tuple[str, str]]) -> Text:
    from rich.text import Text

    styles = {"": "", "1": "bold", DIM: "dim", "33": "yellow"}
    return Text("\n").join(Text(line, style=styles[code], no_wrap=True, overflow="crop") for line, code in lines)


def title(robot: Epuck) -> str:
    """Return the title of the table."""
    return f"{robot.name} ({robot.firmware})"


def to_json(snapshot: Snapshot) -> readings.Json:
    """Return a snapshot for JSON: its own fields, and each reading with its time and whether it is stale."""
    return {
        "time": snapshot.time,
        "origin": snapshot.origin,
        "sequence": snapshot.sequence,
        "dropped": snapshot.dropped,
        "error": None if snapshot.error is None else snapshot.error.message,
        "readings": {
            name: {"time": reading.time, "stale": snapshot.is_stale(name), "value": readings.to_json(reading)}
            for name, reading in snapshot.readings.items()
        },
    }


def to_line(snapshot: Snapshot) -> str:
    """Return a snapshot as one line: the time, ``name=number,number`` for each reading, and the stale readings."""
    parts = [f"time={snapshot.time:.3f}"]
    for name, reading in snapshot.readings.items():
        parts.append(f"{name}={','.join(_leaves(readings.to_json(reading)))}")
    stale = [name for name in snapshot.readings if snapshot.is_stale(name)]
    return " ".join([*parts, *([f"stale={','.join(stale)}"] if stale else [])])


def _leaves(value: readings.Json) -> Iterator[str]:
    match value:
        case dict():
            for item in value.values():
                yield from _leaves(item)
        case list():
            for item in value:
                yield from _leaves(item)
        case float():
            yield f"{value:.6g}"
        case None:
            yield ""
        case bool():
            yield str(int(value))
        case _:
            yield str(value)
