"""Small pictures of the worlds that come with elib, for the start page."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from functools import cache

from msgspec import Struct

from elib.base.pictures import as_png
from elib.simulator.drawing.png import render
from elib.simulator.drawing.top import Tones, top_view
from elib.simulator.physics import Colour, World
from elib.simulator.worlds.files import gallery, load_file


class WorldInfo(Struct):
    """A world that comes with elib: a sentence about it, number of robots, and their firmwares."""

    name: str
    about: str
    robots: int
    firmware: str


SIZE = 480
"""Pixels of the longer side."""
SCALE_BAR = 24
"""Pixels at the bottom of a drawing with a bar that could not be read so small."""
LIGHT = Tones(Colour(223, 228, 234), Colour(251, 250, 245), Colour(231, 229, 220), Colour(74, 82, 97))
DARK = Tones(Colour(17, 21, 27), Colour(42, 49, 59), Colour(52, 61, 74), Colour(140, 151, 168))
"""What tokens.css of the page names room, floor, grid and wall."""


async def world_picture(name: str, *, is_dark: bool) -> bytes | None:
    """Return the picture of a world as PNG; None if there is no such world."""
    return await asyncio.to_thread(_draw, name, DARK if is_dark else LIGHT) if name in gallery() else None


@cache
def _draw(name: str, tones: Tones) -> bytes:
    drawing = top_view(World(load_file(name).scene).snapshot(), (), "", SIZE, tones=tones)
    return as_png(render(replace(drawing, height=drawing.height - SCALE_BAR)), is_small=True)


@cache
def world_list() -> list[WorldInfo]:
    """Return the worlds that come with elib."""
    found = []
    for name in gallery():
        file = load_file(name)
        firmwares = sorted({each for each in file.scene.firmware if each})
        robots = max(1, len(file.scene.starts))  # a whole world takes long to build
        found.append(WorldInfo(name, file.about, robots, ", ".join(firmwares)))
    return found
