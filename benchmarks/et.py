"""How fast et reads a log, beside plain Python that reads its lines and splits them, and how much memory it takes.

Each action runs in a process of its own over a log on disk. Figures: MB/s, the ratio to the floor (above 1: faster than
the loop that anybody would write), and the peak of memory, which must stay below 600 MiB for a log of 1 GB (27 million
rows). It measures CPU time, which other programs hardly change, and prints the best of several rounds.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

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
ROUNDS = 3


def write_log(path: Path, rows: int) -> None:
    """Write a log of calls that took 5 to 15 ms; each fiftieth failed."""
    with path.open("w") as file:
        for call in range(rows // 2):
            time, name = call * 0.02, COMMANDS[call % len(COMMANDS)]
            end = time + 0.005 + call * 7919 % 997 / 1e5
            file.write(f"{time:.8f} Ada call {name} 0 0\n{end:.8f} Ada {'ko' if call % 50 == 7 else 'ok'} {name} 0 0\n")


def measure(*command: str) -> tuple[float, float]:
    """Return the CPU time of a process, s, and its peak of memory, MiB."""
    with subprocess.Popen([sys.executable, "-c", *command], stdout=subprocess.DEVNULL) as process:
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command[1:])} failed")
    scale = 1 << 20 if sys.platform == "darwin" else 1 << 10  # ru_maxrss: bytes there, KiB elsewhere
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / scale


def best(*command: str) -> tuple[float, float]:
    """Return the least CPU time and the greatest memory of several rounds."""
    runs = [measure(*command) for _ in range(ROUNDS)]
    return min(seconds for seconds, _ in runs), max(memory for _, memory in runs)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=1_000_000, help="rows of the log")
    parser.add_argument("--json", action="store_true", help="the figures as one line of JSON, last")
    options = parser.parse_args()
    figures: dict[str, dict[str, float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "run.log"
        write_log(log, options.rows)
        size = log.stat().st_size / 1e6
        floor, _ = best(FLOOR, "-s", str(log))
        print(f"{options.rows:,} rows, {size:.0f} MB; plain Python reads and splits {size / floor:.0f} MB/s")
        print(f"{'action':<28}  MB/s  ratio  peak, MiB")
        for action in ACTIONS:
            seconds, memory = best(ET, "-s", str(log), *action.split())
            figures[action] = {"mb_per_s": size / seconds, "ratio": floor / seconds, "peak_mib": memory}
            print(f"{action:<28} {size / seconds:5.0f} {floor / seconds:6.2f} {memory:10.0f}", flush=True)
    slowest = min(figures[action]["ratio"] for action in SIMPLE)
    print(f"the slowest simple action is {slowest:.2f} times as fast as plain Python")
    if options.json:
        print(json.dumps({"floor_mb_per_s": size / floor, "actions": figures}))


if __name__ == "__main__":
    main()
