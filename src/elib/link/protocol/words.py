"""Answers in words: readings and other values as text for a person, and in types that JSON has for a program."""

from __future__ import annotations

import dataclasses
import math
import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING, TypeAlias, cast

from elib.link.protocol import values as v
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.values import FieldInfo, Role, describe, items, physical_of

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

Json: TypeAlias = "bool | int | float | str | list[Json] | dict[str, Json] | None"

SHOWN = (Role.NUMBER, Role.CONVERTED)
"""Fields that are printed: what the robot sent, and the same in other units."""

FEW = 4
"""The most numbers that keep their names on a short line."""

SAMPLED = describe(v.Microphones, Role.NUMBER)[0].names
"""The microphones of ``microphone_samples``, in the order of its rows; the front one is not among them
(e-puck.md, 7)."""


def to_json(value: object) -> Json:
    """Return *value* in types that JSON has.

    A record becomes an object, a reading one without time and origin; an array becomes nested lists, a number that is
    not finite null, and what has no other form its text.
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
            shown = describe(type(value), *SHOWN, Role.PHYSICAL)
            return {info.name: to_json(getattr(value, info.name)) for info in shown}
        case list():
            return [to_json(item) for item in value]
        case tuple() if type(value).__str__ is tuple.__str__:  # a colour has a text of its own
            return [to_json(item) for item in value]
        case dict():
            return {str(name): to_json(item) for name, item in value.items()}
    if dataclasses.is_dataclass(value):
        return {field.name: to_json(getattr(value, field.name)) for field in dataclasses.fields(value)}
    return to_json(value.tolist()) if hasattr(value, "tolist") else str(value)


def to_text(value: object, width: int) -> str:
    """Return *value* as text, in lines of at most *width* columns; empty for None."""
    match value:
        case None:
            return ""
        case str() | int() | float():
            return str(value)
        case Image():
            return f"{value.width} x {value.height} pixels, {value.mode.name}, {len(value.raw)} bytes"
        case v.Sensors():
            return "\n".join(_line(name, reading, width) for _, name, reading in items(value, Role.NUMBER))
        case v.Reading():
            return _aligned(list(_rows(value)))
        case list():
            return "\n".join(f"0x{item:02x} ({item})" for item in value) or "none"
    return "\n".join(_samples(cast("NDArray[numpy.int16]", value), width))


def _rows(value: v.Reading) -> Iterator[tuple[str, str, str]]:
    """Yield name, number and unit of each number of *value*."""
    physical = physical_of(type(value))
    also = iter(getattr(value, physical.name)) if physical is not None else None
    for info, name, number in items(value, *SHOWN):
        unit = info.unit
        if isinstance(value, v.CameraSettings) and name == "mode" and value.mode in set(CameraMode):
            unit = CameraMode(value.mode).name
        if physical is not None and also is not None:
            unit = f"{unit:<8}{next(also):8.3f} {physical.unit}"
        yield name, in_digits(number), "" if number is None else unit


def shared_unit(kind: type[v.Reading]) -> str:
    """Return the unit of the numbers of a reading; empty if they have none, or several."""
    units = {info.unit for info in describe(kind, *SHOWN)}
    return units.pop() if len(units) == 1 else ""


def in_best_unit(value: v.Reading) -> list[tuple[str, float, FieldInfo]]:
    """Return the numbers of a reading in the most useful unit, each with its label and its field."""
    physical = physical_of(type(value))
    if physical is not None:
        return [
            (v.in_words(name), number, physical)
            for name, number in zip(physical.names, getattr(value, physical.name), strict=True)
        ]
    return [
        (info.words if name == info.name else v.in_words(name), number, info)
        for info, name, number in items(value, Role.NUMBER)
        if isinstance(number, int | float)
    ]


def in_digits(value: object, digits: int = 6) -> str:
    """Return a number, a truth value or None as text."""
    match value:
        case None:
            return "unknown"
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:.{digits}g}"
    return str(value)


def _aligned(rows: list[tuple[str, str, str]]) -> str:
    label = max((len(name) for name, _, _ in rows), default=0)
    numbers = [number for _, number, _ in rows if number.lstrip("-")[:1].isdigit()]
    room = max((len(number) for number in numbers), default=0)
    return "\n".join(f"{name:<{label}}  {number:>{room}} {unit}".rstrip() for name, number, unit in rows)


def _line(name: str, value: object, width: int) -> str:
    """Return one reading on one line with its label; a long line is wrapped and indented."""
    margin = 17
    text = in_one_line(value) if isinstance(value, v.Reading) else "-"
    return textwrap.fill(text, width, initial_indent=f"{name:<{margin}}", subsequent_indent=" " * margin)


def in_one_line(value: v.Reading, *, is_short: bool = False) -> str:
    """Return a reading on one line, with its units; if it is to be short, many numbers stand without their names."""
    unit, digits = shared_unit(type(value)), 4 if is_short else 6
    rows = [
        (name, in_digits(number, digits), "" if unit or number is None else info.unit)
        for info, name, number in items(value, *SHOWN)
    ]
    if is_short and unit and len(rows) > FEW:
        text = " ".join(number for _, number, _ in rows)
    else:
        text = ", ".join(" ".join(filter(None, row)) for row in rows)
    text = f"{text} {unit}".rstrip()
    physical = physical_of(type(value))
    if physical is None:
        return text
    converted = " ".join(f"{number:.4g}" for number in getattr(value, physical.name))
    return f"{text} ({converted} {physical.unit})"


def _samples(rings: NDArray[numpy.int16], width: int) -> Iterator[str]:
    for label, ring in zip(SAMPLED, rings, strict=False):
        numbers = [int(sample) for sample in ring]
        yield f"{label}: {len(numbers)} samples from {min(numbers)} to {max(numbers)} counts"
        yield textwrap.fill(" ".join(map(str, numbers)), width, initial_indent="  ", subsequent_indent="  ")
