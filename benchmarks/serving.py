"""Whether ``elib simulate`` serves a crowd in real time, and how much is left.

A server of its own process offers the robots of the world ``crowd`` on TCP ports, or ptys; this process opens all of
them as one swarm and polls every sensor of each at a fixed rate. Used: what the server's process takes of one core for
all polls wanted. Available: the whole core, since one thread serves all. The headroom is available by used. A second
part asks as fast as the server answers, without the line's pace.
"""

from __future__ import annotations

import asyncio
import statistics
import time
from dataclasses import dataclass, field

from harness import Tables, load, quick, run, simulated

import elib

SETTLING = 1.0
"""s that robots drive before anything is measured."""
CROWD = ("--world", "crowd")


@dataclass
class Polls:
    """The results of the polls of all robots.

    A poll is due at a fixed time; it is late if its answer comes when the next one is due, and left out if not even
    its question has left by then.
    """

    period: float
    reading: str
    trips: list[float] = field(default_factory=list)
    late: int = 0
    left_out: int = 0

    async def go_on(self, robot: elib.Epuck, first: float, end: float) -> None:
        """Poll *robot* at its times from *first* to *end*."""
        loop = asyncio.get_running_loop()
        due = first
        while due < end:
            await asyncio.sleep(max(0.0, due - loop.time()))
            began = loop.time()
            await getattr(robot, self.reading)()
            now = loop.time()
            self.trips.append(now - began)
            self.late += now > due + self.period
            due += self.period
            while due + self.period < now:
                self.left_out += 1
                due += self.period


async def drive(robots: elib.Swarm) -> None:
    """Let all drive, so that there is something to see and to bump into."""
    await robots.all.set_speed(0.3, 0.25)
    await asyncio.sleep(SETTLING)


def at_rate(count: int, rate: float, seconds: float, *way: str, reading: str = "sensors") -> dict[str, float]:
    """Poll all at *rate*, s apart evenly over a period, and return what it took."""

    async def main(robots: elib.Swarm) -> dict[str, float]:
        await drive(robots)
        polls = Polls(1 / rate, reading)
        start = asyncio.get_running_loop().time() + 0.1
        with load(pid) as server, load() as here:
            await asyncio.gather(
                *(
                    polls.go_on(robot, start + index * polls.period / count, start + seconds)
                    for index, robot in enumerate(robots)
                )
            )
        return {
            "polls a second": len(polls.trips) / seconds,
            "polls a second, wanted": count * rate,
            "late": polls.late,
            "left out": polls.left_out,
            "round trip, median, ms": statistics.median(polls.trips) * 1e3,
            "round trip, 99 % below, ms": statistics.quantiles(polls.trips, n=100)[98] * 1e3,
            "the server's share of a core": server.share,
            "this program's share": here.share,
            "the server is ready without a core": server.delayed,
            "this program is": here.delayed,
            # as if no poll had been left out
            "headroom, available/used": len(polls.trips) / seconds / (count * rate) / server.share,
        }

    with simulated(*CROWD, *way, robots=count) as (pid, urls):
        return elib.swarm(urls).run(main)


def flat_out(count: int, seconds: float, *way: str) -> dict[str, float]:
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

        began = time.perf_counter()
        end = asyncio.get_running_loop().time() + seconds
        with load(pid) as server:
            await asyncio.gather(*(ask(robot, end) for robot in robots))
        rate = answers / (time.perf_counter() - began)
        return {"unpaced polls a second": rate, "unpaced polls a second of CPU time": rate / server.share}

    with simulated(*CROWD, "--baud", "0", *way, robots=count) as (pid, urls):
        return elib.swarm(urls).run(main)


def idle(count: int, seconds: float, *way: str) -> float:
    """Return what the server takes of a core while nobody asks anything: the physics of standing robots."""
    with simulated(*CROWD, *way, robots=count) as (pid, _):
        time.sleep(SETTLING)
        with load(pid) as server:
            time.sleep(seconds)
    return server.share


@quick(robots=5, seconds=1.0)
def measure(*, robots: int = 20, rate: float = 20.0, seconds: float = 10.0, pty: bool = False) -> Tables:
    """Measure.

    Args:
        robots: How many.
        rate: Polls a second of each robot.
        seconds: How long each part lasts.
        pty: Serve on ptys instead of TCP ports.
    """
    way = ("--pty",) if pty else ("--tcp", "0")
    found = at_rate(robots, rate, seconds, *way) | flat_out(robots, seconds / 2, *way)
    found["the server's share while nobody asks"] = idle(robots, seconds / 2, *way)
    title = f"{robots} robots on {'ptys' if pty else 'TCP ports'}, all sensors at {rate:g} Hz"
    yield title, {name: {"figure": value} for name, value in found.items()}


if __name__ == "__main__":
    run(__doc__, measure)
