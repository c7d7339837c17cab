"""The page of robot profiles, from the description of their keys that reads them."""

from __future__ import annotations

import inspect

from elib.emulator import robotprofile
from elib.emulator.robotprofile import TABLES, TOP
from generator.worlds import entry, keys

INTRODUCTION = """# Robot profiles

A robot profile says what sets one robot apart from the nominal one: its wheels, its link, its infrared sensors.
`elib fit RECORDING -o FILE` writes it from a recorded drive, `sim://WORLD?profile=FILE` and `elib simulate --profile
FILE` make every robot of a simulation like it, and `elib compare RECORDING --profile FILE` shows how much that is like
the drive. [Parity](../guides/parity.md) leads through all of it.
"""
RULES = """## Rules

- Every table may be left out; within a table a key without a default must be there.
- With a profile, a world's own spread between specimens (`wheel_spread`, `axle_spread`, `gain_spread`,
  `offset_spread` of its `[epuck]`) is not drawn: the profile is one specimen.
- Step counters count issued steps, as on the true robot, whatever the wheels' size.
- What breaks a rule is refused before anything runs, with the file, the line, the key and a cure:
  `mine.toml:3: wheels.axle is 53; it must be a number from 0.0424 to 0.06625 m`.
"""


def page() -> str:
    """Return the page."""
    text = inspect.cleandoc(robotprofile.__doc__ or "").partition("::\n\n")[2].partition("\n\nEvery table")[0]
    shown = "\n".join(line[4:] for line in text.splitlines())
    parts = [
        INTRODUCTION,
        f"## The file\n\n```toml\n{shown}\n```",
        f"## Top of the file\n\n{keys(TOP)}",
        *(entry(each) for each in TABLES),
        RULES,
    ]
    return "\n\n".join(part.strip() for part in parts)
