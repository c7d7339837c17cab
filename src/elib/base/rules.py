"""Rules for values: unit and range, declared once in the type of a field, and the errors for values that break them.

A class declares the rule of each field in its type, and checks itself::

    Intensity = Annotated[float, Number(0, 10)]

    @dataclass(frozen=True, slots=True)
    class Light:
        x: Place
        intensity: Intensity = 1.0

        def __post_init__(self) -> None:
            check(self, "the light's ")

:mod:`elib.base.tables` reads the same fields from a file, and the control server takes them from a message.
"""

from __future__ import annotations

import contextlib
import difflib
import enum
import inspect
import math
import numbers
import re
import reprlib
import sys
import types
import typing
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, TypeAlias

from elib.base.errors import ArgumentError

MAX_TEXT = 200
"""Characters of a name or a sentence."""

MAX_NUMBER = sys.float_info.max

Path: TypeAlias = tuple[str | int, ...]
"""Where a value is in a file: ``("box", 1, "size")``."""


class Mistake(ArgumentError):
    """A value breaks a rule."""

    def __init__(self, what: str, *, path: Path = (), hint: str = "") -> None:
        super().__init__(f"{dotted(path)} {what}".lstrip(), hint=hint)
        # what is wrong with the value, as the end of a sentence that begins with its place: `is 5; it must be 4`
        self.what = what
        self.path = path  # where the value is inside of what was checked; empty if that itself is wrong

    def at(self, *path: str | int) -> Mistake:
        """Return the same mistake with *path* in front of its own path, as the caller sees it."""
        return Mistake(self.what, path=(*path, *self.path), hint=self.hint)


def dotted(path: Path) -> str:
    """Return *path* as people write it: ``box[1].size``."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            plain = part if part.isprintable() and len(part) <= 60 else shown(part)
            text += f".{plain}" if text else plain
    return text


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


_shortened = _Shortened()


def shown(value: object) -> str:
    """Return *value* for a message: short, on one line, and a number of NumPy as a plain one."""
    if is_number(value):
        value = int(value) if is_whole(value) else float(value)
    return _shortened.repr(value)


def nearest(word: str, known: Iterable[str]) -> str:
    """Return a hint for an unknown word: the word that was probably meant, or all there are."""
    known = list(known)
    near = difflib.get_close_matches(word[:64], known, n=1)
    return f"did you mean {near[0]}?" if near else f"choose one of {', '.join(known)}" if known else "there are none"


SHARE = "of the whole"
"""The unit of a number from 0 to 1 in the table of units; messages do not show it."""
_OTHER_UNITS: dict[str, tuple[tuple[str, float, float], ...]] = {
    "m": (("cm", 0.01, 1), ("mm", 0.001, 10)),
    "cm": (("mm", 0.1, 10),),
    "m/s": (("cm/s", 0.01, 1), ("mm/s", 0.001, 5)),
    "rad": (("degrees", math.pi / 180, 1),),
    "rad/s": (("degrees/s", math.pi / 180, 1),),
    "rev/s": (("rad/s", 1 / math.tau, 6), ("steps/s", 0.001, 20)),
    "s": (("ms", 0.001, 10),),
    "kg": (("g", 0.001, 1),),
    "Hz": (("kHz", 1000, 0),),
    SHARE: (("%", 0.01, 2), ("of 255", 1 / 255, 2)),
}
"""The units for which others are mistaken: name, size, and the least number that somebody writes in it."""


def other_unit(value: object, unit: str, low: float, high: float) -> str:
    """Return a hint for a wrong number: what it is if it was written in another unit or as text, or an empty text."""
    written = re.fullmatch(r"\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*(\S*)\s*", value) if isinstance(value, str) else None
    if written:
        sizes = {"": 1.0, unit: 1.0, **{other: size for other, size, _ in _OTHER_UNITS.get(unit, ())}}
        amount = float(written[1]) * sizes.get(written[2], math.inf)
        if low <= amount <= high:
            return f"did you mean {amount:.4g}, without quotes?"
        return other_unit(float(written[1]), unit, low, high) if not written[2] else ""
    number = value if not is_number(value) or isinstance(value, int) else float(value)
    if not is_number(number) or not abs(number) < MAX_NUMBER / 1000:
        return ""
    found = []
    for other, size, least in _OTHER_UNITS.get(unit, ()):
        if abs(number) >= least and low <= number * size <= high:
            is_angle = other.startswith("degrees")
            found.append(f"math.radians({number:g})" if is_angle else f"{number * size:.4g} ({number:g} {other})")
    return f"did you mean {' or '.join(found)}?" if found else ""


def is_number(value: object) -> typing.TypeGuard[Any]:
    """Whether *value* is a number of Python or NumPy; true and false are not."""
    # The plain types first: the question after NumPy's takes much longer.
    return type(value) in (float, int) or (isinstance(value, numbers.Real) and not isinstance(value, bool))


def is_whole(value: object) -> typing.TypeGuard[Any]:
    """Whether *value* is a whole number of Python or NumPy; true and false are not."""
    return type(value) is int or (isinstance(value, numbers.Integral) and not isinstance(value, bool))


def is_truth(value: object) -> typing.TypeGuard[Any]:
    """Whether *value* is true or false, of Python or NumPy."""
    return isinstance(value, bool) or type(value).__name__ in ("bool", "bool_")  # bool_ is NumPy's


def number_from(text: str) -> object:
    """Return *text* as a number, decimal or like ``0x60``; if it is not a number, return *text* itself."""
    with contextlib.suppress(ValueError):
        return int(text, 0)
    with contextlib.suppress(ValueError):
        return float(text)
    return text


class _Meant(float):
    """A number that was passed through :func:`really`."""

    __slots__ = ()


def really(number: float) -> float:
    """Mark a number that is larger than usual as meant so: ``robot.drive(elib.really(12))``.

    A distance or place beyond 5 m, an angle beyond three turns, and a time beyond an hour are refused without it: most
    of them are in another unit.

    Raises:
        ArgumentError: *number* is not a number.

    Example:
        >>> robot.sleep(elib.really(5000))
        >>> round(robot.time) >= 5000
        True
    """
    if not is_number(number):
        raise ArgumentError(f"elib.really() takes a number, not {number!r}")
    return _Meant(number)


@dataclass(frozen=True, slots=True)
class Rule:
    """What a value must be. Its text follows "it must be"."""

    example: str = field(default="", kw_only=True)  # a good value, as a file writes it
    # what holds if the value is left out, in words, if the default does not say that
    otherwise: str = field(default="", kw_only=True)

    def accept(self, value: object) -> Any:
        """Return *value* as the field holds it.

        Raises:
            Mistake: *value* breaks the rule.
        """
        raise NotImplementedError

    def read(self, text: str) -> object:
        """Return the value that *text* of a command line or a URL means; whether it keeps the rule is not checked."""
        return text

    def require(self, value: object, name: str, whose: str = "") -> Any:
        """Return *value* as the field holds it; a message begins with *whose* and the *name* of the value.

        Raises:
            ArgumentError: *value* breaks the rule.
        """
        try:
            return self.accept(value)
        except Mistake as mistake:
            raise ArgumentError(f"{whose}{mistake.at(name).message}", hint=mistake.hint) from None

    def written(self, value: object) -> str:
        """Return how a file writes what the field holds."""
        if value is None:
            return "none"
        return f"{value:g}" if is_number(value) else f'"{value}"'

    def refuse(self, value: object) -> Mistake:
        """Return what is wrong with *value*, and what was probably meant."""
        return Mistake(f"is {shown(value)}; it must be {self}", hint=getattr(value, "advice", ""))


@dataclass(frozen=True, slots=True)
class Number(Rule):
    """A number."""

    low: float = -MAX_NUMBER  # least value
    high: float = MAX_NUMBER  # greatest value
    unit: str = ""
    usual: float = field(default=math.inf, kw_only=True)  # largest magnitude that is taken without really
    is_open: bool = field(default=False, kw_only=True)  # the number must be above *low*; *low* itself is refused

    @property
    def bounds(self) -> tuple[float, float]:
        """The least and the greatest value without :func:`really`."""
        low = math.nextafter(self.low, math.inf) if self.is_open else self.low
        return max(low, -self.usual), min(self.high, self.usual)

    @property
    def range(self) -> str:
        """The bounds, in words."""
        low, high = self.bounds
        unit = self.unit and f" {self.unit}"
        if self.is_open:
            below = "" if high == MAX_NUMBER else f", at most {short(high)}{unit}"
            return f"above {short(self.low)}{unit}{below}"
        return f"from {short(low)}{unit} on" if high == MAX_NUMBER else f"from {short(low)} to {short(high)}{unit}"

    def __str__(self) -> str:
        is_any = (self.low, self.high) == (-MAX_NUMBER, MAX_NUMBER)
        return "a finite number" if is_any else f"a number {self.range}"

    def read(self, text: str) -> object:
        """Return the number that *text* is."""
        return number_from(text)

    def accept(self, value: object) -> float:
        """Return *value* as a float."""
        # A whole number of Python has no bound, so it is compared before it becomes a float. NaN fits nowhere.
        # NumPy compares with a narrow float in few bits: there the bounds overflow.
        if is_number(value):
            number = value if isinstance(value, int) else float(value)
            usual = math.inf if isinstance(value, _Meant) else self.usual
            if self.low <= number <= self.high and abs(number) <= usual and not (self.is_open and number == self.low):
                return float(number)
        raise self.refuse(value)

    def refuse(self, value: object) -> Mistake:
        """Return what is wrong with *value*, and which unit was probably meant."""
        unit = SHARE if not self.unit and (self.low, self.high) == (0, 1) else self.unit
        hint = getattr(value, "advice", "") or other_unit(value, unit, *self.bounds)
        said = shown(value)
        if is_number(value):
            said = f"{said} {self.unit}".rstrip() if not said.endswith(" bits") else said
            if self.usual < abs(value) and self.low <= value <= self.high:
                hint += f" for {said} write elib.really({value:g})"
        rule = str(self)
        if is_number(value) and value == math.inf and self.high == MAX_NUMBER and "finite" not in rule:
            rule = rule.replace("number", "finite number", 1)
        return Mistake(f"is {said}; it must be {rule}", hint=hint.strip())


@dataclass(frozen=True, slots=True)
class Whole(Number):
    """A whole number."""

    step: int = field(default=1, kw_only=True)  # what it must be a multiple of

    def __str__(self) -> str:
        return f"a {'whole number' if self.step == 1 else f'multiple of {self.step}'} {self.range}"

    def accept(self, value: object) -> int:
        """Return *value* as an int."""
        low, high = self.bounds
        if is_whole(value) and low <= value <= high and value % self.step == 0:
            return int(value)
        raise self.refuse(value)


@dataclass(frozen=True, slots=True)
class Degrees(Number):
    """An angle in a file: degrees there, rad in the field."""

    low: float = -360
    high: float = 360
    unit: str = "degrees"

    def accept(self, value: object) -> float:
        """Return *value*, degrees, in rad."""
        return math.radians(Number.accept(self, value))

    def written(self, value: object) -> str:
        """Return *value*, rad, in degrees."""
        assert is_number(value)
        return f"{math.degrees(value):g}"


@dataclass(frozen=True, slots=True)
class Several(Rule):
    """Several numbers under the same rule."""

    rule: Number  # the rule that each of them must keep
    least: int  # how many there are at least
    most: int | None = None  # how many there are at most; None for exactly *least*

    def __str__(self) -> str:
        kind = "whole numbers" if isinstance(self.rule, Whole) else "numbers"
        count = "two" if self.least == 2 else str(self.least)
        if self.most is not None:
            count = f"{self.least} to {self.most}"
        return f"{count} {kind}, each {self.rule.range}"

    def accept(self, value: object) -> tuple[float, ...]:
        """Return *value* as a tuple."""
        most = self.least if self.most is None else self.most
        if isinstance(value, list | tuple) and self.least <= len(value) <= most:
            try:
                return tuple(self.rule.accept(each) for each in value)
            except Mistake as mistake:
                raise Mistake(self.refuse(value).what, hint=mistake.hint) from None
        raise self.refuse(value)

    def read(self, text: str) -> object:
        """Return the numbers in *text*, which has commas between them."""
        return [number_from(each) for each in text.split(",")]

    def written(self, value: object) -> str:
        """Return the list."""
        assert isinstance(value, tuple)
        return f"[{', '.join(map(str, value))}]"


@dataclass(frozen=True, slots=True)
class Text(Rule):
    """A text on one line."""

    longest: int = MAX_TEXT  # characters at most
    shortest: int = field(default=1, kw_only=True)  # characters at least

    def __str__(self) -> str:
        return f"a text of {self.shortest} to {self.longest} characters on one line"

    def accept(self, value: object) -> str:
        """Return *value*."""
        if isinstance(value, str) and self.shortest <= len(value) <= self.longest and value.isprintable():
            return str(value)
        raise self.refuse(value)


@dataclass(frozen=True, slots=True)
class Lines(Rule):
    """A text, which may be empty or have several lines."""

    longest: int = MAX_TEXT  # characters at most

    def __str__(self) -> str:
        return f"a text of at most {self.longest} characters"

    def accept(self, value: object) -> str:
        """Return *value*."""
        if isinstance(value, str) and len(value) <= self.longest:
            return str(value)
        raise self.refuse(value)


@dataclass(frozen=True, slots=True)
class Choice(Rule):
    """One of a few values."""

    among: tuple[str | int, ...]  # the values

    def __str__(self) -> str:
        return " or ".join(self.written(value) for value in self.among)

    def accept(self, value: object) -> str | int:
        """Return *value*."""
        # 1.0 and true equal 1, but are something else.
        if isinstance(value, str) and value in self.among:
            return str(value)
        if is_whole(value) and value in self.among:
            return int(value)
        raise self.refuse(value)

    def read(self, text: str) -> object:
        """Return the value that is *text*, in upper or lower case."""
        return text.lower() if text.lower() in self.among else text

    def refuse(self, value: object) -> Mistake:
        """Return what is wrong with *value*, and which one was probably meant."""
        words = [word for word in self.among if isinstance(word, str)]
        hint = nearest(value, words) if isinstance(value, str) and words else ""
        return Mistake(f"is {shown(value)}; it must be {self}", hint=hint if hint.startswith("did") else "")


@dataclass(frozen=True, slots=True)
class Member(Rule):
    """A member of an enumeration, its name in upper or lower case, or its number."""

    of: type[enum.IntEnum]  # the enumeration

    def __str__(self) -> str:
        return f"one of {', '.join(member.name for member in self.of)}"

    def accept(self, value: object) -> enum.IntEnum:
        """Return the member."""
        named = self.of.__members__.get(value.strip().upper()) if isinstance(value, str) else None
        if named is not None:
            return named
        if (is_whole(value) or is_truth(value)) and int(value) in set(self.of):
            return self.of(int(value))
        raise self.refuse(value)


@dataclass(frozen=True, slots=True)
class Flag(Rule):
    """Yes or no."""

    def __str__(self) -> str:
        return "true or false"

    def accept(self, value: object) -> bool:
        """Return *value* as a bool."""
        if is_truth(value):
            return bool(value)
        raise self.refuse(value)

    def written(self, value: object) -> str:
        """Return true or false."""
        return "true" if value else "false"


SEED = Whole(0, 2**64 - 1, example="1")
Seed = typing.Annotated[int, SEED]
"""The seed of everything random."""

DELAY = Number(0, 60, "s")
Delay = typing.Annotated[float, DELAY]
"""The delay of a link, or its standard deviation."""

DURATION = Number(0, unit="s", is_open=True)
"""How long something lasts."""

PORT_NUMBER = Whole(0, 65535)
"""The number of a TCP port; 0 is any free one."""

PROBABILITY = Number(0, 1)
Probability = typing.Annotated[float, PROBABILITY]


@dataclass(frozen=True, slots=True)
class Field:
    """An argument of a class or function, and its rule."""

    name: str
    rule: Rule  # what its value must be
    default: object  # the value that holds if it is left out; REQUIRED if it must be given


REQUIRED = inspect.Parameter.empty


@lru_cache(maxsize=256)
def fields_of(taker: Callable[..., object]) -> tuple[Field, ...]:
    """Return those arguments of a class or function whose types have rules, in their order.

    A bool without a rule of its own is a :class:`Flag`.
    """
    hints = typing.get_type_hints(taker, include_extras=True)
    found = ((each, rule_in(hints.get(each.name))) for each in inspect.signature(taker).parameters.values())
    return tuple(Field(each.name, rule, each.default) for each, rule in found if rule is not None)


def rule_of(taker: Callable[..., object], name: str) -> Rule:
    """Return the rule of one argument."""
    return next(each.rule for each in fields_of(taker) if each.name == name)


def rule_in(hint: Any) -> Rule | None:
    """Return the rule in a type; of ``Length | None`` it is that of the length."""
    if hint is bool:
        return Flag(example="true")
    inner = [each for each in getattr(hint, "__metadata__", ()) if isinstance(each, Rule)]
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        inner += [rule for part in typing.get_args(hint) if (rule := rule_in(part)) is not None]
    return inner[0] if inner else None


def check(thing: object, whose: str = "") -> None:
    """Check all fields of a dataclass object that have rules, and put numbers of NumPy into plain ones.

    A field that holds its default is not checked: None, or "" for no name, may stand there.

    Args:
        thing: The object; it may be frozen.
        whose: What messages say in front of the field: ``the light's``, and a space.

    Raises:
        ArgumentError: A field breaks its rule; the message names it, its value and the rule.
    """
    kind: Any = type(thing)
    for each in fields_of(kind):
        value = getattr(thing, each.name)
        if value is each.default:
            continue
        found = each.rule.require(value, each.name, whose)
        if found is not value:
            object.__setattr__(thing, each.name, found)


def short(number: float) -> str:
    """Return a bound in as few digits as say it."""
    if number == 2**64 - 1:
        return "2**64 - 1"
    return f"{number:.0f}" if 1e6 <= abs(number) < 1e15 else f"{number:.6g}"
