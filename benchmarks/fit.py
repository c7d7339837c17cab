"""How exactly elib fit finds the hidden values of virtual robots: the table of the guide to parity.

Each is a typical robot, whose wheels, axle, infrared sensors and link are drawn from its seed, and is driven once
through the calibration drive. With 24 robots this takes some minutes.
"""

from __future__ import annotations

import math
import statistics
import sys
import tempfile
from pathlib import Path

from harness import Tables, quick, run, use_tests

from elib.records.reader import read_recording
from elib.studies import fit_robot

use_tests("studies")
from parity_drives import hidden_robot, off  # noqa: E402

DISTANCES = [0.001 * k for k in range(12, 61, 2)]
"""m, at which curves are compared: from where the drive turns to where noise hides the wall."""


def errors(folder: Path, seed: int, jitter: float, duration: float) -> dict[str, float]:
    """Return by how much each value of one robot was missed."""
    hidden = hidden_robot(folder, seed, keys=f"&jitter={jitter:g}" if jitter else "", duration=duration)
    found = fit_robot(read_recording(hidden.file))
    hidden.file.unlink()
    if found.wheels is None or found.link is None or found.curve is None:
        raise SystemExit(f"robot {seed}: {found.missing}")
    infrared = found.curve.infrared
    curve = [off(infrared.counts(each), hidden.light(each)) for each in DISTANCES]
    gains = [off(*pair) for pair in zip(infrared.gains, hidden.shares, strict=True)]
    offsets = [abs(one - other) for one, other in zip(infrared.offsets, hidden.open_air, strict=True)]
    return {
        "left wheel, %": 100 * off(found.wheels.left, hidden.left),
        "right wheel, %": 100 * off(found.wheels.right, hidden.right),
        "axle, %": 100 * off(found.wheels.axle, hidden.axle),
        "latency, ms": 1000 * abs(found.link.latency - hidden.latency),
        "infrared curve, % RMS": 100 * math.sqrt(sum(each**2 for each in curve) / len(curve)),
        "gain, % (worst sensor)": 100 * max(gains),
        "in the open, counts (worst sensor)": max(offsets),
        "unseen readings of walls, % RMS": 100 * found.curve.near_error,
    }


@quick(robots=1)
def measure(*, robots: int = 24, seed: int = 100, jitter: float = 0.0, duration: float = 120.0) -> Tables:
    """Drive and fit.

    Args:
        robots: How many.
        seed: Of the first robot.
        jitter: Of the link, s.
        duration: Of each drive, s.
    """
    missed: list[dict[str, float]] = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(robots):
            missed.append(errors(Path(folder), seed + number, jitter, duration))
            print(".", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    columns = {name: [each[name] for each in missed] for name in missed[0]}
    rows = {name: {"mean": statistics.fmean(each), "largest": max(each)} for name, each in columns.items()}
    yield f"missed by, of {robots} robots", rows


if __name__ == "__main__":
    run(__doc__, measure)
