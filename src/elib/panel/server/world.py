"""What a page is told of a virtual world: the scene once, then frames of what moves, and what else has changed.

A frame is little-endian binary: number (uint32), flags (uint32, 1: with rays), simulated time (float64, s), robots
(uint32), 4 bytes of nothing; then x, y, heading of every robot (float32, m and rad); with rays start, end (m) and
strength of eight of each robot (40 float32); a byte of bits each (1 touching, 2 body light, 4 front LED, 8 link cut);
and 24 bytes each of the ring's colours. The rest is JSON.

Frames are made only while a page looks, from an immutable snapshot, and at most :data:`SHARE` of the time goes into
them. A page that does not keep up gets fewer.
"""

from __future__ import annotations

import asyncio
import base64
import struct
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from functools import lru_cache
from io import BytesIO
from typing import Protocol, TypeVar

import msgspec

from elib.simulator.drawing.floor import floor_picture
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.control_server import time_factor, told
from elib.simulator.emulator.simulation import Simulation
from elib.simulator.physics import Box, Colour, Cylinder, Lamps, RobotView, Snapshot
from elib.simulator.physics.fittings import FLOOR_COLOUR
from elib.simulator.physics.floor import packed

HEADER = struct.Struct("<IIdIxxxx")
RAYS = 1
TOUCHING, BODY, FRONT, CUT = 1, 2, 4, 8
RATE = 25.0
"""Frames a second of the wall clock, at most."""
SHARE = 0.1
"""How much of the time may go into frames: of a huge crowd there are fewer."""
AHEAD = 2
"""Frames on their way to a page that has not drawn them yet, at most."""
EVERY = 3
"""Frames from one look at a robot's readings to the next: more could not be read."""

Json = dict[str, object]
_Thing = TypeVar("_Thing")


class Viewer(Protocol):
    """A page, as far as it shows a world.

    Attributes:
        wants_rays: Whether it shows the rays of the infrared sensors.
        watched: The robot whose readings it shows, by its index; None for none.
    """

    wants_rays: bool
    watched: int | None

    @property
    def world(self) -> Control | None:
        """The control of the world that it shows, or None."""

    @property
    def own(self) -> int | None:
        """The index of the page's own robot in that world, or None."""

    async def send(self, data: bytes, *, is_text: bool = True) -> None:
        """Send a text, or a frame."""


class WorldUpdates:
    """Sends one page the world that it shows, while there is one.

    Args:
        page: The page.
    """

    def __init__(self, page: Viewer) -> None:
        self._page = page
        self._place: tuple[Simulation, int | None] | None = None  # the world that is shown, and the page's own robot
        self._seen: Snapshot | None = None
        self._said: Json = {}
        self._number = self._drawn = 0

    def drawn(self, number: int) -> None:
        """Note how far the page has come."""
        self._drawn = min(max(self._drawn, number), self._number)

    async def send(self) -> None:
        """Send what changes until the page is gone."""
        loop, factor = asyncio.get_running_loop(), time_factor()
        while True:
            began = loop.time()
            await self._send_next()
            cost = loop.time() - began
            await asyncio.sleep(max(factor / RATE - cost, cost / SHARE))

    async def _send_next(self) -> None:
        page, control = self._page, self._page.world
        place = None if control is None else (control.simulation, page.own)
        if place != self._place:
            self._place, self._seen, self._drawn = place, None, self._number
            if control is None:
                await self._tell({"type": "scene", "scene": None})
        if control is None or self._number - self._drawn >= AHEAD:
            return
        self._number += 1
        looks = page.watched is not None and self._number % EVERY == 0
        snapshot = control.snapshot(beams=looks or page.wants_rays)
        packed_frame = frame(snapshot, self._number, control.is_cut, rays=page.wants_rays)
        await self._tell_changes(control, snapshot)
        if looks and page.watched is not None and page.watched < len(snapshot.robots):
            await self._tell(readings(control, snapshot, page.watched))
        await page.send(packed_frame, is_text=False)

    async def _tell_changes(self, control: Control, snapshot: Snapshot) -> None:
        seen, self._seen = self._seen, snapshot
        said, self._said = self._said, settings(control)
        if seen is None:
            floor = _floor_png(snapshot) if snapshot.floor.columns else None
            about = {**scene(snapshot), **self._said}
            about |= {"names": list(control.names), "own": self._page.own, "floor_png": floor}
            await self._tell({"type": "scene", "scene": about})
            return
        found = change(seen, snapshot) or {}
        found |= {key: value for key, value in self._said.items() if value != said[key]}
        if found:
            await self._tell({"type": "change"} | found)

    async def _tell(self, message: Json) -> None:
        await self._page.send(msgspec.json.encode(message))


def _floor_png(snapshot: Snapshot) -> str:
    """Return the painted floor as the address of a picture."""
    out = BytesIO()
    floor_picture(snapshot.floor).save(out, "PNG")
    return f"data:image/png;base64,{base64.b64encode(out.getvalue()).decode()}"


def settings(control: Control) -> Json:
    """Return what a hand can set in a world as a whole: the room's light, and its clock."""
    clock = control.simulation.clock
    return {
        "ambient": control.ambient,
        "clock": {"paused": clock.is_paused, "speed": clock.rate * time_factor(), "fixed": clock.refusal},
    }


def scene(snapshot: Snapshot) -> Json:
    """Return what the page has to know once."""
    floor, plain = snapshot.floor, packed(FLOOR_COLOUR)
    return {
        "world": snapshot.name,
        "width": snapshot.width,
        "depth": snapshot.depth,
        "walls": _walls(snapshot),
        "floor": {
            # The colour of bare linoleum is left to the page, which has a light and a dark one.
            "colour": None if floor.colour == plain else f"#{floor.colour:06x}",
            "picture": bool(floor.columns),
            "width": floor.columns / floor.scale if floor.columns else 0.0,
            "depth": floor.rows / floor.scale if floor.columns else 0.0,
        },
        "robots": len(snapshot.robots),
        "radius": max((robot.radius for robot in snapshot.robots), default=0.0),
        "boxes": [_box(box) for box in snapshot.boxes],
        "cylinders": [_post(post) for post in snapshot.cylinders],
        "lights": [asdict(light) for light in snapshot.lights],
        "sounds": [asdict(sound) for sound in snapshot.sounds],
    }


def frame(snapshot: Snapshot, number: int, is_cut: Callable[[int], bool], *, rays: bool) -> bytes:
    """Return what moves, packed.

    Args:
        snapshot: The world, with the beams of all robots if there are to be rays.
        number: Number of the frame; the page repeats it when it has drawn the frame.
        is_cut: Tells of a robot's index whether its link is cut.
        rays: Whether to show the rays of the infrared sensors.
    """
    robots = snapshot.robots
    has_rays = rays and bool(robots)
    parts = [
        HEADER.pack(number & 0xFFFFFFFF, RAYS if has_rays else 0, snapshot.time, len(robots)),
        _floats([value for robot in robots for value in (robot.pose.x, robot.pose.y, robot.pose.heading)]),
    ]
    if has_rays:
        beams = [beam for robot in robots for beam in robot.beams]
        parts.append(_floats([value for beam in beams for value in (*beam.start, *beam.end, beam.strength)]))
    parts.append(bytes(_bits(robot) | (CUT if is_cut(index) else 0) for index, robot in enumerate(robots)))
    parts += [_ring(robot.lamps) for robot in robots]
    return b"".join(parts)


def change(old: Snapshot, new: Snapshot) -> Json | None:
    """Return what stands elsewhere or shines otherwise than before, or None if nothing does.

    ``boxes`` has those that moved, ``all_boxes`` and ``walls`` have all of them after one was added or removed.
    """
    found: Json = {}
    if old.walls != new.walls:
        found["walls"] = _walls(new)
    if len(old.boxes) != len(new.boxes):
        found["all_boxes"] = [_box(box) for box in new.boxes]
        old = replace(old, boxes=new.boxes)
    _note(found, "boxes", _moved(old.boxes, new.boxes), lambda box: [box.x, box.y, box.angle])
    _note(found, "cylinders", _moved(old.cylinders, new.cylinders), lambda post: [post.x, post.y])
    _note(found, "lights", _moved(old.lights, new.lights), lambda light: [asdict(light)])
    _note(found, "sounds", _moved(old.sounds, new.sounds), lambda sound: [asdict(sound)])
    return found or None


def readings(control: Control, snapshot: Snapshot, robot: int) -> Json:
    """Return what one robot perceives and how it is connected.

    The infrared readings are those of the beams: a reading the robot is told counts into the world's hash, and a page
    that looks must not change it.

    Args:
        control: Knows the links.
        snapshot: The world, with beams.
        robot: Which one.
    """
    virtual = control.simulation.robots.get(robot)
    found: Json = {
        "type": "readings",
        "robot": robot,
        "proximity": [beam.reading for beam in snapshot.robots[robot].beams],
        "encoders": list(control.world.encoders(robot)),
        "link": told(control.link(robot)),
    }
    if virtual is not None:
        own, hardware = virtual.settings, control.hardware(robot)
        found["base"] = {"latency": own.latency, "jitter": own.jitter, "loss": own.loss}
        found["selector"] = hardware.selector()
        found["button"] = hardware.button_is_pressed() if control.has_button(robot) else None
    return found


def _walls(snapshot: Snapshot) -> list[list[object]]:
    return [[wall.x1, wall.y1, wall.x2, wall.y2, str(wall.colour)] for wall in snapshot.walls]


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
