"""The names, units and ranges of a robot's readings, as a person sees them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import cast

from elib.protocol import values as v
from elib.protocol.context import Profile
from elib.protocol.image import Image
from elib.robot.snapshot import SENSORS


@dataclass(frozen=True, slots=True)
class Instrument:
    """One reading, as a person sees it.

    Attributes:
        name: Name of the reading.
        title: Title for a person.
        labels: Names of its values, in order.
        units: Units of its values, in order.
        numbers: Returns the values of a reading; None where one is unknown.
        low: Value of an empty gauge, or None where there is no natural one.
        high: Value of a full gauge, or None.
        physical: Returns the same values in a physical unit, or None.
        physical_unit: The physical unit.
    """

    name: str
    title: str
    labels: tuple[str, ...]
    units: tuple[str, ...]
    numbers: Callable[[v.Reading], Sequence[float | None]]
    low: float | None = None
    high: float | None = None
    physical: Callable[[v.Reading], Sequence[float]] | None = None
    physical_unit: str = ""


@dataclass(frozen=True, slots=True)
class Row:
    """One reading in words, for a table or a screen reader.

    Attributes:
        name: Name of the reading.
        title: Title for a person.
        values: Label, number and unit of each value, as text; the number is ``?`` before the first reading.
        age: How old the reading is, as text; empty before the first one.
        is_stale: Whether the reading is too old to be trusted.
    """

    name: str
    title: str
    values: tuple[tuple[str, str, str], ...]
    age: str
    is_stale: bool


def rows(
    profile: Profile | None,
    readings: Mapping[str, v.Reading | Image],
    age: Callable[[str], float],
    is_stale: Callable[[str], bool],
) -> list[Row]:
    """Return every reading that a robot can have, in words, in the order of :class:`elib.Sensors`.

    Args:
        profile: Profile of the firmware; None before it is known.
        readings: The newest readings, by name.
        age: Returns how old a reading is, s.
        is_stale: Returns whether a reading is too old to be trusted.
    """
    absent: Mapping[str, str] = {} if profile is None else profile.absent
    return [
        Row(each.name, each.title, words(each, readings.get(each.name)), age_text(age(each.name)), is_stale(each.name))
        for each in instruments(profile)
        if each.name not in absent
    ]


def words(instrument: Instrument, reading: object) -> tuple[tuple[str, str, str], ...]:
    """Return label, number and unit of each value of a reading; ``?`` for a number that is not known."""
    numbers: Sequence[float | None] = [None] * len(instrument.labels)
    if isinstance(reading, v.Reading):
        numbers = instrument.numbers(reading)
    return tuple(
        (label, _number(number), unit)
        for label, number, unit in zip(instrument.labels, numbers, instrument.units, strict=False)
    )


def _number(value: float | None) -> str:
    if value is None:
        return "?"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value) if isinstance(value, int) else f"{value:.4g}"


def age_text(age: float) -> str:
    """Return an age, s, in words; empty where it is infinite."""
    if not math.isfinite(age):
        return ""
    return f"{1000 * age:.0f} ms" if age < 1 else f"{age:.1f} s" if age < 60 else f"{age / 60:.0f} min"


def instruments(profile: Profile | None) -> tuple[Instrument, ...]:
    """Return all readings but the picture, in the order of :class:`elib.Sensors`.

    Args:
        profile: Profile of the firmware, which decides the ranges; None before it is known.
    """
    name = "" if profile is None else profile.name
    known = _KNOWN.get(name)
    if known is None:
        known = _KNOWN[name] = tuple(_instrument(reading, profile) for reading in SENSORS)
    return known


_KNOWN: dict[str, tuple[Instrument, ...]] = {}


def _instrument(name: str, profile: Profile | None) -> Instrument:
    kind = v.READING_TYPES[name]
    title = next(info.words for info in v.describe(v.Sensors) if info.name == name)
    title = title[:1].upper() + title[1:]
    if kind is v.Battery:
        return Instrument(name, title, ("raw", "voltage", "charge"), ("counts", "V", "%"), _battery)
    fields = v.describe(kind, v.Role.NUMBER)
    labels = tuple(label for info in fields for label in (map(v.in_words, info.names) if info.names else (info.words,)))
    units = tuple(info.unit for info in fields for _ in info.names or (info.name,))
    low, high = _range(name, fields[0], profile)
    physical = v.physical_of(kind)
    if physical is None:
        return Instrument(name, title, labels, units, _numbers, low, high)
    return Instrument(name, title, labels, units, _numbers, low, high, attrgetter(physical.name), physical.unit)


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


def _numbers(reading: v.Reading) -> Sequence[float | None]:
    """Return the numbers; a packet has -1 for a ground module that is not plugged in."""
    if isinstance(reading, v.Counts):
        return [None if count < 0 else count for count in reading.counts]
    return [cast("float | None", number) for _, _, number in v.items(reading, v.Role.NUMBER)]


def _battery(reading: v.Reading) -> Sequence[float | None]:
    if not isinstance(reading, v.Battery):
        return ()
    return reading.raw, reading.volts, None if reading.fraction is None else 100 * reading.fraction


__all__ = ["Instrument", "Row", "age_text", "instruments", "rows", "words"]
