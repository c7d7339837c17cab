"""A robot made of a script: it says exactly what a test wants, when the test wants it."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field

import pytest

from elib.base.errors import LinkError, ReplyTimeout
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context
from elib.link.protocol.table import Request
from elib.link.session import Session
from elib.link.transport.memory import MemoryTransport, memory_pair

VERSIONS = {
    "btcom-1.1.3": b"v,Version 1.1.3 September 2006\r\n",
    "btcom-2.0": b"v,Version 2.0.0 January 2008\r\n",
    "asercom-1.2.2": b"v,Version 1.2.2 August 2008 GCtronic\r\nHW version: FFF7\r\n",
    "epuck2": b"v,Version 2.0 January 2018 GCtronic\r\nHW version: FFF7\r\n",
}
ANSWERS = {
    b"D": b"d\r\n",
    b"E": b"e,0,0\r\n",
    b"S": b"s\r\n",
    b"N": b"n,1,2,3,4,5,6,7,8\r\n",
    b"O": b"o,11,12,13,14,15,16,17,18\r\n",
    b"Q": b"q,5,-6\r\n",
    b"C": b"c,3\r\n",
    b"F": b"f\r\n",
    b"B": b"b\r\n",
    b"L": b"l\r\n",
    b"T": b"t\r\n",
    b"P": b"p\r\n",
    b"J": b"j\r\n",
    b"A": b"a,1892,2206,2800\r\n",
    b"U": b"u,10,6,17\r\n",
    b"G": b"g IR check : 0x1, address : 0xa, data : 0xff\r\n",
    b"I": b"i,1,40,40,8,3200\r\n",
    b"K": b"k, Starting calibration - Remove any object in sensors range\r\nk, Calibration finished\r\n",
}
Part = bytes | float


@dataclass
class FakeRobot:
    """Answers each line after *delay*; a script entry replaces the next answer to its letter.

    An answer is a list of bytes and pauses (floats, s). ``heard`` keeps (time, line) of everything that came.
    """

    transport: MemoryTransport
    firmware: str = "btcom-1.1.3"
    delay: float = 0.02
    answers: dict[bytes, list[Part]] = field(default_factory=dict)
    script: dict[bytes, list[list[Part]]] = field(default_factory=dict)
    heard: list[tuple[float, bytes]] = field(default_factory=list)
    raw: bytearray = field(default_factory=bytearray)

    def next_answer(self, letter: bytes, *parts: Part) -> None:
        """Queue a special answer to the next command with this letter (``b"\\xb7"`` is the picture)."""
        self.script.setdefault(letter, []).append(list(parts))

    @property
    def lines(self) -> list[bytes]:
        return [line for _, line in self.heard]

    async def run(self) -> None:
        with contextlib.suppress(LinkError):
            buffer = bytearray()
            while True:
                data = await self.transport.read()
                self.raw += data
                buffer += data
                while command := self._take(buffer):
                    self.heard.append((asyncio.get_running_loop().time(), command))
                    await self._answer(command)

    @staticmethod
    def _take(buffer: bytearray) -> bytes:
        while buffer and buffer[0] in b"\0\r\n":
            del buffer[0]
        if not buffer:
            return b""
        end = buffer.find(b"\0" if buffer[0] >= 0x80 else b"\r")
        if end < 0:
            return b""
        command = bytes(buffer[:end])
        del buffer[: end + 1]
        return command

    async def _answer(self, command: bytes) -> None:
        letter = command[:1]
        queued = self.script.get(letter)
        if queued:
            parts = queued.pop(0)
        elif letter in self.answers:
            parts = [self.delay, *self.answers[letter]]
        elif letter == b"V":
            parts = [self.delay, VERSIONS[self.firmware]]
        else:
            parts = [self.delay, ANSWERS.get(letter.upper(), b"z,Command not found\r\n")]
        for part in parts:
            if isinstance(part, bytes):
                await self.transport.write(part)
            else:
                await asyncio.sleep(part)  # clock: simulated


@dataclass
class Rig:
    session: Session
    robot: FakeRobot
    link: MemoryTransport
    """The robot's end of the line."""

    @property
    def now(self) -> float:
        return asyncio.get_running_loop().time()

    def request(self, name: str, *args: object) -> Request[object]:
        return SPECS[name].request(self.session.context, *args)

    async def ask(self, name: str, *args: object, within: float = 1.0) -> object:
        return await self.session.execute(self.request(name, *args), within)

    async def lose(self, name: str, *args: object, within: float = 0.1) -> None:
        """Ask, and let the time be over before the answer."""
        with pytest.raises(ReplyTimeout):
            await self.ask(name, *args, within=within)

    def begin(self, name: str, *args: object, within: float = 1.0) -> "asyncio.Task[object]":
        return asyncio.ensure_future(self.ask(name, *args, within=within))


@contextlib.asynccontextmanager
async def rig(
    firmware: str = "btcom-1.1.3", *, delay: float = 0.02, prepare: Callable[[FakeRobot], None] | None = None
) -> AsyncIterator[Rig]:
    """A session with a fake robot."""
    host, far = memory_pair()
    robot = FakeRobot(far, firmware, delay)
    if prepare is not None:
        prepare(robot)
    task = asyncio.ensure_future(robot.run())
    try:
        session = await Session.open(host)
        robot.heard.clear()
        robot.raw.clear()
        try:
            yield Rig(session, robot, far)
        finally:
            await session.close()
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        await far.close()


__all__ = ["ANSWERS", "VERSIONS", "Context", "FakeRobot", "Rig", "rig"]
