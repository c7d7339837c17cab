"""Lines on their way to a file: written by a thread of their own, so that no disk or pipe ever holds a robot up."""

from __future__ import annotations

import atexit
import logging
import os
import threading
import weakref
from collections import deque
from typing import Protocol

from elib.errors import ArgumentError, ElibError

GATHERED = 0.5
"""s of real time for which lines are gathered before they are written: they stand in the file within a second."""
MOST_LINES = 100_000
"""Lines that wait for a target that takes none, some 6 MB; more are lost, and the log says how many."""
MANY_LINES = 10_000
"""Lines that are written without gathering more."""
CLOSING_TIME = 2.0
"""s of real time that closing waits for the target to take the last lines."""

log = logging.getLogger("elib")


class TextStream(Protocol):
    """Where text can be written: an open text file, ``sys.stdout``, a ``StringIO``."""

    def write(self, text: str, /) -> object:
        """Take *text*."""
        ...

    def flush(self) -> object:
        """Hand on what was taken."""
        ...


Target = str | os.PathLike[str] | TextStream
"""A file by its path, which is created or appended to, or an open text stream."""

_LOCKS: weakref.WeakKeyDictionary[TextStream, threading.Lock] = weakref.WeakKeyDictionary()
"""One for each stream: several writers may share it."""
_LOCKS_LOCK = threading.Lock()


class AppendedFile:
    """A file that whole lines are appended to, each batch in one system call.

    Batches of several writers, and of several programs, then stand one behind the other.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._file = open(path, "ab", buffering=0)  # noqa: SIM115  # closed by the writer's thread

    def write(self, text: str, /) -> None:
        """Append *text*."""
        rest = memoryview(text.encode("utf-8", "backslashreplace"))
        while rest:
            rest = rest[self._file.write(rest) or 0 :]

    def flush(self) -> None:
        """Do nothing: everything is with the system already."""

    def close(self) -> None:
        """Free the file."""
        self._file.close()


class Writer:
    """Writes lines to a target until it is closed. Any thread may use it.

    Args:
        target: Path or stream; a stream stays open at the end.

    Raises:
        ArgumentError: The target is neither.
        OSError: The file cannot be opened.
    """

    def __init__(self, target: Target) -> None:
        self._own: AppendedFile | None = None
        self._stream: TextStream
        if isinstance(target, str | os.PathLike):
            self._stream = self._own = AppendedFile(target)
            self.name = os.fspath(target)
        else:
            self._stream = _checked(target)
            self.name = str(getattr(target, "name", type(target).__name__))
        self._lines: deque[str] = deque()
        self._lost = 0
        self._is_urgent = self._must_end = False
        self._error: BaseException | None = None
        self._change = threading.Condition()
        self._thread = threading.Thread(target=self._work, name=f"elib log {self.name}", daemon=True)
        self._thread.start()
        atexit.register(self.end)

    @property
    def is_closed(self) -> bool:
        """Whether :meth:`close` was called."""
        return self._must_end

    def put(self, line: str) -> None:
        """Let *line* be written soon; it ends in a line feed. Never waits for the target."""
        with self._change:
            if self._must_end or self._error is not None:
                return
            if len(self._lines) >= MOST_LINES:
                self._lost += 1
                return
            self._lines.append(line)
            if len(self._lines) in (1, MANY_LINES):
                self._is_urgent |= len(self._lines) == MANY_LINES
                self._change.notify_all()

    def hurry(self) -> None:
        """Let what is there be written now, without waiting for it."""
        with self._change:
            self._is_urgent = True
            self._change.notify_all()

    def check(self) -> None:
        """Raise what went wrong so far.

        Raises:
            ElibError: The target took no more lines.
        """
        if self._error is not None:
            raise ElibError(
                f"the log {self.name} could not be written: {self._error}",
                hint="its later lines are lost; is there room on the disk, and is the stream still open?",
            ) from self._error

    def close(self) -> None:
        """Write what is left and free the file. Safe to repeat.

        Raises:
            ElibError: Lines could not be written, or not within 2 s.
        """
        if self.end():
            self.check()
        else:
            raise ElibError(
                f"the log {self.name} did not take its last lines within {CLOSING_TIME:g} s",
                hint="does anybody read the pipe it goes to?",
            )

    def end(self, patience: float = CLOSING_TIME) -> bool:
        """Write what is left and free the file.

        Args:
            patience: s of real time to wait for it.

        Returns:
            Whether it is done.
        """
        with self._change:
            self._must_end = True
            self._change.notify_all()
        atexit.unregister(self.end)
        self._thread.join(patience)
        return not self._thread.is_alive()

    # -- the thread --

    def _work(self) -> None:
        try:
            while (batch := self._gather()) is not None:
                with _lock_of(self._stream):
                    self._stream.write(batch)
                    self._stream.flush()
        except Exception as error:
            with self._change:
                self._error = error
                self._lines.clear()
            log.error("the log %s could not be written: %s", self.name, error)
        finally:
            if self._own is not None:
                self._own.close()

    def _gather(self) -> str | None:
        """Wait for lines and return them; None when there will be no more."""
        with self._change:
            self._change.wait_for(lambda: self._lines or self._must_end)
            self._change.wait_for(lambda: self._is_urgent or self._must_end, GATHERED)
            if not self._lines:
                return None
            if self._lost:
                self._lines.append(f"#{self._lost} lines were lost: they came faster than they could be written\n")
            batch = "".join(self._lines)
            self._lines.clear()
            self._lost = 0
            self._is_urgent = False
            return batch


def _checked(stream: TextStream) -> TextStream:
    try:
        stream.write("")  # binary and closed ones refuse it
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
    except TypeError:  # it cannot be referred to weakly: it shares with nobody
        return threading.Lock()
