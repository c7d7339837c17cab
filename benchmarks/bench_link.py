"""What the session costs: round trips through elib against a raw read/write loop, on the same pty, in one run.

The other end of the pty is a bare echo-like robot in its own process, so what differs is the host's side alone.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import resource
import statistics
import time
import tty
from collections.abc import Awaitable, Callable

import elib

TRIPS = 3000
ANSWERS = {
    b"V": b"v,Version 2.0.0 January 2008\r\n",
    b"N": b"n,1,2,3,4,5,6,7,8\r\n",
    b"D": b"d\r\n",
    b"S": b"s\r\n",
}


def robot(master: int) -> None:
    """Answer every line at once, as fast as a process can."""
    buffer = b""
    while True:
        try:
            buffer += os.read(master, 4096)
        except OSError:
            return
        while b"\r" in buffer:
            line, _, buffer = buffer.partition(b"\r")
            line = line.lstrip(b"\0")
            if line:
                os.write(master, ANSWERS.get(line[:1], b"z,Command not found\r\n"))


def raw(slave: int) -> list[float]:
    """The floor: blocking system calls and nothing else."""
    trips = []
    for _ in range(TRIPS):
        began = time.perf_counter()
        os.write(slave, b"N\r")
        answer = b""
        while not answer.endswith(b"\n"):
            answer += os.read(slave, 4096)
        trips.append(time.perf_counter() - began)
    return trips


async def timed(call: Callable[[], Awaitable[object]]) -> list[float]:
    trips = []
    for _ in range(TRIPS):
        began = time.perf_counter()
        await call()
        trips.append(time.perf_counter() - began)
    return trips


async def through_async(port: str) -> list[float]:
    async with elib.open(f"serial://{port}") as robot:
        return await timed(robot.proximity)


def through_blocking(port: str) -> list[float]:
    with elib.connect(f"serial://{port}") as robot:
        trips = []
        for _ in range(TRIPS):
            began = time.perf_counter()
            robot.proximity()
            trips.append(time.perf_counter() - began)
        return trips


def main() -> None:
    master, slave = os.openpty()
    tty.setraw(master)
    tty.setraw(slave)
    port = os.ttyname(slave)
    process = multiprocessing.get_context("fork").Process(target=robot, args=(master,), daemon=True)
    process.start()
    os.close(master)
    floor = raw(slave)
    rows = [("raw os.read/os.write", floor)]
    rows.append(("elib, async", asyncio.run(through_async(port))))
    rows.append(("elib, blocking", through_blocking(port)))
    process.terminate()
    base = statistics.median(floor)
    print(f"text N over a pty, unpaced, {TRIPS} round trips each")
    print(f"{'':24}{'median us':>10}{'p99 us':>10}{'x floor':>10}")
    for name, trips in rows:
        ordered = sorted(trips)
        median, p99 = ordered[len(ordered) // 2], ordered[int(len(ordered) * 0.99)]
        print(f"{name:24}{median * 1e6:10.0f}{p99 * 1e6:10.0f}{median / base:10.1f}")
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
