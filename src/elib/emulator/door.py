"""The control door on the wire: one JSON object a line, over TCP on this computer alone, or over a WebSocket.

::

    {"do": "move_robot", "robot": "epuck-1", "x": 0.4, "y": 0.5, "id": 7}
    {"id": 7, "ok": true}
    {"do": "set_light", "light": 0, "intensity": 12}
    {"ok": false, "error": "intensity is 12; it must be a number from 0 to 10", "hint": ""}

Whatever comes is taken for a stranger's: every key and every number is checked, and an answer says what was wrong.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from elib.emulator.control import AMBIENT, FAULTS, PLACE, Control
from elib.emulator.loopback import bind, named
from elib.errors import ArgumentError, ElibError
from elib.fields import Number, Rule, nearest, rule_of, shown
from elib.physics import Light, Sound

LONGEST = 4096
"""Bytes of a message: the longest that means anything has some 200."""
MOST_CLIENTS = 8
LONGEST_IDLE = 30.0
"""s without a message after which a client's place is another one's who comes when all are taken."""
RATE = 200.0
"""Messages a second that one client may send for long; those beyond wait. A hand that drags makes 60."""
BURST = 50.0
PORT = 8650
"""The first port to try where none is named; the next ones follow."""

Value = float | int | str


@dataclass(frozen=True, slots=True)
class Which(Rule):
    """Which thing is meant."""

    def __str__(self) -> str:
        return "a name, or an index from 0"

    def accept(self, value: object) -> str | int:
        """Return *value*, cut to a size that names nothing if it is larger than any name or index."""
        if isinstance(value, str):
            return value[:64]
        if isinstance(value, int) and not isinstance(value, bool):
            return min(max(value, -1), 1 << 40)
        raise self.refuse(value)


@dataclass(frozen=True, slots=True)
class Key:
    """A key of a message.

    Attributes:
        rule: What its value must be.
        text: What it means, with its unit.
        required: The message means nothing without.
    """

    rule: Rule
    text: str
    required: bool = False


def _which(what: str) -> Key:
    return Key(Which(), f"{what}: its name, or its index from 0", required=True)


def _place(*, required: bool) -> dict[str, Key]:
    return {axis: Key(PLACE, f"{axis}, m", required) for axis in ("x", "y")}


def _value(kind: Callable[..., object], name: str, text: str) -> dict[str, Key]:
    return {name: Key(rule_of(kind, name), text)}


_TURN = Key(Number(-1000, 1000, "rad"), "direction, rad, positive to the left; kept if left out")

MESSAGES: Mapping[str, tuple[str, Mapping[str, Key]]] = MappingProxyType(
    {
        "state": ("Ask for everything there is.", {}),
        "move_robot": (
            "Put a robot elsewhere.",
            {"robot": _which("the robot"), **_place(required=True), "heading": _TURN},
        ),
        "move_box": ("Put a box elsewhere.", {"box": _which("the box"), **_place(required=True), "angle": _TURN}),
        "move_cylinder": ("Put a cylinder elsewhere.", {"cylinder": _which("the cylinder"), **_place(required=True)}),
        "set_light": (
            "Change a lamp; what is left out stays.",
            {
                "light": _which("the light"),
                **_value(Light, "intensity", "intensity, 0 is off"),
                **_place(required=False),
                **_value(Light, "height", "height, m"),
            },
        ),
        "set_sound": (
            "Change a source of sound; what is left out stays.",
            {
                "sound": _which("the sound"),
                **_value(Sound, "volume", "volume, counts at 0.1 m, 0 is silent"),
                **_value(Sound, "frequency", "frequency, Hz"),
                **_place(required=False),
            },
        ),
        "set_ambient": (
            "Set the light of the room.",
            {"ambient": Key(AMBIENT, "infrared reading, counts, higher is darker", required=True)},
        ),
        "set_faults": (
            "Make a robot's link worse; what is left out stays.",
            {
                "robot": _which("the robot"),
                "latency": Key(FAULTS["latency"], "delay of each answer, s"),
                "jitter": Key(FAULTS["jitter"], "standard deviation of the delay, s"),
                "loss": Key(FAULTS["loss"], "probability that an answer is lost"),
            },
        ),
        "cut": ("Cut a robot's link.", {"robot": _which("the robot")}),
        "mend": ("Mend it.", {"robot": _which("the robot")}),
    }
)
"""What the door understands: what it does, and its keys beside ``do`` and ``id``."""


def parse(line: str | bytes) -> dict[str, object]:
    """Return the JSON object that *line* is.

    Raises:
        ArgumentError: It is none.
    """
    if len(line) > LONGEST:
        raise ArgumentError(f"a message has {len(line)} bytes; at most {LONGEST} are possible")
    try:
        message = json.loads(line, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        message = None
    if not isinstance(message, dict):
        raise ArgumentError("a message must be a JSON object on one line", hint='try {"do": "state"}')
    return message


def answer(control: Control, message: Mapping[str, object]) -> dict[str, object]:
    """Do what *message* says and return the answer to it."""
    number = message.get("id")
    reply: dict[str, object] = {}
    if number is not None and isinstance(number, str | int) and len(str(number)[:65]) <= 64:
        reply["id"] = number
    try:
        what, values = check(message)
        result = _perform(control, what, values)
    except ElibError as error:
        return reply | {"ok": False, "error": error.message, "hint": error.hint}
    return reply | {"ok": True} | ({} if result is None else {"result": result})


def check(message: Mapping[str, object]) -> tuple[str, dict[str, Value]]:
    """Return what *message* asks for and the values of its keys.

    Raises:
        ArgumentError: There is no such message, a key is missing, unknown, of the wrong kind or out of its range, or
            its ``id`` is neither a whole number nor a text of at most 64 characters.
    """
    what = message.get("do")
    if not isinstance(what, str) or what not in MESSAGES:
        raise ArgumentError(f"'do' is {shown(what)}", hint=f"it must be one of {', '.join(MESSAGES)}")
    number = message.get("id")
    if number is not None and (
        isinstance(number, bool) or not isinstance(number, str | int) or len(str(number)[:65]) > 64
    ):
        raise ArgumentError("'id' must be a whole number or a text of at most 64 characters")
    keys = MESSAGES[what][1]
    for name in message:
        if name not in keys and name not in ("do", "id"):
            raise ArgumentError(f"{what} has no key {shown(name)}", hint=nearest(name, keys))
    values: dict[str, Value] = {}
    for name, key in keys.items():
        value = message.get(name)
        if value is None:
            if key.required:
                raise ArgumentError(f"{what} needs {name!r}: {key.text}")
        else:
            values[name] = key.rule.require(value, name)
    return what, values


def _no_constant(name: str) -> float:
    raise ValueError(name)  # NaN and the infinities are no JSON


def _perform(control: Control, what: str, values: dict[str, Value]) -> object:
    if what == "state":
        return state(control)
    method = getattr(control, what)
    method(values.pop("ambient")) if what == "set_ambient" else method(**values)
    return None


def state(control: Control) -> dict[str, object]:
    """Return everything there is as JSON values: m, rad, s, counts.

    Raises:
        SimulationError: There is no world.
    """
    snapshot = control.snapshot()
    robots: list[dict[str, object]] = []
    for name, robot in zip(control.names, snapshot.robots, strict=True):
        link = control.link(name)
        robots.append(
            {
                "name": name,
                "x": robot.pose.x,
                "y": robot.pose.y,
                "heading": robot.pose.heading,
                "touching": robot.touching,
                "connected": link.is_connected,
                "cut": link.is_cut,
                "latency": link.latency,
                "jitter": link.jitter,
                "loss": link.loss,
            }
        )
    return {
        "world": snapshot.name,
        "time": snapshot.time,
        "width": snapshot.width,
        "depth": snapshot.depth,
        "ambient": control.ambient,
        "robots": robots,
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


class Pace:
    """How often one client may ask: a bucket that fills at :data:`RATE`.

    Args:
        factor: Seconds of loop time in one of the wall clock.
    """

    def __init__(self, factor: float = 1.0) -> None:
        self._loop = asyncio.get_running_loop()
        self._factor = factor
        self._left = BURST
        self._last = self._loop.time()

    async def wait(self) -> None:
        """Wait until one more message may come; at least let others run."""
        now = self._loop.time()
        self._left = min(BURST, self._left + (now - self._last) / self._factor * RATE) - 1.0
        self._last = now
        await asyncio.sleep(max(0.0, -self._left / RATE) * self._factor)


@contextlib.asynccontextmanager
async def open_door(control: Control, place: str = "") -> AsyncIterator[str]:
    """Let other programs on this computer control the simulation until the block is left.

    Args:
        control: What they control.
        place: ``HOST:PORT`` or ``PORT``; empty for the first free port from :data:`PORT` on, port 0 for any.

    Yields:
        ``tcp://HOST:PORT``.

    Raises:
        ArgumentError: *place* cannot be, or is not on this computer.
        LinkBusy: The port is taken, or all that were tried are.
        LinkDenied: The port is not for this user.
    """
    door = _Door(control)
    sock = bind(place, PORT)
    server = await asyncio.start_server(door.serve, sock=sock, limit=LONGEST)
    try:
        yield f"tcp://{named(sock)}"
    finally:
        server.close()
        door.close()
        await server.wait_closed()


class _Door:
    """Serves the clients of one port."""

    def __init__(self, control: Control) -> None:
        self._control = control
        self._loop = asyncio.get_running_loop()
        self._writers: dict[asyncio.StreamWriter, float] = {}  # and when each was last heard

    def close(self) -> None:
        for writer in self._writers:
            writer.transport.abort()

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(self._writers) >= MOST_CLIENTS and not self._make_room():
            _say(writer, {"ok": False, "error": f"{MOST_CLIENTS} programs are connected already", "hint": ""})
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
        """Show the client out that has been silent longest; return False if none has been for long."""
        writer, heard = min(self._writers.items(), key=lambda item: item[1])
        if self._loop.time() - heard < LONGEST_IDLE * time_factor():
            return False
        del self._writers[writer]
        _say(
            writer, {"ok": False, "error": "another program needed the place of this silent one", "hint": "come again"}
        )
        writer.close()
        return True

    async def _converse(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        pace = Pace(time_factor())
        while True:
            try:
                line = await reader.readuntil(b"\n")
                if writer not in self._writers:  # shown out
                    return
                self._writers[writer] = self._loop.time()
                message = parse(line)
            except (ArgumentError, asyncio.LimitOverrunError) as error:
                # Whoever talks something else has no business here: a web page that sends its form to any port of
                # this computer could hide a message behind the lines of its request.
                text = error.message if isinstance(error, ArgumentError) else f"a line is longer than {LONGEST} bytes"
                _say(writer, {"ok": False, "error": text, "hint": 'try {"do": "state"}'})
                return
            _say(writer, answer(self._control, message))
            await writer.drain()
            await pace.wait()


def _say(writer: asyncio.StreamWriter, reply: Mapping[str, object]) -> None:
    writer.write(json.dumps(reply, separators=(",", ":")).encode() + b"\n")


def time_factor() -> float:
    """Return how many seconds of the running loop's time one of the wall clock has."""
    return float(getattr(asyncio.get_running_loop(), "factor", 1.0))
