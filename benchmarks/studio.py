"""How fast a program runs in the studio, in chromium, beside the same program under this Python.

Each program times itself, so the start of Python counts on neither side, and prints what it found, which is compared.
In the studio all lines of the program are followed, for its breakpoints and steps; those of elib are not. "slower" is
the median of each round's ratio: 1 is as fast as CPython on the same computer, in the same run.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import subprocess
import sys
import tempfile
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from textwrap import indent

from harness import ROOT, Tables, in_turns, quick, ratio, run, use_tests

use_tests("panel", "studio")

from browser import CHROMIUM, Tab, browser  # noqa: E402
from studio_rig import Server  # noqa: E402

IDLE = "window.elib?.loading.value === '' && elib.program.value.state === 'idle'"
SHOWN = "new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))"
"""What was printed last is drawn with the next picture."""
TEXT = "elib.lines.value.map(({ text }) => text).join('\\n')"

LOOP = """
found = 0
for number in range(300_000):
    if number % 7 == 3:
        found += number * number
print(found)
"""
AVOID = """
import elib
from elib.behaviours import play
from elib.behaviours.avoid import wander

result = play(wander, "sim://arena?seed=1&speed=max", seconds=60)
print(result.reason, len(result.states))
"""
SWARM = """
import elib
from elib.behaviours import OpenAir


async def wander(robot):
    open_air, end = OpenAir(), robot.time + 20
    while robot.time < end:
        near = open_air(await robot.proximity())
        left, right = near.front_left + near.diagonal_left, near.front_right + near.diagonal_right
        await robot.set_speed(*((0.5, 0.5) if left + right < 200 else (0.4, -0.4) if left > right else (-0.4, 0.4)))
        await robot.sleep(0.1)
    return tuple(await robot.encoders())


async def main(robots):
    print(sorted((await robots.all.run(wander)).values()))


elib.swarm("sim://crowd?robots=10&seed=1&speed=max").run(main)
"""
PROGRAMS = {"a loop of plain Python": LOOP, "avoid, one robot for 60 s": AVOID, "ten robots for 20 s": SWARM}
TIMED = """import time


def work():
{}

work()
began = time.perf_counter()
work()
print(time.perf_counter() - began)
"""
"""The first time is for what is imported and compiled."""


@contextlib.contextmanager
def served() -> Iterator[str]:
    """Build the studio and serve it; give its address."""
    with tempfile.TemporaryDirectory() as name:
        subprocess.run([sys.executable, str(ROOT / "release/studio.py"), "--to", name], check=True)
        server = Server(Path(name))
        yield server.url
        server.close()


@contextlib.asynccontextmanager
async def opened(url: str) -> AsyncIterator[Tab]:
    """Open the studio in a browser; its robots live as fast as they can."""
    async with browser() as opener:
        tab = await opener(url)
        await tab.until(IDLE)
        await tab.run("elib.speed.value = 0")
        yield tab


async def begin(tab: Tab, text: str) -> None:
    """Begin to run a program, always under the same name."""
    await tab.until(IDLE)
    await tab.run(f"localStorage['elib-program:bench.py'] = {json.dumps(text)}, elib.open('bench.py'), elib.run(), 0")


async def printed(tab: Tab) -> str:
    """Wait until the program has ended, and return what it printed."""
    await tab.until(IDLE)
    await tab.run(SHOWN)
    return str(await tab.run(TEXT))


async def ran(tab: Tab, text: str) -> str:
    """Run a program to its end, and return what it printed."""
    await begin(tab, text)
    return await printed(tab)


def slower(program: str, rounds: int, tab: Tab, runner: asyncio.Runner) -> float:
    """Return how many times longer a program takes in the studio than under CPython."""
    text = TIMED.format(indent(program, 4 * " "))
    known = set[str]()

    def seconds(output: str) -> float:
        found, _, took = output.strip().rpartition("\n")
        known.add(found)
        if len(known) > 1:
            sys.exit("\n".join(["the studio and CPython print different things:", *known]))
        return float(took)

    def in_studio() -> float:
        return seconds(runner.run(ran(tab, text)))

    def under_cpython() -> float:
        done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
        return seconds(done.stdout)

    took = in_turns({"studio": in_studio, "CPython": under_cpython}, rounds)
    return ratio(took["studio"], took["CPython"])


@quick(rounds=1)
def measure(*, rounds: int = 7) -> Tables:
    """Measure.

    Args:
        rounds: Of each program, in the studio and under CPython in turns.
    """
    if CHROMIUM is None:
        raise SystemExit("no chromium: apt-get install chromium")
    with served() as url, asyncio.Runner() as runner:
        place = opened(url)
        tab = runner.run(place.__aenter__())
        try:
            table = {name: {"slower": slower(text, rounds, tab, runner)} for name, text in PROGRAMS.items()}
        finally:
            runner.run(place.__aexit__(None, None, None))
    yield "a program in the studio beside CPython", table


if __name__ == "__main__":
    run(__doc__, measure)
