"""How surely and how quickly an agent without a model finds the red box through ``elib agent`` alone.

In each placement a robot, a red box and four things of other colours stand at random in the world ``red-boxes``. The
agent is examples/agent/find_the_red_box.py: it decides by the pictures and readings of the tools. Whether it found the
box is decided by the world: it stands within 4 cm of the box, looks at it, and has pushed nothing by a centimetre.

    python benchmarks/agent.py --placements 20
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from pathlib import Path

TESTS = Path(__file__).parents[1] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "doors"), str(TESTS / "web")]

from test_agent_red_box import is_found, search  # noqa: E402

from elib.testing import simulated  # noqa: E402


def main() -> None:
    """Search in all placements and print how it went."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--placements", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    options = parser.parse_args()
    took, walls, found = [], [], 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(options.first, options.first + options.placements):
            began = time.perf_counter()
            said = simulated(search)(seed, Path(folder))
            walls.append(time.perf_counter() - began)
            took.append(said["time"])
            found += is_found(said)
            word = "found" if is_found(said) else "not found"
            print(f"{seed:3}  {word}, {said['gap']:.3f} m away, after {took[-1]:.0f} s, computed in {walls[-1]:.1f} s")
    print(f"found in {found} of {options.placements} placements")
    print(
        f"simulated time: median {statistics.median(took):.0f} s, longest {max(took):.0f} s; in all {sum(walls):.0f} s"
    )


if __name__ == "__main__":
    main()
