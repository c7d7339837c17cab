"""Worlds as TOML files: the gallery, and files of your own.

::

    about = "A room to try things in."

    [arena]
    size = [1.0, 1.0]          # m, walled; required

    [simulation]
    step = 0.015625            # s
    seed = 1

    [epuck]                    # what the robots are like: the fields of EpuckModel
    profile = "enki"
    ground_module = true

    [[wall]]
    from = [0.2, 0.2]
    to = [0.2, 0.6]

    [[box]]
    position = [0.5, 0.5]      # its centre
    size = [0.1, 0.1]
    angle = 30                 # degrees
    pushable = true
    mass = 0.2                 # kg
    friction = 0.5             # force over weight at which it begins to slide

    [[cylinder]]
    position = [0.3, 0.8]
    radius = 0.05
    height = 0.10              # m; also of walls and boxes
    colour = "#d04030"         # also of walls and boxes

    [[polygon]]
    points = [[0.7, 0.1], [0.9, 0.1], [0.8, 0.3]]

    [[light]]
    position = [0.9, 0.9]

    [[sound]]
    position = [0.1, 0.9]

    [[zone]]                   # a part of the floor that knows what is in it
    name = "nest"
    position = [0.2, 0.2]
    radius = 0.1

    [floor]
    colour = "#d8d4cc"

    [[stripe]]                 # on the floor: checkers lie lowest, then pictures, patches, stripes
    points = [[0.1, 0.1], [0.9, 0.1]]

    [[robot]]
    position = [0.5, 0.2]
    heading = 90               # degrees, 0 along x, positive to the left

Lengths are metres, angles degrees: such files are written by hand. ``tables.py`` has the tables; their keys are the
fields of the classes that they make.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar, cast

from elib.base.errors import ArgumentError, LinkNotFound, SimulationError
from elib.base.files import WORLDS
from elib.base.rules import Mistake
from elib.base.tables import Source, content_of, others, read_toml, shipped
from elib.base.tags import FACES
from elib.simulator.physics.body import EpuckModel
from elib.simulator.physics.fittings import Checkers, Energy, Light, Paint, Print, Sound, Zone
from elib.simulator.physics.floor import opened
from elib.simulator.physics.geometry import Box, Cylinder, Polygon, Wall
from elib.simulator.physics.placement import first_taken, inside_hint, places
from elib.simulator.physics.scene import Scene, check_switches
from elib.simulator.worlds.tables import PAINT, TABLES, THINGS, TOP, Arena, Start

MAX_COVER = 4
"""Width of a picture in widths of the arena, and depth likewise: what lies outside is painted in vain."""

_T = TypeVar("_T")
_P = TypeVar("_P", Paint, Zone, Wall, Box)


@dataclass(frozen=True, slots=True)
class WorldFile:
    """What a world's file says.

    Attributes:
        about: What the world is for; empty if it does not say.
        scene: The world.
    """

    about: str
    scene: Scene


def gallery() -> list[str]:
    """Return the names of the worlds that come with elib, in alphabetical order."""
    return shipped(WORLDS)


def load_file(name: str, *, robots: int | None = None) -> WorldFile:
    """Read a world, and return what its file says beside the scene, too.

    Args:
        name: The name of a world that comes with elib, or the path of a file.
        robots: How many there will be; a world that says its density is as large as they need. None means as many as
            the file says.

    Raises:
        LinkNotFound: There is no such world.
        SimulationError: The file breaks a rule.
    """
    content, filename = source_of(name)
    return parse_file(content, filename, robots=robots)


def source_of(name: str) -> tuple[bytes, str]:
    """Return the content of a world's file, and the file's name.

    Args:
        name: The name of the world, or the path of its file.

    Raises:
        LinkNotFound: There is no such world.
    """
    found = content_of(name, WORLDS, "world", error=LinkNotFound)
    if found is None:
        raise LinkNotFound(f"there is no world {name!r}", hint=others(name, WORLDS))
    return found


def parse(content: bytes, filename: str, *, robots: int | None = None) -> Scene:
    """Return the scene that *content* describes, as :func:`parse_file` does."""
    return parse_file(content, filename, robots=robots).scene


def parse_file(content: bytes, filename: str, *, robots: int | None = None) -> WorldFile:
    """Return what *content* says.

    Args:
        content: TOML in UTF-8.
        filename: For messages, and to find pictures beside it; without folder and suffix it names the scene.
        robots: As for :func:`load_file`.

    Raises:
        SimulationError: It is not TOML, or a key is missing, unknown, of the wrong type or out of its range.
            The message names the file, the line and the key, and ends with a cure.
    """
    source, document = read_toml(content, filename, "a world")
    assembly = _Assembly(source, source.read_all(document, TOP, TABLES))
    return WorldFile(assembly.values("").get("about", ""), assembly.scene(robots))


class _Assembly:
    """Puts the parts of a file together, and checks what no part can know alone."""

    def __init__(self, source: Source, parts: dict[str, list[object]]) -> None:
        self._source = source
        self._parts = parts
        self._folder = Path(source.filename).parent

    def scene(self, robots: int | None) -> Scene:
        """Return the scene for so many robots."""
        arena = self._all("arena", Arena)[0]
        starts = self._all("robot", Start)
        counted = arena.robots or 0
        wanted = robots if robots is not None else counted or len(starts)
        width, depth = arena.size(max(wanted, 0))
        self._check_names()
        self._each("picture", Print, lambda picture: _check_file(picture.file, "file", self._folder))
        self._each("zone", Zone, lambda zone: _check_file(zone.file, "file", self._folder))
        for kind in ("wall", "box"):
            self._each(kind, Wall, lambda thing: _check_file(thing.face, "face", self._folder))
        walls = [self._found(wall) for wall in self._all("wall", Wall)]
        boxes, cylinders = [self._found(box) for box in self._all("box", Box)], self._all("cylinder", Cylinder)
        lights, sounds = self._all("light", Light), self._all("sound", Sound)
        zones = [self._found(zone) for zone in self._all("zone", Zone)]
        with self._source.at():
            check_switches(zones, boxes, cylinders, lights, sounds)
        try:
            scene = Scene(
                width,
                depth,
                walls=tuple(walls),
                boxes=tuple(boxes),
                cylinders=tuple(cylinders),
                polygons=tuple(self._all("polygon", Polygon)),
                starts=tuple(start.pose for start in starts),
                model=next(iter(self._all("epuck", EpuckModel)), EpuckModel()),
                name=Path(self._source.filename).stem,
                lights=tuple(lights),
                sounds=tuple(sounds),
                zones=tuple(zones),
                energy=next(iter(self._all("energy", Energy)), None),
                energies=_given(start.energy for start in starts),
                pens=_given(start.pen for start in starts),
                paint=tuple(self._found(cast("Paint", part)) for kind in PAINT for part in self._parts[kind]),
                firmware=tuple(start.firmware for start in starts),
                **self.values("simulation"),
                **self.values("floor"),
            )
        except ArgumentError as error:
            raise SimulationError(f"{self._source.filename}: {error.message}", hint=error.hint) from error
        self._each("checkers", Checkers, lambda checkers: checkers.count(width, depth))
        self._each("picture", Print, lambda picture: _check_cover(picture, scene))
        self._each("box", Box, lambda box: _check_inside(box, scene))
        self._each("cylinder", Cylinder, lambda cylinder: _check_inside(cylinder, scene))
        self._each("zone", Zone, lambda zone: _check_meets(zone, scene))
        taken = first_taken(scene) if starts else None
        if taken is not None:
            mistake = Mistake(taken.what, path=("position",), hint=taken.hint)
            raise self._source.error(("robot", taken.robot), mistake)
        if robots is None and counted > len(starts):
            # Robots that the file asks for stand where the file's seed puts them, whatever the seed of a run is.
            try:
                scene = replace(scene, starts=places(scene, counted, scene.seed))
            except SimulationError as error:
                mistake = Mistake(f"is {counted}: {error.message}", path=("robots",), hint=error.hint)
                raise self._source.error(("arena",), mistake) from error
        return scene

    def values(self, name: str) -> dict[str, Any]:
        """Return what a table says that goes into the scene as it is."""
        return next(iter(self._all(name, dict)), {})

    def _all(self, name: str, kind: type[_T]) -> list[_T]:
        return cast("list[_T]", self._parts[name])

    def _each(self, name: str, kind: type[_T], check: Callable[[_T], object]) -> None:
        for index, part in enumerate(self._all(name, kind)):
            try:
                check(part)
            except ArgumentError as error:
                raise self._source.error((name,) if name == "checkers" else (name, index), error) from error

    def _check_names(self) -> None:
        owners: dict[str, str] = {}
        for kind in THINGS:
            for index, part in enumerate(self._parts[kind]):
                name = cast("Box | Cylinder | Light | Sound | Zone", part).name
                if name in owners:
                    what = f'is "{name}", as that of {owners[name]}'
                    mistake = Mistake(what, path=("name",), hint="give it another name")
                    raise self._source.error((kind, index), mistake)
                if name:
                    owners[name] = f"{kind}[{index}]"

    def _found(self, part: _P) -> _P:
        """Return what may show a picture with the path of that, if it has one."""
        key = "face" if hasattr(part, "face") else "file"
        file = getattr(part, key, "")
        is_file = file and file not in FACES
        return replace(cast("Any", part), **{key: str((self._folder / file).resolve())}) if is_file else part


def _given(values: Iterable[_T | None]) -> tuple[_T | None, ...]:
    """Return what is given to robots; nothing if that is nothing for all of them."""
    found = tuple(values)
    return () if all(value is None for value in found) else found


def _check_inside(thing: Box | Cylinder, scene: Scene) -> None:
    if not (0 <= thing.x <= scene.width and 0 <= thing.y <= scene.depth):
        raise Mistake(
            f"is [{thing.x:g}, {thing.y:g}], outside the arena of {scene.width:g} x {scene.depth:g} m",
            path=("position",),
            hint=inside_hint(thing.x, thing.y, scene.width, scene.depth),
        )


def _check_meets(zone: Zone, scene: Scene) -> None:
    xs, ys = zip(*zone.outline, strict=True) if zone.outline else ((0.0,), (0.0,))
    if min(xs) > scene.width or max(xs) < 0 or min(ys) > scene.depth or max(ys) < 0:
        raise Mistake(
            f"puts all of the zone outside the arena of {scene.width:g} x {scene.depth:g} m",
            path=("points" if zone.points else "position",),
            hint=inside_hint(min(xs), min(ys), scene.width, scene.depth),
        )


def _check_cover(picture: Print, scene: Scene) -> None:
    if picture.width > MAX_COVER * scene.width or picture.depth > MAX_COVER * scene.depth:
        raise Mistake(
            f"is [{picture.width:g}, {picture.depth:g}]: too large for an arena of {scene.width:g} x {scene.depth:g} m",
            path=("size",),
            hint="it is given in m",
        )


def _check_file(file: str, key: str, folder: Path) -> None:
    """Raise Mistake unless a file, if there is one, holds a picture of a reasonable size; only its head is read."""
    if file in FACES:
        return
    try:
        with opened(folder / file):
            pass
    except ArgumentError as error:
        raise Mistake(f'is "{file}": {error.message}', path=(key,), hint=error.hint) from error
