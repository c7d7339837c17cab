"""The site of the documentation in chromium: nothing comes from elsewhere, the search works, from files too."""

import asyncio
import functools
import http.server
import subprocess
import sys
import threading
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
import pytest_asyncio
from browser import Opener, Tab, needs_browser

from shared import PATIENCE

pytestmark = [needs_browser, pytest.mark.long, pytest.mark.asyncio(loop_scope="module")]

ROOT = Path(__file__).parents[2]
KINDS = [
    "index.html",
    "tutorial/01-first-robot.html",
    "reference/commands.html",
    "reference/wire-protocol.html",
    "guides/joystick.html",
    "architecture.html",
    "examples.html",
]
"""A page of each kind."""
PICTURES_ARE_THERE = "[...document.images].every(image => image.complete && image.naturalWidth > 0)"
SEARCH = """[...document.querySelectorAll("*")].map(e => e.shadowRoot?.querySelector("input")).find(e => e)"""
FOUND = f"""(() => {{
    const root = {SEARCH}?.getRootNode();
    return root && [...root.querySelectorAll("a")].map(a => a.getAttribute("href")).join(" ");
}})()"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site") / "site"
    subprocess.run([sys.executable, ROOT / "docs/make_site.py", "--to", folder], check=True, timeout=5 * PATIENCE)
    return folder


@pytest.fixture(scope="module")
def address(site: Path) -> Iterator[str]:
    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, format: str, *args: object) -> None:  # noqa: A002
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=site)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


@pytest_asyncio.fixture(loop_scope="module")
async def tab(open_page: Opener) -> AsyncIterator[Tab]:
    tab = await open_page("about:blank")
    yield tab
    await tab.close()


async def show(tab: Tab, url: str) -> None:
    await tab.go(url)
    await tab.until(f"location.href === '{url}' && document.readyState === 'complete'")


async def search(tab: Tab, words: str, found: str) -> None:
    """Search for words until something is found."""
    await tab.until("document.querySelector('.md-search__button')?.click(), true")
    await tab.until(f"{SEARCH}?.focus(), !!({SEARCH})")
    await tab.type(words)
    await tab.until(f"{FOUND}?.includes({found!r})")


async def test_every_kind_of_page_shows_its_pictures_and_fetches_nothing_from_elsewhere(tab: Tab, address: str) -> None:
    for page in KINDS:
        await show(tab, address + page)
        await tab.until(PICTURES_ARE_THERE)
    await search(tab, "proximity", ".html")
    assert [url for url in tab.requests if not url.startswith((address, "data:", "blob:", "about:"))] == []
    assert tab.complaints == []


async def test_the_search_finds_pages(tab: Tab, address: str) -> None:
    await show(tab, address + "index.html")
    await search(tab, "set_speed", "reference/commands.html")


async def test_the_search_works_from_files(tab: Tab, site: Path) -> None:
    await show(tab, (site / "tutorial/01-first-robot.html").as_uri())
    await search(tab, "timeou", ".html")
    for letter in "ts":  # what was typed stays in the field while results arrive
        await tab.type(letter)
        await asyncio.sleep(0.2)  # clock: whatever the pause is, nothing may change what was typed
    assert await tab.run(f"{SEARCH}.value") == "timeouts"
    assert [url for url in tab.requests if not url.startswith((site.as_uri(), "data:", "blob:", "about:"))] == []


@pytest.mark.parametrize("page", KINDS)
async def test_a_phone_need_not_scroll_to_the_side(tab: Tab, address: str, page: str) -> None:
    await tab.size(390, 844, phone=True)
    await show(tab, address + page)
    await tab.until("document.documentElement.scrollWidth === 390")


async def test_the_site_follows_the_dark_theme_of_the_computer(tab: Tab, address: str) -> None:
    seen = []
    for dark in (False, True):
        await tab.size(1200, 800, dark=dark)
        await show(tab, address + "index.html")
        seen.append(await tab.run("getComputedStyle(document.body).backgroundColor"))
    assert len(set(seen)) == 2


async def test_a_block_of_code_has_a_button_that_copies_it_without_the_prompt(tab: Tab, address: str) -> None:
    await show(tab, address + "tutorial/01-first-robot.html")
    blocks = await tab.until("document.querySelectorAll('.highlight pre').length")
    await tab.until(f"document.querySelectorAll('.highlight .md-code__button').length === {blocks}")
    await tab.run(
        "document.execCommand = () => { window.copied = document.querySelector('textarea').value; return true }, 0"
    )
    await tab.run("document.querySelector('.language-console .md-code__button').click(), 0")
    assert await tab.until("window.copied") == "elib demo"
