"""How surely and how quickly an agent without a model finds the red box through ``elib agent`` alone.

In each placement a robot, a red box and four things of other colours stand at random in the world ``red-boxes``. The
agent is examples/agent/find_the_red_box.py: it decides by the pictures and readings of the tools. Whether it found the
box is decided by the world: it stands within 4 cm of the box, looks at it, and has pushed nothing by a centimetre.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from pathlib import Path

from harness import Tables, quick, run, use_tests

use_tests("doors")

from test_agent_red_box import is_found, search  # noqa: E402

from elib.testing import simulated  # noqa: E402


@quick(placements=2)
def measure(*, placements: int = 20, first: int = 0) -> Tables:
    """Search.

    Args:
        placements: How many.
        first: The first seed.
    """
    rows = {}
    took, found = [], 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + placements):
            began = time.perf_counter()
            said = simulated(search)(seed, Path(folder))
            took.append(said["time"])
            found += is_found(said)
            word = "found" if is_found(said) else "not found"
            computed = time.perf_counter() - began
            rows[str(seed)] = {"box": word, "m away": said["gap"], "after s": took[-1], "computed in s": computed}
    rows["all"] = {"box": f"{found} of {placements}", "after s": statistics.median(took), "longest s": max(took)}
    yield "placement", rows


if __name__ == "__main__":
    run(__doc__, measure)
