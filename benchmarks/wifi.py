"""What a program pays for an e-puck2 on Wi-Fi: sensor packets, pictures, calls, and twenty robots at once.

A small robot of its own process answers as docs/reference/wire-protocol.md 4 says: one command a cycle
of 20 ms, sensors in each cycle, and with pictures one of 38,401 bytes more every 80 ms. It computes nothing, so that
the figures are those of the program's side. Each part is measured twice in one run: with elib, and as a floor with a
program that only reads the sockets and throws the bytes away. Used: processor time of this process by the time that
passed, in percent of one core.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Awaitable, Callable

from harness import Table, Tables, calling, load, quick, run, started

import elib

CYCLE = 0.02
"""s. Sensors alone go round in two steps of 10 ms (wire-protocol.md, 4.4)."""
PICTURE_CYCLE = 0.08
"""s of a cycle with a picture; the bound of the reference is arithmetic, a real robot takes longer."""
STREAM = bytes((0x80, 2)) + bytes(19)
PICTURES = bytes((0x80, 3)) + bytes(19)


# -- the robot ---------------------------------------------------------------------------------------------------------


def serve() -> None:
    """Serve any number of robots on one port, a connection each, and print the port."""
    asyncio.run(_serve())


async def _serve() -> None:
    sensors = bytearray(105)
    sensors[0], sensors[1 + 89] = 2, 15
    picture = b"\x01" + bytes(38400)

    async def robot(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        waiting: asyncio.Queue[bytes] = asyncio.Queue()

        async def listen() -> None:
            with contextlib.suppress(asyncio.IncompleteReadError, ConnectionError):
                while True:
                    waiting.put_nowait(await reader.readexactly(21))
            waiting.put_nowait(b"")

        listening = asyncio.ensure_future(listen())
        command = await waiting.get()
        loop = asyncio.get_running_loop()
        due = loop.time()
        with contextlib.suppress(ConnectionError):
            while command:
                request = command[1]
                writer.write((picture if request & 1 else b"") + (bytes(sensors) if request & 2 else b"\x03"))
                await writer.drain()
                due += PICTURE_CYCLE if request & 1 else CYCLE
                await asyncio.sleep(max(0.0, due - loop.time()))
                if not waiting.empty():
                    command = waiting.get_nowait()
        listening.cancel()
        writer.close()

    server = await asyncio.start_server(robot, "127.0.0.1", 0)
    print(server.sockets[0].getsockname()[1], flush=True)
    await server.serve_forever()


# -- what is measured --------------------------------------------------------------------------------------------------


async def measured(work: Callable[[float], Awaitable[int]], seconds: float) -> tuple[float, float]:
    """Return how many things a second *work* counted, and the percent of a core that this process took."""
    began = time.perf_counter()
    with load() as used:
        count = await work(asyncio.get_running_loop().time() + seconds)
    return count / (time.perf_counter() - began), 100 * used.share


class Floor(asyncio.Protocol):
    """Reads and throws away; counts bytes."""

    def __init__(self, command: bytes) -> None:
        self.command = command
        self.count = 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Let the robot stream."""
        transport.write(self.command)  # type: ignore[attr-defined]

    def data_received(self, data: bytes) -> None:
        """Count."""
        self.count += len(data)


async def floor(port: int, seconds: float, *, links: int = 1, command: bytes = STREAM) -> tuple[float, float]:
    """Return bytes a second and the percent of a core of a program that only reads."""
    loop = asyncio.get_running_loop()
    opened = [await loop.create_connection(lambda: Floor(command), "127.0.0.1", port) for _ in range(links)]
    await asyncio.sleep(0.2)

    async def read(end: float) -> int:
        before = sum(protocol.count for _, protocol in opened)
        await asyncio.sleep(end - loop.time())
        return sum(protocol.count for _, protocol in opened) - before

    found = await measured(read, seconds)
    for transport, _ in opened:
        transport.close()
    return found


async def watched(port: int, seconds: float, *names: str) -> tuple[float, float]:
    """Return snapshots a second and the percent of a core of a program that watches."""
    async with elib.open(f"wifi://127.0.0.1:{port}") as robot, robot.watch(*names, rate=1000) as snapshots:
        await snapshots.take()

        async def take(end: float) -> int:
            count = 0
            while robot.time < end:
                await snapshots.take()
                count += 1
            return count

        return await measured(take, seconds)


async def called(port: int, seconds: float) -> Table:
    """Return how long a call takes that sets something, one that reads, and a picture, ms."""
    found = {}
    async with elib.open(f"wifi://127.0.0.1:{port}") as robot:
        calls: dict[str, Callable[[], Awaitable[object]]] = {
            "set_speed": lambda: robot.set_speed(0.1, 0.1),
            "proximity": robot.proximity,
            "image": robot.image,
        }
        for name, call in calls.items():
            began, count = robot.time, 0
            while robot.time < began + seconds / 3:
                await call()
                count += 1
            found[name] = {"ms": 1000 * (robot.time - began) / count}
    return found


async def crowd(port: int, seconds: float, count: int, rate: float) -> tuple[float, float]:
    """Return snapshots a second and the percent of a core of a program that watches all sensors of many robots."""
    async with contextlib.AsyncExitStack() as stack:
        opened = [await stack.enter_async_context(elib.open(f"wifi://127.0.0.1:{port}")) for _ in range(count)]
        watches = [await stack.enter_async_context(robot.watch(rate=rate)) for robot in opened]
        await asyncio.gather(*(watch.take() for watch in watches))

        async def take(end: float) -> int:
            async def one(watch: elib.Watch) -> int:
                taken = 0
                while opened[0].time < end:
                    await watch.take()
                    taken += 1
                return taken

            return sum(await asyncio.gather(*(one(watch) for watch in watches)))

        return await measured(take, seconds)


async def streams(port: int, seconds: float, count: int, rate: float) -> Table:
    """Return what watching costs: packets, pictures, and all sensors of many robots."""
    found = {}
    for name, command, size in (("proximity", STREAM, 105), ("image", PICTURES, 38401 + 105)):
        carried, idle = await floor(port, seconds, command=command)
        snapshots, core = await watched(port, seconds, name)
        shares = {"share of what came": snapshots * size / carried, "% of a core": core, "floor, % of a core": idle}
        found[name] = {"a second": snapshots, **shares}
    _, idle = await floor(port, seconds, links=count)
    snapshots, core = await crowd(port, seconds, count, rate)
    all_of = {"a second": snapshots, "% of a core": core, "floor, % of a core": idle}
    return found | {f"all sensors of {count} robots at {rate:g} Hz": all_of}


@quick(robots=3, seconds=0.5)
def measure(*, robots: int = 20, rate: float = 10.0, seconds: float = 5.0) -> Tables:
    """Measure.

    Args:
        robots: How many are watched at once.
        rate: Snapshots a second of each of them.
        seconds: How long each part lasts.
    """
    with started(*calling(serve)) as (_, [port]):
        yield "watching", asyncio.run(streams(int(port), seconds, robots, rate))
        yield "calls", asyncio.run(called(int(port), seconds))


if __name__ == "__main__":
    run(__doc__, measure)
