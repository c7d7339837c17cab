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

    [[cylinder]]
    position = [0.3, 0.8]
    radius = 0.05
    height = 0.10              # m; also of walls and boxes
    colour = "#d04030"         # also of walls and boxes

    [[light]]
    position = [0.9, 0.9]

    [[sound]]
    position = [0.1, 0.9]

    [floor]
    colour = "#d8d4cc"

    [[stripe]]                 # on the floor: checkers lie lowest, then pictures, patches, stripes
    points = [[0.1, 0.1], [0.9, 0.1]]

    [[robot]]
    position = [0.5, 0.2]
    heading = 90               # degrees, 0 along x, positive to the left

Lengths are metres, angles degrees: such files are written by hand. :mod:`elib.physics.worldschema` has every key.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path
from typing import TypeVar, cast

from elib.errors import ArgumentError, LinkNotFound, SimulationError
from elib.files import read_file
from elib.physics.body import EpuckModel
from elib.physics.fittings import MOST_SQUARES, Checkers, Light, Paint, Print, Sound
from elib.physics.floor import LARGEST_PRINT
from elib.physics.geometry import Box, Cylinder, Wall
from elib.physics.keys import Mistake
from elib.physics.placement import first_taken, places
from elib.physics.scene import Scene
from elib.physics.schema import Source, unknown
from elib.physics.tomltext import LARGEST_FILE, read
from elib.physics.worldparts import Arena, Ground, Rules, Start, Top
from elib.physics.worldschema import PAINT, SECTIONS, THINGS, TOP

LARGEST_COVER = 4
"""Width of a picture in widths of the arena, and depth likewise: what lies outside is painted in vain."""

_T = TypeVar("_T")


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
    return sorted(
        entry.name.removesuffix(".toml")
        for entry in files("elib").joinpath("worlds").iterdir()
        if entry.name.endswith(".toml")
    )


def load(name: str, *, robots: int | None = None) -> Scene:
    """Read a world of the gallery, or a file when *name* is a path or ends in ``.toml``.

    Args:
        name: Of the world, or the path of its file.
        robots: How many robots there will be; a world that says its density is as large as they need. None means
            as many as the file says.

    Raises:
        LinkNotFound: There is no such world.
        SimulationError: The file breaks a rule.
    """
    return load_file(name, robots=robots).scene


def load_file(name: str, *, robots: int | None = None) -> WorldFile:
    """Read like :func:`load`, and return what the file says beside the scene, too."""
    content, filename = source_of(name)
    return parse_file(content, filename, robots=robots)


def source_of(name: str) -> tuple[bytes, str]:
    """Return the content of a world's file, at most :data:`LARGEST_FILE` bytes and one, and the file's name.

    Args:
        name: Of the world, or the path of its file.

    Raises:
        LinkNotFound: There is no such world.
    """
    if name.endswith(".toml") or "/" in name or os.sep in name:
        hint = "check its path" if Path(name).is_absolute() else f"check its path; it was looked for in {Path.cwd()}"
        return read_file(name, "the world file", largest=LARGEST_FILE, hint=hint, error=LinkNotFound), name
    names = gallery()
    if name not in names:
        near = get_close_matches(name, names, 1)
        meant = f"did you mean {near[0]}? " if near else ""
        raise LinkNotFound(
            f"there is no world {name!r}",
            hint=f"{meant}choose one of {', '.join(names)}, or give the path of a .toml file",
        )
    path = files("elib").joinpath("worlds", f"{name}.toml")
    return path.read_bytes(), str(path)


def parse(content: bytes, filename: str, *, robots: int | None = None) -> Scene:
    """Return the scene that *content* describes.

    Args:
        content: TOML in UTF-8.
        filename: For messages, and to find pictures beside it; without folder and suffix it names the scene.
        robots: As for :func:`load`.

    Raises:
        SimulationError: It is no TOML, or a key is missing, unknown, of the wrong type or out of its range.
            The message names the file, the line and the key, and ends with a cure.
    """
    return parse_file(content, filename, robots=robots).scene


def parse_file(content: bytes, filename: str, *, robots: int | None = None) -> WorldFile:
    """Return what *content* says; as :func:`parse`."""
    text, document = read(content, filename)
    source = Source(filename, text)
    known = {section.name: section for section in SECTIONS}
    try:
        for name in document:
            if name not in known and name not in TOP.by_name:
                raise unknown(name, [*TOP.by_name, *known])
        top = cast("Top", TOP.read({key: value for key, value in document.items() if key in TOP.by_name}))
    except ArgumentError as error:
        raise source.wrong((), error) from error
    parts = {name: source.read(section, document.get(name)) for name, section in known.items()}
    return WorldFile(top.about, _Assembly(source, parts).scene(robots))


class _Assembly:
    """Puts the parts of a file together, and checks what no part can know alone."""

    def __init__(self, source: Source, parts: dict[str, list[object]]) -> None:
        self._source = source
        self._parts = parts

    def scene(self, robots: int | None) -> Scene:
        """Return the scene for so many robots."""
        arena, rules = self._one("arena", Arena), self._one("simulation", Rules)
        starts = self._all("robot", Start)
        wanted = robots if robots is not None else arena.robots or len(starts)
        width, depth = arena.size(max(wanted, 0))
        self._check_names()
        folder = Path(self._source.filename).parent
        paint = tuple(part for kind in PAINT for part in self._parts[kind])
        self._each("picture", Print, lambda picture: _check_picture(picture, folder))
        try:
            scene = Scene(
                width,
                depth,
                tuple(self._all("wall", Wall)),
                tuple(self._all("box", Box)),
                tuple(self._all("cylinder", Cylinder)),
                tuple(start.pose for start in starts),
                rules.step,
                rules.seed,
                self._one("epuck", EpuckModel),
                Path(self._source.filename).stem,
                tuple(self._all("light", Light)),
                tuple(self._all("sound", Sound)),
                self._one("floor", Ground).colour,
                cast("tuple[Paint, ...]", tuple(_found(part, folder) for part in paint)),
                tuple(start.firmware for start in starts),
            )
        except ArgumentError as error:
            raise SimulationError(f"{self._source.filename}: {error.message}", hint=error.hint) from error
        self._each("checkers", Checkers, lambda checkers: _check_squares(checkers, scene))
        self._each("picture", Print, lambda picture: _check_cover(picture, scene))
        self._each("box", Box, lambda box: _check_inside(box, scene))
        self._each("cylinder", Cylinder, lambda cylinder: _check_inside(cylinder, scene))
        taken = first_taken(scene) if starts else None
        if taken is not None:
            raise self._source.mistake(("robot", taken.robot, "position"), taken.what, taken.hint)
        if robots is None and arena.robots > len(starts):
            # Robots that the file asks for stand where the file's seed puts them, whatever the seed of a run is.
            scene = replace(scene, starts=places(scene, arena.robots, scene.seed))
        return scene

    def _one(self, name: str, kind: type[_T]) -> _T:
        found = self._all(name, kind)
        return found[0] if found else kind()

    def _all(self, name: str, kind: type[_T]) -> list[_T]:
        return cast("list[_T]", self._parts[name])

    def _each(self, name: str, kind: type[_T], check: Callable[[_T], None]) -> None:
        for index, part in enumerate(self._all(name, kind)):
            try:
                check(part)
            except ArgumentError as error:
                path = (name,) if name == "checkers" else (name, index)
                raise self._source.wrong(path, error) from error

    def _check_names(self) -> None:
        owners: dict[str, str] = {}
        for kind in THINGS:
            for index, part in enumerate(self._parts[kind]):
                name = cast("Box | Cylinder | Light | Sound", part).name
                if name in owners:
                    raise self._source.mistake(
                        (kind, index, "name"), f'is "{name}", as that of {owners[name]}', "give it another name"
                    )
                if name:
                    owners[name] = f"{kind}[{index}]"


def _found(part: object, folder: Path) -> object:
    return replace(part, file=str((folder / part.file).resolve())) if isinstance(part, Print) else part


def _check_inside(thing: Box | Cylinder, scene: Scene) -> None:
    if not (0 <= thing.x <= scene.width and 0 <= thing.y <= scene.depth):
        raise Mistake(
            f"is [{thing.x:g}, {thing.y:g}], outside the arena of {scene.width:g} x {scene.depth:g} m",
            path=("position",),
            hint="x and y run from 0 to the arena's size",
        )


def _check_squares(checkers: Checkers, scene: Scene) -> None:
    across, along = math.ceil(scene.width / checkers.square), math.ceil(scene.depth / checkers.square)
    if across * along > MOST_SQUARES:
        raise Mistake(
            f"is {checkers.square:g}, which makes {across * along} squares; at most {MOST_SQUARES} are possible",
            path=("square",),
            hint="make them larger",
        )


def _check_cover(picture: Print, scene: Scene) -> None:
    if picture.width > LARGEST_COVER * scene.width or picture.depth > LARGEST_COVER * scene.depth:
        raise Mistake(
            f"is [{picture.width:g}, {picture.depth:g}]: too large for an arena of {scene.width:g} x {scene.depth:g} m",
            path=("size",),
            hint="it is given in m",
        )


def _check_picture(picture: Print, folder: Path) -> None:
    """Raise Mistake unless its file holds a picture of a reasonable size; nothing but its head is read."""
    import warnings

    from PIL import Image, UnidentifiedImageError  # Only floors with pictures need Pillow.

    path = folder / picture.file
    if not path.is_file():
        raise Mistake(f'is "{picture.file}": there is no such file', path=("file",), hint=f"it would be {path}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Of its size: that is what is looked at here.
            with Image.open(path, formats=("PNG", "JPEG")) as image:
                pixels = image.width * image.height
    except Image.DecompressionBombError:
        pixels = LARGEST_PRINT + 1
    except (OSError, UnidentifiedImageError, ValueError, SyntaxError) as error:
        raise Mistake(
            f'is "{picture.file}", which is no picture: {getattr(error, "strerror", None) or "it cannot be decoded"}',
            path=("file",),
            hint="give the path of a PNG or JPEG file",
        ) from error
    if pixels > LARGEST_PRINT:
        raise Mistake(
            f'is "{picture.file}", which has more than {LARGEST_PRINT // 1_000_000} million pixels',
            path=("file",),
            hint="scale it down",
        )
