"""The page of a student: it shows one world, asks for its token, and opens nothing else of the computer."""

from __future__ import annotations

import asyncio
import contextlib
import os
import urllib.error
import urllib.request
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

pytest.importorskip("aiohttp", reason="the extra web is not installed: pip install '.[web]'")

from page_rig import Page, fetch, opened

from elib.panel.panel import ALL, STUDENT, WORLD, Can, Panel
from elib.panel.server.http import served
from elib.panel.server.listening import listen
from elib.panel.server.messages import MESSAGES
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from shared import PATIENCE, needs_page, until

pytestmark = needs_page

TOKEN = "k7m2xq9p"
HARMLESS = {"subscribe", "drawn", "frames_drawn", "stop", "choose_controller"}


class _Stay(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, *_: object) -> None:
        return None


def log_in(url: str, token: str) -> str:
    """Show a token, and return the cookie; empty if the token is wrong."""
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}), _Stay())
    request = urllib.request.Request(f"{url}login", f"token={token}".encode(), {"Origin": url.rstrip("/")})
    try:
        opener.open(request, timeout=PATIENCE)
    except urllib.error.HTTPError as error:
        with error:
            return (error.headers["Set-Cookie"] or "").partition(";")[0]
    return ""


@contextlib.asynccontextmanager
async def page_of_a_student(token: str | None = None) -> AsyncIterator[tuple[str, Control]]:
    controls: list[Control] = []
    async with contextlib.AsyncExitStack() as stack:
        settings = SimulationSettings(world="square")
        await stack.enter_async_context(serve(settings, tcp="0", control=controls.append))
        address = listen("127.0.0.1", 0)
        panel = Panel(is_shared=True, can=STUDENT, worlds={"": controls[0]})
        server = await stack.enter_async_context(served(panel, address, token))
        yield server.url, controls[0]


async def refused(page: Page, what: str, /, **values: object) -> bool:
    answer = await page.ask(what, **values)
    return not answer["ok"] and answer["error"]["message"].startswith("this page cannot ")


async def test_only_what_concerns_the_world_is_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    async with page_of_a_student() as (url, control), opened(url) as page:
        await page.ask("subscribe", what="world")
        await until(lambda: page.frames)
        assert page.hello["folder"] == ""
        assert await refused(page, "add", url="tcp://127.0.0.1:4002")
        assert await refused(page, "find")
        assert await refused(page, "recents")
        assert await refused(page, "forget", url="sim://")
        assert await refused(page, "files")
        assert await refused(page, "open_recording", name="run.mcap")
        assert await refused(page, "save_world", name="mine.toml")
        assert await refused(page, "start_log", robot="1", name="run.log")
        assert (await page.ask("move_robot", robot="epuck-1", x=0.3, y=0.4))["ok"]
        assert control.world.pose(0).x == pytest.approx(0.3, abs=0.01)
        assert await refused(page, "set_speed", speed=10)
        assert await refused(page, "pause")
    assert os.listdir(tmp_path) == []


def test_a_message_needs_something_that_a_page_can_do_unless_it_is_harmless() -> None:
    assert {name for name, kind in MESSAGES.items() if not kind.needs} == HARMLESS
    assert {kind.needs for kind in MESSAGES.values()} - {""} == set(Can.__struct_fields__)


@pytest.mark.parametrize("can", [ALL, WORLD, STUDENT, Can()])
async def test_a_page_is_told_what_it_can_do_and_can_do_nothing_else(can: Can, tmp_path: Path) -> None:
    address = listen("127.0.0.1", 0)
    async with served(Panel(can=can, folder=tmp_path), address) as server, opened(server.url) as page:
        told = page.hello["can"]
        for name in ("steer", "move_box", "set_speed", "save_world", "disconnect", "stop_log", "source"):
            needs = MESSAGES[name].needs
            values = {"robot": "9"} if name in ("disconnect", "stop_log") else {"name": "x"}
            values = {"steer": {"robot": "9", "left": 0, "right": 0}, "set_speed": {"speed": 1}}.get(name, values)
            values = {"box": 0, "x": 0, "y": 0} if name == "move_box" else values
            assert await refused(page, name, **values) is not told[needs], name


async def test_nothing_is_shown_without_the_token() -> None:
    async with page_of_a_student(TOKEN) as (url, _):
        status, text = await asyncio.to_thread(fetch, url)
        assert status == 401
        assert TOKEN not in text
        assert await asyncio.to_thread(log_in, url, "wrong") == ""
        cookie = await asyncio.to_thread(log_in, url, TOKEN)
        async with opened(url, cookie=cookie) as page:
            await page.ask("subscribe", what="world")
            await until(lambda: page.frames)
