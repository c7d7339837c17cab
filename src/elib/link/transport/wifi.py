"""The TCP connection to an e-puck2 on Wi-Fi, which carries packets instead of serial bytes."""

from __future__ import annotations

import contextlib
import os
import re
import socket
import threading
import time

from elib.base.errors import ArgumentError
from elib.link.transport.stream import StreamTransport
from elib.link.transport.tcp import ONE_AT_A_TIME, connect_tcp, host_and_port
from elib.link.transport.url import Scheme, Url

PORT = 1000
"""The port on which the robot serves (wire-protocol.md, 4.1)."""
TAKING_TIME = 0.3
"""s in which the robot takes a command: two of its cycles with a picture (wire-protocol.md, 4.4)."""
_HOST = re.compile(r"\[[0-9a-fA-F:.]+\]|[\w.-]+")


class WifiTransport(StreamTransport):
    """A TCP connection that carries the packets of the e-puck2's Wi-Fi.

    A connection that is closed while packets wait in it is reset, and the robot forgets the commands that it has not
    taken yet. So the connection outlives its transport for :data:`TAKING_TIME`, read by a thread of its own.
    """

    codec = "wifi"

    def _mark_closed(self) -> None:
        super()._mark_closed()
        number = -1 if self._channel is None else self._channel.get_extra_info("socket").fileno()
        if number >= 0:
            threading.Thread(target=_outlive, args=(os.dup(number),), name="elib closes Wi-Fi").start()


def _outlive(number: int) -> None:
    """Read and drop what a robot sends for a while, then close the connection."""
    end = time.monotonic() + TAKING_TIME  # noqa: TID251  # this thread has no event loop
    with socket.socket(fileno=number) as line, contextlib.suppress(OSError):
        while (left := end - time.monotonic()) > 0:  # noqa: TID251
            line.settimeout(left)
            if not line.recv(65536):
                return


def _check(url: Url) -> Url:
    """Return the URL with its port, unless that is the usual one.

    Raises:
        ArgumentError: There is no host, or the port is not 1 to 65535.
    """
    target = url.target.rstrip("/")
    if not target:
        raise ArgumentError(f"{str(url)!r} names no host", hint="a URL of this kind looks like wifi://192.168.1.5")
    full = Url(url.scheme, f"{target}:{PORT}" if _HOST.fullmatch(target) else target)
    host_and_port(full)
    return Url(url.scheme, full.target.removesuffix(f":{PORT}"))


async def open_wifi(url: Url) -> StreamTransport:
    """Connect to ``wifi://host`` or ``wifi://host:port``.

    Raises:
        LinkNotFound: There is no such host, no robot listens there, or no answer came within 5 s.
        LinkError: The system refuses for another reason.
        SimulationError: The event loop simulates time.
    """
    host, port = host_and_port(Url(url.scheme, f"{url.target}:{PORT}" if _HOST.fullmatch(url.target) else url.target))
    return await connect_tcp(
        WifiTransport(str(url)),
        host,
        port,
        silent="is the robot on, and on the same network as this computer? Other programs may hold it; "
        + ONE_AT_A_TIME,
        refused="is it the address of the robot? Its selector must be at 15, and its Wi-Fi firmware connected to the "
        "network: ring LED 1 is then green",
    )


SCHEME = Scheme(open_wifi, check=_check)
"""``wifi://HOST`` or ``wifi://HOST:PORT``."""
