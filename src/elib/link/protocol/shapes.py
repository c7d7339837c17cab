"""The shapes of the table's answers, text and binary: their patterns, their bytes, and the values made of them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from elib.base.body import STEPS_PER_REVOLUTION, wrapped
from elib.base.errors import RemoteProtocolError
from elib.link.protocol import values as v
from elib.link.protocol.context import Context, Parsed, Reply
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode, pixel_bytes
from elib.link.protocol.replies import LineReply, LinesReply, Packed, guarded_lines

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

T = TypeVar("T")
Values = Sequence[int | float]
Build = Callable[[Values, Context], T]
"""Makes the value of an answer from its numbers."""

MICROPHONES, SAMPLES = 3, 100
"""The e-puck1 keeps 100 samples of each of its 3 microphones (wire-protocol.md, 3.3)."""
BATTERY_EMPTY, BATTERY_FULL = 3.4, 4.2
"""V. The scale of the firmware from 0 to 100 % (wire-protocol.md, 5.11)."""


# -- values of numbers -----------------------------------------------------------------------------------------------


def fields(cls: Callable[..., T]) -> Build[T]:
    """Return what makes a *cls* of numbers that are its fields."""
    return lambda numbers, context: cls(*numbers, **context.stamp)


def counts(cls: Callable[..., T]) -> Build[T]:
    """Return what makes a *cls* of any number of counts."""
    return lambda numbers, context: cls(counts=tuple(map(int, numbers)), **context.stamp)


def wheels(numbers: Values, context: Context) -> v.Wheels:
    """Return the wheel speeds."""
    # The e-puck2 prints some negative speeds as 65536 + n.
    left, right = (wrapped(int(number)) / STEPS_PER_REVOLUTION for number in numbers)
    return v.Wheels(left, right, **context.stamp)


def acceleration(numbers: Values, context: Context) -> v.Acceleration:
    """Return the acceleration, with the zero and the scale of the firmware."""
    x, y, z = map(int, numbers)
    profile = context.profile
    return v.Acceleration(x, y, z, zero=profile.acceleration_zero, counts_per_g=profile.counts_per_g, **context.stamp)


def angular_velocity(numbers: Values, context: Context) -> v.AngularVelocity:
    """Return the turn rates, with the scale of the firmware."""
    x, y, z = map(int, numbers)
    return v.AngularVelocity(x, y, z, counts_per_degree=context.profile.gyroscope_counts_per_degree, **context.stamp)


def camera_settings(numbers: Values, context: Context) -> v.CameraSettings:
    """Return the settings for the upright picture; the robot sends the columns and rows of the chip."""
    mode, columns, rows, zoom, size = map(int, numbers)
    width, height = (rows, columns) if context.profile.mounting.swaps else (columns, rows)
    settings = v.CameraSettings(mode, width, height, zoom, size, **context.stamp)
    context.last_set.camera = settings
    return settings


def battery_of(raw: int, context: Context, *, is_one_bit: bool = False) -> v.Battery:
    """Return the state of the battery from its raw reading; the profile has the counts of an empty and a full one."""
    empty, full = context.profile.battery_counts
    if is_one_bit or raw <= 1:
        return v.Battery(raw, None, None, **context.stamp)
    share = (raw - empty) / (full - empty)
    volts = BATTERY_EMPTY + share * (BATTERY_FULL - BATTERY_EMPTY)
    return v.Battery(raw, volts, min(1.0, max(0.0, share)), **context.stamp)


def samples(numbers: Values, context: Context) -> NDArray[numpy.int16]:
    """Return the samples of each microphone, in rows, as the robot keeps them: in rings."""
    import numpy as np

    return np.array(numbers, np.uint16).astype(np.int16).reshape(MICROPHONES, SAMPLES)


def ordered_samples(numbers: Values, context: Context) -> NDArray[numpy.int16]:
    """Return the samples of each microphone, oldest first; behind the rings is the slot that is written next.

    Raises:
        RemoteProtocolError: There is no such slot, so the bytes do not answer this request.
    """
    import numpy as np

    rings, oldest = rings_of(numbers, context)
    return np.roll(rings, -oldest, axis=1)


def pitch_of(numbers: Values, context: Context) -> v.Pitch:
    """Return the pitch of the samples of the microphones, as :func:`ordered_samples` gives them."""
    from elib.link.protocol.pitch import found_pitch  # here: few programs ask for it

    rings, oldest = rings_of(numbers, context)
    return found_pitch(rings, oldest, context)


def rings_of(numbers: Values, context: Context) -> tuple[NDArray[numpy.int16], int]:
    """Return the rings of the microphones, and the slot that was to be written next when they began to be sent.

    Raises:
        RemoteProtocolError: There is no such slot, so the bytes do not answer this request.
    """
    *rings, oldest = numbers
    if oldest >= SAMPLES:
        raise RemoteProtocolError(f"the microphones' next slot is {oldest}; there are {SAMPLES}")
    return samples(rings, context), int(oldest)


def attitude_of(numbers: Values, context: Context) -> v.Attitude:
    """Return magnitude, orientation and inclination from counts and degrees.

    Raises:
        RemoteProtocolError: A number is not finite, so the bytes do not answer this request.
    """
    magnitude, orientation, inclination = numbers
    if not all(math.isfinite(number) for number in numbers):
        raise RemoteProtocolError("the attitude is not a finite number")
    return v.Attitude(magnitude, math.radians(orientation), math.radians(inclination), **context.stamp)


# -- text ------------------------------------------------------------------------------------------------------------


def integers(letter: str, build: Build[T], least: int, most: int = 0) -> LineReply[T]:
    """Return the shape of a letter and *least* to *most* decimal numbers between commas; *most* 0 is *least*."""
    most = most or least
    count = f"{least}" if least == most else f"{least} to {most}"
    return LineReply(
        letter,
        rf"{letter}((?:,-?\d{{1,11}}){{{least},{most}}})",
        f"{letter.lower()!r} and {count} numbers",
        lambda groups, context: build([int(text) for text in groups[0][1:].split(",")], context),
    )


BATTERY_TEXT = LineReply(
    "b",
    r"b,(\d{1,11})( \(-?\d{1,11}%\))?",
    "'b', a number and a percentage, or 'b' and one bit",
    lambda groups, context: battery_of(int(groups[0] or 0), context, is_one_bit=groups[1] is None),
)
"""``b,2400 (67%)``, or ``b,1`` from hardware that has one bit."""

IR_CODE = LineReply(
    "G",
    r"g IR check : 0x([0-9a-f]{1,8}), address : 0x([0-9a-f]{1,8}), data : 0x([0-9a-f]{1,8})",
    "'g IR check : 0x.., address : 0x.., data : 0x..'",
    lambda groups, context: v.IrCode(*(int(text, 16) for text in groups), **context.stamp),
)
"""Three hexadecimal numbers in prose; behind ``g`` is a blank, not a comma."""

CALIBRATION: LinesReply[None] = LinesReply(
    "K",
    r"k, starting calibration",
    "a line when calibration starts and one when it is finished",
    lambda lines, context: "finished" in lines[-1].lower(),
    lambda lines, context: None,
)
"""Two lines, seconds apart."""


def is_gctronic(version: str) -> bool:
    """Whether an answer to ``V`` is from one of GCtronic's firmwares."""
    return "gctronic" in version.lower()


def _version(lines: Sequence[str], context: Context) -> v.Version:
    hardware = lines[1].rpartition(":")[2].strip() if len(lines) > 1 else ""
    return v.Version(lines[0][2:], context.profile.name, hardware, **context.stamp)


VERSION = LinesReply(
    "V", r"v,", "'v,Version ...'", lambda lines, context: len(lines) == 2 or not is_gctronic(lines[0]), _version
)
"""One line from BTcom, or two from GCtronic's firmwares."""

HELP_TEXT = guarded_lines("H", r'"', "lines that begin with a quoted letter", lambda lines, context: "\n".join(lines))
"""22 to 28 lines without an end mark."""


def _number_after_comma(line: str) -> int:
    match = re.fullmatch(r"y,(-?\d+)", line, re.IGNORECASE)
    if match is None:
        raise RemoteProtocolError(f"the answer to 'Y' goes on with {line[:80]!r}; expected 'y,value'")
    return int(match[1])


I2C_VALUE = LinesReply(
    "Y",
    r"y,-?\d+,-?\d+$",
    "'y,device,register' and 'y,value'",
    lambda lines, context: len(lines) == 2,
    lambda lines, context: _number_after_comma(lines[1]) % 256,
)
"""The address and, on a second line, the value, which some firmwares print signed."""


def _i2c_devices(lines: Sequence[str], context: Context) -> list[int]:
    found = []
    for line in lines:
        match = re.fullmatch(r"(\d{1,3}): (-?\d{1,5})", line)
        if match is None:
            raise RemoteProtocolError(f"the answer to 'Z' goes on with {line[:80]!r}; expected 'address: value'")
        found.append((int(match[1]), int(match[2])))
    return [address for address, value in found if value or not context.profile.i2c_scan_prints_all]


I2C_DEVICES = guarded_lines("Z", r"(\d+: -?\d+|c,\d+)$", "lines 'address: value'", _i2c_devices)
"""0 to 127 lines without an end mark."""

GREETING = b"WELCOME to the SerCom"
"""The beginning of the greeting that every firmware sends when it starts (wire-protocol.md, 1.2)."""

BANNER: LinesReply[None] = LinesReply(
    "R",
    rf"r|.*{GREETING.decode()}",
    "'r' and the greeting",
    lambda lines, context: lines[-1].endswith('type "H" for help'),
    lambda lines, context: None,
)
"""``r``, whose line feed the reset swallows, and the greeting of the restarted firmware."""


# -- binary ----------------------------------------------------------------------------------------------------------


STATUS: Packed[None] = Packed("<B", lambda numbers, context: None)
BATTERY = Packed("<H", lambda numbers, context: battery_of(int(numbers[0]), context))
TEMPERATURE = Packed("<b", fields(v.Temperature))
DISTANCE = Packed("<H", lambda n, context: distance_of(n[0], context))
BUTTON = Packed("<B", lambda n, context: v.Button(bool(n[0]), **context.stamp))
SD_CARD = Packed("<B", lambda n, context: v.SdCard(bool(n[0]), **context.stamp))
ATTITUDE = Packed("<3f", attitude_of)
RINGS = f"<{MICROPHONES * SAMPLES}H"
"""The samples, each a 16-bit number (wire-protocol.md, 3.3)."""

PICTURE_HEADER = 3
"""Bytes before the pixels of a picture: mode, columns, rows (wire-protocol.md, 3.2)."""


def picture_size(header: Sequence[int], context: Context) -> tuple[int, int, int]:
    """Return the columns, the rows and the bytes of pixels of the picture that has this header.

    The header has one byte for each side: of a wider picture it has the side modulo 256, and the settings tell.
    """
    mode, columns, rows = header
    settings = context.last_set.camera
    if settings is not None:
        sides = (settings.width, settings.height)
        wide, high = sides[::-1] if context.profile.mounting.swaps else sides
        if (mode, columns, rows) == (settings.mode, wide % 256, high % 256):
            columns, rows = wide, high
    return columns, rows, columns * rows * pixel_bytes(mode)


@dataclass(frozen=True, slots=True)
class Picture:
    """A header of three bytes (mode, columns, rows) and the pixels."""

    is_binary = True

    def parse(self, buffer: bytes | bytearray, start: int, context: Context) -> Parsed[Image] | None:
        """See :class:`~elib.link.protocol.context.Reply`."""
        if len(buffer) < start + PICTURE_HEADER:
            return None
        profile, mode = context.profile, buffer[start]
        columns, rows, size = picture_size(buffer[start : start + PICTURE_HEADER], context)
        if mode > CameraMode.YUV or not 0 < size <= profile.picture_bytes:
            raise RemoteProtocolError(
                f"the picture's header says mode {mode}, {columns} x {rows} pixels, which {profile.name} cannot send"
            )
        end = start + PICTURE_HEADER + size
        if len(buffer) < end:
            return None
        width, height = (rows, columns) if profile.mounting.swaps else (columns, rows)
        raw = bytes(buffer[start + PICTURE_HEADER : end])
        settings = context.last_set.camera
        zoom = profile.zoom_of_chip(ZOOM if settings is None else settings.zoom)
        image = Image(
            CameraMode(mode), width, height, raw, profile.mounting, zoom=zoom, grey=context.grey, **context.stamp
        )
        return Parsed(end, image)


PICTURE: Reply[Image] = Picture()

ZOOM = 8
"""Of every robot's pictures until it is set another one (wire-protocol.md, 3.4)."""

NO_ECHO = 8190
"""mm. What an e-puck2 sends where its time-of-flight sensor sees nothing (measured-robots: time_of_flight.epuck2)."""


def distance_of(millimetres: float, context: Context) -> v.Distance:
    """Return the reading of the time-of-flight sensor."""
    return v.Distance(millimetres / 1000 if millimetres < NO_ECHO else math.inf, **context.stamp)


PACKET_CODE = 0x08
PACKET_FORMAT = "<3h3f3h3fb8H8HH4H2hHB3BB3H3HB"
"""The e-puck2's packet of all sensors: its opcode, and its answer of 103 bytes (wire-protocol.md, 3.5 and 4.3)."""


def packet_of(numbers: Values, context: Context, *, button: v.Button | None = None) -> v.Sensors:
    """Return the readings of the e-puck2's packet of all sensors, and the *button*, which only Wi-Fi has there.

    Raises:
        RemoteProtocolError: A number is not finite, so the bytes are not such a packet.
    """
    if not all(map(math.isfinite, numbers)):
        raise RemoteProtocolError("the packet of the sensors has a number that is not finite")
    n = [*numbers]
    stamp = context.stamp
    whole = [int(number) for number in n]
    return v.Sensors(
        accelerometer=acceleration(n[0:3], context),
        attitude=attitude_of(n[3:6], context),
        gyroscope=angular_velocity(n[6:9], context),
        magnetometer=v.MagneticField(*(number * 1e-6 for number in n[9:12]), **stamp),
        temperature=v.Temperature(whole[12], **stamp),
        proximity=v.Proximity(*whole[13:21], **stamp),
        ambient_light=v.AmbientLight(*whole[21:29], **stamp),
        distance=distance_of(n[29], context),
        microphones=v.Microphones(counts=tuple(whole[30:34]), **stamp),
        encoders=v.Steps(whole[34], whole[35], **stamp),
        battery=battery_of(whole[36], context),
        sd_card=v.SdCard(bool(whole[37]), **stamp),
        ir_receiver=v.IrCode(*whole[38:41], **stamp),
        selector=v.Selector(whole[41], **stamp),
        ground=v.Ground(counts=tuple(whole[42:45]), **stamp),
        button=button,
        **stamp,
    )


PACKET = Packed(PACKET_FORMAT, packet_of)


def from_packet(name: str, cls: type[T]) -> Packed[T]:
    """Return the shape of the packet, of which one reading is the value."""

    def pick(numbers: Values, context: Context) -> T:
        value = getattr(packet_of(numbers, context), name)
        assert isinstance(value, cls)
        return value

    return Packed(PACKET_FORMAT, pick)
