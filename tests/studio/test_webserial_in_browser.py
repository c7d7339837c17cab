"""A real robot from the studio: the browser's serial port is one of the test's own, with an emulator behind it."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio
from browser import Tab, browser, needs_browser
from studio_rig import Server

from elib.link.transport import parse_url
from elib.link.transport.memory import memory_pair
from elib.simulator.emulator.settings import settings_of
from elib.simulator.emulator.simulation import Simulation
from shared import until

pytestmark = [pytest.mark.long, needs_browser, pytest.mark.asyncio(loop_scope="module")]

PORT = """
let sent, line;
const requestPort = async () => {
  sent = [];
  return {
    open: async () => {},
    close: async () => {},
    readable: new ReadableStream({ start: (controller) => void (line = controller) }),
    writable: new WritableStream({ write: (bytes) => void sent.push(...bytes) }),
  };
};
Object.defineProperty(navigator, "serial", { value: { requestPort } });
window.robot = {
  take: () => sent.splice(0),
  give: (bytes) => line.enqueue(new Uint8Array(bytes)),
  unplug: () => line.error(new Error("The device has been lost.")),
};
"""
PAUSE = 0.005
"""s between two looks at what the page has written."""
STATE = "elib.program.value.state"
READY = f"window.elib?.loading.value === '' && {STATE} === 'idle'"
DRIVE = """import elib
with elib.connect() as robot:
    print(robot.url, robot.firmware)
    robot = robot.within(60)  # clock: on a busy computer a second is too short for the cable of this test
    robot.set_speed(0.4, 0.4)
    robot.sleep(0.5)
    print(min(robot.encoders()) > 50, len(robot.proximity()))
"""
GO = """import elib
robot = elib.connect()
robot.within(60).set_speed(0.4, 0.4)
"""
DEAF, LONG = f"{GO}sum(range(10**12))", f"{GO}robot.sleep(1000)"


class Cable:
    """Carries bytes between the page and an emulator.

    Attributes:
        tab: The page.
        robots: The simulation of the robot.
    """

    def __init__(self, tab: Tab, firmware: str) -> None:
        self.tab = tab
        url = f"sim://arena?firmware={firmware}&quality=ideal"
        settings = settings_of(parse_url(url))
        self.robots = Simulation(settings, is_connected=False)
        self._line, end = memory_pair()
        self.robots.take(0, settings, url).link.attach(end)
        self._said = bytearray()
        self._line.listen(self._said.extend)

    async def carry(self) -> None:
        """Carry on, for ever."""
        while True:
            if data := await self.tab.run("robot.take()"):
                self._line.send_nowait(bytes(data))  # type: ignore[arg-type]
            said, self._said[:] = list(self._said), b""  # more may come while the page is told
            if said:
                await self.tab.run(f"robot.give({said})")
            await asyncio.sleep(PAUSE)  # clock: a cable takes its time

    def turns(self) -> bool:
        """Return whether the wheels turn."""
        self.robots.catch_up()
        assert self.robots.world is not None
        return self.robots.world.wheel_speeds(0) != (0.0, 0.0)

    def stands(self) -> bool:
        """Return whether the wheels stand."""
        return not self.turns()

    async def begin(self, text: str) -> None:
        """Begin a program on the robot of the port, and wait until it drives."""
        await self.tab.run(f"elib.borrow('test.py', {json.dumps(text)}, 'a test')")
        await self.tab.run("elib.run()")
        await until(self.turns)

    async def printed(self) -> str:
        """Wait until the program has ended, and return what it printed."""
        await self.tab.until(READY)
        await self.tab.drawn()
        return str(await self.tab.run("elib.lines.value.map(({ text }) => text).join('\\n')"))


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def tab(studio: Path) -> AsyncIterator[Tab]:
    server = Server(studio)
    async with browser() as opener:
        tab = await opener("about:blank")
        await tab.call("Page.addScriptToEvaluateOnNewDocument", source=PORT)
        await tab.go(server.url)
        await tab.until(READY)
        yield tab
    server.close()


@contextlib.asynccontextmanager
async def plugged(tab: Tab, firmware: str = "btcom-2.0") -> AsyncIterator[Cable]:
    """Choose the port of a robot in the studio, and unplug it in the end."""
    press = "[...document.querySelectorAll('button')].find((each) => each.textContent.includes('{}'))"
    for name in ("Robot: as", "Real robot"):
        await tab.until(f"!!{press.format(name)}")
        await tab.run(f"{press.format(name)}.click()")
    await tab.until("elib.robot.value === 'webserial://'")
    cable = Cable(tab, firmware)
    carrying = asyncio.ensure_future(cable.carry())
    try:
        yield cable
        await tab.run("elib.stop()")
        await tab.until(READY)
    finally:
        carrying.cancel()
        cable.robots.close()
    await tab.run("robot.unplug()")
    await tab.until("elib.robot.value === ''")


@pytest.mark.parametrize("firmware", ["btcom-1.1.3", "btcom-2.0", "asercom-1.2.2", "epuck2"])
async def test_a_program_drives_the_robot_on_the_port_and_leaves_it_standing(tab: Tab, firmware: str) -> None:
    async with plugged(tab, firmware) as cable:
        await cable.begin(DRIVE)
        assert await cable.printed() == f"webserial:// {firmware}\nTrue 8\n"
        assert cable.stands()


async def test_a_real_robot_has_no_world_to_look_at(tab: Tab) -> None:
    async with plugged(tab):
        await tab.until("document.querySelector('.stage').textContent.includes('A real robot has no world')")
        await tab.run("elib.borrow('test.py', 'print()', 'a test')")  # another program may name another world
        await tab.until(READY)
        assert await tab.run("!document.querySelector('.stage canvas')")
    await tab.until("!!document.querySelector('.stage canvas')")


async def test_the_window_stops_the_robot_when_python_is_ended_and_when_the_page_is_left(tab: Tab) -> None:
    async with plugged(tab) as cable:
        await cable.begin(DEAF)
        await cable.tab.until("elib.isSilent.value")  # it computes, and hears no stop
        await cable.tab.run("document.querySelector('#stop').click()")
        await until(cable.stands)
        assert "was ended" in await cable.printed()
        await cable.begin(LONG)
        await cable.tab.run("dispatchEvent(new Event('pagehide'))")
        await until(cable.stands)


async def test_a_paused_program_lets_no_real_robot_drive_on(tab: Tab) -> None:
    async with plugged(tab) as cable:
        await cable.begin(LONG)
        await cable.tab.run("elib.pause()")
        await until(cable.stands)


async def test_a_port_that_is_unplugged_ends_the_program_with_a_reason(tab: Tab) -> None:
    async with plugged(tab) as cable:
        await cable.begin(DRIVE.replace("sleep(0.5)", "sleep(0.5)\n    while True: robot.proximity()"))
        await cable.tab.run("robot.unplug()")
        assert "The device has been lost." in await cable.printed()
        await cable.tab.until("elib.robot.value === ''")
