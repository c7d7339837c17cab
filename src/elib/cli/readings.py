"""What a command returned, for a person and for a program."""

from __future__ import annotations

import dataclasses
import math
import textwrap
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, TypeAlias, cast

from elib.protocol import values as v
from elib.protocol.image import Image
from elib.protocol.quantities import CameraMode

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

Json: TypeAlias = "bool | int | float | str | list[Json] | dict[str, Json] | None"

UNITS: Mapping[type, str] = {
    v.Wheels: "rev/s",
    v.Steps: "steps",
    v.Proximity: "counts",
    v.AmbientLight: "counts",
    v.Acceleration: "counts",
    v.AngularVelocity: "counts",
    v.MagneticField: "T",
    v.Ground: "counts",
    v.Microphones: "counts",
}
"""Unit of all numbers of a value, where they share one."""

FIELD_UNITS: Mapping[tuple[type, str], str] = {
    (v.Attitude, "magnitude"): "counts",
    (v.Attitude, "orientation"): "rad",
    (v.Attitude, "inclination"): "rad",
    (v.Temperature, "celsius"): "degrees C",
    (v.Distance, "metres"): "m",
    (v.Battery, "raw"): "counts",
    (v.Battery, "volts"): "V",
    (v.CameraSettings, "width"): "pixels",
    (v.CameraSettings, "height"): "pixels",
    (v.CameraSettings, "zoom"): "sensor pixels a pixel",
    (v.CameraSettings, "size"): "bytes",
}
"""Unit of single fields."""

CONVERTED: Mapping[type, tuple[str, str]] = {v.Acceleration: ("g", "g"), v.AngularVelocity: ("rad_per_s", "rad/s")}
"""Property with the same numbers in a physical unit, and that unit."""

LABELS: Mapping[type, tuple[str, ...]] = {
    v.Ground: ("left", "centre", "right", "cliff_left", "cliff_right"),
    v.Microphones: ("right", "left", "rear", "front"),
}
"""Names of the counts of a value whose length depends on the firmware, in the order of the wire."""

SAMPLED = ("right", "left", "rear")
"""The microphones of ``microphone_samples``, in the order of its rows (robot-model, 2.7)."""


def to_json(value: object) -> Json:
    """Return *value* as JSON can hold it.

    A value with named fields becomes an object of them, without time and origin; an array becomes nested lists;
    nothing, and what is not a number, become null.
    """
    match value:
        case None | bool() | str():
            return value
        case int():
            return int(value)
        case float():
            return value if math.isfinite(value) else None
        case Image():
            return {
                "mode": value.mode.name,
                "width": value.width,
                "height": value.height,
                "pixels": to_json(value.pixels) if value.mode != CameraMode.YUV else None,
            }
        case v.Counts():
            return list(value.counts)
        case v.Reading():
            shown: dict[str, Json] = {name: to_json(getattr(value, name)) for name in _names(value)}
            if type(value) in CONVERTED:
                name, _ = CONVERTED[type(value)]
                shown[name] = to_json(getattr(value, name))
            return shown
        case list() | tuple():
            return [to_json(item) for item in value]
    return to_json(cast("NDArray[numpy.int16]", value).tolist())


def to_text(value: object, width: int) -> str:
    """Return *value* for a person, in lines of at most *width* columns; empty if there is nothing to say."""
    match value:
        case None:
            return ""
        case str() | int() | float():
            return str(value)
        case Image():
            return f"{value.width} x {value.height} pixels, {value.mode.name}, {len(value.raw)} bytes"
        case v.Sensors():
            return "\n".join(_line(name, getattr(value, name), width) for name in _names(value))
        case v.Reading():
            return _aligned(list(_rows(value)))
        case list():
            return "\n".join(f"0x{item:02x} ({item})" for item in value) or "none"
    return "\n".join(_samples(cast("NDArray[numpy.int16]", value), width))


def _names(value: v.Reading) -> list[str]:
    """Return the fields that the robot sent: neither time and origin nor what converts."""
    is_all_named = isinstance(value, v.Sensors)
    return [
        item.name
        for item in dataclasses.fields(value)
        if (is_all_named or not item.kw_only) and item.name not in ("time", "origin")
    ]


def _rows(value: v.Reading) -> Iterator[tuple[str, str, str]]:
    """Return name, number and unit of each part of *value*."""
    kind = type(value)
    if isinstance(value, v.Counts):
        labels = [*LABELS[kind], *map(str, range(len(LABELS[kind]), len(value.counts)))]
        for label, count in zip(labels, value.counts, strict=False):
            yield label, str(count), UNITS[kind]
        return
    converted, unit = CONVERTED.get(kind, ("", ""))
    also = iter(getattr(value, converted)) if converted else None
    for name in _names(value):
        number = getattr(value, name)
        shown = FIELD_UNITS.get((kind, name), UNITS.get(kind, ""))
        if isinstance(value, v.CameraSettings) and name == "mode" and number in set(CameraMode):
            shown = CameraMode(number).name
        if also is not None:
            shown = f"{shown:<8}{next(also):8.3f} {unit}"
        yield name, _number(number), "" if number is None else shown


def _number(value: object) -> str:
    match value:
        case None:
            return "unknown"
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:.6g}"
    return str(value)


def _aligned(rows: list[tuple[str, str, str]]) -> str:
    label = max((len(name) for name, _, _ in rows), default=0)
    numbers = [number for _, number, _ in rows if number.lstrip("-")[:1].isdigit()]
    room = max((len(number) for number in numbers), default=0)
    return "\n".join(f"{name:<{label}}  {number:>{room}} {unit}".rstrip() for name, number, unit in rows)


def _line(name: str, value: v.Reading | None, width: int) -> str:
    """Return one reading on one line, labelled; wrapped under itself if it is long."""
    margin = 17
    if value is None:
        return f"{name:<{margin}}-"
    rows = list(_rows(value))
    unit = UNITS.get(type(value), "")
    parts = [f"{label} {number}" if unit else f"{label} {number} {own}".rstrip() for label, number, own in rows]
    text = ", ".join(parts) + (f" {unit}" if unit else "")
    return textwrap.fill(text, width, initial_indent=f"{name:<{margin}}", subsequent_indent=" " * margin)


def _samples(rings: NDArray[numpy.int16], width: int) -> Iterator[str]:
    for label, ring in zip(SAMPLED, rings, strict=False):
        numbers = [int(sample) for sample in ring]
        yield f"{label}: {len(numbers)} samples from {min(numbers)} to {max(numbers)} counts"
        yield textwrap.fill(" ".join(map(str, numbers)), width, initial_indent="  ", subsequent_indent="  ")
