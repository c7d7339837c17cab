"""Bluetooth by address, without a port, where the system and this Python have Bluetooth sockets.

It was never run with a radio: the addresses, the missing socket family and the mapping of errors are tested, the
connection itself is not.
"""

from __future__ import annotations

import asyncio
import errno
import socket

from elib.base.errors import ArgumentError, LinkBusy, LinkDenied, LinkError, LinkNotFound, Unsupported
from elib.base.timebase import require_real_time
from elib.link.transport.stream import StreamTransport
from elib.link.transport.url import BLUETOOTH_ADDRESS, Scheme, Url

OPEN_TIMEOUT = 10.0
"""Seconds; looking for a robot takes a radio up to 5.12 s by Bluetooth's default page timeout."""

EPUCK1_CHANNEL, EPUCK2_CHANNEL = 1, 2
"""RFCOMM channels of the line: the only service of an e-puck1, and the second of an e-puck2's GDB, UART and SPI
(wire-protocol.md, 1.1)."""

_ABSENT = {errno.EHOSTDOWN, errno.EHOSTUNREACH, errno.ETIMEDOUT, errno.ENODEV}


def bluetooth_address(url: Url) -> tuple[str, int | None]:
    """Return address and RFCOMM channel of an ``rfcomm://`` URL; None stands for a channel that is to be found.

    Raises:
        ArgumentError: The address is not six hexadecimal pairs, or the channel is not 1 to 30.
    """
    if not BLUETOOTH_ADDRESS.fullmatch(url.target):
        raise ArgumentError(
            f"{url.target!r} is not a Bluetooth address", hint="it has six pairs: rfcomm://10:00:E8:AA:BB:CC"
        )
    channel = url.keys.get("channel")
    if channel is None:
        return url.target.upper(), None
    if not channel.isascii() or not channel.isdigit() or len(channel) > 2 or not 1 <= int(channel) <= 30:
        raise ArgumentError(
            f"channel is {channel!r}; it must be from 1 to 30",
            hint=f"leave it out: an e-puck1 listens on {EPUCK1_CHANNEL}, an e-puck2 on {EPUCK2_CHANNEL}",
        )
    return url.target.upper(), int(channel)


async def open_rfcomm(url: Url) -> StreamTransport:
    """Connect to ``rfcomm://ADDRESS``, on the channel of its key or on the one where the robot has its line.

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
    # An e-puck1 refuses the e-puck2's channel. The e-puck2 has another service on the e-puck1's.
    channels = [channel] if channel is not None else [EPUCK2_CHANNEL, EPUCK1_CHANNEL]
    loop = asyncio.get_running_loop()
    while True:
        try:
            radio = socket.socket(family, socket.SOCK_STREAM, protocol)
        except OSError as error:
            raise _unsupported(url, f"this system has no Bluetooth sockets ({error.strerror})") from error
        try:
            radio.setblocking(False)
            async with asyncio.timeout(OPEN_TIMEOUT):
                await loop.sock_connect(radio, (address, channels.pop(0)))
                _, transport = await loop.create_connection(lambda: StreamTransport(str(url)), sock=radio)
                return transport
        except BaseException as error:
            radio.close()
            if isinstance(error, OSError) and not (channels and error.errno == errno.ECONNREFUSED):
                raise refusal(url, error) from error  # a TimeoutError is an OSError
            if not isinstance(error, OSError):
                raise


def refusal(url: Url, error: OSError) -> LinkError:
    """Return the error that says what *error*, raised while connecting, means and what to do."""
    if error.errno == errno.ECONNREFUSED:
        return LinkNotFound(
            f"{url}: the device has no serial service there",
            hint="is it an e-puck's address? its channel is found if the URL names none",
        )
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
    number = channel or f"{EPUCK1_CHANNEL} ({EPUCK2_CHANNEL} for an e-puck2)"
    return Unsupported(
        f"{url}: {why}",
        hint=f"on Linux: sudo rfcomm bind 0 {address} {number}, then use serial:///dev/rfcomm0; on Windows and "
        "macOS: pair the robot in the settings and use the port that appears",
    )


def _check(url: Url) -> Url:
    bluetooth_address(url)
    return url


SCHEME = Scheme(open_rfcomm, keys=("channel",), check=_check)
"""``rfcomm://ADDRESS``."""
