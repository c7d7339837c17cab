"""The example clients in other languages, each a program beside ``elib serve``."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import aiohttp
import pytest
import pytest_asyncio
from browser import browser, needs_browser

from shared import PATIENCE, needs_page

pytestmark = [
    needs_page,
    pytest.mark.long,
    pytest.mark.asyncio(loop_scope="module"),
    pytest.mark.skipif(sys.platform != "linux", reason="it kills programs by signals"),
]

CLIENTS = Path(__file__).parents[2] / "examples/clients"
STANDS = 20
"""Readings in a row, 50 a second, that are the same where the wheels stand."""
DRIVEN = 200
"""Steps of a wheel after which the robot has certainly been driven."""
PATIENT = "import elib.panel.drivelock as lock, elib.cli, sys; lock.DEAD_MAN = 60.0; sys.exit(elib.cli.main())"
"""``elib`` with a dead man's switch that waits longer than a busy machine keeps a client from its next message."""
LANGUAGES = ["node", "csharp", "cpp"]


class Door:
    """``elib serve`` as a program, and what a second program watches there."""

    def __init__(self, process: asyncio.subprocess.Process, url: str, socket) -> None:
        self.process, self.url, self._socket = process, url, socket
        self._next: asyncio.Future[tuple[float, tuple[int, int]]] = asyncio.get_running_loop().create_future()

    async def listen(self) -> None:
        """Take the readings as they come, so that none waits to be read."""
        async for text in self._socket:
            message = json.loads(text.data)
            if message["type"] == "readings":
                counted = message["readings"]["encoders"]
                self._next.set_result((message["time"], (counted["left"], counted["right"])))
                self._next = asyncio.get_running_loop().create_future()

    async def steps(self) -> tuple[float, tuple[int, int]]:
        """Return the next reading of the step counters, and when it was taken, s."""
        async with asyncio.timeout(PATIENCE):
            return await asyncio.shield(self._next)

    async def until_driven(self) -> None:
        """Wait until the robot has gone some way."""
        _, began = await self.steps()
        while sum(abs(now - then) for now, then in zip((await self.steps())[1], began, strict=True)) < DRIVEN:
            pass

    async def until_it_stands(self) -> None:
        """Wait until the wheels turn no more."""
        same, (_, before) = 0, await self.steps()
        while same < STANDS:
            _, steps = await self.steps()
            same, before = same + 1 if steps == before else 0, steps

    async def send(self, **message: object) -> None:
        await self._socket.send_json(message)


@contextlib.asynccontextmanager
async def opened() -> AsyncIterator[Door]:
    """Start a door, and watch its robot."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-c", PATIENT, "serve", "sim://arena", "--port", "0", "--allow-origin", "null"),
        stdout=asyncio.subprocess.PIPE,
    )
    assert process.stdout is not None
    try:
        async with asyncio.timeout(PATIENCE):
            url = (await process.stdout.readline()).decode().strip()
        async with aiohttp.ClientSession() as session, session.ws_connect(url) as socket:
            await socket.send_json({"do": "watch", "readings": ["encoders"], "rate": 50})
            served = Door(process, url, socket)
            listening = asyncio.create_task(served.listen())
            yield served
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)
    finally:
        if process.returncode is None:
            process.send_signal(signal.SIGINT)
        await process.wait()


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def door() -> AsyncIterator[Door]:
    """A door that the tests share, for it takes a second to start."""
    async with opened() as door:
        yield door


@pytest_asyncio.fixture(scope="module", loop_scope="module", params=LANGUAGES)
async def client(request, tmp_path_factory) -> Callable[[float, str], list[str]]:
    """The command that drives for some seconds at an address, compiled where that is necessary."""
    folder = tmp_path_factory.mktemp("client")
    # In a thread, for the door that is watched meanwhile leaves who does not answer its pings.
    return await asyncio.to_thread({"node": node, "csharp": csharp, "cpp": cpp}[request.param], folder)


def node(_: Path) -> Callable[[float, str], list[str]]:
    program = shutil.which("node")
    if program is None:
        pytest.skip("no node: apt-get install nodejs")
    option = "--experimental-websocket"
    if subprocess.run([program, option, "-e", "WebSocket"], check=False, capture_output=True, timeout=60).returncode:
        pytest.skip("this node has no WebSocket: it needs 20.10 or later")
    return lambda seconds, url: [program, option, str(CLIENTS / "node/avoid.mjs"), str(seconds), url]


def csharp(folder: Path) -> Callable[[float, str], list[str]]:
    if not (shutil.which("mcs") and shutil.which("mono")):
        pytest.skip("no Mono: apt-get install mono-mcs libmono-system-runtime-serialization4.0-cil")
    libraries = ("-r:System.Runtime.Serialization.dll", "-r:System.Xml.Linq.dll")
    compiled("mcs", *libraries, f"-out:{folder}/Avoid.exe", CLIENTS / "csharp/Avoid.cs")
    return lambda seconds, url: ["mono", f"{folder}/Avoid.exe", str(seconds), url]


def cpp(folder: Path) -> Callable[[float, str], list[str]]:
    headers = ("boost/beast.hpp", "nlohmann/json.hpp")
    if not (shutil.which("g++") and all(Path("/usr/include", header).exists() for header in headers)):
        pytest.skip("no Boost or JSON headers: apt-get install g++ libboost-dev nlohmann-json3-dev")
    compiled("g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", CLIENTS / "cpp/avoid.cpp", "-o", folder / "avoid")
    return lambda seconds, url: [f"{folder}/avoid", str(seconds), url.rpartition(":")[2].partition("/")[0]]


def compiled(*command: object) -> None:
    done = subprocess.run([str(word) for word in command], check=False, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr


@contextlib.asynccontextmanager
async def running(command: list[str]) -> AsyncIterator[asyncio.subprocess.Process]:
    process = await asyncio.create_subprocess_exec(
        *command, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE
    )
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()


async def said(process: asyncio.subprocess.Process) -> tuple[str, str]:
    """Wait until a program has ended; return what it printed."""
    async with asyncio.timeout(PATIENCE):
        out, error = await process.communicate()
    return out.decode(), error.decode()


async def test_each_client_has_less_than_70_lines() -> None:
    for path in CLIENTS.glob("*/*"):
        if path.suffix != ".md":
            lines = path.read_text(encoding="utf-8").splitlines()
            assert len(lines) < 70, path
            assert max(map(len, lines)) <= 130, path


async def test_a_client_drives_says_what_it_sees_and_leaves_a_standing_robot(door: Door, client) -> None:
    async with running(client(2, door.url)) as process:
        await door.until_driven()
        out, error = await said(process)
    assert (process.returncode, error) == (0, "")
    assert "0.5" in out
    assert out.splitlines()[-1] == "the robot stands"
    await door.until_it_stands()


async def test_the_robot_of_a_killed_client_stands(door: Door, client) -> None:
    async with running(client(60, door.url)) as process:
        await door.until_driven()
        process.kill()
        await door.until_it_stands()


async def test_a_client_says_that_the_door_is_gone(client) -> None:
    async with opened() as door, running(client(60, door.url)) as process:
        await door.until_driven()
        door.process.kill()
        _, error = await said(process)
    assert process.returncode == 1
    assert error.startswith("ended: ")
    assert len(error.splitlines()) == 1


async def test_a_client_says_that_somebody_stopped_its_robot(door: Door, client) -> None:
    async with running(client(60, door.url)) as process:
        await door.until_driven()
        await door.send(do="stop")
        _, error = await said(process)
    assert process.returncode == 1
    assert error.startswith("ended: ")
    await door.until_it_stands()


async def test_a_client_says_that_there_is_no_door(client) -> None:
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))  # and nobody listens there
        async with running(client(1, f"ws://127.0.0.1:{held.getsockname()[1]}/v1")) as process:
            _, error = await said(process)
    assert process.returncode == 1
    assert error.startswith("ended: ")


async def shown(open_page, url: str, seconds: float):
    """Open the page from its file, and let it drive."""
    tab = await open_page((CLIENTS / "browser/avoid.html").as_uri())
    await tab.until("document.readyState == 'complete'")
    await tab.run(f"url.value = {json.dumps(url)}, seconds.value = {seconds}, start.click()")
    return tab


@needs_browser
async def test_the_page_drives_leaves_a_standing_robot_and_says_that_the_door_is_gone() -> None:
    async with opened() as door, browser() as open_page:
        tab = await shown(open_page, door.url, 2)
        await door.until_driven()
        await tab.until("log.textContent.endsWith('the robot stands\\n')")
        assert not tab.complaints
        await door.until_it_stands()
        await tab.run("seconds.value = 60, start.click()")
        await door.until_driven()
        door.process.kill()
        await tab.until("log.textContent.includes('ended: no connection')")


@needs_browser
async def test_the_robot_of_a_killed_browser_stands(door: Door) -> None:
    with contextlib.suppress(Exception):  # the connection to the browser breaks, as it must
        async with browser() as open_page:
            await shown(open_page, door.url, 60)
            await door.until_driven()
            for group in browsers():
                os.killpg(group, signal.SIGKILL)
            await door.until_it_stands()
            return
    pytest.fail("the robot did not stand")


def browsers() -> list[int]:
    """Return the process groups of the browsers that this test has started."""
    children = [child for task in Path("/proc/self/task").glob("*/children") for child in task.read_text().split()]
    found = [int(child) for child in children if b"elib-browser-" in Path(f"/proc/{child}/cmdline").read_bytes()]
    assert found
    return found
