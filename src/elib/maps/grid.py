"""A map of squares: how likely it is that something stands in each, from poses and infrared readings."""

from __future__ import annotations

import importlib
import math
import os
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from elib.base.body import RADIUS, SENSOR_DIRECTIONS, SENSOR_RADIUS
from elib.base.errors import ArgumentError
from elib.base.files import read_file, write_file
from elib.base.pictures import as_png
from elib.base.pose import Pose
from elib.base.rules import Number

if TYPE_CHECKING:
    from numpy.typing import NDArray

CELL: Final = Number(0.002, 0.1, "m", example="0.01")
MAX_CELLS: Final = 4_000_000
"""Squares of a map at most: 20 m x 20 m of 1 cm. A robot that has come further has lost its way."""
CONE: Final = math.radians(15)
"""rad from the axis of a sensor within which a map takes what it sees."""
SURE: Final = 0.05
"""m up to which a sensor that sees nothing says that nothing is there: the least sensitive ones see no farther."""
WRONG: Final = 0.06
"""Part of a distance by which it is wrong: gains differ by 17 % (measured-robots: infrared.distance_8_sensors)."""
FREE, OCCUPIED, MAX_ODDS = -0.3, 0.6, 4.0
"""What a reading adds to the logarithm of the odds, and where that ends: a thing that is taken away is forgotten."""
DRIVEN: Final = -1.0
"""What the body adds where it stands: nothing else can be there."""
KNOWN: Final = 0.5
"""Logarithm of the odds from which a square counts as occupied, and below minus which as free."""
SIGHT: Final = 0.06 + SENSOR_RADIUS
"""m from the middle of the robot that a reading reaches."""
COLOURED: Final = 64
"""Difference of red, green and blue from which a pixel is coloured: more than a JPEG makes of grey. Chosen."""
LINES: Final = 'the file beside the picture has two lines, such as "cell = 0.01" and "origin = [0.0, 0.0]", in m'
BLOCK: Final = 50
"""Squares by which a map grows."""


class Grid:
    """A map of squares. It begins empty and grows with what is added.

    The coordinates are those of the poses that are added, m. A square stands for the place of its middle.

    Args:
        cell: The side of a square, m.

    Attributes:
        cell: The side of a square, m.
        x: Middle of the first column, m.
        y: Middle of the first row, m.
        odds: For each row, from the least y, and column the logarithm of the odds that something is there: 0 if nothing
            is known, at most 4, at least -4.
        dark: By rows and columns, where the floor is dark to the ground sensors; None if that is not known, as it is of
            a map that grows or comes from a file.

    Example:
        >>> grid = elib.Grid()
        >>> with elib.connect("sim://square?speed=max") as robot:
        ...     for _ in range(20):
        ...         robot.drive(0.01)
        ...         grid.add(robot.pose(), robot.distances())
        >>> grid.is_free(0.1, 0)
        True
    """

    def __init__(self, cell: float = 0.01) -> None:
        self.cell = float(CELL.require(cell, "cell", "the grid's "))
        self.x = self.y = 0.0
        self.odds: NDArray[np.float32] = np.zeros((0, 0), np.float32)
        self.dark: NDArray[np.bool_] | None = None
        self.changes = 0
        """How often something was added: what was made from the map before is old."""

    def copy(self) -> Grid:
        """Return a map that knows the same and goes its own way."""
        made = Grid(self.cell)
        made.x, made.y, made.odds, made.changes = self.x, self.y, self.odds.copy(), self.changes
        made.dark = self.dark
        return made

    # -- what it knows -------------------------------------------------------------------------------------------------

    @property
    def occupied(self) -> NDArray[np.bool_]:
        """Where something stands, by rows and columns."""
        return self.odds > KNOWN

    @property
    def free(self) -> NDArray[np.bool_]:
        """Where nothing stands, by rows and columns."""
        return self.odds < -KNOWN

    def is_free(self, x: float, y: float) -> bool:
        """Return whether nothing stands at a place, m; False where that is not known."""
        row, column = self.square(x, y)
        return self.has(row, column) and bool(self.free[row, column])

    @property
    def unknown(self) -> NDArray[np.bool_]:
        """Of what nothing is known, by rows and columns."""
        return np.abs(self.odds) <= KNOWN

    @property
    def edge(self) -> NDArray[np.bool_]:
        """Unknown squares beside free ones, by rows and columns. Those beside occupied ones are surfaces."""
        free = np.pad(self.free, 1)
        is_beside = free[:-2, 1:-1] | free[2:, 1:-1] | free[1:-1, :-2] | free[1:-1, 2:]
        return self.unknown & is_beside & (self.clearance(2.5 * self.cell) > 1.5 * self.cell)

    def is_occupied(self, x: float, y: float) -> bool:
        """Return whether something stands at a place, m; False where that is not known."""
        row, column = self.square(x, y)
        return self.has(row, column) and bool(self.occupied[row, column])

    def square(self, x: float, y: float) -> tuple[int, int]:
        """Return the row and the column of a place; they may lie outside the map."""
        return round((y - self.y) / self.cell), round((x - self.x) / self.cell)

    def place(self, row: int, column: int) -> tuple[float, float]:
        """Return the middle of a square, m."""
        return self.x + column * self.cell, self.y + row * self.cell

    def has(self, row: int, column: int) -> bool:
        """Return whether the map has such a square."""
        rows, columns = self.odds.shape
        return row in range(rows) and column in range(columns)

    def clearance(self, limit: float, *, is_unknown_free: bool = True) -> NDArray[np.float32]:
        """Return how far each square is from the nearest occupied one, m, at most *limit*.

        Args:
            limit: m.
            is_unknown_free: Whether what is unknown is no obstacle.
        """
        return self.distance_from(self.occupied if is_unknown_free else ~self.free, limit)

    def distance_from(self, chosen: NDArray[np.bool_], limit: float) -> NDArray[np.float32]:
        """Return how far each square is from the nearest chosen one, m, at most *limit*."""
        reach = int(limit / self.cell)
        rows, columns = chosen.shape
        padded = np.pad(chosen, reach)
        found = np.full(chosen.shape, limit, np.float32)
        for up in range(-reach, reach + 1):
            for aside in range(-reach, reach + 1):
                gap = self.cell * math.hypot(up, aside)
                if gap < limit:
                    there = padded[reach + up : reach + up + rows, reach + aside : reach + aside + columns]
                    np.minimum(found, np.float32(gap), out=found, where=there)
        return found

    # -- what it learns ------------------------------------------------------------------------------------------------

    def add(self, pose: Pose, distances: Sequence[float]) -> None:
        """Take eight distances into account that were read at a pose.

        Along a cone of 15 degrees to each side, nothing is nearer than a sensor says, and something is there. A sensor
        that sees nothing says that nothing is nearer than 5 cm. Where the robot is, nothing else is.

        Args:
            pose: Where the robot was, in the coordinates of the map.
            distances: ``robot.distances()``.
        """
        self._cover(pose.x - SIGHT, pose.y - SIGHT, pose.x + SIGHT, pose.y + SIGHT)
        self.changes += 1
        row, column = self.square(pose.x, pose.y)
        reach = math.ceil(SIGHT / self.cell)
        part = np.s_[row - reach : row + reach + 1, column - reach : column + reach + 1]
        beside = np.arange(-reach, reach + 1)
        x = self.x + (column + beside)[np.newaxis, :] * self.cell - pose.x
        y = self.y + (row + beside)[:, np.newaxis] * self.cell - pose.y
        added = np.where(np.hypot(x, y) < RADIUS, DRIVEN, 0.0)
        for direction, distance in zip(SENSOR_DIRECTIONS, distances, strict=True):
            axis = pose.heading + direction
            ahead = x * math.cos(axis) + y * math.sin(axis) - SENSOR_RADIUS
            aside = y * math.cos(axis) - x * math.sin(axis)
            off = np.abs(np.arctan2(aside, ahead)) / CONE
            away = np.hypot(ahead, aside)
            band = max(0.75 * self.cell, WRONG * min(distance, SURE))
            is_there = (off <= 1) & (np.abs(away - distance) <= band)
            is_between = (off <= 1) & (away < min(distance - band, SURE))
            added += np.where(is_there, OCCUPIED * (1 - off * off), 0.0) + np.where(is_between, FREE, 0.0)
        self.odds[part] = np.clip(self.odds[part] + added, -MAX_ODDS, MAX_ODDS)

    def fill(self, x: float, y: float, radius: float) -> None:
        """Put something round on the map, whatever was known there; what lies outside the map is left out."""
        rows, columns = np.ogrid[: self.odds.shape[0], : self.odds.shape[1]]
        self.odds[np.hypot(self.x + columns * self.cell - x, self.y + rows * self.cell - y) <= radius] = MAX_ODDS
        self.changes += 1

    def _cover(self, left: float, bottom: float, right: float, top: float) -> None:
        """Let the map grow until it has these places, m."""
        if not self.odds.size:
            self.x, self.y = (self.cell * round(each / self.cell) for each in (left, bottom))
        low, high = self.square(left, bottom), self.square(right, top)
        rows, columns = self.odds.shape
        before = [BLOCK * math.ceil(max(0, 2 - each) / BLOCK) for each in low]
        after = [
            BLOCK * math.ceil(max(0, each + 3 - size) / BLOCK) for each, size in zip(high, (rows, columns), strict=True)
        ]
        if not any(before + after):
            return
        _check_size(
            f"a way from ({left:.2f}, {bottom:.2f}) to ({right:.2f}, {top:.2f}) m",
            (columns + before[1] + after[1], rows + before[0] + after[0]),
            "is the pose right? Larger squares make a larger map: elib.Grid(0.02)",
        )
        self.dark = None
        self.odds = np.pad(self.odds, ((before[0], after[0]), (before[1], after[1])))
        self.x -= before[1] * self.cell
        self.y -= before[0] * self.cell

    # -- files and worlds ----------------------------------------------------------------------------------------------

    @classmethod
    def of_world(cls, world: Any, cell: float = 0.01) -> Grid:
        """Return the map of a world of the simulator: what stands in it at the beginning.

        Args:
            world: Its name, the path of its file, an ``elib.Scene`` or an ``elib.World``.
            cell: The side of a square, m.

        Raises:
            ArgumentError: The map would have more than 4,000,000 squares.

        Example:
            >>> elib.Grid.of_world("maze").odds.shape
            (141, 141)
        """
        if isinstance(world, str | os.PathLike):
            world = importlib.import_module("elib.simulator.physics.scene").Scene.load(world)
        scene = getattr(world, "scene", world)
        grid = cls(cell)
        columns, rows = round(scene.width / grid.cell) + 1, round(scene.depth / grid.cell) + 1
        _check_size(
            f"a world of {scene.width:g} x {scene.depth:g} m",
            (columns, rows),
            "larger squares make a larger map: elib.Grid.of_world(world, 0.02)",
        )
        grid.odds = np.full((rows, columns), -MAX_ODDS, np.float32)
        x, y = np.meshgrid(*(np.arange(size) * grid.cell for size in grid.odds.shape[::-1]))
        for wall in (*scene.edge, *scene.surfaces):
            count = math.ceil(4 * math.hypot(wall.x2 - wall.x1, wall.y2 - wall.y1) / grid.cell) + 1
            columns, rows = (
                np.rint(np.linspace(*ends, count) / grid.cell).astype(int)
                for ends in ((wall.x1, wall.x2), (wall.y1, wall.y2))
            )
            is_inside = (rows >= 0) & (rows < x.shape[0]) & (columns >= 0) & (columns < x.shape[1])
            grid.odds[rows[is_inside], columns[is_inside]] = MAX_ODDS
        for block in (*scene.boxes, *scene.polygons):
            is_inside = np.zeros(x.shape, bool)
            for side in block.sides:  # a place is inside if it has an odd number of sides to its right
                rows = np.flatnonzero((side.y1 > y[:, 0]) != (side.y2 > y[:, 0]))
                at = side.x1 + (y[rows, :1] - side.y1) / (side.y2 - side.y1) * (side.x2 - side.x1)
                is_inside[rows] ^= x[rows] < at
            grid.odds[is_inside] = MAX_ODDS
        for post in scene.cylinders:
            grid.fill(post.x, post.y, post.radius)
        if scene.paint:
            floor = importlib.import_module("elib.simulator.physics.floor").floor_of(scene)
            ground = importlib.import_module("elib.simulator.physics.sensors.ground")
            pixels = np.array(floor.pixels).reshape(floor.rows, floor.columns)
            places = [
                np.minimum((np.arange(size) * grid.cell * floor.scale).astype(int), limit - 1)
                for size, limit in zip(grid.odds.shape, pixels.shape, strict=True)
            ]
            colours, kinds = np.unique(pixels[np.ix_(*places)], return_inverse=True)
            is_dark = [each >= ground.HOLE_MARK or ground.brightness(int(each)) < 0.5 for each in colours]
            grid.dark = np.array(is_dark)[kinds.reshape(grid.odds.shape)]
        grid.changes += 1
        return grid

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the map as a picture, and beside it a TOML file with the size of its squares and where they are.

        Free is white, occupied black, unknown grey. :meth:`open` reads both again.

        Args:
            path: The picture, such as ``room.png``; the other file is then ``room.toml``.

        Raises:
            ArgumentError: A file cannot be written, or the picture's name does not end in ``.png``.
        """
        from PIL import Image  # only pictures need Pillow

        if Path(path).suffix.lower() != ".png":
            raise ArgumentError(f"a map is saved as a PNG file: {path} does not end in .png")
        odds = self.odds[::-1].astype(float)
        grey = np.rint(255 / (1 + np.exp(odds))).astype(np.uint8)
        write_file(path, as_png(Image.fromarray(grey)))
        lines = f"cell = {self.cell!r}  # m\norigin = [{self.x!r}, {self.y!r}]  # middle of the lower left square, m\n"
        write_file(Path(path).with_suffix(".toml"), lines.encode())

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> Grid:
        """Read a map that :meth:`save` wrote, or a picture that was drawn by hand with such a TOML file beside it.

        Args:
            path: The picture.

        Raises:
            ArgumentError: One of the files cannot be read, or says something else.
        """
        import io
        import tomllib

        from PIL import Image

        content = read_file(path, "the map", largest=100_000_000)
        beside = Path(path).with_suffix(".toml")
        text = read_file(beside, "the map's file", largest=10_000, hint=LINES)
        try:
            told = tomllib.loads(text.decode())
            (x, y), cell = map(float, told["origin"]), float(told["cell"])
        except (ValueError, KeyError, TypeError):
            raise ArgumentError(f"{beside} does not say how large a square is, and where", hint=LINES) from None
        grid = cls(cell)
        try:
            with warnings.catch_warnings(action="ignore"):  # of its size, which is checked here
                picture = Image.open(io.BytesIO(content))
            with picture:
                _check_size(f"{path}", picture.size, "make the picture smaller, and cell larger")
                if np.ptp(np.asarray(picture.convert("RGB"), int), axis=2).max() > COLOURED:
                    raise ArgumentError(f"{path} has colours", hint="white is free, black occupied, grey unknown")
                grey = np.asarray(picture.convert("L"), float)[::-1]
        except Image.DecompressionBombError:
            raise ArgumentError(
                f"{path} has too many pixels", hint="make the picture smaller, and cell larger"
            ) from None
        except (OSError, SyntaxError):
            hint = "a map is a picture, such as room.png, with room.toml beside it"
            raise ArgumentError(f"{path} is not a picture", hint=hint) from None
        share = np.clip(grey / 255, 0.001, 0.999)
        grid.odds = np.clip(np.log((1 - share) / share), -MAX_ODDS, MAX_ODDS).astype(np.float32)
        grid.odds[np.abs(grid.odds) < 0.01] = 0  # grey 127 and 128
        grid.x, grid.y, grid.changes = x, y, 1
        return grid

    def to_text(self) -> str:
        """Return what is known as text: ``#`` is occupied, ``.`` free, ``?`` unknown; the last row has the least y.

        The line before the rows has the side of a square and the middle of the lower left one, m.

        Example:
            >>> grid = elib.Grid.of_world("maze", cell=0.1)
            >>> print(grid.to_text()[:32])
            map 0.1 0.0 0.0
            ###############
        """
        shown = np.select([self.occupied, self.free], ["#", "."], "?")
        low, high = (
            ([0, 0], [0, 0])
            if self.unknown.all()
            else [find(np.argwhere(~self.unknown), axis=0) for find in (np.min, np.max)]
        )
        x, y = self.place(low[0], low[1])
        rows = shown[low[0] : high[0] + 1, low[1] : high[1] + 1][::-1]
        return "\n".join([f"map {self.cell:.6g} {x:.6g} {y:.6g}", *map("".join, rows)])

    def to_world(self, path: str | os.PathLike[str]) -> None:
        """Write the map as a world of the simulator: occupied squares become boxes.

        The arena is as large as the map, its lower left corner is that of the map. A robot stands where it has room.

        Args:
            path: Such as ``room-world.toml``, for ``elib simulate room-world.toml``.

        Raises:
            ArgumentError: The file cannot be written.
        """
        rows, columns = self.odds.shape
        texts = [
            'about = "A map, as a world."\n',
            f"[arena]\nsize = [{columns * self.cell:.6g}, {rows * self.cell:.6g}]\nrobots = 1\n",
        ]
        for row, column, tall, wide in rectangles(self.occupied):
            middle = f"[{(column + wide / 2) * self.cell:.6g}, {(row + tall / 2) * self.cell:.6g}]"
            size = f"[{wide * self.cell:.6g}, {tall * self.cell:.6g}]"
            texts.append(f"[[box]]\nposition = {middle}\nsize = {size}\n")
        write_file(path, "\n".join(texts).encode())

    def __repr__(self) -> str:
        rows, columns = self.odds.shape
        known = f"{int(self.occupied.sum())} occupied, {int(self.free.sum())} free"
        return f"<Grid of {columns} x {rows} squares of {self.cell:g} m: {known}>"


def _check_size(what: str, size: tuple[int, int], hint: str) -> None:
    """Raise ArgumentError if a map of so many columns and rows is too large."""
    if size[0] * size[1] > MAX_CELLS:
        raise ArgumentError(f"{what} makes {size[0]} x {size[1]} squares: too large a map", hint=hint)


def check_grid(map: object) -> None:  # noqa: A002
    """Raise ArgumentError unless that is a map."""
    if not isinstance(map, Grid):
        raise ArgumentError(
            f"the map is {map!r}; it must be an elib.Grid",
            hint='elib.Grid.open("room.png") opens a map, elib.Grid.of_world("maze") takes that of a world',
        )


def rectangles(taken: NDArray[np.bool_]) -> Iterable[tuple[int, int, int, int]]:
    """Yield rectangles that cover what is taken: first row, first column, rows, columns. None lies over another."""
    left = taken.copy()
    for row, column in zip(*map(np.ndarray.tolist, np.nonzero(taken)), strict=True):
        if not left[row, column]:
            continue
        wide = tall = 1
        while column + wide < left.shape[1] and left[row, column + wide]:
            wide += 1
        while row + tall < left.shape[0] and left[row + tall, column : column + wide].all():
            tall += 1
        left[row : row + tall, column : column + wide] = False
        yield row, column, tall, wide
