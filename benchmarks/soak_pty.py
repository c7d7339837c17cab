"""Ten real minutes on a pty with the faults of flaky Bluetooth: every call ends, counts agree, memory does not grow.

Robot and program share one process and one event loop; between them is a real pty, so the bytes go through the kernel
in real time. It ends with exit code 1 if a check fails.
"""

from __future__ import annotations

import asyncio
import gc
import os
import resource
import sys
import threading
import time
from collections import Counter
from pathlib import Path

from harness import Tables, quick, run

import elib
from elib.base.timebase import new_loop
from elib.link.session import Called, Ended, TraceEvent, Wrote
from elib.link.transport.pty import PtyTransport
from elib.simulator.emulator.settings import SimulationSettings
from elib.simulator.emulator.simulation import Simulation

PERIOD = 0.2
"""s between two rounds of calls."""
SHARE_OF_WARM_UP = 0.25
MORE_BLOCKS, MORE_MEMORY = 1500, 2_000_000
"""Blocks and bytes by which the process may have grown since the warm-up."""


class Books:
    """Counts calls and the probes of resyncs."""

    def __init__(self) -> None:
        self.called = self.ended = self.questions = self.twice = 0

    def __call__(self, moment: float, event: TraceEvent) -> None:
        match event:
            case Called():
                self.called += 1
            case Ended():
                self.ended += 1
                self.twice += self.ended != self.called
            case Wrote(data=data) if data.startswith(b"\0"):
                self.questions += 1


def memory() -> tuple[int, int]:
    """Return allocated blocks and resident bytes."""
    gc.collect()
    pages = Path("/proc/self/statm")
    resident = int(pages.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") if pages.exists() else 0
    return sys.getallocatedblocks(), resident


async def soak(seconds: float, script: str) -> dict[str, bool]:
    simulation = Simulation(SimulationSettings(world="square", fault=script))
    pty = PtyTransport()
    simulation.robots[0].link.attach(pty)
    books, ends, before = Books(), Counter[str](), (0, 0)
    slowest = 0.0
    async with elib.open(pty.url) as robot:
        robot.trace(books)
        start = robot.time
        turn = 0
        while robot.time - start < seconds:
            turn += 1
            for call in (robot.proximity(), robot.set_speed(0.2, 0.1 + 0.001 * (turn % 100))):
                began = robot.time
                try:
                    await call
                    ends["value"] += 1
                except elib.ReplyTimeout:
                    ends["timeout"] += 1
                slowest = max(slowest, robot.time - began)
            if before == (0, 0) and robot.time - start > seconds * SHARE_OF_WARM_UP:
                before = memory()
            await robot.sleep(PERIOD)
        after = memory()
        statistics, counts, tasks = robot.statistics, simulation.robots[0].player.counts, len(asyncio.all_tasks())
    simulation.close()
    await pty.close()
    calls = ends.total()
    unanswered = books.questions - statistics.resyncs
    print(f"{script} on {pty.url} for {seconds:g} s")
    print(f"calls {calls}, {dict(ends)}; resyncs {statistics.resyncs}, of their questions {unanswered} unanswered")
    print(f"the script: {counts}")
    trips = f"median {statistics.median * 1e3:.1f} ms, p99 {statistics.p99 * 1e3:.1f} ms"
    print(f"{trips}, longest call {slowest * 1e3:.0f} ms")
    print(f"blocks {before[0]} -> {after[0]}, resident {before[1] / 1e6:.2f} -> {after[1] / 1e6:.2f} MB")
    print(f"processor time {time.process_time():.1f} s, peak {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss} kB")
    return {
        "every call ended once": (books.called - 1, books.ended - 1, books.twice) == (calls, calls, 0),
        "no call ended later than 0.15 s after its deadline": slowest <= 1.15,
        "values and statistics agree": statistics.count == ends["value"],
        "timeouts and statistics agree": statistics.lost + statistics.unsent == ends["timeout"],
        "what the script took is what was missed": counts.lost + counts.halved == statistics.lost + unanswered,
        "memory is flat": after[0] - before[0] < MORE_BLOCKS and after[1] - before[1] < MORE_MEMORY,
        "no task is left": tasks == 1 and len(asyncio.all_tasks()) == 1,
    }


@quick(seconds=4.0)
def measure(*, seconds: float = 600.0, fault: str = "flaky-bluetooth") -> Tables:
    """Soak the library.

    Args:
        seconds: How long.
        fault: The fault script.
    """
    threads = threading.active_count()
    with asyncio.Runner(loop_factory=lambda: new_loop("real")) as runner:
        checks = runner.run(soak(seconds, fault))
    checks["no thread is left"] = threading.active_count() == threads
    yield "checks", {name: {"": "ok" if is_kept else "FAILED"} for name, is_kept in checks.items()}
    if not all(checks.values()):
        raise SystemExit(1)


if __name__ == "__main__":
    run(__doc__, measure)
