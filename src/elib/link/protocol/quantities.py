"""Units and ranges of the arguments of commands."""

from __future__ import annotations

import enum
import math
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Annotated

from elib.base.body import STEPS_PER_REVOLUTION
from elib.base.rules import Choice, Member, Number, Rule, Whole, is_number


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
        usual: The largest magnitude that is taken without :func:`~elib.really`.
        takes: The rule that follows from all this.
    """

    name: str
    unit: str
    low: float
    high: float
    scale: float = 0
    choices: Collection[int] | None = None
    names: type[enum.IntEnum] | None = None
    usual: float = math.inf

    takes: Rule = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.names is not None:
            takes: Rule = Member(self.names)
        elif isinstance(self.choices, range):
            takes = Whole(self.low, self.high, self.unit, step=self.choices.step)
        elif self.choices is not None:
            takes = Choice(tuple(self.choices))
        else:
            takes = (Number if self.scale else Whole)(self.low, self.high, self.unit, usual=self.usual)
        object.__setattr__(self, "takes", takes)

    def check(self, argument: str, value: object, *, clip: bool = False) -> float:
        """Return *value* as the number to use; with *clip*, the nearest one that is allowed.

        Raises:
            ArgumentError: *value* has the wrong type, is not finite, or is out of range.
        """
        if clip and is_number(value):
            value = min(max(value, self.low), self.high)  # in this order NaN stays NaN
        number: float = self.takes.require(value, argument)
        return number

    @property
    def rule(self) -> str:
        """The rule in words, for errors and help pages."""
        return str(self.takes)

    def to_wire(self, value: float) -> int:
        """Return *value* as the nearest whole number on the wire."""
        return round(value * self.scale) if self.scale else int(value)


SECONDS = Quantity("seconds", "s", 0, 1e9, scale=1, usual=3600)
"""A time to wait, an hour at most: a larger number is likely to be in milliseconds."""
Seconds = Annotated[float, SECONDS]


def check_timeout(seconds: object) -> float:
    """Return *seconds* if that can be the limit of a wait.

    Raises:
        ArgumentError: *seconds* is not a number, not finite, negative, or more than an hour without ``really()``.
    """
    return float(SECONDS.check("a timeout", seconds))


WheelSpeed = Annotated[float, Quantity("wheel_speed", "rev/s", -1, 1, scale=STEPS_PER_REVOLUTION)]
EncoderSteps = Annotated[int, Quantity("encoder", "steps", -32768, 32767)]
LedNumber = Annotated[int, Quantity("led", "", 0, 8)]
RGB_LEDS = (1, 3, 5, 7)
"""The ring LEDs that have colours on an e-puck2."""
RgbLedNumber = Annotated[int, Quantity("rgb_led", "", 1, 7, choices=RGB_LEDS)]
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
TAG_SIZE = Quantity("tag_size", "m", 0.005, 1, scale=1e6)
TagSize = Annotated[float, TAG_SIZE]
I2cDevice = Annotated[int, Quantity("i2c_device", "", 0, 254, choices=range(0, 255, 2))]
Byte = Annotated[int, Quantity("byte", "", 0, 255)]
Rate = Annotated[ProximityRate | int | str, Quantity("proximity_rate", "", 0, 2, names=ProximityRate)]
Switch = Annotated[
    bool | str,
    Quantity("switch", "", 0, 1, names=enum.IntEnum("Switch", {"OFF": 0, "ON": 1, "FALSE": 0, "TRUE": 1})),
]
