"""The figures that were measured on real e-pucks: the file ``measured.toml``, read and checked.

A ``[[source]]`` says whose robots they were, a ``[[fact]]`` what was done and how far it can be trusted, a
``[[quantity]]`` holds the figures of a fact. All quantities have one shape: the 5th, 50th and 95th percentile of the
robots in each condition. An ``[[apart]]`` says which quantities the simulator does not match, and why.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, NamedTuple, TypeVar

from elib.base.errors import ArgumentError
from elib.base.rules import Choice, Mistake, Number, Rule, Text, Whole, nearest
from elib.base.tables import Table, keys_of, read_toml

FILE = Path(__file__).with_name("measured.toml")

FIRMWARES = {"e-puck1": "asercom-1.2.2", "e-puck2": "epuck2", "e-puck2 over Wi-Fi": "epuck2-wifi"}
"""The firmware of the virtual robots that are measured, by the kind of the real ones."""

KINDS = {
    "measured": "computed from recorded numbers",
    "digitised": "read off a published plot",
    "stated": "a figure that its author found by experiment",
    "inferred": "a conclusion from other figures",
}
BOUNDS = {
    "percentiles": "percentiles of the sensors, robots or readings",
    "deviation": "the mean, 1.645 standard deviations below and above it",
    "extremes": "the least, the middle and the greatest of a few",
    "uncertainty": "one figure, and how uncertain it is",
}
"""What stands for the percentiles where these are not known."""

CONFIDENCES = ("high", "middle", "low")
COUNTED = CONFIDENCES[:2]
"""Confidences that count in the score."""

Line = Annotated[str, Text(600)]
T = TypeVar("T")
Key = Annotated[str, Text(60, example='"ground.black"')]


class Figure(NamedTuple):
    """What robots have in one condition: its name, and the 5th, 50th and 95th percentile."""

    condition: str
    low: float
    middle: float
    high: float


@dataclass(frozen=True, slots=True)
class FiguresRule(Rule):
    """The figures of a quantity, a row for each condition."""

    def __str__(self) -> str:
        return "rows of a condition and three numbers that do not fall, each condition once"

    def accept(self, value: object) -> tuple[Figure, ...]:
        """Return *value* as figures."""
        if not isinstance(value, list) or not value:
            raise self.refuse(value)
        found: list[Figure] = []
        for index, row in enumerate(value):
            if not isinstance(row, list) or len(row) != len(Figure._fields):
                raise Mistake(f"is {row!r}; it must be a condition and three numbers", path=(index,))
            name, *numbers = row
            try:
                figure = Figure(Text(40).accept(name), *map(Number().accept, numbers))
            except Mistake as mistake:
                raise mistake.at(index) from None
            if not figure.low <= figure.middle <= figure.high:
                raise Mistake("falls; its numbers are the 5th, 50th and 95th percentile", path=(index,))
            if figure.condition in (each.condition for each in found):
                raise Mistake(f"has the condition {figure.condition!r} once more", path=(index,))
            found.append(figure)
        return tuple(found)


@dataclass(frozen=True, slots=True)
class Source:
    """Whose robots they were."""

    key: Key  # its name in facts
    where: Line  # where it was published: repository and commit, or address
    date: Line  # when
    robot: Line  # what robots
    robots: Annotated[int, Whole(0, 10_000)]  # how many, at least


@dataclass(frozen=True, slots=True)
class Fact:
    """One measurement on real robots, or a statement about them."""

    key: Key  # its name, which the source code cites
    source: Line  # keys of its sources, with commas
    kind: Annotated[str, Choice(tuple(KINDS))]  # one of KINDS
    n: Line  # how many robots, sensors or readings
    conditions: Line  # how it was measured
    confidence: Annotated[str, Choice(CONFIDENCES)]  # high, middle or low
    reason: Line  # why the confidence is what it is
    says: Line = ""  # what it says, if that is not a quantity to compare

    @property
    def sources(self) -> list[str]:
        """Keys of its sources."""
        return self.source.split(", ")


@dataclass(frozen=True, slots=True)
class Quantity:
    """A quantity that can be measured on a virtual robot, too."""

    key: Key  # its name; what stands before the dot is the sensor
    fact: Key  # key of the fact that its figures are from
    title: Line  # what it is, in words
    robot: Annotated[str, Choice(tuple(FIRMWARES))]  # the kind of robot, a key of FIRMWARES
    unit: Line  # unit of its figures
    bounds: Annotated[str, Choice(tuple(BOUNDS))]  # what the first and the last of three figures are, a key of BOUNDS
    figures: Annotated[tuple[Figure, ...], FiguresRule(example='[["1 cm", 668, 996, 1324]]')]
    confidence: Annotated[str, Choice(CONFIDENCES)] = ""  # if it is not that of the fact

    @property
    def sensor(self) -> str:
        """The sensor, in words."""
        return self.key.partition(".")[0].replace("_", " ")


@dataclass(frozen=True, slots=True)
class Apart:
    """Quantities that typical virtual robots do not match in all conditions, as far as known."""

    why: Line
    quantities: Annotated[str, Text(2000)]  # their keys, with commas

    @property
    def keys(self) -> list[str]:
        """Their keys."""
        return self.quantities.split(", ")


@dataclass(frozen=True, slots=True)
class Reference:
    """Everything that the file says."""

    sources: dict[str, Source]  # by key, as the facts and quantities
    facts: dict[str, Fact]
    quantities: dict[str, Quantity]
    apart: dict[str, str]  # why a quantity is apart, by its key
    score: float  # the score of the typical virtual robots of this version, as a test holds it

    def confidence(self, quantity: Quantity) -> str:
        """Return how far a quantity can be trusted."""
        return quantity.confidence or self.facts[quantity.fact].confidence


def _top(score: Annotated[float, Number(0, 1)]) -> float:
    """Return the key above all tables.

    Args:
        score: The score of the typical virtual robots of this version.
    """
    return score


_TABLES = (
    Table("source", "Whose robots they were.", Source, keys_of(Source), is_required=True),
    Table("fact", "One measurement.", Fact, keys_of(Fact), is_required=True),
    Table("quantity", "Figures of a fact.", Quantity, keys_of(Quantity), is_required=True),
    Table("apart", "What the simulator does not match.", Apart, keys_of(Apart)),
)


def parse(content: bytes, filename: str) -> Reference:
    """Return what a file of figures says."""
    file, document = read_toml(content, filename, "measured robots")
    read = file.read_all(document, Table("", "", _top, keys_of(_top)), _TABLES)

    def tables(name: str, kind: type[T], key: str = "key") -> dict[str, T]:
        found: dict[str, T] = {}
        for index, each in enumerate(read[name]):
            assert isinstance(each, kind)
            if found.setdefault(getattr(each, key), each) is not each:
                raise file.error((name, index, key), ArgumentError(f"{getattr(each, key)} is there once more"))
        return found

    def check(name: str, key: str, names: Iterable[list[str]], known: Collection[str]) -> None:
        for index, each in enumerate(names):
            for word in each:
                if word not in known:
                    raise file.error(
                        (name, index, key), Mistake(f"names {word!r}, which is not there", hint=nearest(word, known))
                    )

    sources, facts = tables("source", Source), tables("fact", Fact)
    quantities, apart = tables("quantity", Quantity), tables("apart", Apart, "why")
    check("fact", "source", (each.sources for each in facts.values()), sources)
    check("quantity", "fact", ([each.fact] for each in quantities.values()), facts)
    check("apart", "quantities", (each.keys for each in apart.values()), quantities)
    (score,) = read[""]
    assert isinstance(score, float)
    return Reference(sources, facts, quantities, {key: it.why for it in apart.values() for key in it.keys}, score)


@cache
def reference() -> Reference:
    """Return the figures that come with elib."""
    return parse(FILE.read_bytes(), str(FILE))
