"""What the panel tells a page of a robot: every number with its name, unit and age, as plain data.

A page gets :func:`scheme` whenever :attr:`Slot.edition` is new to it, and :func:`tick` ten times a second.
``static/hub.js`` describes their fields: Scheme, Tick and Summary. Both are JSON without nan and infinity; a value that
is not known is null. Text in them comes from outside (names of robots, comments in logs, errors): a page must show it
as text, never as HTML.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import islice
from typing import TypeAlias, TypeVar

from elib.base.body import STEPS_PER_REVOLUTION, WHEEL_CIRCUMFERENCE
from elib.base.errors import ElibError
from elib.link.protocol import values as v
from elib.link.protocol.image import Image
from elib.link.protocol.profiles import FIRMWARES
from elib.link.protocol.quantities import CameraMode
from elib.panel.events import Line
from elib.panel.gauges import instruments, numbers, physical
from elib.panel.slot import Phase, Slot
from elib.robot.snapshot import IMAGE

Json: TypeAlias = "bool | int | float | str | list[Json] | dict[str, Json] | None"
T = TypeVar("T")

MAX_POINTS = 500
"""Points of the trail, and lines of the event log, in one tick: a tick stays small, however much a page has missed."""
MAX_TEXT = 2000
"""Characters of one line of the event log."""


@dataclass(slots=True)
class Cursor:
    """How much one page has seen; :func:`tick` updates it. A page that shows another robot needs a new one.

    Attributes:
        trail: Points of the trail, of all that there ever were.
        lines: Lines of the event log, likewise.
        picture: Time of the picture, s.
    """

    trail: int = 0
    lines: int = 0
    picture: float = math.nan


def scheme(slot: Slot) -> dict[str, Json]:
    """Return what a page must know once."""
    profile = FIRMWARES.get(slot.firmware)
    return {
        "scheme": slot.edition,
        "firmware": slot.firmware,
        "fastest": slot.drive.fastest,
        "circumference": WHEEL_CIRCUMFERENCE,
        "status_led": None if profile is None else profile.status_led,
        "instruments": [
            asdict(each) | {"absent": "" if profile is None else profile.absent.get(each.name, "")}
            for each in instruments(profile)
        ],
    }


def tick(slot: Slot, cursor: Cursor | None = None) -> dict[str, Json]:
    """Return what changes ten times a second.

    Args:
        slot: The robot.
        cursor: What this page has seen of trail, event log and pictures; moved on. Without one all counts as new.
    """
    cursor = Cursor() if cursor is None else cursor
    drive = slot.drive
    left, right = _wheels(slot)
    return {
        "time": _finite(slot.now, 3),
        "phase": slot.phase.name.lower(),
        "phase_text": slot.phase.value,
        "error": _error(slot.error),
        "doctor": _doctor(slot),
        "drive": {
            "driver": drive.driver,
            "left": _finite(left),
            "right": _finite(right),
            "limit": _finite(drive.limit),
            "may_move": drive.may_move,
            "trouble": drive.trouble,
        },
        "readings": _readings(slot),
        "lamps": _lamps(slot),
        "camera": _camera(slot),
        "picture": _picture(slot, cursor),
        "distances": _distances(slot),
        "pose": _pose(slot),
        "trail": _trail(slot, cursor),
        "lines": _lines(slot, cursor),
        "link": _link(slot),
        "log": slot.records.armed_log or (None if slot.records.log is None else slot.records.log.target),
        "recorder": _recorder(slot),
        "playback": _playback(slot),
        "live": slot.watcher.pictures,
    }


def summary(slot: Slot) -> dict[str, Json]:
    """Return the part of a tick that an overview of many robots draws, a few hundred bytes."""
    battery = slot.readings.get("battery")
    statistics = slot.statistics
    return {
        "url": slot.url,
        "phase": slot.phase.name.lower(),
        "phase_text": slot.phase.value,
        "error": None if slot.error is None else slot.error.message,
        "may_move": slot.drive.may_move,
        "driver": slot.drive.driver,
        "behaviour": slot.runner.name if slot.runner.is_active else "",
        "pose": _pose(slot),
        "distances": _distances(slot),
        "battery": battery.fraction if isinstance(battery, v.Battery) else None,
        "stale": slot.is_stale("proximity"),
        "median": None if statistics is None else _finite(statistics.median),
    }


def _finite(value: float | None, digits: int = 5) -> float | None:
    """Return *value* rounded, as JSON can hold it: null for a value that is not known."""
    if value is None or isinstance(value, int):
        return value
    return round(value, digits) if math.isfinite(value) else None


def _small(value: float | None) -> float | None:
    """Return *value* with six significant digits: a magnetic field is some 0.00002 T."""
    if value is None or isinstance(value, int):
        return value
    return float(f"{value:.6g}") if math.isfinite(value) else None


def _readings(slot: Slot) -> dict[str, Json]:
    profile = FIRMWARES.get(slot.firmware)
    absent: Mapping[str, str] = {} if profile is None else profile.absent
    found: dict[str, Json] = {}
    for each in instruments(profile):
        if each.name in absent:
            continue
        reading = slot.readings.get(each.name)
        if not isinstance(reading, v.Reading):
            found[each.name] = {"values": None, "physical": None, "age": None, "stale": True}
            continue
        found[each.name] = {
            "values": [_small(number) for number in numbers(reading)],
            "physical": [_small(number) for number in physical(reading)] if each.physical_unit else None,
            "age": _finite(slot.watcher.age(each.name), 3),
            "stale": slot.is_stale(each.name),
        }
    return found


def _distances(slot: Slot) -> list[Json]:
    """Return how far the infrared sensors see, m; null where nothing is."""
    return [_finite(metres, 4) for metres in slot.watcher.distances]


def _pose(slot: Slot) -> Json:
    pose = slot.watcher.trail[-1] if slot.watcher.trail else None
    return None if pose is None else [_finite(pose.x), _finite(pose.y), _finite(pose.heading)]


def _error(error: ElibError | None) -> Json:
    return None if error is None else {"message": error.message, "hint": error.hint or ""}


def _doctor(slot: Slot) -> Json:
    if slot.diagnosis is None:
        return None
    steps: list[Json] = [
        {"name": step.name, "state": step.state, "detail": step.detail, "fix": step.fix}
        for step in slot.diagnosis.steps
    ]
    return {"steps": steps}


def _wheels(slot: Slot) -> tuple[float, float]:
    """Return the speeds of the wheels as set, rev/s: by the stick, otherwise by a behaviour or the console."""
    target = slot.drive.target
    may_move = slot.drive.may_move or slot.phase is Phase.PLAYING
    if any(target) or slot.context is None or not may_move:
        return target
    left, right = slot.context.last_set.speed
    return left / STEPS_PER_REVOLUTION, right / STEPS_PER_REVOLUTION


def _lamps(slot: Slot) -> Json:
    context = slot.context
    if context is None:
        return {"ring": [0] * 8, "body": 0, "front": 0, "rgb": None}
    lamps, rgb = context.last_set.lamps, context.last_set.rgb
    has_rgb = "set_rgb_led" not in context.profile.absent
    colours: list[Json] = [list(rgb[3 * index : 3 * index + 3]) for index in range(4)]
    return {"ring": list(lamps[:8]), "body": lamps[8], "front": lamps[9], "rgb": colours if has_rgb else None}


def _camera(slot: Slot) -> Json:
    camera = None if slot.context is None else slot.context.last_set.camera
    if camera is None:
        return None
    mode = CameraMode(camera.mode).name if camera.mode in set(CameraMode) else str(camera.mode)
    return {"width": camera.width, "height": camera.height, "zoom": camera.zoom, "mode": mode}


def _picture(slot: Slot, cursor: Cursor) -> Json:
    image = slot.readings.get(IMAGE)
    if not isinstance(image, Image) or image.mode == CameraMode.YUV:
        return None
    is_new = image.time != cursor.picture
    cursor.picture = image.time
    return {
        "width": image.width,
        "height": image.height,
        "mode": image.mode.name,
        "age": _finite(slot.watcher.age(IMAGE), 3),
        "stale": slot.is_stale(IMAGE),
        "pixels": base64.b64encode(image.pixels.tobytes()).decode("ascii") if is_new else None,
    }


def _behind(kept: Sequence[T], count: int, seen: int) -> tuple[bool, list[T], int]:
    """Return whether a page must begin again, what is new to it, and how much it has then seen.

    Args:
        kept: The newest of all that there ever were.
        count: How many there ever were.
        seen: How many of those the page has seen.
    """
    first = count - len(kept)
    is_whole = seen < first or seen > count or seen == 0
    begin = first if is_whole else seen
    end = min(count, begin + MAX_POINTS)
    return is_whole, list(islice(kept, begin - first, end - first)) if end > begin else [], end


def _trail(slot: Slot, cursor: Cursor) -> Json:
    if cursor.trail < slot.watcher.trail_began:
        cursor.trail = 0
    is_whole, poses, cursor.trail = _behind(slot.watcher.trail, slot.watcher.trail_count, cursor.trail)
    points: list[Json] = [[round(pose.x, 4), round(pose.y, 4)] for pose in poses]
    return {"whole": is_whole, "points": points}


def _lines(slot: Slot, cursor: Cursor) -> Json:
    is_whole, lines, cursor.lines = _behind(slot.log.lines, slot.log.count, cursor.lines)
    number = cursor.lines - len(lines)
    shown: list[Json] = [_line(line, number + index) for index, line in enumerate(lines)]
    return {"whole": is_whole, "lines": shown}


def _line(line: Line, number: int) -> Json:
    text = line.text if len(line.text) <= MAX_TEXT else line.text[:MAX_TEXT] + " …"
    return {"number": number, "time": _finite(line.time, 3), "kind": line.kind, "text": text, "bad": line.is_bad}


def _link(slot: Slot) -> Json:
    health = slot.statistics
    if health is None:
        return None
    sent = health.count + health.lost + health.refused
    return {
        "median": _finite(health.median),
        "p99": _finite(health.p99),
        "count": health.count,
        "lost": health.lost,
        "refused": health.refused,
        "unsent": health.unsent,
        "resyncs": health.resyncs,
        "resets": health.resets,
        "loss": _finite(health.lost / sent) if sent else None,
        "age": _finite(health.age, 3) if slot.phase in (Phase.CONNECTED, Phase.GAP) else None,
        "waiting": slot.robot.session.waiting,
    }


def _playback(slot: Slot) -> Json:
    if not slot.is_playing:
        return None
    playback = slot.playback
    return {"at": _finite(playback.at, 2), "length": _finite(playback.length, 2), "paused": playback.is_paused}


def _recorder(slot: Slot) -> Json:
    recorder = slot.records.recorder
    if recorder is None:
        armed = slot.records.armed_recording
        return {"path": armed, "bytes": 0, "messages": 0} if armed else None
    return {"path": str(recorder.path), "bytes": recorder.size, "messages": recorder.messages}
