"""What a model is told: the results of tools, as data with units and as text, and the picture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, TypeAlias

from mcp_types import CallToolResult, ContentBlock, ImageContent, TextContent

from elib.base.errors import ArgumentError
from elib.base.pictures import as_png, base64_of
from elib.doors.agent.driver import OBSTACLE, Driver, Outcome
from elib.link.protocol import values as v
from elib.link.protocol.colours import Hue
from elib.link.protocol.image import Image, enlarged

PICTURE = (40, 40)
"""Columns and rows of a picture: 3,200 bytes, 0.3 s at 115,200 baud."""
ENLARGED = 8
"""Times that a picture is enlarged: 40 pixels are too few for the eyes of most models."""
WORDS = ((1000, "touching"), (OBSTACLE, "about 2 cm away"), (100, "near"))
"""Counts of an infrared sensor above those in the open, from which on a word holds; a dark thing has fewer."""
CLEAR = "clear"

Data: TypeAlias = dict[str, Any]
"""An object of JSON."""


def answer(data: Data, text: str, *, picture: bytes = b"", is_error: bool = False) -> CallToolResult:
    """Return the result of a call."""
    content: list[ContentBlock] = [TextContent(text=text)]
    if picture:
        content.append(ImageContent(data=base64_of(picture), mime_type="image/png"))
    return CallToolResult(content=content, structured_content=data, is_error=is_error)


def text_of(result: CallToolResult) -> str:
    """Return the text of a result."""
    return "".join(each.text for each in result.content if isinstance(each, TextContent))


def refused(error: ArgumentError) -> CallToolResult:
    """Return the result of a call with wrong arguments; nothing was sent."""
    text = f"{error.message}. Nothing was sent."
    text += f" Try: {error.hint}" if error.hint else ""
    return answer({"ended": "failed", "message": error.message, "hint": error.hint}, text, is_error=True)


def acted(key: str, driver: Driver, outcome: Outcome) -> CallToolResult:
    """Return the result of an action: what happened to the robot of this key, and what is seen now."""
    near = nearness(outcome.near or driver.near(driver.slot.readings.get("proximity")))
    data: Data = {
        "robot": key,
        "ended": outcome.ended,
        "message": outcome.text,
        "hint": outcome.hint,
        "stands": outcome.stands,
        "driven": round(outcome.driven, 4),
        "turned": round(outcome.turned, 1),
        "seconds": round(outcome.seconds, 2),
        "pose": pose_of(driver),
        "proximity": {name: count for name, (count, _) in near.items()},
        "nearness": {name: word for name, (_, word) in near.items()},
        "budget": budget_of(driver),
    }
    if outcome.lines:
        data["lines"] = list(outcome.lines)
    text = f"{outcome.ended}: {outcome.text}."
    if outcome.hint:
        text += f" Try: {outcome.hint}."
    if outcome.began:
        text += f" Driven {outcome.driven:.3f} m, turned {outcome.turned:.0f} degrees."
    text += f" Now at {place_of(driver)}. {seen(near)}"
    for line in outcome.lines:
        text += f"\n{line}"
    return answer(data, text, is_error=outcome.is_error)


def budget_of(driver: Driver) -> Data:
    """Return what is left of the agent's budget."""
    return {"calls": driver.budget.calls, "seconds": round(driver.budget.seconds, 1)}


def pose_of(driver: Driver) -> Data:
    """Return where a robot is: m and degrees."""
    pose = driver.pose
    found: Data = {
        "x": round(pose.x, 4),
        "y": round(pose.y, 4),
        "heading": round(math.degrees(pose.heading), 1),
    }
    if pose.is_uncertain:
        found |= {
            "wrong_by": round(pose.uncertainty, 2),
            "heading_wrong_by": round(math.degrees(pose.heading_uncertainty)),
        }
    return found


def place_of(driver: Driver) -> str:
    """Return where a robot is, as text."""
    pose = driver.pose
    return f"x {pose.x:.3f} m, y {pose.y:.3f} m, heading {math.degrees(pose.heading):.0f} degrees"


def nearness(near: v.Proximity | None) -> dict[str, tuple[int, str]]:
    """Return counts and a word for each infrared sensor; empty where nothing was read."""
    if near is None:
        return {}
    found = {}
    for name in v.describe(v.Proximity, v.Role.NUMBER):
        count = getattr(near, name.name)
        found[name.name] = count, next((word for least, word in WORDS if count >= least), CLEAR)
    return found


def seen(near: Mapping[str, tuple[int, str]]) -> str:
    """Return what the infrared sensors see, as text."""
    if not near:
        return "The infrared sensors were not read."
    close = [f"{v.in_words(name)} {word} ({count})" for name, (count, word) in near.items() if word != CLEAR]
    return f"Infrared: {', '.join(close)}." if close else "Infrared: nothing is near."


def spoken(reading: v.Reading) -> tuple[Data, Data, str]:
    """Return the values of a reading by name, their units by name, and both as text."""
    values: Data = {}
    units: Data = {}
    said = []
    for info, name, number in v.items(reading, v.Role.NUMBER, v.Role.CONVERTED):
        value: object
        if number is None or isinstance(number, bool | int | str):
            value = number
        elif isinstance(number, float) and math.isfinite(number):
            value = round(number, 6)
        else:
            value = None if isinstance(number, float) else str(number)
        values[name] = value
        if info.unit:
            units[name] = info.unit
        said.append(f"{v.in_words(name)} {value} {info.unit}".rstrip())
    return values, units, ", ".join(said)


def colours(picture: Image) -> dict[str, tuple[float, float]]:
    """Return of each colour in a picture the direction of its largest area, degrees, and the share of the width."""
    found = {}
    for hue in Hue:
        blob = picture.find(hue.name)
        if blob is not None:
            direction = math.degrees(picture.bearing((blob.left + blob.right) / 2))
            found[hue.name.lower()] = (round(direction, 1), (blob.right + 1 - blob.left) / picture.width)
    return found


def png(picture: Image) -> bytes:
    """Return a picture as PNG, enlarged if it is small."""
    return as_png(enlarged(picture, ENLARGED if picture.width <= 2 * PICTURE[0] else 1))
