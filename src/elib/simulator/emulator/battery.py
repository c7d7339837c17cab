"""The battery of a virtual robot: a lithium-ion cell of 5 Wh that runs down by what is switched on.

5 Wh last about 3 h (Webots' guide to the e-puck; e-puck.md, 11), so the robot takes 1.67 W in use. How much each
part takes was never published; the values below are chosen so that a robot that drives with one or two LEDs lit takes
that much. The discharge curve is that of any small lithium-ion cell, between the firmwares' 4.2 V and 3.4 V.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from elib.base.curves import interpolated
from elib.base.rules import Number

CAPACITY: Final = 5.0 * 3600
"""J. 5 Wh."""

FULL_VOLTS, LOW_VOLTS = 4.2, 3.4
"""Between these both robots' firmwares tell how full the battery is; below, the e-puck1 calls it low
(e-puck.md, 11)."""

IDLE: Final = 1.1
"""Power taken by processor, sensors and radio, W."""

MOTOR: Final = 0.25
"""Power taken by each motor that turns, W."""

SAVING_MOTOR: Final = 0.125
"""Power taken by each motor that turns slower than :data:`SAVING_RATE`, W: the firmware halves its current there."""

SAVING_RATE: Final = 601.0
"""steps/s (firmware of the e-puck1; 650 on the e-puck2)."""

LED: Final = 0.05
"""Power taken by each LED that is lit, W: some 14 mA."""

DISCHARGE: Final = ((0.0, 3.0), (0.03, 3.4), (0.1, 3.58), (0.3, 3.7), (0.5, 3.79), (0.7, 3.92), (0.9, 4.09), (1.0, 4.2))
"""Charge left, 0..1, and voltage, V; straight lines between."""


def power_of(rates: Sequence[float], lamps: float) -> float:
    """Return the power that the robot takes, W.

    Args:
        rates: Step rates of its motors, steps/s.
        lamps: How many LEDs are lit; a fraction stands for a dimmed one.
    """
    power = IDLE + LED * lamps
    for rate in rates:
        if rate != 0.0:
            power += SAVING_MOTOR if abs(rate) < SAVING_RATE else MOTOR
    return power


def volts_at(charge: float) -> float:
    """Return the voltage, V, 3.0..4.2, of a battery that holds so much, 0..1."""
    return interpolated(DISCHARGE, charge)


class BatteryCell:
    """The cell. An empty one stays at 3 V: the virtual robot drives on.

    Args:
        charge: Its charge at the beginning, 0..1.
        time: The time of the beginning, s.

    Raises:
        ArgumentError: The charge is out of its range.
    """

    def __init__(self, charge: float = 1.0, time: float = 0.0) -> None:
        self._left: float = CAPACITY * Number(0, 1).require(charge, "charge", "the battery's ")
        self._since = time
        self._power = IDLE

    def load(self, power: float, time: float) -> None:
        """Draw *power*, W, from *time*, s, on."""
        self._left, self._since = self._left_at(time), max(time, self._since)
        self._power = power

    def charge(self, time: float) -> float:
        """Return what is left at *time*, 0..1."""
        return self._left_at(time) / CAPACITY

    def volts(self, time: float) -> float:
        """Return the voltage at *time*, V, 3.0..4.2."""
        return volts_at(self.charge(time))

    def _left_at(self, time: float) -> float:
        return max(0.0, self._left - self._power * max(0.0, time - self._since))
