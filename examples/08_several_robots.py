"""Drive several robots at once; name their URLs on the command line, or take three virtual ones."""

import asyncio
import sys

import elib
from elib.timebase import new_loop
from elib.transport import speed_of

URLS = sys.argv[1:] or [f"sim://?speed=max&seed={seed}" for seed in (1, 2, 3)]


async def turn_and_look(url: str, name: str) -> tuple[str, int]:
    """Turn once on the spot and return the nearest thing seen, counts."""
    async with elib.open(url, name=name) as robot:
        await robot.set_speed(0.2, -0.2)
        nearest = 0
        for _ in range(60):
            nearest = max(nearest, *await robot.proximity())
            await robot.sleep(0.1)
        return robot.name, nearest


async def main() -> None:
    async with asyncio.TaskGroup() as group:  # if one robot fails, the others stop
        tasks = [group.create_task(turn_and_look(url, f"epuck-{n}")) for n, url in enumerate(URLS, 1)]
    for name, nearest in (task.result() for task in tasks):
        print(f"{name}: nearest {nearest} counts")


with asyncio.Runner(loop_factory=lambda: new_loop(speed_of(URLS[0]))) as runner:
    runner.run(main())
