"""The parameters of one robot that clients of Foxglove read and set."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from elib.base.body import WHEEL_CIRCUMFERENCE
from elib.base.errors import ArgumentError
from elib.base.rules import Flag, Number
from elib.panel.slot import LIVE, Slot
from elib.panel.watching import FAST, QUICKEST, SLOW, SLOWEST

Value = bool | int | float | str


@dataclass(frozen=True, slots=True)
class Setting:
    """One parameter.

    Attributes:
        name: Its name, below the robot's own.
        about: What it means, for the documentation.
        read: Returns its value.
        change: Sets it; None for a parameter that can only be read.
    """

    name: str
    about: str
    read: Callable[[Slot], Value]
    change: Callable[[Slot, Value], object] | None = None


def number(value: Value, low: float, high: float) -> float:
    """Return a number of a client.

    Raises:
        ArgumentError: It is not a number in this range.
    """
    return float(Number(low, high).require(value, "it"))


def switch(value: Value) -> bool:
    """Return a switch of a client.

    Raises:
        ArgumentError: It is neither true nor false.
    """
    return bool(Flag().require(value, "it"))


def _fastest(slot: Slot) -> float:
    return slot.drive.fastest * WHEEL_CIRCUMFERENCE


def _top_speed(slot: Slot, value: Value) -> None:
    slot.drive.limit_to(number(value, 0.0, _fastest(slot)) / _fastest(slot))


def _camera(slot: Slot, value: Value) -> None:
    slot.watch_camera(LIVE if switch(value) else None)


def _period(slot: Slot, value: Value) -> None:
    slot.watch_camera(number(value, QUICKEST, SLOWEST))


def _hold(slot: Slot, value: Value) -> None:
    slot.playback.pause(on=switch(value))


def _seek(slot: Slot, value: Value) -> None:
    slot.playback.seek(number(value, 0.0, slot.playback.length))


OF_EVERY_ROBOT = (
    Setting("/name", "name of the robot", lambda slot: slot.name),
    Setting("/state", "whether it is connected", lambda slot: slot.phase.value),
)
OF_ROBOTS = (
    *OF_EVERY_ROBOT,
    Setting("/firmware", "its firmware", lambda slot: slot.firmware),
    Setting("/driver", "who drives; empty while no client or page does", lambda slot: slot.drive.driver),
    Setting(
        "/top_speed",
        "highest speed of a wheel, m/s, up to what the robot can do",
        lambda slot: round(slot.drive.limit * _fastest(slot), 6),
        _top_speed,
    ),
    Setting(
        "/rate",
        f"how often all sensors are read, {SLOW:g} to {FAST:g} times a second",
        lambda slot: slot.watcher.rate,
        lambda slot, value: slot.watcher.watch_sensors(number(value, SLOW, FAST)),
    ),
    Setting(
        "/camera", "whether pictures are taken all the time", lambda slot: slot.watcher.pictures is not None, _camera
    ),
    Setting(
        "/picture_period",
        f"s between two pictures, {QUICKEST:g} to {SLOWEST:g}; setting it switches the camera on",
        lambda slot: float(slot.watcher.pictures or LIVE),
        _period,
    ),
)
OF_RECORDINGS = (
    *OF_EVERY_ROBOT,
    Setting(
        "/paused", "whether the recording is held", lambda slot: slot.is_playing and slot.playback.is_paused, _hold
    ),
    Setting(
        "/position",
        "s from the beginning of the recording; setting it goes there",
        lambda slot: round(slot.playback.at, 1) if slot.is_playing else 0.0,
        _seek,
    ),
)


class Parameters:
    """The parameters of one robot.

    Args:
        slot: The robot.
        prefix: Stands before their names.
    """

    def __init__(self, slot: Slot, prefix: str) -> None:
        self._slot = slot
        is_recording = slot.url.startswith("replay:") and "fork=" not in slot.url
        self._settings = {prefix + each.name: each for each in (OF_RECORDINGS if is_recording else OF_ROBOTS)}

    def values(self) -> Mapping[str, Value]:
        """Return all of them by name."""
        return {name: setting.read(self._slot) for name, setting in self._settings.items()}

    def change(self, name: str, value: Value) -> None:
        """Set one of them.

        Raises:
            ElibError: It is not one of this robot, it can only be read, or the value is wrong.
        """
        setting = self._settings[name]
        if setting.change is None:
            raise ArgumentError("it can only be read")
        setting.change(self._slot, value)
