"""The page of robot profiles, from the description of their keys that reads them."""

from __future__ import annotations

from elib.simulator.emulator import robotprofile
from elib.simulator.emulator.robotprofile import TABLES, TOP
from generator.markdown import block, joined
from generator.worlds import entry, keys

INTRODUCTION = """# Robot profiles

A robot profile says how one robot differs from the nominal one: its wheels, its link, its infrared sensors.
`elib fit RECORDING -o FILE` writes it from a recorded drive, `sim://WORLD?profile=FILE` and `elib simulate --profile
FILE` give it to every robot of a simulation, and `elib compare RECORDING --profile FILE` shows how close the simulation
is to the drive. [Parity](../guides/parity.md) shows every step.
"""
RULES = """## Rules

- Every table is optional; in a table, a key without a default is required.
- With a profile, a world's own spread between specimens (`wheel_spread`, `axle_spread`, `gain_spread`,
  `offset_spread` of its `[epuck]`) is not drawn: the profile is one specimen.
- Step counters count issued steps, as on the real robot, whatever the size of the wheels.
- A file that breaks a rule is refused before anything runs; the error names the file, the line, the key and what to
  try: `mine.toml:3: wheels.axle is 53 m; it must be a number from 0.0424 to 0.06625 m`.
"""


def page() -> str:
    """Return the page."""
    parts = [
        INTRODUCTION,
        f"## The file\n\n```toml\n{block(robotprofile.__doc__)}\n```",
        f"## Top of the file\n\n{keys(TOP)}",
        *(entry(each) for each in TABLES),
        RULES,
    ]
    return joined(parts)
