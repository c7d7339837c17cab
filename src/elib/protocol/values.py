"""What commands return: frozen values that know when and where they came from.

A value with several numbers unpacks, indexes, iterates and compares like a tuple of them. ``.time`` (s, on the clock
of the robot's event loop, when the answer was complete) and ``.origin`` (``robot``, ``simulator`` or ``replay``) take
no part in equality, length or iteration.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import ClassVar, Generic, TypeVar, overload

N = TypeVar("N", int, float)

APART = MappingProxyType({"apart": True})
"""Metadata of a field that is no raw number of the reading: its time, a constant, or the same in another unit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """Base of every value that came from a robot."""

    time: float = field(default=math.nan, compare=False, repr=False, metadata=APART)
    origin: str = field(default="", compare=False, repr=False, metadata=APART)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Numbers(Reading, Sequence[N], Generic[N]):
    """A reading of several numbers: a sequence of its fields in order."""

    _names: ClassVar[tuple[str, ...]] = ()

    @property
    def numbers(self) -> tuple[N, ...]:
        """The numbers alone, as a tuple."""
        names = type(self)._names
        if not names:
            names = tuple(item.name for item in fields(self) if item.init and not item.kw_only)
            type(self)._names = names
        return tuple(getattr(self, name) for name in names)

    @overload
    def __getitem__(self, index: int) -> N: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[N, ...]: ...
    def __getitem__(self, index: int | slice) -> N | tuple[N, ...]:
        return self.numbers[index]

    def __len__(self) -> int:
        return len(self.numbers)

    def __iter__(self) -> Iterator[N]:
        return iter(self.numbers)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, tuple):
            return self.numbers == other
        if isinstance(other, Numbers) and type(other) is type(self):
            return self.numbers == other.numbers
        return NotImplemented

    def __hash__(self) -> int:
        return hash(self.numbers)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Counts(Numbers[int]):
    """A reading whose length depends on the firmware."""

    counts: tuple[int, ...] = ()

    @property
    def numbers(self) -> tuple[int, ...]:
        """The counts, in the order of the wire."""
        return self.counts


@dataclass(frozen=True, slots=True, eq=False)
class Wheels(Numbers[float]):
    """Speeds of the wheels, rev/s: 1 rev/s is 1000 steps/s, 12.88 cm/s."""

    left: float
    right: float


@dataclass(frozen=True, slots=True, eq=False)
class Steps(Numbers[int]):
    """Motor steps counted since the counters were set; 1000 are one turn of a wheel."""

    left: int
    right: int


@dataclass(frozen=True, slots=True, eq=False)
class InfraredRing(Numbers[int]):
    """Eight counts, clockwise from the front right: the robot's infrared sensors 0 to 7."""

    front_right: int = 0
    diagonal_right: int = 0
    right: int = 0
    rear_right: int = 0
    rear_left: int = 0
    left: int = 0
    diagonal_left: int = 0
    front_left: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Proximity(InfraredRing):
    """Eight proximity counts, about 0 to 4000; higher is nearer."""


@dataclass(frozen=True, slots=True, eq=False)
class AmbientLight(InfraredRing):
    """Eight ambient light counts, about 0 to 4000; higher is darker."""


@dataclass(frozen=True, slots=True, eq=False)
class Vector(Numbers[int]):
    """Three counts along x (right), y (rear) and z (up), as the firmware sends them."""

    x: int
    y: int
    z: int


@dataclass(frozen=True, slots=True, eq=False)
class Acceleration(Vector):
    """Acceleration, counts as sent; :attr:`g` converts with the profile's zero and scale."""

    zero: float = field(default=2048, kw_only=True, repr=False, metadata=APART)
    counts_per_g: float = field(default=768, kw_only=True, repr=False, metadata=APART)

    @property
    def g(self) -> tuple[float, float, float]:
        """Acceleration along x, y, z in units of standard gravity; (0, 0, 1) at rest."""
        zero, scale = self.zero, self.counts_per_g
        return (self.x - zero) / scale, (self.y - zero) / scale, (self.z - zero) / scale


@dataclass(frozen=True, slots=True, eq=False)
class AngularVelocity(Vector):
    """Turn rates, counts as sent; :attr:`rad_per_s` converts with the profile's scale."""

    counts_per_degree: float = field(default=131.0, kw_only=True, repr=False, metadata=APART)

    @property
    def rad_per_s(self) -> tuple[float, float, float]:
        """Turn rates around x, y, z, rad/s."""
        scale = math.radians(1) / self.counts_per_degree
        return self.x * scale, self.y * scale, self.z * scale


@dataclass(frozen=True, slots=True, eq=False)
class Attitude(Numbers[float]):
    """Direction of gravity as the robot computes it.

    Attributes:
        magnitude: Length of the acceleration, counts; 768 is 1 g.
        orientation: Where the robot leans to, rad, 0 to 2 pi: 0 front down, pi/2 left down; 0 where it stands level.
        inclination: How far it leans, rad: 0 upright, pi upside down.
    """

    magnitude: float
    orientation: float
    inclination: float


@dataclass(frozen=True, slots=True, eq=False)
class MagneticField(Numbers[float]):
    """Magnetic flux density along x, y, z, T."""

    x: float
    y: float
    z: float


@dataclass(frozen=True, slots=True)
class Temperature(Reading):
    """Temperature of the inertial chip, degrees C."""

    celsius: int


@dataclass(frozen=True, slots=True)
class Distance(Reading):
    """Time-of-flight distance straight ahead, m."""

    metres: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ground(Counts):
    """Ground sensors left, centre, right and, where the firmware reads them, one or two cliff sensors."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Microphones(Counts):
    """Peak-to-peak volumes, counts: right, left, rear and, on the e-puck2, front."""


@dataclass(frozen=True, slots=True)
class Battery(Reading):
    """State of the battery.

    Attributes:
        raw: The reading as sent. The older e-puck1 sends 1 (fine) or 0 (below 3.4 V).
        volts: Voltage, V, or None where the robot has only the one bit.
        fraction: Charge from 0 (3.4 V) to 1 (4.2 V), or None.
    """

    raw: int
    volts: float | None = field(metadata=APART)
    fraction: float | None = field(metadata=APART)


@dataclass(frozen=True, slots=True)
class Selector(Reading):
    """Position of the rotary switch, 0..15."""

    position: int


@dataclass(frozen=True, slots=True)
class Button(Reading):
    """The user button."""

    pressed: bool


@dataclass(frozen=True, slots=True)
class SdCard(Reading):
    """Whether a micro SD card was found and initialised."""

    present: bool


@dataclass(frozen=True, slots=True, eq=False)
class IrCode(Numbers[int]):
    """Last code of an RC5 remote control: the toggle bit, the address and the key."""

    check: int
    address: int
    data: int


@dataclass(frozen=True, slots=True, eq=False)
class CameraSettings(Numbers[int]):
    """Settings of the camera, for the upright picture.

    Attributes:
        mode: Pixel format; see :class:`~elib.CameraMode`.
        width: Columns of the upright picture.
        height: Rows of the upright picture.
        zoom: Sensor pixels per picture pixel: 8 is the widest view, 1 the narrowest.
        size: Bytes of pixels in an answer.
    """

    mode: int
    width: int
    height: int
    zoom: int
    size: int


@dataclass(frozen=True, slots=True)
class Version(Reading):
    """Who answers.

    Attributes:
        text: The answer's lines, without the leading letter.
        firmware: The profile elib uses for it: ``btcom-1.1.3``, ``btcom-2.0``, ``asercom-1.2.2`` or ``epuck2``.
        hardware: The identity word of the hardware in hexadecimal, or an empty string.
    """

    text: str
    firmware: str
    hardware: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensors(Reading):
    """Every reading at once; None where the firmware has none."""

    speed: Wheels | None = None
    encoders: Steps | None = None
    proximity: Proximity | None = None
    ambient_light: AmbientLight | None = None
    accelerometer: Acceleration | None = None
    attitude: Attitude | None = None
    gyroscope: AngularVelocity | None = None
    magnetometer: MagneticField | None = None
    temperature: Temperature | None = None
    distance: Distance | None = None
    ground: Ground | None = None
    microphones: Microphones | None = None
    battery: Battery | None = None
    selector: Selector | None = None
    button: Button | None = None
    sd_card: SdCard | None = None
    ir_receiver: IrCode | None = None
