"""What a world tells of itself: poses, wheel steps, what its robots sense and show, a picture and a digest of it."""

from __future__ import annotations

import hashlib
import math
import operator
import struct
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from os import PathLike
from typing import TYPE_CHECKING, Any

from elib.base.errors import ArgumentError
from elib.base.pose import Pose
from elib.simulator.physics.fittings import ROBOTS, Zone
from elib.simulator.physics.floor import Floor, packed
from elib.simulator.physics.geometry import Box, Colour, Cylinder
from elib.simulator.physics.hearing import waveform
from elib.simulator.physics.noise import tick_key
from elib.simulator.physics.optics import CHIPS, broken_row
from elib.simulator.physics.rangebearing import Heard, RangeAndBearing
from elib.simulator.physics.records import Records, Robot, SensorView, Thing
from elib.simulator.physics.scene import Scene
from elib.simulator.physics.senses import Senses
from elib.simulator.physics.sensors.rotation import rocking
from elib.simulator.physics.snapshot import Event, Lamps, RobotView, Snapshot
from elib.simulator.physics.state import State
from elib.simulator.physics.zones import KEPT, KINDS, area_at, is_free

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

DARK = Lamps()
ROUNDING = 1e-6
"""Steps. A sum of many parts falls just short of a whole number: it counts from here on."""

SHOWN = 10  # Numbers a robot in what the camera gets: eight colours, body, front.


class ReadableWorld:
    """All of a :class:`~elib.simulator.physics.world.World` that changes nothing."""

    _state: State
    _senses: Senses
    _boards: RangeAndBearing
    _lamps: dict[int, Lamps]
    _memory: Any
    _memory_size: int
    _told: tuple[Event, ...]  # the events until boxes last came or went: their numbers stood for other things

    @property
    def scene(self) -> Scene:
        """What it was made from, with the walls and boxes that came and went since."""
        return self._state.scene

    @property
    def robots(self) -> int:
        """How many there are."""
        return len(self._state.world.robots)

    @property
    def records(self) -> Records:
        """The records of the world as its engine keeps them: for reward functions, which only read them."""
        return self._state.world

    @property
    def tick(self) -> int:
        """Whole ticks since the start."""
        return int(self._state.world.setting[0].tick)

    @property
    def time(self) -> float:
        """Since the start, s: whole ticks."""
        return self.tick * self.scene.step

    @property
    def poses(self) -> list[Pose]:
        """Where each robot stands, in order of insertion."""
        return [Pose(x, y, math.atan2(sine, cosine)) for x, y, cosine, sine in self._places().tolist()]

    @property
    def poses_array(self) -> NDArray[np.float64]:
        """Where each robot stands: x, y, m, and heading, rad, in the shape (robots, 3). A copy."""
        import numpy as np

        placed = self._places()
        # NumPy's arctan2 has another last bit than that of single poses.
        headings = np.array([*map(math.atan2, placed[:, 3].tolist(), placed[:, 2].tolist())], dtype=np.float64)
        return np.column_stack((placed[:, :2], headings))

    @property
    def encoders_array(self) -> NDArray[np.int64]:
        """Steps issued to the left and the right wheel of each robot, in the shape (robots, 2). A copy."""
        import numpy as np

        robots = self._state.world.robots
        steps = [self._state.engine.column(Robot, robots, name) for name in ("left_steps", "right_steps")]
        return np.floor(np.stack(steps, axis=1) + ROUNDING).astype(np.int64)

    @property
    def proximity_array(self) -> NDArray[np.int64]:
        """What the infrared sensors of each robot read (:meth:`proximity`), in the shape (robots, 8). A copy."""
        return self.readings("proximity")

    @property
    def fitness(self) -> NDArray[np.float64]:
        """What each robot's control function wrote into its ``fitness``; 0 before. In the shape (robots,). A copy."""
        return self._state.engine.column(SensorView, self._state.world.views, "fitness").copy()

    @property
    def memory(self) -> NDArray[np.float64]:
        """What the control function of each robot remembers, in the shape (robots, n). A copy."""
        import numpy as np

        remembered = [] if self._memory is None else self._memory
        return np.array(remembered, dtype=np.float64).reshape(self.robots, self._memory_size)

    def readings(self, sensor: str) -> NDArray[Any]:
        """Return what a sensor of every robot reads now, by the sensor's name: ``"ground"``, ``"distance"``...

        Returns:
            In the shape (robots, n), or (robots,) for a sensor that reads one number. A copy.

        Raises:
            ArgumentError: There is no such sensor.
        """
        return self._senses.readings(sensor)

    def _places(self) -> NDArray[np.float64]:
        import numpy as np

        robots = self._state.world.robots
        names = ("x", "y", "heading_x", "heading_y")
        return np.stack([self._state.engine.column(Robot, robots, name) for name in names], axis=1)

    def pose(self, robot: int) -> Pose:
        """Return where one robot stands."""
        here = self._robot(robot)
        return Pose(float(here.x), float(here.y), math.atan2(here.heading_y, here.heading_x))

    def encoders(self, robot: int) -> tuple[int, int]:
        """Return the steps issued to the left and the right wheel since the start, whether or not it could follow."""
        here = self._robot(robot)
        return _whole(here.left_steps), _whole(here.right_steps)

    def wheel_speeds(self, robot: int) -> tuple[float, float]:
        """Return how fast the wheels are asked to turn, left and right: speeds of a nominal wheel's rim, m/s."""
        here = self._robot(robot)
        return float(here.left_speed), float(here.right_speed)

    def proximity(self, robot: int) -> list[int]:
        """Return the reflected light of the eight infrared sensors, counts, 0..4095, higher is nearer."""
        return self._senses.reading("proximity", self._index(robot))

    def ambient_light(self, robot: int) -> list[int]:
        """Return the infrared sensors' readings with emitters off, counts, 0..4095, higher is darker."""
        return self._senses.reading("ambient_light", self._index(robot))

    def distance(self, robot: int) -> float:
        """Return what the time-of-flight sensor measures before its bias, m; its reach, 2 m, where it sees nothing."""
        return float(self._senses.reading("distance", self._index(robot))[0])

    def ground(self, robot: int) -> list[int]:
        """Return the ground sensors left, centre, right and the cliff sensors left, right, counts, 0..1000."""
        return self._senses.reading("ground", self._index(robot))

    def microphones(self, robot: int) -> list[int]:
        """Return the microphones right, left, rear, front, counts peak to peak, 0..4095."""
        return self._senses.reading("microphones", self._index(robot))

    def waveform(self, robot: int, numbers: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return samples of the robot's microphones, counts around 0, at 16,384 Hz.

        Args:
            robot: Index.
            numbers: Which samples, counted from the start: one row a microphone, right, left, rear, front.
        """
        return waveform(self._state, self._index(robot), numbers)

    def acceleration(self, robot: int) -> list[float]:
        """Return the acceleration forward, to the left and upwards, m/s2; (0, 0, 9.81) at rest."""
        return self._senses.reading("acceleration", self._index(robot))

    def rotation(self, robot: int) -> float:
        """Return the rate of turn about the upright axis, rad/s, positive to the left."""
        return float(self._senses.reading("rotation", self._index(robot))[0])

    def rocking(self, robot: int) -> tuple[float, float]:
        """Return what the gyroscope reads about the forward and the leftward axis, rad/s: noise, and its offset."""
        forward, leftward = rocking(self._state.world, self._index(robot))  # Too little to be compiled.
        return float(forward), float(leftward)

    def neighbours(self, robot: int) -> list[Heard]:
        """Return what a robot hears of others by range and bearing, the nearest first.

        The model is described in :mod:`elib.simulator.physics.rangebearing`.
        """
        return self._boards.heard(self._index(robot))

    def picture(
        self, robot: int, right: Sequence[float], up: Sequence[float], *, generation: int | None = None
    ) -> NDArray[np.uint8]:
        """Return what the robot's camera sees, upright.

        Args:
            robot: Index.
            right: Offset of each column's centre to the right of the optical axis, sensor pixels, evenly spaced.
            up: Offset of each row's centre above it, the same.
            generation: Whose camera it has, 1 or 2 (e-puck2); the model's if this is None.

        Returns:
            Red, green, blue, 0..255, in the shape (rows, columns, 3).

        Raises:
            ArgumentError: There is no such robot, or offsets are not finite or not evenly spaced.
        """
        picture: NDArray[np.uint8] = self.pictures((robot,), right, up, generation=generation)[0]
        return picture

    def pictures(
        self,
        robots: Sequence[int] | None,
        right: Sequence[float],
        up: Sequence[float],
        *,
        generation: int | None = None,
    ) -> NDArray[np.uint8]:
        """Return what the cameras of several robots see, upright: faster than one picture after the other.

        Args:
            robots: Indices; None means all robots.
            right: Offset of each column's centre to the right of the optical axis, sensor pixels, evenly spaced.
            up: Offset of each row's centre above it, the same.
            generation: Whose camera they have, 1 or 2 (e-puck2); the model's if this is None.

        Returns:
            Red, green, blue, 0..255, in the shape (robots, rows, columns, 3).

        Raises:
            ArgumentError: There is no such robot, or offsets are not finite or not evenly spaced.
        """
        chosen = range(self.robots) if robots is None else [self._index(robot) for robot in robots]
        chip = CHIPS[generation or self.scene.model.generation]
        return self._senses.pictures(chip, chosen, self._shown(), (right, up))

    def broken_row(self, robot: int, rows: int) -> int | None:
        """Return in which of so many rows the robot's camera loses a byte at this tick; None, mostly."""
        setting, here = self._state.world.setting[0], self._robot(robot)
        return broken_row(tick_key(int(here.key), int(setting.tick)), float(setting.spread), rows)

    def _shown(self) -> NDArray[np.int64]:
        """Return what each robot shows, as the camera takes it; an array of size 0 if no robot shows anything."""
        import numpy as np

        if not self._lamps:
            return np.zeros((0, SHOWN), np.int64)
        shown = [self._lamps.get(i, DARK) for i in range(self.robots)]
        return np.array([[*map(packed, lamps.ring), int(lamps.body), int(lamps.front)] for lamps in shown])

    def laid_out(self) -> dict[str, Any]:
        """Return what stands in the world as parts of a scene: doors closed, pucks that are away where they began.

        Where a robot stands there, a puck is where it may come back. What one that is gone for good switched, nothing
        switches any more.
        """
        state, things = self._state, self._state.world.things
        posts: list[Cylinder] = []
        for k, (thing, post) in enumerate(zip(state.solids.cylinder_things, state.cylinders, strict=True)):
            if thing < 0 or things[thing].back < 0:
                posts.append(state.cylinder(k))
            elif post.respawn:
                posts.append(self._back(post, int(things[thing].respawn), posts))
        there = {ROBOTS, *(box.name for box in state.boxes), *(post.name for post in posts)}
        robots = [(here.x, here.y, here.radius) for here in state.world.robots]
        doors = [box for box in state.boxes if box.switch]
        in_the_way = {door.switch for door in doors if any(door.distance(x, y) < room for x, y, room in robots)}
        zones = []
        for zone in self.zones:
            # A door that waits for a robot begins open, and waits again from the first tick on.
            waits = zone.name in in_the_way and bool(zone.outline) and not zone.stays
            zones.append(replace(zone, is_on=zone.is_on or waits, by=zone.by if zone.by in there else ""))
        return {
            "zones": tuple(zones),
            "boxes": tuple(box if box.switch else state.box(k) for k, box in enumerate(state.boxes)),
            "cylinders": tuple(posts),
            "lights": tuple(state.lights),
            "sounds": tuple(state.sounds),
            "pens": tuple(
                None if here.pen < 0 else Colour(*int(here.pen).to_bytes(3, "big")) for here in state.world.robots
            )
            if state.world.setting[0].has_pens
            else (),
        }

    def _back(self, puck: Cylinder, field: int, others: Sequence[Cylinder]) -> Cylinder:
        """Return a puck where it began; if a robot stands there, at the first free place of the zone of that number."""
        world, areas = self._state.world, self._state.areas
        if all(puck.distance(here.x, here.y) >= here.radius for here in world.robots):
            return puck
        for cell in range(len(areas.cells)):
            x, y = (cell % areas.columns + 0.5) / areas.scale, (cell // areas.columns + 0.5) / areas.scale
            has_room = area_at(world, x, y) >> field & 1 and is_free(world, x, y, puck.radius)
            if has_room and all(each.distance(x, y) > puck.radius for each in others):
                return replace(puck, x=x, y=y)
        return puck

    def touching(self, robot: int) -> bool:
        """Return whether the robot was in contact with anything in the last tick."""
        return bool(self._robot(robot).touched > 0)

    @property
    def zones(self) -> tuple[Zone, ...]:
        """The zones as they are now: switched on or not, and with what is left to give."""
        found = []
        for zone, state in zip(self.scene.zones, self._state.world.zones, strict=True):
            store = None if zone.store is None else float(state.store)
            is_same = (zone.is_on, zone.store) == (state.is_on, store)
            found.append(zone if is_same else replace(zone, is_on=bool(state.is_on), store=store))
        return tuple(found)

    @property
    def floor(self) -> Floor:
        """The floor with all that is painted on it and that pens drew."""
        return self._state.inked()

    def zones_of(self, robot: int) -> tuple[str, ...]:
        """Return the names of the zones in which the middle of a robot was at the end of the last tick."""
        inside = int(self._robot(robot).zones)
        return tuple(zone.name for k, zone in enumerate(self.scene.zones) if inside >> k & 1)

    def energy(self, robot: int) -> float:
        """Return what a robot has left of its energy, 0..1; 1 in a world whose robots do not tire."""
        return float(self._robot(robot).energy)

    def score(self, robot: int | None = None) -> float:
        """Return the points of a robot, or of all together."""
        if robot is None:
            return sum(float(here.score) for here in self._state.world.robots)
        return float(self._robot(robot).score)

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened to zones, doors, pucks and the energy of robots, the last 256, oldest first."""
        log = self._state.world.states
        count = int(log[0]) if len(log) else 0
        told = {event.number: event for event in self._told}
        return tuple(told.get(n) or self._event(n, *map(int, log[at : at + 4])) for n, at in _last(count))

    def _event(self, number: int, tick: int, kind: int, what: int, robot: int) -> Event:
        named, solids = KINDS[kind], self._state.solids
        name = ""
        if named in ("open", "closed", "collect", "respawn"):
            boxes, posts = solids.box_things, solids.cylinder_things
            kind_of, k = ("box", boxes.index(what)) if what in boxes else ("cylinder", posts.index(what))
            things: tuple[Box | Cylinder, ...] = self.scene.boxes if kind_of == "box" else self.scene.cylinders
            name = things[k].name or f"{kind_of} {k}"
        elif what >= 0:
            name = self.scene.zones[what].name
        return Event(number, tick * self.scene.step, named, name, None if robot < 0 else robot)

    @property
    def ambient(self) -> float:
        """What an infrared sensor reads in the room's own light, counts."""
        return float(self._state.world.setting[0].ambient)

    def snapshot(self, *, beams: bool = False) -> Snapshot:
        """Return the world as it is now, frozen.

        Args:
            beams: Also cast each robot's infrared sensors.
        """
        scene, state = self.scene, self._state
        robots = tuple(
            RobotView(
                self.pose(i),
                float(state.world.robots[i].radius),
                self.touching(i),
                self._lamps.get(i, DARK),
                self._senses.beams(i) if beams else (),
                float(state.world.robots[i].energy),
                float(state.world.robots[i].score),
            )
            for i in range(self.robots)
        )
        return Snapshot(
            scene.name,
            self.tick,
            self.time,
            scene.width,
            scene.depth,
            scene.fixed_walls,
            tuple(state.box(k) for k in range(len(state.boxes))),
            tuple(state.cylinder(k) for k in range(len(state.cylinders))),
            robots,
            state.switched(state.lights),
            state.switched(state.sounds),
            state.floor,
            self.zones,
            scene.polygons,
        )

    def draw(
        self,
        path: str | PathLike[str] | None = None,
        *,
        trails: Sequence[Sequence[Pose]] = (),
        beams: bool = True,
        caption: str | None = None,
        size: int = 900,
    ) -> str | None:
        """Draw the world from above, as SVG or PNG.

        Args:
            path: File to write, ending in ``.svg`` or ``.png``; None returns SVG text instead.
            trails: Where each robot was, oldest first, in the order of the robots; pale is old.
            beams: Show the infrared sensors.
            caption: Line below the picture; None makes one, "" leaves it empty.
            size: Pixels of the arena's longer side, 200..8000.

        Raises:
            ArgumentError: *path* ends in something else, *size* is out of its range, or the file cannot be created.
            ElibError: The disk is full.
        """
        drawing = import_module("elib.simulator.drawing")  # it is above the physics, and goes by name
        seen = replace(self.snapshot(beams=beams), floor=self.floor)
        drawn: str | None = drawing.draw(seen, path, trails=trails, caption=caption, size=size)
        return drawn

    def _repr_svg_(self) -> str | None:
        """Show the world in a notebook."""
        return self.draw(size=450)

    def hash(self, *sensors: str) -> str:
        """Return a digest of the run: equal runs have equal digests, whichever sensors were read and by whomever.

        It covers the tick, every pose to the last bit, the encoders, and what the infrared, inertial and ground
        sensors read now.

        Args:
            sensors: Cover also everything that these sensors told since the start, such as ``"proximity"``: then the
                digest depends on when they were asked.
        """
        digest = hashlib.blake2b(struct.pack("<q", self.tick), digest_size=16)
        world = self._state.world
        for i, here in enumerate(world.robots):
            digest.update(struct.pack("<4d2q", *_place(here), *self.encoders(i)))
            digest.update(self._senses.now(i))
        for thing in world.things:
            digest.update(struct.pack("<4d", *_place(thing)))
        if world.setting[0].has_states:
            for zone in world.zones:
                digest.update(struct.pack("<2qd", zone.is_on, zone.count, zone.store))
            for here in world.robots:
                digest.update(struct.pack("<2dq", here.energy, here.score, here.zones))
            digest.update(struct.pack(f"<{len(world.states)}i", *world.states))
        digest.update(self._senses.told(sensors))
        return digest.hexdigest()

    def _index(self, robot: int) -> int:
        return checked(robot, self.robots, "robot")

    def _robot(self, robot: int) -> Robot:
        return self._state.world.robots[self._index(robot)]


def _place(record: Robot | Thing) -> tuple[float, float, float, float]:
    return record.x, record.y, record.heading_x, record.heading_y


def checked(index: int, count: int, what: str) -> int:
    """Return an index as a whole number.

    Args:
        index: As the caller gave it.
        count: How many there are.
        what: What is counted, for messages.

    Raises:
        ArgumentError: It is not a whole number, or there is nothing with that index.
    """
    try:
        index = operator.index(index)
    except TypeError:
        raise ArgumentError(f"the {what} is {index!r}; it must be a whole number, counted from 0") from None
    if not 0 <= index < count:
        raise ArgumentError(f"there is no {what} {index}; the world has {count}, counted from 0")
    return index


def _last(count: int) -> list[tuple[int, int]]:
    """Return the numbers of the events that are remembered, and where each lies."""
    return [(n, 1 + 4 * (n % KEPT)) for n in range(max(count - KEPT, 0), count)]


def _whole(steps: float) -> int:
    return math.floor(steps + ROUNDING)
