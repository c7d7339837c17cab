"""The top view: an arena, what stands in it, robots, and the trails they left."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias, TypedDict

from elib.base.rules import Whole
from elib.base.zone import Zone
from elib.simulator.drawing.fittings import glow_shapes, lamp_shapes, push_shapes, sound_shapes
from elib.simulator.drawing.robot import robot_shapes
from elib.simulator.drawing.shapes import Area, Circle, Drawing, Picture, Point, Shape, Stroke, Text, blend
from elib.simulator.physics import Box, Colour, Cylinder, Pose, RobotView, Snapshot
from elib.simulator.physics.fittings import FLOOR_COLOUR
from elib.simulator.physics.fittings import Zone as WorldZone
from elib.simulator.physics.floor import packed

Trail: TypeAlias = Sequence[Pose]
"""Where one robot was, oldest first, in even steps of time."""

PAPER = Colour(247, 246, 242)
FLOOR = Colour(255, 255, 253)
GRID = Colour(236, 235, 229)
SHADE = Colour(30, 28, 16)
EDGE = Colour(52, 58, 70)
INK = Colour(52, 58, 70)
FAINT_INK = Colour(112, 117, 126)
ZONE = Colour(38, 130, 98)
TOLD = Colour(240, 140, 30)
TOLD_FREE = Colour(255, 238, 214)

TRAIL_HUES = (
    Colour(24, 90, 157),
    Colour(199, 81, 22),
    Colour(46, 125, 80),
    Colour(142, 68, 143),
    Colour(176, 42, 72),
    Colour(96, 96, 20),
)
"""One robot each, then again from the first: dark enough to read on white, apart also for colour-blind eyes."""

GRID_STEP = 0.1  # m between the faint lines.
TRAIL_SHADES = 48  # Steps from pale to full colour: more cannot be told apart.
NICE_LENGTHS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)  # m, for the scale bar.
SIZE = Whole(200, 8000, "pixels")  # of the longer side


@dataclass(frozen=True, slots=True)
class Tones:
    """The colours around the things of a drawing."""

    paper: Colour = PAPER  # the colour beside the arena
    floor: Colour = FLOOR  # the colour of bare linoleum
    grid: Colour = GRID  # the colour of the lines on the floor
    edge: Colour = EDGE  # the colour of walls, outlines and words


ON_PAPER = Tones()


class Look(TypedDict, total=False):
    """How a world is drawn."""

    # where each robot was, oldest first, in the order of the robots; pale is old. Fewer leave others without.
    trails: Sequence[Trail]
    caption: str | None  # line below the picture; None makes one from the snapshot, "" leaves it empty
    size: int  # pixels of the arena's longer side, 200..8000
    zones: Sequence[Zone]  # parts of the floor to be marked
    # parts of a map that is laid over the floor: whether something stands there on the map, and the corners, m
    patches: Sequence[tuple[bool, Sequence[tuple[float, float]]]]
    tones: Tones  # the colours around the things


def top_view(
    snapshot: Snapshot,
    trails: Sequence[Trail] = (),
    caption: str | None = None,
    size: int = 900,
    zones: Sequence[Zone] = (),
    patches: Sequence[tuple[bool, Sequence[tuple[float, float]]]] = (),
    tones: Tones = ON_PAPER,
) -> Drawing:
    """Return the drawing of *snapshot* from above; the other arguments are those of :class:`Look`.

    Raises:
        ArgumentError: *size* is out of its range.
    """
    SIZE.require(size, "size")
    frame = _Frame(snapshot, size, tones)
    told = [(solid, tuple(frame.at(*corner) for corner in corners)) for solid, corners in patches]
    shapes = [
        *_floor(snapshot, frame),
        *(Area(corners, TOLD_FREE, TOLD_FREE, 0.5) for solid, corners in told if not solid),
        *(shape for zone in snapshot.zones if zone.outline for shape in _area(zone, snapshot, frame)),
        *(shape for zone in zones for shape in _zone(zone, frame)),
        *_shadows(snapshot, frame),
        *(shape for i, trail in enumerate(trails) for shape in _trail(trail, hue(i), frame)),
        *_obstacles(snapshot, frame),
        *(Area(corners, TOLD) for solid, corners in told if solid),
        *_walls(snapshot, frame),
        *(shape for robot in snapshot.robots for shape in _beams(robot, frame)),
        *(shape for i, trail in enumerate(trails) for shape in _start(trail, hue(i), frame)),
        *(shape for robot in snapshot.robots for shape in robot_shapes(robot, frame.at, frame.scale)),
        *(shape for sound in snapshot.sounds for shape in sound_shapes(sound, frame.at(sound.x, sound.y), frame.text)),
        *(shape for light in snapshot.lights for shape in lamp_shapes(light, frame.at(light.x, light.y), frame.text)),
        *_edge(snapshot, frame),
        *_footer(snapshot, trails, caption, frame),
    ]
    return Drawing(frame.width, frame.height, tones.paper, tuple(shapes))


def hue(robot: int) -> Colour:
    """Return the colour of a robot's trail."""
    return TRAIL_HUES[robot % len(TRAIL_HUES)]


class _Frame:
    """Where things of the world lie in the image."""

    def __init__(self, snapshot: Snapshot, size: int, tones: Tones) -> None:
        self.tones = tones
        self.scale = size / max(snapshot.width, snapshot.depth)
        self.margin = round(size * 0.045)
        self.text = max(11.0, size * 0.0175)
        self.depth = snapshot.depth
        self.bottom = self.margin + snapshot.depth * self.scale
        self.right = self.margin + snapshot.width * self.scale
        self.width = round(self.right + self.margin)
        self.height = round(self.bottom + self.margin * 0.7 + 2.2 * self.text)
        self.line = size / 900  # The unit of line widths: 1 at the usual size.
        colour = snapshot.floor.colour
        self.bare = tones.floor if colour == packed(FLOOR_COLOUR) else Colour(*colour.to_bytes(3, "big"))
        self.edge = tones.edge if self.bare == tones.floor else EDGE
        self.is_dark = sum(self.bare) < 3 * 128

    def at(self, x: float, y: float) -> Point:
        """Return the pixel of a place in the world, m."""
        return self.margin + x * self.scale, self.margin + (self.depth - y) * self.scale


def _floor(snapshot: Snapshot, frame: _Frame) -> Iterator[Shape]:
    width, depth, floor, bare = snapshot.width, snapshot.depth, snapshot.floor, frame.bare
    yield Area((frame.at(0, 0), frame.at(width, 0), frame.at(width, depth), frame.at(0, depth)), bare)
    if floor.columns:
        across, up = floor.columns / floor.scale, floor.rows / floor.scale
        yield Picture(frame.at(0, up), (across * frame.scale, up * frame.scale), floor, bare)
        return
    yield from glow_shapes(snapshot.lights, frame.at, frame.scale, bare)
    if snapshot.lights:
        yield from _margins(snapshot, frame)
    tones = frame.tones
    grid = tones.grid if bare == tones.floor else blend(bare, frame.edge, 0.1)
    step = GRID_STEP if max(width, depth) <= 3 else 1.0
    for k in range(1, math.ceil(width / step)):
        yield Stroke((frame.at(k * step, 0), frame.at(k * step, depth)), grid, frame.line)
    for k in range(1, math.ceil(depth / step)):
        yield Stroke((frame.at(0, k * step), frame.at(width, k * step)), grid, frame.line)


def _zone(zone: Zone, frame: _Frame) -> Iterator[Shape]:
    if zone.radius:
        yield Circle(frame.at(zone.x, zone.y), zone.radius * frame.scale, None, ZONE, 2.4 * frame.line)
    else:
        left, right = zone.x - zone.width / 2, zone.x + zone.width / 2
        low, high = zone.y - zone.depth / 2, zone.y + zone.depth / 2
        corners = (left, low), (right, low), (right, high), (left, high), (left, low)
        yield Stroke(tuple(frame.at(*corner) for corner in corners), ZONE, 2.4 * frame.line)
    yield _title(zone.name, frame.at(zone.x, zone.y + (zone.radius or zone.depth / 2)), ZONE, frame)


def _title(name: str, top: Point, colour: Colour, frame: _Frame) -> Text:
    """Return the name of a zone above its upper end."""
    x, bottom = top[0], top[1] - 0.4 * frame.text
    if bottom - frame.text < frame.margin:  # the wall is there: go above it
        bottom = frame.margin - 6 * frame.line - 0.25 * frame.text
    return Text((x, bottom), name, 0.85 * frame.text, colour, "middle")


def _area(zone: WorldZone, snapshot: Snapshot, frame: _Frame) -> Iterator[Shape]:
    """Draw a zone of the world; it is filled where that hides nothing, darker while it is switched on."""
    corners = tuple(frame.at(x, y) for x, y in zone.outline)
    if snapshot.floor.columns or zone.file:
        yield Stroke((*corners, corners[0]), zone.colour, 1.6 * frame.line)
    else:
        yield Area(corners, blend(frame.bare, zone.colour, 0.4 if zone.is_on else 0.15), zone.colour, 1.6 * frame.line)
    left, right = min(x for x, _ in corners), max(x for x, _ in corners)
    yield _title(zone.name, ((left + right) / 2, min(y for _, y in corners)), zone.colour, frame)


def _margins(snapshot: Snapshot, frame: _Frame) -> Iterator[Shape]:
    """Cover what shines beyond the arena."""
    left, top = (place - frame.line for place in frame.at(0, snapshot.depth))
    right, bottom = (place + frame.line for place in frame.at(snapshot.width, 0))
    for x1, y1, x2, y2 in (
        (0, 0, frame.width, top),
        (0, bottom, frame.width, frame.height),
        (0, 0, left, frame.height),
        (right, 0, frame.width, frame.height),
    ):
        yield Area(((x1, y1), (x2, y1), (x2, y2), (x1, y2)), frame.tones.paper)


def _shadows(snapshot: Snapshot, frame: _Frame) -> Iterator[Shape]:
    if snapshot.floor.columns:
        return  # Shapes are opaque: a shadow would hide what is painted on the floor.
    shift = 0.007 * max(snapshot.width, snapshot.depth)
    shadow = blend(frame.bare, SHADE, 0.15)
    for box in snapshot.boxes:
        yield Area(_corners(box, frame, shift), shadow)
    for post in _there(snapshot):
        yield Circle(frame.at(post.x + shift, post.y - shift), post.radius * frame.scale, shadow)
    for robot in snapshot.robots:
        centre = frame.at(robot.pose.x + 0.6 * shift, robot.pose.y - 0.6 * shift)
        yield Circle(centre, robot.radius * frame.scale, shadow)


def _there(snapshot: Snapshot) -> list[Cylinder]:
    """Return the cylinders without the pucks that are gone, which lie far away."""
    return [post for post in snapshot.cylinders if post.x > -snapshot.width]


def _obstacles(snapshot: Snapshot, frame: _Frame) -> Iterator[Shape]:
    for box in snapshot.boxes:
        outline = blend(box.colour, frame.edge, 0.45)
        yield Area(_corners(box, frame, 0.0), box.colour, outline, 2 * frame.line)
        yield from push_shapes(box, frame.at, 2 * frame.line)
    for post in _there(snapshot):
        centre, radius = frame.at(post.x, post.y), post.radius * frame.scale
        yield Circle(centre, radius, post.colour, blend(post.colour, frame.edge, 0.45), 2 * frame.line)
        if not post.is_pushable:
            yield Circle(centre, 0.62 * radius, blend(post.colour, FLOOR, 0.22))
        yield from push_shapes(post, frame.at, 2 * frame.line)


def _walls(snapshot: Snapshot, frame: _Frame) -> Iterator[Shape]:
    for block in snapshot.polygons:
        yield Area(tuple(frame.at(x, y) for x, y in block.points), block.colour)
    for wall in snapshot.walls:
        yield Stroke(
            (frame.at(wall.x1, wall.y1), frame.at(wall.x2, wall.y2)),
            blend(wall.colour, frame.edge, 0.75),
            5 * frame.line,
        )


def _corners(box: Box, frame: _Frame, shift: float) -> tuple[Point, ...]:
    return tuple(frame.at(x + shift, y - shift) for x, y in box.corners)


def _edge(snapshot: Snapshot, frame: _Frame) -> Iterator[Shape]:
    width, depth = snapshot.width, snapshot.depth
    corners = (frame.at(0, 0), frame.at(width, 0), frame.at(width, depth), frame.at(0, depth))
    # The line lies outside the floor, so that a robot at the wall touches it and is not covered by it.
    half = 3 * frame.line
    outer = tuple(
        (x + (half if x > frame.margin + 1 else -half), y + (half if y > frame.margin + 1 else -half))
        for x, y in corners
    )
    yield Stroke((*outer, outer[0]), frame.tones.edge, 2 * half)


def _trail(trail: Trail, colour: Colour, frame: _Frame) -> Iterator[Shape]:
    points = _thinned([frame.at(pose.x, pose.y) for pose in trail], 1.5 * frame.line)
    pale = blend(colour, frame.bare, 0.72)
    for shade in range(TRAIL_SHADES):
        first, last = (len(points) - 1) * shade // TRAIL_SHADES, (len(points) - 1) * (shade + 1) // TRAIL_SHADES
        if first < last:
            age = shade / (TRAIL_SHADES - 1)
            yield Stroke(tuple(points[first : last + 1]), blend(pale, colour, age), 3.2 * frame.line)


def _thinned(points: list[Point], distance: float) -> list[Point]:
    """Return *points* without those less than *distance* from the one before; first and last stay."""
    kept = points[:1]
    for point in points[1:]:
        if math.dist(point, kept[-1]) >= distance:
            kept.append(point)
    if points and kept[-1] != points[-1]:
        kept.append(points[-1])
    return kept


def _start(trail: Trail, colour: Colour, frame: _Frame) -> Iterator[Shape]:
    if not trail:
        return
    x, y = frame.at(trail[0].x, trail[0].y)
    radius = 0.62 * frame.text
    yield Circle((x, y), radius, FLOOR, colour, 2.4 * frame.line)
    yield Circle((x, y), 0.3 * radius, colour)
    below = y + 2.2 * frame.text < frame.bottom
    place = (x, y + (1.9 if below else -1.0) * frame.text)
    ink = blend(colour, FLOOR, 0.75) if frame.is_dark else blend(colour, INK, 0.3)
    yield Text(place, "start", 0.85 * frame.text, ink, "middle")


def _beams(robot: RobotView, frame: _Frame) -> Iterator[Shape]:
    for beam in robot.beams:
        lit = min(1.0, beam.strength * 4)  # A quarter of full scale is already very near.
        colour = blend(Colour(250, 214, 190), Colour(224, 62, 20), lit)
        yield Stroke((frame.at(*beam.start), frame.at(*beam.end)), colour, (1.2 + 1.6 * lit) * frame.line)


def _footer(snapshot: Snapshot, trails: Sequence[Trail], caption: str | None, frame: _Frame) -> Iterator[Shape]:
    base = frame.bottom + frame.margin * 0.55 + 1.15 * frame.text
    if caption is None:
        caption = _caption(snapshot, trails)
    yield Text((frame.margin, base), caption, frame.text, frame.tones.edge)
    length = max(nice for nice in NICE_LENGTHS if nice <= max(snapshot.width / 4, NICE_LENGTHS[0]))
    start = frame.right - length * frame.scale
    y = base - 0.35 * frame.text
    tick = 0.35 * frame.text
    yield Stroke(((start, y), (frame.right, y)), frame.tones.edge, 1.8 * frame.line)
    for x in (start, frame.right):
        yield Stroke(((x, y - tick), (x, y + tick)), frame.tones.edge, 1.8 * frame.line)
    label = f"{length * 100:g} cm" if length < 1 else f"{length:g} m"
    yield Text((start - 0.6 * frame.text, base), label, frame.text, FAINT_INK, "end")


def _caption(snapshot: Snapshot, trails: Sequence[Trail]) -> str:
    count = len(snapshot.robots)
    parts = [snapshot.name, f"{snapshot.time:.1f} s"]
    if count > 1:
        parts.append(f"{count} robots")
    score = sum(robot.score for robot in snapshot.robots)
    if score:
        parts.append(f"{score:g} points")
    if count == 1 and snapshot.robots[0].energy < 1:
        parts.append(f"energy {snapshot.robots[0].energy:.0%}")
    driven = sum(math.hypot(b.x - a.x, b.y - a.y) for trail in trails for a, b in pairwise(trail))
    if driven > 0:
        parts.append(f"{driven:.2f} m driven")
    return " · ".join(parts)
