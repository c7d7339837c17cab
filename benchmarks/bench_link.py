"""What the link costs: elib against raw system calls, with the same responder in another process, in one run.

The responder is the emulated firmware behind ptys (``responder`` below); the floor is a loop of blocking ``os.read``
and ``os.write`` on the same pty. A second, bare responder that answers ``N`` with a constant shows the host's side
alone.
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import os
import resource
import statistics
import subprocess
import sys
import termios
import time
import tty
from collections.abc import Awaitable, Callable, Iterator
from multiprocessing.connection import Connection

import elib
from elib.base.timebase import new_loop
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings

TRIPS = 2000
ROUNDS = 10
FIRMWARE = "asercom-1.2.2"
CONSTANTS = {b"V": b"v,Version 2.0.0 January 2008\r\n", b"N": b"n,1,2,3,4,5,6,7,8\r\n", b"S": b"s\r\n"}


# -- the other side ----------------------------------------------------------------------------------------------------


def responder(pipe: Connection, settings: dict[str, object]) -> None:
    """Serve emulated robots until the pipe is closed."""

    async def run() -> None:
        async with serve(SimulationSettings(**settings), pty=True) as served:  # type: ignore[arg-type]
            pipe.send([place.url for place in served])
            await asyncio.get_running_loop().run_in_executor(None, wait, pipe)

    def wait(pipe: Connection) -> None:
        with contextlib.suppress(EOFError):
            pipe.recv()

    with asyncio.Runner(loop_factory=lambda: new_loop("real")) as runner:
        runner.run(run())


def bare_responder(pipe: Connection, settings: dict[str, object]) -> None:
    """Answer every line with a constant, as fast as a process can."""
    master, slave = os.openpty()
    tty.setraw(slave)
    pipe.send([f"serial://{os.ttyname(slave)}"])
    buffer = b""
    while True:
        buffer += os.read(master, 4096)
        while b"\r" in buffer:
            line, _, buffer = buffer.partition(b"\r")
            if line := line.lstrip(b"\0"):
                os.write(master, CONSTANTS.get(line[:1], b"z,Command not found\r\n"))


@contextlib.contextmanager
def robots(
    target: Callable[[Connection, dict[str, object]], None] = responder, **settings: object
) -> Iterator[list[str]]:
    """Run a responder in a process of its own and give the URLs of its robots."""
    here, there = multiprocessing.Pipe()
    process = multiprocessing.get_context("spawn").Process(target=target, args=(there, settings), daemon=True)
    process.start()
    try:
        yield here.recv()
    finally:
        process.terminate()
        process.join(5)


# -- measuring ---------------------------------------------------------------------------------------------------------


class Raw:
    """A port without any library."""

    def __init__(self, url: str) -> None:
        self._port = os.open(url.removeprefix("serial://"), os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._port)
        termios.tcflush(self._port, termios.TCIOFLUSH)

    def ask(self, data: bytes, *, size: int = 0) -> None:
        """Send *data* and read *size* bytes, or a line."""
        os.write(self._port, data)
        answer = b""
        while len(answer) < size if size else not answer.endswith(b"\n"):
            answer += os.read(self._port, 8192)

    def close(self) -> None:
        os.close(self._port)


def timed(call: Callable[[], object], count: int) -> list[float]:
    trips = []
    for _ in range(count):
        began = time.perf_counter()
        call()
        trips.append(time.perf_counter() - began)
    return trips


async def timed_async(call: Callable[[], Awaitable[object]], count: int) -> list[float]:
    trips = []
    for _ in range(count):
        began = time.perf_counter()
        await call()
        trips.append(time.perf_counter() - began)
    return trips


def show(what: str, seconds: float, floor: float, bound: str) -> None:
    print(f"  {what:34}{seconds * 1e6:12,.0f} us{seconds / floor:8.2f} x floor   {bound}")


def round_trips(url: str) -> None:
    raw = Raw(url)
    timed(lambda: raw.ask(b"N\r"), 200)
    floor = statistics.median(timed(lambda: raw.ask(b"N\r"), TRIPS))
    raw.close()
    show("raw os.read/os.write", floor, floor, "")

    async def through_async() -> tuple[float, float, float]:
        async with elib.open(url) as robot:
            await timed_async(robot.proximity, 200)
            trips = await timed_async(robot.proximity, TRIPS)
            in_turn, queued = [], []
            patient = robot.within(60)
            for _ in range(ROUNDS):  # by turns, so that a busy moment of the machine falls on both
                in_turn.append(sum(await timed_async(patient.proximity, 1000)) / 1000)
                began = time.perf_counter()
                await asyncio.gather(*(patient.proximity() for _ in range(1000)))
                queued.append((time.perf_counter() - began) / 1000)
            return statistics.median(trips), statistics.median(in_turn), statistics.median(queued)

    one, in_turn, queued = asyncio.run(through_async())
    show("async", one, floor, "goal 2")
    show("1,000 async, one by one, each", in_turn, floor, "")
    show("1,000 queued, each", queued, floor, "goal: not above the line before")
    with elib.connect(url) as robot:
        timed(robot.proximity, 200)
        show("blocking", statistics.median(timed(robot.proximity, TRIPS)), floor, "goal 3")


def paced() -> None:
    with robots(firmware=FIRMWARE, latency=0.015) as (url,):
        raw = Raw(url)
        with elib.connect(url) as robot:
            requests: list[bytes] = []
            sizes: list[int] = []

            def watch(_: float, event: object) -> None:
                if type(event).__name__ == "Wrote":
                    requests.append(event.data)  # type: ignore[attr-defined]
                    sizes.append(0)
                elif type(event).__name__ == "Received":
                    sizes[-1] += len(event.data)  # type: ignore[attr-defined]

            robot.trace(watch)
            robot.sensors()
            ours = statistics.median(timed(robot.sensors, 20))
            picture = statistics.median(timed(robot.image, 8))
            request, size = requests[0], sizes[0]
        raw.close()
        raw = Raw(url)
        floor = statistics.median(timed(lambda: raw.ask(request, size=size), 20))
        floor_picture = statistics.median(timed(lambda: raw.ask(b"\xb7\0", size=3203), 8))
        raw.close()
        show(f"sensors(), {len(request)}+{size} bytes", ours, floor, "goal 1.05")
        show("picture 40 x 40 in colour", picture, floor_picture, "goal 1.03")


def many(count: int = 50, rate: float = 20, seconds: float = 10) -> None:
    async def poll(robot: elib.Epuck, end: float) -> int:
        answers = 0
        loop = asyncio.get_running_loop()
        due = loop.time()
        while due < end:
            await robot.proximity()
            answers += 1
            due += 1 / rate
            await asyncio.sleep(max(0.0, due - loop.time()))
        return answers

    async def run(urls: list[str]) -> tuple[int, float]:
        async with contextlib.AsyncExitStack() as stack:
            crowd = await asyncio.gather(*(stack.enter_async_context(elib.open(url)) for url in urls))
            began = time.process_time()
            end = asyncio.get_running_loop().time() + seconds
            answers = sum(await asyncio.gather(*(poll(robot, end) for robot in crowd)))
            return answers, time.process_time() - began

    with robots(firmware=FIRMWARE, robots=count, world="square") as urls:
        answers, spent = asyncio.run(run(urls))
    load = spent / seconds
    print(f"  {count} robots at {rate:g} Hz: {answers / seconds:,.0f} answers/s, {load:.1%} of a core   goal 10 %")


IDLE = """
import resource, time, elib
robot = elib.connect({url!r})
robot.proximity()
began = time.process_time()
time.sleep(5)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, (time.process_time() - began) / 5)
robot.close()
"""


def idle() -> None:
    def run(program: str) -> tuple[float, str]:
        began = time.perf_counter()
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
        return time.perf_counter() - began, done.stdout

    empty = statistics.median(run("pass")[0] for _ in range(5))
    full = statistics.median(run("import elib")[0] for _ in range(5))
    facade = statistics.median(run("import elib; elib.connect")[0] for _ in range(5))
    print(
        f"  import elib {full - empty:.3f} s, elib.connect {facade - empty:.3f} s beyond an empty Python   goal 0.15 s"
    )
    with robots(firmware=FIRMWARE) as (url,):
        memory, load = run(IDLE.format(url=url))[1].split()
    print(f"  a connected idle program: {float(memory):.0f} MB, {float(load):.2%} of a core   goal 45 MB, 0.5 %")


def main() -> None:
    print("round trip of proximity() on a pty, unpaced, median")
    with robots(bare_responder) as (url,):
        print(" a responder that answers a constant")
        round_trips(url)
    with robots(firmware=FIRMWARE, baud=0, world="square") as (url,):
        print(" the emulated firmware")
        round_trips(url)
    print("115,200 baud, 15 ms each way, the emulated firmware")
    paced()
    print("many robots in another process")
    many()
    print("starting and waiting")
    idle()
    print(f"peak memory of this program {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
