"""Bluetooth by address, without a port, where the system and this Python have Bluetooth sockets.

It was never run with a radio: the addresses, the missing socket family and the mapping of errors are tested, the
connection itself is not.
"""

from __future__ import annotations

import asyncio
import errno
import socket

from elib.errors import ArgumentError, LinkBusy, LinkDenied, LinkError, LinkNotFound, Unsupported
from elib.timebase import require_real_time
from elib.transport.stream import StreamTransport
from elib.transport.url import BLUETOOTH_ADDRESS, Scheme, Url

OPEN_TIMEOUT = 10.0
"""Seconds; looking for a robot takes a radio up to 5.12 s by Bluetooth's default page timeout."""

EPUCK2_CHANNEL = 2
"""RFCOMM channel of the e-puck2's line, the second of its services GDB, UART and SPI (wire-protocol.md, 1.1)."""

_ABSENT = {errno.EHOSTDOWN, errno.EHOSTUNREACH, errno.ETIMEDOUT, errno.ECONNREFUSED, errno.ENODEV}


def bluetooth_address(url: Url) -> tuple[str, int]:
    """Return address and RFCOMM channel of an ``rfcomm://`` URL.

    Raises:
        ArgumentError: The address is not six hexadecimal pairs, or the channel is not 1 to 30.
    """
    if not BLUETOOTH_ADDRESS.fullmatch(url.target):
        raise ArgumentError(
            f"{url.target!r} is not a Bluetooth address", hint="it has six pairs: rfcomm://10:00:E8:AA:BB:CC"
        )
    channel = url.keys.get("channel", "1")  # where the e-puck1 listens (wire-protocol.md, 1.1)
    if not channel.isascii() or not channel.isdigit() or not 1 <= int(channel) <= 30:
        raise ArgumentError(
            f"channel is {channel!r}; it must be from 1 to 30",
            hint=f"an e-puck1 listens on channel 1, an e-puck2 on channel {EPUCK2_CHANNEL}",
        )
    return url.target.upper(), int(channel)


async def open_rfcomm(url: Url) -> StreamTransport:
    """Connect to ``rfcomm://ADDRESS?channel=1``.

    Raises:
        ArgumentError: The address or the channel is wrong.
        Unsupported: This system or Python has no Bluetooth sockets; the hint says what works instead.
        LinkNotFound: The robot does not answer within 10 s.
        LinkBusy: The robot is connected to another program.
        SimulationError: The event loop simulates time.
    """
    address, channel = bluetooth_address(url)
    family = getattr(socket, "AF_BLUETOOTH", None)
    protocol = getattr(socket, "BTPROTO_RFCOMM", None)
    if family is None or protocol is None:
        raise _unsupported(url, "this Python was built without Bluetooth sockets")
    require_real_time(f"{url}")
    try:
        radio = socket.socket(family, socket.SOCK_STREAM, protocol)
    except OSError as error:
        raise _unsupported(url, f"this system has no Bluetooth sockets ({error.strerror})") from error
    try:
        radio.setblocking(False)
        loop = asyncio.get_running_loop()
        async with asyncio.timeout(OPEN_TIMEOUT):
            await loop.sock_connect(radio, (address, channel))
            _, transport = await loop.create_connection(lambda: StreamTransport(str(url)), sock=radio)
    except BaseException as error:
        radio.close()
        if isinstance(error, OSError):  # a TimeoutError is one
            raise refusal(url, error) from error
        raise
    return transport


def refusal(url: Url, error: OSError) -> LinkError:
    """Return the error that says what *error*, raised while connecting, means and what to do."""
    if isinstance(error, TimeoutError) or error.errno in _ABSENT:
        return LinkNotFound(
            f"{url}: the robot does not answer",
            hint="switch it on, turn its selector to a program that talks, pair it (the PIN is on its label)",
        )
    if error.errno == errno.EBUSY:
        return LinkBusy(f"{url}: another program is connected", hint="close the other program")
    if isinstance(error, PermissionError):
        return LinkDenied(f"{url}: this user may not connect", hint="pair the robot first, and enter its PIN")
    return LinkError(f"{url}: {error.strerror or error}")


def _unsupported(url: Url, why: str) -> Unsupported:
    address, channel = bluetooth_address(url)
    return Unsupported(
        f"{url}: {why}",
        hint=f"on Linux: sudo rfcomm bind 0 {address} {channel}, then use serial:///dev/rfcomm0; on Windows and "
        "macOS: pair the robot in the settings and use the port that appears",
    )


def _check(url: Url) -> Url:
    bluetooth_address(url)
    return url


SCHEME = Scheme(open_rfcomm, keys=("channel",), check=_check)
"""``rfcomm://ADDRESS``."""
