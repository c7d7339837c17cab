"""The robot's end of a pseudo terminal: the port that ``elib simulate`` offers."""

from __future__ import annotations

import asyncio
import errno
import os
import select
import sys
import termios
import tty
from collections.abc import Callable

from elib.link.transport.base import BufferedTransport

CHUNK = 4096  # most bytes that a pty gives at once
CHUNKS_AT_ONCE = 16  # so that a client that floods the port does not block the event loop


class PtyTransport(BufferedTransport):
    """The master side of a new pty in raw mode; clients open :attr:`path`, leave, and come again.

    If a client leaves, the link is not lost: its unread bytes are dropped, :attr:`on_hang_up` is called, and the next
    one may come. While no program has the port open, everything written is dropped, as over Bluetooth.

    Only Linux tells that a client left. There a pty without a client reports a hang-up all the time, which would keep
    an event loop busy, so an edge-triggered poll of its own watches it. Elsewhere the port stays open on this side too,
    and a change of clients is not noticed.

    Raises:
        OSError: The system has no more ptys.
    """

    def __init__(self, *, origin: str = "simulator") -> None:
        self._master, port = os.openpty()
        try:
            self.path = os.ttyname(port)  # name of the port that clients open, like `/dev/pts/5`
            tty.setraw(port)
        finally:
            if sys.platform == "linux":
                os.close(port)
        super().__init__(f"serial://{self.path}", origin=origin)
        os.set_blocking(self._master, False)
        # called when the last client has left, after its bytes were delivered
        self.on_hang_up: Callable[[], None] | None = None
        self._out = bytearray()
        self._is_reading = False
        self._loop = asyncio.get_running_loop()
        if sys.platform == "linux":
            self._port = -1
            self._poll = select.epoll()
            self._poll.register(self._master, select.EPOLLIN | select.EPOLLHUP | select.EPOLLET)
            self._watched = self._poll.fileno()
            self._poll.poll(0)  # the hang-up of our own opening
        else:
            self._port = port
            self._watched = self._master
        self._resume()

    @property
    def has_client(self) -> bool:
        """Whether a program has the port open, as far as the system tells."""
        if self._closed:
            return False
        question = select.poll()
        question.register(self._master, 0)
        return not any(event & select.POLLHUP for _, event in question.poll(0))

    def send_nowait(self, data: bytes) -> bool:
        """Send *data* without waiting; return False if there is no client or no room."""
        return self.has_client and super().send_nowait(data)

    def abort(self) -> None:
        """Take the port away; a client that has it open sees a lost link."""
        if self._closed:
            return
        self._pause()
        self._drop_output()
        self._mark_closed()
        if sys.platform == "linux":
            self._poll.close()
        else:
            os.close(self._port)
        os.close(self._master)

    def _push(self, data: bytes) -> None:
        """Hand *data* to the client; without a client it is dropped."""
        if not self.has_client:
            return
        if not self._out:
            data = data[self._write_some(data) :]
        if data:
            self._loop.add_writer(self._master, self._flush)
            self._out += data

    def _flush(self) -> None:
        del self._out[: self._write_some(self._out)]
        if not self._out:
            self._drop_output()

    def _write_some(self, data: bytes | bytearray) -> int:
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            return len(data)  # there is no client

    def _drop_output(self) -> None:
        self._out.clear()
        self._loop.remove_writer(self._master)
        self.wake_writer()

    def _unsent(self) -> int:
        return len(self._out)

    def _read_all(self) -> None:
        """Deliver what arrived, then handle a hang-up: the client's last bytes come first."""
        if self._closed:
            return
        hung_up = sys.platform == "linux" and any(edge & select.EPOLLHUP for _, edge in self._poll.poll(0))
        for _ in range(CHUNKS_AT_ONCE):
            data = self._read_some() if self._is_reading else b""
            if not data:
                break
            self.feed(data)
        else:
            self._loop.call_soon(self._read_all)  # an edge does not come again
        if hung_up:
            self._hang_up()

    def _read_some(self) -> bytes:
        try:
            return os.read(self._master, CHUNK)
        except BlockingIOError:
            return b""
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            return b""  # there is no client

    def _hang_up(self) -> None:
        """Reset the port: raw mode again, without the bytes that the last client did not read."""
        self._drop_output()
        port = os.open(self.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            tty.setraw(port)
            termios.tcflush(port, termios.TCIFLUSH)
        finally:
            os.close(port)
        if sys.platform == "linux":
            self._poll.poll(0)  # the hang-up of our own opening
        self._loop.call_soon(self._read_all)  # another client may have come and gone meanwhile
        if self.on_hang_up is not None:
            self.on_hang_up()

    def _pause(self) -> None:
        self._is_reading = False
        self._loop.remove_reader(self._watched)

    def _resume(self) -> None:
        if self._is_reading or self._closed:
            return
        self._is_reading = True
        self._loop.add_reader(self._watched, self._read_all)
        # An edge that came while the poll was not watched does not come again.
        self._loop.call_soon(self._read_all)
