"""Small pictures of the worlds that come with elib, for the start page."""

from __future__ import annotations

import asyncio
from functools import cache

from msgspec import Struct

from elib.simulator.drawing.png import png_of
from elib.simulator.physics import World
from elib.simulator.worlds.files import gallery, load_file


class WorldInfo(Struct):
    """A world that comes with elib: a sentence about it, number of robots, and their firmwares."""

    name: str
    about: str
    robots: int
    firmware: str


SIZE = 320
"""Pixels of the longer side."""


async def world_picture(name: str) -> bytes | None:
    """Return the picture of a world as PNG; None if there is no such world."""
    return await asyncio.to_thread(_draw, name) if name in gallery() else None


@cache
def _draw(name: str) -> bytes:
    return png_of(World(load_file(name).scene).snapshot(), caption="", size=SIZE)


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
