"""``elib record``: record a robot, show what a recording holds, repair one that was cut off, export its tables."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from cyclopts import App
from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.plaintext import plain
from elib.base.tasks import end_tasks
from elib.cli.arguments import AsJson, RobotUrl, Seconds, option
from elib.cli.live import ENTER, beside, period_of, sensor_parts
from elib.cli.report import amount, link_rows
from elib.cli.terminal import BOLD, LiveLine, json_line, say, table
from elib.cli.watch import RATE, Names, Rate, chosen
from elib.link.protocol.values import Proximity
from elib.link.protocol.words import Json
from elib.link.transport import speed_of
from elib.records.et.formats import format_of
from elib.records.export import export
from elib.records.reader import Summary, read_recording, summary_of
from elib.records.recorder import check_new
from elib.records.repair import repair
from elib.records.tables import FIXED
from elib.robot.aio import Epuck
from elib.robot.runner import Records, run_on, unwritable
from elib.robot.substitute import DEFAULT_URL

SHOWN_NOTES = 20
"""Number of notes that are shown; --json has all."""

Existing = Annotated[str, Cli(metavar="FILE", help="A recording; the first file if it has several parts.")]
PartBytes = Annotated[int | None, option("--part-bytes N", "Go on in FILE.part2.mcap and so on after N bytes.")]
Output = Annotated[str | None, option("-o, --output OUT", "The new file (default: FILE.repaired.mcap).")]

Tables = Annotated[str, Cli(name="TABLES", help=f"proximity or another reading, {', '.join(FIXED)} (default: all).")]
Csv = Annotated[str | None, option("--csv PATH", "Write CSV: a folder, or a file for one table.")]
Parquet = Annotated[str | None, option("--parquet PATH", "Write Parquet, in the same way.")]
Replace = Annotated[bool, option("--replace", "Replace files that exist.")]

Reality = Annotated[
    bool, option("--reality", "Let the robot do what elib compare --reality FILE needs: it drives, for two minutes.")
]

app = App(name="record")


@app.default
def record(
    file: Annotated[str, Cli(metavar="FILE", help="Name of the recording, .mcap.")],
    /,
    *names: Names,
    robot: RobotUrl = DEFAULT_URL,
    seconds: Seconds = None,
    rate: Rate = RATE,
    part_bytes: PartBytes = None,
    part_seconds: Annotated[float | None, option("--part-seconds S", "The same after S seconds.")] = None,
    keep: Annotated[int | None, option("--keep N", "Keep the newest N parts, 2 at least.")] = None,
    reality: Reality = False,
) -> None:
    """Record everything that happens on a robot's link until Enter, Ctrl-C or the end of --for.

    FILE ends in .mcap and must not exist. The readings are asked for at --rate; without NAMES, these are all readings
    that the robot has, and `image` can be named too. The robot is not told to do anything. Everything older than a
    second is in the file, even if this program is killed; Foxglove (https://foxglove.dev) shows the file. `elib run
    BEHAVIOUR --record FILE` records a robot that does something. With --reality the robot stands, turns on the spot and
    drives 33 cm backwards, and asks you to put it to a white wall: the page "How real is it?" has more.

    `elib record info FILE` says what a recording holds, `elib record repair FILE` repairs one that was cut off, and
    `elib record export FILE --csv FOLDER` makes tables of it.

    For example:
        elib record drive.mcap --robot serial:///dev/rfcomm0
        elib record near.mcap proximity --rate 20 --for 60
    """
    if reality:
        if names or seconds is not None or (rate, part_bytes, part_seconds, keep) != (RATE, None, None, None):
            raise ArgumentError("--reality records all readings in one file", hint="leave out what else is asked for")
        from elib.cli.script import run
        from elib.studies.reality.session import reality as session

        run(session, robots=[robot], records=Records(record=file))
        return
    wanted = chosen(names, rate)
    check_new(file, part_bytes=part_bytes, part_seconds=part_seconds, keep=keep)
    line = LiveLine()
    rows: list[tuple[str, str]] = []

    async def main(epuck: Epuck) -> None:
        try:
            recorder = epuck.record(file, part_bytes=part_bytes, part_seconds=part_seconds, keep=keep)
        except OSError as error:
            raise unwritable(error) from None
        began, seen = epuck.time, dict[str, object]()
        if line.is_shown:
            say(f"recording {epuck.name} ({epuck.firmware}) to {file}; Enter or Ctrl-C ends it")

        async def follow() -> None:
            while True:
                near = seen.get("proximity")
                parts = [(f"{epuck.time - began:6.1f} s  {amount(recorder)}   ", BOLD)]
                line.show([*parts, *sensor_parts(near if isinstance(near, Proximity) else ())])
                await asyncio.sleep(period_of(speed_of(robot)))

        try:
            async with beside(follow()):
                await _watch(epuck, wanted, rate, seconds, seen)
        finally:
            rows.extend([("robot time", f"{epuck.time - began:.1f} s"), *link_rows(epuck.statistics)])
            try:
                recorder.close()
            finally:
                rows.append(("recording", f"{amount(recorder)} in {file}"))

    try:
        run_on(robot, main, keep_moving=True)
    finally:
        line.clear()
        if rows:
            say(table(rows, indent=0))


@app.command(name="info")
def info(file: Existing, /, *, json: AsJson = False) -> None:
    """Show what a recording holds, and whether it is complete.

    For example:
        elib record info drive.mcap
    """
    summary = summary_of(read_recording(file))
    print(json_line(to_json(summary)) if json else to_text(summary), flush=True)


@app.command(name="repair")
def mend(file: Existing, /, *, output: Output = None) -> None:
    """Write a complete recording with everything that can be read of one that was cut off or damaged.

    The old file does not change. Each part of a recording is repaired separately.

    For example:
        elib record repair drive.mcap
    """
    done = repair(file, output)
    health = done.health
    if health.is_whole:
        say(f"{file} is complete; nothing was lost")
    else:
        lost = f"{health.damaged} damaged pieces inside and the last {done.lost} bytes of {Path(file).stat().st_size}"
        say(f"lost: {lost}")
    say(f"wrote {done.path}: {done.messages} messages")


@app.command(name="export")
def export_tables(
    file: Existing, /, *tables: Tables, csv: Csv = None, parquet: Parquet = None, replace: Replace = False
) -> None:
    """Write what was recorded as tables, a file for each: proximity.csv, encoders.csv, calls.csv and so on.

    A row is a reading, a column is a number: time, proximity_front_right, ..., robot, origin. Times are in s on the
    robot's clock. PATH is a folder; or a file, where one of TABLES is named. Parquet needs the extra `parquet`.

    For example:
        elib record export drive.mcap --csv tables
        elib record export drive.mcap proximity --csv near.csv
    """
    if (csv is None) == (parquet is None):
        raise ArgumentError("elib record export needs --csv or --parquet, one of them", hint="try --csv tables")
    format_name = format_of("csv" if parquet is None else "parquet", csv or parquet)
    names = [name.replace("-", "_") for name in tables]
    done = export(read_recording(file), Path(csv or parquet or ""), format_name, names, replace=replace)
    print(table([("file", "rows"), *((str(path), str(count)) for path, count in done.rows.items())], indent=0))
    if not done.health.is_whole:
        lost = done.health.damaged
        say(f"{file} is not complete: {lost} damaged pieces were left out; all that is whole was exported")
    if done.misfits:
        say(f"{done.misfits} readings were left out: they have other fields than the first one of their kind")
    if done.pictures:
        say(f"pictures ({done.pictures}) are not in the tables; in Python, recording.entries('/pictures') has them")


async def _watch(
    robot: Epuck, names: Sequence[str], rate: float, seconds: float | None, seen: dict[str, object]
) -> None:
    """Read the sensors into *seen* until the time is over or a person presses Enter."""
    loop = asyncio.get_running_loop()

    async def read() -> None:
        async with robot.watch(*names, rate=rate) as stream:
            async for snapshot in stream:
                seen.update(snapshot.readings)

    reading = asyncio.create_task(read())

    def end() -> None:
        with contextlib.suppress(RuntimeError):  # Enter came after the end
            loop.call_soon_threadsafe(reading.cancel)

    ENTER.calls(end)
    try:
        await asyncio.wait([reading], timeout=seconds)
    finally:
        await end_tasks(reading)
    if not reading.cancelled():
        reading.result()


def to_text(summary: Summary) -> str:
    """Return the summary of a recording as text."""
    about = summary.about
    world = f"{about['world']}, seed {about.get('seed', '?')}" if "world" in about else ""
    rows = [
        ("robot", f"{about.get('robot', '')} ({about.get('firmware', '')})"),
        ("url", about.get("url", "")),
        ("world", world),
        ("program", about.get("program", "")),
        ("written", f"{about.get('wall', '')} by elib {about.get('elib', '')}"),
        ("duration", f"{summary.duration:.3f} s of robot time"),
        ("state", "complete" if summary.is_complete else "not complete: elib record repair FILE repairs it"),
    ]
    for part in summary.parts:
        state = "" if part.health.is_complete else ", cut off"
        damaged = f", {part.health.damaged} damaged pieces" if part.health.damaged else ""
        rows.append(("file", f"{part.path}, {part.size / 1000:.0f} KB{state}{damaged}"))
    lines = [table([(label, text) for label, text in rows if text], indent=0), ""]
    width = max((len(topic) for topic in summary.messages), default=0)
    lines += [
        f"{topic:<{width}}  {count:>8}  {summary.rate(topic):>9.2f} /s"
        for topic, count in sorted(summary.messages.items())
    ]
    began = float(about["began"])
    shown = summary.notes[:SHOWN_NOTES]
    if shown:
        lines.append("")
    lines += [f"{note.time - began:10.3f} s  {note.data['name']:<8}  {note.data['message']}" for note in shown]
    if len(summary.notes) > len(shown):
        lines.append(f"and {len(summary.notes) - len(shown)} more notes; --json has them all")
    return plain("\n".join(lines))


def to_json(summary: Summary) -> Json:
    """Return the summary of a recording in types that JSON has; times are in s since it began."""
    began = float(summary.about["began"])
    return {
        "about": {**summary.about},
        "duration": summary.duration,
        "complete": summary.is_complete,
        "parts": [
            {
                "path": str(part.path),
                "bytes": part.size,
                "complete": part.health.is_complete,
                "damaged": part.health.damaged,
                "readable_bytes": part.health.ends_at,
            }
            for part in summary.parts
        ],
        "topics": {
            topic: {"messages": count, "rate": round(summary.rate(topic), 6)}
            for topic, count in sorted(summary.messages.items())
        },
        "notes": [
            {"time": note.time - began, "kind": note.data["name"], "text": note.data["message"]}
            for note in summary.notes
        ],
    }
