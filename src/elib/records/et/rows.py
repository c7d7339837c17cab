"""Read the rows of a log, one block at a time: its text is never in memory as a whole."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from elib.base.errors import ArgumentError
from elib.base.rules import shown

BLOCK = 1 << 20
"""Bytes that are read at once: enough that the overhead of a block does not count, and few enough for the cache."""
MAX_LINE = 16 * BLOCK
"""Bytes of a row at most: a file without line ends is not a log, and must not fill the memory."""

NAMES = {"time": 0, "robot": 1, "event": 2, "command": 3, "not_sent": 4, "not_answered": 5, "latency": 4}
"""Columns by name; ``latency`` is the fifth column of the rows that ``Join`` writes."""

NUMBER = re.compile(rb"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
BYTES_OF_NUMBERS = b"0123456789+-.eE "
HEADER = b"# elib log "
"""The beginning of the first line of a log; a run that was appended to one has a header of its own."""
BOM = b"\xef\xbb\xbf"
"""The byte order mark that .NET writes in front of UTF-8."""


def text_of(word: bytes) -> str:
    """Return a word of a log as text."""
    return word.decode("utf-8", "replace")


class RowError(ArgumentError):
    """A row is not what the action needs; the message names the file and the line."""


class Block:
    """Some lines of a log."""

    def __init__(self, data: bytes, name: str = "stdin", line: int = 1) -> None:
        lines = data.replace(b"\r\n", b"\n").split(b"\n")
        if not lines[-1]:
            lines.pop()
        # the rows, without line ends; comments and empty lines are left out
        self.rows = [each for each in lines if each and each[0] != 35]  # 35 is "#"
        self.begins: set[int] = set()  # before which rows a header stands
        place = 0
        for each in lines if HEADER in data else ():
            if each.startswith(HEADER):
                self.begins.add(place)
            place += bool(each) and each[0] != 35
        self.name = name
        self.line = line  # number of the first line, from 1
        self.count = len(lines)  # how many lines there are, with comments and empty lines
        self.size = len(data)  # how many bytes were read
        # whether its last line has a line end; without one it may have been cut off
        self.is_whole = data.endswith(b"\n")
        self._lines = lines

    def words(self, column: int) -> list[bytes]:
        """Return the words of a column; a negative one counts from the end of the row."""
        try:
            if column < 0:
                return [row.rsplit(b" ", -column)[column] for row in self.rows]
            return [row.split(b" ", column + 1)[column] for row in self.rows]
        except IndexError:
            least = column + 1 if column >= 0 else -column
            place, row = next(each for each in enumerate(self.rows) if each[1].count(b" ") + 1 < least)
            has = f"the row has {row.count(b' ') + 1}, counted from 0: {shown(text_of(row))}"
            raise self.error(place, f"there is no column {column}: {has}") from None

    def numbers(self, column: int) -> NDArray[np.float64]:
        """Return the numbers of a column. A decimal comma, which logs of 2011 have in some countries, means a point."""
        words = self.words(column)
        joined = b" ".join(words)
        if b"," in joined:
            joined = joined.replace(b",", b".")
            words = joined.split(b" ")
        with contextlib.suppress(ValueError):
            values = np.fromiter(map(float, words), np.float64, len(words))
            # Python's float() also accepts "nan", "1_0" and more; they have bytes that translate() leaves over here.
            if not joined.translate(None, BYTES_OF_NUMBERS) and np.isfinite(values).all():
                return values
        finite = (NUMBER.fullmatch(word) is not None and np.isfinite(float(word)) for word in words)
        bad = next(place for place, is_finite in enumerate(finite) if not is_finite)
        raise self.error(bad, f"column {column} is {shown(text_of(self.words(column)[bad]))}, which is not a number")

    def error(self, place: int, message: str) -> RowError:
        """Return an error about the row with this index; its message names file and line."""
        numbers = (number for number, line in enumerate(self._lines, self.line) if line and line[0] != 35)
        return RowError(f"{self.name}:{next(islice(numbers, place, None))}: {message}")


def blocks_of(read: Callable[[int], bytes | None], name: str = "stdin") -> Iterator[Block]:
    """Yield the lines of a source in blocks of whole lines.

    Args:
        read: Function that returns the bytes that are there, at most so many; an empty result is the end.
        name: Name of the source, for messages.
    """
    line = 1
    rest: list[bytes] = []
    held = 0
    is_first = True
    while data := read(BLOCK):
        if is_first:
            while len(data) < len(BOM) and (more := read(BLOCK)):
                data += more
            data, is_first = data.removeprefix(BOM), False
        end = data.rfind(b"\n") + 1
        if end:
            block = Block(b"".join([*rest, data[:end]]), name, line)
            yield block
            line += block.count
            rest, held = [], 0
        rest.append(data[end:])
        held += len(data) - end
        if held > MAX_LINE:
            raise RowError(f"{name}:{line}: the line is longer than {MAX_LINE >> 20} MiB; this is not a log")
    if held:
        yield Block(b"".join(rest), name, line)
