"""What robots see: pictures of a scene, and windows of the chip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from world_rig import Room

from elib.simulator.physics import Scene
from elib.simulator.physics.engine import EngineName
from elib.simulator.physics.optics import Chip
from elib.simulator.physics.worldreading import SHOWN

Offsets = Sequence[float]
Picture = NDArray[np.uint8]
NOTHING = np.zeros((0, SHOWN), np.int64)
FAITHFUL = Chip(1.0, 1.0, (0.0, 0.0, 0.0))
"""Shows colours as they are."""


def window(columns: int, rows: int, zoom: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the offsets of a window in the middle of the chip."""
    return centred(columns, zoom), tuple(-offset for offset in centred(rows, zoom))


def centred(count: int, zoom: float) -> tuple[float, ...]:
    return tuple((k + 0.5) * zoom - count * zoom / 2 for k in range(count))


def showing(robots: int, shown: dict[int, dict[int, int]]) -> NDArray[np.int64]:
    """Return what *robots* show: of those named, LED 0..7 a colour, 8 the body, 9 the front LED."""
    lamps = np.zeros((robots, SHOWN), np.int64)
    for robot, lit in shown.items():
        for led, value in lit.items():
            lamps[robot, led] = value
    return lamps


class Cameras(Room):
    """The cameras of all robots of a scene; their chips show colours as they are, without noise."""

    def __init__(
        self, scene: Scene, *, engine: EngineName = "interpreted", lamps: NDArray[np.int64] = NOTHING, lens: str = ""
    ) -> None:
        model = replace(scene.model, quality="ideal", sensor_noise=0.0, lens=lens or scene.model.lens)
        super().__init__(replace(scene, model=model), engine=engine)
        self.ambient, self.lamps = scene.model.ambient, lamps

    def picture(self, right: Offsets, up: Offsets, *, robot: int = 0, ambient: float | None = None) -> Picture:
        self.state.world.setting[0].ambient = self.ambient if ambient is None else ambient
        return self.senses.pictures(FAITHFUL, (robot,), self.lamps, (right, up))[0]
