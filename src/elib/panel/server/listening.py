"""The port of the panel: for this computer alone, or for others too."""

from __future__ import annotations

import contextlib
import ipaddress
import socket
from dataclasses import dataclass

from elib.base.errors import LinkBusy, LinkError
from elib.base.rules import PORT_NUMBER
from elib.simulator.emulator.loopback import LOOPBACK, PORTS, bound, joined, reachable

PORT = 8700
"""The first port to try where none is named; the next ones follow."""


@dataclass(frozen=True, slots=True)
class Address:
    """Where the page is served."""

    socket: socket.socket  # a socket that listens, so that no other program can have its port
    host: str  # the host as it was asked for
    is_shared: bool  # whether other computers reach it

    @property
    def port(self) -> int:
        """The number of the port."""
        return int(self.socket.getsockname()[1])

    @property
    def url(self) -> str:
        """The URL that a browser opens."""
        return f"http://{joined(reachable(self.host), self.port)}/"


def listen(host: str = LOOPBACK, port: int | None = None, option: str = "--port", first: int | None = None) -> Address:
    """Take the port of the panel, or of another server.

    Args:
        host: An address or a name of this computer.
        port: 0 for any free one; None for the first free one from *first* on.
        option: The option that names the port, for hints.
        first: The first port to try where none is named; the panel's, :data:`PORT`, unless given.
    """
    first = PORT if first is None else first
    if port is not None:
        PORT_NUMBER.require(port, "the port")
    try:
        *_, where = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError):
        raise LinkError(
            f"{host!r} is not an address of this computer", hint="0.0.0.0 means all addresses that it has"
        ) from None
    is_shared = not ipaddress.ip_address(str(where[0]).partition("%")[0]).is_loopback
    tried = range(first, first + PORTS) if port is None else (port,)
    hint = "is that an address of this computer? 0.0.0.0 means all of them"
    for number in tried:
        with contextlib.suppress(LinkBusy):
            return Address(bound(str(where[0]), number, hint=hint), host, is_shared)
    taken = f"port {port} of {host} is" if port is not None else f"the ports {first} to {first + PORTS - 1} are"
    raise LinkBusy(f"{taken} taken", hint=f"choose another with {option}, or 0 for a free one")
