"""``elib fit``: fit of a robot profile to a recorded drive."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.body import AXLE
from elib.base.errors import ArgumentError
from elib.cli.arguments import AsJson, option
from elib.cli.terminal import LiveLine, columns, json_line, quoted, say, table
from elib.records.reader import read_recording
from elib.simulator.emulator.robotprofile import NOMINAL_RADIUS, write
from elib.studies import Fitted, fit_robot
from elib.studies.infrared import NEAR

Recorded = Annotated[Path, Cli(name="FILE", help="A recording of a drive, .mcap.")]
Output = Annotated[Path | None, option("--output, -o PROFILE", "Write the profile to this .toml file.")]
WorldName = Annotated[str | None, option("--world NAME", "World in which it drove, if the recording has none.")]


def fit(file: Recorded, /, *, output: Output = None, world: WorldName = None, json: AsJson = False) -> None:
    """Fit wheels, link and infrared sensors of a robot from a recorded drive.

    sim://WORLD?profile=FILE and `elib simulate --profile FILE` use the profile. The best drive is that of `elib run
    calibration-drive --record FILE`: two minutes of legs, turns, arcs and approaches to a wall. Wheels and sensors need
    poses measured from outside; the recording of a virtual robot has them.

    For example:
        elib run calibration-drive --record drive.mcap --robot serial:///dev/rfcomm0
        elib fit drive.mcap --output mine.toml
        elib run avoid --robot sim://arena?profile=mine.toml
    """
    if output is not None and output.suffix.lower() != ".toml":
        raise ArgumentError(f"the profile cannot be written to {str(output)!r}; its name must end in .toml")
    with LiveLine() as line:
        found = fit_robot(read_recording(file), world=world, progress=lambda text: line.tell(f"fitting: {text}"))
    if output is not None:
        write(found.profile, output)
    print(json_line(to_json(found)) if json else to_text(found), flush=True)
    for each in found.missing:
        say(f"not fitted: {each.what}: {each.why}\nhint: {each.cure}")
    if output is not None and not json:
        say(f"wrote {output}; try it: elib compare {quoted(file)} --profile {quoted(output)}")


def to_text(found: Fitted) -> str:
    """Return the result as rows of label and text."""
    rows: list[tuple[str, str]] = []
    wheels, link, curve = found.wheels, found.link, found.curve
    if wheels is not None:
        width = 2 * NOMINAL_RADIUS
        for label, what, share, size, error in (
            ("left wheel", " in diameter", wheels.left, width * wheels.left, wheels.errors[0] / wheels.left),
            ("right wheel", " in diameter", wheels.right, width * wheels.right, wheels.errors[1] / wheels.right),
            ("axle", "", wheels.axle / AXLE, wheels.axle, wheels.errors[2] / wheels.axle),
        ):
            nominal = f"{100 * (share - 1):+.2f} % of nominal (± {100 * error:.3f} %)"
            rows.append((label, f"{1000 * size:.3f} mm{what}, {nominal}"))
        out = f", {wheels.left_out} others do not fit" if wheels.left_out else ""
        left_over = f"{1000 * wheels.position_error:.2f} mm, {math.degrees(wheels.heading_error):.2f} degrees"
        rows.append(("drive", f"{wheels.windows} pieces{out}; what is left over a piece: {left_over}"))
    if link is not None:
        latency = f"{1000 * link.latency:.1f} ms each way (± {1000 * link.error:.2f} ms)"
        rows.append(("latency", f"{latency}, jitter {1000 * link.jitter:.1f} ms, from {link.calls} calls"))
    if curve is not None:
        infrared = curve.infrared
        shown = ", ".join(f"{infrared.counts(d):.0f} at {100 * d:g} cm" for d in (0.01, 0.02, 0.03, 0.05))
        errors = f"{curve.error:.1f} counts RMS, {100 * curve.near_error:.1f} % of those {NEAR:g} above the open"
        nearest = f"nothing was nearer than {1000 * curve.nearest:.0f} mm"
        rows += [
            ("infrared", f"{shown}; noise {infrared.noise:.1f} counts"),
            ("gains", " ".join(f"{gain:.3f}" for gain in infrared.gains)),
            ("in the open", " ".join(f"{offset:.1f}" for offset in infrared.offsets)),
            ("predicted", f"readings that were not fitted, within {errors}; {nearest}"),
        ]
    return table(rows, width=min(columns(), 79))


def to_json(found: Fitted) -> dict[str, object]:
    """Return the result for JSON, in m, s and counts; None for what could not be fitted."""
    wheels, link, curve = found.wheels, found.link, found.curve
    return {
        "wheels": wheels
        and {
            "left_radius": NOMINAL_RADIUS * wheels.left,
            "right_radius": NOMINAL_RADIUS * wheels.right,
            "axle": wheels.axle,
            "errors": {
                "left_radius": NOMINAL_RADIUS * wheels.errors[0],
                "right_radius": NOMINAL_RADIUS * wheels.errors[1],
                "axle": wheels.errors[2],
            },
            "windows": wheels.windows,
            "left_out": wheels.left_out,
        },
        "link": link,
        "infrared": curve
        and {
            "curve": curve.infrared.curve,
            "noise": curve.infrared.noise,
            "gains": curve.infrared.gains,
            "offsets": curve.infrared.offsets,
            "nearest": curve.nearest,
            "error": curve.error,
            "near_error": curve.near_error,
        },
        "missing": found.missing,
    }
