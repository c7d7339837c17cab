"""How soon a robot stands after its program was ended or frozen, beside a stop that the program sends itself.

A program drives a virtual robot over a pty or TCP in real time, and is sent a signal at a random moment. The time runs
from the signal until the wheels rest and nothing is on its way to the robot. docs/concepts/link.md tells these times.

    python benchmarks/stopping.py --kills 10
"""

from __future__ import annotations

import argparse
import random
import signal
import statistics
import sys
import tempfile
import time
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1] / "tests"), str(Path(__file__).parents[1] / "tests" / "robot")]

from served import served_from_a_thread  # noqa: E402
from test_kill_points import start  # noqa: E402

import elib  # noqa: E402
from shared import wait_until  # noqa: E402

MAX_DRIVE = 1.0
"""s. How long a program drives at most before it is sent the signal."""


def until_it_stands(program: str, number: str, line: str, chance: random.Random) -> float:
    """Return the time from the signal until the robot stands, s."""
    with tempfile.TemporaryDirectory() as folder, served_from_a_thread(line) as robot:
        process = start(program, robot.url, Path(folder), 2)
        try:
            wait_until(lambda: robot.is_turning)
            time.sleep(chance.uniform(0, MAX_DRIVE))
            process.send_signal(getattr(signal, number))
            return seconds_until_it_stands(robot)
        finally:
            process.kill()
            process.wait()


def own_stop(line: str) -> float:
    """Return how long a stop takes that the program sends itself, s: the floor."""
    with served_from_a_thread(line) as robot, elib.connect(robot.url) as driver:
        driver.set_speed(0.3, 0.3)
        began = time.perf_counter()
        driver.begin.stop()
        return seconds_until_it_stands(robot, began)


def seconds_until_it_stands(robot: object, began: float | None = None) -> float:
    """Return the time since *began*, or since now, until the robot stands."""
    began = time.perf_counter() if began is None else began
    while not robot.stands:  # type: ignore[attr-defined]
        time.sleep(0.001)
    return time.perf_counter() - began


def main() -> None:
    """Kill programs by each signal, and print how soon their robots stood."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=10, help="by each signal and on each line")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    chance = random.Random(options.seed)
    for line in ("pty", "tcp"):
        floor = statistics.median(own_stop(line) for _ in range(options.kills))
        print(f"{line}: a stop of the program itself takes {floor * 1000:.0f} ms")
        for number in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGKILL", "SIGSTOP"):
            times = [until_it_stands("blocking", number, line, chance) for _ in range(options.kills)]
            middle = statistics.median(times)
            told = f"median {middle * 1000:4.0f} ms, longest {max(times) * 1000:4.0f} ms"
            print(f"  {number:8} {told}, {middle / floor:.1f} times that")


if __name__ == "__main__":
    main()
