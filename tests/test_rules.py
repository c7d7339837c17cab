"""Rules of values: what is accepted, what is refused, and with which words."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pytest

from elib import EpuckModel, Scene
from elib.base.errors import ArgumentError
from elib.base.rules import (
    Choice,
    Degrees,
    Flag,
    Number,
    Rule,
    Several,
    Text,
    Whole,
    check,
    fields_of,
    nearest,
    rule_of,
)
from elib.simulator.physics import Box, Light, Wall


@dataclass(frozen=True, slots=True)
class Lamp:
    """A thing with rules.

    Attributes:
        power: W.
        count: How many.
        is_on: Whether it shines.
        note: Anything.
    """

    power: Annotated[float, Number(0, 10, "W")]
    count: Annotated[int, Whole(1, 9)] | None = None
    is_on: bool = True
    note: object = None

    def __post_init__(self) -> None:
        check(self, "the lamp's ")


def test_a_number_of_numpy_becomes_a_plain_one() -> None:
    lamp = Lamp(np.float32(1.5), np.int64(3), np.bool_(False))  # type: ignore[arg-type]
    assert lamp == Lamp(1.5, 3, is_on=False)
    assert [type(value) for value in (lamp.power, lamp.count, lamp.is_on)] == [float, int, bool]
    assert type(Lamp(2).power) is float
    box = Box(np.float64(0.5), np.int32(1), np.float32(0.5), np.float16(0.5), is_pushable=np.bool_(True))  # type: ignore[arg-type]
    assert box == Box(0.5, 1.0, 0.5, 0.5, is_pushable=True)
    assert Scene(np.float32(2), np.int8(1), seed=np.uint8(7)) == Scene(2.0, 1.0, seed=7)  # type: ignore[arg-type]
    assert EpuckModel(rays=np.int64(5)).rays == 5  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("rule", "value", "message"),
    [
        (Number(0, 10, "W"), 11, "is 11 W; it must be a number from 0 to 10 W"),
        (Number(0, 10), math.nan, "is nan; it must be a number from 0 to 10"),
        (Number(0, 10), True, "is true; it must be a number from 0 to 10"),
        (Number(0, 10), np.bool_(True), "it must be a number from 0 to 10"),
        (Number(0, 10), "5", "is '5'; it must be a number from 0 to 10"),
        (Number(0, 10), np.float32(12.5), "is 12.5; it must be a number from 0 to 10"),
        (Number(0, unit="s", is_open=True), 0, "is 0 s; it must be a number above 0 s"),
        (Number(0, 60, "s", is_open=True), 0, "is 0 s; it must be a number above 0 s, at most 60 s"),
        (Number(), math.inf, "is inf; it must be a finite number"),
        (Number(), 10**400, "is a number of 1329 bits; it must be a finite number"),
        (Degrees(), 361, "is 361 degrees; it must be a number from -360 to 360 degrees"),
        (Whole(1, 9), 2.0, "is 2.0; it must be a whole number from 1 to 9"),
        (Choice((1, 2)), 1.0, "is 1.0; it must be 1 or 2"),
        (Choice((1, 2)), True, "is true; it must be 1 or 2"),
        (Choice(("one", "two")), "won", 'is \'won\'; it must be "one" or "two"'),
        (Flag(), 1, "is 1; it must be true or false"),
        (Text(5), "", "is ''; it must be a text of 1 to 5 characters on one line"),
        (Text(5), "a\nb", "it must be a text of 1 to 5 characters on one line"),
        (Several(Number(0, 1), 2), [0.5], "is [0.5]; it must be two numbers, each from 0 to 1"),
        (Several(Whole(0, 9), 8, 10), [0] * 11, "it must be 8 to 10 whole numbers, each from 0 to 9"),
    ],
)
def test_what_breaks_a_rule_is_refused_with_the_value_and_the_rule(rule: Rule, value: object, message: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        rule.accept(value)
    assert message in caught.value.message


@pytest.mark.parametrize(
    ("rule", "value", "hint"),
    [
        (Number(0, 5, "m"), 40, "did you mean 0.4 (40 cm) or 0.04 (40 mm)?"),
        (Number(0, 5, "m"), 7, "did you mean 0.07 (7 cm)?"),
        (Number(0, 0.13, "m/s"), np.float32(5), "did you mean 0.05 (5 cm/s) or 0.005 (5 mm/s)?"),
        (Number(-9, 9, "rad"), -90, "did you mean math.radians(-90)?"),
        (Number(0, 60, "s"), 200, "did you mean 0.2 (200 ms)?"),
        (Number(0.001, 100, "kg"), 150, "did you mean 0.15 (150 g)?"),
        (Several(Number(0, 5, "m"), 2), [40, 1], "did you mean 0.4 (40 cm) or 0.04 (40 mm)?"),
        (Number(0, 5, "m"), -40, ""),
        (Number(0, 5, "m"), math.nan, ""),
        (Number(0, 5, "m"), 10**400, ""),
        (Number(0, 5, "m"), "40", "did you mean 0.4 (40 cm) or 0.04 (40 mm)?"),
        (Number(0, 5, "m"), "2", "did you mean 2, without quotes?"),
        (Number(0, 5, "m"), " 40 cm ", "did you mean 0.4, without quotes?"),
        (Number(0, 5, "m"), "40 kg", ""),
        (Number(0, 5, "m"), "far", ""),
        (Number(0, 5), 40, ""),
    ],
)
def test_a_number_that_fits_in_another_unit_is_answered_with_what_it_is_in_this_one(
    rule: Rule, value: object, hint: str
) -> None:
    with pytest.raises(ArgumentError) as caught:
        rule.accept(value)
    assert caught.value.hint == hint


@pytest.mark.parametrize(
    ("rule", "text", "value"),
    [
        (Number(0, is_open=True), "5e-324", 5e-324),
        (Number(0, 10), "0.5", 0.5),
        (Whole(0, 100), "0x60", 96),
        (Several(Number(0, 1), 1, 3), "0.5,1", (0.5, 1)),
        (Choice(("csv", "json")), "CSV", "csv"),
        (Text(), "5", "5"),
    ],
)
def test_a_word_of_a_command_line_is_read_as_its_rule_needs_it(rule: Rule, text: str, value: object) -> None:
    assert rule.accept(rule.read(text)) == value


def test_a_message_names_whose_value_it_is() -> None:
    with pytest.raises(ArgumentError, match=r"^the lamp's power is 11 W; it must be a number from 0 to 10 W$"):
        Lamp(11)
    with pytest.raises(ArgumentError, match=r"^the light's intensity is 11; it must be a number from 0 to 10$"):
        Light(0, 0, intensity=11)
    with pytest.raises(ArgumentError, match=r"^ambient is -1 counts; it must be a number from 0 to 4095 counts$"):
        EpuckModel(ambient=-1)


def test_a_default_is_not_checked_and_what_has_no_rule_neither() -> None:
    assert Lamp(1, None, note=math.nan).count is None
    assert Wall(0, 0, 1, 1, reflectance=None).reflectance is None
    assert [field.name for field in fields_of(Lamp)] == ["power", "count", "is_on"]
    assert rule_of(Lamp, "count") == Whole(1, 9)


@pytest.mark.parametrize(
    ("word", "known", "hint"),
    [
        ("colr", ["colour", "size"], "did you mean colour?"),
        ("x" * 100_000, ["colour", "size"], "choose one of colour, size"),
        ("any", [], "there are none"),
    ],
)
def test_an_unknown_word_is_answered_with_the_nearest_or_with_all(word: str, known: list[str], hint: str) -> None:
    assert nearest(word, known) == hint
