"""What the flight recorder costs, and what a killed program loses.

Round trips of proximity() on a pty, the emulated firmware in another process, with and without a recorder in turns of
the same run: at 115,200 baud, as a robot's line is, and unpaced, where every microsecond shows. The rate of each turn
is compared with its neighbour's, because other programs use the machine too; the figure is the median of these ratios.
Before its turn is counted, a recorder has worked for longer than it collects, so that its thread's work counts too.

Then a program that records a robot at 20 times real time is killed with SIGKILL at random moments, and what is in its
file is compared with what it had reported until then.
"""

from __future__ import annotations

import asyncio
import random
import statistics
import tempfile
import time
from pathlib import Path

from bench_link import FIRMWARE
from harness import Cell, Tables, quick, ratio, run, simulated, use_tests

import elib

use_tests("records")
from killing import SPEED, Killed, record_and_kill  # noqa: E402

TURN = 0.8
"""s."""
AHEAD = 0.6
"""s that a recorder is at work before its turn."""


async def turn(robot: elib.Epuck, seconds: float) -> tuple[float, float]:
    """Return the round trips a second, and the processor's time that each took, s."""
    trips, began, spent = 0, time.perf_counter(), time.process_time()
    while (now := time.perf_counter()) < began + seconds:
        await robot.proximity()
        trips += 1
    return trips / (now - began), (time.process_time() - spent) / trips


async def compare(url: str, turns: int, folder: Path) -> dict[str, Cell]:
    """Return the figures of one line."""
    without, recorded = [], []
    sizes: list[float] = []
    async with elib.open(url) as robot:
        await turn(robot, TURN)
        for number in range(turns):
            without.append(await turn(robot, TURN))
            path, began = folder / f"{number}.mcap", robot.time
            with robot.record(path):
                await turn(robot, AHEAD)
                recorded.append(await turn(robot, TURN))
            sizes.append(path.stat().st_size / (robot.time - began))
    (plain, plain_spent), (rates, spent) = zip(*without, strict=True), zip(*recorded, strict=True)
    lower, _, upper = statistics.quantiles([one / other for one, other in zip(rates, plain, strict=True)], n=4)
    return {
        "/s without": statistics.median(plain),
        "/s recorded": statistics.median(rates),
        "ratio": ratio(rates, plain),
        "lower quartile": lower,
        "upper": upper,
        "us of CPU a trip": 1e6 * statistics.median(one - other for one, other in zip(spent, plain_spent, strict=True)),
        "KB/s": statistics.median(sizes) / 1000,
    }


def killed(count: int, seed: int) -> list[Killed]:
    moments = random.Random(seed)
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            pause = moments.uniform(0.2, 3.0)
            found.append(record_and_kill(Path(folder) / f"{number}.mcap", lambda pause=pause: time.sleep(pause)))
    return found


@quick(turns=2, kills=1)
def measure(*, turns: int = 20, kills: int = 50, seed: int = 1) -> Tables:
    """Measure.

    Args:
        turns: Of each line, with and without; 0 leaves them out.
        kills: Of the recording program.
        seed: Of the moments of the kills.
    """
    rates = {}
    for name, baud in (("115200 baud", "115200"), ("unpaced", "0")) if turns else ():
        options = (*FIRMWARE, "--baud", baud, "--world", "square")
        with simulated(*options) as (_, [url]), tempfile.TemporaryDirectory() as folder:
            rates[name] = asyncio.run(compare(url, turns, Path(folder)))
    if rates:
        yield "round trips of proximity() on a pty, in turns; goal: 0.95 of the rate", rates
    ends = killed(kills, seed)
    losses = sorted(each.loss for each in ends)
    if losses:
        found = {
            "median loss, s": statistics.median(losses),
            "most, s": losses[-1],
            "below 1 s": f"{sum(loss < 1 for loss in losses)} of {kills}",
            "damaged chunks": sum(each.health.damaged for each in ends),
        }
        yield f"a recording program at {SPEED} times real time, killed", {"wall time; no gap before it": found}


if __name__ == "__main__":
    run(__doc__, measure)
