"""A page's own doings, without a browser."""

from __future__ import annotations

import asyncio
import gc

import pytest

pytest.importorskip("nicegui", reason="the extra web is not installed: pip install '.[web]'")

from elib.web.ui.page import START, Page

from elib.testing import simulated
from elib.web.panel import Panel


@simulated
async def test_a_tab_that_is_closed_by_two_fast_clicks_is_closed_once() -> None:
    complaints: list[dict[str, object]] = []
    asyncio.get_running_loop().set_exception_handler(lambda loop, context: complaints.append(context))
    panel, shown = Panel(), list[str]()
    page = Page.__new__(Page)  # what a page has beside these needs a browser
    page.panel, page.open = panel, shown.append  # type: ignore[method-assign]
    key = panel.add("sim://?speed=max")
    await asyncio.gather(page.close_robot(key), page.close_robot(key))
    await asyncio.sleep(1)
    gc.collect()
    assert complaints == []
    assert not panel.slots
    assert shown == [START, START]
