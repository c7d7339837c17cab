"""Text on a terminal: messages, tables, lines of JSON, and the live line."""

from __future__ import annotations

import enum
import json
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Literal, Self, TextIO

from elib.base.plaintext import is_live as is_live
from elib.base.plaintext import plain, two_columns
from elib.base.plaintext import say as say

if TYPE_CHECKING:
    from rich.progress import Progress

NARROWEST, WIDEST = 20, 100
"""Columns at which text is wrapped in a narrower terminal too, which wraps it again, and in a wider one."""

BLOCKS = "▁▂▃▄▅▆▇█"
DIM, BOLD, GREEN, YELLOW, RED, CYAN = "2", "1", "32", "33", "31", "36"


def print_json(value: object) -> None:
    """Print *value* as one line of JSON, at once."""
    print(json_line(value), flush=True)


def typed(value: object) -> str:
    """Return a value as a person types it: the name of a member, a number in its shortest form."""
    return value.name if isinstance(value, enum.Enum) else f"{value:g}" if isinstance(value, float) else str(value)


def json_line(value: object) -> str:
    """Return *value* as one line of JSON."""
    from elib.link.protocol.words import to_json  # the list of commands needs no protocol

    return json.dumps(to_json(value), ensure_ascii=False)


def quoted(path: str | os.PathLike[str]) -> str:
    """Return a path as a person types it to a shell."""
    text = os.fspath(path)
    return subprocess.list2cmdline([text]) if sys.platform == "win32" else shlex.quote(text)


def has_colour(stream: TextIO) -> bool:
    """Return whether *stream* shows colours, and the user wants them (https://no-color.org)."""
    return is_live(stream) and not os.environ.get("NO_COLOR")


def columns() -> int:
    """Return the number of columns to write on."""
    return max(NARROWEST, min(shutil.get_terminal_size().columns, WIDEST))


def paint(text: str, code: str, stream: TextIO) -> str:
    """Return *text* in the SGR colour *code*, or unchanged where there are no colours."""
    return f"\x1b[{code}m{text}\x1b[0m" if has_colour(stream) and text else text


def table(rows: Iterable[tuple[str, str]], *, indent: int = 2, width: int | None = None) -> str:
    """Return two aligned columns, safe to print; the second one is wrapped to *width*, by default the terminal's."""
    told = [(plain(label), plain(text)) for label, text in rows]
    return two_columns(told, columns() if width is None else width, indent=indent)


def grid(heading: Sequence[str], rows: Iterable[Iterable[str]], *, left: int = 1) -> str:
    """Return a table, safe to print, with colours where the terminal has them; *left* columns hold no numbers."""
    from rich.console import Console  # most commands print no table
    from rich.table import Table

    shown = Table(box=None, pad_edge=False, header_style="bold")
    for place, name in enumerate(heading):
        shown.add_column(name, justify="left" if place < left else "right")
    for row in rows:
        shown.add_row(*map(plain, row))
    colours: Literal["auto"] | None = "auto" if has_colour(sys.stdout) else None
    console = Console(width=columns(), color_system=colours, highlight=False, markup=False)
    with console.capture() as found:
        console.print(shown)
    return "\n".join(line.rstrip() for line in found.get().splitlines())


def progress_bar() -> Progress:
    """Return a bar on stderr that counts what is done, without a task yet."""
    from rich.console import Console  # most commands show none
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    return Progress(*columns, console=Console(stderr=True), redirect_stdout=False)


class LiveLine:
    """A line that is overwritten again and again, until a block ends; nothing is written where there is no terminal."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = sys.stderr if stream is None else stream
        self.is_shown = is_live(self._stream)
        self._is_dirty = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.clear()

    def tell(self, text: str) -> None:
        """Overwrite the line with a note on how far the work is."""
        self.show([(text, DIM)])

    def show(self, parts: Sequence[tuple[str, str]]) -> None:
        """Overwrite the line by texts, each with its SGR colour code; what does not fit on the line is cut off."""
        if not self.is_shown:
            return
        room = shutil.get_terminal_size().columns - 1
        line = ""
        for text, code in parts:
            text = text[:room]
            room -= len(text)
            line += paint(text, code, self._stream) if code else text
        self._stream.write(f"\r{line}\x1b[K")
        self._stream.flush()
        self._is_dirty = True

    def clear(self) -> None:
        """Remove the line."""
        if self._is_dirty:
            self._stream.write("\r\x1b[K")
            self._stream.flush()
            self._is_dirty = False
