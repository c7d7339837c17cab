"""``elib joystick``: a panel in the browser, to drive and watch robots with."""

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
"""Randomness of the token: 128 bits, which nobody guesses."""

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
        help="Address to be reached at; others than this computer are asked for a token, which is printed.",
    ),
]
NoBrowser = Annotated[bool, Cli(name="--no-browser", help="Open no browser; the address is printed.")]


def joystick(*, robot: Robots = None, port: Port = None, host: Host = LOOPBACK, no_browser: NoBrowser = False) -> None:
    """Drive and watch robots in the browser, until Ctrl-C.

    Without --robot the page offers a virtual one, and the robots it was used with before. The page is for this computer
    alone, unless --host says otherwise.

    Raises:
        ElibError: A URL cannot be.
        Unsupported: The extra ``web`` is not installed.
    """
    check_installed()
    address = listen(host, _port(port))
    token = secrets.token_urlsafe(TOKEN_BYTES) if address.is_shared else None

    def announce(url: str) -> None:
        if token is not None:  # not on stdout, whose lines a script may keep
            print(f"token: {token}", file=sys.stderr)
            print("What is typed and seen travels in the clear: use this in a network you trust.", file=sys.stderr)
        print(url, flush=True)
        if not no_browser:
            # A text browser would wait for its end; and the panel answers meanwhile.
            threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()

    with contextlib.closing(address.socket), contextlib.suppress(KeyboardInterrupt):
        run_coroutine(lambda: serve(address, robot or (), token=token, on_ready=announce))


def _port(text: str | None) -> int | None:
    if text is None:
        return None
    if not (text.isascii() and text.isdecimal() and int(text) <= 65535):
        raise ArgumentError(f"--port is {text!r}; it must be from 0 to 65535", hint="--port 0 takes a free one")
    return int(text)
