"""What a page is told of a virtual world: the scene once, then frames of what moves, and what else has changed.

A frame is little-endian binary: number (uint32), flags (uint32, 1: with rays, 2: the world can go back to it),
simulated time (float64, s), robots (uint32), channel (uint32, as the page chose it); then x, y, heading of every robot
(float32, m and rad); with rays start, end (m) and strength of eight of each robot (40 float32); a byte of bits each (1
touching, 2 body light, 4 front LED, 8 link cut); and 24 bytes each of the ring's colours. The rest is JSON.

Frames are made only while a page looks, from an immutable snapshot.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TypeVar

from msgspec import UNSET, Struct, UnsetType

from elib.base.errors import ArgumentError
from elib.base.pictures import as_address
from elib.panel.server.conversation import Told
from elib.panel.server.page import Page, Stream, Wish
from elib.simulator import physics
from elib.simulator.drawing.floor import floor_png
from elib.simulator.emulator.control import Control, LinkState
from elib.simulator.emulator.control_server import time_factor
from elib.simulator.emulator.past import is_due
from elib.simulator.physics import Colour, Light, RobotView, Snapshot, Sound
from elib.simulator.physics.faces import cells_of
from elib.simulator.physics.fittings import FLOOR_COLOUR
from elib.simulator.physics.floor import packed

HEADER = struct.Struct("<IIdII")
RAYS, KEPT = 1, 2
TOUCHING, BODY, FRONT, CUT = 1, 2, 4, 8
RATE = 25.0
"""Frames a second of the wall clock, at most."""

_Thing = TypeVar("_Thing")
Walls = list[tuple[float, float, float, float, str, float, list[list[int]]]]
"""x1, y1, x2, y2, the colour, the height and the face of each: the rows of cells that it shows, from above, as colours,
65536 red + 256 green + blue."""


class Box(Struct):
    """A box: m, rad, whether it gives way to a robot, and what its sides show, as a wall."""

    name: str
    x: float
    y: float
    angle: float
    width: float
    depth: float
    height: float
    colour: str
    pushable: bool
    face: list[list[int]]


class Cylinder(Struct):
    """A cylinder: m, and whether it gives way to a robot."""

    name: str
    x: float
    y: float
    radius: float
    height: float
    colour: str
    pushable: bool


class Block(Struct):
    """A fixed block: its corners, m, its height, m. Its sides are among the walls."""

    points: tuple[tuple[float, float], ...]
    height: float
    colour: str


class Zone(Struct):
    """A zone of the world: the corners of its shape, m, whether it is switched on, and whether a picture tells more."""

    name: str
    points: tuple[tuple[float, float], ...]
    colour: str
    on: bool
    picture: bool


class Floor(Struct):
    """The painted floor, if there is a picture of it; without a colour, it is bare linoleum."""

    colour: str | None
    width: float
    depth: float


class Clock(Struct):
    """The clock of a world: how often faster than the wall clock, and why its speed cannot be changed, if it cannot."""

    paused: bool
    speed: float
    fixed: str


class Scene(Struct):
    """What the page has to know once of a world: m, and counts of the room's light.

    Attributes:
        radius: Of a robot, m.
        own: The index of the robot by whose key the page has subscribed to it; None for another key.
        floor_png: The painted floor, with what pens drew until now, as the address of a picture.
        pens: The colour of each robot's pen, if it has one; empty if no robot has.
    """

    world: str
    width: float
    depth: float
    walls: Walls
    blocks: list[Block]
    floor: Floor
    robots: int
    radius: float
    boxes: list[Box]
    cylinders: list[Cylinder]
    lights: tuple[Light, ...]
    sounds: tuple[Sound, ...]
    ambient: float
    clock: Clock
    names: tuple[str, ...]
    own: int | None
    floor_png: str | None
    zones: list[Zone]
    pens: list[str | None]


class NewScene(Told, tag="scene"):
    """The world of a channel from now on, or that there is none."""

    channel: int
    scene: Scene | None


class Change(Told, tag="change"):
    """What stands elsewhere or shines otherwise than before, each with its index; or all of a kind."""

    channel: int
    walls: Walls | UnsetType = UNSET
    all_boxes: list[Box] | UnsetType = UNSET
    boxes: list[tuple[int, float, float, float]] | UnsetType = UNSET
    cylinders: list[tuple[int, float, float]] | UnsetType = UNSET
    lights: list[tuple[int, Light]] | UnsetType = UNSET
    sounds: list[tuple[int, Sound]] | UnsetType = UNSET
    zones: list[Zone] | UnsetType = UNSET
    ambient: float | UnsetType = UNSET
    clock: Clock | UnsetType = UNSET


class LinkFaults(Struct):
    """Faults of a link: delay of answers and its standard deviation, s, and the probability of a loss."""

    latency: float
    jitter: float
    loss: float


class Readings(Told, tag="readings"):
    """What one robot of the world perceives and how it is connected; the last three only if a program has opened it."""

    channel: int
    robot: int
    proximity: list[int]
    encoders: tuple[int, int]
    link: LinkState
    energy: float
    score: float
    zones: tuple[str, ...]
    base: LinkFaults | UnsetType = UNSET
    selector: int | UnsetType = UNSET
    button: bool | UnsetType | None = UNSET


class WorldStream(Stream):
    """A world: its scene, then frames, and what changes."""

    fastest = RATE

    def __init__(self, page: Page, wish: Wish) -> None:
        self._simulation: object = self  # none, and no world either
        self._seen: Snapshot | None = None
        self._said: tuple[float, Clock] | None = None
        self._number = 0
        self._kept = -math.inf  # when the page last kept a moment, s
        super().__init__(page, wish)

    @property
    def control(self) -> Control | None:
        """The control of the world, or None while there is none."""
        return self._page.panel.world(self.wish.of)

    def _next(self) -> Iterable[Told | bytes]:
        control, wish = self.control, self.wish
        simulation = None if control is None else control.simulation
        if simulation is not self._simulation:
            self._simulation, self._seen, self._kept = simulation, None, -math.inf
            self._sent.clear()
            if control is None:
                yield NewScene(wish.channel, None)
        if control is None:
            return
        self._number += 1
        self._sent.append(self._number)
        snapshot = control.snapshot(beams=wish.rays)
        size = len(snapshot.robots) + len(snapshot.boxes) + len(snapshot.cylinders)
        is_kept = is_due(size, snapshot.time, self._kept)
        if is_kept:
            self._kept = snapshot.time
            control.keep()
        packed_frame = frame(
            snapshot, self._number, control.is_cut, rays=wish.rays, channel=wish.channel, is_kept=is_kept
        )
        seen, self._seen = self._seen, snapshot
        said, self._said = self._said, (control.ambient, clock(control))
        if seen is None or said is None:
            slot = self._page.panel.slots.get(wish.of)
            yield NewScene(wish.channel, scene(control, snapshot, None if slot is None else slot.index))
        else:
            found = change(seen, snapshot, wish.channel)
            if said[0] != self._said[0]:
                found.ambient = self._said[0]
            if said[1] != self._said[1]:
                found.clock = self._said[1]
            if found != Change(wish.channel):
                yield found
        yield packed_frame


class ReadingsStream(Stream):
    """What one robot of a world perceives, by its index there; the world is that of the same channel."""

    def __init__(self, page: Page, wish: Wish) -> None:
        if not (wish.of.isascii() and wish.of.isdecimal()):
            raise ArgumentError(f"of is {wish.of!r}; it must be the index of a robot in the world")
        self._index = int(wish.of)
        super().__init__(page, wish)

    def _next(self) -> Iterable[Readings]:
        control = self._page.world(self.wish.channel)
        if control is not None and not self._page.unread:
            snapshot = control.snapshot(beams=True)
            if self._index < len(snapshot.robots):
                yield readings(control, snapshot, self._index, self.wish.channel)


def clock(control: Control) -> Clock:
    """Return how fast a world goes."""
    found = control.simulation.clock
    return Clock(found.is_paused, found.rate * time_factor(), found.refusal)


def scene(control: Control, snapshot: Snapshot, own: int | None) -> Scene:
    """Return what the page has to know once; *own* is the index of its own robot."""
    floor = control.world.floor
    pens = control.world.laid_out()["pens"]
    scale = 1 / floor.scale if floor.columns else 0.0
    # The colour of bare linoleum is left to the page, which has a light and a dark one.
    colour = None if floor.colour == packed(FLOOR_COLOUR) else f"#{floor.colour:06x}"
    return Scene(
        world=snapshot.name,
        width=snapshot.width,
        depth=snapshot.depth,
        walls=_walls(snapshot),
        blocks=[Block(each.points, each.height, str(each.colour)) for each in snapshot.polygons],
        floor=Floor(colour, floor.columns * scale, floor.rows * scale),
        robots=len(snapshot.robots),
        radius=max((robot.radius for robot in snapshot.robots), default=0.0),
        boxes=[_box(box) for box in snapshot.boxes],
        cylinders=[_post(post) for post in snapshot.cylinders],
        lights=snapshot.lights,
        sounds=snapshot.sounds,
        ambient=control.ambient,
        clock=clock(control),
        names=tuple(control.names),
        own=own,
        floor_png=as_address(floor_png(floor)) if floor.columns else None,
        zones=_zones(snapshot),
        pens=[None if colour is None else str(colour) for colour in pens],
    )


def frame(
    snapshot: Snapshot,
    number: int,
    is_cut: Callable[[int], bool],
    *,
    rays: bool,
    channel: int = 0,
    is_kept: bool = False,
) -> bytes:
    """Return what moves, packed.

    Args:
        snapshot: The world, with the beams of all robots if there are to be rays.
        number: Number of the frame; the page repeats it when it has drawn the frame.
        is_cut: Tells of a robot's index whether its link is cut.
        rays: Whether to show the rays of the infrared sensors.
        channel: The page's own number for the world.
        is_kept: Whether the world can go back to this moment.
    """
    robots = snapshot.robots
    has_rays = rays and bool(robots)
    parts = [
        HEADER.pack(number & 0xFFFFFFFF, has_rays * RAYS | is_kept * KEPT, snapshot.time, len(robots), channel),
        _floats([value for robot in robots for value in (robot.pose.x, robot.pose.y, robot.pose.heading)]),
    ]
    if has_rays:
        beams = [beam for robot in robots for beam in robot.beams]
        parts.append(_floats([value for beam in beams for value in (*beam.start, *beam.end, beam.strength)]))
    parts.append(bytes(_bits(robot) | (CUT if is_cut(index) else 0) for index, robot in enumerate(robots)))
    parts += [_ring(robot.lamps) for robot in robots]
    return b"".join(parts)


def change(old: Snapshot, new: Snapshot, channel: int = 0) -> Change:
    """Return what stands elsewhere or shines otherwise than before.

    ``boxes`` has those that moved, ``all_boxes`` and ``walls`` have all of them after one was added or removed, or the
    world went back to when there were others.
    """
    found = Change(channel)
    if old.walls != new.walls:
        found.walls = _walls(new)
    boxes = zip(old.boxes, new.boxes, strict=False)
    if len(old.boxes) != len(new.boxes) or any(
        before is not after and replace(before, x=after.x, y=after.y, angle=after.angle) != after
        for before, after in boxes
    ):
        found.all_boxes = [_box(box) for box in new.boxes]
        old = replace(old, boxes=new.boxes)
    found.boxes = [(at, box.x, box.y, box.angle) for at, box in _moved(old.boxes, new.boxes)] or UNSET
    found.cylinders = [(at, post.x, post.y) for at, post in _moved(old.cylinders, new.cylinders)] or UNSET
    found.lights = _moved(old.lights, new.lights) or UNSET
    found.sounds = _moved(old.sounds, new.sounds) or UNSET
    if [zone.is_on for zone in old.zones] != [zone.is_on for zone in new.zones]:
        found.zones = _zones(new)
    return found


def readings(control: Control, snapshot: Snapshot, robot: int, channel: int = 0) -> Readings:
    """Return what one robot perceives and how it is connected.

    The infrared readings are those of the beams of *snapshot*: a reading the robot is told counts into the world's
    hash, and a page that looks must not change it.
    """
    virtual = control.simulation.robots.get(robot)
    proximity = [beam.reading for beam in snapshot.robots[robot].beams]
    world, seen = control.world, snapshot.robots[robot]
    earned = seen.energy, seen.score, world.zones_of(robot)
    found = Readings(channel, robot, proximity, world.encoders(robot), control.link(robot), *earned)
    if virtual is not None:
        own, hardware = virtual.settings, control.hardware(robot)
        found.base = LinkFaults(own.latency, own.jitter, own.loss)
        found.selector = hardware.selector()
        found.button = hardware.button_is_pressed() if control.has_button(robot) else None
    return found


def _walls(snapshot: Snapshot) -> Walls:
    return [(w.x1, w.y1, w.x2, w.y2, str(w.colour), w.height, _face(w.face)) for w in snapshot.walls]


def _zones(snapshot: Snapshot) -> list[Zone]:
    return [Zone(a.name, a.outline, str(a.colour), a.is_on, bool(a.file)) for a in snapshot.zones if a.outline]


def _face(face: str) -> list[list[int]]:
    return [list(row) for row in cells_of(face)]


def _box(box: physics.Box) -> Box:
    size = box.width, box.depth, box.height
    return Box(box.name, box.x, box.y, box.angle, *size, str(box.colour), box.is_pushable, _face(box.face))


def _post(post: physics.Cylinder) -> Cylinder:
    return Cylinder(post.name, post.x, post.y, post.radius, post.height, str(post.colour), post.is_pushable)


def _floats(values: list[float]) -> bytes:
    return struct.pack(f"<{len(values)}f", *values)


def _bits(robot: RobotView) -> int:
    lamps = robot.lamps
    return robot.touching * TOUCHING | lamps.body * BODY | lamps.front * FRONT


@lru_cache(256)
def _ring(lamps: physics.Lamps) -> bytes:
    return bytes(part for colour in lamps.ring for part in Colour(*colour))


def _moved(old: Sequence[_Thing], new: Sequence[_Thing]) -> list[tuple[int, _Thing]]:
    if old is new:
        return []
    pairs = enumerate(zip(old, new, strict=True))
    return [(index, after) for index, (before, after) in pairs if before is not after and before != after]
