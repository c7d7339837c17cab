"""A small, strict e-puck2 on Wi-Fi for tests, written from docs/reference/wire-protocol.md 4, and the air before it.

It shares nothing with elib's own codec: offsets and sizes stand here again. Every fetch of its sensors and every
picture has a number of its own, and what it did is kept with its time.
"""

# clock: simulated

import asyncio
import contextlib
import math
import struct
from collections import deque
from collections.abc import AsyncIterator, Iterable
from dataclasses import dataclass, field
from itertools import pairwise

from elib.link.session import Session
from elib.link.transport.memory import MemoryTransport

SENSOR_CYCLE = 0.02
"""s. Sensors alone go round in two steps of the socket task, 10 ms each (wire-protocol.md, 4.4)."""
PICTURE_TIME = 0.06
"""s more in a cycle with a picture."""
SEND_BUFFER = 5744
"""Bytes that the robot's TCP takes before sending blocks (wire-protocol.md, 4.4)."""
NUMBERS = 3800
"""Readings are numbered modulo this."""


def sensor_payload(number: int = 0) -> bytearray:
    """Return the 104 bytes of a robot at rest; *number* is the ambient light and the distance."""
    data = bytearray(104)
    struct.pack_into("<3h", data, 0, 0, 0, 768)
    struct.pack_into("<3f", data, 6, 768.0, 0.0, 0.0)
    struct.pack_into("<8H", data, 53, *[number] * 8)
    struct.pack_into("<H", data, 69, number)
    struct.pack_into("<H", data, 83, 3100)
    data[85] = 1
    data[89] = 15
    return data


@dataclass
class Act:
    """One command as the robot applied it in one cycle."""

    time: float
    request: int
    settings: int
    left: int
    right: int
    lamps: int
    rgb: tuple[int, ...]
    sound: int


class WifiRobot:
    """The robot: one client at a time, one command adopted a cycle, the newest one repeated."""

    def __init__(self) -> None:
        self.number = 0
        self.readings: dict[str, list[tuple[float, int]]] = {}
        self.acts: list[tuple[float, str, object]] = []
        self.cycles: list[Act] = []
        self.steps = (0, 0)
        self.speed = (0, 0)
        self.adopted: list[bytes] = []
        self.adopted_at: list[float] = []
        self.discarded = 0
        self.wrong: list[bytes] = []
        self.sent_packets = 0
        self.picture_cycles = 0
        self.is_frozen = False
        """Whether it streams on but takes no command."""
        self.is_silent = False
        """Whether it does nothing at all."""
        self._waiting = bytearray()
        self._air: Air | None = None
        self._backlog: deque[Air] = deque()
        self._task: asyncio.Task[None] | None = None
        self._origin = asyncio.get_running_loop().time()
        self._fetched = bytes(self._fetch())
        """What the main processor sent one cycle ago."""

    @property
    def clock(self) -> float:
        return asyncio.get_running_loop().time() - self._origin

    def accept(self, air: "Air") -> None:
        """Serve a client, now or when the one before is gone."""
        self._backlog.append(air)
        if self._task is None:
            self._task = asyncio.get_running_loop().create_task(self._serve())

    def feed(self, air: "Air", data: bytes) -> None:
        """Take bytes of a client."""
        if air is self._air:
            self._waiting += data
        else:
            air.early += data

    async def close(self) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])

    async def _serve(self) -> None:
        while self._backlog:
            self._air = self._backlog.popleft()
            self._waiting = bytearray(self._air.early)
            command = b""
            while not self._air.is_down:
                command = await self._cycle(command)
            self._air = None
        self._task = None

    async def _cycle(self, command: bytes) -> bytes:
        await asyncio.sleep(SENSOR_CYCLE / 2)
        if self.is_silent or self._air is None or self._air.is_down:
            return command
        whole = len(self._waiting) // 21
        if whole >= 5:
            self.discarded += whole - 1
            del self._waiting[: (whole - 1) * 21]
            whole = 1
        if whole and not self.is_frozen:
            new = bytes(self._waiting[:21])
            del self._waiting[:21]
            self.adopted.append(new)
            self.adopted_at.append(self.clock)
            if new[0] != 0x80:
                self.wrong.append(new)
            if new[0] == 0x80 or command:
                command = new
        if not command:
            return command
        request = command[1]
        ready = self._fetched
        if request & 1:
            await asyncio.sleep(PICTURE_TIME)
            self.picture_cycles += 1
            await self._send(b"\x01" + self._picture())
        self._exchange(command)
        await asyncio.sleep(SENSOR_CYCLE / 2)
        if request & 2:
            await self._send(b"\x02" + ready)
        elif not request & 3:
            await self._send(b"\x03")
        return command

    def _exchange(self, command: bytes) -> None:
        """Exchange data with the main processor: F8, which reads the sensors, is before F7, which acts."""
        self._fetched = bytes(self._fetch())
        settings, left, right, lamps = struct.unpack_from("<BhhB", command, 2)
        rgb = tuple(command[8:20])
        self.cycles.append(Act(self.clock, command[1], settings, left, right, lamps, rgb, command[20]))
        if settings & 4:
            self.steps = (left, right)
            self.acts.append((self.clock, "steps", (left, right)))
        else:
            self.speed = (left, right)
            self.acts.append((self.clock, "drive", (left, right)))
        self.acts.append((self.clock, "show", (lamps >> 4 & 1, lamps >> 5 & 1)))
        if command[20]:
            self.acts.append((self.clock, "sound", command[20]))

    def _next(self, *kinds: str) -> int:
        self.number = self.number % NUMBERS + 1
        for kind in kinds:
            self.readings.setdefault(kind, []).append((self.clock, self.number))
        return self.number

    def _fetch(self) -> bytearray:
        data = sensor_payload(self._next("ambient_light", "distance"))
        struct.pack_into("<2h", data, 79, *self.steps)
        return data

    def _picture(self) -> bytes:
        return self._next("image").to_bytes(2, "big") + bytes(38400 - 2)

    async def _send(self, data: bytes) -> None:
        air = self._air
        assert air is not None
        while air.in_flight >= SEND_BUFFER and not air.is_down:  # noqa: ASYNC110
            await asyncio.sleep(0.01)
        self.sent_packets += 1
        air.down(data)


@dataclass
class Fault:
    """What happens to one piece that is sent: it waits *delay* s, and is torn into pieces at these shares of it."""

    delay: float = 0.0
    tears: tuple[float, ...] = ()
    pause: float = 0.0
    """s between the pieces."""


@dataclass
class Air:
    """The way between one client and the robot: a stream in each direction, late and in pieces, that may end."""

    robot: WifiRobot
    far: MemoryTransport
    latency: float = 0.0
    up_faults: deque[Fault] = field(default_factory=deque)
    down_faults: deque[Fault] = field(default_factory=deque)
    cut_up: float = math.inf
    """Bytes toward the robot after which the connection is gone."""
    cut_down: float = math.inf
    """Bytes toward the program after which the connection is gone."""
    in_flight: int = 0
    is_down: bool = False
    early: bytearray = field(default_factory=bytearray)

    def __post_init__(self) -> None:
        self._due = {"up": 0.0, "down": 0.0}
        self._under_way: dict[str, deque[bytes]] = {"up": deque(), "down": deque()}
        self.far.listen(self._on_up, self._on_lost)
        self.robot.accept(self)

    def cut(self) -> None:
        """End the connection, as when the robot is switched off and the system notices."""
        if not self.is_down:
            self.is_down = True
            self.far.abort()

    def down(self, data: bytes) -> None:
        """Send *data* toward the program."""
        self.in_flight += len(data)
        self._carry("down", self.down_faults, data)

    def _on_lost(self) -> None:
        self.is_down = True

    def _on_up(self, data: bytes) -> None:
        self._carry("up", self.up_faults, data)

    def _carry(self, way: str, faults: deque[Fault], data: bytes) -> None:
        loop = asyncio.get_running_loop()
        fault = faults.popleft() if faults else Fault()
        cuts = sorted({0, len(data), *(round(share * len(data)) for share in fault.tears)})
        for index, (begin, end) in enumerate(pairwise(cuts)):
            pause = fault.delay if index == 0 else fault.pause
            self._due[way] = max(self._due[way], loop.time() + self.latency) + pause
            self._under_way[way].append(data[begin:end])
            loop.call_at(self._due[way], self._arrive, way)

    def _arrive(self, way: str) -> None:
        data = self._under_way[way].popleft()  # timers of the same moment come in any order
        if way == "down":
            self.in_flight -= len(data)
        if self.is_down:
            return
        if way == "up":
            piece, self.cut_up = data[: int(min(self.cut_up, len(data)))], self.cut_up - len(data)
            self.robot.feed(self, piece)
            ended = self.cut_up <= 0
        else:
            piece, self.cut_down = data[: int(min(self.cut_down, len(data)))], self.cut_down - len(data)
            if piece:
                self.far.send_nowait(piece)
            ended = self.cut_down <= 0
        if ended:
            self.cut()


class WifiEnd(MemoryTransport):
    """The program's end of a connection in memory."""

    codec = "wifi"


def wifi_pair(url: str = "wifi://robot") -> tuple[WifiEnd, MemoryTransport]:
    """Return the program's end and the air's end of a connection."""
    near, far = WifiEnd(url, origin="robot"), MemoryTransport(url)
    near.join(far)
    return near, far


@dataclass
class WifiRig:
    robot: WifiRobot
    air: Air
    session: Session


@contextlib.asynccontextmanager
async def wifi_rig(
    *, latency: float = 0.0, up: Iterable[Fault] = (), down: Iterable[Fault] = ()
) -> AsyncIterator[WifiRig]:
    """A session with the robot; the faults begin once it is open."""
    robot = WifiRobot()
    near, far = wifi_pair()
    air = Air(robot, far, latency)
    session = await Session.open(near)
    air.up_faults.extend(up)
    air.down_faults.extend(down)
    try:
        yield WifiRig(robot, air, session)
    finally:
        await session.close()
        air.cut()
        await robot.close()
