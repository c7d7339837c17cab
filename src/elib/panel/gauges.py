"""The names, units and ranges of a robot's readings, as a person sees them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import cast

from msgspec import Struct

from elib.link.protocol import values as v
from elib.link.protocol.context import Profile
from elib.link.protocol.profiles import FIRMWARES
from elib.robot.snapshot import SENSORS


class Instrument(Struct, frozen=True):
    """One reading, as a person sees it."""

    name: str
    title: str  # title for a person
    labels: tuple[str, ...]  # names of its values, in order
    units: tuple[str, ...]  # units of its values, in order
    low: float | None = None  # value of an empty gauge, or None where there is no natural one
    high: float | None = None  # value of a full gauge, or None
    physical_unit: str = ""  # unit of physical; empty where the readings have no such values
    absent: str = ""  # why the firmware does not have the reading; empty if it has


@cache
def instruments(firmware: str = "") -> tuple[Instrument, ...]:
    """Return all readings but the picture, in the order of :class:`elib.Sensors`.

    The firmware decides the ranges; it is empty before it is known.
    """
    return tuple(_instrument(reading, FIRMWARES.get(firmware)) for reading in SENSORS)


def _instrument(name: str, profile: Profile | None) -> Instrument:
    kind = v.READING_TYPES[name]
    absent = "" if profile is None else profile.absent.get(name, "")
    title = next(info.words for info in v.describe(v.Sensors) if info.name == name)
    title = "Tilt" if kind is v.Attitude else title[:1].upper() + title[1:]
    if kind is v.Battery:
        return Instrument(name, title, ("raw", "voltage", "charge"), ("counts", "V", "%"), absent=absent)
    fields = v.describe(kind, v.Role.NUMBER)
    labels = tuple(label for info in fields for label in (map(v.in_words, info.names) if info.names else (info.words,)))
    units = tuple(info.unit for info in fields for _ in info.names or (info.name,))
    low, high = _range(name, fields[0], profile)
    converted = v.physical_of(kind)
    return Instrument(name, title, labels, units, low, high, "" if converted is None else converted.unit, absent)


def _range(name: str, info: v.FieldInfo, profile: Profile | None) -> tuple[float | None, float | None]:
    """Return the ends of a gauge; some firmwares have a wider range than others."""
    match name:
        case "speed":
            return (-1.0, 1.0) if profile is None else profile.ranges.get("wheel_speed", (-1.0, 1.0))
        case "accelerometer":  # the chips of the e-puck measure up to about 2 g either way
            zero, per_g = (2048.0, 768.0) if profile is None else (profile.acceleration_zero, profile.counts_per_g)
            return zero - 2 * per_g, zero + 2 * per_g
        case "gyroscope":  # the chips are set to measure up to 250 degrees/s
            span = 250 * (131.0 if profile is None else profile.gyroscope_counts_per_degree)
            return -span, span
    return info.low, info.high


def numbers(reading: v.Reading) -> Sequence[float | None]:
    """Return the values of a reading; None where one is unknown."""
    match reading:
        case v.Counts():  # a packet has -1 for a ground module that is not plugged in
            return [None if count < 0 else count for count in reading.counts]
        case v.Battery():
            return reading.raw, reading.volts, None if reading.fraction is None else 100 * reading.fraction
    return [cast("float | None", number) for _, _, number in v.items(reading, v.Role.NUMBER)]


def physical(reading: v.Reading) -> Sequence[float]:
    """Return the same values in a physical unit; none for a reading that does not have it."""
    info = v.physical_of(type(reading))
    return () if info is None else cast("Sequence[float]", getattr(reading, info.name))
