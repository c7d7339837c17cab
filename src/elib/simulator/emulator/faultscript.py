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

Times are seconds of robot time since the first byte that a program sent to the robot.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Annotated, Any, cast

from elib.base.errors import ArgumentError
from elib.base.fields import Choice, Mistake, Number, Rule, Seed, check, rule_of
from elib.base.files import FAULTS
from elib.base.tables import Key, Table, content_of, keys_of, others, read_toml, shipped

LONGEST = 1e6
"""s; more than eleven days, longer than any script."""

LARGEST = 1e12
"""Far above all numbers of a script."""

Start = Annotated[float, Number(0, LONGEST, "s", example="5")]
Span = Annotated[float, Number(0.001, LONGEST, "s", example="5")]


@dataclass(frozen=True, slots=True)
class When:
    """The times at which a fault holds, s of robot time since the program's first byte.

    Attributes:
        start: When the fault begins: ``at`` or ``from`` in the file.
        until: When it ends, exclusive; infinite for a fault that does not end.
        every: Time from one beginning to the next, for a fault that comes again; None for one that comes once.
        lasting: How long it holds each time: ``for`` in the file; None where *until* gives the end.

    Raises:
        ArgumentError: The times contradict each other; the message names the key and a cure.
    """

    start: Start = 0.0
    until: float = math.inf
    every: Span | None = None
    lasting: Span | None = None

    def __post_init__(self) -> None:
        check(self)
        if not self.until > self.start:
            raise ArgumentError(
                f"until is {self.until:g} s, but it begins at {self.start:g} s", hint="let until come after from"
            )
        if self.every is not None and self.lasting is not None and not self.lasting < self.every:
            raise ArgumentError(
                f"for is {self.lasting:g} s and every is {self.every:g} s: it would never stop",
                hint="let for be shorter than every, or leave every out",
            )

    @property
    def is_bounded(self) -> bool:
        """Whether the fault ends each time it holds."""
        return self.lasting is not None or (self.every is None and math.isfinite(self.until))

    def share(self, time: float) -> float | None:
        """Return which share of its span has passed at *time*, 0 to 1; 0 without an end, None outside of its spans."""
        begin = self._begin(time)
        end = min(self.until, begin + (math.inf if self.lasting is None else self.lasting))
        if not begin <= time < end:
            return None
        return (time - begin) / (end - begin) if self.is_bounded else 0.0

    def next_change(self, time: float) -> float:
        """Return when it begins or ends next after *time*; infinite if never."""
        begin = self._begin(time)
        changes = [begin, begin + (math.inf if self.lasting is None else self.lasting), self.until]
        if self.every is not None:
            changes.append(self._next_begin(begin))
        return min((change for change in changes if time < change <= self.until), default=math.inf)

    def beginning(self, after: float) -> float:
        """Return the first beginning later than *after*; infinite if there is none."""
        begin = self._begin(after)
        if begin <= after:
            begin = math.inf if self.every is None else self._next_begin(begin)
        return begin if begin < self.until else math.inf

    def _begin(self, time: float) -> float:
        """Return the last beginning at or before *time*, or else the first one."""
        if self.every is None or time < self.start:
            return self.start
        count = math.floor((time - self.start) / self.every)
        # The quotient may be rounded across a beginning; the beginnings themselves decide.
        while self.start + count * self.every > time:
            count -= 1
        while self.start + (count + 1) * self.every <= time:
            count += 1
        return self.start + count * self.every

    def _next_begin(self, begin: float) -> float:
        assert self.every is not None
        return self.start + (round((begin - self.start) / self.every) + 1) * self.every


@dataclass(frozen=True, slots=True)
class Ramp:
    """A strength that changes from one value to another while a fault holds, or stays the same.

    Attributes:
        first: Strength at the beginning.
        last: Strength at the end.
    """

    first: float
    last: float

    def at(self, share: float) -> float:
        """Return the strength when *share*, 0 to 1, of the fault's span has passed."""
        return self.first + (self.last - self.first) * share


@dataclass(frozen=True, slots=True)
class Strength(Number):
    """One number that says how bad a fault is.

    Attributes:
        name: Name of the key in the file.
        meaning: What it sets, in a few words.
        default: The value if the file does not give one; None if the file must give one.
        may_change: Whether it may change from one value to another: ``[0.0, 0.9]``.
    """

    name: str = ""
    meaning: str = ""
    default: float | None = None
    may_change: bool = False


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of fault: its effect and its keys.

    Attributes:
        effect: What happens, in a sentence.
        keys: The strengths that it has.
        is_instant: Whether it happens at one moment and has no length.
        needs_end: Whether it must end each time it holds.
        may_repeat: Whether it may come again.
    """

    effect: str
    keys: tuple[Strength, ...] = ()
    is_instant: bool = False
    needs_end: bool = False
    may_repeat: bool = True


WEAK = 3.54
"""V below which answers come later: where the e-puck2 calls its battery low, 2900 counts (e-puck.md, 11)."""

WEAK_DELAY = 0.009
"""s: setting the motors took 34 ms on a weak battery, 25 ms on a charged one (wire-protocol.md, 5.13)."""

EMPTY = 3.3
"""V at which the robot dies. It is a guess, a little below the 3.4 V that the e-puck1's comparator calls low."""


def _probability(default: float | None = None) -> Strength:
    return Strength(0, 1, "", "probability", "how probable it is for each answer", default, may_change=True)


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "loss": Kind("A whole answer is lost.", (_probability(),)),
        "delay": Kind(
            "An answer comes later, and those behind it wait.",
            (
                Strength(0, 60, "s", "delay", "how much later", may_change=True),
                Strength(0, 60, "s", "jitter", "standard deviation of that", 0.0),
                _probability(1.0),
            ),
        ),
        "duplicate": Kind(
            "An answer comes twice.",
            (_probability(), Strength(0, 60, "s", "after", "from its end to the copy", 0.0)),
        ),
        "halve": Kind("Only the first half of an answer comes.", (_probability(),)),
        "corrupt": Kind("The highest bit of one of an answer's first bytes is inverted.", (_probability(),)),
        "noise": Kind(
            "Bytes arrive that the robot did not send.",
            (
                Strength(0.001, 1000, "1/s", "rate", "bursts in a second, at random"),
                Strength(1, 64, "bytes", "size", "how many in a burst", 1.0),
            ),
        ),
        "stall": Kind("No byte passes either way; then all come at once.", needs_end=True),
        "silence": Kind("No answer comes back; the robot still receives."),
        "cut": Kind("The link dies, and cannot be opened again before the end."),
        "reset": Kind("The robot restarts: wheels, lamps, encoders and camera as when switched on.", is_instant=True),
        "battery": Kind(
            "The battery runs down; when weak, answers come later; when empty, the robot dies.",
            (
                Strength(0, 5, "V", "volts", "its voltage", may_change=True),
                Strength(0, 5, "V", "empty", "where the robot dies", EMPTY),
                Strength(
                    0, 10, "s", "slows", f"how much later answers come at the end; it begins at {WEAK} V", WEAK_DELAY
                ),
            ),
            needs_end=True,
            may_repeat=False,
        ),
    }
)
"""Every kind of fault, by the name it has in a file."""


@dataclass(frozen=True, slots=True)
class TimedFault:
    """A fault of a script.

    Attributes:
        kind: Name of its kind in :data:`KINDS`.
        when: The times at which it holds.
        strengths: How bad it is, by the kind's keys; those left out have the kind's defaults.

    Raises:
        ArgumentError: The times do not fit the kind, or a number may not change; the message says which, and a cure.
    """

    kind: str
    when: When = When()
    strengths: Mapping[str, Ramp] = field(default_factory=dict)

    def __post_init__(self) -> None:
        kind = KINDS[self.kind]
        for key in kind.keys:
            if key.name in self.strengths:
                self._check(key, self.strengths[key.name])
        if kind.is_instant and self.when.lasting is not None:
            raise ArgumentError(f"for is {self.when.lasting:g} s, but a {self.kind} has no length", hint="leave it out")
        if not kind.may_repeat and self.when.every is not None:
            raise ArgumentError(f"every is {self.when.every:g} s, but a {self.kind} comes once", hint="leave it out")
        if not kind.is_instant and self.when.every is not None and self.when.lasting is None:
            raise ArgumentError("for is missing: how long it holds each time", hint="write for = SECONDS")
        if kind.needs_end and not self.when.is_bounded:
            raise ArgumentError(f"a {self.kind} needs an end", hint="write for = SECONDS, or until = SECONDS")

    def level(self, key: str, share: float) -> float:
        """Return the strength *key* when *share*, 0 to 1, of the fault's span has passed."""
        ramp = self.strengths.get(key)
        if ramp is not None:
            return ramp.at(share)
        default = next(known.default for known in KINDS[self.kind].keys if known.name == key)
        assert default is not None
        return default

    def _check(self, key: Strength, ramp: Ramp) -> None:
        if ramp.first == ramp.last:
            return
        if not key.may_change:
            raise ArgumentError(
                f"{key.name} goes from {ramp.first:g} to {ramp.last:g}; it must be one number",
                hint=f"write {key.name} = {ramp.first:g}",
            )
        if not self.when.is_bounded:
            raise ArgumentError(
                f"{key.name} goes from {ramp.first:g} to {ramp.last:g}, but it is not said until when",
                hint="write until = SECONDS",
            )


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

    Attributes:
        name: Name of a script that comes with elib, or the path of a file.
        description: A sentence for people.
        seed: Seed of all random numbers, 0 to 2**64 - 1.
        faults: The faults in the order of the file; one answer may have several.

    Raises:
        ArgumentError: The seed is out of its range.
    """

    name: str
    description: Annotated[str, _AnyText(example='"..."')]
    seed: Seed = 0
    faults: tuple[TimedFault, ...] = ()

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
    Key("until", Number(0, LARGEST, "s"), ("until",), (math.inf,)),
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
        given = Table("fault", "", dict, (*self.keys, *TIMES, *own)).values(table, what)
        del given["kind"]
        when = _when({key.name: given.pop(key.name) for key in TIMES if key.name in table})
        return TimedFault(kind, when, cast("dict[str, Ramp]", given))


def _strength(strength: Strength) -> Key:
    rule = _Ramped(strength, example=f"{(strength.low + strength.high) / 2:g}")
    return Key(strength.name, rule, (strength.name,), () if strength.default is None else (strength.default,))


FAULT = _FaultTable(
    "fault", "What goes wrong.", TimedFault, (Key("kind", Choice(tuple(KINDS), example='"loss"'), ("kind",)),)
)


def gallery() -> list[str]:
    """Return the names of the scripts that come with elib, in alphabetical order."""
    return shipped(FAULTS)


def load(name: str) -> FaultScript:
    """Read a script that comes with elib, or a file where *name* is a path or ends in ``.toml``.

    Raises:
        ArgumentError: There is no such script, or the file cannot be read.
        SimulationError: The file breaks a rule; the message names the file, the line, the key and a cure.
    """
    found = content_of(name, FAULTS, "fault script")
    if found is None:
        raise ArgumentError(f"there is no fault script {name!r}", hint=others(name, FAULTS))
    return parse(found[0], name)


def parse(content: bytes, name: str) -> FaultScript:
    """Return the script that *content* describes.

    Args:
        content: TOML in UTF-8.
        name: Name of the script; messages begin with it.

    Raises:
        SimulationError: It is not TOML, or a key is missing, unknown, of the wrong type or out of its range.
    """
    source, document = read_toml(content, name, "a fault script")
    parts = source.read_all(document, TOP, [FAULT])
    top = cast("dict[str, Any]", parts[""][0])
    return FaultScript(name, faults=tuple(cast("list[TimedFault]", parts["fault"])), **top)


def _when(times: Mapping[str, Any]) -> When:
    if "at" in times and ("from" in times or "every" in times):
        raise ArgumentError("at is for what happens once", hint="write from and every, or at alone")
    if "for" in times and "until" in times and "every" not in times:
        raise ArgumentError("for and until both say when it ends", hint="leave one of them out")
    return When(
        times.get("at", times.get("from", 0.0)), times.get("until", math.inf), times.get("every"), times.get("for")
    )
