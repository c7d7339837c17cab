"""Fault scripts: what goes wrong with a virtual robot and its link, when, and how badly; and their TOML files.

A script is data; :mod:`elib.simulator.emulator.faultplayer` runs it.

::

    description = "Bluetooth on a bad day"
    seed = 1                       # of all random numbers

    [[fault]]
    kind = "loss"                  # a key of KINDS
    probability = 0.02             # what the kind takes

    [[fault]]
    kind = "delay"
    from = 10                      # s; 0 if left out
    until = 30                     # s; without an end if left out
    delay = [0.0, 0.4]             # s; rises from one to the other, from 10 s until 30 s

    [[fault]]
    kind = "stall"
    from = 5
    every = 20                     # again at 25 s, 45 s, ...
    for = 0.5                      # s each time

    [[fault]]
    kind = "reset"
    at = 12                        # once; with for, or until, where the kind has a length

    [[fault]]
    kind = "sensor"
    robots = ["epuck-2", 5]        # of several robots: by name, or number from 1; all if left out
    sensor = "proximity"
    numbers = [0, 7]               # which of its readings; all if left out
    stuck = 300                    # counts

Times are seconds of robot time since the first byte that a program sent to the robot.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, cast

from elib.base.errors import ArgumentError
from elib.base.files import FAULTS
from elib.base.rules import Choice, Mistake, Number, Rule, Seed, check, rule_of
from elib.base.tables import Key, Table, content_of, keys_of, others, read_toml, shipped
from elib.simulator.emulator.faultkinds import KINDS, DefectKind, Ramp, Strength, TimedFault, When
from elib.simulator.physics.records import MAX_DEFECTS

MAX_NUMBER = 1e12
"""Far above all numbers of a script."""


@dataclass(frozen=True, slots=True)
class _AnyText(Rule):
    """A text of any length, on any number of lines."""

    def __str__(self) -> str:
        return "a text"

    def accept(self, value: object) -> str:
        if isinstance(value, str):
            return value
        raise self.refuse(value)


@dataclass(frozen=True, slots=True)
class FaultScript:
    """Faults and their times.

    Raises:
        ArgumentError: The seed is out of its range.
    """

    name: str  # name of a script that comes with elib, or the path of a file
    description: Annotated[str, _AnyText(example='"..."')]  # a sentence for people
    seed: Seed = 0  # seed of all random numbers, 0 to 2**64 - 1
    faults: tuple[TimedFault, ...] = ()  # the faults in the order of the file; one answer may have several

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, slots=True)
class _Ramped(Rule):
    """A number, or two: the first and the last value."""

    number: Number

    def __str__(self) -> str:
        return f"{self.number}, or two of them"

    def accept(self, value: object) -> Ramp:
        first, last = value if isinstance(value, list) and len(value) == 2 else (value, value)
        try:
            return Ramp(self.number.accept(first), self.number.accept(last))
        except Mistake:
            raise self.refuse(value) from None


TIMES = (
    Key("at", rule_of(When, "start"), ("at",), (0.0,)),
    Key("from", rule_of(When, "start"), ("from",), (0.0,)),
    Key("until", Number(0, MAX_NUMBER, "s"), ("until",), (math.inf,)),
    Key("every", rule_of(When, "every"), ("every",), (None,)),
    Key("for", rule_of(When, "lasting"), ("for",), (None,)),
)
"""The keys of a fault that say when it holds."""

TOP = Table("", "What stands above the faults.", dict, keys_of(FaultScript), is_array=False)


@dataclass(frozen=True)
class _FaultTable(Table):
    """A fault; its kind says which keys it has."""

    def read(self, table: Mapping[str, object], what: str) -> TimedFault:
        kind = str(self.values({"kind": table["kind"]} if "kind" in table else {}, what)["kind"])
        own = (_strength(strength) for strength in KINDS[kind].keys)
        names = KINDS[kind].names
        given = Table("fault", "", dict, (*self.keys, *TIMES, ROBOTS, *names, *own)).values(table, what)
        del given["kind"]
        robots = cast("tuple[int, ...]", given.pop("robots", ()))
        which = {key.name: given.pop(key.name) for key in names if key.name in table}
        when = _when({key.name: given.pop(key.name) for key in TIMES if key.name in table})
        return TimedFault(kind, when, cast("dict[str, Ramp]", given), which, robots)


def _strength(strength: Strength) -> Key:
    rule = _Ramped(strength, example=f"{(strength.low + strength.high) / 2:g}")
    return Key(strength.name, rule, (strength.name,), () if strength.default is None else (strength.default,))


@dataclass(frozen=True, slots=True)
class _Robots(Rule):
    """Some robots of a world."""

    def __str__(self) -> str:
        return 'a list of robots, each a name such as "epuck-2" or a number from 1'

    def accept(self, value: object) -> tuple[int, ...]:
        """Return their numbers, from 1."""
        robots = value if isinstance(value, list) else ()
        numbers = [re.fullmatch(r"(?:epuck-)?([1-9][0-9]{0,8})", str(each)) for each in robots]
        if not numbers or not all(numbers):
            raise self.refuse(value)
        return tuple(int(number[1]) for number in numbers if number)


ROBOTS = Key("robots", _Robots(example='["epuck-2"]', otherwise="all"), ("robots",), ((),))
FAULT = _FaultTable(
    "fault", "What goes wrong.", TimedFault, (Key("kind", Choice(tuple(KINDS), example='"loss"'), ("kind",)),)
)


def gallery() -> list[str]:
    """Return the names of the scripts that come with elib, in alphabetical order."""
    return shipped(FAULTS)


def load(name: str, robots: int | None = None) -> FaultScript:
    """Read a script that comes with elib, or a file where *name* is a path or ends in ``.toml``.

    Args:
        name: The name or the path.
        robots: How many robots the world has; None if that is not known.

    Raises:
        ArgumentError: There is no such script, or the file cannot be read.
        SimulationError: The file breaks a rule; the message names the file, the line, the key and a cure.
    """
    found = content_of(name, FAULTS, "fault script")
    if found is None:
        raise ArgumentError(f"there is no fault script {name!r}", hint=others(name, FAULTS))
    return parse(found[0], name, robots)


def parse(content: bytes, name: str, robots: int | None = None) -> FaultScript:
    """Return the script that *content* describes.

    Args:
        content: TOML in UTF-8.
        name: Name of the script; messages begin with it.
        robots: How many robots the world has; None if that is not known.

    Raises:
        SimulationError: It is not TOML, names a robot that is not there, or a key is missing, unknown, of the wrong
            type or out of its range.
    """
    source, document = read_toml(content, name, "a fault script")
    parts = source.read_all(document, TOP, [FAULT])
    top = cast("dict[str, Any]", parts[""][0])
    faults = cast("list[TimedFault]", parts["fault"])
    named = {number for fault in faults for number in fault.robots} | {0}
    for index, fault in enumerate(faults):
        before = [each for each in faults[: index + 1] if issubclass(KINDS[each.kind], DefectKind)]
        if any(sum(each.hits(number - 1) for each in before) > MAX_DEFECTS for number in named):
            raise source.error(("fault", index), Mistake(f"is one too many; a robot has {MAX_DEFECTS} broken parts"))
        if robots is not None and max(fault.robots, default=0) > robots:
            what = f"names robot {max(fault.robots)}; the world has {robots}, epuck-1 to epuck-{robots}"
            raise source.error(("fault", index), Mistake(what, path=("robots",)))
    return FaultScript(name, faults=tuple(faults), **top)


def _when(times: Mapping[str, Any]) -> When:
    if "at" in times and ("from" in times or "every" in times):
        raise ArgumentError("at is for what happens once", hint="write from and every, or at alone")
    if "for" in times and "until" in times and "every" not in times:
        raise ArgumentError("for and until both say when it ends", hint="leave one of them out")
    return When(
        times.get("at", times.get("from", 0.0)), times.get("until", math.inf), times.get("every"), times.get("for")
    )
