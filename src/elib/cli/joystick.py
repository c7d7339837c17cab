"""``elib joystick``: a panel in the browser, to drive and to watch robots."""

from __future__ import annotations

import contextlib
import secrets
import sys
import threading
import webbrowser
from collections.abc import Sequence
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.emulator.loopback import LOOPBACK
from elib.errors import ArgumentError
from elib.joystick.listening import PORT, listen
from elib.joystick.server import check_installed, serve
from elib.robot.running import run_coroutine

TOKEN_BYTES = 16
"""128 bits of randomness, too many to guess the token."""

Robots = Annotated[
    Sequence[str] | None,
    Cli(
        name="--robot",
        metavar="URL",
        help="sim://, serial:///dev/rfcomm0, ...; several times for several robots.",
    ),
]
Port = Annotated[
    str | None, Cli(name="--port", metavar="P", help=f"Port; 0 takes a free one (default: the first from {PORT} on).")
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


def joystick(*, robot: Robots = None, port: Port = None, host: Host = LOOPBACK, no_browser: NoBrowser = False) -> None:
    """Drive and watch robots in the browser, until Ctrl-C.

    Without --robot the page offers a virtual robot, and the robots that it was used with before. Only this computer can
    open the page, unless --host names another address.
    """
    check_installed()
    address = listen(host, _port(port))
    token = secrets.token_urlsafe(TOKEN_BYTES) if address.is_shared else None

    def announce(url: str) -> None:
        if token is not None:  # not on stdout: a script may keep its lines
            print(f"token: {token}", file=sys.stderr)
            print("The connection is not encrypted: use this in a network you trust.", file=sys.stderr)
        print(url, flush=True)
        if not no_browser:
            # In a thread: a text browser returns when it ends, and the panel must answer meanwhile.
            threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()

    with contextlib.closing(address.socket), contextlib.suppress(KeyboardInterrupt):
        run_coroutine(lambda: serve(address, robot or (), token=token, on_ready=announce))


def _port(text: str | None) -> int | None:
    if text is None:
        return None
    if not (text.isascii() and text.isdecimal() and int(text) <= 65535):
        raise ArgumentError(f"--port is {text!r}; it must be from 0 to 65535", hint="--port 0 takes a free one")
    return int(text)
