"""What the doors cost: a command through ``elib serve``, and its watchers.

A command through the door is compared with the same blocking call in the program itself, and with an echo by a bare
aiohttp server, which is the least that a WebSocket costs. The robot is virtual, on a line without delays. All three
take turns. Then many programs watch all sensors; the load is the CPU time of the server's process, as a share of one
core.
"""

from __future__ import annotations

import asyncio
import json
import statistics
import sys
import time
from collections.abc import Callable
from functools import partial

from echo import echo
from harness import Cell, Tables, calling, in_turns, load, quick, run, started, trip
from websockets.asyncio.client import connect as connect_async
from websockets.sync.client import ClientConnection, connect

import elib

ROBOT = "sim://square?baud=0"
QUESTION = '{"do":"selector","id":1}'


def asking(socket: ClientConnection) -> Callable[[], object]:
    def ask() -> object:
        socket.send(QUESTION)
        return socket.recv()

    return ask


def commands(url: str, calls: int, rounds: int) -> dict[str, dict[str, Cell]]:
    """Measure a call, a command through the door, and an echo."""
    with (
        started(*calling(echo)) as (_, [echo_url]),
        connect(url, compression=None, proxy=None) as door,
        connect(f"{echo_url}ws".replace("http", "ws"), compression=None, proxy=None) as bare,
        elib.connect(ROBOT) as robot,
    ):
        works = {"blocking call": robot.selector, "through the door": asking(door), "echo of aiohttp": asking(bare)}
        found = in_turns({name: partial(trip, work, calls) for name, work in works.items()}, rounds)
    call, through, _ = found.values()
    more = statistics.median(one - other for one, other in zip(through, call, strict=True))
    return {name: {"ms": 1e3 * statistics.median(took)} for name, took in found.items()} | {
        "the door adds": {"ms": 1e3 * more}
    }


async def watch(url: str, pid: int, watchers: int, rate: float, seconds: float) -> dict[str, Cell]:
    """Return what watchers get, and the load of the server."""
    counts = [0] * watchers

    async def one(index: int) -> None:
        async with connect_async(url, compression=None, proxy=None) as socket:
            await socket.send(json.dumps({"do": "watch", "rate": rate}))
            async for _ in socket:
                counts[index] += 1

    tasks = [asyncio.create_task(one(index)) for index in range(watchers)]
    await asyncio.sleep(2)
    before, began = sum(counts), time.perf_counter()
    with load(pid) as server:
        await asyncio.sleep(seconds)
    messages = (sum(counts) - before) / (time.perf_counter() - began)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    return {"messages/s": messages, "% of a core": 100 * server.share, "% delayed": 100 * server.delayed}


@quick(calls=20, rounds=2, seconds=1.0)
def measure(
    *, calls: int = 200, rounds: int = 5, watchers: int = 20, rate: float = 20.0, seconds: float = 10.0
) -> Tables:
    """Measure.

    Args:
        calls: Of each kind a round.
        rounds: How many.
        watchers: Programs that watch.
        rate: Messages a second to each.
        seconds: How long they watch.
    """
    with started(sys.executable, "-m", "elib", "serve", ROBOT, "--port", "0") as (process, [url]):
        yield "one command", commands(url, calls, rounds)
        with load(process.pid) as idle:
            time.sleep(min(seconds, 3))
        watched = asyncio.run(watch(url, process.pid, watchers, rate, seconds))
    rows = {f"{watchers} watchers at {rate:g} Hz": watched, "none": {"% of a core": 100 * idle.share}}
    yield "the server", rows


if __name__ == "__main__":
    run(__doc__, measure)
