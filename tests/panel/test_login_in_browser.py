"""A person elsewhere opens the page of a shared panel: the browser asks for the token, and keeps it."""

from __future__ import annotations

import pytest

pytest.importorskip("aiohttp", reason="the extra web is not installed: pip install '.[web]'")

from browser import browser, needs_browser
from guard_rig import guarded

from shared import needs_page

pytestmark = [needs_browser, pytest.mark.long, needs_page]
IS_THERE = "document.readyState === 'complete' && !!document.querySelector('#token')"


async def test_the_token_opens_the_page_and_a_wrong_one_says_so() -> None:
    async with guarded(token="right-token") as rig, browser() as open_page:
        tab = await open_page(rig.url)
        await tab.until(IS_THERE)
        assert await tab.run("getComputedStyle(document.querySelector('.note')).display") == "none"
        for word in ("wrong-token", "right-token"):
            await tab.run("document.querySelector('#token').focus()")
            await tab.type(word)
            await tab.run("document.querySelector('form button').click()")
            if word == "wrong-token":
                await tab.until("document.querySelector('.note')?.textContent === 'That is not the token.'")
                await tab.until(IS_THERE)
        await tab.until("!!document.querySelector('.start')")
        assert len(rig.pages) == 1
        assert await tab.run("document.cookie") == ""
        assert "right-token" not in await tab.run("location.href")
        assert {request.split("/")[2] for request in tab.requests if not request.startswith("data:")} == {rig.name}
        again = await open_page(rig.url)
        await again.until("!!document.querySelector('.start')")
        assert [text for text in [*tab.complaints, *again.complaints] if "401" not in text and "403" not in text] == []
