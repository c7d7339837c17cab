"""The camera: a pinhole that looks level and forward, one for all robots of a world.

Picture coordinates are offsets on the sensor from its optical axis in sensor pixels, to the right and up, so a
window, a zoom and the way a chip is mounted are all arithmetic of the caller. How the picture is found stands in
:mod:`~elib.physics.sensors.casting`, how bright it is in :mod:`~elib.physics.sensors.optics`.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, cast

from elib.physics.engine import Engine
from elib.physics.floor import Floor
from elib.physics.geometry import Colour
from elib.physics.layout import DISC, LIGHT, ROBOT, WALL, Floats, Ints
from elib.physics.scene import Scene
from elib.physics.sensors.casting import MARKS, SKYLINE
from elib.physics.sensors.optics import (
    ABOVE,
    DISC_COUNT,
    FOCAL,
    FORWARD,
    LENSES,
    LIGHT_COUNT,
    ROBOT_COUNT,
    SENSOR,
    SHOWING,
    WALL_COUNT,
    Lens,
    Window,
)
from elib.physics.sensors.painting import paint_columns
from elib.physics.sensors.rendering import WEIGHT, render, render_spread
from elib.physics.sensors.shining import LAMPS, quick_fill

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["ABOVE", "FOCAL", "FORWARD", "LENSES", "SENSOR", "Camera", "Lens"]

BACKGROUND = Colour(214, 222, 230)
"""What is seen above the walls."""

MOST_WINDOWS = 16
"""Kept at a time: each robot uses one or two, and all share one camera."""


class Camera:
    """The eye of every robot of one world.

    Attributes:
        digest: Of the picture last returned by :meth:`picture`, 32 bits: of equal pictures equal, on both engines.
    """

    def __init__(self, scene: Scene, engine: Engine, floor: Floor, *, lens: Lens | None = None) -> None:
        """Prepare for pictures of *scene*.

        Args:
            scene: Of which the pictures are.
            engine: Of the kernels; it also makes the sequences given to :meth:`picture`.
            floor: What is painted on the floor.
            lens: Through which the robots look; None for the usual one.
        """
        self.digest = 0
        self._engine = engine
        self._floor = floor
        self._lens = LENSES["epucklib"] if lens is None else lens
        self._paint = engine.ints(floor.pixels)
        self._is_compiled = engine.name == "compiled"
        self._render = engine.bare(render)
        if not self._is_compiled:
            columns = engine.bare(paint_columns, fill=quick_fill())
            self._render = engine.bare(render, paint_columns=columns)
        self._render_spread = engine.bare(render_spread)
        self._empty: Callable[..., NDArray[np.uint8]] | None = None
        self._windows: dict[tuple[tuple[float, ...], tuple[float, ...]], Window] = {}
        self._scratch = engine.floats(()), engine.ints(())
        self._window = self._window_of((), ())
        # What the last picture was taken of and through: most often the next one is of the same.
        self._robots = self._walls = self._discs = self._lights = engine.floats(())
        self._lamps = engine.ints(())
        self._right: object = None
        self._up: object = None
        self._sequences = self._sequences_of(self._window)

    def picture(
        self,
        robot: int,
        robots: Floats,
        walls: Floats,
        discs: Floats,
        lamps: Ints,
        lights: Floats,
        ambient: float,
        right: Sequence[float],
        up: Sequence[float],
    ) -> NDArray[np.uint8]:
        """Return what a robot sees; the first picture loads numpy.

        Args:
            robot: Index.
            robots: All robots (:mod:`elib.physics.layout`).
            walls: All walls, the sides of boxes among them.
            discs: All cylinders.
            lamps: What each robot shows, ten integers: eight colours of its ring, body 0 or 1, front 0 or 1; empty if
                none shows anything.
            lights: All lamps of the world.
            ambient: What the infrared sensors read in the room's light, counts, 0..4095, higher is darker.
            right: Offset of each column's centre to the right of the axis, sensor pixels, evenly spaced. Tuples are
                recognised at once when they come again.
            up: Offset of each row's centre above the axis, the same.

        Returns:
            Red, green, blue, 0..255, in the shape (rows, columns, 3); rows and columns in the order given.

        Raises:
            ArgumentError: Offsets are not finite or not evenly spaced.
        """
        window = self._aim(robots, walls, discs, lamps, lights, right, up)
        if self._empty is None:
            import numpy as np

            self._empty = np.empty
        counts = self._empty(window.shape, "u1")
        if self._is_compiled:
            self.digest = self._render_spread(robot, ambient, *self._sequences, window.size, counts.ravel())
            return counts
        cast("Any", window.pixels)[:] = window.blank
        self._render(robot, ambient, *self._sequences)
        self.digest = _spread(window, counts)
        return counts

    def render(
        self,
        robot: int,
        robots: Floats,
        walls: Floats,
        discs: Floats,
        lamps: Ints,
        lights: Floats,
        ambient: float,
        right: Sequence[float],
        up: Sequence[float],
    ) -> Ints:
        """Return the same picture as one sequence, row by row, each pixel 65536 red + 256 green + blue.

        The sequence is the camera's own and is overwritten by the next picture of the same window.
        """
        window = self._aim(robots, walls, discs, lamps, lights, right, up)
        cast("Any", window.pixels)[:] = window.blank  # Whole sequences, arrays of one kind or the other.
        self._render(robot, ambient, *self._sequences)
        return window.pixels

    def _aim(
        self,
        robots: Floats,
        walls: Floats,
        discs: Floats,
        lamps: Ints,
        lights: Floats,
        right: Sequence[float],
        up: Sequence[float],
    ) -> Window:
        """Return the window, ready for a picture of these things; no sequence ever changes its length."""
        if (
            right is self._right
            and up is self._up
            and robots is self._robots
            and walls is self._walls
            and discs is self._discs
            and lamps is self._lamps
            and lights is self._lights
        ):
            return self._window
        self._window = window = self._window_of(tuple(right), tuple(up))
        # Anything but a tuple may hold other offsets next time.
        self._right, self._up = (right, up) if type(right) is tuple and type(up) is tuple else (None, None)
        self._robots, self._walls, self._discs, self._lamps, self._lights = robots, walls, discs, lamps, lights
        plan = window.plan
        plan[ROBOT_COUNT] = len(robots) // ROBOT
        plan[WALL_COUNT] = len(walls) // WALL
        plan[DISC_COUNT] = len(discs) // DISC
        plan[LIGHT_COUNT] = len(lights) // LIGHT
        plan[SHOWING] = len(lamps) // LAMPS
        self._sequences = self._sequences_of(window)
        return window

    def _sequences_of(
        self, window: Window
    ) -> tuple[Floats, Floats, Floats, Ints, Floats, Ints, Floats, Ints, Floats, Ints, Ints, Ints]:
        """Return everything that the kernels take, in their order."""
        solids = self._robots, self._walls, self._discs
        return *solids, self._lamps, self._lights, self._paint, *self._scratch, *window.sequences

    def _window_of(self, right: tuple[float, ...], up: tuple[float, ...]) -> Window:
        window = self._windows.get((right, up))
        if window is None:
            window = Window(self._lens, self._engine, right, up, self._floor, BACKGROUND)
            if len(self._windows) == MOST_WINDOWS:
                del self._windows[next(iter(self._windows))]
            self._windows[right, up] = window
            if len(right) * MARKS > len(self._scratch[1]):
                hits, marks = [0.0] * (len(right) * SKYLINE), [0] * (len(right) * MARKS)
                self._scratch = self._engine.floats(hits), self._engine.ints(marks)
        return window


def _spread(window: Window, counts: NDArray[np.uint8]) -> int:
    """Write red, green and blue of each pixel of *window* side by side into *counts*; return the digest."""
    import numpy as np

    words = np.frombuffer(cast("array[int]", window.pixels), np.uint32).astype("<u4", copy=False)
    parts = words.view(np.uint8).reshape(window.rows, window.columns, 4)
    for k in range(3):
        counts[:, :, k] = parts[:, :, 2 - k]
    return int(np.dot(words, _weights(window.size))) & 0xFFFFFFFF


@lru_cache(maxsize=MOST_WINDOWS)
def _weights(size: int) -> NDArray[np.int64]:
    """Return how each of *size* pixels counts in the digest."""
    import numpy as np

    return np.arange(size, dtype=np.int64) * WEIGHT & 0xFFFF | 1
