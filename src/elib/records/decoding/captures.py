"""Captures: raw bytes, hexadecimal text of one direction or of both as other programs write it, elib's recordings."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from datetime import datetime
from io import BufferedReader

from elib.base.errors import ArgumentError
from elib.records.decoding.lines import Direction
from elib.records.topics import BYTES

CHUNK = 65_536
"""Bytes read at once, and the longest line of a text capture."""

Piece = tuple[float | None, Direction, bytes]
"""When bytes came, s since the first time in the capture; their direction; the bytes."""
Form = Callable[[BufferedReader, Direction, str], Iterator[Piece]]
"""Reads a capture. The arguments: an open file, the direction of bytes without one, the name of the file in errors."""

_HEX = r"(?:[0-9a-fA-F]{2}[ \t]*)+"
_STAMP = r"[0-9][0-9.:/T-]*(?:[ T][0-9:.]+)?Z?"
_DIRECTED = re.compile(rf"(?:\[?({_STAMP})\]?s?:?[ \t]+)?([<>]|->|<-)[ \t]*({_HEX})?(?:\|.*)?")
_SOCAT = re.compile(rf"([<>]) ({_STAMP})[ \t]+length=[0-9]+ from=[0-9]+ to=[0-9]+")
_XXD = re.compile(r"([0-9a-fA-F]{6,}):[ \t]((?:[0-9a-fA-F]{2,} )*[0-9a-fA-F]{2,})(?: [ \t].*| ?)?")
_CANONICAL = re.compile(rf"([0-9a-fA-F]{{8,}})[ \t]{{2}}({_HEX})\|.*")
_PLAIN = re.compile(_HEX)
_WORDS = re.compile(r"[0-9a-f]{7,8}(?:[ \t]+[0-9a-f]{4})+[ \t]*")

KNOWN_TEXT = "xxd, xxd -p, hexdump -C, socat -x, and lines like '> 44 0d' or '12.5 < 64 0d 0a' are understood"


def raw(file: BufferedReader, direction: Direction, name: str) -> Iterator[Piece]:
    """Read raw bytes of one direction."""
    while data := _read(file, name):
        yield None, direction, data


def hexadecimal(file: BufferedReader, direction: Direction, name: str) -> Iterator[Piece]:
    """Read hexadecimal text."""
    return _HexText(direction, name).read(file)


def mcap(file: BufferedReader, direction: Direction, name: str) -> Iterator[Piece]:
    """Read a recording of elib, with its further parts."""
    from elib.records.reader import read_recording  # mcap may not be installed, and other forms do not need it

    if name == "-":
        raise ArgumentError("a recording is read from a file, not from a pipe", hint="elib decode run.mcap")
    for entry in read_recording(name).entries(BYTES.name):
        transfer = entry.transfer
        yield transfer.time, "to robot" if transfer.to_robot else "to host", transfer.data


FORMS: Mapping[str, Form] = {"raw": raw, "hex": hexadecimal, "mcap": mcap}
"""The forms of a capture, by the name that a person gives."""


def form_of(head: bytes) -> str:
    """Return the form of a capture that begins with *head*: ``hex`` if its first line is hexadecimal text."""
    if head.startswith(b"\x89MCAP"):
        return "mcap"
    if not all(byte in b"\t\r\n" or 0x20 <= byte < 0x7F for byte in head):
        return "raw"
    lines = (line.strip() for line in head.decode("ascii").splitlines())
    first = next((line for line in lines if line and not line.startswith("#")), "")
    # An answer of a robot is never all hexadecimal digits: the shortest, "b", is not a pair of them.
    patterns = (_DIRECTED, _SOCAT, _XXD, _CANONICAL, _PLAIN, _WORDS)
    return "hex" if any(pattern.fullmatch(first) for pattern in patterns) else "raw"


def direction_of(head: bytes) -> Direction:
    """Return the direction of raw bytes: robots end lines with CR LF, programs with a CR alone."""
    return "to robot" if b"\r" in head and b"\n" not in head else "to host"


class _HexText:
    """Reads lines of hexadecimal text; some tell their offset, time and direction."""

    def __init__(self, direction: Direction, name: str) -> None:
        self._direction = direction
        self._name = name
        self._number = 0
        self._time: float | None = None
        self._clock = _Clock()
        self._row = b""
        self._end: int | None = None  # where the next row of a dump begins
        self._is_squeezed = False

    def read(self, file: BufferedReader) -> Iterator[Piece]:
        while line := _read(file, self._name, of_line=True):
            self._number += 1
            if len(line) > CHUNK:
                raise ArgumentError(
                    f"{self._name}: line {self._number} is longer than {CHUNK} characters",
                    hint="xxd -p -c 32 cuts lines",
                )
            text = line.decode("latin-1").strip()
            if text and not text.startswith("#"):
                yield from self._pieces(text)

    def _pieces(self, text: str) -> Iterator[Piece]:
        if match := _SOCAT.fullmatch(text):
            self._direction, self._time = _arrow(match[1]), self._stamp(match[2])
        elif text == "--" or (self._end is not None and text == "*"):
            self._is_squeezed = text == "*"
        elif match := _DIRECTED.fullmatch(text):
            self._direction = _arrow(match[2])
            if match[1]:
                self._time = self._stamp(match[1])
            yield self._time, self._direction, bytes.fromhex(match[3] or "")
        elif match := _CANONICAL.fullmatch(text) or _XXD.fullmatch(text):
            yield from self._dumped(int(match[1], 16), self._bytes(match[2]))
        elif self._end is not None and re.fullmatch(r"[0-9a-fA-F]{8,}", text):
            yield from self._dumped(int(text, 16), b"")
        elif _PLAIN.fullmatch(text):
            yield self._time, self._direction, bytes.fromhex(text)
        else:
            hint = "plain hexdump swaps bytes: use hexdump -C" if _WORDS.fullmatch(text) else KNOWN_TEXT
            raise ArgumentError(f"{self._name}: line {self._number} is not hexadecimal text: {text[:60]!r}", hint=hint)

    def _dumped(self, offset: int, row: bytes) -> Iterator[Piece]:
        """Return a row of a dump, after the rows that ``*`` stands for."""
        end = self._end
        if end is not None and offset != end:
            missing = offset - end
            if not self._is_squeezed or missing < 0 or not self._row or missing % len(self._row):
                raise ArgumentError(
                    f"{self._name}: line {self._number} begins at {offset:#x}; {end:#x} comes next",
                    hint="is a line of the dump missing?",
                )
            for _ in range(missing // len(self._row)):
                yield self._time, self._direction, self._row
        self._is_squeezed = False
        self._row, self._end = row, offset + len(row)
        if row:
            yield self._time, self._direction, row

    def _bytes(self, text: str) -> bytes:
        try:
            return bytes.fromhex(text)
        except ValueError:
            raise ArgumentError(
                f"{self._name}: line {self._number} has half a byte: {text[:60]!r}", hint=KNOWN_TEXT
            ) from None

    def _stamp(self, text: str) -> float:
        try:
            return self._clock.seconds(text)
        except ValueError:
            raise ArgumentError(
                f"{self._name}: line {self._number}: {text!r} is not a time",
                hint="seconds (12.5), a time of day (14:03:59.250) or a date and a time are",
            ) from None


class _Clock:
    """Turns the times of a capture into seconds: plain numbers as they are, others since the first time."""

    def __init__(self) -> None:
        self._start: float | None = None
        self._last = 0.0
        self._days = 0

    def seconds(self, text: str) -> float:
        if ":" not in text:
            return float(text)
        if re.match(r"\d{4}[-/]", text):
            date, clock = re.split(r"[ T]", text.replace("/", "-").rstrip("Z"), maxsplit=1)
            # Python keeps microseconds; some tools write nanoseconds.
            stamp = datetime.fromisoformat(f"{date}T{clock[:15]}")
            time = (stamp - datetime(1970, 1, 1)).total_seconds()
        else:
            hours, minutes, rest = text.split(":")
            time = int(hours) * 3600 + int(minutes) * 60 + float(rest)
            if time + 43_200 < self._last % 86_400:
                self._days += 1  # it is after midnight
            time += self._days * 86_400
        self._last = time
        self._start = time if self._start is None else self._start
        return round(time - self._start, 9)


def _arrow(text: str) -> Direction:
    return "to robot" if text in (">", "->") else "to host"


def _read(file: BufferedReader, name: str, *, of_line: bool = False) -> bytes:
    """Read what is there, or a line; an error of the system gets the name of the file."""
    try:
        return file.readline(CHUNK + 1) if of_line else file.read1(CHUNK)
    except OSError as error:
        error.filename = name
        raise
