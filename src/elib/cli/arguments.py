"""What several commands take: where the robot is, for how long, and numbers with a rule."""

from __future__ import annotations

import contextlib
import math
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.errors import ArgumentError
from elib.recording.log import Vocabulary

FAST_SIMULATION = "sim://?speed=max"
"""The robot where none is given and nobody has to watch: a virtual one, as fast as the processor allows."""

RobotUrl = Annotated[
    str, Cli(name="--robot", metavar="URL", help="sim://, serial:///dev/rfcomm0, tcp://HOST:PORT, ...")
]
Seconds = Annotated[float | None, Cli(name="--for", metavar="S", help="Robot time to run for, seconds.")]

LogFile = Annotated[
    str | None, Cli(name="--log", metavar="FILE", help="Append a line for each call and its outcome to this file.")
]
LogNames = Annotated[Vocabulary, Cli(name="--log-names", help="Its command names: python or 2011.")]
RecordFile = Annotated[
    str | None, Cli(name="--record", metavar="FILE.mcap", help="Record everything that happens on the link.")
]


def check_duration(seconds: float | None) -> None:
    """Refuse a time that cannot be.

    Raises:
        ArgumentError: It is not positive and finite.
    """
    if seconds is not None and not (math.isfinite(seconds) and seconds > 0):
        raise ArgumentError(f"--for is {seconds:g} s; it must be a finite number above 0")


def number_from(text: str) -> object:
    """Return the number that *text* is, decimal or like ``0x60``; else *text*: a name, or the error will show it."""
    with contextlib.suppress(ValueError):
        return int(text, 0)
    with contextlib.suppress(ValueError):
        return float(text)
    return text
