"""What the page of ``elib joystick`` costs, and how quick it is, in a real browser, beside a bare WebSocket.

Figures, the medians of several tries where there are tries:

- ``click to robot``: from the press on the pad, by the clock of the browser, to the turning of the wheels of a virtual
  robot in this process. The floor is the way of the same press to a bare aiohttp WebSocket server in its own process.
- ``click acknowledged``: from the click on an LED to the mark that says that it waits, on a link that is 1 s late, on
  one that loses three answers of ten and delays the others by 0.1 s or so, and on one that was just cut.
- ``dead man``: from the moment at which the scripts of the page hang until the wheels stand.
- ``page usable``: from the opening of the page to the pad of a connected robot.
- ``one robot``, ``twenty robots``: share of a core that the program takes with one page, at 10 and at 5 updates per
  second, and without a page. The floor is a bare server that sends messages of the same size as often.
- ``script``: time that the page's own scripts take for each frame, with twenty robots and their world.

``--beside`` measures the program of another checkout of elib (with its own ``.venv``) too, in the same run.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import statistics
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AbstractContextManager
from pathlib import Path
from subprocess import Popen

from echo import echo
from harness import Tables, calling, load, python_in, quick, run, simulated, started, use_tests

use_tests("panel")

from browser import CHROMIUM, Tab, browser  # noqa: E402
from panel_rig import Driver, Rig, virtual_robot  # noqa: E402

Opener = Callable[[str], Awaitable[Tab]]

ROBOTS = 20
CONNECTED = "[...elib.robots.values()].some(({tick}) => (tick?.value ?? tick)?.phase === 'connected')"
"""Also on older pages, whose tick is no signal."""
LINKS = {"late": {"latency": 1.0}, "noisy": {"loss": 0.3, "jitter": 0.1}, "cut": {"loss": 1.0}}
STARTED = """window.addEventListener('pointerdown', (event) => {
  window.pressedAt = performance.timeOrigin + event.timeStamp;
}, true);
const timer = setInterval(() => {
  const pad = document.querySelector('.pad');
  if (!pad || !window.elib || !(CONNECTED)) return;
  window.usableAfter = performance.now();
  clearInterval(timer);
}, 5);""".replace("CONNECTED", CONNECTED)
FRAMES = """window.framesDrawn = 0;
const send = WebSocket.prototype.send;
WebSocket.prototype.send = function (text) {
  if (/frames?_drawn/.test(text)) window.framesDrawn += JSON.parse(text).frames?.length ?? 1; // older ones tell of each
  send.call(this, text);
};"""


@contextlib.asynccontextmanager
async def aside(place: AbstractContextManager[tuple[Popen[str], list[str]]]) -> AsyncIterator[tuple[Popen[str], str]]:
    """Start a process while the event loop goes on, for the robot in it; give it and the first line that it prints."""
    process, [line] = await asyncio.to_thread(place.__enter__)
    try:
        yield process, line
    finally:
        await asyncio.to_thread(place.__exit__, None, None, None)


def panel(python: str, folder: Path, *urls: str) -> contextlib.AbstractAsyncContextManager[tuple[Popen[str], str]]:
    """Open the panel of a checkout on some robots."""
    command = (python, "-m", "elib", "joystick", "--no-browser", "--port", "0", *urls)
    return aside(started(*command, cwd=folder, env=os.environ | {"XDG_STATE_HOME": str(folder)}))


async def share(process: Popen[str], seconds: float) -> float:
    """Return which share of a core a process takes, in percent."""
    with load(process.pid) as used:
        await asyncio.sleep(seconds)
    return 100 * used.share


async def upper(tab: Tab) -> tuple[float, float]:
    """Return where the pad is pressed to drive ahead."""
    x, y = await Driver(tab).middle(".pad")
    height = await tab.run("document.querySelector('.pad').getBoundingClientRect().height")
    return x, y - float(height) / 4  # type: ignore[arg-type]


def is_turning(rig: Rig) -> bool:
    """Return whether the wheels of the virtual robot turn."""
    motors = rig.control.simulation.robots[0].emulator.firmware.motors
    return any(motor.speed for motor in motors)


async def until(rig: Rig, *, turning: bool) -> float:
    """Wait until the wheels turn, or stand, and return the wall clock then, ms."""
    async with asyncio.timeout(30):
        while is_turning(rig) is not turning:  # noqa: ASYNC110  # motors tell nobody
            await asyncio.sleep(0.0003)
    return 1000 * time.time()


async def quickness(python: str, opened: Opener, folder: Path, tries: int) -> dict[str, float]:
    """Measure how quick the page is."""
    found: dict[str, float] = {}
    async with (
        virtual_robot(folder, baud=0) as rig,
        panel(python, folder, rig.url) as (_, address),
    ):
        tab = await opened("about:blank")
        await tab.call("Page.addScriptToEvaluateOnNewDocument", source=STARTED)
        await tab.size(1440, 900)
        times = []
        for _ in range(1 + max(tries // 4, 1)):
            await tab.call("Page.navigate", url=address)
            await tab.until("window.usableAfter")
            times.append(float(await tab.run("window.usableAfter")))  # type: ignore[arg-type]
        found["page usable, ms"] = statistics.median(times[1:])  # the first fills the browser's cache
        x, y = await upper(tab)
        times = []
        for _ in range(tries):
            await asyncio.gather(
                tab.mouse("mousePressed", x, y), turned := asyncio.ensure_future(until(rig, turning=True))
            )
            times.append(turned.result() - float(await tab.run("window.pressedAt")))  # type: ignore[arg-type]
            await tab.mouse("mouseReleased", x, y)
            await until(rig, turning=False)
            await asyncio.sleep(0.3)
        found["click to robot, ms"] = statistics.median(times)
        times = []
        for _ in range(max(tries // 3, 1)):
            await tab.mouse("mousePressed", x, y)
            await until(rig, turning=True)
            await asyncio.sleep(0.3)
            await tab.call("Debugger.enable")
            hanging = 1000 * time.time()
            await tab.call("Debugger.pause")
            times.append(await until(rig, turning=False) - hanging)
            await tab.call("Debugger.resume")
            await tab.call("Debugger.disable")
            await tab.mouse("mouseReleased", x, y)
            await asyncio.sleep(0.5)
        found["dead man, ms"] = statistics.median(times)
        for name, faults in LINKS.items():
            rig.control.set_faults(0, **faults)
            found[f"click acknowledged on a {name} link, ms"] = await acknowledged(tab)
            rig.control.set_faults(0, **dict.fromkeys(faults, 0.0))
            await tab.until(CONNECTED + " && !document.querySelector('[aria-busy]')")
        await tab.close()
    return found


async def acknowledged(tab: Tab) -> float:
    """Return how long a click on an LED stays without a mark, ms."""
    await tab.run(
        "window.marked = new Promise((done) => { let began = NaN;"
        " addEventListener('click', () => { began = performance.now(); }, true);"
        " new MutationObserver(() => requestAnimationFrame(() => done(performance.now() - began)))"
        ".observe(document.body, {subtree: true, attributeFilter: ['aria-busy']}); }), 0"
    )
    await tab.run("document.querySelector('.lamp').dispatchEvent(new MouseEvent('click', {bubbles: true})), 0")
    return float(await tab.run("window.marked"))  # type: ignore[arg-type]


async def costs(python: str, opened: Opener, folder: Path, seconds: float) -> dict[str, float]:
    """Measure what the program and the page take of a core."""
    found: dict[str, float] = {}
    async with virtual_robot(folder) as rig, panel(python, folder, rig.url) as (program, address):
        await asyncio.sleep(3)
        found["one robot, no page, % of a core"] = await share(program, seconds)
        tab = await opened(address)
        await tab.size(1440, 900)
        await tab.until(f"window.elib && {CONNECTED}")
        await asyncio.sleep(2)
        found["one robot, one page, % of a core"] = await share(program, seconds)
        await tab.close()
    with simulated("--world", "crowd", "--tcp", "0", robots=ROBOTS, python=python) as (_, urls):
        async with panel(python, folder, *urls) as (program, address):
            await asyncio.sleep(8)
            found["twenty robots, no page, % of a core"] = await share(program, seconds)
            tab = await opened(address)
            await tab.size(1440, 900)
            await tab.until("document.querySelectorAll('article').length >= 20")
            await asyncio.sleep(3)
            found["twenty robots, one page, % of a core"] = await share(program, seconds)
            await tab.close()
    async with panel(python, folder, f"sim://crowd?robots={ROBOTS}") as (_, address):
        tab = await opened("about:blank")
        await tab.call("Page.addScriptToEvaluateOnNewDocument", source=FRAMES)
        await tab.size(1440, 900)
        await tab.go(address)
        await tab.until("document.querySelectorAll('article').length >= 20")
        await asyncio.sleep(5)
        found["script, ms a frame, twenty robots and their world"] = await script(tab, seconds)
        await tab.close()
    return found


async def script(tab: Tab, seconds: float) -> float:
    """Return the time that the page's scripts take for each frame that they draw, ms."""
    await tab.call("Performance.enable")

    async def spent() -> float:
        metrics = (await tab.call("Performance.getMetrics"))["metrics"]
        return next(each["value"] for each in metrics if each["name"] == "ScriptDuration")

    async def frames() -> float:
        return float(await tab.run("window.framesDrawn"))  # type: ignore[arg-type]

    before, first = await spent(), await frames()
    await asyncio.sleep(seconds)
    drawn = await frames() - first
    return 1000 * (await spent() - before) / drawn if drawn else math.nan  # a busy computer draws none in a second


async def floor(opened: Opener, tries: int, seconds: float) -> dict[str, float]:
    """Measure a bare WebSocket server of aiohttp."""
    found: dict[str, float] = {}
    for name, rate, size in (("one robot", 10, 6000), ("twenty robots", 5, 8000)):
        async with aside(started(*calling(echo, str(rate), str(size)))) as (server, address):
            assert server.stdout is not None
            tab = await opened(address)
            await tab.size(1440, 900)
            await asyncio.sleep(1)
            if name == "one robot":
                x, y = await upper(tab)
                times = []
                for _ in range(tries):
                    await tab.mouse("mousePressed", x, y)
                    times.append(float(await asyncio.to_thread(server.stdout.readline)))
                    await tab.mouse("mouseReleased", x, y)
                    await asyncio.sleep(0.3)
                found["click to robot, ms"] = statistics.median(times)
            found[f"{name}, one page, % of a core"] = await share(server, seconds)
            await tab.close()
    return found


async def all_of(pythons: dict[str, str], tries: int, seconds: float) -> dict[str, dict[str, float]]:
    """Return the figures of the floor and of each checkout."""
    with tempfile.TemporaryDirectory(prefix="elib-web-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        async with browser() as opened:
            found = {"floor": await floor(opened, tries, seconds)}
            for column, python in pythons.items():
                quickly = await quickness(python, opened, folder, tries)
                found[column] = quickly | await costs(python, opened, folder, seconds)
    return found


@quick(tries=1, seconds=1.0)
def measure(*, beside: Path | None = None, tries: int = 15, seconds: float = 10.0) -> Tables:
    """Measure.

    Args:
        beside: Another checkout of elib to measure too, with its own ``.venv``.
        tries: Of a click.
        seconds: How long a share of a core is measured.
    """
    if CHROMIUM is None:
        raise SystemExit("no chromium: apt-get install chromium")
    pythons = {"here": sys.executable} | ({"beside": python_in(beside)} if beside else {})
    found = asyncio.run(all_of(pythons, tries, seconds))
    names = dict.fromkeys(name for figures in found.values() for name in figures)
    rows = {name: {column: each[name] for column, each in found.items() if name in each} for name in names}
    yield "the page", rows


if __name__ == "__main__":
    run(__doc__, measure)
