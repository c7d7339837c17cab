"""``elib serve``: robots for programs in any language, by JSON messages over a WebSocket."""

from __future__ import annotations

import contextlib
import secrets
import sys
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.extras import check_web
from elib.cli.joystick import TOKEN_BYTES, Port, Robots
from elib.panel.server.listening import listen
from elib.robot.running import run_coroutine
from elib.simulator.emulator.loopback import LOOPBACK

Host = Annotated[
    str,
    Cli(name="--host", metavar="H", help="Address; other computers must give a token, which is printed."),
]
Token = Annotated[
    str | None, Cli(name="--token", metavar="T", help="Ask for this token, also programs on this computer.")
]
Origins = Annotated[
    list[str] | None,
    Cli(
        name="--allow-origin",
        metavar="URL",
        help="Let pages of this site connect, too; null for pages from files. May be repeated.",
    ),
]
Schema = Annotated[bool, Cli(name="--schema", help="Print the protocol as JSON Schema, and end.")]


def serve(
    *urls: Robots,
    port: Port = None,
    host: Host = LOOPBACK,
    token: Token = None,
    allow_origin: Origins = None,
    schema: Schema = False,
) -> None:
    """Let programs in any language drive and watch robots, until Ctrl-C.

    Programs connect to the first printed address and exchange JSON messages. The second address shows the same robots
    to a person, who can stop them or take over. One program or page drives a robot at a time. A robot whose driver
    falls silent stops.
    """
    check_web()
    if schema:
        import json

        from elib.doors.serve.schema import schema as protocol

        print(json.dumps(protocol(), indent=2))
        return
    if not urls:
        raise ArgumentError("there is no robot to serve", hint="name its URL: elib serve sim://")
    if token is not None and not (token.isascii() and token.isprintable() and 0 < len(token) <= 200):
        raise ArgumentError("a token has 1 to 200 ASCII characters")
    from elib.doors.serve.door import serve as serve_programs

    address = listen(host, port)
    if token is None and address.is_shared:
        token = secrets.token_urlsafe(TOKEN_BYTES)
        print(f"token: {token}", file=sys.stderr)
    if address.is_shared:
        print("The connection is not encrypted: use this in a network you trust.", file=sys.stderr)

    def announce(programs: str, page: str) -> None:
        print(f"{programs}\n{page}", flush=True)

    with contextlib.closing(address.socket), contextlib.suppress(KeyboardInterrupt):
        run_coroutine(lambda: serve_programs(address, urls, token=token, origins=allow_origin or (), on_ready=announce))
