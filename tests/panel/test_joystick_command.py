"""``elib joystick`` as a person starts and ends it, and as strangers attack it while it runs."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import socket
import sys
from collections.abc import AsyncIterator
from contextlib import AbstractContextManager
from pathlib import Path

import pytest
from elib_process import Running, started
from page_rig import fetch, opened

from elib.base.extras import install
from elib.cli import main
from elib.panel.panel import Panel
from elib.panel.server import http as server
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from elib.testing import simulated
from lanes import short
from shared import PATIENCE, needs_page, until, wait_until

pytestmark = needs_page

DRIVING = Path(__file__).parent / "driving_panel.py"


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A home of its own, so that nothing is written into that of whoever runs the tests."""
    for name in ("HOME", "XDG_STATE_HOME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, str(tmp_path))
    return tmp_path


def driving(url: str, home: Path) -> AbstractContextManager[Running]:
    """Start a panel that drives a robot."""
    words = ("joystick", "--no-browser", "--port", "0", url)
    return started(*words, cwd=home, command=(sys.executable, str(DRIVING)))


@contextlib.asynccontextmanager
async def robot() -> AsyncIterator[tuple[Control, str]]:
    """Offer a virtual robot in a room without walls near, on a TCP port; yield its control and its URL."""
    controls: list[Control] = []
    async with serve(SimulationSettings(world="square", baud=0), tcp="0", control=controls.append) as robots:
        yield controls[0], robots[0].url


def place(control: Control) -> tuple[float, float]:
    """Return where the robot is now."""
    control.simulation.catch_up()
    pose = control.world.pose(0)
    return pose.x, pose.y


def standing(control: Control) -> bool:
    """Return whether the wheels stand."""
    control.simulation.catch_up()
    return not any(control.world.wheel_speeds(0))


async def moves(control: Control) -> None:
    """Wait until the robot moves."""
    began = place(control)
    await until(lambda: place(control) != began)


# -- how it begins and ends --


def test_it_prints_where_it_is_and_ends_quietly(home: Path) -> None:
    with started("joystick", "--no-browser", "--port", "0", cwd=home) as run:
        url = run.out.line()
        assert url.startswith("http://127.0.0.1:")
        status, page = fetch(url)
        assert status == 200
        assert "<title>elib</title>" in page
        assert fetch(f"{url}icon.svg")[0] == 200
        assert run.end() == 0
        assert (run.out.rest(), run.err.rest()) == (url, "")
    assert not list(home.iterdir())


@pytest.mark.parametrize("number", short([signal.SIGINT, signal.SIGTERM, signal.SIGHUP], signal.SIGTERM))
async def test_whatever_ends_it_stops_the_robot(number: signal.Signals, home: Path) -> None:
    async with robot() as (control, url):
        with driving(url, home) as run:
            await moves(control)
            assert await asyncio.to_thread(run.end, number) == 0
            assert await asyncio.to_thread(run.err.rest) == ""
        await until(lambda: standing(control))  # nobody is left who would stop it later
        await until(lambda: not control.link(0).is_connected)


@pytest.mark.long
async def test_a_robot_that_does_not_confirm_its_stop_is_named_at_the_end(home: Path) -> None:
    async with robot() as (control, url):
        with driving(url, home) as run:
            await moves(control)
            control.cut(0)
            run.process.send_signal(signal.SIGINT)  # and another one: impatience changes nothing
            assert await asyncio.to_thread(run.end, signal.SIGTERM) == 1
            said = await asyncio.to_thread(run.err.rest)
        assert said.startswith(f"error: {url} did not confirm that it stands: it may still be moving")


@pytest.mark.long
def test_it_opens_the_browser_unless_told_otherwise(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = home / "shown"
    script = home / "browser"
    script.write_text(f'#!/bin/sh\necho "$1" > {shown}.new && mv {shown}.new {shown}\n')
    script.chmod(0o755)
    monkeypatch.setenv("BROWSER", f"{script} %s")
    with started("joystick", "--port", "0", cwd=home) as run:
        url = run.out.line()
        fetch(url)
        wait_until(shown.exists)  # a thread of the program starts the browser, and ends with the program
        assert run.end() == 0
    assert shown.read_text().strip() == url


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--port", "70000"], 2, "--port is 70000; it must be a whole number from 0 to 65535"),
        (["--port", "-1"], 2, "--port is -1;"),
        (["--port", "http"], 2, "--port is 'http'"),
        (["--host", "192.0.2.77", "--port", "0"], 1, "cannot listen on 192.0.2.77"),
        (["--host", "no such host"], 1, "'no such host' is not an address of this computer"),
        (["ftp://x", "--port", "0"], 2, "there is no scheme ftp://"),
        (["sim://nowhere", "--port", "0"], 1, "there is no world 'nowhere'"),
        (["sim://crowd?robots=65", "--port", "0"], 2, "the panel has room for 64"),
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
    monkeypatch.setitem(sys.modules, "aiohttp", None)
    assert main(["joystick"]) == 1
    assert install("web") in capsys.readouterr().err


# -- shared --


@pytest.mark.long
def test_a_shared_panel_prints_its_token_once_and_lets_nobody_in_without(home: Path) -> None:
    with started("joystick", "--no-browser", "--host", "0.0.0.0", "--port", "0", cwd=home) as run:
        url = run.out.line()
        token = run.err.line().removeprefix("token: ")
        assert len(token) >= 22
        port = url.rstrip("/").rpartition(":")[2]
        for here in (f"http://127.0.0.1:{port}/", f"http://localhost:{port}/?token={token}"):
            status, page = fetch(here)
            assert status == 401
            assert "shows a token" in page
            assert token not in page
        assert fetch(f"http://127.0.0.1:{port}/", Host="evil.example")[0] == 403
        assert run.end() == 0
        assert token not in run.out.rest()
        assert run.err.rest().count(token) == 1


@pytest.mark.long
async def test_a_page_that_takes_a_robot_out_and_leaves_at_once_leaves_it_standing(home: Path) -> None:
    async with robot() as (control, url):
        with driving(url, home) as run:
            page_url = run.out.line()
            await moves(control)
            async with opened(page_url) as page:
                await page.tell("remove", robot="1")
            await until(lambda: not control.link(0).is_connected)
            await until(lambda: standing(control))  # no link is left on which a stop could come later
            assert await asyncio.to_thread(run.end) == 0


# -- the end with the last page --


@pytest.mark.long
async def test_it_ends_some_time_after_the_last_page_was_closed_if_asked_to(home: Path) -> None:
    words = ("joystick", "--no-browser", "--port", "0", "--close-with-page")
    program = "import elib.cli, elib.cli.joystick, sys; elib.cli.joystick.CLOSE_AFTER = 1.0; sys.exit(elib.cli.main())"
    with started(*words, cwd=home, command=(sys.executable, "-c", program)) as run:
        url = run.out.line()
        async with opened(url):
            pass
        assert await asyncio.to_thread(run.process.wait, PATIENCE) == 0
        assert await asyncio.to_thread(run.err.rest) == ""


@simulated
async def test_the_time_until_it_ends_begins_anew_with_each_page_and_goes_on_only_while_none_is_open() -> None:
    panel, stop = Panel(), asyncio.Event()
    server._end_when_empty(panel, 1.0, stop)
    await asyncio.sleep(5)
    assert not stop.is_set(), "no page was open yet"
    for pause in (0.9, 5):
        panel.on_visit()
        await asyncio.sleep(pause)
        assert not stop.is_set()
        panel.on_empty()
        await asyncio.sleep(0.9)
        assert not stop.is_set()
    await asyncio.sleep(0.2)
    assert stop.is_set()


@pytest.mark.long
async def test_it_ends_whatever_its_pages_do(home: Path) -> None:
    with started("joystick", "--no-browser", "--port", "0", "sim://", cwd=home) as run:
        place = run.out.line().removeprefix("http://").rstrip("/")
        host, port = place.split(":")
        async with opened(f"http://{place}/"):
            silent = [await asyncio.open_connection(host, int(port)) for _ in range(3)]
            for _, writer in silent:
                writer.write(
                    f"GET /ws HTTP/1.1\r\nHost: {place}\r\nOrigin: http://{place}\r\nUpgrade: websocket\r\n"
                    "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
                )
            for reader, _ in silent:
                assert b" 101 " in await reader.readline()
            run.process.send_signal(signal.SIGTERM)
            assert await asyncio.to_thread(run.process.wait, PATIENCE) == 0
        for _, writer in silent:
            writer.close()
        assert await asyncio.to_thread(run.err.rest) == ""
