"""The program's side of the watchdog, a small process that stops its robots when the program dies or freezes."""

from __future__ import annotations

import contextlib
import itertools
import os
import select
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator

from elib.base.errors import Unsupported
from elib.robot import watchdog_process
from elib.robot.watchdog_process import BEAT, GUARD, GUARD_DEATH, MESSAGE, RELEASE, SILENCE

BEAT_EVERY = SILENCE / 5
"""s between two signs of life."""
RELEASE_TIME = 0.25
"""s that the watchdog has to release a line before this program closes it."""


def is_supported() -> bool:
    """Return whether this system can pass an open line to another process, and this Python can start one."""
    # In a zip archive or a frozen program there is no script, and the executable may be the program itself.
    can_start = bool(sys.executable) and os.path.isfile(watchdog_process.__file__)
    return can_start and hasattr(socket, "send_fds") and sys.platform != "win32"


def check_supported() -> None:
    """Check that this system supports the watchdog.

    Raises:
        Unsupported: This system does not support the watchdog.
    """
    if not is_supported():
        raise Unsupported("this system does not support the watchdog", hint="leave watchdog=True out")


_is_usual = False


@contextlib.contextmanager
def watched() -> Iterator[None]:
    """Let the watchdog stop every robot whose program says nothing about it, while the block lasts.

    Where it is not supported, nothing changes.
    """
    global _is_usual
    before, _is_usual = _is_usual, is_supported()
    try:
        yield
    finally:
        _is_usual = before


def is_usual() -> bool:
    """Return whether a robot has the watchdog if its program does not say so: within :func:`watched`."""
    return _is_usual


class Watchdog:
    """The watchdog of this program: one process for all robots, which runs while one of them is watched."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._keys = itertools.count(1)
        self._watched: set[int] = set()
        self._line: socket.socket | None = None

    def guard(self, number: int, data: bytes, *, beats: bool, streams: bool = False) -> int:
        """Stop the robot at the other end of a line when the program dies.

        Args:
            number: The descriptor of the line.
            data: The bytes that stop the robot.
            beats: Also stop it when :meth:`beat` was not called for half a second.
            streams: The robot streams packets, over Wi-Fi. Its connection is ended if it may be stuck.

        Returns:
            The key of the robot.

        Raises:
            Unsupported: The system does not start the process.
        """
        with self._lock:
            if self._line is None:
                self._line = _start()
            key = next(self._keys)
            self._watched.add(key)
            message = MESSAGE.pack(GUARD if beats else GUARD_DEATH, streams, len(data), key) + data
            with contextlib.suppress(OSError):
                socket.send_fds(self._line, [message], [number])
            return key

    def beat(self, key: int) -> None:
        """Tell the watchdog that the event loop of a robot runs."""
        line = self._line
        if line is not None:
            with contextlib.suppress(OSError):
                line.send(MESSAGE.pack(BEAT, False, 0, key))

    def release(self, key: int) -> None:
        """Let the watchdog release a robot's line, so that closing it frees the port."""
        with self._lock:
            if key not in self._watched or self._line is None:
                return
            self._watched.discard(key)
            with contextlib.suppress(OSError):
                self._line.send(MESSAGE.pack(RELEASE, False, 0, key))
                if select.select([self._line], [], [], RELEASE_TIME)[0]:
                    self._line.recv(1)
            if not self._watched:
                self._line.close()
                self._line = None


def _start() -> socket.socket:
    """Start the process and return this program's end of the socket to it.

    Raises:
        Unsupported: The system does not start the process.
    """
    ours, its = socket.socketpair()
    with its:
        command = [sys.executable, "-I", "-S", watchdog_process.__file__, str(its.fileno()), str(os.getpid())]
        # In a session of its own: Ctrl-C, Ctrl-Z and the end of the terminal are meant for the program only.
        try:
            process = subprocess.Popen(
                command,
                pass_fds=[its.fileno()],
                start_new_session=True,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        except OSError as error:
            ours.close()
            raise Unsupported(
                f"the watchdog cannot be started: {error}", hint="open the robot with watchdog=False"
            ) from error
    threading.Thread(target=process.wait, name="elib waits for its watchdog", daemon=True).start()
    ours.setblocking(False)
    return ours


WATCHDOG = Watchdog()
