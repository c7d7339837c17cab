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

``--beside FOLDER`` measures the program of another checkout of elib (with its own ``.venv``) too, in the same run.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import AsyncIterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "panel")]

from browser import CHROMIUM, Tab, browser  # noqa: E402
from panel_rig import Rig, virtual_robot  # noqa: E402

SECONDS = 10.0
ROBOTS = 20
TRIES = 15
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
ECHO = """
import asyncio, json, sys, time
from aiohttp import web
PAGE = '''<canvas style="width:300px;height:300px" class="pad"></canvas><script>
const ws = new WebSocket(`ws://${location.host}/ws`);
addEventListener("pointerdown", (e) => ws.send(String(performance.timeOrigin + e.timeStamp)));
</script>'''
async def page(request):
    return web.Response(text=PAGE, content_type="text/html")
async def socket(request):
    ws = web.WebSocketResponse(compress=False)
    await ws.prepare(request)
    async def send():
        while True:
            await asyncio.sleep(1 / float(sys.argv[1]))
            await ws.send_str("x" * int(sys.argv[2]))
    sending = asyncio.create_task(send())
    async for message in ws:
        print(1000 * time.time() - float(message.data), flush=True)
    sending.cancel()
    return ws
async def main():
    app = web.Application()
    app.router.add_get("/", page)
    app.router.add_get("/ws", socket)
    runner = web.AppRunner(app)
    await runner.setup()
    site = web.TCPSite(runner, "127.0.0.1", 0)
    await site.start()
    print(f"http://127.0.0.1:{site._server.sockets[0].getsockname()[1]}/", flush=True)
    await asyncio.Event().wait()
asyncio.run(main())
"""


@contextlib.asynccontextmanager
async def process(*words: str, folder: Path) -> AsyncIterator[tuple[asyncio.subprocess.Process, str]]:
    """Run a program until the block ends; yield it and the first line that it prints."""
    started = await asyncio.create_subprocess_exec(
        *words, stdout=asyncio.subprocess.PIPE, cwd=folder, env={**os.environ, "XDG_STATE_HOME": str(folder)}
    )
    assert started.stdout is not None
    try:
        async with asyncio.timeout(60):
            line = (await started.stdout.readline()).decode().strip()
        yield started, line
    finally:
        with contextlib.suppress(ProcessLookupError):
            started.terminate()
        await started.wait()


class Program:
    """The program of one checkout.

    Args:
        root: The checkout.
    """

    def __init__(self, root: Path) -> None:
        self.python = str(root / ".venv" / "bin" / "python")

    def command(self, *urls: str) -> list[str]:
        """Return the command line that opens the panel on some robots."""
        return [self.python, "-m", "elib", "joystick", "--no-browser", "--port", "0", *urls]


def cpu(program: asyncio.subprocess.Process) -> float:
    """Return the CPU time of a process so far, s."""
    fields = Path(f"/proc/{program.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def share(program: asyncio.subprocess.Process) -> float:
    """Return which share of a core a process takes, in percent."""
    before = cpu(program)
    await asyncio.sleep(SECONDS)
    return 100 * (cpu(program) - before) / SECONDS


async def middle(tab: Tab, selector: str) -> tuple[float, float]:
    """Return where the middle of an element is."""
    found = f"document.querySelector({selector!r})"
    await tab.until(f"!!{found}")
    await tab.run(f"{found}.scrollIntoView({{block: 'center', behavior: 'instant'}})")
    await asyncio.sleep(0.2)
    place = await tab.run(
        f"(() => {{ const b = {found}.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 4]; }})()"
    )
    x, y = place  # type: ignore[misc]
    return x, y


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


async def quickness(program: Program, opened, folder: Path) -> dict[str, float]:
    """Measure how quick the page is."""
    found: dict[str, float] = {}
    async with (
        virtual_robot(folder, baud=0) as rig,
        process(*program.command(rig.url), folder=folder) as (_, address),
    ):
        tab = await opened("about:blank")
        await tab.call("Page.addScriptToEvaluateOnNewDocument", source=STARTED)
        await tab.size(1440, 900)
        times = []
        for _ in range(5):
            await tab.call("Page.navigate", url=address)
            await tab.until("window.usableAfter")
            times.append(float(await tab.run("window.usableAfter")))  # type: ignore[arg-type]
        found["page usable, ms"] = statistics.median(times[1:])  # the first fills the browser's cache
        x, y = await middle(tab, ".pad")
        times = []
        for _ in range(TRIES):
            await asyncio.gather(
                tab.mouse("mousePressed", x, y), turned := asyncio.ensure_future(until(rig, turning=True))
            )
            times.append(turned.result() - float(await tab.run("window.pressedAt")))  # type: ignore[arg-type]
            await tab.mouse("mouseReleased", x, y)
            await until(rig, turning=False)
            await asyncio.sleep(0.3)
        found["click to robot, ms"] = statistics.median(times)
        times = []
        for _ in range(5):
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


async def costs(program: Program, opened, folder: Path) -> dict[str, float]:
    """Measure what the program and the page take of a core."""
    found: dict[str, float] = {}
    async with virtual_robot(folder) as rig, process(*program.command(rig.url), folder=folder) as (panel, address):
        await asyncio.sleep(3)
        found["one robot, no page, % of a core"] = await share(panel)
        tab = await opened(address)
        await tab.size(1440, 900)
        await tab.until(f"window.elib && {CONNECTED}")
        await asyncio.sleep(2)
        found["one robot, one page, % of a core"] = await share(panel)
        await tab.close()
    simulate = [program.python, "-m", "elib", "simulate", "crowd", "--robots", str(ROBOTS), "--tcp", "0"]
    async with process(*simulate, folder=folder) as (served, line):
        assert served.stdout is not None
        lines = [line] + [(await served.stdout.readline()).decode() for _ in range(ROBOTS - 1)]
        urls = [each.split()[1] for each in lines]
        async with process(*program.command(*urls), folder=folder) as (panel, address):
            await asyncio.sleep(8)
            found["twenty robots, no page, % of a core"] = await share(panel)
            tab = await opened(address)
            await tab.size(1440, 900)
            await tab.until("document.querySelectorAll('article').length >= 20")
            await asyncio.sleep(3)
            found["twenty robots, one page, % of a core"] = await share(panel)
            await tab.close()
    async with process(*program.command(f"sim://crowd?robots={ROBOTS}"), folder=folder) as (_, address):
        tab = await opened("about:blank")
        await tab.call("Page.addScriptToEvaluateOnNewDocument", source=FRAMES)
        await tab.size(1440, 900)
        await tab.go(address)
        await tab.until("document.querySelectorAll('article').length >= 20")
        await asyncio.sleep(5)
        found["script, ms a frame, twenty robots and their world"] = await script(tab)
        await tab.close()
    return found


async def script(tab: Tab) -> float:
    """Return the time that the page's scripts take for each frame that they draw, ms."""
    await tab.call("Performance.enable")

    async def spent() -> float:
        metrics = (await tab.call("Performance.getMetrics"))["metrics"]
        return next(each["value"] for each in metrics if each["name"] == "ScriptDuration")

    async def frames() -> float:
        return float(await tab.run("window.framesDrawn"))  # type: ignore[arg-type]

    before, first = await spent(), await frames()
    await asyncio.sleep(SECONDS)
    drawn = await frames() - first
    return 1000 * (await spent() - before) / drawn


async def floor(opened, folder: Path) -> dict[str, float]:
    """Measure a bare WebSocket server of aiohttp."""
    found: dict[str, float] = {}
    for name, rate, size in (("one", 10, 6000), ("twenty", 5, 8000)):
        async with process(sys.executable, "-c", ECHO, str(rate), str(size), folder=folder) as (server, address):
            assert server.stdout is not None
            tab = await opened(address)
            await tab.size(1440, 900)
            await asyncio.sleep(1)
            if name == "one":
                x, y = await middle(tab, ".pad")
                times = []
                for _ in range(TRIES):
                    await tab.mouse("mousePressed", x, y)
                    times.append(float(await server.stdout.readline()))
                    await tab.mouse("mouseReleased", x, y)
                    await asyncio.sleep(0.3)
                found["click to robot, ms"] = statistics.median(times)
            found[f"{name} robot{'s' * (name == 'twenty')}, one page, % of a core"] = await share(server)
            await tab.close()
    return found


async def measure(programs: dict[str, Program]) -> dict[str, dict[str, float]]:
    """Measure everything once."""
    folder = Path(tempfile.mkdtemp(prefix="elib-web-"))
    found: dict[str, dict[str, float]] = {}
    async with browser() as opened:
        found["floor"] = await floor(opened, folder)
        for name, program in programs.items():
            found[name] = await quickness(program, opened, folder) | await costs(program, opened, folder)
    return found


def main() -> None:
    """Print what was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--beside", type=Path)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if CHROMIUM is None:
        raise SystemExit("no chromium: apt-get install chromium")
    programs = {"here": Program(ROOT)} | ({"beside": Program(options.beside)} if options.beside else {})
    found = asyncio.run(measure(programs))
    if options.json:
        print(json.dumps(found))
        return
    rows = dict.fromkeys(name for figures in found.values() for name in figures)
    print(f"{'':52}" + "".join(f"{name:>10}" for name in found))
    for row in rows:
        figures = (each.get(row) for each in found.values())
        print(f"{row:52}" + "".join(f"{'' if figure is None else f'{figure:.1f}':>10}" for figure in figures))


if __name__ == "__main__":
    main()
