"""A served simulation with a live view, and a page's end of the WebSocket."""

from __future__ import annotations

import asyncio
import contextlib
import json
import struct
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path

from elib.view.live import watchable

from elib.emulator.control import Control
from elib.emulator.server import Served, serve
from elib.emulator.settings import SimulationSettings

PATIENCE = 20.0

ROOM = """
[arena]
size = [1.2, 0.8]
[[wall]]
from = [0.6, 0.0]
to = [0.6, 0.2]
colour = "#204060"
[[box]]
position = [1.0, 0.2]
size = [0.12, 0.08]
colour = "#d04030"
pushable = true
[[cylinder]]
position = [0.2, 0.6]
radius = 0.05
[[light]]
position = [1.1, 0.7]
[[sound]]
position = [0.1, 0.1]
[[robot]]
position = [0.4, 0.4]
[[robot]]
position = [0.8, 0.5]
heading = 90
"""

PAINT = """
[floor]
colour = "#205030"
[[stripe]]
points = [[0.1, 0.3], [1.1, 0.3]]
width = 0.06
colour = "#ff0000"
"""


@dataclass
class Rig:
    """What a test has to do with.

    Attributes:
        control: The door of the simulation.
        robots: How they are reached.
        url: Of the page.
    """

    control: Control
    robots: list[Served]
    url: str

    @property
    def host(self) -> str:
        return self.url.removeprefix("http://").rstrip("/")


@contextlib.asynccontextmanager
async def watched(folder: Path, *, world: str = ROOM) -> AsyncIterator[Rig]:
    """Serve a world with its live view."""
    path = folder / "room.toml"
    path.write_text(world)
    doors: list[Control] = []
    settings = SimulationSettings(world=str(path), baud=0)
    async with serve(settings, tcp="0", control=doors.append) as robots, watchable(doors[0], "0") as url:
        yield Rig(doors[0], robots, url)


@dataclass(frozen=True)
class Frame:
    """A frame, taken apart anew from what elib/view/wire.py says of it."""

    number: int
    time: float
    poses: list[tuple[float, float, float]]
    rays: list[tuple[float, ...]]
    bits: bytes
    rings: list[bytes]

    @classmethod
    def parse(cls, data: bytes) -> Frame:
        number, flags, time, count, _ = struct.unpack_from("<IIdII", data)
        at = 24
        poses = [struct.unpack_from("<3f", data, at + 12 * k) for k in range(count)]
        at += 12 * count
        rays = [struct.unpack_from("<5f", data, at + 20 * k) for k in range(8 * count)] if flags & 1 else []
        at += 20 * len(rays)
        bits = data[at : at + count]
        at += count
        rings = [data[at + 24 * k : at + 24 * k + 24] for k in range(count)]
        assert len(data) == at + 24 * count
        return cls(number, time, poses, rays, bits, rings)


class Page:
    """A browser's end."""

    def __init__(self, socket) -> None:
        self.socket = socket

    async def hear(self, kind: str) -> dict:
        """Return the next message of a kind; frames before it are drawn."""
        async with asyncio.timeout(PATIENCE):
            while True:
                message = await self.socket.recv()
                if isinstance(message, bytes):
                    await self.socket.send(message[:4])
                elif (found := json.loads(message)).get("kind", "reply") == kind:
                    return found

    async def frame(self, *, draw: bool = True) -> Frame:
        """Return the next frame."""
        async with asyncio.timeout(PATIENCE):
            while not isinstance(message := await self.socket.recv(), bytes):
                pass
        if draw:
            await self.socket.send(message[:4])
        return Frame.parse(message)

    async def ask(self, **message: object) -> dict:
        """Ask for something and return the answer."""
        await self.socket.send(json.dumps(message))
        return await self.hear("reply")


@contextlib.asynccontextmanager
async def opened(rig: Rig) -> AsyncIterator[Page]:
    """Open the page's WebSocket, as the browser does."""
    from websockets.asyncio.client import connect

    async with connect(f"ws://{rig.host}/live", origin=f"http://{rig.host}") as socket:
        yield Page(socket)
