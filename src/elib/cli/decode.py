"""``elib decode``: show what the bytes between a program and a robot mean, from a capture or live from a port."""

from __future__ import annotations

import asyncio
import io
import re
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, cast

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.files import reason_of
from elib.base.plaintext import counted
from elib.base.rules import DURATION, Choice
from elib.cli.arguments import option
from elib.cli.terminal import CYAN, DIM, YELLOW, json_line, paint, say
from elib.link.protocol.profiles import FIRMWARES, profile_named, recognise
from elib.link.transport import open_transport, parse_url, speed_of
from elib.records.decoding import ASSUMED, FAULTS, AnyDecoder, Direction, Line, WifiDecoder, decoder_of, is_wifi
from elib.records.decoding.captures import FORMS, Piece, direction_of, form_of
from elib.records.decoding.words import PAUSE, Part, to_json, to_text
from elib.robot.running import run_coroutine

LOOK_AHEAD = 1 << 20
"""Bytes of a file that are searched for the version of the robot before anything is shown."""
COLOURS: dict[Part, str] = {"place": DIM, "arrow": CYAN, "fault": YELLOW, "filler": DIM}
HALF = (
    "only the robot's half is here, and nothing else tells what its bytes answer: capture both directions, as with "
    "`elib record`, `robot.trace(...)` or `socat -x`"
)
"""What is said of a capture without the host's half."""
_VERSION = re.compile(rb"v,(Version [^\r\n]{1,80})\r?\n")
_SENDERS: dict[str, Direction] = {"robot": "to host", "host": "to robot"}

Firmware = Annotated[
    str | None, option("--firmware NAME", f"{', '.join(FIRMWARES)} (default: what the capture tells, or {ASSUMED}).")
]
As = Annotated[str | None, Choice(tuple(FORMS)), option("--as FORM", f"Form of the capture: {', '.join(FORMS)}.")]


def decode(
    source: Annotated[
        str, Cli(name="FILE", allow_leading_hyphen=True, help="A capture, - for standard input, a port or a URL.")
    ] = "-",
    /,
    *,
    firmware: Firmware = None,
    sender: Annotated[
        str | None,
        Choice(tuple(_SENDERS)),
        option("--from WHO", "Who sent the bytes, if the capture does not tell: robot or host."),
    ] = None,
    form: As = None,
    seconds: Annotated[float | None, DURATION, option("--for S", "Seconds to listen to a port.")] = None,
    json: Annotated[bool, option("--json", "Print a line of JSON for each command and answer.")] = False,
) -> None:
    """Show the bytes between a program and a robot as commands and answers, a line each.

    FILE is a capture: raw bytes of one direction, or hexadecimal text as xxd, hexdump -C and socat -x write it, or
    lines like `> 44 0d` (to the robot) and `< 64 0d 0a` (from it), with or without times. elib listens to a port or URL
    until Ctrl-C. Faults are marked with `!`: unknown bytes, halves, answers without a request.

    For example:
        elib decode capture.txt
        elib decode serial:///dev/rfcomm0 --for 10
    """
    if firmware is not None:
        profile_named(firmware)
    direction = _SENDERS[sender] if sender else None
    printer = Printer(json=json)
    decoder: AnyDecoder
    if _is_port(source):
        if form is not None:
            raise ArgumentError("--as is for files; a port sends raw bytes")
        decoder = decoder_of(firmware)
        printer.assume(decoder)
        _listen(source, decoder, direction or "to host", printer, seconds)
        return
    if seconds is not None:
        raise ArgumentError("--for is for ports; a file is read to its end")
    if source == "-" and sys.stdin.isatty():
        raise ArgumentError("no FILE was given, and nothing is piped in", hint="elib decode capture.bin")
    with _opened(source) as file:
        head = file.peek(4096)
        read = FORMS[form or form_of(head)]
        pieces = read(file, direction or direction_of(head), source)
        ahead = list(_up_to(pieces, LOOK_AHEAD)) if source != "-" else []
        if firmware is None and is_wifi(ahead):
            decoder = WifiDecoder("by its packets")
        else:
            decoder = decoder_of(firmware, assumed=_version_in(ahead))
        printer.assume(decoder)
        for part in (ahead, pieces):
            for time, way, data in part:
                printer.show(decoder.feed(way, time, data))
    printer.show(decoder.flush())
    printer.summary(decoder)


class Printer:
    """Writes lines to stdout and counts them."""

    def __init__(self, *, json: bool) -> None:
        self._json = json
        self.is_live = False  # whether each line is shown at once
        self._count = self._faults = self._unanswered = 0

    def assume(self, decoder: AnyDecoder) -> None:
        """Say which firmware is assumed, if one is."""
        if decoder.source == "assumed":
            say(f"firmware: {decoder.firmware}, assumed until the capture tells; --firmware names another")

    def show(self, lines: list[Line]) -> None:
        """Write lines."""
        for line in lines:
            self._count += 1
            self._faults += line.kind in FAULTS
            self._unanswered += len(line.unanswered)
            print(json_line(to_json(line)) if self._json else to_text(line, paint=_paint))
        if lines and self.is_live:
            sys.stdout.flush()

    def summary(self, decoder: AnyDecoder) -> None:
        """Say how many lines there were, how many faults, and how many requests without an answer."""
        sys.stdout.flush()
        last = decoder.unanswered
        unanswered = self._unanswered + len(last)
        wrong = [f"{self._faults} of them marked !"] * (self._faults > 0)
        wrong += [f"{counted(unanswered, 'request')} without an answer"] * (unanswered > 0)
        lines = ", ".join([counted(self._count, "line"), *(wrong or ["nothing wrong"])])
        parts = [lines if self._count else "no bytes", f"{decoder.firmware}, {decoder.source}"]
        if last:
            parts.append(f"no answer to {', '.join(last)}")
        say("; ".join(parts))
        if decoder.lacks_requests:
            say(HALF)


def _paint(text: str, part: Part) -> str:
    return paint(text, COLOURS[part], sys.stdout)


def _is_port(source: str) -> bool:
    """Return whether *source* is a port or URL, not a file."""
    if "://" in source or re.fullmatch(r"COM\d+", source, re.IGNORECASE):
        return True
    if source.startswith(("/dev/std", "/dev/fd/", "/proc/")):
        return False
    try:
        return stat.S_ISCHR(Path(source).stat().st_mode) and source != "/dev/null"
    except (OSError, ValueError):
        return False


@contextmanager
def _opened(source: str) -> Iterator[io.BufferedReader]:
    if source == "-":
        yield cast("io.BufferedReader", sys.stdin.buffer)
        return
    try:
        file = open(source, "rb")  # noqa: SIM115  # closed below
    except (OSError, ValueError) as error:
        raise ArgumentError(f"{source!r} cannot be read: {reason_of(error)}", hint="check its path") from None
    with file:
        yield file


def _up_to(pieces: Iterator[Piece], limit: int) -> Iterator[Piece]:
    total = 0
    for piece in pieces:
        yield piece
        total += len(piece[2])
        if total >= limit:
            return


def _version_in(pieces: list[Piece]) -> str | None:
    """Return the firmware that an answer to ``V`` in *pieces* names, or None."""
    found = _VERSION.search(b"".join(data for _, direction, data in pieces if direction == "to host"))
    return None if found is None else recognise(found[1].decode("latin-1")).name


def _listen(source: str, decoder: AnyDecoder, direction: Direction, printer: Printer, seconds: float | None) -> None:
    """Show what comes from a port until the time is over, the link is lost, or Ctrl-C."""
    url = parse_url(source)
    printer.is_live = True

    async def main() -> None:
        loop = asyncio.get_running_loop()
        transport = await open_transport(url)
        start = loop.time()
        end = None if seconds is None else start + seconds
        try:
            while end is None or loop.time() < end:
                pause = loop.time() + PAUSE
                try:
                    async with asyncio.timeout_at(pause if end is None else min(pause, end)):
                        data = await transport.read()
                except TimeoutError:
                    printer.show(decoder.flush())
                    continue
                printer.show(decoder.feed(direction, loop.time() - start, data))
        finally:
            await transport.close()

    try:
        run_coroutine(main, speed_of(url))
    finally:
        printer.show(decoder.flush())
        printer.summary(decoder)
