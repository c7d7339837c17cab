"""``elib serve``: robots for programs in any language, by JSON messages over a WebSocket."""

from __future__ import annotations

from typing import Annotated

from elib.base.errors import ArgumentError
from elib.base.extras import check_web
from elib.cli.arguments import option
from elib.cli.serving import Host, Port, Robots, listening, token_for
from elib.robot.running import run_coroutine
from elib.simulator.emulator.loopback import LOOPBACK

Origins = Annotated[
    list[str] | None,
    option("--allow-origin URL", "Let pages of this site connect, too; null for pages from files. May be repeated."),
]


def serve(
    *urls: Robots,
    port: Port = None,
    host: Host = LOOPBACK,
    token: Annotated[str | None, option("--token T", "Ask for this token, also programs on this computer.")] = None,
    allow_origin: Origins = None,
    schema: Annotated[bool, option("--schema", "Print the protocol as JSON Schema, and end.")] = False,
) -> None:
    """Let programs in any language drive and watch robots, until Ctrl-C.

    Programs connect to the first printed address and exchange JSON messages. The second address shows the same robots
    to a person, who can stop them or take over. One program or page drives a robot at a time. A robot whose driver
    falls silent stops.

    For example:
        elib serve sim://arena
        elib serve serial:///dev/rfcomm0 --port 8700
    """
    check_web()
    if schema:
        import json

        from elib.doors.serve.schema import schema as protocol

        print(json.dumps(protocol(), indent=2))
        return
    if not urls:
        raise ArgumentError("there is no robot to serve", hint="name its URL: elib serve sim://")
    from elib.doors.serve.door import serve as serve_programs

    def announce(programs: str, page: str) -> None:
        print(f"{programs}\n{page}", flush=True)

    with listening(host, port) as address:
        token = token_for(address, token)
        run_coroutine(lambda: serve_programs(address, urls, token=token, origins=allow_origin or (), on_ready=announce))
