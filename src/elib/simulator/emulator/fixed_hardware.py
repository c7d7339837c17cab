"""Hardware whose readings never change by themselves: the state of golden transcripts, or of ``hardware=FILE``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, TypeVar

from elib.base.errors import ArgumentError
from elib.base.files import MAX_STATE, parse_json, read_file
from elib.base.rules import Choice, Number, Rule, Several, Whole, nearest, shown
from elib.link.protocol.camera import CameraWindow
from elib.link.protocol.shapes import MICROPHONES, SAMPLES
from elib.simulator.emulator.hardware import Lights

T = TypeVar("T")

INT16 = Whole(-32_768, 32_767)
UINT16 = Whole(0, 65_535)
SWITCH = Whole(0, 1)

TRIANGLE = 20
"""Period of the sound, samples (tests/golden/README.md)."""

KEYS: Mapping[str, tuple[Any, Rule]] = {
    "selector": (3, Whole(0, 15)),
    "ir_check": (2, UINT16),
    "ir_address": (0, UINT16),
    "ir_data": (0, UINT16),
    "prox": (
        [100, 90, 80, 70, 60, 50, 40, 30, 20, 10],
        Several(INT16, 8, 10),
    ),  # two of the ten exist on the gumstix extension only
    "light": ([3501, 3502, 3503, 3504, 3505, 3506, 3507, 3508, 3509, 3510], Several(INT16, 8, 10)),
    "acc": ([2100, 1990, 2800], Several(INT16, 3)),
    "acc13": ([160, -320, 16_000], Several(INT16, 3)),
    "gyro": ([11, -22, 333], Several(INT16, 3)),
    "temp": (27, Whole(-128, 127)),
    "floor": ([1001, 1002, 1003, 1004, 1005], Several(UINT16, 5)),
    "floor_ambient": ([11, 12, 13, 14, 15], Several(UINT16, 5)),
    "floor_present": (1, SWITCH),
    "mic_base": ([2000, 2010, 2020, 2030], Several(INT16, 4)),
    "mic_volume": ([30, 40, 50, 60], Several(INT16, 4)),
    "mic_last_id": (42, Whole(0, 99)),
    "battery_raw": (2400, UINT16),
    "batt_low": (1, SWITCH),
    "hw13": (0, SWITCH),
    "eeprom": (0xFFF7, UINT16),
    "camera": (0x3030, UINT16),
    "mag": ([1.5, -2.5, 3.25], Several(Number(-3.0e38, 3.0e38), 3)),
    "tof": (123, UINT16),
    "button": (0, SWITCH),
    "sd": (0, SWITCH),
    "shift": (0, UINT16),
    "motor_time": ("frozen", Choice(("frozen", "running"))),
}
"""The keys of a state: the value of each at rest, and its rule."""

DEFAULT_STATE: Mapping[str, Any] = {key: value for key, (value, _) in KEYS.items()}
"""The state the golden transcripts begin with, unless they say otherwise (``tests/golden/README.md``)."""

AT_REST: Mapping[str, Mapping[str, Any]] = {
    "epuck2": {"acc13": [160, -320, -16_384]},
    "epuck2-wifi": {"acc13": [160, -320, -16_384], "selector": 15},
}
"""Readings at rest that differ by firmware: the inertial chip of the e-puck2, counts, whose z axis points down; and the
selector's position for Wi-Fi."""


def defaults_for(firmware: str) -> dict[str, Any]:
    """Return the state of a robot at rest that runs *firmware*."""
    return deepcopy({**DEFAULT_STATE, **AT_REST.get(firmware, {})})


def _reading(key: str, kind: Callable[[Any], T]) -> Callable[[FixedHardware], T]:
    """Return a method that returns what the state has under *key*."""

    def read(self: FixedHardware) -> T:
        return kind(self._state[key])

    return read


class FixedHardware:
    """A robot whose readings are those of a state.

    Args:
        state: Values by key, as in the ``state`` objects of the golden files.
        firmware: The firmware whose robot at rest gives the missing keys; see :func:`defaults_for`.

    Raises:
        ArgumentError: A key is unknown or a value not allowed; the message names both.
    """

    def __init__(self, state: Mapping[str, object] | None = None, *, firmware: str = "") -> None:
        self._state = defaults_for(firmware)
        self.lights = Lights()  # the lamps as last set
        self.sound = 0  # the sound last started, 1..5; 0 is silence
        self.rates = (0.0, 0.0)  # the wheels' step rates as last driven, steps/s
        self.set(**(state or {}))

    @classmethod
    def load(cls, path: str | Path, *, firmware: str = "") -> FixedHardware:
        """Read the state from a JSON file.

        Args:
            path: A file that holds one object, such as ``{"selector": 3, "prox": [0, 0, 0, 0, 0, 0, 0, 0]}``.
            firmware: The firmware whose robot at rest gives the missing keys.

        Raises:
            ArgumentError: The file cannot be read, is not a JSON object, or holds a key or value not allowed.
        """
        content = read_file(path, "the hardware file", largest=MAX_STATE)
        if len(content) > MAX_STATE:
            raise ArgumentError(
                f"the hardware file {path} is larger than {MAX_STATE // 1_000_000} MB, which is the limit",
                hint='it holds one object: {"selector": 3}',
            )
        try:
            state = parse_json(content)
        except ValueError as error:
            raise ArgumentError(
                f"the hardware file {path} is not JSON: {error}", hint='it holds one object: {"selector": 3}'
            ) from error
        if not isinstance(state, dict):
            raise ArgumentError(
                f"the hardware file {path} holds {type(state).__name__}, not an object",
                hint='it holds one object: {"selector": 3}',
            )
        try:
            return cls(state, firmware=firmware)
        except ArgumentError as error:
            raise ArgumentError(f"in the hardware file {path}: {error.message}", hint=error.hint) from error

    def set(self, **state: object) -> None:
        """Change the hardware from outside: all given keys or, if one is not allowed, none.

        Args:
            **state: New values by key.

        Raises:
            ArgumentError: A key is unknown or a value not allowed.
        """
        checked = {key: _checked(key, value) for key, value in state.items()}
        self._state.update(checked)

    @property
    def state(self) -> dict[str, Any]:
        """A copy of the whole state."""
        return deepcopy(self._state)

    @property
    def motor_time(self) -> Literal["frozen", "running"]:
        """Whether motors move with time, or only by :meth:`~elib.testing.EmulatedRobot.tick`."""
        return "running" if self._state["motor_time"] == "running" else "frozen"

    @property
    def hw13(self) -> bool:
        """Hardware revision 1.3 of the e-puck1."""
        return bool(self._state["hw13"])

    @property
    def eeprom(self) -> int:
        """Identity word, 16 bit."""
        return int(self._state["eeprom"])

    @property
    def camera_chip(self) -> int:
        """Chip number; 0 means no camera answers."""
        return int(self._state["camera"])

    @property
    def floor_present(self) -> bool:
        """Whether the ground module is plugged in."""
        return bool(self._state["floor_present"])

    def advance(self, time: float) -> None:
        """Do nothing: time changes no reading."""

    def step(self, left: float, right: float) -> None:
        """Do nothing: there is no world to move in."""

    def drive(self, left: float, right: float) -> None:
        """Store the step rates."""
        self.rates = (left, right)

    def show(self, lights: Lights) -> None:
        """Store the lamps."""
        self.lights = deepcopy(lights)

    def play_sound(self, number: int) -> None:
        """Store the sound."""
        self.sound = number

    selector = _reading("selector", int)
    reflected_light = _reading("prox", list[int])
    ambient_light = _reading("light", list[int])
    acceleration = _reading("acc", list[int])
    inertial_acceleration = _reading("acc13", list[int])
    rotation = _reading("gyro", list[int])
    magnetic_field = _reading("mag", list[float])
    temperature = _reading("temp", int)
    ground = _reading("floor", list[int])
    ground_ambient = _reading("floor_ambient", list[int])
    microphone_index = _reading("mic_last_id", int)
    battery = _reading("battery_raw", int)
    distance = _reading("tof", int)
    button_is_pressed = _reading("button", bool)
    has_sd_card = _reading("sd", bool)

    def inertial_zeros(self) -> tuple[Sequence[int], Sequence[int]]:
        """Return ``acc13`` and ``gyro``."""
        return self.inertial_acceleration(), self.rotation()

    def infrared(self) -> tuple[int, int, int]:
        """Return ``ir_check``, ``ir_address``, ``ir_data``."""
        return int(self._state["ir_check"]), int(self._state["ir_address"]), int(self._state["ir_data"])

    def microphones(self) -> Sequence[tuple[int, int]]:
        """Return pairs of ``mic_base`` and ``mic_volume``."""
        return list(zip(self._state["mic_base"], self._state["mic_volume"], strict=True))

    def microphone_rings(self) -> Sequence[int]:
        """Return a triangle wave around each base level, three samples apart (tests/golden/README.md)."""
        values = []
        for number, (base, volume) in enumerate(self.microphones()[:MICROPHONES]):
            for sample in range(SAMPLES):
                phase = (sample + 3 * number) % TRIANGLE
                values.append(base - volume // 2 + volume * min(phase, TRIANGLE - phase) // (TRIANGLE // 2))
        return values

    def battery_is_low(self) -> bool:
        """Return the comparator's result: ``batt_low`` is the level of its pin, and 1 means that it is *not* low."""
        return not self._state["batt_low"]

    def picture(self, window: CameraWindow) -> bytes:
        """Take a picture of the test pattern, which depends only on row and column; ``shift`` moves it."""
        shift = int(self._state["shift"])
        return b"".join(_pattern_row(window.mode, window.width, row + shift) for row in range(window.height))


@lru_cache(maxsize=1024)
def _pattern_row(mode: int, width: int, row: int) -> bytes:
    """Return one row of the pattern in ``tests/golden/README.md``."""
    if mode == 0:
        return bytes((3 * column + 7 * row) & 0xFF for column in range(width))
    line = bytearray()
    for pixel in range(width):
        if mode == 2:
            chroma = 128 - row if pixel & 1 else 128 + pixel
            line += bytes(((3 * pixel + 7 * row) & 0xFF, chroma & 0xFF))
        else:
            red, green, blue = pixel & 31, row & 63, (pixel + row) & 31
            line += ((red << 11) | (green << 5) | blue).to_bytes(2, "big")
    return bytes(line)


def _checked(key: str, value: object) -> Any:
    """Return *value* if it follows the rule of *key*; true and false count as 1 and 0."""
    if key not in KEYS:
        raise ArgumentError(f"hardware has no {shown(key)}", hint=nearest(key, KEYS))
    rule = KEYS[key][1]
    if isinstance(value, list | tuple):
        return list(rule.require([_number(item) for item in value], key))
    return rule.require(_number(value), key)


def _number(value: object) -> object:
    return int(value) if isinstance(value, bool) else value
