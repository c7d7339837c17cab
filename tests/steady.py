"""Run the quick lane again and again beside busy loops: the tool with which unsteady tests are found.

``make steady N=20`` runs it. Each lap draws a seed, from which the order of the test files and the examples of
Hypothesis follow. A failure is printed with its seed; ``make steady N=1 SEED=...`` runs that lap again.
"""

from __future__ import annotations

import argparse
import contextlib
import secrets
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
LANES = {"quick": "test", "long": "test-all"}
"""The targets of make."""


@contextlib.contextmanager
def load(loops: int) -> Iterator[None]:
    """Keep so many processor cores busy."""
    processes = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(loops)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


def lap(seed: int, lane: str) -> list[str]:
    """Run a lane once; return the tests that failed, or what pytest said if it came to no result."""
    command = ["make", LANES[lane], f"ARGS=-rfE --hypothesis-seed={seed}"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if not done.returncode:
        return []
    (ROOT / ".cache").mkdir(exist_ok=True)
    (ROOT / ".cache" / f"steady-{seed}.log").write_text(done.stdout + done.stderr)
    lines = done.stdout.splitlines()
    return [line for line in lines if line.startswith(("FAILED ", "ERROR "))] or lines[-20:]


def main() -> int:  # clock: it tells how long a lap took
    """Run all laps; return 1 if a test failed in any of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("laps", type=int, nargs="?", default=20)
    parser.add_argument("--seed", type=int, help="the seed of the first lap; the others are drawn")
    parser.add_argument("--loops", type=int, default=2, help="busy loops beside the tests")
    parser.add_argument("--lane", choices=LANES, default="quick")
    options = parser.parse_args()
    green = 0
    with load(options.loops):
        for number in range(1, options.laps + 1):
            seed = secrets.randbelow(2**32) if options.seed is None or number > 1 else options.seed
            began = time.monotonic()
            failed = lap(seed, options.lane)
            green += not failed
            took = f"{'failed' if failed else 'green'} in {time.monotonic() - began:.0f} s"
            print(f"lap {number} of {options.laps}, seed {seed}: {took}", *failed, sep="\n  ", flush=True)
            if failed:
                print(f"  Again: make steady N=1 SEED={seed}. All of it: .cache/steady-{seed}.log", flush=True)
    print(f"{green} of {options.laps} green")
    return green < options.laps


if __name__ == "__main__":
    sys.exit(main())
