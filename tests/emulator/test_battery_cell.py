"""The battery: three hours, a falling voltage, and what takes how much."""

import itertools

import pytest

from elib.base.errors import ArgumentError
from elib.simulator.emulator.battery import IDLE, MOTOR, SAVING_MOTOR, BatteryCell, power_of

HOUR = 3600.0
IN_USE = power_of((1000, 1000), 1.5)


def test_five_watt_hours_last_about_three_hours_in_use():
    cell = BatteryCell()
    cell.load(IN_USE, 0.0)
    assert cell.charge(2.7 * HOUR) > 0.03
    assert cell.volts(2.7 * HOUR) > 3.4
    assert cell.volts(3.0 * HOUR) < 3.4
    assert cell.volts(30 * HOUR) == 3.0


def test_the_voltage_falls_from_4_2_without_a_jump():
    cell = BatteryCell()
    cell.load(IN_USE, 0.0)
    volts = [cell.volts(60.0 * minute) for minute in range(200)]
    assert volts[0] == 4.2
    assert all(0 <= before - after < 0.08 for before, after in itertools.pairwise(volts))


def test_what_is_taken_counts_from_when_it_is_switched_on():
    cell = BatteryCell()
    cell.load(0.0, 0.0)
    assert cell.charge(1.0 * HOUR) == 1.0
    cell.load(5.0, 1.0 * HOUR)
    assert cell.charge(1.2 * HOUR) == pytest.approx(0.8)
    cell.load(0.0, 1.5 * HOUR)
    assert cell.charge(9.0 * HOUR) == pytest.approx(0.5)


def test_how_often_it_is_looked_at_changes_nothing_and_time_never_goes_back():
    cell = BatteryCell()
    cell.load(2.0, 100.0)
    looked = [cell.charge(time) for time in (200.0, 150.0, 200.0, 0.0)]
    assert looked[0] == looked[2] < looked[1] < 1.0
    cell.load(2.0, 50.0)
    assert cell.charge(200.0) == looked[0]


@pytest.mark.parametrize(
    ("rates", "power"),
    [((0, 0), 0), ((100, 0), SAVING_MOTOR), ((-600, 600), 2 * SAVING_MOTOR), ((-601, 1000), 2 * MOTOR)],
)
def test_a_motor_takes_half_below_601_steps_per_second(rates, power):
    assert power_of(rates, 0) == pytest.approx(IDLE + power)


def test_an_impossible_charge_is_refused():
    for charge in (-0.1, 1.1, float("nan")):
        with pytest.raises(ArgumentError, match="from 0 to 1"):
            BatteryCell(charge)
