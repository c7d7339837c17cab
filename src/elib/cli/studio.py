"""``elib studio``: the page with Python in it, served to this computer."""

from __future__ import annotations

import functools
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.browser import show_page
from elib.base.errors import ArgumentError
from elib.base.files import PACKAGE
from elib.cli.joystick import NoBrowser
from elib.cli.serving import Port, listening

STUDIO = PACKAGE.parents[1] / "build/studio"
"""Where ``make studio`` puts it."""


class Handler(SimpleHTTPRequestHandler):
    """Sends the files of the studio, and writes no log."""

    extensions_map = {  # the tables of a computer may know none of them, or others
        **SimpleHTTPRequestHandler.extensions_map,
        ".js": "text/javascript",
        ".mjs": "text/javascript",
        ".wasm": "application/wasm",
        ".whl": "application/zip",
    }

    def end_headers(self) -> None:
        """End the headers of an answer."""
        self.send_header("Cache-Control", "no-cache")  # it may have been built again
        super().end_headers()

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002
        """Write nothing."""


def studio(
    folder: Annotated[str | None, Cli(help="The built studio (default: the one of this checkout).")] = None,
    /,
    *,
    port: Port = None,
    no_browser: NoBrowser = False,
) -> None:
    """Write programs and watch their robots in the browser, where Python runs too, until Ctrl-C.

    A checkout builds the studio with `make studio`; packages of elib do not contain it. Only this computer can open it.
    Any web server can offer the folder to others.

    For example:
        elib studio
        elib studio ~/Downloads/studio
    """
    where = STUDIO if folder is None else Path(folder)
    if not (where / "worker.js").is_file():
        raise ArgumentError(
            f"there is no studio in {where}", hint="make studio, in a checkout of elib, builds it; or name its folder"
        )
    with listening(port=port) as address:
        handler = functools.partial(Handler, directory=str(where))
        with ThreadingHTTPServer(("", 0), handler, bind_and_activate=False) as server:
            server.socket.close()
            server.socket = address.socket
            print(address.url, flush=True)
            if not no_browser:
                show_page(address.url)
            server.serve_forever()
