"""How soon a robot stands after its program was ended or frozen, beside a stop that the program sends itself.

A program drives a virtual robot over a pty or TCP in real time, and is sent a signal at a random moment. The time runs
from the signal until the wheels rest and nothing is on its way to the robot. docs/concepts/link.md tells these times.
"""

from __future__ import annotations

import random
import signal
import statistics
import tempfile
import time
from pathlib import Path

from harness import Tables, quick, run, use_tests

use_tests("robot")

from served import ServedRobot, served_from_a_thread  # noqa: E402
from test_kill_points import start  # noqa: E402

import elib  # noqa: E402
from shared import wait_until  # noqa: E402

SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGKILL", "SIGSTOP")
MAX_DRIVE = 1.0
"""s. How long a program drives at most before it is sent the signal."""


def until_it_stands(number: str, line: str, chance: random.Random) -> float:
    """Return the time from the signal until the robot stands, s."""
    with tempfile.TemporaryDirectory() as folder, served_from_a_thread(line) as robot:
        process = start("blocking", robot.url, Path(folder), 2)
        try:
            wait_until(lambda: robot.is_turning)
            time.sleep(chance.uniform(0, MAX_DRIVE))
            process.send_signal(getattr(signal, number))
            return seconds_until_it_stands(robot, time.perf_counter())
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


def seconds_until_it_stands(robot: ServedRobot, began: float) -> float:
    """Return the time since *began* until the robot stands."""
    while not robot.stands:
        time.sleep(0.001)
    return time.perf_counter() - began


@quick(kills=1)
def measure(*, kills: int = 10, seed: int = 1) -> Tables:
    """Kill programs.

    Args:
        kills: By each signal and on each line.
        seed: Of the moments.
    """
    chance = random.Random(seed)
    for line in ("pty", "tcp"):
        own = [own_stop(line) for _ in range(kills)]
        times = {number: [until_it_stands(number, line, chance) for _ in range(kills)] for number in SIGNALS}
        rows = {
            name: {
                "median, ms": 1000 * statistics.median(each),
                "longest, ms": 1000 * max(each),
                "x own stop": statistics.median(each) / statistics.median(own),
            }
            for name, each in {"its own stop": own, **times}.items()
        }
        yield line, rows


if __name__ == "__main__":
    run(__doc__, measure)
