"""Run hundreds of programs in the studio, in chromium, and end half of them by STOP: does it stay as small as it was?

It shows how many MiB WebAssembly, the scripts of the page and the processes of its tabs have, and how many objects
Python has, from time to time. ``one`` does so while one program drives its robot for an hour of the robot's time.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import random
from pathlib import Path

from harness import Tables, quick, run

from studio import IDLE, TEXT, begin, opened, ran, served

from browser import Tab  # isort: skip  # the folder of it is found by the one above
from elib.simulator.worlds.files import gallery

PARTS = 12
"""How often the sizes are looked at while one program runs."""
SIZES = """import gc, pyodide_js
def show():
    gc.collect()
    print(pyodide_js._module.HEAP8.length / 2**20, len(gc.get_objects()), flush=True)
"""
WORK = [
    "robot.set_speed(0.3, 0.2)\nrobot.sleep({time})",
    "while robot.time < {time}:\n    robot.set_speed(0.5, 0.5 if robot.proximity()[0] < 200 else -0.5)",
    "robot.callback(print, print).proximity()\nrobot.sleep({time})\nprint([robot.sensors()] * 9)",
    "robot.drive(0.02)\nrobot.turn(1.0)\nprint(robot.pose(), 'x' * 5000)",
    "for each in [elib.connect({world!r}) for _ in range(3)]:\n    each.set_speed(0.1, 0.1)\n    each.sleep(0.3)",
    "1 / (robot.encoders().left - robot.encoders().left)",
]
"""What the programs do with their robots."""
ENDLESS = "\nrobot.set_speed(0.2, 0.3)\nwhile True:\n    robot.sleep(0.05)"
PATROL = f"""{SIZES}
import elib
with elib.connect("sim://arena?seed=1") as robot:
    for _ in range({{parts}}):
        end = robot.time + {{seconds}}
        while robot.time < end:
            near = robot.proximity()
            blocked = near.front_left + near.front_right > 300
            robot.set_speed(0.4, -0.4 if blocked else 0.4)
            robot.sleep(0.1)
        show()
"""


def drawn(dice: random.Random, worlds: list[str], *, is_endless: bool) -> str:
    """Return a program."""
    world = dice.choice(worlds)
    work = dice.choice(WORK).format(time=round(dice.uniform(0.5, 5), 2), world=world)
    lines = f"{work}{ENDLESS if is_endless else ''}".replace("\n", "\n    ")
    return f"import elib\nwith elib.connect({world!r}) as robot:\n    {lines}\n"


def processes(parent: int) -> list[int]:
    """Return the processes that a process has started, and those that they have."""
    found = []
    for task in Path(f"/proc/{parent}/task").iterdir():
        for child in map(int, (task / "children").read_text().split()):
            found += [child, *processes(child)]
    return found


def tabs() -> float:
    """Return the memory of the processes of the browser's tabs, MiB."""
    size = 0
    for number in processes(os.getpid()):
        with contextlib.suppress(OSError):
            if b"--type=renderer" in Path(f"/proc/{number}/cmdline").read_bytes():
                size += int(Path(f"/proc/{number}/statm").read_text().split()[1])
    return size * os.sysconf("SC_PAGE_SIZE") / 2**20


async def sizes(tab: Tab, shown: str) -> dict[str, float]:
    """Return what there is, of which a program has shown the size of WebAssembly and the number of objects."""
    heap, objects = map(float, shown.split())
    await tab.call("HeapProfiler.collectGarbage")
    used = await tab.call("Runtime.getHeapUsage")
    return {"WebAssembly": heap, "scripts": used["usedSize"] / 2**20, "tabs": tabs(), "objects": objects}


async def many(url: str, dice: random.Random, runs: int, worlds: list[str]) -> dict[str, dict[str, float]]:
    """Run and stop programs, and return the sizes."""
    found = {}
    async with opened(url) as tab:
        for number in range(runs + 1):
            if number % max(1, min(50, runs // 2)) == 0:
                shown = await ran(tab, SIZES + "show()\n")
                found[f"after {number} runs"] = await sizes(tab, shown)
            is_endless = number % 2 == 1
            await begin(tab, drawn(dice, worlds, is_endless=is_endless))
            if is_endless:
                await tab.until("elib.program.value.time > 0.2 || elib.program.value.state === 'idle'")
                await tab.run(
                    "elib.ask('stop_program', {}), 0"
                )  # and without the page, which ends a Python that is late
            await tab.until(IDLE)
    return found


async def alone(url: str, speed: float, minutes: float) -> dict[str, dict[str, float]]:
    """Run one program, and return the sizes from time to time."""
    found: dict[str, dict[str, float]] = {}
    async with opened(url) as tab:
        await tab.run(f"elib.speed.value = {speed}")
        await begin(tab, PATROL.format(parts=PARTS, seconds=60 * minutes / PARTS))
        for part in range(1, PARTS + 1):
            while not await tab.run(f"elib.lines.value.length > {part}"):  # noqa: ASYNC110  # a page
                await asyncio.sleep(0.5)
            text = str(await tab.run(TEXT)).splitlines()[part - 1]
            found[f"after {minutes * part / PARTS:.3g} min of the robot"] = await sizes(tab, text)
        await tab.until(IDLE)
    return found


@quick(runs=4)
def programs(*, runs: int = 500, worlds: int = 50, seed: int | None = None) -> Tables:
    """Run and stop many programs.

    Args:
        runs: Of programs.
        worlds: In so many worlds.
        seed: What programs and worlds are drawn with.
    """
    seed = random.SystemRandom().randrange(10**6) if seed is None else seed
    dice = random.Random(seed)
    urls = [
        f"sim://{dice.choice(gallery())}?robots={dice.randint(1, 5)}&seed={dice.randrange(10**6)}"
        for _ in range(worlds)
    ]
    with served() as url:
        yield f"{runs} programs, seed {seed}; MiB", asyncio.run(many(url, dice, runs, urls))


@quick(minutes=1)
def one(*, minutes: float = 60, speed: float = 0) -> Tables:
    """Let one program drive its robot for long.

    Args:
        minutes: Of the robot's time.
        speed: How many times faster than the clock; 0 is as fast as possible.
    """
    with served() as url:
        yield "one program; MiB", asyncio.run(alone(url, speed, minutes))


if __name__ == "__main__":
    run(__doc__, programs, one)
