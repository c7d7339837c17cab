"""What the browser tests of the page share: one browser, and one panel, for each file."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest_asyncio
from local_network import pytest_asyncio_loop_factories as pytest_asyncio_loop_factories
from panel_rig import Opener, Rig, browser, panel, virtual_robot


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def open_page(request) -> AsyncIterator[Opener]:
    """What opens a page in chromium, or in Firefox where the file's tests ask for that."""
    async with getattr(request, "param", browser)() as opener:
        yield opener


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("panel")


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def address(folder) -> AsyncIterator[str]:
    """The panel, which the tests share."""
    async with panel(folder) as url:
        yield url


@pytest_asyncio.fixture(loop_scope="module")
async def robot(tmp_path) -> AsyncIterator[Rig]:
    async with virtual_robot(tmp_path) as rig:
        yield rig
