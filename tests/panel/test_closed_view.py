"""The page of a student: it shows one world, and opens nothing else of the computer. The teacher's asks for a token."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import urllib.error
import urllib.request
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from browser import Opener, browser, needs_browser
from page_rig import Page, fetch, opened
from websockets.exceptions import InvalidStatus

import elib
from elib.panel.panel import ALL, STUDENT, TEACHER, WORLD, Can, Panel
from elib.panel.server import http
from elib.panel.server.classroom import Classroom, Student
from elib.panel.server.http import served
from elib.panel.server.listening import listen
from elib.panel.server.messages import MESSAGES
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from shared import PATIENCE, needs_page, until

pytestmark = needs_page

TOKEN = "k7m2xq9p"
HARMLESS = {"states", "subscribe", "drawn", "frames_drawn", "stop", "choose_controller"}


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


@contextlib.asynccontextmanager
async def a_class(token: str | None = None) -> AsyncIterator[tuple[str, dict[str, Control]]]:
    """Serve the pages of two students, each with a world of his own, and that of the teacher."""
    controls: list[Control] = []
    async with contextlib.AsyncExitStack() as stack:
        for world in ("square", "arena"):
            await stack.enter_async_context(serve(SimulationSettings(world=world), tcp="0", control=controls.append))
        worlds = {"1": controls[0], "2": controls[1]}
        pages = {key: Panel(is_shared=True, can=STUDENT, worlds={"": each}) for key, each in worlds.items()}
        teacher = Panel(is_shared=True, can=TEACHER, worlds=worlds)
        server = await stack.enter_async_context(served(teacher, listen("127.0.0.1", 0), token, students=pages))
        yield server.url, worlds


def scenes(page: Page) -> dict[int, str]:
    """Return the names of the worlds that a page was shown, by channel."""
    return {told["channel"]: told["scene"]["world"] for told in page.of("scene") if told["scene"]}


async def test_a_student_needs_no_token_and_nothing_leads_from_there_to_the_teacher_s_page() -> None:
    async with a_class(TOKEN) as (url, _):
        status, text = await asyncio.to_thread(fetch, f"{url}student/2")
        assert status == 200
        for path in re.findall(r'(?:src|href)="(/[^"]+)"', text):
            assert (await asyncio.to_thread(fetch, url.rstrip("/") + path))[0] == 200, path
        for path in ("", "index.html", "ws", "worlds/arena.png", "student", "student/../", "student/%2e%2e/index.html"):
            assert (await asyncio.to_thread(fetch, url + path))[0] in (401, 404), path
        for path in ("student/3", "student/3/ws", "student/2/index.html", "student/02"):
            assert (await asyncio.to_thread(fetch, url + path, Origin=url.rstrip("/")))[0] in (401, 404), path
        with pytest.raises(InvalidStatus, match="401"):
            async with opened(url):
                pass
        with pytest.raises(InvalidStatus, match="404"):
            async with opened(f"{url}student/3"):
                pass


async def test_a_student_sees_and_changes_his_world_alone() -> None:
    async with a_class(TOKEN) as (url, worlds), opened(f"{url}student/2") as page:
        await page.ask("subscribe", what="world", of="1", channel=1)
        await page.ask("subscribe", what="world", channel=2)
        await until(lambda: len(page.frames) > 3)
        assert scenes(page) == {2: "arena"}
        before = worlds["1"].world.pose(0)
        assert not (await page.ask("move_robot", robot=0, x=0.3, y=0.4, channel=1))["ok"]
        assert (await page.ask("move_robot", robot=0, x=0.5, y=0.4, channel=2))["ok"]
        assert worlds["1"].world.pose(0) == before
        assert await refused(page, "pause", channel=2)


async def test_the_teacher_watches_all_worlds_at_once_stops_them_and_lets_them_go_on() -> None:
    async with a_class(TOKEN) as (url, worlds):
        cookie = await asyncio.to_thread(log_in, url, TOKEN)
        async with opened(url, cookie=cookie) as page:
            for key in worlds:
                await page.ask("subscribe", what="world", of=key, channel=int(key), rate=5)
            await until(lambda: scenes(page) == {1: "square", 2: "arena"})
            for do, is_paused in (("pause", True), ("resume", False)):
                for key, control in worlds.items():
                    assert (await page.ask(do, channel=int(key)))["ok"]
                    assert control.simulation.clock.is_paused is is_paused
            assert await refused(page, "add", url="sim://")
            assert await refused(page, "save_world", name="mine.toml")


async def test_a_student_who_opens_many_pages_keeps_nobody_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http, "MAX_OF_STUDENT", 2)
    async with a_class() as (url, _), contextlib.AsyncExitStack() as stack:
        for _ in range(2):
            await stack.enter_async_context(opened(f"{url}student/1"))
        with pytest.raises(InvalidStatus, match="503"):
            await stack.enter_async_context(opened(f"{url}student/1"))
        for other in ("student/2", ""):
            page = await stack.enter_async_context(opened(url + other))
            await page.ask("subscribe", what="world")
            await until(lambda page=page: page.frames)


# -- in a browser --

CONTROLS = "[...document.querySelectorAll('button, select, a, input')].map((each) => each.ariaLabel ?? each.innerText)"


@contextlib.asynccontextmanager
async def lesson(students: int) -> AsyncIterator[tuple[list[Student], Opener]]:
    """Open a class, as `elib simulate --class` does, and a browser."""
    room = Classroom(students, robot_port=0, page_port=0)
    async with room.open(SimulationSettings(world="square")) as there, browser() as open_page:
        yield there, open_page


@needs_browser
@pytest.mark.long
async def test_the_teacher_sees_who_drives_and_who_is_stuck_stops_all_and_opens_one() -> None:
    async with lesson(3) as ((_, two, three, teacher), open_page):
        tab = await open_page(teacher.page)
        await tab.size(1440, 900)
        await tab.until("window.elib && [1, 2, 3].every((k) => elib.worldOf(k).frame.value?.number > 2)")
        says = "document.querySelector(`.student[aria-label='student {}: {}']`) !== null"
        await tab.until(says.format(2, "no program"))
        async with elib.open(two.urls) as robot:
            await robot.set_speed(1, 1)  # to the wall, and on
            await tab.until(says.format(2, "a program drives"))
            await tab.until(says.format(2, "stuck"))
            assert await tab.run(says.format(3, "no program"))
        paused = "[1, 2, 3].every((k) => elib.worldOf(k).clock.value.paused === {})"
        for word, is_paused in (("STOP ALL", "true"), ("Go on", "false")):
            await tab.run(
                f"[...document.querySelectorAll('button')].find((b) => b.innerText.includes({word!r})).click()"
            )
            await tab.until(paused.format(is_paused))
        await tab.key(" ", "Space")
        await tab.until(paused.format("true"))
        await tab.run("document.querySelectorAll('.student')[2].click()")
        await tab.until("document.querySelector('.reach h1')?.innerText === 'Student 3'")
        assert three.urls in str(await tab.run("document.querySelector('.reach').innerText"))
        assert two.urls not in str(await tab.run("document.body.innerText"))
        assert tab.complaints == []


@needs_browser
@pytest.mark.long
async def test_a_student_is_told_how_to_drive_and_sees_no_control_that_can_only_fail() -> None:
    async with lesson(2) as ((one, two, _), open_page):
        tab = await open_page(two.page)
        await tab.size(390, 844, phone=True)
        await tab.until("window.elib?.worldOf().frame.value?.number > 2")
        text = str(await tab.run("document.body.innerText"))
        for line in ("Student 2", f"elib joystick {two.urls}", f'url = "{two.urls}"'):
            assert line in text
        assert one.urls not in text
        labels = str(await tab.run(f"{CONTROLS}.join()"))
        for absent in ("STOP", "another robot", "pause", "save", "speed"):
            assert absent not in labels, labels
        assert await tab.run("document.documentElement.scrollWidth") == 390
        cut_off = "[...document.querySelectorAll('.reach pre')].filter((each) => each.scrollWidth > each.clientWidth)"
        assert await tab.run(f"{cut_off}.length") == 0
        assert tab.complaints == []
