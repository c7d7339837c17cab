"""Ports of this computer: those that only its own programs can reach, and the addresses by which others reach it."""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import re
import socket
import sys
from asyncio.trsock import TransportSocket

from elib.base.errors import ArgumentError, LinkBusy, LinkDenied, LinkError

LOOPBACK = "127.0.0.1"
EVERYWHERE = ("0.0.0.0", "::")
"""Hosts that stand for all addresses of this computer; a program can listen on them, and none can open them."""
ELSEWHERE = ("192.0.2.1", 9)
"""An address that no computer has (RFC 5737). The system is asked which of ours
would speak to it; nothing is sent."""
PORTS = 20
"""How many ports are tried where none is named."""


def bind(place: str, port: int) -> socket.socket:
    """Return a socket that listens on a port of this computer.

    Args:
        place: ``HOST:PORT`` or ``PORT``, port 0 for any free one; empty for the first free one from *port* on.
        port: The first port to try if *place* is empty.

    Raises:
        ArgumentError: *place* is not an address, or other computers could reach it.
        LinkBusy: The port is taken, or all that were tried are.
        LinkDenied: This user may not use the port.
        LinkError: The system does not give the port.
    """
    if place:
        return bound(*address(place))
    for number in range(port, port + PORTS):
        try:
            return bound(LOOPBACK, number)
        except LinkBusy:
            continue
    raise LinkBusy(f"the ports {port} to {port + PORTS - 1} are taken", hint="name another one, or 0 for a free one")


def address(text: str) -> tuple[str, int]:
    """Return host and port of ``HOST:PORT`` or ``PORT``.

    Raises:
        ArgumentError: *text* is neither, or the host is not this computer's own loopback.
    """
    host, port = split(text, 8600)
    if host == "localhost":
        return LOOPBACK, port
    try:
        is_ours = ipaddress.ip_address(host).is_loopback
    except ValueError:
        is_ours = False
    if not is_ours:
        raise ArgumentError(
            f"{host!r} is not this computer: every program that reaches the port could move robots and cut links",
            hint=f"use {LOOPBACK}:{port}; from elsewhere, come through a tunnel: ssh -L {port}:{LOOPBACK}:{port} HOST",
        )
    return host, port


def split(text: str, example: int) -> tuple[str, int]:
    """Return host and port of ``HOST:PORT`` or ``PORT``; the host is this computer unless the text names one.

    Args:
        text: The address.
        example: A port for the hint.

    Raises:
        ArgumentError: *text* is neither.
    """
    host, _, port = text.rpartition(":")
    if not re.fullmatch(r"[0-9]{1,5}", port) or int(port) > 65535:
        raise ArgumentError(
            f"{text!r} is neither HOST:PORT nor PORT; a port is from 0 to 65535", hint=f"try {LOOPBACK}:{example}"
        )
    return host.removeprefix("[").removesuffix("]") or LOOPBACK, int(port)


def named(sock: socket.socket | TransportSocket) -> str:
    """Return ``HOST:PORT`` of a bound socket, as it stands in a URL that others can open."""
    host, port = sock.getsockname()[:2]
    return joined(reachable(host), port)


def joined(host: str, port: int) -> str:
    """Return ``HOST:PORT``; an IPv6 address gets its brackets."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def reachable(host: str) -> str:
    """Return the host by which others reach a port: of a port on all addresses, this computer's own address.

    It is the address from which this computer would speak to the internet, or its name if it has no such address.
    """
    if host not in EVERYWHERE:
        return host
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking, contextlib.suppress(OSError):
        asking.connect(ELSEWHERE)
        return str(asking.getsockname()[0])
    return socket.gethostname()


def bound(host: str, port: int, *, hint: str = "") -> socket.socket:
    """Return a socket that listens on an address of this computer, so that no other program can have its port.

    Args:
        host: The address.
        port: 0 for any free one.
        hint: What to try where the system does not give the port.

    Raises:
        LinkBusy: The port is taken.
        LinkDenied: This user may not use the port.
        LinkError: The system does not give the port.
    """
    sock = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM)
    try:
        if sys.platform != "win32":  # there it would let two programs share a port
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        sock.bind((host, port))
        sock.listen()
    except OSError as error:
        sock.close()
        raise refusal(error, host, port, hint=hint) from error
    return sock


def refusal(error: OSError, host: str, port: int, *, hint: str = "") -> LinkError:
    """Return the error that says what *error*, raised while a port was opened to listen, means."""
    if error.errno == errno.EADDRINUSE:
        return LinkBusy(f"port {port} of {host} is taken", hint="choose another, or port 0 for a free one")
    if isinstance(error, PermissionError):
        return LinkDenied(f"this user may not use port {port}", hint="choose one above 1023")
    return LinkError(f"cannot listen on {host}:{port}: {error.strerror or error}", hint=hint)
