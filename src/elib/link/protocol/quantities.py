"""Units and ranges of the arguments of commands."""

from __future__ import annotations

import contextlib
import enum
import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Annotated

from elib.base.body import STEPS_PER_REVOLUTION
from elib.base.errors import ArgumentError
from elib.base.fields import is_number, is_truth, is_whole, other_unit, shown


class LedAction(enum.IntEnum):
    """What to do with a lamp. The numbers are those on the wire."""

    OFF = 0
    ON = 1
    TOGGLE = 2


class CameraMode(enum.IntEnum):
    """Pixel format of the camera. The numbers are those on the wire."""

    GREY = 0
    COLOUR = 1
    YUV = 2
    COLOR = 1


def pixel_bytes(mode: int) -> int:
    """Return the bytes of a pixel in a mode of the camera."""
    return 1 if mode == CameraMode.GREY else 2


class ProximityRate(enum.IntEnum):
    """How often the e-puck2 samples its proximity sensors: not at all, at 100 Hz, at 20 Hz."""

    OFF = 0
    FAST = 1
    SLOW = 2


Number = int | float


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
class Quantity:
    """One kind of argument: its unit, its range, and its whole number on the wire.

    Attributes:
        name: The key under which a profile may have another range.
        unit: Its unit in words; empty for plain numbers.
        low: The smallest value allowed.
        high: The largest value allowed.
        scale: Counts on the wire for one unit; 0 for a whole number that is on the wire as it is.
        choices: The only values allowed, or None.
        names: An enumeration; its members, their numbers and their names are allowed.
        usual: The largest magnitude that is taken without :func:`really`.
    """

    name: str
    unit: str
    low: float
    high: float
    scale: float = 0
    choices: Collection[int] | None = None
    names: type[enum.IntEnum] | None = None
    usual: float = math.inf

    def check(self, argument: str, value: object, *, clip: bool = False) -> Number:
        """Return *value* as the number to use; with *clip*, the nearest one that is allowed.

        Raises:
            ArgumentError: *value* has the wrong type, is not finite, or is out of range.
        """
        if self.names is not None:
            return self._member(argument, value, self.names)
        usual = math.inf if isinstance(value, _Meant) else self.usual
        if is_number(value) and (self.scale or is_whole(value)):
            # A whole number of Python has no bound, so it is compared before it becomes a float.
            number = value if isinstance(value, int) else float(value)
            if clip:
                number = min(max(number, self.low), self.high)  # in this order NaN stays NaN
            is_allowed = self.low <= number <= self.high and abs(number) <= usual
            if is_allowed and (self.choices is None or number in self.choices):
                return float(number) if self.scale else int(number)
        said = f"{shown(value)} {self.unit}".rstrip() if is_number(value) else repr(value)
        raise ArgumentError(f"{argument} is {said}; it must be {self.rule}", hint=self._hint(value))

    def _hint(self, value: object) -> str:
        hint = getattr(value, "advice", "") or other_unit(value, self.unit or self.name, *self._bounds)
        if is_number(value) and self.usual < abs(value) and self.low <= value <= self.high:
            hint += f" for {value:g} {self.unit} write elib.really({value:g})"
        return hint.strip()

    @property
    def _bounds(self) -> tuple[float, float]:
        """The range without :func:`really`."""
        return max(self.low, -self.usual), min(self.high, self.usual)

    def _member(self, argument: str, value: object, names: type[enum.IntEnum]) -> Number:
        if isinstance(value, str):
            member = names.__members__.get(value.strip().upper())
            if member is not None:
                return member
        elif (is_whole(value) or is_truth(value)) and int(value) in set(names):
            return names(int(value))
        allowed = ", ".join(f"{member.name} ({member.value})" for member in names)
        raise ArgumentError(f"{argument} is {value!r}; it must be one of {allowed}")

    @property
    def rule(self) -> str:
        """The rule in words, for errors and help pages."""
        low, high = map(plain, self._bounds)
        if self.names is not None:
            return "one of " + ", ".join(member.name for member in self.names)
        if isinstance(self.choices, range):
            return f"a multiple of {self.choices.step} from {low} to {high}"
        if self.choices is not None:
            return "one of " + ", ".join(str(choice) for choice in self.choices)
        kind = "a number" if self.scale else "a whole number"
        unit = f" {self.unit}" if self.unit else ""
        return f"{kind} from {low} to {high}{unit}"

    def to_wire(self, value: Number) -> int:
        """Return *value* as the nearest whole number on the wire."""
        return round(value * self.scale) if self.scale else int(value)


def number_from(text: str) -> object:
    """Return *text* as a number, decimal or like ``0x60``; if it is not a number, return *text* itself."""
    with contextlib.suppress(ValueError):
        return int(text, 0)
    with contextlib.suppress(ValueError):
        return float(text)
    return text


def plain(bound: float) -> str:
    """Return a bound with all its digits."""
    return f"{bound:.0f}" if bound == int(bound) else f"{bound:g}"


SECONDS = Quantity("seconds", "s", 0, 1e9, scale=1, usual=3600)
"""A time to wait, an hour at most: a larger number is likely to be in milliseconds."""
Seconds = Annotated[float, SECONDS]


def check_timeout(seconds: object, what: str = "a timeout") -> float:
    """Return *seconds* if that can be the limit of a wait; an error calls it *what*.

    Raises:
        ArgumentError: *seconds* is not a number, not finite, negative, or more than an hour without :func:`really`.
    """
    return float(SECONDS.check(what, seconds))


WheelSpeed = Annotated[float, Quantity("wheel_speed", "rev/s", -1, 1, scale=STEPS_PER_REVOLUTION)]
EncoderSteps = Annotated[int, Quantity("encoder", "steps", -32768, 32767)]
LedNumber = Annotated[int, Quantity("led", "", 0, 8)]
RgbLedNumber = Annotated[int, Quantity("rgb_led", "", 1, 7, choices=(1, 3, 5, 7))]
Lamp = Annotated[LedAction | int | bool | str, Quantity("led_action", "", 0, 2, names=LedAction)]
Intensity = Annotated[float, Quantity("intensity", "", 0, 1, scale=100)]
SoundNumber = Annotated[int, Quantity("sound", "", 0, 6)]
Columns = Annotated[int, Quantity("columns", "pixels", 1, 640)]
Rows = Annotated[int, Quantity("rows", "pixels", 1, 640)]
Zoom = Annotated[int, Quantity("zoom", "", 1, 640)]
PixelMode = Annotated[
    CameraMode | int | str,
    Quantity("camera_mode", "", 0, 1, names=enum.IntEnum("PictureMode", {"GREY": 0, "COLOUR": 1, "COLOR": 1})),
]
I2cDevice = Annotated[int, Quantity("i2c_device", "", 0, 254, choices=range(0, 255, 2))]
Byte = Annotated[int, Quantity("byte", "", 0, 255)]
Rate = Annotated[ProximityRate | int | str, Quantity("proximity_rate", "", 0, 2, names=ProximityRate)]
Switch = Annotated[
    bool | str,
    Quantity("switch", "", 0, 1, names=enum.IntEnum("Switch", {"OFF": 0, "ON": 1, "FALSE": 0, "TRUE": 1})),
]
