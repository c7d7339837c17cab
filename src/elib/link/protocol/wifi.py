"""The packets of the e-puck2's Wi-Fi as data, and how a row of the command table becomes one (wire-protocol.md, 4).

The program sends commands of 21 bytes, each with all actuators. The robot takes one command a cycle, repeats the newest
one, and streams packets of three kinds without being asked again.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from elib.base.errors import RemoteProtocolError, Unsupported
from elib.link.protocol import values as v
from elib.link.protocol.actuators import ACTUATORS_LAYOUT, AVOID, BODY, FRONT, actuator_bytes
from elib.link.protocol.camera import SENSOR_WIDTH
from elib.link.protocol.context import Context, Form, LastSet, Parsed
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.shapes import PACKET_FORMAT, packet_of

T = TypeVar("T")
Note = Callable[[Sequence[int], Context], None]
"""Notes in ``context.last_set`` what a call sets; the ``remember`` of a row."""

# -- commands --------------------------------------------------------------------------------------------------------

COMMAND = struct.Struct(f"<2B{ACTUATORS_LAYOUT}")
"""Start byte, request, and the actuators as in the serial packet 0x09: 21 bytes."""
START = 0x80
"""The first byte of every command."""
NO_REQUEST, STREAM_IMAGES, STREAM_SENSORS = 0, 1, 2
"""What a command asks the robot to stream; with NO_REQUEST it answers with empty packets."""
REQUEST, SETTINGS, STEPS, SOUND = 1, 2, slice(3, 7), 20
"""Where these bytes are in a command."""
CALIBRATE, SET_STEPS = 1, 4
"""Settings that act once in every cycle, as sounds do."""
SOUND_BITS = {0: 0x20, 1: 0x01, 2: 0x02, 3: 0x04, 4: 0x08, 5: 0x10, 6: 0x20}
"""The bit of each sound of ``play_sound()``; 0x20 stops all."""
MAX_WAITING = 4
"""Commands that may wait in the robot; when 5 do, it throws all but the newest away."""


def command_of(memory: LastSet, request: int) -> bytes:
    """Return the command that sets the actuators as in *memory*, without what acts once."""
    return bytes((START, request)) + actuator_bytes(memory, avoid=memory.avoidance, speed=memory.speed)


def memory_of(command: bytes) -> LastSet:
    """Return the actuators as *command* sets them; of the ring LEDs with a colour only the colour is known."""
    _, _, settings, left, right, bits, *rgb, _ = COMMAND.unpack(command)
    lamps = [0] * 10
    for bit, lamp in enumerate((0, 2, 4, 6, BODY, FRONT)):
        lamps[lamp] = bits >> bit & 1
    return LastSet((left, right), lamps, list(rgb), bool(settings & AVOID))


def stop_command(sent: bytes) -> bytes:
    """Return a command that stops the robot whatever it is doing; it leaves stream, body and front as *sent* has them.

    Nothing answers it, so it may be sent past all calls.
    """
    memory = memory_of(sent)
    lamps = [0] * 8 + memory.lamps[BODY:]
    return command_of(LastSet(lamps=lamps), sent[REQUEST] or STREAM_SENSORS)


# -- packets ---------------------------------------------------------------------------------------------------------

IMAGE, SENSORS, EMPTY = 1, 2, 3
"""The first byte of a packet: its kind."""
COLUMNS, ROWS = 160, 120
"""Pixels of every picture, in colour, high byte first."""
SENSORS_PACKET = struct.Struct(f"{PACKET_FORMAT}B")
"""The serial packet of all sensors; the button takes its spare byte, and another spare byte follows."""
PAYLOAD = {IMAGE: COLUMNS * ROWS * 2, SENSORS: SENSORS_PACKET.size, EMPTY: 0}
"""Bytes behind the first one, by the kind of the packet."""
SELECTOR_AT, BUTTON_AT, SPARE_AT = 89, 102, 103
"""Where these bytes are in the payload of a sensor packet."""
_INFRARED, INFRARED_AT = struct.Struct("<16H"), 37
"""The proximity and the ambient light, and where they are."""
MAX_COUNTS = 4095
"""The converter has 12 bits."""


def check_sensors(payload: bytes | bytearray, start: int) -> None:
    """Check the bytes of a sensor packet whose values are limited: a stream out of step does not have them there.

    Raises:
        RemoteProtocolError: A byte is not possible there.
    """
    selector, button, spare = (payload[start + at] for at in (SELECTOR_AT, BUTTON_AT, SPARE_AT))
    if selector > 15 or button > 1 or spare:
        raise RemoteProtocolError(
            f"a sensor packet has selector {selector}, button {button} and spare byte {spare}: it is out of step"
        )
    highest = max(_INFRARED.unpack_from(payload, start + INFRARED_AT))
    if highest > MAX_COUNTS:
        raise RemoteProtocolError(f"a sensor packet has an infrared sensor at {highest} counts: it is out of step")


# -- rows of the command table ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class PacketReply(Generic[T]):
    """The packet that answers a command, and what its value is made of."""

    kind: int
    # makes the value of the answer from the readings or the picture; from None if the packet is empty
    pick: Callable[[v.Sensors | Image | None], T]
    is_binary = True

    def parse(self, buffer: bytes | bytearray, start: int, context: Context) -> Parsed[T] | None:
        """See :class:`~elib.link.protocol.context.Reply`."""
        end = start + 1 + PAYLOAD[self.kind]
        if len(buffer) < end:
            return None
        if buffer[start] != self.kind:
            raise RemoteProtocolError(f"a packet of kind {buffer[start]} stands where kind {self.kind} should")
        return Parsed(end, self.pick(packet_value(self.kind, buffer, start + 1, context)))


def packet_value(kind: int, buffer: bytes | bytearray, start: int, context: Context) -> v.Sensors | Image | None:
    """Return the readings or the picture of a packet, whose payload begins at *start*; None if it is empty.

    Raises:
        RemoteProtocolError: The bytes are not those of such a packet.
    """
    if kind == SENSORS:
        check_sensors(buffer, start)
        numbers = SENSORS_PACKET.unpack_from(buffer, start)
        return packet_of(numbers, context, button=v.Button(bool(buffer[start + BUTTON_AT]), **context.stamp))
    if kind == IMAGE:
        mounting, zoom = context.profile.mounting, SENSOR_WIDTH // COLUMNS
        raw = bytes(buffer[start : start + PAYLOAD[IMAGE]])
        return Image(CameraMode.COLOUR, COLUMNS, ROWS, raw, mounting, zoom=zoom, grey=context.grey, **context.stamp)
    return None


@dataclass(frozen=True, slots=True)
class WifiForm(Generic[T]):
    """How a row of the command table is done over Wi-Fi."""

    reply: PacketReply[T]  # what answers it
    once: Callable[[Sequence[int], bytearray], None] | None = None  # writes what acts only once into a command
    check: Note | None = None  # refuses arguments that Wi-Fi does not support

    def form(self, remember: Note | None) -> Form[T]:
        """Return the form of a row that sets what *remember* notes."""

        def encode(numbers: Sequence[int], context: Context) -> bytes:
            if self.check is not None:
                self.check(numbers, context)
            return pair(context, numbers, remember, self.once, images=self.reply.kind == IMAGE)

        return Form(encode, self.reply, is_stateful=True)


def pair(
    context: Context,
    numbers: Sequence[int] = (),
    note: Note | None = None,
    once: Callable[[Sequence[int], bytearray], None] | None = None,
    *,
    images: bool = False,
) -> bytes:
    """Return the two commands of a request, for one write.

    The first one, the marker, asks for nothing, so that an empty packet answers it in the cycle that takes it; it
    alone has what acts once. The second one lets the stream go on.

    Args:
        context: The connection's knowledge; its command that was sent last has the actuators that stay as they are.
        numbers: The arguments of the call.
        note: Notes what the call sets.
        once: Writes what acts only once.
        images: Whether the robot must send pictures.
    """
    memory = memory_of(context.sent)
    if note is not None:
        note(numbers, Context(context.profile, last_set=memory))
    streams = STREAM_SENSORS | (STREAM_IMAGES if images or context.streams_images else 0)
    rest = command_of(memory, streams)
    marker = bytearray(rest)
    marker[REQUEST] = NO_REQUEST
    if once is not None:
        once(numbers, marker)
    return bytes(marker) + rest


def reading(name: str, kind: type[T]) -> WifiForm[T]:
    """Return the form of a row that reads *name*."""

    def pick(value: v.Sensors | Image | None) -> T:
        found = getattr(value, name)
        assert isinstance(found, kind)
        return found

    return WifiForm(PacketReply(SENSORS, pick))


def _nothing(value: v.Sensors | Image | None) -> None:
    return None


def _readings(value: v.Sensors | Image | None) -> v.Sensors:
    assert isinstance(value, v.Sensors)
    return value


def _picture(value: v.Sensors | Image | None) -> Image:
    assert isinstance(value, Image)
    return value


def _calibrate(numbers: Sequence[int], command: bytearray) -> None:
    command[SETTINGS] |= CALIBRATE


def _set_steps(numbers: Sequence[int], command: bytearray) -> None:
    command[SETTINGS] |= SET_STEPS
    command[STEPS] = struct.pack("<2h", *numbers)


def _play(numbers: Sequence[int], command: bytearray) -> None:
    command[SOUND] = SOUND_BITS[numbers[0]]


def _check_led(numbers: Sequence[int], context: Context) -> None:
    if numbers[0] == context.profile.status_led:
        raise Unsupported(
            f"ring LED {numbers[0]} shows the state of the Wi-Fi on {context.profile.name}: no command reaches it",
            hint="the other ring LEDs, the body and the front can be set",
        )


ALL_SENSORS: PacketReply[v.Sensors] = PacketReply(SENSORS, _readings)
"""The answer to ``sensors()``."""
SETTING: WifiForm[None] = WifiForm(PacketReply(EMPTY, _nothing))
"""What sets actuators: the empty packet says that the robot has applied it."""
LED_SETTING: WifiForm[None] = WifiForm(PacketReply(EMPTY, _nothing), check=_check_led)
"""What sets one ring LED."""
CALIBRATION: WifiForm[None] = WifiForm(PacketReply(SENSORS, _nothing), _calibrate)
"""The calibration of the proximity sensors: the robot reads its sensors again after it."""
STEP_SETTING: WifiForm[None] = WifiForm(PacketReply(EMPTY, _nothing), _set_steps)
"""What sets the step counters; the speeds stay."""
SOUND_START: WifiForm[None] = WifiForm(PacketReply(EMPTY, _nothing), _play)
"""What starts or stops a sound."""
PICTURE: WifiForm[Image] = WifiForm(PacketReply(IMAGE, _picture))
"""What takes a picture: the first one behind the marker."""
