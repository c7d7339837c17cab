"""The panel and a virtual robot, both in this program, and a person at the panel's page."""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import sys
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

from browser import Opener, Tab, browser, firefox, needs_browser, needs_firefox

from elib.base.pose import Pose
from elib.panel.panel import Panel
from elib.panel.server.http import served
from elib.panel.server.listening import listen
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from shared import PATIENCE, until

ROOM = """
[arena]
size = [2.0, 2.0]
[[box]]
position = [1.35, 1.1]
size = [0.1, 0.1]
colour = "#101010"
[[box]]
position = [1.5, 0.85]
size = [0.2, 0.2]
colour = "#f0f0f0"
[[robot]]
position = [1.0, 1.0]
heading = 0
"""
TICK = "[...elib.robots.values()].at(-1)?.tick.value"


@dataclass
class Rig:
    """A virtual robot, and what a test does with it.

    Attributes:
        control: Of its world.
        url: Opens it.
    """

    control: Control
    url: str

    @property
    def pose(self) -> Pose:
        """Where the robot truly is."""
        self.control.snapshot()
        return self.control.world.pose(0)

    @property
    def wheels(self) -> tuple[float, float]:
        """How fast the wheels turn, m/s."""
        self.control.snapshot()
        left, right = self.control.world.wheel_speeds(0)
        return left, right

    async def until(self, is_so: Callable[[], bool]) -> None:
        """Wait until something is so in the world."""
        await until(is_so)

    async def until_it_moves(self, metres: float = 0.01, radians: float = 0.2) -> None:
        """Wait until it has moved so far, or turned."""
        began = self.pose
        await self.until(lambda: far(began, self.pose) > metres or abs(turn(began, self.pose)) > radians)

    async def until_it_stands(self) -> None:
        """Wait until it has not moved for half a second of the world's time."""
        before, since = self.pose, self.control.snapshot().time

        def stands() -> bool:
            nonlocal before, since
            now, pose = self.control.snapshot().time, self.pose
            if any(self.wheels) or far(before, pose) > 1e-6 or abs(turn(before, pose)) > 1e-6:
                before, since = pose, now
            return now - since > 0.5

        await until(stands)


def far(one: Pose, other: Pose) -> float:
    return math.hypot(one.x - other.x, one.y - other.y)


def turn(one: Pose, other: Pose) -> float:
    return math.remainder(other.heading - one.heading, math.tau)


@contextlib.asynccontextmanager
async def virtual_robot(folder: Path, **settings: object) -> AsyncIterator[Rig]:
    """Serve a virtual robot on a TCP port."""
    path = folder / "room.toml"
    path.write_text(ROOM)
    doors: list[Control] = []
    built = SimulationSettings(world=str(path), **settings)  # type: ignore[arg-type]
    async with serve(built, tcp="0", control=doors.append) as robots:
        yield Rig(doors[0], robots[0].url)


@contextlib.asynccontextmanager
async def panel(folder: Path, *urls: str, port: int = 0) -> AsyncIterator[str]:
    """Serve the panel in a folder that is also its home, and yield its address."""
    with mock.patch.dict(os.environ, own(folder)):
        robots = Panel(folder=folder)
        address = listen(port=port)
        async with served(robots, address):
            try:
                for url in urls:
                    for key in robots.add_all(url, is_trusted=True):
                        robots.connect(key)
                yield address.url
            finally:
                robots.is_ending = True
                await robots.close()


def own(folder: Path) -> dict[str, str]:
    """Return the variables of the environment by which a folder is the home."""
    runtime = folder / "runtime"
    runtime.mkdir(exist_ok=True)
    return {"XDG_STATE_HOME": str(folder), "XDG_RUNTIME_DIR": str(runtime), "HOME": str(folder)}


@contextlib.asynccontextmanager
async def program(folder: Path, *words: str) -> AsyncIterator[str]:
    """Run `elib` in a folder that is also its home, and yield its first line; it must end on SIGTERM."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "elib", *words),
        cwd=folder,
        env=os.environ | own(folder),
        stdout=asyncio.subprocess.PIPE,
    )
    assert process.stdout is not None
    try:
        async with asyncio.timeout(PATIENCE):
            line = await process.stdout.readline()
        yield line.decode().strip()
    finally:
        process.terminate()
        async with asyncio.timeout(PATIENCE):
            await process.wait()


@dataclass
class Driver:
    """A person at the page.

    Attributes:
        tab: The page.
    """

    tab: Tab

    async def enter(self, url: str) -> None:
        """Type a robot's URL on the start page."""
        await self.tab.until("!!document.querySelector('.start form input')")
        await self.tab.run("document.querySelector('.start details:has(form)').open = true")
        await self.tab.run("document.querySelector('.start form input').focus()")
        await self.tab.type(url)
        await self.key("Enter", "Enter")

    async def connect(self, url: str) -> None:
        """Enter a robot's URL, and wait until the page shows it connected."""
        await self.enter(url)
        await self.tab.until(f"{TICK}?.phase === 'connected' && !!document.querySelector('.pad')")

    async def connect_all(self, url: str, robots: int) -> None:
        """Enter the URL of several robots, and wait until the overview shows them connected."""
        await self.enter(url)
        connected = "document.querySelectorAll('.robot-card [data-phase=connected]')"
        await self.tab.until(f"{connected}.length === {robots}")

    async def remove(self) -> None:
        """Take the connected robot off the page, and wait for the start page or another robot."""
        await self.click("[aria-label='Remove from this page']")
        await self.click("dialog .primary")
        await self.tab.until("!document.querySelector('dialog')")

    async def click(self, selector: str) -> None:
        """Click the middle of the first element that fits."""
        await self.tab.click(f"document.querySelector({selector!r})")

    async def press(self, text: str) -> None:
        """Click the button or the tab that says so."""
        buttons = "[...document.querySelectorAll('button, a')]"
        # What cannot be pressed yet is waited for, as a person would.
        found = f"{buttons}.find(b => b.textContent.trim() === {text!r} && b.offsetParent && !b.disabled)"
        await self.tab.click(found)

    async def middle(self, selector: str) -> tuple[float, float]:
        """Return where the middle of the first element is that fits."""
        return await self.tab.middle(f"document.querySelector({selector!r})")

    async def push(self, right: float, ahead: float) -> None:
        """Push the stick so far, and hold it."""
        x, y = await self.middle(".pad")
        reach = 0.37 * float(await self.tab.run("document.querySelector('.pad').clientWidth"))  # type: ignore[arg-type]
        await self.tab.mouse("mousePressed", x, y)
        await self.tab.mouse("mouseMoved", x + right * reach, y - ahead * reach)

    async def let_go(self) -> None:
        """Let the stick go."""
        x, y = await self.middle(".pad")
        await self.tab.mouse("mouseReleased", x, y)

    async def key(self, key: str, code: str, *, kind: str = "") -> None:
        """Press and release a key, or only one of both."""
        await self.tab.key(key, code, kind=kind)


__all__ = [
    "TICK",
    "Driver",
    "Opener",
    "Rig",
    "browser",
    "far",
    "firefox",
    "needs_browser",
    "needs_firefox",
    "panel",
    "program",
    "turn",
    "virtual_robot",
]
