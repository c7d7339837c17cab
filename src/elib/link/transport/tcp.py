"""Serial bytes over TCP: a robot behind a bridge, or ``elib simulate`` on another computer."""

from __future__ import annotations

import asyncio
import errno
import socket

from elib.base.errors import ArgumentError, LinkError, LinkNotFound
from elib.base.rules import Whole
from elib.base.timebase import require_real_time
from elib.link.transport.stream import StreamTransport
from elib.link.transport.url import HOST_PORT, Scheme, Url

ONE_AT_A_TIME = "it serves one program at a time: close the other one"
"""What to try if a robot on TCP accepts a connection and closes it again (wire-protocol.md, 4)."""

OPEN_TIMEOUT = 5.0
"""Seconds; a computer on the same network answers within one, even if a packet must be sent again."""


def host_and_port(url: Url) -> tuple[str, int]:
    """Return host and port of a URL that names both.

    Raises:
        ArgumentError: A part is missing, or the port is not 1 to 65535.
    """
    match = HOST_PORT.fullmatch(url.target.rstrip("/"))
    if match is None:
        raise ArgumentError(
            f"{url.target!r} is not HOST:PORT", hint=f"a URL of this kind looks like {url.scheme}://192.168.1.5:4000"
        )
    return match[1].strip("[]"), Whole(1, 65535).require(int(match[2]), "port")


async def open_tcp(url: Url) -> StreamTransport:
    """Connect to ``tcp://host:port``.

    Raises:
        LinkNotFound: There is no such host, nothing listens there, or no answer came within 5 s.
        LinkError: The system refuses for another reason.
        SimulationError: The event loop simulates time.
    """
    host, port = host_and_port(url)
    return await connect_tcp(
        StreamTransport(str(url)),
        host,
        port,
        silent="is the computer on, on the same network, and its firewall open for this port?",
        refused=f"start the server first, for a virtual robot: elib simulate --tcp {host}:{port}",
    )


async def connect_tcp(
    transport: StreamTransport, host: str, port: int, *, silent: str, refused: str
) -> StreamTransport:
    """Connect *transport* to a port, and return it.

    Args:
        transport: What the connection is for.
        host: Name or number of the host.
        port: Its port.
        silent: What to try if nothing answers at the address.
        refused: What to try if nothing listens on the port.

    Raises:
        LinkNotFound: There is no such host, nothing listens there, or no answer came within 5 s.
        LinkError: The system refuses for another reason.
        SimulationError: The event loop simulates time.
    """
    url = transport.url
    require_real_time(url)
    loop = asyncio.get_running_loop()
    try:
        async with asyncio.timeout(OPEN_TIMEOUT):
            channel, _ = await loop.create_connection(lambda: transport, host, port)
    except (socket.gaierror, UnicodeError) as error:  # UnicodeError: no host can have such a name
        raise LinkNotFound(
            f"{url}: there is no host {host!r} ({getattr(error, 'strerror', error)})",
            hint="check the spelling, or use the number of the address, like 192.168.1.5",
        ) from error
    except TimeoutError as error:
        raise LinkNotFound(f"{url}: no answer within {OPEN_TIMEOUT:g} s", hint=silent) from error
    except OSError as error:
        # For a host with several addresses there is one error without a number, made of the texts of all.
        if isinstance(error, ConnectionRefusedError) or f"[Errno {errno.ECONNREFUSED}]" in str(error):
            raise LinkNotFound(f"{url}: no program listens on port {port}", hint=refused) from error
        text = error.strerror or str(error)
        raise LinkError(f"{url}: {text}", hint="can this computer reach that network?") from error
    channel.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return transport


def _check(url: Url) -> Url:
    host_and_port(url)
    return url


SCHEME = Scheme(open_tcp, check=_check)
"""``tcp://HOST:PORT``."""
