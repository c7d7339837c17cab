"""The control server: :class:`~elib.simulator.emulator.control.Control` for other programs on this computer.

It takes and gives one JSON object a line, over TCP; a page of the web application asks for the same objects::

    {"do": "move_robot", "robot": "epuck-1", "x": 0.4, "y": 0.5, "id": 7}
    {"id": 7, "ok": true}
    {"do": "set_light", "light": 0, "intensity": 12}
    {"ok": false, "error": "intensity is 12; it must be a number from 0 to 10", "hint": ""}

Every key and every number is checked, because any program may connect; an answer says what was wrong.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Mapping
from types import MappingProxyType

import msgspec

from elib.base.errors import ArgumentError, ElibError
from elib.base.files import parse_json
from elib.base.rules import REQUIRED, Field, fields_of, nearest, shown
from elib.base.tasks import Tasks
from elib.simulator.emulator.control import ORDERS, Control
from elib.simulator.emulator.loopback import bind, named

MAX_MESSAGE = 4096
"""Bytes of a message: the longest useful one has some 200."""
MAX_CLIENTS = 8
MAX_IDLE = 30.0
"""s without a message after which a client loses its place if another one comes and all places are taken."""
RATE = 200.0
"""Messages a second that one client may send for long; those beyond wait. A mouse that drags makes 60."""
BURST = 50.0
PORT = 8650
"""The first port to try where none is named; the next ones follow."""

Value = float | int | str

MESSAGES: Mapping[str, Mapping[str, Field]] = MappingProxyType(
    {"state": {}} | {name: {each.name: each for each in fields_of(order)} for name, order in ORDERS.items()}
)
"""What may be asked with ``do``, and the keys beside ``do`` and ``id``: ``state`` asks for everything there is, the
others are the orders of :class:`~elib.simulator.emulator.control.Control` with their arguments."""


def parse(line: str | bytes) -> dict[str, object]:
    """Return the JSON object that *line* is.

    Raises:
        ArgumentError: The line is not a JSON object, or it is too long.
    """
    if len(line) > MAX_MESSAGE:
        raise ArgumentError(f"a message has {len(line)} bytes; at most {MAX_MESSAGE} are possible")
    try:
        message = parse_json(line)
    except ValueError:
        message = None
    if not isinstance(message, dict):
        raise ArgumentError("a message must be a JSON object on one line", hint='try {"do": "state"}')
    return message


def answer(control: Control, message: Mapping[str, object]) -> dict[str, object]:
    """Do what *message* says and return the answer to it."""
    number = message.get("id")
    reply: dict[str, object] = {"id": number} if _is_id(number) else {}
    try:
        result = obey(control, message)
    except ElibError as error:
        return reply | {"ok": False, "error": error.message, "hint": error.hint}
    return reply | {"ok": True} | ({} if result is None else {"result": result})


def obey(control: Control, message: Mapping[str, object]) -> object:
    """Do what *message* says and return the result.

    Raises:
        ElibError: The message is wrong, or what it asks for cannot be done.
    """
    what, values = check(message)
    return state(control) if what == "state" else getattr(control, what)(**values)


def check(message: Mapping[str, object]) -> tuple[str, dict[str, Value]]:
    """Return what *message* asks for, and the values of its keys.

    Raises:
        ArgumentError: There is no such message, a key is missing, unknown, of the wrong kind or out of its range, or
            the ``id`` is neither a whole number nor a text of at most 64 characters.
    """
    what = message.get("do")
    if not isinstance(what, str) or what not in MESSAGES:
        raise ArgumentError(f"'do' is {shown(what)}", hint=f"it must be one of {', '.join(MESSAGES)}")
    number = message.get("id")
    if number is not None and not _is_id(number):
        raise ArgumentError("'id' must be a whole number or a text of at most 64 characters")
    keys = MESSAGES[what]
    for name in message:
        if name not in keys and name not in ("do", "id"):
            raise ArgumentError(f"{what} has no key {shown(name)}", hint=nearest(name, keys))
    values: dict[str, Value] = {}
    for name, key in keys.items():
        value = message.get(name)
        if value is None:
            if key.default is REQUIRED:
                raise ArgumentError(f"{what} needs {name!r}: {key.rule}")
        else:
            values[name] = key.rule.require(value, name)
    return what, values


def _is_id(number: object) -> bool:
    """Return whether *number* may be the ``id`` of a message."""
    return isinstance(number, str | int) and not isinstance(number, bool) and len(str(number)[:65]) <= 64


def state(control: Control) -> dict[str, object]:
    """Return the whole simulation as JSON values: m, rad, s, counts.

    Raises:
        SimulationError: There is no world.
    """
    snapshot = control.snapshot()
    robots: list[dict[str, object]] = []
    for name, robot in zip(control.names, snapshot.robots, strict=True):
        robots.append(
            {
                "name": name,
                "x": robot.pose.x,
                "y": robot.pose.y,
                "heading": robot.pose.heading,
                "touching": robot.touching,
            }
            | msgspec.to_builtins(control.link(name))
        )
    return {
        "world": snapshot.name,
        "time": snapshot.time,
        "paused": control.simulation.clock.is_paused,
        "speed": control.simulation.clock.rate,
        "width": snapshot.width,
        "depth": snapshot.depth,
        "ambient": control.ambient,
        "robots": robots,
        "walls": [{"x1": wall.x1, "y1": wall.y1, "x2": wall.x2, "y2": wall.y2} for wall in snapshot.walls],
        "boxes": [{"name": box.name, "x": box.x, "y": box.y, "angle": box.angle} for box in snapshot.boxes],
        "cylinders": [{"name": post.name, "x": post.x, "y": post.y} for post in snapshot.cylinders],
        "lights": [
            {"name": light.name, "x": light.x, "y": light.y, "height": light.height, "intensity": light.intensity}
            for light in snapshot.lights
        ],
        "sounds": [
            {"name": sound.name, "x": sound.x, "y": sound.y, "volume": sound.volume, "frequency": sound.frequency}
            for sound in snapshot.sounds
        ],
    }


class Bucket:
    """A token bucket: lets so many things through a second of the wall clock, and some more at once.

    Args:
        rate: How many for long, per second.
        burst: How many at once.
    """

    def __init__(self, rate: float, burst: float) -> None:
        self._rate, self._burst = rate / time_factor(), burst
        self._clock = asyncio.get_running_loop().time
        self._left, self._seen = burst, self._clock()

    def take(self, amount: float = 1.0) -> bool:
        """Return whether *amount* may pass now."""
        now = self._clock()
        self._left = min(self._burst, self._left + (now - self._seen) * self._rate)
        self._seen = now
        if self._left < amount:
            return False
        self._left -= amount
        return True

    async def wait(self) -> None:
        """Wait until one more may pass; in any case let other tasks run."""
        if not self.take():
            self._left -= 1.0
        await asyncio.sleep(max(0.0, -self._left / self._rate))


@contextlib.asynccontextmanager
async def serve_control(control: Control, place: str = "") -> AsyncIterator[str]:
    """Serve a simulation's control to other programs on this computer until the block is left.

    Args:
        control: What they control.
        place: ``HOST:PORT`` or ``PORT``; empty for the first free port from :data:`PORT` on, port 0 for any.

    Yields:
        ``tcp://HOST:PORT``.

    Raises:
        ArgumentError: *place* is not an address, or not on this computer.
        LinkBusy: The port is taken, or all that were tried are.
        LinkDenied: This user may not use the port.
    """
    clients = _Clients(control)
    sock = bind(place, PORT)
    server = await asyncio.start_server(clients.admit, sock=sock, limit=MAX_MESSAGE)
    try:
        yield f"tcp://{named(sock)}"
    finally:
        server.close()
        await clients.close()
        await server.wait_closed()


class _Clients:
    """The clients of one port."""

    def __init__(self, control: Control) -> None:
        self._control = control
        self._loop = asyncio.get_running_loop()
        self._writers: dict[asyncio.StreamWriter, float] = {}  # and when each sent its last message
        self._tasks = Tasks()

    def admit(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve a client in a task of our own: asyncio reports the cancelling of one that it makes as an error."""
        self._tasks.begin(self._serve(reader, writer), "elib control")

    async def close(self) -> None:
        """Disconnect every client."""
        for writer in self._writers:
            writer.transport.abort()
        await self._tasks.end()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(self._writers) >= MAX_CLIENTS and not self._make_room():
            _say(writer, {"ok": False, "error": f"{MAX_CLIENTS} programs are connected already", "hint": ""})
            writer.close()
            return
        self._writers[writer] = self._loop.time()
        try:
            with contextlib.suppress(ConnectionError, asyncio.IncompleteReadError):
                await self._converse(reader, writer)
        finally:
            self._writers.pop(writer, None)
            writer.close()

    def _make_room(self) -> bool:
        """Disconnect the client that has been silent longest; return False if none has been silent for long."""
        writer, heard = min(self._writers.items(), key=lambda item: item[1])
        if self._loop.time() - heard < MAX_IDLE * time_factor():
            return False
        del self._writers[writer]
        _say(
            writer, {"ok": False, "error": "another program needed the place of this silent one", "hint": "come again"}
        )
        writer.close()
        return True

    async def _converse(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        pace = Bucket(RATE, BURST)
        while True:
            try:
                line = await reader.readuntil(b"\n")
                if writer not in self._writers:  # it was disconnected
                    return
                self._writers[writer] = self._loop.time()
                message = parse(line)
            except (ArgumentError, asyncio.LimitOverrunError) as error:
                # A client that sends anything else is disconnected: a web page that sends its form to any port of
                # this computer could hide a message behind the lines of its request.
                text = (
                    error.message if isinstance(error, ArgumentError) else f"a line is longer than {MAX_MESSAGE} bytes"
                )
                _say(writer, {"ok": False, "error": text, "hint": 'try {"do": "state"}'})
                return
            _say(writer, answer(self._control, message))
            await writer.drain()
            await pace.wait()


def _say(writer: asyncio.StreamWriter, reply: Mapping[str, object]) -> None:
    writer.write(json.dumps(reply, separators=(",", ":")).encode() + b"\n")


def time_factor() -> float:
    """Return how many seconds of the running loop's time pass in one second of the wall clock."""
    return float(getattr(asyncio.get_running_loop(), "factor", 1.0))
