"""A decoded line in words, and in types that JSON has."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Literal, TypeAlias, cast

from elib.link.protocol import values as v
from elib.link.protocol import words as readings
from elib.link.protocol.image import Image
from elib.records.decoding.lines import FAULTS, Kind, Line
from elib.records.decoding.text import is_text

Part: TypeAlias = Literal["place", "arrow", "fault", "filler"]
PAUSE = 0.3
"""s of silence after which half an answer is shown; within an answer a link pauses less (wire-protocol.md, trap 27)."""
TEXT_SHOWN, BYTES_SHOWN = 26, 8
"""The most characters of text, and bytes in hexadecimal, that are shown whole."""


def to_text(line: Line, *, robot: str = "", paint: Callable[[str, Part], str] = lambda text, _: text) -> str:
    """Return a line as text: time or offset, the robot if it is named, direction, bytes, meaning."""
    place = f"{line.offset:>10}" if line.time is None else f"{line.time:>10.4f}"
    place += f" {robot}" if robot else ""
    arrow = ">" if line.direction == "to robot" else "<"
    is_fault = line.kind in FAULTS
    shown = f"{whole(line.data) if line.kind is Kind.BYTES else shorten(line.data):<{TEXT_SHOWN}}"
    said = meaning(line)
    if line.unanswered:
        said += f"  (no answer came to {', '.join(line.unanswered)})"
    if is_fault or line.kind is Kind.FILLER:
        said = paint(said, "fault" if is_fault else "filler")
    return f"{paint(place, 'place')} {paint(arrow, 'arrow')}{'!' if is_fault else ' '}{shown}  {said}".rstrip()


def to_json(line: Line) -> dict[str, object]:
    """Return a line for JSON, without keys that have no value."""
    found: dict[str, object] = {
        "time": line.time,
        "offset": line.offset,
        "direction": line.direction,
        "kind": line.kind.value,
        "bytes": line.data.hex(" "),
    }
    if line.calls:
        found["calls"] = [
            {"name": call.name, "arguments": {each.name: each.value for each in call.arguments}} for call in line.calls
        ]
    if line.name:
        found["name"] = line.name
    if line.value is not None:
        value = line.value
        shown = cast("readings.Json", value) if isinstance(value, dict) else readings.to_json(value)
        if isinstance(value, Image) and isinstance(shown, dict):
            shown.pop("pixels")  # the bytes have them
        found["value"] = shown
    for name in ("problem", "unanswered"):
        if getattr(line, name):
            found[name] = getattr(line, name)
    return found


def whole(data: bytes) -> str:
    r"""Return text with its line ends as ``\r\n``, or bytes in hexadecimal."""
    if not is_text(data):
        return data.hex(" ")
    text = data.decode("ascii").replace("\a", "\\a").encode("unicode_escape").decode("ascii")
    return text.replace("\\\\a", "\\a").replace("\\x0c", "\\f")


def shorten(data: bytes) -> str:
    """Return the same as :func:`whole`, of long data only the beginning."""
    if len(data) > 3 and data.count(data[0]) == len(data) and not is_text(data):
        return f"{data[0]:02x} x {len(data)}"
    if is_text(data):
        text = whole(data)
        return text if len(text) <= TEXT_SHOWN else f"{text[: TEXT_SHOWN - 3]}..."
    if len(data) <= BYTES_SHOWN:
        return data.hex(" ")
    return f"{data[: BYTES_SHOWN - 4].hex(' ')} .. {len(data)} in all"


def meaning(line: Line) -> str:
    """Return the meaning of a line, in words."""
    if line.calls:
        said = " + ".join(map(str, line.calls))
    elif line.kind is Kind.ANSWER or line.value is not None:
        said = f"{line.name}: {worded(line.value)}"
    else:
        said = line.name
    if line.kind in FAULTS:
        said = " ".join(part for part in (line.kind.value, said) if part)
        return f"{said}: {line.problem}" if line.problem else said
    return "; ".join(part for part in (said, line.problem) if part)


def worded(value: object) -> str:
    """Return a value in one line, with its units."""
    match value:
        case None:
            return "done"
        case Image():
            return f"{value.width}x{value.height} {value.mode.name.lower()}, {len(value.raw)} bytes"
        case v.Version():
            return f"{value.text} ({value.firmware})"
        case v.Sensors():
            names = [item.name for item in dataclasses.fields(value) if item.name not in ("time", "origin")]
            return "; ".join(
                f"{name} {worded(getattr(value, name))}" for name in names if getattr(value, name) is not None
            )
        case str():
            return f"{len(value.splitlines())} lines"
        case dict():
            return ", ".join(f"device {address}, register 0 is {number}" for address, number in value.items())
        case v.Reading():
            return readings.in_one_line(value, is_short=True)
        case int():
            return str(value)
    rings = cast("list[list[int]]", readings.to_json(value))
    samples = [sample for ring in rings for sample in ring]
    return f"{len(rings)} x {len(rings[0])} samples from {min(samples)} to {max(samples)} counts"
