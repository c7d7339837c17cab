"""What a world is made of while it runs: its records, in the form that its engine takes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any, TypeVar, cast

from elib.base.errors import ArgumentError
from elib.base.pose import Pose
from elib.simulator.physics import assembly, profiles, records
from elib.simulator.physics.body import EpuckModel
from elib.simulator.physics.engine import Engine, engine_named
from elib.simulator.physics.faces import Faces
from elib.simulator.physics.fittings import ROBOTS, Light, Sound
from elib.simulator.physics.floor import Floor, packed
from elib.simulator.physics.geometry import Box, Cylinder, Wall, unit
from elib.simulator.physics.motion import STEPS_PER_METRE
from elib.simulator.physics.neighbours import NEAR_WALLS, list_near
from elib.simulator.physics.noise import seed_key
from elib.simulator.physics.pushing import follow
from elib.simulator.physics.records import Records
from elib.simulator.physics.scene import Scene
from elib.simulator.physics.sensors.proximity import forget
from elib.simulator.physics.simulation import advance
from elib.simulator.physics.spawning import spawn, stand
from elib.simulator.physics.zones import FIRST_INK, areas_of, open_cells, zone_state

PLACE = "x", "y", "heading_x", "heading_y"
"""Where a robot or a thing stands, to the last bit, which an angle does not keep."""
MOTION = *PLACE, "speed_x", "speed_y", "spin", "open", "back"
ZONE = "is_on", "hand", "count", "store"
LIFE = "energy", "was_told", "score", "zones", "pen"
"""What a zone and a robot are in at a moment."""
_Lit = TypeVar("_Lit", Light, Sound)


@dataclass(frozen=True, slots=True)
class Moment:
    """What a world was at one moment: :meth:`~elib.simulator.physics.world.World.go_back` makes it so again."""

    time: float  # s since the start
    scene: Scene  # with the walls and the boxes that there were
    boxes: tuple[Box, ...]  # as they were laid out
    cylinders: tuple[Cylinder, ...]  # the same
    lights: tuple[Light, ...]
    sounds: tuple[Sound, ...]
    ambient: float  # the room's light, counts
    robots: list[tuple[float, ...]]  # where each robot stood
    things: list[tuple[float, ...]]  # where each thing that can move was, and how it moved
    zones: list[tuple[float, ...]]  # the state of each zone
    lives: list[tuple[float, ...]]  # energy, score, zones and pen of each robot


class State:
    """A scene laid out for one engine.

    Attributes:
        scene: What it was made from.
        engine: How its kernels run.
        lanes: Into how many blocks its robots are divided; those of different blocks can be sensed at the same time.
        floor: What is painted on the floor.
        areas: The map of the zones.
        faces: What walls and boxes show.
        world: All records.
        boxes: As they were laid out; pushable ones have moved since.
        cylinders: The same.
        lights: Lamps as they are now.
        sounds: Tones as they are now.
        solids: Where in the records the boxes and cylinders are.
    """

    world: Records
    solids: assembly.Solids

    def __init__(
        self, scene: Scene, starts: Sequence[Pose], seed: int, engine: Engine, floor: Floor, *, lanes: int = 1
    ) -> None:
        self.scene, self.engine, self.floor, self.lanes = scene, engine, floor, lanes
        self.areas = areas_of(scene)
        self.faces: Faces = {"": 0}
        count = len(starts)
        self.boxes, self.cylinders = list(scene.boxes), list(scene.cylinders)
        self.lights, self.sounds = list(scene.lights), list(scene.sounds)
        self.world = Records(
            robots=engine.blank(records.Robot, count),
            views=engine.blank(records.SensorView, count),
            scratch=engine.blank(records.Scratch, lanes),
            **_tables(engine.name, scene.model),
            **self._solid_rows(count),
            lamps=engine.blank(records.Lamp, 0),
            tones=engine.blank(records.Tone, 0),
            zones=engine.blank(records.ZoneState, 0),
            states=engine.ints([]),
        )
        for lane in range(lanes):
            for i in range(lane * count // lanes, (lane + 1) * count // lanes):
                self.world.robots[i].lane = lane
        self.relight()
        self.spawn(starts, seed)

    def spawn(self, starts: Sequence[Pose], seed: int) -> None:
        """Put every robot to its start, and the noise and all states to their beginning."""
        scene, engine = self.scene, self.engine
        self.world = self.world._replace(
            zones=engine.records(records.ZoneState, [zone_state(zone) for zone in scene.zones]),
            states=engine.ints([], self._room_for_states()),
        )
        self._find_keys()
        energies = scene.energies + (None,) * len(starts)
        pens = scene.pens + (None,) * len(starts)
        whole = scene.energy.start if scene.energy else 1.0
        for robot, energy, pen in zip(self.world.robots, energies, pens, strict=False):
            robot.full = whole if energy is None else energy
            robot.pen = -1 if pen is None else packed(pen)
        table = self.engine.table([(pose.x, pose.y, *unit(pose.heading)) for pose in starts] or [[0.0] * 4])
        self.engine.ready(spawn)(self.world, table, seed_key(seed))
        self.list_near()

    def _room_for_states(self) -> int:
        setting = self.world.setting[0]
        return (FIRST_INK + setting.has_pens * len(self.areas.cells)) if setting.has_states else 0

    def _find_keys(self) -> None:
        """Tell each zone which thing switches it."""
        things: list[Box | Cylinder] = [*self.scene.boxes, *self.scene.cylinders]
        places = [*self.solids.box_things, *self.solids.cylinder_things]
        numbers = {ROBOTS: -2} | {thing.name: k for thing, k in zip(things, places, strict=True) if thing.name}
        for zone, state in zip(self.scene.zones, self.world.zones, strict=True):
            state.key = numbers.get(zone.by, -1)

    def reset(self, starts: Sequence[Pose], seed: int) -> None:
        """Go back to the beginning with other starts and another seed."""
        before = _fixed(self.boxes), _fixed(self.cylinders)
        self.boxes, self.cylinders = list(self.scene.boxes), list(self.scene.cylinders)
        self.lights, self.sounds = list(self.scene.lights), list(self.scene.sounds)
        if before == (_fixed(self.boxes), _fixed(self.cylinders)):
            self._put_things_back()
        else:
            self.world = self.world._replace(**self._solid_rows(len(starts)))
        self.world = self.world._replace(views=self.engine.blank(records.SensorView, len(starts)))
        self.world.setting[0].ambient = self.scene.model.ambient
        self.relight()
        self.spawn(starts, seed)

    def _put_things_back(self) -> None:
        """Put everything that can be pushed where the scene has it: laying out the whole floor takes far longer."""
        world = self.world
        for box, k in zip(self.boxes, self.solids.box_things, strict=True):
            if k >= 0:
                first = int(world.things[k].first)
                _overwrite(world.things[k], assembly.thing_record(box, self.scene, first))
                for n, side in enumerate(assembly.moved_box(box, world.things[k]).sides, first):
                    _overwrite(world.walls[n], assembly.wall_record(side, self.faces))
        for cylinder, k in zip(self.cylinders, self.solids.cylinder_things, strict=True):
            if k >= 0:
                first = int(world.things[k].first)
                _overwrite(world.things[k], assembly.thing_record(cylinder, self.scene, first))
                _overwrite(world.discs[first], assembly.disc_record(cylinder))

    def put_door(self, index: int) -> None:
        """Put a door where its box is laid out now."""
        k = self.solids.box_things[index]
        first = int(self.world.things[k].first)
        _overwrite(self.world.things[k], assembly.thing_record(self.boxes[index], self.scene, first))
        follow(self.world, k)
        self.list_near()

    def _solid_rows(self, count: int) -> dict[str, Any]:
        """Lay out everything solid; return the parts of the world that hold it."""
        engine = self.engine
        self.solids = solids = assembly.Solids.of(self.scene, self.boxes, self.cylinders, self.faces)
        profile = profiles.profile(self.scene.model.profile)
        grid = assembly.Grid(self.scene, solids, assembly.horizon_of(profile))
        setting = assembly.setting(self.scene, self.floor, self.areas, grid, profile, solids, count)
        cells, lists = assembly.listed(grid)
        setting.first_all = len(lists)
        lists += range(count + len(solids.things))
        setting.first_own = len(lists)
        setting.first_near = setting.first_own + count * NEAR_WALLS
        room = count * NEAR_WALLS + assembly.room_for_neighbours(count, len(solids.things), setting.horizon)
        visible = count + len(solids.discs)
        return {
            "setting": engine.records(records.Setting, [setting]),
            "walls": engine.records(records.Segment, solids.walls),
            "discs": engine.records(records.Disc, solids.discs),
            "things": engine.records(records.Thing, solids.things),
            "floor": _ground(engine.name, self.floor, open_cells(self.areas, self.scene, self.boxes)),
            "cells": engine.records(records.Cell, cells),
            "heads": engine.ints([], setting.hash_columns * setting.hash_rows),
            "listings": engine.records(records.Listing, assembly.listings(solids, count, setting.horizon)),
            "lists": engine.ints(lists, room),
            "visible_walls": engine.blank(records.Segment, len(solids.walls) * self.lanes),
            "visible_discs": engine.blank(records.Disc, visible * self.lanes),
        }

    def advance(self, ticks: int) -> None:
        """Run *ticks* ticks without sensing and without a controller."""
        self.engine.ready(advance)(self.world, ticks)

    def moment(self) -> Moment:
        """Return what the world is now."""
        world, setting = self.world, self.world.setting[0]
        return Moment(
            float(setting.tick * setting.step),
            self.scene,
            tuple(self.boxes),
            tuple(self.cylinders),
            tuple(self.lights),
            tuple(self.sounds),
            float(setting.ambient),
            [_values(robot, PLACE) for robot in world.robots],
            self._motions(),
            [tuple(getattr(zone, name) for name in ZONE) for zone in world.zones],
            [tuple(getattr(robot, name) for name in LIFE) for robot in world.robots],
        )

    def go_back(self, moment: Moment) -> None:
        """Make the world what it was at a moment; its time, and what is inside of the robots, goes on."""
        self.scene = moment.scene
        self.boxes, self.cylinders = list(moment.boxes), list(moment.cylinders)
        self.lights, self.sounds = list(moment.lights), list(moment.sounds)
        for robot, place in zip(self.world.robots, moment.robots, strict=True):
            stand(robot, *place)
            # What the wheels have rolled within this tick is counted, but moves the robot no more.
            robot.left_steps += robot.left_travel * STEPS_PER_METRE
            robot.right_steps += robot.right_travel * STEPS_PER_METRE
            robot.left_travel = robot.right_travel = 0.0
        self._lay_out(moment.things)
        for names, rows, then in ((ZONE, self.world.zones, moment.zones), (LIFE, self.world.robots, moment.lives)):
            for row, values in zip(cast("Sequence[object]", rows), then, strict=True):
                for name, value in zip(names, values, strict=True):
                    setattr(row, name, value)
        self.world.setting[0].ambient = moment.ambient
        self.relight()

    def rebuild(self) -> None:
        """Lay the solids out again after a fixed one was moved; pushable ones stay where they are."""
        self._follow_things()
        self._lay_out(self._motions())

    def add_box(self, box: Box) -> None:
        """Put a box into the world, the last one of its scene."""
        scene = replace(self.scene, boxes=(*self.scene.boxes, box))  # refused before anything changes
        things = self._motions()
        if box.can_move:  # Boxes come before cylinders.
            made = assembly.thing_record(box, self.scene)
            things.insert(sum(k >= 0 for k in self.solids.box_things), _values(made, MOTION))
        self._follow_things()
        self.boxes.append(box)
        self.scene = scene
        self._lay_out(things)

    def remove_box(self, index: int) -> None:
        """Take a box out of the world; those behind it in the scene move up.

        Raises:
            ArgumentError: It switches a zone.
        """
        name = self.boxes[index].name
        zone = next((zone.name for zone in self.scene.zones if name and zone.by == name), None)
        if zone is not None:
            raise ArgumentError(f"box {index} ({name}) stays: it switches the zone {zone}", hint="move it instead")
        things, gone = self._motions(), self.solids.box_things[index]
        if gone >= 0:
            del things[gone]
        self._follow_things()
        del self.boxes[index]
        boxes = self.scene.boxes
        self.scene = replace(self.scene, boxes=boxes[:index] + boxes[index + 1 :])
        self._lay_out(things)

    def set_walls(self, walls: tuple[Wall, ...]) -> None:
        """Replace all interior walls."""
        self.scene = replace(self.scene, walls=walls)
        self.rebuild()

    def _follow_things(self) -> None:
        """Note where the things that can be pushed are now, before all are laid out again."""
        self.boxes = [box if box.switch else self.box(k) for k, box in enumerate(self.boxes)]
        self.cylinders = [self.cylinder(k) for k in range(len(self.cylinders))]

    def _motions(self) -> list[tuple[float, ...]]:
        return [_values(thing, MOTION) for thing in self.world.things]

    def _lay_out(self, things: Sequence[tuple[float, ...]]) -> None:
        """Lay the solids out again; *things* say where the pushable ones are and how they move."""
        before = self.world
        self.world = before._replace(**self._solid_rows(len(before.robots)))
        setting = self.world.setting[0]
        for name in ("tick", "ambient", "key"):
            setattr(setting, name, getattr(before.setting[0], name))
        self._find_keys()
        for k, motion in enumerate(things):
            for name, value in zip(MOTION, motion, strict=True):
                setattr(self.world.things[k], name, int(value) if name == "back" else value)
            follow(self.world, k)
        self.list_near()

    def relight(self) -> None:
        """Lay lights and sounds out again after one was changed."""
        of = self.scene.zone_number
        lamps = [records.Lamp(a.x, a.y, a.height, a.intensity, of(a.switch)) for a in self.lights if a.intensity > 0.0]
        tones = [
            records.Tone(a.x, a.y, a.volume, a.every, a.lasts, of(a.switch)) for a in self.sounds if a.volume > 0.0
        ]
        self.world = self.world._replace(
            lamps=self.engine.records(records.Lamp, lamps), tones=self.engine.records(records.Tone, tones)
        )
        self.forget()

    def list_near(self) -> None:
        """List what is near whom again, after something was put elsewhere."""
        self.engine.ready(list_near)(self.world)
        self.forget()

    def forget(self) -> None:
        """Forget the infrared readings of this tick, after something changed that they depend on."""
        self.engine.ready(forget)(self.world)

    def box(self, index: int) -> Box:
        """Return a box where it is now."""
        thing = self.solids.box_things[index]
        box = self.boxes[index]
        return box if thing < 0 else assembly.moved_box(box, self.world.things[thing])

    def cylinder(self, index: int) -> Cylinder:
        """Return a cylinder where it is now."""
        k = self.solids.cylinder_things[index]
        cylinder = self.cylinders[index]
        if k < 0:
            return cylinder
        thing = self.world.things[k]
        return replace(cylinder, x=float(thing.x), y=float(thing.y))

    def switched(self, things: Sequence[_Lit]) -> tuple[_Lit, ...]:
        """Return lights or sounds as they are now: what is switched off neither shines nor sounds."""
        off: dict[str, Any] = {"intensity": 0.0} if any(isinstance(each, Light) for each in things) else {"volume": 0.0}
        return tuple(each if self.is_on(each.switch) else replace(each, **off) for each in things)

    def is_on(self, zone: str) -> bool:
        """Return whether the zone of this name is switched on; true for no name."""
        return not zone or bool(self.world.zones[self.scene.zone_number(zone)].is_on)

    def inked(self) -> Floor:
        """Return the floor with what pens drew on it."""
        floor, areas = self.floor, self.areas
        drawn = [(cell, int(ink) - 1) for cell, ink in enumerate(self.world.states[FIRST_INK:]) if ink]
        if not drawn:
            return floor
        if not floor.columns:
            floor = Floor(floor.colour, areas.columns, areas.rows, areas.scale, (floor.colour,) * len(areas.cells))
        pixels, finer = list(floor.pixels), floor.scale / areas.scale
        for cell, colour in drawn:
            row, column = divmod(cell, areas.columns)
            for v in range(int(row * finer), min(math.ceil((row + 1) * finer), floor.rows)):
                for u in range(int(column * finer), min(math.ceil((column + 1) * finer), floor.columns)):
                    pixels[v * floor.columns + u] = colour
        return replace(floor, pixels=tuple(pixels))


def _values(record: object, names: tuple[str, ...]) -> tuple[float, ...]:
    return tuple(float(getattr(record, name)) for name in names)


def _fixed(solids: Sequence[Box] | Sequence[Cylinder]) -> list[Box | Cylinder]:
    return [solid for solid in solids if not solid.can_move]


def _overwrite(record: object, new: Any) -> None:
    """Give *record* the values of another one."""
    for entry in fields(new):
        setattr(record, entry.name, getattr(new, entry.name))


@lru_cache(maxsize=8)
def _tables(engine_name: str, model: EpuckModel) -> dict[str, Any]:
    """Return the tables that all worlds with the same sensors share."""
    engine = engine_named(engine_name)
    profile = profiles.profile(model.profile)
    responses = [records.Response(*pair) for pair in zip(profile.counts, profile.deviation, strict=True)]
    return {
        "tables": engine.records(records.Tables, [assembly.tables(model.generation)]),
        "fans": engine.records(records.Fan, assembly.fans(model.rays, profile)),
        "response": engine.records(records.Response, responses),
    }


@lru_cache(maxsize=8)
def _ground(engine_name: str, floor: Floor, cells: tuple[int, ...]) -> Any:
    """Return the table that all worlds with the same floor and map of zones share."""
    return engine_named(engine_name).ints([*(floor.pixels or [0]), *cells])
