"""What the link costs: elib against raw system calls, with the same robot in another process, in one run.

The robot is the emulated firmware behind a pty; the floor is a loop of blocking ``os.read`` and ``os.write`` on the
same pty. A bare robot that answers ``N`` with a constant shows the host's side alone.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import statistics
import subprocess
import sys
import termios
import time
import tty
from collections.abc import Awaitable, Callable

from harness import Cell, Table, Tables, calling, in_turns, quick, run, simulated, started, trip
from serving import at_rate

import elib
from elib.link.session import Received, Wrote

FIRMWARE = ("--firmware", "asercom-1.2.2")
CONSTANTS = {b"V": b"v,Version 2.0.0 January 2008\r\n", b"N": b"n,1,2,3,4,5,6,7,8\r\n", b"S": b"s\r\n"}


def bare_robot() -> None:
    """Answer every line on a pty with a constant, as fast as a process can."""
    master, slave = os.openpty()
    tty.setraw(slave)
    print(f"serial://{os.ttyname(slave)}", flush=True)
    buffer = b""
    while True:
        buffer += os.read(master, 4096)
        while b"\r" in buffer:
            line, _, buffer = buffer.partition(b"\r")
            if line := line.lstrip(b"\0"):
                os.write(master, CONSTANTS.get(line[:1], b"z,Command not found\r\n"))


class Raw:
    """A port without any library."""

    def __init__(self, url: str) -> None:
        self._port = os.open(url.removeprefix("serial://"), os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._port)
        termios.tcflush(self._port, termios.TCIOFLUSH)

    def close(self) -> None:
        os.close(self._port)

    def ask(self, data: bytes, *, size: int = 0) -> None:
        """Send *data* and read *size* bytes, or a line."""
        os.write(self._port, data)
        answer = b""
        while len(answer) < size if size else not answer.endswith(b"\n"):
            answer += os.read(self._port, 8192)


async def trips(call: Callable[[], Awaitable[object]], count: int) -> list[float]:
    took = []
    for _ in range(count):
        began = time.perf_counter()
        await call()
        took.append(time.perf_counter() - began)
    return took


def row(seconds: float, floor: float, goal: str = "") -> dict[str, Cell]:
    return {"us": seconds * 1e6, "x floor": seconds / floor, "goal": goal}


def round_trips(url: str, count: int, rounds: int) -> Table:
    with contextlib.closing(Raw(url)) as raw:
        trip(lambda: raw.ask(b"N\r"), 200)
        floor = trip(lambda: raw.ask(b"N\r"), count)

    async def through_async() -> tuple[float, float, float]:
        async with elib.open(url) as robot:
            await trips(robot.proximity, 200)
            one = statistics.median(await trips(robot.proximity, count))
            in_turn, queued = [], []
            patient = robot.within(60)
            for _ in range(rounds):  # by turns, so that a busy moment of the machine falls on both
                in_turn.append(sum(await trips(patient.proximity, 1000)) / 1000)
                began = time.perf_counter()
                await asyncio.gather(*(patient.proximity() for _ in range(1000)))
                queued.append((time.perf_counter() - began) / 1000)
            return one, statistics.median(in_turn), statistics.median(queued)

    one, in_turn, queued = asyncio.run(through_async())
    with elib.connect(url) as robot:
        trip(robot.proximity, 200)
        blocking = trip(robot.proximity, count)
    return {
        "raw os.read/os.write": row(floor, floor),
        "async": row(one, floor, "2"),
        "1,000 async, one by one, each": row(in_turn, floor),
        "1,000 queued, each": row(queued, floor, "not above the line before"),
        "blocking": row(blocking, floor, "3"),
    }


def paced(url: str) -> Table:
    requests: list[bytes] = []
    sizes: list[int] = []

    def watch(_: float, event: object) -> None:
        match event:
            case Wrote(data=data):
                requests.append(data)
                sizes.append(0)
            case Received(data=data):
                sizes[-1] += len(data)

    with elib.connect(url) as robot:
        robot.trace(watch)
        robot.sensors()
        request, size = requests[0], sizes[0]
        ours, picture = trip(robot.sensors, 20), trip(robot.image, 8)
    with contextlib.closing(Raw(url)) as raw:
        floor = trip(lambda: raw.ask(request, size=size), 20)
        floor_picture = trip(lambda: raw.ask(b"\xb7\0", size=3203), 8)
    return {
        f"sensors(), {len(request)}+{size} bytes": row(ours, floor, "1.05"),
        "picture 40 x 40 in colour": row(picture, floor_picture, "1.03"),
    }


IDLE = """
import resource, time, elib
robot = elib.connect({url!r})
robot.proximity()
began = time.process_time()
time.sleep(5)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, (time.process_time() - began) / 5)
robot.close()
"""


def output(program: str) -> str:
    return subprocess.run([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, check=True).stdout


def idle(rounds: int) -> Table:
    works = ("pass", "import elib", "import elib; elib.connect")
    took = in_turns({work: lambda work=work: trip(lambda: output(work), 1) for work in works}, rounds)
    empty, full, facade = (statistics.median(took[work]) for work in works)
    with simulated(*FIRMWARE) as (_, [url]):
        memory, load = map(float, output(IDLE.format(url=url)).split())
    return {
        "import elib, s beyond an empty Python": {"figure": full - empty, "goal": "0.15"},
        "elib.connect, s beyond an empty Python": {"figure": facade - empty, "goal": "0.15"},
        "a connected idle program, MB": {"figure": memory, "goal": "45"},
        "a connected idle program, % of a core": {"figure": 100 * load, "goal": "0.5"},
    }


@quick(trips=50, rounds=1, seconds=1.0)
def measure(*, trips: int = 2000, rounds: int = 10, seconds: float = 10.0) -> Tables:
    with started(*calling(bare_robot)) as (_, [url]):
        yield "proximity() on a pty, a robot that answers a constant", round_trips(url, trips, rounds)
    with simulated(*FIRMWARE, "--baud", "0", "--world", "square") as (_, [url]):
        yield "proximity() on a pty, the emulated firmware, unpaced", round_trips(url, trips, rounds)
    with simulated(*FIRMWARE, "--latency", "0.015") as (_, [url]):
        yield "115,200 baud, 15 ms each way, the emulated firmware", paced(url)
    crowd = at_rate(50, 20, seconds, "--pty", *FIRMWARE, reading="proximity")
    found = {"answers/s": crowd["polls a second"], "% of a core": 100 * crowd["this program's share"], "goal": "10 %"}
    yield "many robots in another process", {"proximity() of 50 robots at 20 Hz": found}
    yield "starting and waiting", idle(min(rounds, 5))


if __name__ == "__main__":
    run(__doc__, measure)
