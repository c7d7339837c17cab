"""What the tests of the studio in browsers share: it is built once, and served as anybody would."""

from __future__ import annotations

import functools
import http.server
import subprocess
import sys
import threading
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
import pytest_asyncio

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "docs"), str(ROOT / "tests/panel")]

from browser import Opener, browser, firefox, needs_browser, needs_firefox  # noqa: E402

from hatch_build import NOT_BUILT  # noqa: E402
from shared import PATIENCE  # noqa: E402

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


@pytest.fixture(scope="session")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the studio."""
    folder = tmp_path_factory.mktemp("site") / "studio"
    command = [sys.executable, str(ROOT / "release/studio.py"), "--to", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=5 * PATIENCE, check=False)
    if done.returncode == NOT_BUILT:
        pytest.skip(done.stderr.splitlines()[0])
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def server(studio: Path) -> Iterator[Server]:
    """A server whose folder ``studio`` is the studio; a test may close it earlier."""
    server = Server(studio.parent)
    yield server
    server.close()


@pytest_asyncio.fixture
async def open_page(request: pytest.FixtureRequest) -> AsyncIterator[Opener]:
    """What opens a page, in a browser that knows nothing yet."""
    async with request.param() as opener:
        yield opener
