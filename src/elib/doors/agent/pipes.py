"""Standard input and output as an MCP server needs them: lines of a bounded length, and nothing else on the output."""

from __future__ import annotations

import asyncio
import contextlib
import os
import queue
import sys
import threading
from collections.abc import Iterator

MAX_LINE = 1 << 20
"""Bytes of a message: the longest call of a tool has less than a thousandth of this."""
CHUNK = 1 << 16
MAX_WAITING = 1000
"""Lines that wait for a slow reader of the error output; later ones are dropped."""
MAX_UNREAD = 1000, 4 << 20
"""Lines, and bytes of them, that a client may send while it reads none of its answers; then it is left."""
LAST_WORDS = 0.5
"""s that the last answers may take, after a client has closed its end or was left."""


class Lines:
    """The lines of a file descriptor, read by a thread, so that the event loop can end while it waits for input.

    A line that is too long becomes an empty one: it is not a message, and is refused as such. The lines end where the
    input ends, or where a client has sent too much without reading an answer.

    Args:
        descriptor: Number of the file descriptor.
        output: Where the answers go.
    """

    def __init__(self, descriptor: int, output: Output) -> None:
        self._descriptor, self._output = descriptor, output
        self._answers = self._count = self._bytes = 0
        self._loop = asyncio.get_running_loop()
        self._lines: asyncio.Queue[str | None] = asyncio.Queue(MAX_WAITING)
        threading.Thread(target=self._read, name="elib agent reads", daemon=True).start()

    def __aiter__(self) -> Lines:
        """Return the lines themselves."""
        return self

    async def __anext__(self) -> str:
        """Return the next line."""
        line = await self._lines.get()
        if line is None or self._is_too_much(line):
            raise StopAsyncIteration
        return line

    def _is_too_much(self, line: str) -> bool:
        """Count what came since an answer was read last; return whether no more is taken."""
        if self._answers != self._output.answers:
            self._answers, self._count, self._bytes = self._output.answers, 0, 0
        self._count, self._bytes = self._count + 1, self._bytes + len(line)
        return self._output.is_waiting and (self._count > MAX_UNREAD[0] or self._bytes > MAX_UNREAD[1])

    def _read(self) -> None:
        rest, is_too_long = b"", False
        while True:
            try:
                chunk = os.read(self._descriptor, CHUNK)
            except OSError:
                chunk = b""
            if not chunk:
                self._put(None)
                return
            *whole, rest = (rest + chunk).split(b"\n")
            for line in whole:
                if not self._put("" if is_too_long else line.decode("utf-8", "replace")):
                    return
                is_too_long = False
            if len(rest) > MAX_LINE:
                rest, is_too_long = b"", True

    def _put(self, line: str | None) -> bool:
        """Hand a line over when there is room; return whether the event loop still runs."""
        try:
            asyncio.run_coroutine_threadsafe(self._lines.put(line), self._loop).result()
        except (RuntimeError, asyncio.CancelledError):
            return False
        return True


class Output:
    """A file descriptor for text, written by a thread, so that the event loop can end while no client reads.

    Args:
        descriptor: Number of the file descriptor.

    Attributes:
        answers: Number of texts that were written.
    """

    def __init__(self, descriptor: int) -> None:
        self.answers = 0
        self._descriptor = descriptor
        self._written: asyncio.Future[None] | None = None
        self._is_over = False
        self._loop = asyncio.get_running_loop()
        self._texts: queue.SimpleQueue[tuple[bytes, asyncio.Future[None]]] = queue.SimpleQueue()
        threading.Thread(target=self._write, name="elib agent writes", daemon=True).start()

    @property
    def is_waiting(self) -> bool:
        """Whether a text waits for its reader."""
        return self._written is not None

    async def write(self, text: str) -> None:
        """Write a text and wait until it is written.

        Raises:
            BrokenPipeError: No client reads any more.
        """
        if self._is_over:
            raise BrokenPipeError
        self._written = written = self._loop.create_future()
        self._texts.put((text.encode("utf-8"), written))
        try:
            await written
        finally:
            self._written = None
        self.answers += 1

    def end(self) -> None:
        """Write no more: what waits for the reader fails."""
        self._is_over = True
        if self._written is not None:
            _settle(self._written, BrokenPipeError())

    async def flush(self) -> None:
        """Do nothing: nothing is held back."""

    def _write(self) -> None:
        while True:
            text, written = self._texts.get()
            error: OSError | None = None
            try:
                while text:
                    text = text[os.write(self._descriptor, text) :]
            except OSError as failure:
                error = failure
            try:
                self._loop.call_soon_threadsafe(_settle, written, error)
            except RuntimeError:  # the loop has ended meanwhile
                return


def _settle(written: asyncio.Future[None], error: OSError | None) -> None:
    if written.done():
        return
    if error is None:
        written.set_result(None)
    else:
        written.set_exception(error)


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
