"""A reading of one value is used like that value: compared, tested, formatted, and as a number."""

from __future__ import annotations

import pytest

import elib


def test_it_equals_its_value_and_every_reading_with_the_same() -> None:
    switch = elib.Selector(3, time=1.0)
    assert switch == 3
    assert switch != 4
    assert switch in (1, 2, 3)
    assert {3: "three"}[switch] == "three"  # type: ignore[index]  # it is found like the number
    assert switch == elib.Selector(3, time=2.0)
    assert switch != elib.Temperature(3)
    assert elib.Battery(3440, 4.2, 1.0) != elib.Battery(3439, 4.2, 1.0)


def test_it_is_compared_and_rounded_and_formatted_like_a_number() -> None:
    battery = elib.Battery(3000, 3.66, 0.325)
    assert 3.5 < battery <= 3.66
    assert not battery > 3.7
    assert battery < elib.Battery(3440, 4.2, 1.0)
    assert f"{battery:.1f} V" == "3.7 V"
    assert f"{battery}" == str(battery) == "Battery(raw=3000, volts=3.66, fraction=0.325)"
    assert round(battery, 1) == 3.7
    assert float(elib.Distance(0.25)) == 0.25
    assert list(range(elib.Selector(3))) == [0, 1, 2]
    with pytest.raises(TypeError, match="'float' object cannot be interpreted as an integer"):
        range(battery)


def test_a_button_that_is_not_pressed_is_false() -> None:
    assert elib.Button(True)
    assert not elib.Button(False)
    assert not elib.SdCard(False)
    assert elib.Button(False) == False  # noqa: E712  # what beginners write


def test_a_battery_without_a_voltage_says_so() -> None:
    battery = elib.Battery(1, None, None)
    assert battery != 4.2
    with pytest.raises(elib.Unsupported, match=r"this robot does not say the volts of its battery: Battery\(raw=1"):
        assert battery < 3.5
