"""The parameters of one robot that clients of Foxglove read and set."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from elib.base.body import WHEEL_CIRCUMFERENCE
from elib.base.errors import ArgumentError
from elib.base.rules import Flag, Number
from elib.panel.slot import LIVE, Slot

Value = bool | int | float | str


class Setting(NamedTuple):
    """How a parameter is read, and how it is set; one that can only be read has no way to set it."""

    read: Callable[[Slot], Value]
    change: Callable[[Slot, Any], object] | None = None


def _fastest(slot: Slot) -> float:
    return slot.drive.fastest * WHEEL_CIRCUMFERENCE


OF_EVERY_ROBOT = {
    "/name": Setting(lambda slot: slot.name),
    "/state": Setting(lambda slot: slot.phase.value),
}
OF_ROBOTS = OF_EVERY_ROBOT | {
    "/firmware": Setting(lambda slot: slot.firmware),
    "/driver": Setting(lambda slot: slot.drive.driver),  # empty while no client or page drives
    "/top_speed": Setting(  # of a wheel, m/s
        lambda slot: round(slot.drive.limit * _fastest(slot), 6),
        lambda slot, value: slot.drive.limit_to(
            Number(0.0, _fastest(slot), "m/s").require(value, "it") / _fastest(slot)
        ),
    ),
    "/rate": Setting(lambda slot: slot.watcher.rate, lambda slot, value: slot.watcher.watch_sensors(value)),  # Hz
    "/camera": Setting(
        lambda slot: slot.watcher.pictures is not None,
        lambda slot, value: slot.watch_camera(LIVE if Flag().require(value, "it") else None),
    ),
    # s between two pictures; setting it switches the camera on
    "/picture_period": Setting(
        lambda slot: float(slot.watcher.pictures or LIVE), lambda slot, value: slot.watch_camera(value)
    ),
}
OF_RECORDINGS = OF_EVERY_ROBOT | {
    "/paused": Setting(
        lambda slot: slot.is_playing and slot.playback.is_paused,
        lambda slot, value: slot.playback.pause(on=Flag().require(value, "it")),
    ),
    "/position": Setting(  # s
        lambda slot: round(slot.playback.at, 1) if slot.is_playing else 0.0,
        lambda slot, value: slot.playback.seek(Number(0.0, slot.playback.length, "s").require(value, "it")),
    ),
}


class Parameters:
    """The parameters of one robot."""

    def __init__(self, slot: Slot, prefix: str) -> None:
        self._slot = slot
        is_recording = slot.url.startswith("replay:") and "fork=" not in slot.url
        settings = OF_RECORDINGS if is_recording else OF_ROBOTS
        self._settings = {prefix + name: setting for name, setting in settings.items()}

    def values(self) -> Mapping[str, Value]:
        """Return all of them by name."""
        return {name: setting.read(self._slot) for name, setting in self._settings.items()}

    def change(self, name: str, value: Value) -> None:
        """Set one of them."""
        setting = self._settings[name]
        if setting.change is None:
            raise ArgumentError("it can only be read")
        setting.change(self._slot, value)
