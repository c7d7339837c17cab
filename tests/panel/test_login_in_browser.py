"""A person elsewhere opens the page of a shared panel: the browser asks for the token, and keeps it."""

from __future__ import annotations

import pytest
from browser import browser, needs_browser
from guard_rig import guarded
from page_rig import opened

from elib.panel.server import http as server
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


async def test_a_page_asks_for_the_token_again_after_the_program_was_started_anew() -> None:
    async with guarded(token="right-token") as rig, browser() as open_page:
        tab = await open_page(rig.url)
        await tab.until(IS_THERE)
        await tab.run("document.querySelector('#token').focus()")
        await tab.type("right-token")
        await tab.run("document.querySelector('form button').click()")
        await tab.until("!!document.querySelector('.start')")
        rig.server.access.session = "another"
        await rig.server.close()
        await tab.until(IS_THERE)


async def test_a_page_that_is_one_too_many_says_so_and_opens_when_another_is_closed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(server, "MAX_PAGES", 1)
    async with guarded() as rig, browser() as open_page:
        async with opened(rig.url):
            tab = await open_page(rig.url)
            await tab.until(
                "document.querySelector('[role=alert]')?.textContent.includes('1 pages are open. Close some')"
            )
        await tab.until("!!document.querySelector('.start') && !document.querySelector('[role=alert]')")
