"""The kinds of keys that a file may have: what their values must be, how they are read and how they are written."""

from __future__ import annotations

import math
import reprlib
from dataclasses import dataclass
from typing import ClassVar, TypeGuard

from elib.errors import ArgumentError
from elib.physics.geometry import Colour
from elib.physics.tomltext import Path

LONGEST_TEXT = 200
"""Characters of a name or a sentence."""

MOST_POINTS = 10_000
"""Of one stripe: more would be closer together than a pixel of the floor."""


class _Shortened(reprlib.Repr):
    """Shows what somebody wrote, at most a line of it."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = 60
        self.maxlevel, self.maxlist, self.maxdict = 2, 4, 2

    def repr_bool(self, value: bool, level: int) -> str:
        return "true" if value else "false"

    def repr_int(self, value: int, level: int) -> str:
        # A hexadecimal number may be so long that Python refuses to write it in decimal.
        return repr(value) if abs(value) < 10**20 else f"a number of {value.bit_length()} bits"


shown = _Shortened().repr


class Mistake(ArgumentError):
    """A rule of the file was broken.

    Attributes:
        path: Where, as seen from what was being read.
    """

    def __init__(self, message: str, *, path: Path = (), hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.path = path


@dataclass(frozen=True, slots=True, kw_only=True)
class Key:
    """One key of a table.

    Attributes:
        name: What the file calls it.
        meaning: What it sets, in a few words.
        fills: The arguments it gives to what its table makes; its own name if empty.
        example: A good value, as the file writes it.
        otherwise: What holds where it is left out, if that cannot be told from the default value.
    """

    name: str
    meaning: str
    fills: tuple[str, ...] = ()
    example: str = ""
    otherwise: str = ""

    @property
    def arguments(self) -> tuple[str, ...]:
        """The arguments it gives."""
        return self.fills or (self.name,)

    @property
    def rule(self) -> str:
        """What its value must be."""
        return self._rule()

    def read(self, value: object) -> tuple[object, ...]:
        """Return what it gives for its :attr:`arguments`, in SI.

        Raises:
            Mistake: *value* is none that it may have.
        """
        found = self._read(value)
        if found is None:
            raise self.mistake(value, self.rule)
        return found

    def written(self, value: object) -> str:
        """Return how the file writes what one of its arguments holds."""
        return f'"{value}"' if isinstance(value, str | Colour) else f"{value:g}"

    def mistake(self, value: object, rule: str, *index: int) -> Mistake:
        """Return what is wrong with *value*, or with the entry *index* of it."""
        return Mistake(
            f"is {shown(value)}; it must be {rule}",
            path=(self.name, *index),
            hint=f"write {self.name} = {self.example}",
        )

    def _rule(self) -> str:
        raise NotImplementedError

    def _read(self, value: object) -> tuple[object, ...] | None:
        """Return what *value* gives; None if it is none that the key may have."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True, kw_only=True)
class Number(Key):
    """A number.

    Attributes:
        unit: Its unit, or "".
        low: Least value.
        high: Greatest value.
    """

    low: float
    high: float
    unit: str = ""

    kind: ClassVar[str] = "a number"

    @property
    def range(self) -> str:
        """From where to where."""
        return f"from {_short(self.low)} to {_short(self.high)}{self.unit and f' {self.unit}'}"

    def _rule(self) -> str:
        return f"{self.kind} {self.range}"

    def _read(self, value: object) -> tuple[object, ...] | None:
        return (float(value),) if self._fits(value) else None

    def _fits(self, value: object) -> TypeGuard[float]:
        # A whole number of TOML has no bound, so it is compared before it becomes a float; NaN fits nowhere.
        return isinstance(value, int | float) and not isinstance(value, bool) and self.low <= value <= self.high


@dataclass(frozen=True, slots=True, kw_only=True)
class Degrees(Number):
    """An angle, in degrees in the file and in radians elsewhere."""

    low: float = -360.0
    high: float = 360.0
    unit: str = "degrees"

    def written(self, value: object) -> str:
        """Return *value*, rad, in degrees."""
        assert isinstance(value, float)
        return f"{math.degrees(value):g}"

    def _read(self, value: object) -> tuple[object, ...] | None:
        return (math.radians(value),) if self._fits(value) else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Whole(Number):
    """A whole number."""

    low: int
    high: int

    kind: ClassVar[str] = "a whole number"

    def _read(self, value: object) -> tuple[object, ...] | None:
        return (value,) if isinstance(value, int) and self._fits(value) else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair(Number):
    """Two numbers, such as a place."""

    kind: ClassVar[str] = "two numbers, each"

    def _read(self, value: object) -> tuple[object, ...] | None:
        return self._pair(value)

    def _pair(self, value: object) -> tuple[float, float] | None:
        if isinstance(value, list) and len(value) == 2 and self._fits(value[0]) and self._fits(value[1]):
            return float(value[0]), float(value[1])
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Course(Pair):
    """Several places in a row."""

    def _rule(self) -> str:
        return f"2 to {MOST_POINTS} places, each two numbers {self.range}"

    def _read(self, value: object) -> tuple[object, ...] | None:
        if not isinstance(value, list) or not 2 <= len(value) <= MOST_POINTS:
            return None
        places = [self._pair(place) for place in value]
        if None in places:
            index = places.index(None)
            raise self.mistake(value[index], f"{self.kind} {self.range}", index)
        return (tuple(places),)


@dataclass(frozen=True, slots=True, kw_only=True)
class Text(Key):
    """A text."""

    def _rule(self) -> str:
        return f"a text of 1 to {LONGEST_TEXT} characters on one line"

    def _read(self, value: object) -> tuple[object, ...] | None:
        is_text = isinstance(value, str) and 0 < len(value) <= LONGEST_TEXT and value.isprintable()
        return (value,) if is_text else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice(Key):
    """One of a few values.

    Attributes:
        among: The values.
    """

    among: tuple[str, ...] | tuple[int, ...]

    def _rule(self) -> str:
        return " or ".join(self.written(value) for value in self.among)

    def _read(self, value: object) -> tuple[object, ...] | None:
        # Compared with its type: 1.0 and true equal 1.
        return (value,) if any(type(value) is type(each) and value == each for each in self.among) else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Flag(Key):
    """Yes or no."""

    example: str = "true"

    def written(self, value: object) -> str:
        """Return true or false."""
        return "true" if value else "false"

    def _rule(self) -> str:
        return "true or false"

    def _read(self, value: object) -> tuple[object, ...] | None:
        return (value,) if isinstance(value, bool) else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Paint(Key):
    """A colour."""

    example: str = '"#d04030"'

    def _rule(self) -> str:
        return 'a colour, "#rrggbb"'

    def _read(self, value: object) -> tuple[object, ...] | None:
        try:
            return (Colour.parse(value),) if isinstance(value, str) else None
        except ArgumentError:
            return None


def _short(number: float) -> str:
    return "2**64 - 1" if number == 2**64 - 1 else f"{number:.6g}"
