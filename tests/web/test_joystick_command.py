"""``elib joystick`` as a person starts and ends it, and as strangers attack it while it runs."""

from __future__ import annotations

import asyncio
import contextlib
import json
import signal
import socket
import sys
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

pytest.importorskip("nicegui", reason="the extra web is not installed: pip install '.[web]'")

sys.path.insert(0, str(Path(__file__).parents[1] / "cli"))
from elib_process import Running, started
from page_rig import Page, fetch, opened, until

from elib.cli import main
from elib.emulator.control import Control
from elib.emulator.server import serve
from elib.emulator.settings import SimulationSettings

DRIVING = Path(__file__).parent / "driving_panel.py"
pytestmark = pytest.mark.slow


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A home of its own, so that nothing is written into that of whoever runs the tests."""
    for name in ("HOME", "XDG_STATE_HOME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, str(tmp_path))
    return tmp_path


def driving(url: str, home: Path) -> AbstractContextManager[Running]:
    """Start a panel that drives a robot."""
    words = ("joystick", "--no-browser", "--port", "0", "--robot", url)
    return started(*words, cwd=home, command=(sys.executable, str(DRIVING)))


@contextlib.asynccontextmanager
async def robot() -> Control:
    """Offer a virtual robot in a room without walls near, on a TCP port; yield its door and its URL."""
    doors: list[Control] = []
    async with serve(SimulationSettings(world="square", baud=0), tcp="0", control=doors.append) as robots:
        yield doors[0], robots[0].url


def place(door: Control) -> tuple[float, float]:
    """Return where the robot is now."""
    door.simulation.catch_up()
    pose = door.world.pose(0)
    return pose.x, pose.y


async def moves(door: Control) -> None:
    """Wait until the robot moves."""
    began = place(door)
    await until(lambda: place(door) != began)


# -- how it begins and ends --


def test_it_prints_where_it_is_and_ends_quietly(home: Path) -> None:
    with started("joystick", "--no-browser", "--port", "0", cwd=home) as run:
        url = run.out.line()
        assert url.startswith("http://127.0.0.1:")
        status, page = fetch(url)
        assert status == 200
        assert "<title>elib joystick</title>" in page
        assert run.end() == 0
        assert (run.out.rest(), run.err.rest()) == (url, "")
    assert not list(home.glob(".nicegui*"))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
async def test_whatever_ends_it_stops_the_robot(number: signal.Signals, home: Path) -> None:
    async with robot() as (door, url):
        with driving(url, home) as run:
            await moves(door)
            assert await asyncio.to_thread(run.end, number) == 0
            assert await asyncio.to_thread(run.err.rest) == ""
        stood = place(door)
        await asyncio.sleep(0.3)
        assert place(door) == stood
        assert not door.link(0).is_connected


async def test_a_robot_that_does_not_confirm_its_stop_is_named_at_the_end(home: Path) -> None:
    async with robot() as (door, url):
        with driving(url, home) as run:
            await moves(door)
            door.cut(0)
            run.process.send_signal(signal.SIGINT)  # and another one: impatience changes nothing
            assert await asyncio.to_thread(run.end, signal.SIGTERM) == 1
            said = await asyncio.to_thread(run.err.rest)
        assert said.startswith(f"error: {url} did not confirm that it stands: it may still be moving")


def test_it_opens_the_browser_unless_told_otherwise(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = home / "shown"
    script = home / "browser"
    script.write_text(f'#!/bin/sh\necho "$1" > {shown}.new && mv {shown}.new {shown}\n')
    script.chmod(0o755)
    monkeypatch.setenv("BROWSER", f"{script} %s")
    with started("joystick", "--port", "0", cwd=home) as run:
        url = run.out.line()
        fetch(url)
        assert run.end() == 0
        for _ in range(1000):
            if shown.exists():
                break
            run.err.rest()
    assert shown.read_text().strip() == url


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--port", "70000"], 2, "--port is '70000'; it must be from 0 to 65535"),
        (["--port", "-1"], 2, "--port is '-1'"),
        (["--port", "http"], 2, "--port is 'http'"),
        (["--host", "192.0.2.77", "--port", "0"], 1, "cannot listen on 192.0.2.77"),
        (["--host", "no such host"], 1, "'no such host' is no address of this computer"),
        (["--robot", "ftp://x", "--port", "0"], 2, "there is no scheme ftp://"),
    ],
)
def test_what_cannot_be_is_said_without_a_traceback(
    arguments: list[str], code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["joystick", "--no-browser", *arguments]) == code
    assert said in capsys.readouterr().err


def test_a_port_that_is_taken_is_said_and_passed_over_if_none_was_asked_for(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        assert main(["joystick", "--no-browser", "--port", str(taken.getsockname()[1])]) == 1
        assert "taken" in capsys.readouterr().err


def test_without_the_extra_it_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert main(["joystick"]) == 1
    assert 'pip install ".[web]"' in capsys.readouterr().err


# -- shared --


def test_a_shared_panel_prints_its_token_once_and_lets_nobody_in_without(home: Path) -> None:
    with started("joystick", "--no-browser", "--host", "0.0.0.0", "--port", "0", cwd=home) as run:
        url = run.out.line()
        token = run.err.line().removeprefix("token: ")
        assert len(token) >= 22
        port = url.rstrip("/").rpartition(":")[2]
        for here in (f"http://127.0.0.1:{port}/", f"http://localhost:{port}/?token={token}"):
            status, page = fetch(here)
            assert status == 401
            assert "Token, as printed" in page
            assert token not in page
        assert fetch(f"http://127.0.0.1:{port}/", Host="evil.example")[0] == 403
        assert run.end() == 0
        assert token not in run.out.rest()
        assert run.err.rest().count(token) == 1


# -- attacks on the true pages --

SCRIPT = "<img src=x onerror=alert(1)><script>alert(2)</script>"

TRAVERSAL = [
    "static/../../../../../etc/passwd",
    "static/%2e%2e/%2e%2e/%2e%2e/storage.py",
    "static/..%2f..%2fstorage.py",
    "libraries/../storage.py",
    "components/..%2f..%2fstorage.py",
    "resources/x/..%2f..%2fetc%2fpasswd",
    "esm/elib-joystick/..%2f..%2fpages.py",
    "esm/elib-joystick/%2e%2e/%2e%2e/pages.py",
    "esm/elib-joystick//etc/passwd",
    "esm/elib-view/..%5c..%5cwire.py",
    "dynamic_resources/..%2f..%2fetc%2fpasswd",
]


def test_no_path_leads_out_of_the_folders_that_are_served(home: Path) -> None:
    from nicegui import __version__ as version

    with started("joystick", "--no-browser", "--port", "0", cwd=home) as run:
        url = run.out.line()
        assert fetch(f"{url}_nicegui/{version}/static/nicegui.js")[0] == 200
        for path in TRAVERSAL:
            status, text = fetch(f"{url}_nicegui/{version}/{path}")
            assert status in (400, 403, 404), path
            assert "import" not in text
            assert "root:" not in text
        for path in ("docs", "openapi.json", "redoc", "login", "_nicegui", "_nicegui/auto/static/x", "metrics"):
            status, text = fetch(f"{url}{path}")
            assert (status, text) == (404, "There is no such page."), path
        assert run.end() == 0
        assert run.err.rest() == ""


GARBAGE: list[tuple[object, ...]] = [
    *((), (None,), ({},), ([],), (True,), (-1,), (1e308,), (10**19,), ("\0\u202e",), (1, "2", None, {})),
    *((SCRIPT,), ("../../etc/passwd",), ("a" * 9000,), ([[[[{"value": {"value": [1, "2"]}}]]]],)),
    ({"robot": {"__proto__": []}, "left": "1", "right": None, "x": 1e308, "number": -(10**15), "value": SCRIPT},),
    (dict.fromkeys(("robot", "url", "name", "file", "text", "line", "key", "value", "label"), SCRIPT),),
]


ATTACKERS = 3
"""Pages at once: each may send a hundred messages a second."""
MOST_ATTACKED = 60
"""Listeners that each of them attacks, also such as come while it does."""


async def attack(page: Page, part: int) -> int:
    """Send everything to a part of whatever listens, as fast as a page may; return to how many it was sent."""
    attacked: set[tuple[int, str, str]] = set()
    while left := [each for each in sorted(page.listeners) if each[0] % ATTACKERS == part and each not in attacked]:
        for element, listener, kind in left[: MOST_ATTACKED - len(attacked)]:
            attacked.add((element, listener, kind))
            for arguments in GARBAGE:
                await page.emit(element, listener, *map(json.dumps, arguments))
                await asyncio.sleep(0.011)
        if len(attacked) >= MOST_ATTACKED:
            break
    return len(attacked)


async def test_garbage_for_everything_that_listens_breaks_nothing(home: Path) -> None:
    robots = ("--robot", "sim://", "--robot", "sim://line")
    with started("joystick", "--no-browser", "--port", "0", *robots, cwd=home) as run:
        url = run.out.line()
        async with contextlib.AsyncExitStack() as stack:
            pages = [await stack.enter_async_context(opened(url)) for _ in range(ATTACKERS)]
            await until(lambda: any('\\"connected\\"' in text for text in pages[0].heard))
            async with asyncio.timeout(120):
                attacked = await asyncio.gather(*(attack(page, part) for part, page in enumerate(pages)))
            assert sum(attacked) > 20
            assert (await asyncio.to_thread(fetch, url))[0] == 200
        assert await asyncio.to_thread(run.end) == 0
        assert await asyncio.to_thread(run.err.rest) == ""
    assert {path.name for path in home.rglob("*") if path.is_file()} <= {"recent-robots.json"}  # noqa: ASYNC240


async def test_a_page_cannot_act_for_another(home: Path) -> None:
    with started("joystick", "--no-browser", "--port", "0", "--robot", "sim://", cwd=home) as run:
        url = run.out.line()
        async with opened(url) as victim, opened(url) as thief:
            thief.client = victim.client
            element, listener, _ = sorted(victim.listeners)[0]
            with pytest.raises(Exception, match="1008"):
                for _ in range(100):
                    await thief.emit(element, listener, "null")
                    await asyncio.sleep(0.05)
        assert await asyncio.to_thread(run.end) == 0
        assert await asyncio.to_thread(run.err.rest) == ""
