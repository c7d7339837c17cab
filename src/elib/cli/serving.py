"""What the commands that serve share: their port, the token for other computers, and their usual end."""

from __future__ import annotations

import contextlib
import secrets
import sys
from collections.abc import Iterator
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.rules import PORT_NUMBER
from elib.cli.arguments import option
from elib.panel.server.listening import PORT, Address, listen
from elib.simulator.emulator.loopback import LOOPBACK

TOKEN_BYTES = 16
"""128 bits of randomness, too many to guess the token."""
MAX_TOKEN = 200
"""Characters of a token that a person chose."""

Robots = Annotated[str, Cli(help="sim://crowd?robots=20, serial:///dev/rfcomm0, ...; as many as you like.")]


def port_option(first: int) -> Cli:
    """Return the option for a port; without it the first free one from *first* on is taken."""
    return Cli(name="--port", metavar="P", help=f"Port; 0 takes a free one (default: the first from {first} on).")


Port = Annotated[int | None, PORT_NUMBER, port_option(PORT)]
Host = Annotated[str, option("--host H", "Address; other computers must give a token, which is printed.")]


@contextlib.contextmanager
def listening(host: str = LOOPBACK, port: int | None = None, first: int = PORT) -> Iterator[Address]:
    """Take a port while the block lasts. Ctrl-C is the usual end of what is served there, not a failure."""
    address = listen(host, port, first=first)
    with contextlib.closing(address.socket), contextlib.suppress(KeyboardInterrupt):
        yield address


def token_for(address: Address, token: str | None = None) -> str | None:
    """Return the token that a person chose, or a new one, which is printed, if other computers reach the address."""
    if token is not None and not (token.isascii() and token.isprintable() and 0 < len(token) <= MAX_TOKEN):
        raise ArgumentError(f"a token has 1 to {MAX_TOKEN} ASCII characters")
    if token is None and address.is_shared:
        token = secrets.token_urlsafe(TOKEN_BYTES)
        print(f"token: {token}", file=sys.stderr)  # not on stdout: a script may keep its lines
    if address.is_shared:
        print("The connection is not encrypted: use this in a network you trust.", file=sys.stderr)
    return token
