"""What a robot's readings are called, in which units they come, and how far their gauges go."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from elib.protocol import values as v
from elib.protocol.context import Profile
from elib.protocol.image import Image
from elib.robot.snapshot import SENSORS

RING_COUNTS = 4095.0
"""Counts of an infrared sensor, and of a microphone, at most: twelve bits."""
RINGED = ("front right", "diagonal right", "right", "rear right", "rear left", "left", "diagonal left", "front left")


@dataclass(frozen=True, slots=True)
class Instrument:
    """One reading, as a person sees it.

    Attributes:
        name: Of the reading.
        title: What it is called.
        labels: Of its values, in order.
        units: Of its values, in order.
        numbers: Takes the values out of the reading; None where one is unknown.
        low: An empty gauge, or None where there is no natural one.
        high: A full gauge, or None.
        physical: Takes the same values in another unit, or None.
        physical_unit: That unit.
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
        name: Of the reading.
        title: What it is called.
        values: Label, number and unit of each value, as text; the number is ``?`` before the first reading.
        age: How old it is, as text; empty before the first.
        is_stale: It is too old to be believed.
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
        profile: Of the firmware; None before it is known.
        readings: The newest ones, by name.
        age: Returns how old one is, s.
        is_stale: Returns whether one is too old to be believed.
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
        profile: Of the firmware, whose gauges are meant; None before it is known.
    """
    name = "" if profile is None else profile.name
    known = _KNOWN.get(name)
    if known is None:
        known = _KNOWN[name] = tuple(_instrument(reading, profile) for reading in SENSORS)
    return known


_KNOWN: dict[str, tuple[Instrument, ...]] = {}


def _instrument(name: str, profile: Profile | None) -> Instrument:
    fastest = 1.0 if profile is None else profile.ranges.get("wheel_speed", (-1.0, 1.0))[1]
    zero, per_g = (2048.0, 768.0) if profile is None else (profile.acceleration_zero, profile.counts_per_g)
    wheels, axes = ("left", "right"), ("x", "y", "z")
    match name:
        case "speed":  # what was asked for last: a stop leaves it as it is (protocol.md, 5.1)
            return Instrument(name, "Wheel speed last asked for", wheels, ("rev/s",) * 2, _all, -fastest, fastest)
        case "encoders":
            return Instrument(name, "Wheel steps", wheels, ("steps",) * 2, _all)
        case "proximity":
            return Instrument(name, "Proximity", RINGED, ("counts",) * 8, _all, 0.0, RING_COUNTS)
        case "ambient_light":
            return Instrument(name, "Ambient light", RINGED, ("counts",) * 8, _all, 0.0, RING_COUNTS)
        case "accelerometer":
            # The e-puck's chips measure up to about 2 g either way.
            low, high = zero - 2 * per_g, zero + 2 * per_g
            return Instrument(name, "Accelerometer", axes, ("counts",) * 3, _all, low, high, _g, "g")
        case "attitude":
            parts = ("magnitude", "orientation", "inclination")
            return Instrument(name, "Attitude", parts, ("counts", "rad", "rad"), _all)
        case "gyroscope":
            # 250 degrees/s is as far as the chips are set to see.
            span = 250 * (131.0 if profile is None else profile.gyroscope_counts_per_degree)
            return Instrument(name, "Gyroscope", axes, ("counts",) * 3, _all, -span, span, _rad_per_s, "rad/s")
        case "magnetometer":
            return Instrument(name, "Magnetometer", axes, ("T",) * 3, _all)
        case "temperature":
            return Instrument(name, "Temperature", ("",), ("degrees C",), _field("celsius"))
        case "distance":
            return Instrument(name, "Distance ahead", ("",), ("m",), _field("metres"), 0.0, 2.0)
        case "ground":
            places = ("left", "centre", "right", "cliff left", "cliff right")
            return Instrument(name, "Ground", places, ("counts",) * 5, _present, 0.0, 1000.0)
        case "microphones":
            sides = ("right", "left", "rear", "front")
            return Instrument(name, "Microphones", sides, ("counts",) * 4, _all, 0.0, RING_COUNTS)
        case "battery":
            return Instrument(name, "Battery", ("raw", "voltage", "charge"), ("counts", "V", "%"), _battery)
        case "selector":
            return Instrument(name, "Selector", ("position",), ("",), _field("position"), 0.0, 15.0)
        case "button":
            return Instrument(name, "Button", ("pressed",), ("",), _field("pressed"), 0.0, 1.0)
        case "sd_card":
            return Instrument(name, "SD card", ("present",), ("",), _field("present"), 0.0, 1.0)
        case "ir_receiver":
            return Instrument(name, "IR receiver", ("check", "address", "key"), ("",) * 3, _all)
    fields = tuple(item.name for item in dataclasses.fields(v.Sensors))
    raise AssertionError(f"{name} is a new reading among {fields}; give it an instrument")


def _present(reading: v.Reading) -> Sequence[float | None]:
    """Return counts; a packet says -1 of a ground module that is not plugged in."""
    return [None if number is None or number < 0 else number for number in _all(reading)]


def _all(reading: v.Reading) -> Sequence[float | None]:
    return reading.numbers if isinstance(reading, v.Numbers) else ()


def _field(name: str) -> Callable[[v.Reading], Sequence[float | None]]:
    return lambda reading: (getattr(reading, name),)


def _battery(reading: v.Reading) -> Sequence[float | None]:
    if not isinstance(reading, v.Battery):
        return ()
    return reading.raw, reading.volts, None if reading.fraction is None else 100 * reading.fraction


def _g(reading: v.Reading) -> Sequence[float]:
    return reading.g if isinstance(reading, v.Acceleration) else ()


def _rad_per_s(reading: v.Reading) -> Sequence[float]:
    return reading.rad_per_s if isinstance(reading, v.AngularVelocity) else ()


__all__ = ["Instrument", "Row", "age_text", "instruments", "rows", "words"]
