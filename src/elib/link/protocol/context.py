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
    """How one command is written on the wire of one firmware."""

    encode: Encoder  # makes the bytes of the request from its arguments, as the whole numbers of the wire
    reply: Reply[T_co]  # the shape of the answer
    letter: str = ""  # letter of a text form; empty for a binary one
    code: int | None = None  # opcode of a binary form; None for text
    layout: str = ""  # what follows the opcode, as a format of struct; empty if nothing does
    # makes bytes and shape of the calls that need others; returns None for all other calls
    special: Special[T_co] | None = None
    # whether the bytes contain what this program set before, so that they are made when they are sent
    is_stateful: bool = False
    is_guarded: bool = False  # whether the guard follows the request


@dataclass(frozen=True, slots=True)
class Profile:
    """One firmware."""

    name: str
    version: str  # a text that the answer to `V` contains
    codec: Codec = "serial"  # what its link carries
    is_gctronic: bool = False  # whether it is one of GCtronic's firmwares, whose answer to `V` has a second line
    # ranges that differ from those of the quantity, by the name of the quantity
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    # forms that replace those of the command table, by the name of the row
    forms: Mapping[str, Form[object]] = field(default_factory=dict)
    # forms that replace those of the command table in a binary frame, by the name of the row
    binary_forms: Mapping[str, Form[object]] = field(default_factory=dict)
    # rows that this firmware does not have, by name, with the reason; `text` if it takes no text commands
    absent: Mapping[str, str] = field(default_factory=dict)
    text_only: Collection[str] = ()  # rows that have no binary form on this firmware
    # binary commands that it knows and elib does not send (wire-protocol.md, 3.1), by the row with the same effect or
    # by a name
    unsent: Mapping[str, Form[object]] = field(default_factory=dict)
    # text commands that it knows and elib does not send (wire-protocol.md, 2.1): by their letter, a name and the shape
    # of the answer, None for no answer
    unsent_text: Mapping[str, tuple[str, Reply[object] | None]] = field(default_factory=dict)
    kept_letters: str = ""  # small letters that are commands of their own; the firmware reads all others as capitals
    sends_packet: bool = False  # whether it has the packet of all sensors
    chain: tuple[str, ...] = ()  # readings that `sensors()` asks for in one binary frame
    tail: tuple[str, ...] = ()  # readings that `sensors()` adds as text
    generation: int = 1  # whose step motors the robot has, 1 or 2 (e-puck2); see step_rate
    counter_bits: int = 16  # width of the step counters as they are read: where they wrap
    receive_ring: int = 64  # bytes that may wait unread while the robot is busy
    # bytes of the longest parameter list of a binary command, which a resync has to fill up
    longest_parameters: int = 4
    mounting: Mounting = Mounting.QUARTER_LEFT  # how the camera sits in the robot
    picture_bytes: int = 4136  # the most bytes of pixels that the reply buffer holds
    # the driver whose rules the camera's windows must keep. A firmware for three chips does not tell which one it has
    # found; it has the driver of the PO8030, because the others take what that one takes.
    camera_driver: CameraDriver = PO8030
    zooms: tuple[int, ...] | None = None  # the zoom factors that work; None if every factor works whose window fits
    # whether setting the camera resets all ports, so that every lamp goes off (wire-protocol.md, 2.2)
    camera_clears_lamps: bool = True
    acceleration_zero: float = 2048  # counts at 0 g
    counts_per_g: float = 768  # counts for 1 g
    gyroscope_counts_per_degree: float = 131  # counts for 1 degree/s
    battery_counts: tuple[int, int] = (2070, 2560)  # raw readings of an empty and a full battery
    help_ends_with: str = '"Y"'  # the beginning of the last line of the help text; only a decoder needs it
    toggles_all: bool = False  # whether `L,8,2` toggles all ring LEDs; otherwise it switches them off
    # whether lamps 8 and 9 of a binary `L` are the body and the front; otherwise 8 is the whole ring
    numbers_body_lamps: bool = True
    has_rgb_lamps: bool = False  # whether the ring LEDs 1, 3, 5 and 7 have colours; `L` lights them red
    # the ring LED that the robot itself uses to show its state, so that no command reaches it, or None
    status_led: int | None = None
    i2c_scan_prints_all: bool = False  # whether a scan also prints devices that do not answer, with the value 0
    says_selector: bool = False  # whether it sends the position of the selector before its greeting when it starts
    sounds: tuple[str, ...] = ("Ha", "Spa", "Wow", "Yow", "Long wow")  # what sounds 1, 2 and so on are called
    # where the selector must stand when it starts, and what it then talks through (wire-protocol.md, 5.7); empty if it
    # talks in every position
    talks_at: Mapping[int, str] = field(default_factory=dict)
    # longest time that the robot is busy with a row and reads nothing, s, by the row's name
    service: Mapping[str, float] = field(default_factory=dict)
    patience: float = 0.0  # time that a call waits for its answer by default, s, if its row says less

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
    """The settings that this program made last and the robot confirmed. The firmware has no way to read it back."""

    speed: tuple[int, int] = (0, 0)  # wheel speeds, steps/s
    lamps: list[int] = field(default_factory=lambda: [0] * 10)  # ring LEDs 0..7, body (8), front (9): 0 or 1
    # red, green, blue of LED2, LED4, LED6, LED8, 0..100; e-puck2 only
    rgb: list[int] = field(default_factory=lambda: [0] * 12)
    avoidance: bool = False  # whether the obstacle avoidance of the firmware is on; e-puck2 only
    camera: CameraSettings | None = None  # settings of the camera; None until they are set or read


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
    """The knowledge of one connection about its robot."""

    profile: Profile  # the firmware of the robot
    origin: str = "robot"  # where values come from: `robot`, `simulator` or `replay`
    time: float = math.nan  # when the newest bytes came, s on the caller's clock
    last_set: LastSet = field(default_factory=LastSet)  # what this program last set
    # the command that was sent last, over Wi-Fi, where every command has all actuators: even if it was not confirmed,
    # the robot takes it before the next one
    sent: bytes = STANDING
    streams_images: bool = False  # whether the robot is to send pictures all the time, over Wi-Fi
    grey: Grey = field(default_factory=_new_grey, repr=False)  # what its pictures told of how its camera shows grey
    # what its infrared sensors read in the open, as far as `distances()` has seen; None before
    open_air: OpenAir | None = field(default=None, repr=False)
    # requests without arguments, kept by what makes them: rows by their names, polls by their readings
    requests: dict[object, object] = field(default_factory=dict, repr=False)

    def forget(self) -> None:
        """Forget what was set: the robot has restarted."""
        self.last_set, self.open_air = LastSet(), None

    @property
    def stamp(self) -> Stamp:
        """Time and origin of a value that is decoded now."""
        return {"time": self.time, "origin": self.origin}
