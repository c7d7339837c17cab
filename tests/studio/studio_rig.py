"""A server of the studio, and the browsers that open it."""

from __future__ import annotations

import functools
import http.server
import threading
from pathlib import Path

import pytest
from browser import Opener, browser, firefox, needs_browser, needs_firefox
from hatch_build import NOT_BUILT

ROOT = Path(__file__).parents[2]

__all__ = ["BROWSERS", "NOT_BUILT", "ROOT", "Opener", "Server"]

BROWSERS = [
    pytest.param(browser, id="chromium", marks=needs_browser),
    pytest.param(firefox, id="firefox", marks=needs_firefox),
]


class Handler(http.server.SimpleHTTPRequestHandler):
    """What ``python -m http.server`` has, without its log."""

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002
        pass


class Server:
    """A server of a folder, on loopback.

    Attributes:
        url: Where the folder is.
    """

    def __init__(self, folder: Path) -> None:
        handler = functools.partial(Handler, directory=str(folder))
        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
        self.url = f"http://127.0.0.1:{self._server.server_port}/"
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def close(self) -> None:
        """Serve no more."""
        self._server.shutdown()
        self._server.server_close()
