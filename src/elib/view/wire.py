"""What the live view sends: the scene once, then frames of what moves, and what has changed beside.

A frame is little-endian binary: number (uint32), flags (uint32, 1: with rays), simulated time (float64, s), robots
(uint32), 4 bytes of nothing; then x, y, heading of every robot (float32, m and rad); with rays start, end (m) and
strength of eight of each robot (40 float32); a byte of bits each (1 touching, 2 body light, 4 front LED, 8 link cut);
and 24 bytes each of the ring's colours. The rest is JSON.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import lru_cache
from typing import TypeVar

from elib.emulator.control import Control
from elib.errors import ArgumentError
from elib.physics import Box, Colour, Cylinder, Lamps, RobotView, Snapshot
from elib.physics.fittings import FLOOR_COLOUR
from elib.physics.floor import packed
from elib.view.robot import LED_ANGLES

HEADER = struct.Struct("<IIdIxxxx")
RAYS = 1
TOUCHING, BODY, FRONT, CUT = 1, 2, 4, 8
SENSORS = 8
FULL_SCALE = 4095
"""Counts of an infrared sensor."""

Json = dict[str, object]
_Thing = TypeVar("_Thing")


def scene(control: Control, snapshot: Snapshot) -> Json:
    """Return what the page has to know once."""
    settings = control.simulation.settings
    floor, plain = snapshot.floor, packed(FLOOR_COLOUR)
    return {
        "kind": "scene",
        "world": snapshot.name,
        "width": snapshot.width,
        "depth": snapshot.depth,
        "walls": [[wall.x1, wall.y1, wall.x2, wall.y2, str(wall.colour)] for wall in snapshot.walls],
        "floor": {
            # The colour of bare linoleum is left to the page, which has a light and a dark one.
            "colour": None if floor.colour == plain else f"#{floor.colour:06x}",
            "picture": bool(floor.columns),
            "width": floor.columns / floor.scale if floor.columns else 0.0,
            "depth": floor.rows / floor.scale if floor.columns else 0.0,
        },
        "robots": len(snapshot.robots),
        "radius": max((robot.radius for robot in snapshot.robots), default=0.0),
        "leds": [math.radians(angle) for angle in LED_ANGLES],
        "boxes": [_box(box) for box in snapshot.boxes],
        "cylinders": [_post(post) for post in snapshot.cylinders],
        "lights": [asdict(light) for light in snapshot.lights],
        "sounds": [asdict(sound) for sound in snapshot.sounds],
        "ambient": control.ambient,
        "link": {"latency": settings.latency, "jitter": settings.jitter, "loss": settings.loss},
    }


def frame(snapshot: Snapshot, number: int, is_cut: Callable[[int], bool]) -> bytes:
    """Return what moves, packed.

    Args:
        snapshot: The world; with rays if it has the beams of all robots.
        number: Of the frame; the page tells it back when it has drawn it.
        is_cut: Tells of a robot's index whether its link is cut.
    """
    robots = snapshot.robots
    has_rays = bool(robots) and all(len(robot.beams) == SENSORS for robot in robots)
    parts = [
        HEADER.pack(number & 0xFFFFFFFF, RAYS if has_rays else 0, snapshot.time, len(robots)),
        _floats([value for robot in robots for value in (robot.pose.x, robot.pose.y, robot.pose.heading)]),
    ]
    if has_rays:
        rays = [value for robot in robots for beam in robot.beams for value in (*beam.start, *beam.end, beam.strength)]
        parts.append(_floats(rays))
    parts.append(bytes(_bits(robot) | (CUT if is_cut(index) else 0) for index, robot in enumerate(robots)))
    parts += [_ring(robot.lamps) for robot in robots]
    return b"".join(parts)


def change(old: Snapshot, new: Snapshot) -> Json | None:
    """Return what stands elsewhere or shines otherwise than before, or None if nothing does."""
    found: Json = {}
    _note(found, "boxes", _moved(old.boxes, new.boxes), lambda box: [box.x, box.y, box.angle])
    _note(found, "cylinders", _moved(old.cylinders, new.cylinders), lambda post: [post.x, post.y])
    _note(found, "lights", _moved(old.lights, new.lights), lambda light: [asdict(light)])
    _note(found, "sounds", _moved(old.sounds, new.sounds), lambda sound: [asdict(sound)])
    return found or None


def readings(control: Control, snapshot: Snapshot, robot: int) -> Json:
    """Return what one robot perceives and how it is connected.

    The infrared readings are those of the beams, without noise: a reading the robot is told counts into the world's
    hash, and whoever looks on must not change it.

    Args:
        control: Knows the links.
        snapshot: The world, with beams.
        robot: Which one.
    """
    link = control.link(robot)
    return {
        "kind": "readings",
        "robot": robot,
        "proximity": [round(beam.strength * FULL_SCALE) for beam in snapshot.robots[robot].beams],
        "encoders": list(control.world.encoders(robot)),
        "link": {
            "connected": link.is_connected,
            "cut": link.is_cut,
            "latency": link.latency,
            "jitter": link.jitter,
            "loss": link.loss,
        },
    }


def wish(message: Mapping[str, object], robots: int) -> tuple[str, int | bool | None] | None:
    """Return what a page wants to see, or None if *message* is one for the control door.

    ``{"do": "rays", "on": true}`` gives ``("rays", True)``, ``{"do": "watch", "robot": 2}`` ``("watch", 2)`` and with
    null ``("watch", None)``.

    Raises:
        ArgumentError: It is half of that.
    """
    match message:
        case {"do": "rays", "on": bool(on)}:
            return "rays", on
        case {"do": "watch", "robot": None}:
            return "watch", None
        case {"do": "watch", "robot": int(robot)} if not isinstance(robot, bool) and 0 <= robot < robots:
            return "watch", robot
        case {"do": "rays" | "watch"}:
            raise ArgumentError('it must be {"do": "rays", "on": true} or {"do": "watch", "robot": INDEX}')
    return None


def _box(box: Box) -> Json:
    return {
        "name": box.name,
        "x": box.x,
        "y": box.y,
        "angle": box.angle,
        "width": box.width,
        "depth": box.depth,
        "colour": str(box.colour),
        "pushable": box.is_pushable,
    }


def _post(post: Cylinder) -> Json:
    return {
        "name": post.name,
        "x": post.x,
        "y": post.y,
        "radius": post.radius,
        "colour": str(post.colour),
        "pushable": post.is_pushable,
    }


def _floats(values: list[float]) -> bytes:
    return struct.pack(f"<{len(values)}f", *values)


def _bits(robot: RobotView) -> int:
    lamps = robot.lamps
    return robot.touching * TOUCHING | lamps.body * BODY | lamps.front * FRONT


@lru_cache(256)
def _ring(lamps: Lamps) -> bytes:
    return bytes(part for colour in lamps.ring for part in Colour(*colour))


def _moved(old: Sequence[_Thing], new: Sequence[_Thing]) -> list[tuple[int, _Thing]]:
    if old is new:
        return []
    pairs = enumerate(zip(old, new, strict=True))
    return [(index, after) for index, (before, after) in pairs if before is not after and before != after]


def _note(found: Json, key: str, moved: list[tuple[int, _Thing]], numbers: Callable[[_Thing], list[object]]) -> None:
    if moved:
        found[key] = [[index, *numbers(thing)] for index, thing in moved]
