"""How exactly elib fit finds the hidden values of virtual robots: the table of the guide to parity.

Each is a typical robot, whose wheels, axle, infrared sensors and link are drawn from its seed, and is driven once
through the calibration drive. With 24 robots this takes some minutes.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from pathlib import Path

from elib.records.reader import read_recording
from elib.studies import fit_robot

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "studies"))
from parity_drives import hidden_robot, off

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


def main() -> None:
    """Drive, fit and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=24)
    parser.add_argument("--seed", type=int, default=100, help="of the first robot")
    parser.add_argument("--jitter", type=float, default=0.0, help="of the link, s")
    parser.add_argument("--duration", type=float, default=120.0, help="of each drive, s")
    options = parser.parse_args()
    rows: list[dict[str, float]] = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(options.robots):
            rows.append(errors(Path(folder), options.seed + number, options.jitter, options.duration))
            print(".", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    print(f"{options.robots:>3} robots{'':<26}{'mean':>10}{'largest':>10}")
    for name in rows[0]:
        values = [row[name] for row in rows]
        print(f"{name:<36}{sum(values) / len(values):>10.3f}{max(values):>10.3f}")


if __name__ == "__main__":
    main()
