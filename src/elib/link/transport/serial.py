"""Serial ports: a cable, a bound Bluetooth port, or a pty of ``elib simulate``."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import sys

import serialx

from elib.base.errors import ArgumentError, LinkDenied, LinkError, LinkNotFound
from elib.base.timebase import require_real_time
from elib.link.transport.ports import BAUD, BRLTTY, busy, holders, list_ports
from elib.link.transport.stream import StreamTransport
from elib.link.transport.url import Scheme, Url, port_path

OPEN_TIMEOUT = 10.0
"""Seconds; opening a bound Bluetooth port looks for the robot, up to 5.12 s by Bluetooth's default."""

_ABSENT = {errno.ENOENT, errno.ENODEV, errno.ENXIO}
_SILENT = {errno.EHOSTDOWN, errno.EHOSTUNREACH, errno.ETIMEDOUT, errno.ECONNREFUSED}
_NO_PORT = {errno.ENOTTY, errno.EINVAL, errno.EISDIR}


READ_SIZE = 4096
"""Bytes read at once. serialx reserves 256 KiB at every read, which costs more than the read itself."""


class SerialTransport(StreamTransport):
    """An open serial port, locked for this program."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take over the connection."""
        if hasattr(transport, "max_size"):
            transport.max_size = READ_SIZE
        super().connection_made(transport)

    def fileno(self) -> int | None:
        """Return the file descriptor of the open port; None if there is none."""
        if self._closed or sys.platform == "win32" or not isinstance(self._channel, serialx.BaseSerialTransport):
            return None
        try:
            return int(self._channel.serial.fileno())
        except (AssertionError, OSError, ValueError):  # it is closed
            return None

    def _discard_output(self) -> None:
        # Closing a port with unsent bytes blocks in the kernel, for up to 30 s on a cable.
        if isinstance(self._channel, serialx.BaseSerialTransport):
            with contextlib.suppress(OSError, serialx.SerialException, AssertionError):
                self._channel.serial.reset_write_buffer()


async def open_serial(url: Url) -> SerialTransport:
    """Open the port ``serial:///dev/rfcomm0`` or ``serial://COM3``; what it received before is dropped.

    Raises:
        LinkNotFound: There is no such port, or no robot answers behind it within 10 s.
        LinkBusy: Another program holds it; the message names it, if the system tells.
        LinkDenied: This user may not open it.
        LinkError: The path is not a serial port, or the system refuses for another reason.
        SimulationError: The event loop simulates time.
    """
    require_real_time(f"{url}")
    path = url.target
    transport = SerialTransport(str(url))
    opening = asyncio.create_task(_open(path, transport), name=f"open {path}")
    try:
        await asyncio.wait({opening}, timeout=OPEN_TIMEOUT)
    except asyncio.CancelledError:
        _abandon(opening)
        await transport.close()
        raise
    if not opening.done():
        _abandon(opening)
        await transport.close()
        raise LinkNotFound(
            f"{url}: the port did not open within {OPEN_TIMEOUT:g} s",
            hint="is the robot switched on and in range? a bound Bluetooth port looks for it first",
        )
    try:
        opening.result()
    except Exception as error:
        raise await asyncio.to_thread(_explain, url, path, error) from error
    return transport


async def _open(path: str, transport: SerialTransport) -> None:
    loop = asyncio.get_running_loop()
    await serialx.create_serial_connection(loop, lambda: transport, path, baudrate=BAUD, exclusive=True)


def _abandon(opening: asyncio.Task[None]) -> None:
    """Cancel *opening* without waiting: serialx itself waits until the system call returns."""
    opening.cancel()
    opening.add_done_callback(_forget)


def _forget(opening: asyncio.Task[None]) -> None:
    if not opening.cancelled():
        opening.exception()


def _explain(url: Url, path: str, error: Exception) -> LinkError:
    """Return the error that says what *error*, raised while opening, means and what to do."""
    # termios.error and serialx's own exceptions are not OSErrors, but have the number in the same place.
    number = error.errno if isinstance(error, OSError) else next(iter(error.args), None)
    taken = {errno.EBUSY, errno.EAGAIN} | ({errno.EACCES} if sys.platform == "win32" else set())
    if number in _ABSENT:
        return _absent(url, path)
    if number in _SILENT:
        return LinkNotFound(
            f"{url}: no robot answers behind this port", hint="switch the robot on; is it paired and in range?"
        )
    if number in taken:
        return busy(url, holders(path))
    if number in (errno.EACCES, errno.EPERM):
        return _denied(url, path)
    if number in _NO_PORT:
        return LinkError(f"{url}: {path} is not a serial port", hint=f"ports of this computer: {_ports() or 'none'}")
    text = (error.strerror if isinstance(error, OSError) else None) or str(error)
    return LinkError(f"{url}: the port cannot be opened ({text})")


def _absent(url: Url, path: str) -> LinkNotFound:
    if "rfcomm" in path:
        hint = "bind the robot's address to it: sudo rfcomm bind 0 10:00:E8:AA:BB:CC 1 (an e-puck2's channel is 2)"
    else:
        hint = "is the cable plugged in, the robot on and paired?"
        if sys.platform == "linux" and "ttyUSB" in path:
            hint += f" {BRLTTY}"
    return LinkNotFound(f"{url}: there is no port {path}; this computer has {_ports() or 'none'}", hint=hint)


def _denied(url: Url, path: str) -> LinkDenied:
    match sys.platform:
        case "linux":
            group, is_member = _group(path)
            hint = f"join the group of the port and log in again: sudo usermod -aG {group} $USER"
            if is_member:
                hint = f"you are in the group {group} already, but not in this login: log out and in again"
        case "darwin":
            hint = "use the /dev/cu.* name of the port, and look at its rights with ls -l"
        case _:
            hint = "look at the rights of the port"
    return LinkDenied(f"{url}: this user may not open the port", hint=hint)


def _group(path: str) -> tuple[str, bool]:
    """Return the group that may use a port on Linux, and whether the user has joined it since logging in."""
    import grp
    import pwd

    try:
        number = os.stat(path).st_gid
        group = grp.getgrgid(number)
        user = pwd.getpwuid(os.getuid()).pw_name
    except (OSError, KeyError):
        return "dialout", False
    if number == 0:
        return "dialout", False  # root's own port: its rights were set by hand, so the usual group is as good
    return group.gr_name, user in group.gr_mem and number not in os.getgroups()


def _ports() -> str:
    return ", ".join(list_ports())


def _check(url: Url) -> Url:
    """Return *url* with the path of its port."""
    target = url.target
    if not target:
        raise ArgumentError(f"{str(url)!r} names no port", hint="write serial:///dev/rfcomm0 or serial://COM3")
    if target.startswith("dev/"):
        raise ArgumentError(f"{str(url)!r} has two slashes where three belong", hint=f"write serial:///{target}")
    if "/" not in target:
        with contextlib.suppress(ArgumentError):  # it may also be a link in this folder
            return Url("serial", port_path(target))
    return Url("serial", os.path.expanduser(target))


SCHEME = Scheme(open_serial, check=_check)
"""``serial://PORT``."""
