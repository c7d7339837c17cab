"""A writer of text lines with its own thread, for a file or a stream."""

from __future__ import annotations

import os
import threading
import weakref
from collections.abc import Callable
from typing import Protocol

from elib.base.errors import ArgumentError, ElibError
from elib.records.background import CLOSING_TIME, Background

MAX_LINES = 100_000
"""Number of lines that may wait for a slow target, some 6 MB; more are lost, and the log says how many."""
MANY_LINES = 10_000
"""Number of lines that are written at once, without gathering more."""


class TextStream(Protocol):
    """A stream for text: an open text file, ``sys.stdout``, a ``StringIO``."""

    def write(self, text: str, /) -> object:
        """Write *text*."""
        ...

    def flush(self) -> object:
        """Flush what was written."""
        ...


Target = str | os.PathLike[str] | TextStream
"""The path of a file, which is created or appended to, or an open text stream."""

_LOCKS: weakref.WeakKeyDictionary[TextStream, threading.Lock] = weakref.WeakKeyDictionary()
"""A lock for each stream: several writers may share a stream."""
_LOCKS_LOCK = threading.Lock()


class AppendedFile:
    """A file to which each batch of lines is appended in one system call.

    So batches of several writers, also in several programs, do not mix.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._file = open(path, "ab", buffering=0)  # noqa: SIM115  # closed by the writer's thread

    def write(self, text: str, /) -> None:
        """Append *text*."""
        rest = memoryview(text.encode("utf-8", "backslashreplace"))
        while rest:
            rest = rest[self._file.write(rest) or 0 :]

    def flush(self) -> None:
        """Do nothing: the operating system has everything already."""

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class LineWriter(Background[str]):
    """Writes lines to a target until it is closed; a stream stays open then. Any thread may use it."""

    def __init__(self, target: Target) -> None:
        self._stream: TextStream
        free: Callable[[], None] = lambda: None  # noqa: E731
        if isinstance(target, str | os.PathLike):
            self._stream = own = AppendedFile(target)
            free = own.close
            self.target = os.fspath(target)  # name of the file or stream
        else:
            self._stream = _checked(target)
            self.target = str(getattr(target, "name", type(target).__name__))
        super().__init__(f"the log {self.target}", self._write, free, most=MAX_LINES, many=MANY_LINES)

    def check(self) -> None:
        """Raise the error that the thread met, if any."""
        if self.error is not None:
            raise ElibError(
                f"the log {self.target} could not be written: {self.error}",
                hint="its later lines are lost; is there room on the disk, and is the stream still open?",
            ) from self.error

    def close(self) -> None:
        """Write the lines that are left and close the file. It is safe to call this again."""
        if self.end():
            self.check()
        else:
            raise ElibError(
                f"the log {self.target} did not take its last lines within {CLOSING_TIME:g} s",
                hint="does anybody read the pipe it goes to?",
            )

    # -- in the thread --

    def _write(self, lines: list[str], lost: int) -> None:
        if lost:
            lines.append(f"#{lost} lines were lost: they came faster than they could be written\n")
        with _lock_of(self._stream):
            self._stream.write("".join(lines))
            self._stream.flush()


def _checked(stream: TextStream) -> TextStream:
    try:
        stream.write("")  # binary and closed streams refuse it
        stream.flush()
    except Exception as error:
        raise ArgumentError(
            f"{stream!r} takes no text: {error}", hint="a log goes to a path or to a text stream open for writing"
        ) from None
    return stream


def _lock_of(stream: TextStream) -> threading.Lock:
    try:
        with _LOCKS_LOCK:
            return _LOCKS.setdefault(stream, threading.Lock())
    except TypeError:  # the stream does not support weak references: it gets a lock for this writer alone
        return threading.Lock()
