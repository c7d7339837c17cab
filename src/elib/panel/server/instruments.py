"""What the panel tells a page of a robot: every number with its name, unit and age.

A page gets a :class:`Scheme` whenever :attr:`Slot.edition` is new to it, and a :class:`Tick` ten times a second. What
is not known is null. Text in them comes from outside (names of robots, comments in logs, errors): a page must show
it as text, never as HTML.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Annotated, Literal, TypeVar

import msgspec
from msgspec import Meta, Struct

from elib.base.body import STEPS_PER_REVOLUTION, WHEEL_CIRCUMFERENCE
from elib.link.protocol import values as v
from elib.link.protocol.image import Image
from elib.link.protocol.profiles import FIRMWARES
from elib.link.protocol.quantities import RGB_LEDS, CameraMode
from elib.link.transport.ports import BAUD
from elib.panel import lifecycle
from elib.panel.events import Line
from elib.panel.gauges import Instrument, instruments, numbers, physical
from elib.panel.server.conversation import Trouble
from elib.panel.slot import Phase, Slot
from elib.panel.watching import MAX_MISSED
from elib.robot.snapshot import IMAGE

if TYPE_CHECKING:
    from elib.maps.grid import Grid

T = TypeVar("T")

MAX_POINTS = 500
"""Points of the trail, and lines of the event log, in one tick: a tick stays small, however much a page has missed."""

Pose = tuple[float, float, float]
"""Place and heading, m and rad."""
PhaseName = Annotated[str, Meta(extra_json_schema={"enum": [each.name.lower() for each in Phase]})]


class CameraLimits(Struct):
    """What pictures a camera can take, and how long one holds the line."""

    zooms: tuple[int, ...] | None  # the zoom factors that work; None if every factor works whose window fits
    capture: float = lifecycle.CAPTURE_TIME  # s until the first byte
    byte: float = lifecycle.BITS_PER_BYTE / BAUD  # s for each byte


class Scheme(Struct):
    """What seldom changes of a robot."""

    scheme: int
    firmware: str
    fastest: float  # rev/s of its fastest wheel
    circumference: float  # m that a wheel rolls in one turn
    instruments: tuple[Instrument, ...]
    camera: CameraLimits | None = None  # what can be set of the camera; None for nothing
    coloured: list[int] = []  # the LEDs whose colour can be set
    sounds: tuple[str, ...] = ()  # what sounds 1, 2 and so on are called


class DiagnosedStep(Struct):
    """What the doctor found in one step, and what to do."""

    name: str
    state: Literal["ok", "warning", "failed", "skipped"]
    detail: str
    fix: str


class Drive(Struct):
    """Who drives, how fast (rev/s), how fast it may be at most, and whether the robot may move."""

    driver: str
    left: float | None
    right: float | None
    limit: float
    may_move: bool
    trouble: str


class Reading(Struct):
    """The numbers of a reading as its instrument names them, and the same in a physical unit if it has one."""

    values: list[float | bool | None] | None = None
    physical: list[float | None] | None = None
    age: float | None = None
    stale: bool = True


class Lamps(Struct):
    """Which LEDs are on; the colours, in %, of an e-puck2."""

    ring: list[int]
    body: int
    front: int
    rgb: list[list[int]] | None


class CameraSettings(Struct):
    """How the camera is set."""

    width: int
    height: int
    zoom: int
    mode: str


class Picture(Struct):
    """The newest picture; its pixels only if the page does not have them yet."""

    width: int
    height: int
    mode: Annotated[str, Meta(extra_json_schema={"enum": ["GREY", "COLOUR"]})]
    age: float | None
    stale: bool
    pixels: bytes | None


class Trail(Struct):
    """Points where the robot was, m: those that are new to the page, or the whole trail."""

    whole: bool
    points: list[tuple[float, float]]


class MapPart(Struct):
    """A part of what the infrared sensors have met; it is new to the page, and stands in its last map if that fits."""

    cell: float  # m, the side of a square
    x: float  # m, the middle of the first column of the whole map
    y: float  # m, the middle of the first row
    columns: int  # of the whole map
    rows: int
    at: tuple[int, int]  # first row and column of the part
    width: int  # columns of the part
    # signed bytes, row by row: 0 if nothing is known, 127 where surely something is, -127 where surely not
    squares: bytes


class Lines(Struct):
    """Lines of the event log: those that are new to the page, or all."""

    whole: bool
    lines: list[Line]


class LinkStats(Struct, kw_only=True):
    """Statistics of the link, s and counts, and the share of lost and refused commands."""

    median: float | None
    p99: float | None
    count: int
    lost: int
    refused: int
    unsent: int
    resyncs: int
    resets: int
    loss: float | None = None
    age: float | None
    waiting: int


class Playing(Struct):
    """How far a recording was played, s."""

    at: float
    length: float
    paused: bool


class MachineState(Struct):
    """A machine of states: how many have begun, the state that it is in, and the one before; empty if it has ended."""

    count: int
    state: str
    previous_state: str


class Tick(Struct):
    """What changes ten times a second; distances are those to a white wall, m, and null where nothing is seen."""

    time: float
    phase: PhaseName
    phase_text: str
    error: Trouble | None
    doctor: list[DiagnosedStep] | None
    drive: Drive
    readings: dict[str, Reading]
    lamps: Lamps
    camera: CameraSettings | None
    picture: Picture | None
    distances: list[float | None]
    pose: Pose | None
    trail: Trail
    map: MapPart | None
    lines: Lines
    link: LinkStats | None
    log: str | None
    recorder: int | None  # bytes of the recording that is written; 0 before the robot is connected
    playback: Playing | None
    machine: MachineState | None
    live: float | None


class Summary(Struct):
    """The part of a tick that an overview of many robots draws."""

    phase: PhaseName
    phase_text: str
    error: str | None
    may_move: bool
    driver: str
    behaviour: str
    distances: list[float | None]
    battery: float | None
    stale: bool
    median: float | None


@dataclass(slots=True)
class Cursor:
    """How much one page has seen; :func:`tick` updates it. A page that shows another robot needs a new one."""

    trail: int = 0  # points of the trail, of all that there ever were
    map: Grid | None = None  # the map that it was told of, its rows and columns, and what had been added to it
    map_size: tuple[int, ...] = ()
    map_changes: int = 0
    lines: int = 0
    picture: float = math.nan  # time of the picture, s


def scheme(slot: Slot) -> Scheme:
    """Return what a page must know once."""
    profile = FIRMWARES.get(slot.firmware)
    found = Scheme(slot.edition, slot.firmware, slot.drive.fastest, WHEEL_CIRCUMFERENCE, instruments(slot.firmware))
    if profile is None:
        return found
    if "set_camera" not in profile.absent:
        found.camera = CameraLimits(profile.zooms)
    if "set_rgb_led" not in profile.absent:
        found.coloured = [led for led in RGB_LEDS if led != profile.status_led]
    if "play_sound" not in profile.absent:
        found.sounds = profile.sounds
    return found


def tick(slot: Slot, cursor: Cursor | None = None) -> Tick:
    """Return what changes ten times a second.

    The cursor says what the page has seen of trail, event log and pictures, and is moved on. Without one all is new.
    """
    cursor = Cursor() if cursor is None else cursor
    drive = slot.drive
    left, right = _wheels(slot)
    return Tick(
        time=round(slot.now, 3),
        phase=slot.phase.name.lower(),
        phase_text=slot.phase.value,
        error=None if slot.error is None else Trouble.of(slot.error),
        doctor=_doctor(slot),
        drive=Drive(
            drive.driver, round(left, 5), round(right, 5), round(drive.limit, 5), drive.may_move, drive.trouble
        ),
        readings=_readings(slot),
        lamps=_lamps(slot),
        camera=_camera(slot),
        picture=_picture(slot, cursor),
        distances=_distances(slot),
        pose=_pose(slot),
        trail=_trail(slot, cursor),
        map=_map(slot, cursor),
        lines=_lines(slot, cursor),
        link=_link(slot),
        log=_log(slot),
        recorder=_recorder(slot),
        playback=_playback(slot),
        machine=_machine(slot),
        live=slot.watcher.pictures,
    )


def summary(slot: Slot) -> Summary:
    """Return the part of a tick that an overview of many robots draws, a few hundred bytes."""
    battery = slot.readings.get("battery")
    statistics = slot.statistics
    return Summary(
        phase=slot.phase.name.lower(),
        phase_text=slot.phase.value,
        error=None if slot.error is None else slot.error.message,
        may_move=slot.drive.may_move,
        driver=slot.drive.driver,
        behaviour=slot.runner.name if slot.runner.is_active else "",
        distances=_distances(slot),
        battery=battery.fraction if isinstance(battery, v.Battery) else None,
        stale=slot.is_stale("proximity"),
        median=None if statistics is None else _finite(statistics.median),
    )


def _finite(value: float | None, digits: int = 5) -> float | None:
    """Return *value* rounded, and None for one that is not known."""
    return round(value, digits) if value is not None and math.isfinite(value) else None


def _small(value: float | None) -> float | None:
    """Return *value* with six significant digits: a magnetic field is some 0.00002 T."""
    if value is None or isinstance(value, int):
        return value
    return float(f"{value:.6g}") if math.isfinite(value) else None


def _readings(slot: Slot) -> dict[str, Reading]:
    found: dict[str, Reading] = {}
    for each in instruments(slot.firmware):
        reading = slot.readings.get(each.name)
        if each.absent:
            continue
        found[each.name] = Reading()
        if isinstance(reading, v.Reading):
            found[each.name] = Reading(
                values=[_small(number) for number in numbers(reading)],
                physical=[_small(number) for number in physical(reading)] if each.physical_unit else None,
                age=_finite(slot.watcher.age(each.name), 3),
                stale=slot.is_stale(each.name),
            )
    return found


def _distances(slot: Slot) -> list[float | None]:
    """Return how far the infrared sensors see, m; None where nothing is."""
    return [_finite(metres, 4) for metres in slot.watcher.distances]


def _pose(slot: Slot) -> Pose | None:
    pose = slot.watcher.trail[-1] if slot.watcher.trail else None
    return None if pose is None else (round(pose.x, 5), round(pose.y, 5), round(pose.heading, 5))


def _wheels(slot: Slot) -> tuple[float, float]:
    """Return the speeds of the wheels as set, rev/s: by the stick, otherwise by a behaviour or the console."""
    target = slot.drive.target
    may_move = slot.drive.may_move or slot.phase in (Phase.PLAYING, Phase.WATCHED)
    if any(target) or slot.context is None or not may_move:
        return target
    left, right = slot.context.last_set.speed
    return left / STEPS_PER_REVOLUTION, right / STEPS_PER_REVOLUTION


def _lamps(slot: Slot) -> Lamps:
    context = slot.context
    if context is None:
        return Lamps([0] * 8, 0, 0, None)
    lamps, rgb = context.last_set.lamps, context.last_set.rgb
    has_rgb = "set_rgb_led" not in context.profile.absent
    colours = [list(rgb[3 * index : 3 * index + 3]) for index in range(4)]
    return Lamps(list(lamps[:8]), lamps[8], lamps[9], colours if has_rgb else None)


def _camera(slot: Slot) -> CameraSettings | None:
    camera = None if slot.context is None else slot.context.last_set.camera
    if camera is None:
        return None
    mode = CameraMode(camera.mode).name if camera.mode in set(CameraMode) else str(camera.mode)
    return CameraSettings(camera.width, camera.height, camera.zoom, mode)


def _picture(slot: Slot, cursor: Cursor) -> Picture | None:
    image = slot.readings.get(IMAGE)
    if not isinstance(image, Image) or image.mode == CameraMode.YUV:
        return None
    is_new = image.time != cursor.picture
    cursor.picture = image.time
    return Picture(
        width=image.width,
        height=image.height,
        mode=image.mode.name,
        age=_finite(slot.watcher.age(IMAGE), 3),
        stale=slot.is_stale(IMAGE),
        pixels=image.pixels.tobytes() if is_new else None,
    )


def _behind(kept: Sequence[T], count: int, seen: int) -> tuple[bool, list[T], int]:
    """Return whether a page must begin again, what is new to it, and how much it has then seen.

    *kept* are the newest of *count* that there ever were; the page has *seen* so many of those.
    """
    first = count - len(kept)
    is_whole = seen < first or seen > count or seen == 0
    begin = first if is_whole else seen
    end = min(count, begin + MAX_POINTS)
    return is_whole, list(islice(kept, begin - first, end - first)) if end > begin else [], end


def _trail(slot: Slot, cursor: Cursor) -> Trail:
    if cursor.trail < slot.watcher.trail_began:
        cursor.trail = 0
    is_whole, poses, cursor.trail = _behind(slot.watcher.trail, slot.watcher.trail_count, cursor.trail)
    return Trail(is_whole, [(round(pose.x, 4), round(pose.y, 4)) for pose in poses])


def _map(slot: Slot, cursor: Cursor) -> MapPart | None:
    """Return what has changed on the map since the page was told; all of it if the map is another, or has grown."""
    grid = slot.watcher.map
    if grid is None:
        return None
    from elib.maps.grid import MAX_ODDS, SIGHT  # the studio's page may have no NumPy

    size = grid.odds.shape
    is_known = (cursor.map, cursor.map_size) == (grid, size)
    missed = grid.changes - cursor.map_changes if is_known else grid.changes
    cursor.map, cursor.map_size, cursor.map_changes = grid, size, grid.changes
    if not missed:
        return None
    (low, left), (high, right) = (0, 0), size
    if is_known and missed <= MAX_MISSED:
        poses = list(slot.watcher.mapped)[-missed:]
        xs, ys = [pose.x for pose in poses], [pose.y for pose in poses]
        low, left = (max(0, each - 1) for each in grid.square(min(xs) - SIGHT, min(ys) - SIGHT))
        high, right = (each + 2 for each in grid.square(max(xs) + SIGHT, max(ys) + SIGHT))
    part = grid.odds[low:high, left:right]
    squares = (part * 127 / MAX_ODDS).round().astype("int8")
    return MapPart(grid.cell, grid.x, grid.y, size[1], size[0], (low, left), part.shape[1], squares.tobytes())


def _lines(slot: Slot, cursor: Cursor) -> Lines:
    is_whole, lines, cursor.lines = _behind(slot.log.lines, slot.log.count, cursor.lines)
    return Lines(is_whole, lines)


def _link(slot: Slot) -> LinkStats | None:
    health = slot.statistics
    if health is None:
        return None
    found = msgspec.convert(health, LinkStats, from_attributes=True)  # JSON has null for nan
    if sent := health.count + health.lost + health.refused:
        found.loss = health.lost / sent
    if slot.phase not in (Phase.CONNECTED, Phase.GAP):
        found.age = None
    return found


def _playback(slot: Slot) -> Playing | None:
    if not slot.is_playing:
        return None
    return Playing(round(slot.playback.at, 2), round(slot.playback.length, 2), slot.playback.is_paused)


def _machine(slot: Slot) -> MachineState | None:
    machine = slot.machine
    if not machine.program:
        return None
    is_running = slot.runner.is_active or slot.phase in (Phase.PLAYING, Phase.WATCHED)
    now = (machine.state, machine.previous_state) if is_running else ("", "")
    return MachineState(machine.count, *now)


def _log(slot: Slot) -> str | None:
    log = slot.records.log
    return log.armed or (None if log.file is None else log.file.target)


def _doctor(slot: Slot) -> list[DiagnosedStep] | None:
    found = slot.diagnosis
    return None if found is None else msgspec.convert(found.steps, list[DiagnosedStep], from_attributes=True)


def _recorder(slot: Slot) -> int | None:
    recording = slot.records.recording
    if recording.file is None:
        return 0 if recording.armed else None
    return recording.file.size
