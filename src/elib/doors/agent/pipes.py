"""Standard input and output as an MCP server needs them: lines of a bounded length, and nothing else on the output.

Reads and writes are made in threads that the program does not wait for at its end, unlike those of asyncio and anyio:
a client that neither writes nor reads must not hold up a stop.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import queue
import sys
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from typing import Any, TypeVar

from elib.base.timebase import in_thread

T = TypeVar("T")

MAX_LINE = 1 << 20
"""Bytes of a message: the longest call of a tool has less than a thousandth of this."""
CHUNK = 1 << 16
MAX_WAITING = 1000
"""Lines that wait for a slow reader of the error output; later ones are dropped."""
MAX_UNREAD = 1000, 4 << 20
"""Lines, and bytes of them, that a client may send while it reads none of its answers; then it is left."""
ENDING_TIME = 0.5
"""s that the last answers may take, after a client has closed its end or was left."""


class Pipes:
    """One client on two file descriptors."""

    def __init__(self, source: int, target: int) -> None:
        self._source, self._target = source, target
        self._is_writing = False
        self._lines = self._bytes = 0  # that came since an answer was read last
        self._loop = asyncio.get_running_loop()
        self._over: asyncio.Future[None] = self._loop.create_future()

    async def lines(self) -> AsyncIterator[str]:
        """Yield what the client sends, until it closes its end, or sends too much without reading an answer.

        A line that is too long becomes an empty one: it is not a message, and is refused as such.
        """
        rest, is_too_long = b"", False
        while chunk := await _in_thread(lambda: os.read(self._source, CHUNK)):
            *whole, rest = (rest + chunk).split(b"\n")
            for line in whole:
                self._lines, self._bytes = self._lines + 1, self._bytes + len(line)
                if self._is_writing and (self._lines > MAX_UNREAD[0] or self._bytes > MAX_UNREAD[1]):
                    return
                yield "" if is_too_long else line.decode("utf-8", "replace")
                is_too_long = False
            if len(rest) > MAX_LINE:
                rest, is_too_long = b"", True

    async def write(self, text: str) -> None:
        """Write an answer and wait until it is written.

        Raises:
            BrokenPipeError: No client reads any more.
        """
        rest = text.encode("utf-8")
        self._is_writing = True
        while rest:
            writing = _in_thread(lambda data=rest: os.write(self._target, data))  # type: ignore[misc]
            either: list[asyncio.Future[Any]] = [writing, self._over]
            await asyncio.wait(either, return_when=asyncio.FIRST_COMPLETED)
            if not writing.done():
                writing.cancel()
                raise BrokenPipeError
            rest = rest[writing.result() :]
        self._is_writing = False
        self._lines = self._bytes = 0

    async def flush(self) -> None:
        """Do nothing: nothing is held back."""

    def end_soon(self) -> None:
        """Let the last answers be written for a moment; what waits for its reader then fails."""
        self._loop.call_later(ENDING_TIME, self._over.set_result, None)


def _in_thread(function: Callable[[], T]) -> asyncio.Future[T]:
    """Call a function in a thread that no one has to wait for."""
    return asyncio.wrap_future(in_thread(function, "elib agent pipe"))


class Complaints:
    """The error output, written by a thread: a client that does not read it must not hold up a stop."""

    def __init__(self) -> None:
        self._texts: queue.Queue[str] = queue.Queue(MAX_WAITING)
        threading.Thread(target=self._write, name="elib agent complains", daemon=True).start()

    def say(self, text: str) -> None:
        """Write a line as soon as the reader takes it; drop it if too many wait."""
        with contextlib.suppress(queue.Full):
            self._texts.put_nowait(text)

    def _write(self) -> None:
        while True:
            text = self._texts.get()
            with contextlib.suppress(OSError, ValueError):
                os.write(2, f"{text}\n".encode("utf-8", "replace"))


@contextlib.contextmanager
def standard_pipes() -> Iterator[tuple[int, int]]:
    """Take standard input and output for the protocol while the block lasts.

    What is printed meanwhile goes to the error output, and who reads standard input gets nothing.

    Yields:
        The descriptors of the real input and output.
    """
    sys.stdout.flush()
    source, target = os.dup(0), os.dup(1)
    empty = os.open(os.devnull, os.O_RDONLY)
    os.dup2(empty, 0)
    os.close(empty)
    os.dup2(2, 1)
    try:
        yield source, target
    finally:
        sys.stdout.flush()
        os.dup2(source, 0)
        os.dup2(target, 1)
