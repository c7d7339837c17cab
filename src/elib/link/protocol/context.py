"""Types of the codec: shape of a reply, form of a command, profile of a firmware, and what a connection knows."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Generic, Literal, NamedTuple, Protocol, TypedDict, TypeVar

from elib.link.protocol.camera import PO8030, CameraDriver
from elib.link.protocol.image import Mounting
from elib.link.protocol.quantities import Quantity
from elib.link.protocol.values import CameraSettings

if TYPE_CHECKING:
    from elib.link.protocol.colours import Grey
    from elib.link.protocol.distances import OpenAir

T_co = TypeVar("T_co", covariant=True)
Codec = Literal["serial", "wifi"]
"""What a link carries: the text and binary commands of a serial line, or the packets of the e-puck2's Wi-Fi."""


class Parsed(NamedTuple, Generic[T_co]):
    """A whole answer: where it ends in the buffer, and its value."""

    end: int
    value: T_co


@dataclass(frozen=True, slots=True)
class UnexpectedReply:
    """The bytes up to *end* are a line, or noise, that does not answer the request."""

    end: int


class Reply(Protocol[T_co]):
    """The shape of one answer. It has no state, so one shape serves any number of requests."""

    @property
    def is_binary(self) -> bool:
        """Whether the answer begins with bytes that have no framing of their own."""
        ...

    def parse(self, buffer: bytes | bytearray, start: int, context: Context) -> Parsed[T_co] | UnexpectedReply | None:
        """Look for the answer in *buffer*, from *start* on.

        Returns:
            :class:`Parsed` if the whole answer is there, :class:`UnexpectedReply` if a line stands there that answers
            something else and is to be dropped, None if bytes are still missing.

        Raises:
            CommandRejected: The robot does not know the command.
            RemoteProtocolError: The answer is malformed.
        """
        ...


Encoder = Callable[[Sequence[int], "Context"], bytes]
Special = Callable[[Sequence[int], "Context"], tuple[bytes, Reply[T_co]] | None]


@dataclass(frozen=True, slots=True)
class Form(Generic[T_co]):
    """How one command is written on the wire of one firmware.

    Attributes:
        encode: Makes the bytes of the request from its arguments, as the whole numbers of the wire.
        reply: The shape of the answer.
        letter: Letter of a text form; empty for a binary one.
        code: Opcode of a binary form; None for text.
        layout: What follows the opcode, as a format of :mod:`struct`; empty if nothing does.
        special: Makes bytes and shape of the calls that need others; returns None for all other calls.
        is_stateful: Whether the bytes contain what this program set before, so that they are made when they are sent.
        is_guarded: Whether the guard follows the request.
    """

    encode: Encoder
    reply: Reply[T_co]
    letter: str = ""
    code: int | None = None
    layout: str = ""
    special: Special[T_co] | None = None
    is_stateful: bool = False
    is_guarded: bool = False


@dataclass(frozen=True, slots=True)
class Profile:
    """One firmware.

    Attributes:
        name: Name of the firmware, such as ``btcom-2.0``.
        version: A text that the answer to ``V`` contains.
        codec: What its link carries.
        is_gctronic: Whether it is one of GCtronic's firmwares, whose answer to ``V`` has a second line.
        ranges: Ranges that differ from those of the quantity, by the name of the quantity.
        forms: Forms that replace those of the command table, by the name of the row.
        binary_forms: Forms that replace those of the command table in a binary frame, by the name of the row.
        absent: Rows that this firmware does not have, by name, with the reason; ``text`` if it takes no text commands.
        text_only: Rows that have no binary form on this firmware.
        unsent: Binary commands that it knows and elib does not send (wire-protocol.md, 3.1), by the row with the same
            effect or by a name.
        unsent_text: Text commands that it knows and elib does not send (wire-protocol.md, 2.1): by their letter, a name
            and the shape of the answer, None for no answer.
        kept_letters: Small letters that are commands of their own; the firmware reads all others as capitals.
        sends_packet: Whether it has the packet of all sensors.
        chain: Readings that ``sensors()`` asks for in one binary frame.
        tail: Readings that ``sensors()`` adds as text.
        generation: Whose step motors the robot has, 1 or 2 (e-puck2); see :func:`elib.base.body.step_rate`.
        counter_bits: Width of the step counters as they are read: where they wrap.
        receive_ring: Bytes that may wait unread while the robot is busy.
        longest_parameters: Bytes of the longest parameter list of a binary command, which a resync has to fill up.
        mounting: How the camera sits in the robot.
        picture_bytes: The most bytes of pixels that the reply buffer holds.
        camera_driver: The driver whose rules the camera's windows must keep. A firmware for three chips does not tell
            which one it has found; it has the driver of the PO8030, because the others take what that one takes.
        zooms: The zoom factors that work; None if every factor works whose window fits.
        camera_clears_lamps: Whether setting the camera resets all ports, so that every lamp goes off (wire-protocol.md,
            2.2).
        acceleration_zero: Counts at 0 g.
        counts_per_g: Counts for 1 g.
        gyroscope_counts_per_degree: Counts for 1 degree/s.
        battery_counts: Raw readings of an empty and a full battery.
        help_ends_with: The beginning of the last line of the help text; only a decoder needs it.
        toggles_all: Whether ``L,8,2`` toggles all ring LEDs; otherwise it switches them off.
        numbers_body_lamps: Whether lamps 8 and 9 of a binary ``L`` are the body and the front; otherwise 8 is the whole
            ring.
        has_rgb_lamps: Whether the ring LEDs 1, 3, 5 and 7 have colours; ``L`` lights them red.
        status_led: The ring LED that the robot itself uses to show its state, so that no command reaches it, or None.
        i2c_scan_prints_all: Whether a scan also prints devices that do not answer, with the value 0.
        says_selector: Whether it sends the position of the selector before its greeting when it starts.
        sounds: What sounds 1, 2 and so on are called.
        talks_at: Where the selector must stand when it starts, and what it then talks through (wire-protocol.md, 5.7);
            empty if it talks in every position.
        service: Longest time that the robot is busy with a row and reads nothing, s, by the row's name.
        patience: Time that a call waits for its answer by default, s, if its row says less.
    """

    name: str
    version: str
    codec: Codec = "serial"
    is_gctronic: bool = False
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    forms: Mapping[str, Form[object]] = field(default_factory=dict)
    binary_forms: Mapping[str, Form[object]] = field(default_factory=dict)
    absent: Mapping[str, str] = field(default_factory=dict)
    text_only: Collection[str] = ()
    unsent: Mapping[str, Form[object]] = field(default_factory=dict)
    unsent_text: Mapping[str, tuple[str, Reply[object] | None]] = field(default_factory=dict)
    kept_letters: str = ""
    sends_packet: bool = False
    chain: tuple[str, ...] = ()
    tail: tuple[str, ...] = ()
    generation: int = 1
    counter_bits: int = 16
    receive_ring: int = 64
    longest_parameters: int = 4
    mounting: Mounting = Mounting.QUARTER_LEFT
    picture_bytes: int = 4136
    camera_driver: CameraDriver = PO8030
    zooms: tuple[int, ...] | None = None
    camera_clears_lamps: bool = True
    acceleration_zero: float = 2048
    counts_per_g: float = 768
    gyroscope_counts_per_degree: float = 131
    battery_counts: tuple[int, int] = (2070, 2560)
    help_ends_with: str = '"Y"'
    toggles_all: bool = False
    numbers_body_lamps: bool = True
    has_rgb_lamps: bool = False
    status_led: int | None = None
    i2c_scan_prints_all: bool = False
    says_selector: bool = False
    sounds: tuple[str, ...] = ("Ha", "Spa", "Wow", "Yow", "Long wow")
    talks_at: Mapping[int, str] = field(default_factory=dict)
    service: Mapping[str, float] = field(default_factory=dict)
    patience: float = 0.0

    @property
    def line_end(self) -> bytes:
        """The bytes that end a half-received command: zeros, one more than the longest parameter list, and a CR.

        Over Wi-Fi there are none: a command is a count of bytes, and nothing but commands may be sent.
        """
        if self.codec == "wifi":
            return b""
        return bytes(self.longest_parameters + 1) + b"\r"

    def zoom_of_chip(self, zoom: int) -> int:
        """Return the pixels of the chip for one of a picture with this zoom (wire-protocol.md, 3.4)."""
        return zoom if self.zooms is None else min(zoom, 4)

    def limited(self, quantity: Quantity) -> Quantity:
        """Return a kind of argument with its range on this firmware."""
        own = self.ranges.get(quantity.name)
        return quantity if own is None else _limited(quantity, *own)


@functools.cache  # arguments are checked at each call
def _limited(quantity: Quantity, low: float, high: float) -> Quantity:
    return replace(quantity, low=low, high=high)


@dataclass(slots=True)
class LastSet:
    """The settings that this program made last and the robot confirmed. The firmware has no way to read it back.

    Attributes:
        speed: Wheel speeds, steps/s.
        lamps: Ring LEDs 0..7, body (8), front (9): 0 or 1.
        rgb: Red, green, blue of LED2, LED4, LED6, LED8, 0..100; e-puck2 only.
        avoidance: Whether the obstacle avoidance of the firmware is on; e-puck2 only.
        camera: Settings of the camera; None until they are set or read.
    """

    speed: tuple[int, int] = (0, 0)
    lamps: list[int] = field(default_factory=lambda: [0] * 10)
    rgb: list[int] = field(default_factory=lambda: [0] * 12)
    avoidance: bool = False
    camera: CameraSettings | None = None


STANDING = bytes((0x80, 2)) + bytes(19)
"""The command over Wi-Fi that streams the sensors and has all actuators at zero (wire-protocol.md, 4.2)."""


class Stamp(TypedDict):
    """When a value came, and where from."""

    time: float
    origin: str


def _new_grey() -> Grey:
    from elib.link.protocol.colours import Grey  # here: few programs look for colours

    return Grey()


@dataclass(slots=True)
class Context:
    """The knowledge of one connection about its robot.

    Attributes:
        profile: The firmware of the robot.
        origin: Where values come from: ``robot``, ``simulator`` or ``replay``.
        time: When the newest bytes came, s on the caller's clock.
        last_set: What this program last set.
        sent: The command that was sent last, over Wi-Fi, where every command has all actuators: even if it was not
            confirmed, the robot takes it before the next one.
        streams_images: Whether the robot is to send pictures all the time, over Wi-Fi.
        grey: What its pictures told of how its camera shows grey.
        open_air: What its infrared sensors read in the open, as far as ``distances()`` has seen; None before.
        requests: Requests without arguments, kept by what makes them: rows by their names, polls by their readings.
    """

    profile: Profile
    origin: str = "robot"
    time: float = math.nan
    last_set: LastSet = field(default_factory=LastSet)
    sent: bytes = STANDING
    streams_images: bool = False
    grey: Grey = field(default_factory=_new_grey, repr=False)
    open_air: OpenAir | None = field(default=None, repr=False)
    requests: dict[object, object] = field(default_factory=dict, repr=False)

    def forget(self) -> None:
        """Forget what was set: the robot has restarted."""
        self.last_set, self.open_air = LastSet(), None

    @property
    def stamp(self) -> Stamp:
        """Time and origin of a value that is decoded now."""
        return {"time": self.time, "origin": self.origin}
