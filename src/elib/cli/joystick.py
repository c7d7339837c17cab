"""``elib joystick``: a panel in the browser, to drive and to watch robots."""

from __future__ import annotations

import contextlib
import secrets
import sys
import threading
import webbrowser
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.extras import check_web
from elib.base.rules import PORT_NUMBER
from elib.panel.server.listening import PORT, listen
from elib.robot.running import run_coroutine
from elib.simulator.emulator.loopback import LOOPBACK

TOKEN_BYTES = 16
"""128 bits of randomness, too many to guess the token."""
CLOSE_AFTER = 120.0
"""s that --close-with-page waits for another page: one that is loaded again is closed for a moment."""

Robots = Annotated[str, Cli(help="sim://crowd?robots=20, serial:///dev/rfcomm0, ...; as many as you like.")]
Port = Annotated[
    int | None,
    PORT_NUMBER,
    Cli(name="--port", metavar="P", help=f"Port; 0 takes a free one (default: the first from {PORT} on)."),
]
Host = Annotated[
    str,
    Cli(
        name="--host",
        metavar="H",
        help="Address of the page; other computers must give a token, which is printed.",
    ),
]
NoBrowser = Annotated[bool, Cli(name="--no-browser", help="Do not open a browser; the address is printed.")]
CloseWithPage = Annotated[bool, Cli(name="--close-with-page", help="End two minutes after the last page was closed.")]


def joystick(
    *urls: Robots,
    port: Port = None,
    host: Host = LOOPBACK,
    no_browser: NoBrowser = False,
    close_with_page: CloseWithPage = False,
) -> None:
    """Drive and watch robots in the browser, until Ctrl-C.

    Without a URL the page offers the robots that it finds, those that it was used with before, and virtual ones. Only
    this computer can open the page, unless --host names another address.
    """
    check_web()
    from elib.panel.server.http import serve

    address = listen(host, port)
    token = secrets.token_urlsafe(TOKEN_BYTES) if address.is_shared else None

    def announce(url: str) -> None:
        if token is not None:  # not on stdout: a script may keep its lines
            print(f"token: {token}", file=sys.stderr)
            print("The connection is not encrypted: use this in a network you trust.", file=sys.stderr)
        print(url, flush=True)
        if not no_browser:
            # In a thread: a text browser returns when it ends, and the panel must answer meanwhile.
            threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()

    close_after = CLOSE_AFTER if close_with_page else None
    with contextlib.closing(address.socket), contextlib.suppress(KeyboardInterrupt):
        run_coroutine(lambda: serve(address, urls, token=token, close_after=close_after, on_ready=announce))
