"""What the flight recorder costs, and what a killed program loses.

Round trips of proximity() on a pty, the emulated firmware in another process, with and without a recorder in turns of
the same run: at 115,200 baud, as a robot's line is, and unpaced, where every microsecond shows. The rate of each turn
is compared with its neighbour's, because other programs use the machine too; the figure is the median of these ratios.
Before its turn is counted, a recorder has worked for longer than it collects, so that its thread's work counts too.

Then a program that records a robot at 20 times real time is killed with SIGKILL at random moments, and what is in its
file is compared with what it had reported until then.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import random
import statistics
import sys
import tempfile
import time
from pathlib import Path

from bench_link import FIRMWARE, robots

import elib

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "records"))
from killing import SPEED, Killed, record_and_kill

TURN = 0.8
"""s."""
AHEAD = 0.6
"""s that a recorder is at work before its turn."""
GOAL, SECOND = 0.95, 1.0


async def turn(robot: elib.Epuck, seconds: float) -> tuple[float, float]:
    """Return the round trips a second, and the processor's time that each took, s."""
    trips, began, spent = 0, time.perf_counter(), time.process_time()
    while (now := time.perf_counter()) < began + seconds:
        await robot.proximity()
        trips += 1
    return trips / (now - began), (time.process_time() - spent) / trips


async def compare(url: str, turns: int, folder: Path) -> dict[str, float]:
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
    ratios = [rate / other for (rate, _), (other, _) in zip(recorded, without, strict=True)]
    quartiles = statistics.quantiles(ratios, n=4)
    return {
        "rate_without": statistics.median(rate for rate, _ in without),
        "rate_recorded": statistics.median(rate for rate, _ in recorded),
        "ratio": quartiles[1],
        "ratio_lower_quartile": quartiles[0],
        "ratio_upper_quartile": quartiles[2],
        "processor_us_a_trip": 1e6
        * statistics.median(mine - other for (_, mine), (_, other) in zip(recorded, without, strict=True)),
        "bytes_a_second": statistics.median(sizes),
    }


def rates(turns: int) -> dict[str, dict[str, float]]:
    found = {}
    for name, baud in (("115200 baud", 115_200), ("unpaced", 0)):
        with robots(firmware=FIRMWARE, baud=baud, world="square") as (url,), tempfile.TemporaryDirectory() as folder:
            found[name] = figures = asyncio.run(compare(url, turns, Path(folder)))
        print(
            f"  {name:12}{figures['rate_without']:8,.0f} /s without, {figures['rate_recorded']:8,.0f} /s recorded: "
            f"{figures['ratio']:.3f} ({figures['ratio_lower_quartile']:.3f} to {figures['ratio_upper_quartile']:.3f}), "
            f"{figures['processor_us_a_trip']:.0f} us of processor a trip, {figures['bytes_a_second'] / 1000:.0f} KB/s",
            flush=True,
        )
    return found


def kills(count: int, seed: int) -> list[Killed]:
    moments = random.Random(seed)
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            pause = moments.uniform(0.2, 3.0)
            found.append(record_and_kill(Path(folder) / f"{number}.mcap", lambda pause=pause: time.sleep(pause)))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--turns", type=int, default=20, help="of each line, with and without (20)")
    parser.add_argument("--kills", type=int, default=50, help="of the recording program (50)")
    parser.add_argument("--seed", type=int, default=1, help="of the moments of the kills (1)")
    parser.add_argument("--json", action="store_true", help="the figures as one line of JSON, last")
    options = parser.parse_args()
    figures: dict[str, object] = {}
    if options.turns > 1:
        print("round trips of proximity() on a pty, in turns; goal: 0.95 of the rate")
        figures["rates"] = found = rates(options.turns)
        figures["met"] = found["115200 baud"]["ratio"] >= GOAL
    if options.kills:
        print(f"a recording program at {SPEED} times real time, killed at {options.kills} random moments")
        ends = kills(options.kills, options.seed)
        losses = sorted(each.loss for each in ends)
        kept = sum(each.loss < SECOND for each in ends)
        figures["kills"] = {
            "count": len(ends),
            "within_a_second": kept,
            "loss_median_s": statistics.median(losses),
            "loss_most_s": losses[-1],
            "damaged": sum(each.health.damaged for each in ends),
        }
        print(
            f"  loss: median {statistics.median(losses):.2f} s of wall time, most {losses[-1]:.2f} s; below 1 s in "
            f"{kept} of {len(ends)}; no gap before it, {sum(each.health.damaged for each in ends)} damaged chunks"
        )
    if options.json:
        print(json.dumps(figures))


if __name__ == "__main__":
    main()
