"""Programs of the cookbook and the tutorial print in the studio what their pages show, which CPython prints.

Two of each page, drawn by its name: all together take minutes.
"""

from __future__ import annotations

import json
import random
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio
import try_links
from browser import Tab, browser, needs_browser
from studio_rig import ROOT, Server
from try_links import runs, with_needs

pytestmark = [pytest.mark.long, needs_browser, pytest.mark.asyncio(loop_scope="module")]

PAGES = sorted(path for folder in ("cookbook", "tutorial") for path in (ROOT / "docs" / folder).glob("*.md"))
READY = "window.elib?.loading.value === '' && elib.program.value.state === 'idle'"
PRINTED = f"{READY} && elib.lines.value.filter(({{ isError }}) => !isError).map(({{ text }}) => text).join('\\n')"


def programs(page: Path) -> list[tuple[int, str, str]]:
    """Return number, text and shown output of each program of a page that the studio offers to try."""
    found, earlier = [], []
    text = page.read_text(encoding="utf-8")
    for number, match in enumerate(try_links.PROGRAM.finditer(text), 1):
        shown = text[match.end() :].removeprefix("\n\n```text\n")
        whole = with_needs(match["text"], earlier)
        earlier += try_links._statements(match["text"])
        if not match["needs"] and shown != text[match.end() :] and runs(whole):
            found.append((number, whole, shown.partition("\n```")[0]))
    return found


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def tab(studio: Path) -> AsyncIterator[Tab]:
    server = Server(studio)
    async with browser() as opener:
        tab = await opener(server.url)
        await tab.until(READY)
        await tab.run("elib.speed.value = 0")
        yield tab
    server.close()


@pytest.mark.parametrize("page", [pytest.param(page, id=page.stem) for page in PAGES if programs(page)])
async def test_programs_of_a_page_print_what_it_shows(tab: Tab, page: Path) -> None:
    wrong, every = {}, programs(page)
    for number, text, shown in random.Random(page.stem).sample(every, min(2, len(every))):
        await tab.run(f"elib.borrow('test.py', {json.dumps(text)}, 'a test')")
        await tab.run("elib.run()")
        await tab.until(READY)
        await tab.drawn()  # what was printed last, too
        printed = str(await tab.run(f"{PRINTED} || ''")).rstrip()
        if printed != shown:
            wrong[number] = (printed, shown, await tab.run("elib.lines.value.map(({ text }) => text).join('\\n')"))
    assert wrong == {}


async def test_the_studio_offers_most_programs() -> None:
    assert sum(len(programs(page)) for page in PAGES) >= 80
