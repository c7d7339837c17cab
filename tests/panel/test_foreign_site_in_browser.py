"""A page of somebody else in the same browser, while the panel is open: it gets nothing and moves nothing."""

from __future__ import annotations

import asyncio
import contextlib

import pytest
from browser import browser, needs_browser
from guard_rig import SOCKET, Rig, guarded

from shared import needs_page

pytestmark = needs_page

EVIL = """<!doctype html><title>cats</title><script>
window.found = {};
const panel = "http://PANEL";
const note = (name, what) => { found[name] = what; };
const add = (kind, about) => document.body.append(Object.assign(document.createElement(kind), about));
addEventListener("DOMContentLoaded", () => {
  const socket = new WebSocket("ws://PANELSOCKET");
  socket.onopen = () => note("socket", "open");
  socket.onerror = () => note("socket", "refused");
  fetch(panel + "/").then(() => note("fetch", "read"), () => note("fetch", "refused"));
  fetch(panel + "/", {mode: "no-cors"}).then(() => note("blind", "sent"), () => note("blind", "refused"));
  fetch(panel + "/login", {method: "POST", mode: "no-cors", body: "token=x"})
    .then(() => note("post", "sent"), () => note("post", "refused"));
  const heard = (name) => ({onload: () => note(name, "seen"), onerror: () => note(name, "refused")});
  add("script", {src: panel + "/theme.js", ...heard("script")});
  add("img", {src: panel + "/worlds/arena.png", ...heard("image")});
  add("iframe", {src: panel + "/", onload: () => note("frame", "over")});
});
</script><body></body>"""


async def evil_site(rig: Rig) -> asyncio.Server:
    """Serve the page from a port of its own."""
    page = EVIL.replace("PANELSOCKET", rig.name + SOCKET).replace("PANEL", rig.name).encode()

    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        # A browser may open a connection to spare, and close it unused.
        with contextlib.closing(writer), contextlib.suppress(asyncio.IncompleteReadError, ConnectionError):
            await reader.readuntil(b"\r\n\r\n")
            writer.write(b"HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nConnection: close\r\n\r\n" + page)
            await writer.drain()

    return await asyncio.start_server(answer, "127.0.0.1", 0)


@needs_browser
@pytest.mark.parametrize("name", ["127.0.0.1", "localhost"])
@pytest.mark.long
async def test_another_sites_page_in_the_same_browser_gets_nothing(name: str) -> None:
    async with guarded() as rig, browser() as open_page, await evil_site(rig) as site:
        tab = await open_page(f"http://{name}:{site.sockets[0].getsockname()[1]}/")
        await tab.until("window.found && Object.keys(found).length == 7")
        found = await tab.run("found")
        assert isinstance(found, dict)
        assert {found[way] for way in ("socket", "fetch", "script", "image")} == {"refused"}
        assert (rig.pages, rig.heard) == ([], [])  # whatever was sent blindly came to nobody
