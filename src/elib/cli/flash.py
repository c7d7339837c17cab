"""``elib flash``: write a program into an e-puck1 by its bootloader."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError, Unsupported
from elib.base.plaintext import counted, plain
from elib.cli.arguments import FAST_SIMULATION, NamedUrl, SameUrl, one_of, option
from elib.cli.terminal import is_live, progress_bar, say, table
from elib.link.protocol.values import Version
from elib.link.transport import open_transport, parse_url, speed_of
from elib.link.transport.base import codec_of
from elib.robot.running import run_coroutine
from elib.tools.flash import Image, Uploader, read_image
from elib.tools.flash.image import BOOTLOADER, END, EPUCK2_HINT, NUMBER, NUMBER_AT, ROW, START_AT, spans
from elib.tools.flash.uploader import NOT_THIS_ROBOT

File = Annotated[Path, Cli(name="FILE.hex", help="The program, an Intel HEX file.")]
Number = Annotated[int | None, NUMBER, option("--id N", "The robot's number, on its label; 0 to 65535.")]
DryRun = Annotated[bool, option("--dry-run", "Show what would be written; no robot is needed.")]
Verify = Annotated[bool, option("--verify", "Say at the end how far the rows in the robot are checked.")]

WHY_NUMBER = (
    "the robot keeps its number in a row that each upload writes, and it cannot be read back: give --id N with the "
    "number on the robot's label, which is also in its Bluetooth name (e-puck_1234)"
)
VERIFIED = (
    "The robot checked the sum of each packet before it wrote the row, and confirmed each row ({rows}) with K. Its "
    "bootloader cannot be asked what stands in the memory, so nothing was read back."
)
INTERRUPTED = "Interrupted."
SHOWN = 20
"""The most bytes that are shown of what a program without sercom sends."""


def flash(
    file: File,
    url: NamedUrl = None,
    /,
    *,
    robot: SameUrl = None,
    number: Number = None,
    dry_run: DryRun = False,
    verify: Verify = False,
) -> None:
    """Write a program into an e-puck1, which needs the Tiny Bootloader that it is delivered with.

    A robot that drives is stopped first. Then its program resets it; if no program answers, you are asked to press the
    reset button. Rows of the bootloader are never sent, and the reset vector is changed so that it leads to the
    bootloader: an upload that was interrupted can be repeated. Without URL a virtual robot is used. An e-puck2
    is programmed over its USB cable; with a program or a URL of one, this command names the guide.

    For example:
        elib flash program.hex serial:///dev/rfcomm0
        elib flash program.hex --dry-run
    """
    url = one_of(url, robot)
    image = read_image(file)
    if dry_run:
        print(described(image, file.name, number))
        return
    if number is None:
        raise ArgumentError("--id is missing", hint=WHY_NUMBER)
    target = parse_url(url or FAST_SIMULATION)
    if target.scheme == "wifi":
        raise Unsupported(f"{target}: {NOT_THIS_ROBOT}", hint=EPUCK2_HINT)

    async def main() -> Version | bytes:
        return await _flash(str(target), image, number)

    version = run_coroutine(main, speed_of(target))
    rows = len(image.rows)
    if verify:
        say(VERIFIED.format(rows=rows))
    print(f"{rows} rows are written, and the program has started: {_runs(version)}")


def _runs(version: Version | bytes) -> str:
    """Return what the new program says, in words."""
    if isinstance(version, Version):
        return plain(version.text)
    if version:
        return f"it sends {version[:SHOWN]!r}... and does not answer, as programs without sercom do"
    return "it says nothing, as programs without sercom do"


async def _flash(url: str, image: Image, number: int) -> Version | bytes:
    transport = await open_transport(url)
    try:
        if codec_of(transport) != "serial":
            raise Unsupported(f"{url}: {NOT_THIS_ROBOT}", hint=EPUCK2_HINT)
        with _progress(len(image.rows)) as on_row:
            uploader = Uploader(transport, image, number, say=say, on_row=on_row)
            try:
                return await uploader.run()
            except asyncio.CancelledError:
                say(f"{INTERRUPTED} {uploader.state}")
                raise
    finally:
        await transport.close()


def described(image: Image, name: str, number: int | None) -> str:
    """Return what would be written, and what not."""
    rows = len(image.rows)
    written = [f"{_span(first, last)} ({(last - first) // ROW + 1})" for first, last in spans(image.rows)]
    held = f"; the file holds {counted(len(image.protected), 'row')} there" if image.protected else ""
    vector = f"0x000000 leads to the bootloader at 0x{BOOTLOADER:06X}"
    lines = [
        ("rows", f"{rows} of {END // ROW}, of 32 instructions each: {', '.join(written)}"),
        (
            "reset vector",
            f"{vector}, as in the file" if image.is_patched else f"{vector}; in the file: 0x{image.start:06X}",
        ),
        ("start", f"0x{START_AT:06X} leads to the program at 0x{image.start:06X}"),
        ("robot's number", f"{'missing: give it with --id' if number is None else number}, at 0x{NUMBER_AT:06X}"),
        ("never sent", f"{_span(BOOTLOADER, END - ROW)}, the bootloader" + held),
    ]
    lines += [
        ("not sent", f"{memory}: {count} bytes, out of the bootloader's reach")
        for memory, count in image.skipped.items()
    ]
    lines.append(("time", f"{image.seconds:.1f} s on the line at least, and the answers of the robot"))
    return f"{plain(name)}\n{table(lines)}"


def _span(first: int, last: int) -> str:
    """Return the addresses of a run of rows."""
    return f"0x{first:06X}..0x{last + ROW - 2:06X}"


@contextmanager
def _progress(rows: int) -> Iterator[Callable[[int, int], None]]:
    """Show on a terminal how many rows are written; elsewhere say it at each quarter."""
    if not is_live(sys.stderr):
        said = 0

        def tell(written: int, rows: int) -> None:
            nonlocal said
            if written * 4 // rows > said:
                said = written * 4 // rows
                say(f"{written} of {rows} rows")

        yield tell
        return
    with progress_bar() as progress:
        task = progress.add_task("rows", total=rows)
        yield lambda written, rows: progress.update(task, completed=written)
