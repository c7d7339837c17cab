"""What readers of other simulators' files gather: things in metres, and remarks about what is left out."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeAlias, TypeVar

from elib.base.errors import ArgumentError, SimulationError
from elib.base.files import read_file
from elib.base.pose import Pose
from elib.base.tables import MAX_FILE
from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.fittings import Light, Patch, Print
from elib.simulator.physics.floor import opened
from elib.simulator.physics.geometry import Box, Colour, Cylinder, Polygon, Wall, extent
from elib.simulator.physics.placement import all_taken, places
from elib.simulator.physics.scene import Scene

Thing: TypeAlias = Wall | Box | Cylinder | Polygon | Light | Print | Patch | Pose
"""What a world is made of; a pose is the start of a robot."""

_T = TypeVar("_T")
Kind: TypeAlias = Callable[..., Thing]
Form: TypeAlias = Mapping[str, object]
Rectangle: TypeAlias = tuple[float, float, float, float]
"""Least x and y, greatest x and y."""

MAX_PARTS = 100_000
"""Parts of a file that are looked at, repeated ones each time: more would take minutes."""

MAX_DEPTH = 50
"""Parts inside parts; real files have a third of it."""

MAX_NUMBER = 1e9
"""Larger numbers are a mistake, and sums of them are none."""

LOW, HIGH = 0.001, 0.06
"""m. Robots drive over what ends below the first, and under what begins above the second: they are 5.5 cm tall."""

EPUCK = re.compile("e-?puck", re.IGNORECASE)
"""What the names of e-pucks begin with."""

MARGIN = 0.1
"""m. Floor around things whose file does not say how large it is."""


@dataclass
class Plan:
    """The world of another simulator: metres and radians, seen from above, its origin where the file has it."""

    path: Path
    about: str = ""  # what the world is for
    # what is left out or different, each with its line; line 0 is the whole file
    remarks: list[tuple[int, str]] = field(default_factory=list)
    areas: list[Rectangle] = field(default_factory=list)  # floors
    _parts: int = 0
    _things: list[tuple[int, Thing]] = field(default_factory=list)
    _names: set[str] = field(default_factory=lambda: {""})

    def text_of(self, path: Path) -> str:
        """Return the text of a file: UTF-8, or else Latin-1, as old programs wrote it."""
        content = read_file(path, "the world", largest=MAX_FILE)
        if len(content) > MAX_FILE:
            raise self.error(0, f"it is larger than {MAX_FILE // 1_000_000} MB, which is the limit")
        try:
            return content.decode("utf-8-sig")
        except UnicodeDecodeError:
            return content.decode("latin-1")

    def error(self, line: int, message: str, hint: str = "") -> SimulationError:
        """Return the error of a file that cannot be read further."""
        return SimulationError(f"{self.path}{f':{line}' if line else ''}: {message}", hint=hint)

    def note(self, line: int, text: str) -> None:
        """Remark on what stands in a line, once."""
        if (line, text[:300]) not in self.remarks[-1:]:
            self.remarks.append((line, text[:300]))

    def count(self, line: int, depth: int = 0, parts: int = 1) -> None:
        """Count parts; raise SimulationError if there are too many, or too many inside each other."""
        self._parts += parts
        if depth > MAX_DEPTH or self._parts > MAX_PARTS:
            many = f"nested more than {MAX_DEPTH} deep" if depth > MAX_DEPTH else f"made of more than {MAX_PARTS} parts"
            raise self.error(line, f"the world is {many}")

    def number(self, line: int, text: str) -> float:
        """Return the number that *text* is; raise SimulationError if it is none, or a huge one."""
        try:
            if abs(found := float(text)) <= MAX_NUMBER:
                return found
        except ValueError:
            pass
        raise self.error(line, f'"{text[:60]}" is not a number from {-MAX_NUMBER:g} to {MAX_NUMBER:g}')

    def add(self, line: int, what: str, kind: Kind, form: Form, name: str = "") -> None:
        """Add a thing, or note why elib cannot have it; *what* names it there."""
        if name not in self._names and len(name) <= 100 and name.isprintable():
            self._names.add(name)
            form = {**form, "name": name}
        try:
            self._things.append((line, kind(**form)))
        except ArgumentError as error:
            self.note(line, f"{what} is left out: {error.message}")

    def stand(self, line: int, what: str, kind: Kind, low: float, high: float, form: Form, name: str = "") -> None:
        """Add a solid from *low* to *high*, or note that robots drive under or over it."""
        if low > HIGH or high < LOW:
            self.note(line, f"{what} is left out: robots drive {'under' if low > HIGH else 'over'} it")
        else:
            self.add(line, what, kind, {**form, "height": high}, name)

    def robot(self, line: int, what: str, x: float, y: float, heading: float) -> None:
        """Add a robot; one of another kind becomes an e-puck."""
        if not EPUCK.match(what):
            self.note(line, f"{what} becomes an e-puck")
        self.add(line, what, Pose, {"x": x, "y": y, "heading": heading})

    def picture(self, line: int, file: str, area: Rectangle) -> None:
        """Add a picture on the floor, or note that its file is not there."""
        path = self.path.parent / file
        try:
            with opened(path):
                self.add(line, "the picture", Print, {"file": str(path.resolve()), **placed(area)})
        except (ArgumentError, OSError, ValueError) as error:
            why = error.message if isinstance(error, ArgumentError) else "its path is no path"
            self.note(line, f'the picture "{file}" on the floor is left out: {why}')

    def is_free(self, line: int, x: float, y: float, room: float) -> bool:
        """Return whether nothing that stands on the floor is nearer to a place than *room*, m."""
        self.count(line, parts=1 + len(self._things) // 100)
        left, low, right, high = self.areas[0]
        return min(x - left, right - x, y - low, high - y) >= room and all(
            math.hypot(x - thing.x, y - thing.y) >= room + RADIUS
            if isinstance(thing, Pose)
            else isinstance(thing, Light | Print | Patch) or thing.distance(x, y) >= room
            for _, thing in self._things
        )

    def scene(self, folder: Path) -> Scene:
        """Return the world, with the corner of its floor at (0, 0); pictures in *folder* have their path from there.

        Raises:
            SimulationError: There is nothing in it, or it is too small or too large.
        """
        left, low, right, high = self._floor()
        kept: list[tuple[int, Thing]] = []

        def of(kind: type[_T]) -> tuple[_T, ...]:
            return tuple(thing for _, thing in kept if isinstance(thing, kind))

        try:
            for line, thing in self._things:
                if isinstance(thing, Wall | Polygon | Print | Patch) or (
                    left <= thing.x <= right and low <= thing.y <= high
                ):
                    kept.append((line, _moved(thing, -left, -low, folder.resolve())))
                else:
                    what = "robot" if isinstance(thing, Pose) else type(thing).__name__.lower()
                    self.note(line, f"a {what} at ({thing.x:.3g}, {thing.y:.3g}) is left out: it is not on the floor")
            scene = Scene(right - left, high - low, of(Wall), of(Box), of(Cylinder), of(Pose), name=self.path.stem)
            scene = replace(scene, polygons=of(Polygon), lights=of(Light), paint=(*of(Print), *of(Patch)))
        except ArgumentError as error:
            raise self.error(0, error.message) from error
        lines = [line for line, thing in kept if isinstance(thing, Pose)]
        taken = {each.robot: each.what for each in all_taken(scene)}
        for robot, what in taken.items():
            self.note(lines[robot], f"a robot is left out: it {what}")
        free = tuple(pose for robot, pose in enumerate(scene.starts) if robot not in taken)
        if not free:
            self.note(0, "there is no robot: one is placed where there is room")
        return replace(scene, starts=free or places(replace(scene, starts=()), 1, 0))

    def _floor(self) -> Rectangle:
        """Return the rectangle of the whole floor."""
        areas, margin = self.areas, 0.0
        if not areas:
            margin = MARGIN
            self.note(0, f"the floor ends {margin} m beyond what stands on it: the file does not say how large it is")
            for _, thing in self._things:
                solid = Cylinder(thing.x, thing.y, RADIUS) if isinstance(thing, Light | Pose) else thing
                if not isinstance(solid, Print | Patch):
                    left, right, low, high = extent(solid)
                    areas.append((left, low, right, high))
        if not areas:
            raise self.error(0, "there is nothing in it that elib can take")
        lefts, lows, rights, highs = zip(*areas, strict=True)
        return min(lefts) - margin, min(lows) - margin, max(rights) + margin, max(highs) + margin


def placed(area: Rectangle) -> dict[str, float]:
    """Return an area as the corner and the size of what is painted there."""
    left, low, right, high = area
    return {"x": left, "y": low, "width": right - left, "depth": high - low}


def pushed(mass: float) -> dict[str, object]:
    """Return what makes a thing of a mass pushable; nothing if it has none."""
    return {"is_pushable": True, "mass": mass} if mass > 0 else {}


def colour_of(parts: Iterable[float]) -> Colour:
    """Return the colour of red, green and blue, each 0..1; what is beyond is cut."""
    red, green, blue = (round(255 * min(1.0, max(0.0, part))) for part in parts)
    return Colour(red, green, blue)


def _moved(thing: Thing, x: float, y: float, folder: Path) -> Thing:
    match thing:
        case Wall():
            return replace(thing, x1=thing.x1 + x, y1=thing.y1 + y, x2=thing.x2 + x, y2=thing.y2 + y)
        case Polygon():
            return replace(thing, points=tuple((u + x, v + y) for u, v in thing.points))
        case Print() if Path(thing.file).is_relative_to(folder):
            file = Path(thing.file).relative_to(folder).as_posix()
            return replace(thing, x=thing.x + x, y=thing.y + y, file=file)
        case _:
            return replace(thing, x=thing.x + x, y=thing.y + y)
