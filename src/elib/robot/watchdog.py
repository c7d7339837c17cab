"""The program's side of the watchdog, a small process that stops a robot when the program dies or freezes."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator

from elib.base.errors import Unsupported
from elib.robot import watchdog_process

BEAT_EVERY = watchdog_process.FROZEN_AFTER / 5
"""s between two signs of life."""
RELEASE_TIME = 1.0
"""s in which the system must end a process."""


def is_supported() -> bool:
    """Return whether another process can write to an open line of this system, and this Python can start one."""
    # In a zip archive or a frozen program there is no script, and the executable may be the program itself.
    can_start = bool(sys.executable) and os.path.isfile(watchdog_process.__file__)
    return can_start and sys.platform != "win32"


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
    """The process that stops one robot when the program dies, and, from the first :meth:`beat` on, when it freezes.

    Args:
        line: The descriptor of the robot's line.
        stop: The bytes that stop the robot.
        streams: The robot streams packets, over Wi-Fi. Its connection is ended if it may be stuck.

    Raises:
        Unsupported: The system does not start the process.
    """

    def __init__(self, line: int, stop: bytes, *, streams: bool) -> None:
        script = [sys.executable, "-I", "-S", watchdog_process.__file__]
        reader, self._beats = os.pipe()
        os.set_blocking(self._beats, False)
        try:
            # In a session of its own: Ctrl-C, Ctrl-Z and the end of the terminal are meant for the program only.
            self._process = subprocess.Popen(
                [*script, stop.hex(), str(os.getpid()), str(streams)],
                start_new_session=True,
                stdin=reader,
                stdout=line,
                stderr=subprocess.DEVNULL,
            )
        except OSError as error:
            os.close(self._beats)
            hint = "open the robot with watchdog=False"
            raise Unsupported(f"the watchdog cannot be started: {error}", hint=hint) from error
        finally:
            os.close(reader)

    def beat(self) -> None:
        """Tell that the event loop of the robot runs."""
        with contextlib.suppress(OSError):
            os.write(self._beats, b".")

    def release(self) -> None:
        """End the process, so that closing the line frees the port. The program stops its robot itself."""
        self._process.kill()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(RELEASE_TIME)
        os.close(self._beats)
