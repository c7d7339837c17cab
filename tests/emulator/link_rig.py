"""A toy robot on a link, in simulated time: it answers every line with the line in small letters."""

import asyncio
from dataclasses import dataclass, field

from elib.link.transport.memory import MemoryTransport, memory_pair
from elib.simulator.emulator.link import Link


@dataclass(frozen=True)
class Piece:
    time: float
    data: bytes
    answer: int


@dataclass
class Parrot:
    """Answers the line ``AB\\r`` with ``ab\\r\\n`` after a fixed time, in pieces if it is long."""

    service: float = 0.0
    piece: int = 64
    heard: bytearray = field(default_factory=bytearray)
    arrivals: list[tuple[float, bytes]] = field(default_factory=list)
    _line: bytearray = field(default_factory=bytearray)
    _out: list[Piece] = field(default_factory=list)
    _answers: int = 0
    _free: float = 0.0

    def receive(self, data: bytes, time: float) -> None:
        self.arrivals.append((time, data))
        self.heard += data
        for byte in data:
            if byte == ord("\r"):
                self._answer(bytes(self._line).lower() + b"\r\n", time)
                self._line.clear()
            else:
                self._line.append(byte)

    def say(self, data: bytes, time: float) -> None:
        """Send bytes that answer nothing."""
        self._out.append(Piece(time, data, 0))

    def advance(self, time: float) -> list[Piece]:
        ready = [piece for piece in self._out if piece.time <= time]
        self._out = self._out[len(ready) :]
        return ready

    @property
    def due(self) -> float | None:
        return self._out[0].time if self._out else None

    @property
    def is_idle(self) -> bool:
        return not self._out

    def _answer(self, data: bytes, time: float) -> None:
        self._answers += 1
        self._free = max(self._free, time)
        for start in range(0, len(data), self.piece):
            self._free += self.service
            self._out.append(Piece(self._free, data[start : start + self.piece], self._answers))


@dataclass
class Rig:
    robot: Parrot
    host: MemoryTransport
    link: Link

    async def ask(self, line: bytes, wait: float = 1.0) -> bytes:
        """Send *line* and return everything that comes within *wait* seconds."""
        await self.host.write(line)
        return await self.listen(wait)

    async def listen(self, wait: float = 1.0) -> bytes:
        heard = bytearray()
        try:
            async with asyncio.timeout(wait):
                while True:
                    heard += await self.host.read()
        except TimeoutError:
            return bytes(heard)


def make_rig(robot: Parrot | None = None, **options: float) -> Rig:
    robot = robot or Parrot()
    host, end = memory_pair("sim://toy")
    link = Link(robot, **options)
    link.attach(end)
    return Rig(robot, host, link)
