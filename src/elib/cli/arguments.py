"""What several commands take: where the robot is, for how long, and numbers with a rule."""

from __future__ import annotations

import contextlib
import math
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.errors import ArgumentError
from elib.protocol.profiles import PROFILES
from elib.protocol.quantities import Quantity, plain

FAST_SIMULATION = "sim://?speed=max"
"""The robot where none is given and nobody has to watch: a virtual one, as fast as the processor allows."""

MANY = 10
"""More allowed values than this are said as a range, not as a list."""

RobotUrl = Annotated[
    str, Cli(name="--robot", metavar="URL", help="sim://, serial:///dev/rfcomm0, tcp://HOST:PORT, ...")
]
Seconds = Annotated[float | None, Cli(name="--for", metavar="S", help="Robot time to run for, seconds.")]

LogFile = Annotated[
    str | None, Cli(name="--log", metavar="FILE", help="Append a line for each call and its outcome to this file.")
]
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


def rule(quantity: Quantity) -> str:
    """Return unit and range of an argument in words; every firmware with another range is named."""
    unit = f"{quantity.unit}, " if quantity.unit else ""
    text = quantity.rule(quantity.low, quantity.high).removesuffix(f" {quantity.unit}" if quantity.unit else "")
    if quantity.choices is not None and len(quantity.choices) > MANY:
        kind = "an even number" if all(choice % 2 == 0 for choice in quantity.choices) else "some whole numbers"
        text = f"{kind} from {quantity.low:g} to {quantity.high:g}"
    for profile in PROFILES.values():
        if quantity.name in profile.ranges:
            low, high = profile.ranges[quantity.name]
            text += f"; on {profile.name} from {plain(low)} to {plain(high)}"
    return unit + text
