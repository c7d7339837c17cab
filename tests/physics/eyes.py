"""A camera on its own: a scene laid out flat, and windows of the chip."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from elib.physics import Scene
from elib.physics.assembly import Solids, robot_records
from elib.physics.engine import EngineName, engine_named
from elib.physics.floor import floor_of
from elib.physics.sensors.camera import Camera, Lens
from elib.physics.sensors.shining import LAMPS

Offsets = Sequence[float]
Picture = NDArray[np.uint8]


def window(columns: int, rows: int, zoom: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the offsets of a window in the middle of the chip."""
    return centred(columns, zoom), tuple(-offset for offset in centred(rows, zoom))


def centred(count: int, zoom: float) -> tuple[float, ...]:
    return tuple((k + 0.5) * zoom - count * zoom / 2 for k in range(count))


def showing(robots: int, shown: dict[int, dict[int, int]]) -> list[int]:
    """Return what *robots* show: of those named, LED 0..7 a colour, 8 the body, 9 the front LED."""
    lamps = [0] * (robots * LAMPS)
    for robot, lit in shown.items():
        for led, value in lit.items():
            lamps[robot * LAMPS + led] = value
    return lamps


class Eyes:
    """The cameras of all robots of a scene."""

    def __init__(
        self, scene: Scene, *, engine: EngineName = "interpreted", lamps: Sequence[int] = (), lens: Lens | None = None
    ) -> None:
        self.engine = engine_named(engine)
        solids = Solids(scene, scene.boxes, scene.cylinders, 0.1, 1)
        lights = [number for lamp in scene.lights for number in (lamp.x, lamp.y, lamp.height, lamp.intensity)]
        self.ambient = scene.model.ambient
        self.robots = self.engine.floats(robot_records(scene, scene.starts, 0))
        self.walls, self.discs = self.engine.floats(solids.walls), self.engine.floats(solids.discs)
        self.lamps, self.lights = self.engine.ints(lamps), self.engine.floats(lights)
        self.camera = Camera(scene, self.engine, floor_of(scene), lens=lens)

    def picture(self, right: Offsets, up: Offsets, *, robot: int = 0, ambient: float | None = None) -> Picture:
        light = self.ambient if ambient is None else ambient
        flat = self.robots, self.walls, self.discs, self.lamps, self.lights
        return self.camera.picture(robot, *flat, light, right, up)

    def packed(self, right: Offsets, up: Offsets, *, robot: int = 0) -> list[int]:
        flat = self.robots, self.walls, self.discs, self.lamps, self.lights
        seen = self.camera.render(robot, *flat, self.ambient, right, up)
        return [int(seen[k]) for k in range(len(seen))]
