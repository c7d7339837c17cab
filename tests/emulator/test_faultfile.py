"""Fault scripts as files: those that come with elib, and what is wrong with others."""

import math
from pathlib import Path

import pytest

from elib.base.errors import ArgumentError, SimulationError
from elib.simulator.emulator.faultkinds import KINDS, Ramp, When
from elib.simulator.emulator.faultscript import FaultScript, gallery, load, parse

SHIPPED = ["dead-battery", "flaky-bluetooth", "half-answers", "loose-wheel", "robot-reset", "walks-out-of-range"]


def script(text: str) -> FaultScript:
    return parse(f'description = "test"\n{text}'.encode(), "test.toml")


def test_these_scripts_come_with_elib_and_say_what_they_are_like() -> None:
    assert gallery() == SHIPPED
    for name in SHIPPED:
        found = load(name)
        assert found.name == name
        assert len(found.description) > 40
        assert found.faults


def test_every_kind_can_be_written_and_is_read_as_written(tmp_path: Path) -> None:
    path = tmp_path / "all.toml"
    path.write_text(
        'description = "all"\n'
        + "".join(
            f'[[fault]]\nkind = "{name}"\nfrom = 5\n'
            + ("" if kind.is_instant else "until = 7.5\n")
            + "".join(f"{key.name} = {key.example}\n" for key in kind.names)
            + "".join(f"{key.name} = {key.high:g}\n" for key in kind.keys)
            for name, kind in KINDS.items()
        )
    )
    found = load(str(path))
    assert found.seed == 0
    assert [fault.kind for fault in found.faults] == list(KINDS)
    for fault in found.faults:
        assert fault.when == When(5.0, math.inf if KINDS[fault.kind].is_instant else 7.5)
        assert all(fault.strengths[key.name] == Ramp(key.high, key.high) for key in KINDS[fault.kind].keys)


@pytest.mark.parametrize(
    ("text", "message", "cure"),
    [
        ("[[fault]", "test.toml:2: this is not TOML", "toml.io"),
        ("speed = 1", "test.toml:2: speed is not a key of a fault script", "did you mean seed?"),
        ("[fault]\n", "test.toml:2: fault must be an array", "[[fault]]"),
        ("[[fault]]\nat = 1", "test.toml:2: fault[0].kind is missing", 'kind = "loss"'),
        ('[[fault]]\nkind = "los"', "test.toml:3: fault[0].kind is 'los'", "did you mean loss?"),
        ('[[fault]]\nkind = "loss"', "fault[0].probability is missing", "probability = 0.5"),
        (
            '[[fault]]\nkind = "silence"\n[[fault]]\nkind = "loss"\nprobability = 2',
            "test.toml:6: fault[1].probability is 2; it must be a number from 0 to 1",
            "",
        ),
        ('[[fault]]\nkind = "loss"\nprobability = "high"', "probability is 'high'; it must be a number", "= 0.5"),
        ('[[fault]]\nkind = "loss"\nprobability = true', "probability is true", "= 0.5"),
        ('[[fault]]\nkind = "loss"\nprobability = nan', "probability is nan", "= 0.5"),
        (f'[[fault]]\nkind = "loss"\nprobability = {10**400}', "it must be a number", "= 0.5"),
        ('[[fault]]\nkind = "loss"\nprobability = [1, 0, 1]', "it must be a number from 0 to 1, or two of them", "0.5"),
        ('[[fault]]\nkind = "loss"\nprobability = [0, 1]', "probability goes from 0 to 1, but", "until = SECONDS"),
        (
            '[[fault]]\nkind = "duplicate"\nprobability = 1\nuntil = 5\nafter = [0, 1]',
            "after goes from 0 to 1; it must be one number",
            "after = 0",
        ),
        ('[[fault]]\nkind = "loss"\nprobabilty = 1', "probabilty is not a key of a fault script", "probability?"),
        ('[[fault]]\nkind = "silence"\nat = -1', "at is -1 s; it must be a number from 0 to 1000000 s", "at = 5"),
        ('[[fault]]\nkind = "silence"\nfrom = 5\nuntil = 5', "until is 5 s, but it begins at 5 s", "after from"),
        ('[[fault]]\nkind = "silence"\nevery = 5\nfor = 5', "it would never stop", "shorter than every"),
        ('[[fault]]\nkind = "silence"\nevery = 0\nfor = 1', "every is 0 s; it must be a number from 0.001", ""),
        ('[[fault]]\nkind = "silence"\nevery = 5', "for is missing", "for = SECONDS"),
        ('[[fault]]\nkind = "silence"\nat = 1\nfrom = 1', "at is for what happens once", "from and every"),
        ('[[fault]]\nkind = "cut"\nat = 1\nfor = 1\nuntil = 3', "both say when it ends", "leave one"),
        ('[[fault]]\nkind = "stall"\nat = 1', "a stall needs an end", "for = SECONDS"),
        ('[[fault]]\nkind = "reset"\nat = 1\nfor = 1', "a reset has no length", "leave it out"),
        ('[[fault]]\nkind = "battery"\nvolts = 3\nevery = 9\nfor = 3', "a battery comes once", "leave it out"),
    ],
)
def test_a_mistake_in_a_file_is_named_with_its_place_and_its_cure(text: str, message: str, cure: str) -> None:
    with pytest.raises(SimulationError) as caught:
        script(text)
    assert "test.toml" in caught.value.message
    assert message in caught.value.message
    assert cure in caught.value.hint


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"seed = 1", "description is missing"),
        (b'description = "x"\nseed = 1.5', "seed is 1.5; it must be a whole number"),
        (b'description = "x"\nseed = -1', "seed is -1; it must be a whole number from 0"),
        (b'description = "\xff"', "this is not text in UTF-8"),
    ],
)
def test_an_impossible_head_is_refused(content: bytes, message: str) -> None:
    with pytest.raises(SimulationError, match=message):
        parse(content, "test.toml")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("flaky-blutooth", "did you mean flaky-bluetooth?"),
        ("sunshine", "choose one of dead-battery, flaky-bluetooth"),
        ("nowhere/storm.toml", "cannot be read: No such file"),
        ("a\0b.toml", "cannot be read"),
    ],
)
def test_a_script_that_is_not_there_is_refused_with_the_nearest(name: str, message: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        load(name)
    assert message in str(caught.value)
