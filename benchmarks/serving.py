"""Whether `elib simulate` serves a crowd in real time, and how much is left.

A server of its own process offers the robots of the world `crowd` on TCP ports, or ptys; this process opens all of them
as one swarm and polls every sensor of each at a fixed rate. Used: what the server's process takes of one core for all
polls wanted. Available: the whole core, since one thread serves all. The headroom is available by used. A second part
asks as fast as the server answers, without the line's pace.

    python benchmarks/serving.py [--robots 20] [--rate 20] [--seconds 10] [--pty] [--json]

The last line of the JSON form is {"headroom": ..., ...}.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import math
import os
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import elib
from elib.base.timebase import new_loop

SETTLING = 1.0
"""s that robots drive before anything is measured."""


@dataclass
class Polls:
    """The results of the polls of all robots.

    A poll is due at a fixed time; it is late if its answer comes when the next one is due, and left out if not even
    its question has left by then.
    """

    period: float
    trips: list[float] = field(default_factory=list)
    waits: list[float] = field(default_factory=list)
    late: int = 0
    left_out: int = 0

    async def go_on(self, robot: elib.Epuck, first: float, end: float) -> None:
        """Poll *robot* at its times from *first* to *end*."""
        loop = asyncio.get_running_loop()
        due = first
        while due < end:
            await asyncio.sleep(max(0.0, due - loop.time()))
            began = loop.time()
            await robot.sensors()
            now = loop.time()
            self.waits.append(began - due)
            self.trips.append(now - began)
            self.late += now > due + self.period
            due += self.period
            while due + self.period < now:
                self.left_out += 1
                due += self.period


@contextlib.contextmanager
def server(robots: int, *options: str) -> Iterator[tuple[int, list[str]]]:
    """Serve a crowd in another process; give its number and the robots' URLs."""
    command = [sys.executable, "-m", "elib", "simulate", "--world", "crowd", "--robots", str(robots), *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process.pid, [process.stdout.readline().split()[1] for _ in range(robots)]
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(10)


def busy(pid: int) -> float:
    """Return the CPU time that a process has used, s."""
    with open(f"/proc/{pid}/stat", encoding="ascii") as file:
        fields = file.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def delayed(pid: int) -> float:
    """Return how long a process was ready to run and had no core, s: what the machine's other work costs it."""
    with contextlib.suppress(OSError), open(f"/proc/{pid}/schedstat", encoding="ascii") as file:
        return int(file.read().split()[1]) / 1e9
    return math.nan


async def drive(robots: elib.Swarm) -> None:
    """Let all drive, so that there is something to see and to bump into."""
    await robots.all.set_speed(0.3, 0.25)
    await asyncio.sleep(SETTLING)


def at_rate(count: int, rate: float, seconds: float, way: list[str]) -> dict[str, float]:
    """Poll all at *rate*, s apart evenly over a period, and return what it took."""

    async def main(robots: elib.Swarm) -> dict[str, float]:
        await drive(robots)
        polls = Polls(1 / rate)
        start = asyncio.get_running_loop().time() + 0.1
        served, here, began = busy(pid), time.process_time(), time.perf_counter()
        waited, waited_here = delayed(pid), delayed(os.getpid())
        await asyncio.gather(
            *(
                polls.go_on(robot, start + index * polls.period / count, start + seconds)
                for index, robot in enumerate(robots)
            )
        )
        took = time.perf_counter() - began
        return {
            "polls_per_s": len(polls.trips) / seconds,
            "server_load": (busy(pid) - served) / took,
            "client_load": (time.process_time() - here) / took,
            "server_delayed": (delayed(pid) - waited) / took,
            "client_delayed": (delayed(os.getpid()) - waited_here) / took,
            "median_ms": statistics.median(polls.trips) * 1e3,
            "p99_ms": statistics.quantiles(polls.trips, n=100)[98] * 1e3,
            "late": polls.late,
            "left_out": polls.left_out,
        }

    with server(count, *way) as (pid, urls):
        return elib.swarm(urls).run(main)


def flat_out(count: int, seconds: float, way: list[str]) -> dict[str, float]:
    """Ask all again and again, without the line's pace, and return how many polls a second the server answers."""

    async def main(robots: elib.Swarm) -> dict[str, float]:
        await drive(robots)
        answers = 0

        async def ask(robot: elib.Epuck, end: float) -> None:
            nonlocal answers
            patient = robot.within(10)
            while asyncio.get_running_loop().time() < end:
                await patient.sensors()
                answers += 1

        served, began = busy(pid), time.perf_counter()
        end = asyncio.get_running_loop().time() + seconds
        await asyncio.gather(*(ask(robot, end) for robot in robots))
        took = time.perf_counter() - began
        return {"polls_per_s": answers / took, "server_load": (busy(pid) - served) / took}

    with server(count, "--baud", "0", *way) as (pid, urls):
        return elib.swarm(urls).run(main)


def idle(count: int, seconds: float, way: list[str]) -> float:
    """Return what the server takes of a core while nobody asks anything: the physics of standing robots."""
    with server(count, *way) as (pid, _):
        asyncio.Runner(loop_factory=lambda: new_loop("real")).run(asyncio.sleep(SETTLING))
        before, began = busy(pid), time.perf_counter()
        asyncio.Runner(loop_factory=lambda: new_loop("real")).run(asyncio.sleep(seconds))
        return (busy(pid) - before) / (time.perf_counter() - began)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=20)
    parser.add_argument("--rate", type=float, default=20.0, help="polls a second of each robot")
    parser.add_argument("--seconds", type=float, default=10.0, help="how long each part lasts")
    parser.add_argument("--pty", action="store_true", help="serve on ptys instead of TCP ports")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    way = ["--pty"] if asked.pty else ["--tcp", "0"]
    paced = at_rate(asked.robots, asked.rate, asked.seconds, way)
    most = flat_out(asked.robots, asked.seconds / 2, way)
    resting = idle(asked.robots, asked.seconds / 2, way)
    wanted = asked.robots * asked.rate
    result = {
        "robots": asked.robots,
        "rate": asked.rate,
        "headroom": paced["polls_per_s"] / wanted / paced["server_load"],  # as if none had been left out
        "most_by_wanted": most["polls_per_s"] / wanted,
        "idle_load": resting,
        **paced,
        "most_polls_per_s": most["polls_per_s"],
    }
    if asked.json:
        print(json.dumps({key: round(value, 4) for key, value in result.items()}))
        return
    print(f"{asked.robots} robots on {'ptys' if asked.pty else 'TCP ports'}, all sensors at {asked.rate:g} Hz")
    print(f"  polls a second             {paced['polls_per_s']:8.0f} of {wanted:.0f} wanted")
    print(f"  late / left out            {paced['late']:8.0f} / {paced['left_out']:.0f}")
    print(f"  round trip                 {paced['median_ms']:8.1f} ms, 99 % below {paced['p99_ms']:.1f} ms")
    print(f"  the server's share         {paced['server_load']:8.1%} of a core, {resting:.1%} while nobody asks")
    print(f"  this program's share       {paced['client_load']:8.1%} of a core")
    held_up = f"{paced['server_delayed']:.0%} and {paced['client_delayed']:.0%} of the time"
    print(f"  ready, but without a core  {held_up}: other work on this machine")
    print(f"  headroom, available/used   {result['headroom']:8.1f}")
    by_cpu = most["polls_per_s"] / most["server_load"]
    print(f"  unpaced, flat out          {most['polls_per_s']:8.0f} polls a second, {by_cpu:.0f} a second of CPU time")


if __name__ == "__main__":
    main()
