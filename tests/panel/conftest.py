"""What the tests of the page share: a robot in the panel, and one browser and one panel for each file."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio
from local_network import pytest_asyncio_loop_factories as pytest_asyncio_loop_factories
from panel_rig import Opener, Rig, browser, panel, virtual_robot

from elib.panel.slot import Slot


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


@pytest.fixture
def url() -> str:
    """Where the robot of a slot is, unless a file or a test says it."""
    return "sim://square?speed=max&quality=ideal"


@pytest.fixture
def firmware() -> str:
    """What runs on the robot of a slot, unless a test says it."""
    return "asercom-1.2.2"


@pytest_asyncio.fixture
async def slot(url, firmware) -> AsyncIterator[Slot]:
    """The place of a connected robot in the panel."""
    slot = Slot(f"{url}&firmware={firmware}")
    assert await slot.connect()
    yield slot
    await slot.disconnect()
