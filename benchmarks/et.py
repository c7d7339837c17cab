"""How fast et reads a log, beside plain Python that reads its lines and splits them, and how much memory it takes.

Each action runs in a process of its own over a log on disk. Figures: MB/s, the ratio to plain Python (above 1: faster
than the loop that anybody would write), and the peak of memory, which must stay below 600 MiB for a log of 1 GB
(27 million rows). It measures CPU time, which other programs hardly change, and shows the best of several rounds.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

from harness import Tables, in_turns, quick, run

ET = "import sys; from elib.records.et import main; sys.exit(main())"
FLOOR = "import sys\nfor line in open(sys.argv[2]):\n    line.split(' ')"
ACTIONS = (
    "Avg 0",
    "FromTo 0 100 50000",
    "FromCollection 3 Motors(..)",
    "Count 3",
    "Stats 0",
    "Stats 0 --by 3",
    "Latency",
    "Join",
)
SIMPLE = ACTIONS[:4]
"""Actions that must read 20 MB/s or more."""
COMMANDS = ("GetIR(..)", "GetLight(..)", "Motors(..)", "Stop(..)", "GetEncoders(..)")


def write_log(path: Path, rows: int) -> None:
    """Write a log of calls that took 5 to 15 ms; each fiftieth failed."""
    with path.open("w") as file:
        for call in range(rows // 2):
            time, name = call * 0.02, COMMANDS[call % len(COMMANDS)]
            end = time + 0.005 + call * 7919 % 997 / 1e5
            file.write(f"{time:.8f} Ada call {name} 0 0\n{end:.8f} Ada {'ko' if call % 50 == 7 else 'ok'} {name} 0 0\n")


def spent(*command: str) -> tuple[float, float]:
    """Return the CPU time of a process, s, and its peak of memory, MiB."""
    with subprocess.Popen([sys.executable, "-c", *command], stdout=subprocess.DEVNULL) as process:
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command[1:])} failed")
    scale = 1 << 20 if sys.platform == "darwin" else 1 << 10  # ru_maxrss: bytes there, KiB elsewhere
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / scale


@quick(rows=20_000, rounds=1)
def measure(*, rows: int = 1_000_000, rounds: int = 3) -> Tables:
    """Measure.

    Args:
        rows: Of the log.
        rounds: Of each action.
    """
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "run.log"
        write_log(log, rows)
        size = log.stat().st_size / 1e6
        works = {"plain Python": partial(spent, FLOOR, "-s", str(log))}
        works |= {action: partial(spent, ET, "-s", str(log), *action.split()) for action in ACTIONS}
        runs = in_turns(works, rounds)
    best = {name: min(seconds for seconds, _ in each) for name, each in runs.items()}
    floor = best["plain Python"]
    table = {
        name: {"MB/s": size / best[name], "ratio": floor / best[name], "peak, MiB": max(memory for _, memory in each)}
        for name, each in runs.items()
    }
    table["the slowest simple action"] = {"ratio": min(table[name]["ratio"] for name in SIMPLE)}
    yield f"{rows:,} rows, {size:.0f} MB", table


if __name__ == "__main__":
    run(__doc__, measure)
