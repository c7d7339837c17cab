"""The decoder of a Wi-Fi link: commands and packets in, lines with their meaning out. No I/O, no clock."""

from __future__ import annotations

from collections.abc import Iterable

from elib.base.errors import RemoteProtocolError
from elib.link.protocol import wifi
from elib.link.protocol.actuators import BODY, FRONT
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import STANDING, Context
from elib.link.protocol.profiles import EPUCK2_WIFI, profile_named
from elib.records.decoding.decoder import Decoder
from elib.records.decoding.lines import Argument, Call, CaptureBuffer, Direction, Kind, Line
from elib.records.decoding.opcodes import named

_NAMES = {wifi.IMAGE: "image", wifi.SENSORS: "sensors", wifi.EMPTY: "marker"}


class WifiDecoder:
    """Turns the bytes of a Wi-Fi link into lines: one for each command and each packet."""

    firmware = EPUCK2_WIFI.name  # the name of the firmware
    lacks_requests = False  # whether nothing tells what packets mean; they do so themselves

    def __init__(self, source: str = "as told") -> None:
        self.source = source  # how the firmware is known
        self._context = Context(EPUCK2_WIFI, origin="replay")
        self._commands, self._packets = CaptureBuffer("to robot"), CaptureBuffer("to host")
        self._heard: set[Direction] = set()
        self._command = STANDING
        self._markers = 0
        self._is_in_run = False
        self._is_lost = False

    @property
    def unanswered(self) -> list[str]:
        """The markers that were not taken yet."""
        return ["marker"] * self._markers if "to host" in self._heard else []

    def feed(self, direction: Direction, time: float | None, data: bytes) -> list[Line]:
        """Take bytes, and return the lines they complete; see :meth:`elib.records.decoding.Decoder.feed`."""
        self._heard.add(direction)
        if direction == "to robot":
            self._commands.append(data, time)
            return list(self._read_commands())
        self._packets.append(data, time)
        return list(self._read_packets())

    def flush(self) -> list[Line]:
        """Return lines for what is not complete."""
        return [
            buffer.cut(len(buffer.bytes), Kind.HALF, name=name)
            for buffer, name in ((self._commands, "command"), (self._packets, "packet"))
            if buffer.bytes
        ]

    def _read_commands(self) -> Iterable[Line]:
        buffer = self._commands
        while len(buffer.bytes) >= wifi.COMMAND.size:
            if buffer.bytes[0] != wifi.START:
                # The robot counts to 21 whatever comes; a person wants to see where the commands begin again.
                end = buffer.bytes.find(bytes((wifi.START,)))
                yield buffer.cut(end if end > 0 else len(buffer.bytes), Kind.UNKNOWN, problem="not a command")
                continue
            command = bytes(buffer.bytes[: wifi.COMMAND.size])
            before, self._command = self._command, command
            streams = command[wifi.REQUEST]
            self._markers += not streams
            yield buffer.cut(wifi.COMMAND.size, Kind.REQUEST, calls=(_asked(streams), *_changes(before, command)))

    def _read_packets(self) -> Iterable[Line]:
        buffer = self._packets
        while buffer.bytes:
            kind = buffer.bytes[0]
            if kind not in wifi.PAYLOAD or (self._is_lost and kind != wifi.SENSORS):
                self._is_lost = True
                end = buffer.bytes.find(bytes((wifi.SENSORS,)), 1)
                yield buffer.cut(end if end > 0 else len(buffer.bytes), Kind.UNKNOWN, problem="not a packet")
                continue
            size = 1 + wifi.PAYLOAD[kind]
            if len(buffer.bytes) < size:
                return
            yield self._packet(kind, size)

    def _packet(self, kind: int, size: int) -> Line:
        buffer = self._packets
        if kind == wifi.EMPTY:
            if self._is_in_run:
                return buffer.cut(size, Kind.FILLER, name="the marker again")
            self._is_in_run = True
            if self._markers or "to robot" not in self._heard:
                self._markers = max(0, self._markers - 1)
                return buffer.cut(size, Kind.ANSWER, name="marker")
            return buffer.cut(size, Kind.SURPLUS, name="marker", problem="no command asked for nothing")
        self._is_in_run = False
        self._context.time = buffer.time if buffer.time is not None else self._context.time
        try:
            value = wifi.packet_value(kind, buffer.bytes, 1, self._context)
        except RemoteProtocolError as error:
            if self._is_lost:
                return buffer.cut(1, Kind.UNKNOWN, problem="not a packet")
            self._is_lost = True
            return buffer.cut(size, Kind.MALFORMED, name=_NAMES[kind], problem=error.message)
        self._is_lost = False
        return buffer.cut(size, Kind.ANSWER, name=_NAMES[kind], value=value)


def is_wifi(pieces: Iterable[tuple[float | None, Direction, bytes]]) -> bool:
    """Return whether the bytes of a capture are those of a Wi-Fi link: no serial line begins so."""
    heads: dict[Direction, bytes] = {}
    for _, direction, data in pieces:
        heads[direction] = heads.get(direction, b"") + data
    commands, packets = heads.get("to robot", b""), heads.get("to host", b"")
    if commands:
        return len(commands) >= wifi.COMMAND.size and set(commands[:: wifi.COMMAND.size]) == {wifi.START}
    decoder = WifiDecoder()
    lines = decoder.feed("to host", None, packets[: 4 * (1 + wifi.PAYLOAD[wifi.SENSORS])])
    return any(line.value is not None for line in lines) and all(line.kind is not Kind.UNKNOWN for line in lines)


def _asked(streams: int) -> Call:
    names = [name for bit, name in ((wifi.STREAM_IMAGES, "images"), (wifi.STREAM_SENSORS, "sensors")) if streams & bit]
    return Call("stream", tuple(Argument(name, 1) for name in names)) if names else Call("marker")


def _changes(before: bytes, command: bytes) -> Iterable[Call]:
    """Yield the calls that explain how *command* differs from the one *before*."""
    old, new = wifi.memory_of(before), wifi.memory_of(command)
    sets_steps, set_steps = command[wifi.SETTINGS] & wifi.SET_STEPS, before[wifi.SETTINGS] & wifi.SET_STEPS
    if sets_steps:
        yield _call("set_encoders", *new.speed)
    elif new.speed != old.speed and not set_steps:
        yield _call("set_speed", *new.speed)
    if new.avoidance != old.avoidance:
        yield _call("set_obstacle_avoidance", int(new.avoidance))
    if command[wifi.SETTINGS] & wifi.CALIBRATE:
        yield _call("calibrate_proximity")
    for lamp in (0, 2, 4, 6):
        if new.lamps[lamp] != old.lamps[lamp]:
            yield _call("set_led", lamp, new.lamps[lamp])
    for lamp, name in ((BODY, "set_body_led"), (FRONT, "set_front_led")):
        if new.lamps[lamp] != old.lamps[lamp]:
            yield _call(name, new.lamps[lamp])
    for index in range(4):
        at = slice(3 * index, 3 * index + 3)
        if new.rgb[at] != old.rgb[at]:
            yield _call("set_rgb_led", 2 * index + 1, *new.rgb[at])
    for number, bit in wifi.SOUND_BITS.items():
        if command[wifi.SOUND] & bit and number:
            yield _call("play_sound", number)


def _call(name: str, *numbers: int) -> Call:
    return Call(name, named(SPECS[name].parameters, numbers))


AnyDecoder = Decoder | WifiDecoder
"""What turns the bytes of a link into lines."""


def decoder_of(firmware: str | None = None, *, assumed: str | None = None) -> AnyDecoder:
    """Return the decoder for the links of a firmware, or of an assumed one; both as :class:`Decoder` takes them."""
    name = firmware or assumed
    if name is not None and profile_named(name).codec == "wifi":
        return WifiDecoder("as told" if firmware else "assumed")
    return Decoder(firmware, assumed=assumed)
