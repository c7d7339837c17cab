"""The door for programs, in this process, and a program that is connected to it; on a LocalLoop in simulated time."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import sys
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from websockets.asyncio.client import ClientConnection, connect

from elib.doors.robots import connected
from elib.doors.serve.door import PATH, ProgramDoor
from elib.panel.panel import Panel
from elib.panel.server.listening import listen
from elib.panel.slot import Slot
from elib.panel.watching import virtual
from shared import PATIENCE, now, until

DRIVER = Path(__file__).parent / "serve_driver.py"
ROBOT = "sim://square"


@dataclass
class Program:
    """A program of a test.

    Attributes:
        socket: Its WebSocket.
        told: What it was told without having asked.
    """

    socket: ClientConnection
    told: list[dict] = field(default_factory=list)
    _answers: dict[int, list[dict]] = field(default_factory=dict)
    _numbers: itertools.count = field(default_factory=lambda: itertools.count(1))

    async def say(self, do: str, **values: object) -> None:
        """Send a message without a number."""
        await self.socket.send(json.dumps({"do": do} | values))

    async def whole(self, do: str, **values: object) -> dict:
        """Ask, and return the whole answer."""
        number = next(self._numbers)
        await self.say(do, id=number, **values)
        async with asyncio.timeout(PATIENCE):
            while True:
                answer = await self.hear()
                if answer.get("id") == number:
                    return answer

    async def ask(self, do: str, **values: object) -> object:
        """Ask, and return the result; fail on an error."""
        answer = await self.whole(do, **values)
        assert answer["ok"], answer
        return answer["result"]

    async def refused(self, do: str, **values: object) -> dict:
        """Ask for what is not done, and return the error."""
        answer = await self.whole(do, **values)
        assert not answer["ok"], answer
        return answer["error"]

    async def hear(self) -> dict:
        """Return the next message; what is not an answer is noted, too."""
        async with asyncio.timeout(PATIENCE):
            message = json.loads(await self.socket.recv())
        if message["type"] != "answer":
            self.told.append(message)
        return message

    async def until_told(self, kind: str, is_it: Callable[[dict], object] = bool) -> dict:
        """Return the first message of a kind that fits, among those that came and will come."""
        seen = 0
        async with asyncio.timeout(PATIENCE):
            while True:
                for message in self.told[seen:]:
                    if message["type"] == kind and is_it(message):
                        return message
                seen = len(self.told)
                await self.hear()

    async def ask_often(self, do: str, count: int = 20) -> None:
        """Ask the same so often that most requests wait for the robot; their numbers begin with 1000."""
        for number in range(1000, 1000 + count):
            await self.say(do, id=number)

    async def answers(self, count: int = 20) -> list[dict]:
        """Return the answers of :meth:`ask_often`, of which every request gets one."""
        found: list[dict] = []
        while len(found) < count:
            message = await self.hear()
            if message.get("id", 0) >= 1000:
                found.append(message)
        assert sorted(message["id"] for message in found) == list(range(1000, 1000 + count))
        return found

    async def drive_on(self) -> None:
        """Say every tenth of a second that it is there; cancel it to fall silent."""
        while True:
            await self.say("beat")
            await asyncio.sleep(0.1)  # clock: a driver may beat at any rate, and the tests are in simulated time


@dataclass
class Rig:
    """The door.

    Attributes:
        panel: Its robots.
        door: The door.
        url: Where programs connect.
    """

    panel: Panel
    door: ProgramDoor
    url: str

    def slot(self, key: str = "1") -> Slot:
        return self.panel.slots[key]

    def wheels(self, key: str = "1") -> tuple[float, float]:
        """Return how fast the wheels of a robot turn in its world, m/s."""
        transport = virtual(self.slot(key).robot)
        transport.simulation.catch_up()
        here = transport.simulation.world._robot(transport.robot.index)
        return here.left_speed, here.right_speed

    async def until_it_moves(self, key: str = "1") -> None:
        await until(lambda: all(self.wheels(key)))

    async def until_it_stands(self, key: str = "1") -> float:
        """Wait until a robot stands; return how long it took, s."""
        began = now()
        await until(lambda: not any(self.wheels(key)))
        return now() - began

    @contextlib.asynccontextmanager
    async def program(self, **options: object) -> AsyncIterator[Program]:
        """Connect a program."""
        async with connect(
            self.url, compression=None, proxy=None, ping_interval=None, open_timeout=PATIENCE, **options
        ) as socket:
            yield Program(socket)


@contextlib.asynccontextmanager
async def serving(*urls: str, token: str | None = None, origins: Sequence[str] = ()) -> AsyncIterator[Rig]:
    """Open the door in this process."""
    address = listen(port=0)
    door = ProgramDoor(origins)
    with contextlib.closing(address.socket):
        async with connected(urls or (ROBOT,), page=address, token=token, door=door) as panel:
            yield Rig(panel, door, f"ws://127.0.0.1:{address.port}{PATH}")


@contextlib.asynccontextmanager
async def child(url: str, *, key: str = "1") -> AsyncIterator[asyncio.subprocess.Process]:
    """Let a program in a process of its own drive a robot; it is killed at the end of the block."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, str(DRIVER), url, key, stdout=asyncio.subprocess.PIPE
    )
    try:
        assert process.stdout is not None
        async with asyncio.timeout(PATIENCE):
            assert (await process.stdout.readline()).strip() == b"driving"
        yield process
    finally:
        if process.returncode is None:
            process.kill()
        await process.wait()
