"""What the panel costs, and whether it stays quick: `elib joystick` in its own process, with a real browser.

Shares of one core, as the system counts them for the panel's process: with a robot that is watched at 10 Hz and no page
(the floor), with one page, and with twenty robots in the overview at 5 Hz. Then how long a page waits, from the key to
the picture, for what its server says to a line in the console: while the link is well, and while the robot is gone.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import sys
import tempfile
from collections.abc import AsyncIterator
from pathlib import Path

TESTS = Path(__file__).parents[1] / "tests"
sys.path[:0] = [str(TESTS / "joystick"), str(TESTS / "view")]

from browser import CHROMIUM, browser  # noqa: E402
from panel_rig import Driver  # noqa: E402

SECONDS = 10.0
ROBOTS = 20
TRIES = 10


@contextlib.asynccontextmanager
async def started(*words: str, count: int = 1) -> AsyncIterator[tuple[asyncio.subprocess.Process, list[str]]]:
    """Run `elib` until the block ends; yield the process and its first lines."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "elib", *words), stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.DEVNULL
    )
    assert process.stdout is not None
    try:
        async with asyncio.timeout(60):
            lines = [(await process.stdout.readline()).decode().strip() for _ in range(count)]
        yield process, lines
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.terminate()
        await process.wait()


def cpu(process: asyncio.subprocess.Process) -> float:
    """Return the CPU time of a process so far, s."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def share(process: asyncio.subprocess.Process) -> float:
    """Return which share of a core a process takes."""
    before = cpu(process)
    await asyncio.sleep(SECONDS)
    return (cpu(process) - before) / SECONDS


WAIT = """window.waited = new Promise((done) => {
  const box = document.querySelector('.console');
  let began = NaN;
  const press = (event) => { if (event.key === 'Enter') began = performance.now(); };
  box.addEventListener('keydown', press, {capture: true});
  const seen = new MutationObserver(() => {
    if (Number.isNaN(began)) return;
    if (box.querySelectorAll('.came, .bad').length <= window.lines) return;
    seen.disconnect();
    done(performance.now() - began);
  });
  window.lines = box.querySelectorAll('.came, .bad').length;
  seen.observe(box, {childList: true, subtree: true, characterData: true});
}), 0"""


async def waited(driver: Driver) -> float:
    """Return how long the page waits for its server's answer, the longest of several times, s."""
    longest = 0.0
    for _ in range(TRIES):
        await driver.tab.run("document.querySelector('.console input').focus()")
        await driver.tab.run(WAIT)
        await driver.tab.call("Input.insertText", text="nonsense")
        await driver.key("Enter", "Enter")
        longest = max(longest, float(await driver.tab.run("window.waited")) / 1000)  # type: ignore[arg-type]
        await asyncio.sleep(0.2)
    return longest


async def measure() -> dict[str, float]:
    """Measure everything once."""
    found: dict[str, float] = {}
    os.chdir(tempfile.mkdtemp(prefix="elib-joystick-"))
    async with contextlib.AsyncExitStack() as stack:
        _, lines = await stack.enter_async_context(
            started("simulate", "crowd", "--robots", str(ROBOTS), "--tcp", "0", count=ROBOTS)
        )
        urls = [line.split()[1] for line in lines]
        opened = await stack.enter_async_context(browser())
        async with started("joystick", "--no-browser", "--port", "0", "--robot", urls[0]) as (panel, (address,)):
            await asyncio.sleep(5)
            found["one_robot_no_page"] = await share(panel)
            driver = Driver(await opened(address))
            await driver.tab.until("!!window.elib && [...elib.robots.values()].at(-1)?.tick?.phase === 'connected'")
            await asyncio.sleep(3)
            found["one_robot_one_page"] = await share(panel)
            await driver.tab.close()
        async with (
            started("simulate", "--robots", "1", "--tcp", "0", count=1) as (alone, (line,)),
            started("joystick", "--no-browser", "--port", "0", "--robot", line.split()[1]) as (_, (address,)),
        ):
            driver = Driver(await opened(address))
            await driver.tab.until("!!window.elib && [...elib.robots.values()].at(-1)?.tick?.phase === 'connected'")
            await driver.press("Console")
            await driver.tab.until("!!document.querySelector('.console input')")
            found["answer_with_a_link_s"] = await waited(driver)
            alone.kill()
            await asyncio.sleep(2)
            found["answer_without_a_link_s"] = await waited(driver)
            await driver.tab.close()
        await asyncio.sleep(1)
        words = [word for url in urls for word in ("--robot", url)]
        async with started("joystick", "--no-browser", "--port", "0", *words) as (panel, (address,)):
            await asyncio.sleep(8)
            tab = await opened(address)
            await tab.until("!!document.querySelector('.overview article')")
            await asyncio.sleep(3)
            frames = "(async () => { let n = 0; const unlisten = elib.listen('overview', () => n++); "
            frames += "await new Promise((done) => setTimeout(done, 5000)); unlisten(); return n / 5; })()"
            found["overview_messages_per_s"] = float(await tab.run(frames))  # type: ignore[arg-type]
            found["twenty_robots_overview"] = await share(panel)
            await tab.close()
    return found


def main() -> None:
    """Print what was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if CHROMIUM is None:
        raise SystemExit("no chromium: apt-get install chromium")
    found = asyncio.run(measure())
    if options.json:
        print(json.dumps(found))
        return
    for name, value in found.items():
        if name.endswith("_per_s"):
            text = f"{value:.1f} a second"
        else:
            text = f"{1000 * value:.0f} ms at most" if name.endswith("_s") else f"{100 * value:.1f} % of a core"
        print(f"{name.removesuffix('_s').removesuffix('_per').replace('_', ' '):28} {text}")


if __name__ == "__main__":
    main()
