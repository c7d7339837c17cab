"""What the doors cost: a command through `elib serve`, and its watchers.

A command through the door is compared with the same blocking call in the program itself, and with an echo by a bare
aiohttp server, which is the least that a WebSocket costs. The robot is virtual, on a line without delays. All three
take turns, so that what else the computer does falls on all alike. Then twenty programs watch all sensors twenty times
a second; the load is the CPU time of the server's process, as a share of one core.

    python benchmarks/doors.py [--calls 500] [--rounds 5] [--watchers 20] [--rate 20] [--seconds 10] [--json]
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

from serving import busy, delayed
from websockets.asyncio.client import connect as connect_async
from websockets.sync.client import ClientConnection, connect

import elib

ROBOT = "sim://square?baud=0"
QUESTION = '{"do":"selector","id":1}'
ECHO = """
import asyncio
from aiohttp import web

async def echo(request):
    ws = web.WebSocketResponse(compress=False)
    await ws.prepare(request)
    async for message in ws:
        await ws.send_str(message.data)
    return ws

async def main():
    application = web.Application()
    application.router.add_get("/", echo)
    runner = web.AppRunner(application)
    await runner.setup()
    site = web.TCPSite(runner, "127.0.0.1", 0)
    await site.start()
    print(f"ws://127.0.0.1:{site._server.sockets[0].getsockname()[1]}/", flush=True)
    await asyncio.Event().wait()

asyncio.run(main())
"""


@contextlib.contextmanager
def server(*command: str) -> Iterator[tuple[int, str]]:
    """Run a server; give its process number and the first line that it prints."""
    process = subprocess.Popen([sys.executable, *command], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process.pid, process.stdout.readline().strip()
    finally:
        process.terminate()
        process.wait(10)


def median_of(call: Callable[[], object], calls: int) -> float:
    """Return the median time of a call, ms."""
    took = []
    for _ in range(calls):
        began = time.perf_counter()
        call()
        took.append(time.perf_counter() - began)
    return 1e3 * statistics.median(took)


def asking(socket: ClientConnection) -> Callable[[], object]:
    def ask() -> object:
        socket.send(QUESTION)
        return socket.recv()

    return ask


def commands(url: str, calls: int, rounds: int) -> dict[str, float]:
    """Return the median times of a call, of a command through the door, and of an echo, ms."""
    found: dict[str, list[float]] = {"call": [], "door": [], "echo": [], "more": []}
    with (
        server("-c", ECHO) as (_, echo_url),
        connect(url, compression=None, proxy=None) as door,
        connect(echo_url, compression=None, proxy=None) as echo,
        elib.connect(ROBOT) as robot,
    ):
        works = {"call": robot.selector, "door": asking(door), "echo": asking(echo)}
        for work in works.values():
            median_of(work, 50)
        for _ in range(rounds):
            for name, work in works.items():
                found[name].append(median_of(work, calls))
            found["more"].append(found["door"][-1] - found["call"][-1])
    return {f"{name}_ms": statistics.median(values) for name, values in found.items()}


async def watch(url: str, pid: int, watchers: int, rate: float, seconds: float) -> dict[str, float]:
    """Return what watchers get, and the load of the server."""
    counts = [0] * watchers

    async def one(index: int) -> None:
        async with connect_async(url, compression=None, proxy=None) as socket:
            await socket.send(json.dumps({"do": "watch", "rate": rate}))
            async for _ in socket:
                counts[index] += 1

    tasks = [asyncio.create_task(one(index)) for index in range(watchers)]
    await asyncio.sleep(2)
    before, used, waited, began = sum(counts), busy(pid), delayed(pid), time.perf_counter()
    await asyncio.sleep(seconds)
    took = time.perf_counter() - began
    found = {
        "messages_per_s": (sum(counts) - before) / took,
        "load": (busy(pid) - used) / took,
        "delayed": (delayed(pid) - waited) / took,
    }
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=200, help="calls of each kind a round")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--watchers", type=int, default=20)
    parser.add_argument("--rate", type=float, default=20.0, help="messages a second to each")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    with server("-m", "elib", "serve", ROBOT, "--port", "0") as (pid, url):
        found = commands(url, options.calls, options.rounds)
        idle_used, idle_began = busy(pid), time.perf_counter()
        time.sleep(3)
        found["idle_load"] = (busy(pid) - idle_used) / (time.perf_counter() - idle_began)
        found |= asyncio.run(watch(url, pid, options.watchers, options.rate, options.seconds))
    if options.json:
        print(json.dumps({name: round(value, 4) for name, value in found.items()}))
        return
    print(f"blocking call       {found['call_ms']:6.3f} ms")
    print(f"through the door    {found['door_ms']:6.3f} ms, {found['more_ms']:+.3f} ms")
    print(f"echo of bare aiohttp{found['echo_ms']:6.3f} ms")
    print(f"{options.watchers} watchers at {options.rate:g} Hz: {found['messages_per_s']:.0f} messages/s,")
    print(f"  {found['load']:.1%} of a core, {found['idle_load']:.1%} without them; waited {found['delayed']:.1%}")


if __name__ == "__main__":
    main()
