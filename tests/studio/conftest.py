"""What the tests of the studio in browsers share: it is built once, and served as anybody would."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
import pytest_asyncio
from studio_rig import NOT_BUILT, ROOT, Opener, Server

from shared import PATIENCE


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
