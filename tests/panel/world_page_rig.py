"""A served simulation with its page, and a page's end of the WebSocket."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import struct
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path

from elib.panel.panel import WORLD, Panel
from elib.panel.server.http import own_address, served
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.server import Served, serve
from elib.simulator.emulator.settings import SimulationSettings
from shared import PATIENCE

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
        control: Of the simulation.
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
async def simulated(folder: Path, world: str = ROOM, **settings: object) -> AsyncIterator[tuple[Control, list[Served]]]:
    """Serve a world, whose file goes into the folder."""
    path = folder / "room.toml"
    path.write_text(world)
    controls: list[Control] = []
    built = SimulationSettings(world=str(path), baud=0, **settings)  # type: ignore[arg-type]
    async with serve(built, tcp="0", control=controls.append) as robots:
        yield controls[0], robots


@contextlib.asynccontextmanager
async def watched(folder: Path, *, world: str = ROOM, **settings: object) -> AsyncIterator[Rig]:
    """Serve a world with its page; files go into the folder."""
    with contextlib.chdir(folder):
        async with (
            simulated(folder, world, **settings) as (control, robots),
            served(Panel(can=WORLD, worlds={"": control}), own_address("0")) as server,
        ):
            yield Rig(control, robots, server.url)


@dataclass(frozen=True)
class Frame:
    """A frame, taken apart anew from what elib/panel/server/world.py says of it."""

    number: int
    channel: int
    time: float
    poses: list[tuple[float, float, float]]
    rays: list[tuple[float, ...]]
    bits: bytes
    rings: list[bytes]
    is_kept: bool

    @classmethod
    def parse(cls, data: bytes) -> Frame:
        number, flags, time, count, channel = struct.unpack_from("<IIdII", data)
        at = 24
        poses = [struct.unpack_from("<3f", data, at + 12 * k) for k in range(count)]
        at += 12 * count
        rays = [struct.unpack_from("<5f", data, at + 20 * k) for k in range(8 * count)] if flags & 1 else []
        at += 20 * len(rays)
        bits = data[at : at + count]
        at += count
        rings = [data[at + 24 * k : at + 24 * k + 24] for k in range(count)]
        assert len(data) == at + 24 * count
        return cls(number, channel, time, poses, rays, bits, rings, flags & 2 != 0)


class Page:
    """A browser's end."""

    def __init__(self, socket) -> None:
        self.socket = socket
        self._ids = itertools.count(1)
        self._before: list[dict] = []  # What was told before the last answer: a change may come first.

    async def say(self, what: str, /, **values: object) -> None:
        """Say something that needs no answer."""
        await self.socket.send(json.dumps({"do": what, **values}))

    async def hear(self, kind: str) -> dict:
        """Return the next message of a kind; what comes before it is drawn."""
        while kind != "answer" and self._before:
            if (told := self._before.pop(0))["type"] == kind:
                return told
        async with asyncio.timeout(PATIENCE):
            while True:
                message = await self.socket.recv()
                if isinstance(message, bytes):
                    await self.drawn(Frame.parse(message))
                    continue
                found = json.loads(message)
                if found["type"] == "update":
                    await self.say("drawn", number=found["number"])
                if found["type"] == kind:
                    return found
                if kind == "answer":
                    self._before.append(found)

    async def frame(self, *, draw: bool = True) -> Frame:
        """Return the next frame."""
        async with asyncio.timeout(PATIENCE):
            while not isinstance(message := await self.socket.recv(), bytes):
                pass
        found = Frame.parse(message)
        if draw:
            await self.drawn(found)
        return found

    async def drawn(self, frame: Frame) -> None:
        """Say that a frame is on the screen."""
        await self.say("frames_drawn", frames=[[frame.channel, frame.number]])

    async def ask(self, what: str, /, **values: object) -> dict:
        """Ask for something and return the answer."""
        number = next(self._ids)
        self._before.clear()
        await self.say(what, id=number, **values)
        while (found := await self.hear("answer"))["id"] != number:
            pass
        return found

    async def scene(self) -> dict:
        """Return the next scene of a world."""
        while (found := (await self.hear("scene"))["scene"]) is None:
            pass
        return found


@contextlib.asynccontextmanager
async def opened(rig: Rig) -> AsyncIterator[Page]:
    """Open the page's WebSocket, as the browser does."""
    from websockets.asyncio.client import connect

    async with connect(f"ws://{rig.host}/ws", origin=f"http://{rig.host}") as socket:  # type: ignore[arg-type]
        page = Page(socket)
        await page.say("subscribe", what="world", rate=25)
        yield page
