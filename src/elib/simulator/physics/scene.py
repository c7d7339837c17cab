"""A world before anything happens: the arena, what stands in it, where robots start, and the rules."""

from __future__ import annotations

import importlib
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Annotated

from elib.base.errors import ArgumentError
from elib.base.pose import Pose
from elib.base.rules import SEED, Mistake, Number, Seed, check, nearest
from elib.base.tables import MAX_TABLES
from elib.simulator.physics.body import RADIUS, EpuckModel
from elib.simulator.physics.fittings import FLOOR_COLOUR, ROBOTS, Energy, Light, Paint, Sound, Zone
from elib.simulator.physics.geometry import MAX_ARENA, Box, Colour, Cylinder, Painted, Polygon, Wall

STEP = 1 / 64
"""Default tick, s: exact in binary, and the rate at which an e-puck1 refreshes its infrared sensors."""

MAX_STEP = 0.1
"""s. At 12.9 cm/s a robot then moves 13 mm, well below its radius, so nothing can be passed through."""

MIN_STEP = 1 / 4096
"""s. A shorter one computes more ticks than any computer can."""

MIN_ARENA = 4 * RADIUS
"""m. Two robots side by side."""

MAX_THINGS = MAX_TABLES
"""Walls, boxes, cylinders, lights and sounds of a world: of each at most."""

Size = Annotated[float, Number(MIN_ARENA, MAX_ARENA, "m", otherwise="from density")]
"""Width or depth of an arena."""

TimeStep = Annotated[float, Number(MIN_STEP, MAX_STEP, "s")]


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything a :class:`~elib.simulator.physics.world.World` is made from.

    Attributes:
        width: The width of the walled arena, m, 0.148..1000; x runs from 0 to it. At least two robots wide.
        depth: The depth of the arena, m, 0.148..1000; y runs from 0 to it. At least two robots wide.
        walls: Interior walls.
        boxes: Blocks, fixed or pushable.
        cylinders: Posts and balls, fixed or pushable.
        starts: Where the first robots start.
        step: Length of a tick, s, 1/4096..0.1.
        seed: The seed of all noise and of chosen places, 0 <= seed < 2**64.
        model: What the robots are like.
        name: For messages and captions.
        lights: Lamps.
        sounds: Sources of sound.
        floor: Colour of the floor.
        paint: What is painted on it, the first one lowest.
        firmware: The firmware of the first robots; "" where the world does not say.
        polygons: Fixed blocks of other outlines.
        zones: Parts of the floor that know what is in them.
        energy: What robots use; None if they never tire.
        energies: What the first robots begin with; None where that is what the energy says.
        pens: The colours in which the first robots draw where they drive; None for no pen.
    """

    width: Size
    depth: Size
    walls: tuple[Wall, ...] = ()
    boxes: tuple[Box, ...] = ()
    cylinders: tuple[Cylinder, ...] = ()
    starts: tuple[Pose, ...] = ()
    step: TimeStep = STEP
    seed: Seed = 0
    model: EpuckModel = field(default_factory=EpuckModel)
    name: str = "world"
    lights: tuple[Light, ...] = ()
    sounds: tuple[Sound, ...] = ()
    floor: Painted = FLOOR_COLOUR
    paint: tuple[Paint, ...] = ()
    firmware: tuple[str, ...] = ()
    polygons: tuple[Polygon, ...] = ()
    zones: tuple[Zone, ...] = ()
    energy: Energy | None = None
    energies: tuple[float | None, ...] = ()
    pens: tuple[Colour | None, ...] = ()

    def __post_init__(self) -> None:
        check(self, "the world's ")
        check_switches(self.zones, self.boxes, self.cylinders, self.lights, self.sounds)
        things = {what: getattr(self, what) for what in ("walls", "boxes", "cylinders", "lights", "sounds", "paint")}
        for what, found in (things | {"walls": self.fixed_walls}).items():
            count = len(found)
            if count > MAX_THINGS:
                raise ArgumentError(f"the world has {count} {what}; at most {MAX_THINGS} are possible")

    @classmethod
    def load(cls, name: str | os.PathLike[str], *, robots: int | None = None) -> Scene:
        """Read a world from its file.

        Args:
            name: A world that comes with elib, such as ``arena``, or the path of a file ending in ``.toml``.
            robots: How many there will be; a world that says its density is as large as they need. None means as many
                as the file says.

        Raises:
            LinkNotFound: There is no such world.
            SimulationError: The file breaks a rule; the message names the file, the line, the key and a cure.
        """
        # By name: the physics knows no files, and what reads them stands on it.
        files = importlib.import_module("elib.simulator.worlds.files")
        scene: Scene = files.load_file(os.fspath(name), robots=robots).scene
        return scene

    @property
    def edge(self) -> tuple[Wall, ...]:
        """The arena's four walls, counter-clockwise."""
        corners = ((0.0, 0.0), (self.width, 0.0), (self.width, self.depth), (0.0, self.depth))
        return tuple(Wall(*corners[i], *corners[(i + 1) % 4]) for i in range(4))

    def zone_number(self, name: str) -> int:
        """Return the number of a zone; -2 for robots in its place, and -1 for no name."""
        found = [zone.name for zone in self.zones]
        return found.index(name) if name in found else -2 if name == ROBOTS else -1

    @property
    def surfaces(self) -> tuple[Wall, ...]:
        """Every flat surface inside the arena: walls, sides of polygons, then those of boxes."""
        return self.fixed_walls + tuple(side for box in self.boxes for side in box.sides)

    @property
    def fixed_walls(self) -> tuple[Wall, ...]:
        """The interior walls, then the sides of polygons."""
        return self.walls + _sides(self.polygons)


@lru_cache(maxsize=8)
def _sides(polygons: tuple[Polygon, ...]) -> tuple[Wall, ...]:
    """Return the sides of polygons; every picture of a world asks for them."""
    return tuple(side for polygon in polygons for side in polygon.sides)


MAX_ZONES = 30
"""A bit of a whole number for each."""


def check_switches(
    zones: Sequence[Zone],
    boxes: Sequence[Box],
    cylinders: Sequence[Cylinder],
    lights: Sequence[Light],
    sounds: Sequence[Sound],
) -> None:
    """Raise Mistake, with the path of the key in a world's file, unless all zones and things that are named are there.

    Raises:
        Mistake: One is not.
    """
    if len(zones) > MAX_ZONES:
        raise Mistake("is one too many", path=("zone", MAX_ZONES), hint=f"at most {MAX_ZONES} are possible")
    names, areas = [zone.name for zone in zones], [zone.name for zone in zones if zone.outline]
    solids: list[Box | Cylinder] = [*boxes, *cylinders]
    keys = [ROBOTS, *(each.name for each in solids if each.is_pushable and each.name)]
    kinds: list[tuple[str, Sequence[Box | Light | Sound]]] = [("box", boxes), ("light", lights), ("sound", sounds)]
    asked = [(kind, k, "switch", each.switch, names) for kind, found in kinds for k, each in enumerate(found)]
    asked += [("cylinder", k, "collect", each.collect, [ROBOTS, *names]) for k, each in enumerate(cylinders)]
    asked += [("cylinder", k, "respawn", each.respawn, areas) for k, each in enumerate(cylinders)]
    asked += [("zone", k, "by", zone.by, keys) for k, zone in enumerate(zones)]
    asked += [("zone", k, "name", zone.name, []) for k, zone in enumerate(zones) if names.index(zone.name) < k]
    for kind, k, key, name, there in asked:
        if name and name not in there:
            what = "is the name of another one" if key == "name" else "is no thing that can be pushed"
            if key in ("switch", "collect", "respawn"):
                what = "is no zone with a shape" if key == "respawn" else "is no zone of this world"
            hint = "give it another name" if key == "name" else nearest(name, there)
            raise Mistake(f'is "{name}", which {what}', path=(kind, k, key), hint=hint)


def check_scene(scene: object, taker: str) -> Scene:
    """Return *scene*; raise ArgumentError, which names the *taker*, unless it is one."""
    if isinstance(scene, Scene):
        return scene
    hint = f"did you mean {taker}.load({scene!r}, ...)?" if isinstance(scene, str) else ""
    raise ArgumentError(f"{taker}() takes an elib.Scene, not {scene!r}", hint=hint)


def check_seed(seed: int) -> int:
    """Return *seed* as a whole number of Python; raise ArgumentError unless it fits 64 bits."""
    return int(SEED.require(seed, "seed", "the "))
