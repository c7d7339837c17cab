"""The values that commands return: they are frozen, and know when they came and where from.

A value with several numbers unpacks, indexes, iterates and compares like a tuple of them. ``.time`` (s, on the clock
of the robot's event loop, when the answer was complete) and ``.origin`` (``robot``, ``simulator`` or ``replay``) take
no part in equality, length or iteration.
"""

# Units, labels, ranges and roles of fields are stated only here, as metadata of the fields (see FieldInfo). The command
# line, the panel, recordings, comparisons and the reference read them with describe() and items().

from __future__ import annotations

import enum
import math
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import ClassVar, Final, Generic, NamedTuple, TypeVar, cast, get_args, get_type_hints, overload

from elib.base.body import MICROPHONE_DIRECTIONS
from elib.base.errors import Unsupported

N = TypeVar("N", int, float)
R = TypeVar("R")
T = TypeVar("T")

TWELVE_BITS: Final = 4095
"""Largest count of the robot's converter, for infrared sensors and microphones."""


MIN_MICROPHONES: Final = 3
"""Two microphones cannot tell front from rear."""

AUDIBLE: Final = 30
"""Counts of the loudest microphone from which a sound has a direction. A quiet room reads 0 to 12, and the motors up to
28 (measured-robots: microphones.quiet)."""

EAR_ERROR: Final = 0.094
"""Part by which a microphone hears more or less than it should: gains that differ by 8 %, and 5 % from beep to beep
(measured-robots: proposals.microphones)."""

ROOM_ERROR: Final = 2.0
"""Noise of a quiet room, counts (measured-robots: microphones.quiet)."""

UNCLEAR: Final = 0.5
"""rad. A direction with a greater error is none."""


class Role(enum.Enum):
    """The purpose of a field of a reading."""

    NUMBER = enum.auto()
    """What the robot sent."""
    CONVERTED = enum.auto()
    """A number in another unit, which elib computed."""
    PHYSICAL = enum.auto()
    """A property with all numbers of the reading in another unit, in the same order."""
    CONSTANT = enum.auto()
    """A constant that converts the numbers."""
    STAMP = enum.auto()
    """Time and origin of the reading."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldInfo:
    """Facts about a field of a reading, for people and programs."""

    name: str = ""
    role: Role = Role.NUMBER  # what the field is for
    unit: str = ""  # unit of its numbers; empty if they have none
    label: str | None = None  # words for a person; empty if the title of the reading says enough. The name by default.
    names: tuple[str, ...] = ()  # names of its numbers, in order, if it holds several
    low: float | None = None  # value at the low end of a gauge, or None
    high: float | None = None  # value at the high end of a gauge, or None
    # smallest difference that a chart shows at full height, in the unit: a few times the noise of a robot that stands
    # still (e-puck.md)
    span: float = 1.0
    form: str = ""  # format of a number where columns must not move, as for format

    @property
    def words(self) -> str:
        """The label, or the name in words."""
        return in_words(self.name) if self.label is None else self.label


def in_words(name: str) -> str:
    """Return a name as a person writes it: ``front_right`` is ``front right``."""
    return name.replace("_", " ")


def _converting(info: FieldInfo) -> Callable[[Callable[[R], T]], Callable[[R], T]]:
    """Attach *info* to the getter of a property that has all numbers of a reading in another unit."""

    def mark(getter: Callable[[R], T]) -> Callable[[R], T]:
        getter.info = replace(info, name=getter.__name__, role=Role.PHYSICAL)  # type: ignore[attr-defined]  # its own
        return getter

    return mark


_STAMP = {"info": FieldInfo(role=Role.STAMP)}
_CONSTANT = {"info": FieldInfo(role=Role.CONSTANT)}
_WHEEL_SPEED = {"info": FieldInfo(unit="rev/s", span=0.1, form="+.3f")}
_WHEEL_STEPS = {"info": FieldInfo(unit="steps", span=100)}
_INFRARED = {"info": FieldInfo(unit="counts", low=0, high=TWELVE_BITS, span=200, form="4")}
_COUNTS = {"info": FieldInfo(unit="counts")}
_ANGLE = {"info": FieldInfo(unit="rad", span=0.2)}
_TESLA = {"info": FieldInfo(unit="T", span=5e-6)}
_YES_OR_NO = {"info": FieldInfo(low=0, high=1)}
_PIXELS = {"info": FieldInfo(unit="pixels")}


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """Base of every value that came from a robot."""

    time: float = field(default=math.nan, compare=False, repr=False, metadata=_STAMP)
    origin: str = field(default="", compare=False, repr=False, metadata=_STAMP)

    def _repr_html_(self) -> str:
        """Show the reading in a notebook."""
        from elib.base.plaintext import html_table  # here: only notebooks need it

        when = "" if math.isnan(self.time) else f" at {self.time:.2f} s"
        return html_table(map(_row, items(self, Role.NUMBER, Role.CONVERTED)), f"{type(self).__name__}{when}")


def _row(item: tuple[FieldInfo, str, object]) -> tuple[str, ...]:
    """Return name, number and bar of one number of a reading."""
    from elib.base.plaintext import html_bar

    info, name, value = item
    shown = f"{value:.4g}" if isinstance(value, float) else "-" if value is None else str(value)
    cells = (in_words(name), f"{shown} {info.unit}".strip())
    if info.low is None or info.high is None or not isinstance(value, int | float):
        return cells
    return *cells, html_bar((value - info.low) / (info.high - info.low))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Single(Reading):
    """A reading of one value, used like it: ``robot.selector() == 3``, ``if robot.button():``, ``battery < 3.5``."""

    _holds: ClassVar[str] = ""  # name of the field with the value; empty if the reading has one number

    @property
    def _plain(self) -> float | None:
        """The value; None if this robot does not say it."""
        value: float | None = getattr(self, self._holds or describe(type(self), Role.NUMBER)[0].name)
        return value

    @property
    def value(self) -> float:
        """The value alone: a number, or true or false.

        Raises:
            Unsupported: This robot does not say it, as an e-puck1 of the first kind does not say a voltage.
        """
        if self._plain is None:
            raise Unsupported(f"this robot does not say the {self._holds} of its {type(self).__name__.lower()}: {self}")
        return self._plain

    def __bool__(self) -> bool:
        return bool(self._plain)

    def __int__(self) -> int:
        return int(self.value)

    def __float__(self) -> float:
        return float(self.value)

    def __index__(self) -> int:
        return operator.index(cast("int", self.value))  # a float is refused in Python's words

    def __round__(self, digits: int | None = None) -> float:
        return round(self.value, digits)

    def __format__(self, how: str) -> str:
        return format(self.value, how) if how else str(self)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Single):
            return type(other) is type(self) and _fields(self) == _fields(other)
        return self._plain == other if isinstance(other, int | float) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._plain)

    def __lt__(self, other: float) -> bool:
        return self.value < float(other)

    def __le__(self, other: float) -> bool:
        return self.value <= float(other)

    def __gt__(self, other: float) -> bool:
        return self.value > float(other)

    def __ge__(self, other: float) -> bool:
        return self.value >= float(other)


def _fields(reading: Reading) -> tuple[object, ...]:
    """Return what a reading compares by: its fields without its time and origin."""
    return tuple(getattr(reading, info.name) for info in describe(type(reading)) if info.role is not Role.STAMP)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Numbers(Reading, Sequence[N], Generic[N]):
    """A reading of several numbers: a sequence of its fields in order."""

    _names: ClassVar[tuple[str, ...]] = ()

    @property
    def numbers(self) -> tuple[N, ...]:
        """The numbers alone, as a tuple."""
        names = type(self)._names
        if not names:
            names = type(self)._names = tuple(info.name for info in describe(type(self), Role.NUMBER))
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

    left: float = field(metadata=_WHEEL_SPEED)
    right: float = field(metadata=_WHEEL_SPEED)


@dataclass(frozen=True, slots=True, eq=False)
class Steps(Numbers[int]):
    """Motor steps counted since the counters were set; 1000 are one turn of a wheel."""

    left: int = field(metadata=_WHEEL_STEPS)
    right: int = field(metadata=_WHEEL_STEPS)


@dataclass(frozen=True, slots=True, eq=False)
class InfraredRing(Numbers[int]):
    """Eight counts, clockwise from the front right: the robot's infrared sensors 0 to 7."""

    front_right: int = field(default=0, metadata=_INFRARED)
    diagonal_right: int = field(default=0, metadata=_INFRARED)
    right: int = field(default=0, metadata=_INFRARED)
    rear_right: int = field(default=0, metadata=_INFRARED)
    rear_left: int = field(default=0, metadata=_INFRARED)
    left: int = field(default=0, metadata=_INFRARED)
    diagonal_left: int = field(default=0, metadata=_INFRARED)
    front_left: int = field(default=0, metadata=_INFRARED)


@dataclass(frozen=True, slots=True, eq=False)
class Proximity(InfraredRing):
    """Eight proximity counts, about 0 to 4000; higher is nearer."""


@dataclass(frozen=True, slots=True, eq=False)
class AmbientLight(InfraredRing):
    """Eight ambient light counts, about 0 to 4000; higher is darker."""


@dataclass(frozen=True, slots=True, eq=False)
class Vector(Numbers[int]):
    """Three counts along x (right), y (rear) and z (up), as the firmware sends them."""

    x: int = field(metadata=_COUNTS)
    y: int = field(metadata=_COUNTS)
    z: int = field(metadata=_COUNTS)


@dataclass(frozen=True, slots=True, eq=False)
class Acceleration(Vector):
    """Acceleration, counts as sent; :attr:`g` converts with the profile's zero and scale."""

    zero: float = field(default=2048, kw_only=True, repr=False, metadata=_CONSTANT)
    counts_per_g: float = field(default=768, kw_only=True, repr=False, metadata=_CONSTANT)

    @property
    @_converting(FieldInfo(unit="g", names=("x", "y", "z"), span=0.2, form="+.2f"))
    def g(self) -> tuple[float, float, float]:
        """Acceleration along x, y, z in units of standard gravity; (0, 0, 1) at rest."""
        zero, scale = self.zero, self.counts_per_g
        return (self.x - zero) / scale, (self.y - zero) / scale, (self.z - zero) / scale


@dataclass(frozen=True, slots=True, eq=False)
class AngularVelocity(Vector):
    """Turn rates, counts as sent; :attr:`rad_per_s` converts with the profile's scale."""

    counts_per_degree: float = field(default=131.0, kw_only=True, repr=False, metadata=_CONSTANT)

    @property
    @_converting(FieldInfo(unit="rad/s", names=("x", "y", "z"), span=0.2, form="+.2f"))
    def rad_per_s(self) -> tuple[float, float, float]:
        """Turn rates around x, y, z, rad/s."""
        scale = math.radians(1) / self.counts_per_degree
        return self.x * scale, self.y * scale, self.z * scale


@dataclass(frozen=True, slots=True, eq=False)
class Attitude(Numbers[float]):
    """Direction of gravity as the robot computes it.

    Attributes:
        magnitude: Length of the acceleration; 768 is 1 g.
        orientation: Direction in which the robot leans, 0 to 2 pi: 0 front down, pi/2 left down; 0 if it stands level.
        inclination: How far the robot leans: 0 upright, pi upside down.
    """

    magnitude: float = field(metadata=_COUNTS)
    orientation: float = field(metadata=_ANGLE)
    inclination: float = field(metadata=_ANGLE)


@dataclass(frozen=True, slots=True, eq=False)
class MagneticField(Numbers[float]):
    """Magnetic flux density along x, y, z, T."""

    x: float = field(metadata=_TESLA)
    y: float = field(metadata=_TESLA)
    z: float = field(metadata=_TESLA)


@dataclass(frozen=True, slots=True, eq=False)
class Temperature(Single):
    """Temperature of the inertial chip, degrees C."""

    celsius: int = field(metadata={"info": FieldInfo(unit="degrees C", label="", span=2)})


@dataclass(frozen=True, slots=True, eq=False)
class Distance(Single):
    """Time-of-flight distance straight ahead, m; infinite (``math.inf``) where the sensor sees nothing.

    The robot then sends 8190. Beyond 0.9 m a real one does so now and then although something is there: ask again
    before you believe it. A thing narrower than the cone of 25 degrees reads too far if something stands behind it.
    """

    metres: float = field(metadata={"info": FieldInfo(unit="m", label="", low=0, high=2, span=0.02, form=".3f")})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ground(Counts):
    """Ground sensors left, centre, right and, where the firmware reads them, one or two cliff sensors."""

    counts: tuple[int, ...] = field(
        default=(),
        metadata={
            "info": FieldInfo(
                unit="counts",
                names=("left", "centre", "right", "cliff_left", "cliff_right"),
                low=0,
                high=1000,
                span=100,
            )
        },
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Microphones(Counts):
    """Peak-to-peak volumes, counts: right, left, rear and, on the e-puck2, front."""

    counts: tuple[int, ...] = field(
        default=(),
        metadata={
            "info": FieldInfo(
                unit="counts", names=("right", "left", "rear", "front"), low=0, high=TWELVE_BITS, span=100
            )
        },
    )

    @property
    def direction(self) -> float | None:
        """Direction that the sound comes from, rad, 0 ahead, positive to the left; None if the readings do not tell.

        It is None if no microphone hears 30 counts, or all hear so much the same that the error would exceed 0.5 rad:
        in silence, amid noise from all sides, of a sound from above, and where the loudest sound exceeds what the robot
        can measure. The motors are loud: listen while the robot stands. A robot's body shades little, and its
        microphones are not equally loud, so directions are rough: of the beeps that a real e-puck2 heard 16, 32 and 48
        cm away, 5, 32 and 56 % had none, and the others were right to 12, 19 and 24 degrees (root mean square). Of its
        first three microphones alone, as an e-puck1 has them, 15, 49 and 65 % had none, and the others were right to
        18, 21 and 28 degrees. A clap 1 m away has often none.
        """
        sound = self._sound
        return sound.bearing if sound is not None and sound.error <= UNCLEAR else None

    @property
    def direction_error(self) -> float:
        """Error of the direction that is to be expected, rad, root mean square; infinite if nothing is heard.

        It follows from how much louder one side hears the sound. Most of it comes from the gains of the microphones,
        which are not known and differ by 8 %: a mean over several readings does not help against that. Of the
        recordings of a real e-puck2, 67 % of the directions were right to this, and 99 % to twice as much.
        """
        sound = self._sound
        return math.inf if sound is None else sound.error

    @property
    def _sound(self) -> Sound | None:
        is_heard = len(self.counts) >= MIN_MICROPHONES and max(self.counts) >= AUDIBLE
        return locate_sound(self.counts) if is_heard else None


@dataclass(frozen=True, slots=True, eq=False)
class Pitch(Single):
    """The frequency of the loudest tone that the microphones hear, used like its number, in Hz.

    Attributes:
        frequency: Hz, 150 to 8000; 0 if no tone stands out, as in silence, of a clap or of a voice.
        error: The frequency is right to this, Hz, if one steady tone of 150 to 8000 Hz is much louder than the rest.
        share: Part of what is heard that this tone makes, 0..1.
    """

    _holds: ClassVar[str] = "frequency"

    frequency: float = field(metadata={"info": FieldInfo(unit="Hz", label="", low=0, high=8000, span=20, form=".0f")})
    error: float = field(metadata={"info": FieldInfo(unit="Hz", span=20, form=".0f")})
    share: float = field(metadata={"info": FieldInfo(low=0, high=1, span=0.2, form=".2f")})


class Sound(NamedTuple):
    """A sound, as the microphones hear it."""

    bearing: float  # direction from which it comes, rad, 0 ahead, positive to the left
    volume: float  # how loud it is at the robot's centre, counts peak to peak
    contrast: float  # how much more a microphone hears that faces it, counts peak to peak
    error: float


def locate_sound(volumes: Sequence[float]) -> Sound:
    """Return the sound that three or four microphones hear.

    To the first order, a microphone that faces the source hears the most, and the others less with the cosine of the
    angle: v = volume + contrast cos(bearing - facing), whatever the exact shadow of the body is. Least squares give the
    best fit, and its error if each microphone is wrong by 9.4 % and 2 counts.

    Args:
        volumes: Right, left, rear and perhaps front, counts peak to peak, with the noise of the room.
    """
    towards = [(math.cos(angle), math.sin(angle)) for angle in MICROPHONE_DIRECTIONS[: len(volumes)]]
    count = len(towards)
    mean_x, mean_y = (sum(axis) / count for axis in zip(*towards, strict=True))
    mean = sum(volumes) / count
    xx = xy = yy = xv = yv = 0.0
    for volume, (x, y) in zip(volumes, towards, strict=True):
        dx, dy, dv = x - mean_x, y - mean_y, volume - mean
        xx, xy, yy, xv, yv = xx + dx * dx, xy + dx * dy, yy + dy * dy, xv + dx * dv, yv + dy * dv
    determinant = xx * yy - xy * xy
    ahead, leftward = (yy * xv - xy * yv) / determinant, (xx * yv - xy * xv) / determinant
    volume = mean - ahead * mean_x - leftward * mean_y
    contrast = math.hypot(ahead, leftward)
    if contrast == 0:
        return Sound(0.0, volume, 0.0, math.inf)
    across = (leftward * leftward * yy + 2 * leftward * ahead * xy + ahead * ahead * xx) / determinant
    error = (EAR_ERROR * mean + ROOM_ERROR) * math.sqrt(across) / (contrast * contrast)
    return Sound(math.atan2(leftward, ahead), volume, contrast, error)


@dataclass(frozen=True, slots=True, eq=False)
class Battery(Single):
    """State of the battery.

    Attributes:
        raw: The reading as sent. The older e-puck1 sends 1 (fine) or 0 (below 3.4 V).
        volts: Voltage, or None where the robot has only the one bit.
        fraction: Charge from 0 (3.4 V) to 1 (4.2 V), or None.
    """

    _holds: ClassVar[str] = "volts"

    raw: int = field(metadata={"info": FieldInfo(unit="counts", span=100)})
    volts: float | None = field(metadata={"info": FieldInfo(role=Role.CONVERTED, unit="V", label="voltage")})
    fraction: float | None = field(metadata={"info": FieldInfo(role=Role.CONVERTED, label="charge")})


@dataclass(frozen=True, slots=True, eq=False)
class Selector(Single):
    """Position of the rotary switch, 0..15."""

    position: int = field(metadata={"info": FieldInfo(low=0, high=15)})


@dataclass(frozen=True, slots=True, eq=False)
class Button(Single):
    """The user button."""

    pressed: bool = field(metadata=_YES_OR_NO)


@dataclass(frozen=True, slots=True, eq=False)
class SdCard(Single):
    """Whether a micro SD card was found and initialised."""

    present: bool = field(metadata=_YES_OR_NO)


@dataclass(frozen=True, slots=True, eq=False)
class IrCode(Numbers[int]):
    """Last code of an RC5 remote control: the toggle bit, the address and the key."""

    check: int
    address: int
    data: int = field(metadata={"info": FieldInfo(label="key")})


@dataclass(frozen=True, slots=True, eq=False)
class CameraSettings(Numbers[int]):
    """Settings of the camera, for the upright picture.

    Attributes:
        mode: Pixel format; see :class:`~elib.CameraMode`.
        width: Columns of the upright picture.
        height: Rows of the upright picture.
        zoom: Sensor pixels for one pixel of the picture: 8 is the widest view, 1 the narrowest.
        size: Bytes of pixels in an answer.
    """

    mode: int
    width: int = field(metadata=_PIXELS)
    height: int = field(metadata=_PIXELS)
    zoom: int = field(metadata={"info": FieldInfo(unit="sensor pixels a pixel")})
    size: int = field(metadata={"info": FieldInfo(unit="bytes")})


@dataclass(frozen=True, slots=True)
class Version(Reading):
    """The robot's firmware and hardware.

    Attributes:
        text: The lines of the answer, without the leading letter.
        firmware: Name of the firmware's profile in elib, such as ``btcom-2.0``.
        hardware: The identity word of the hardware in hexadecimal, or an empty string.
    """

    text: str
    firmware: str
    hardware: str


@dataclass(frozen=True, slots=True)
class Neighbour(Reading):
    """Another robot, as range and bearing shows it; ``.time`` is when its message was heard.

    Attributes:
        distance: From the middle of this robot to the middle of the other one.
        bearing: Direction in which the other one is, 0 ahead, positive to the left.
        message: What it said last, up to 4 bytes; empty unless it was given a message.
    """

    distance: float = field(metadata={"info": FieldInfo(unit="m", low=0, high=0.8, span=0.05, form=".3f")})
    bearing: float = field(metadata=_ANGLE)
    message: bytes = b""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensors(Reading):
    """Every reading at once; None where the firmware does not have it."""

    # A stop leaves the speed as it was asked for last (wire-protocol.md, 5.1).
    speed: Wheels | None = field(default=None, metadata={"info": FieldInfo(label="wheel speed as set")})
    encoders: Steps | None = field(default=None, metadata={"info": FieldInfo(label="wheel steps")})
    proximity: Proximity | None = None
    ambient_light: AmbientLight | None = None
    accelerometer: Acceleration | None = None
    attitude: Attitude | None = None
    gyroscope: AngularVelocity | None = None
    magnetometer: MagneticField | None = None
    temperature: Temperature | None = None
    distance: Distance | None = field(default=None, metadata={"info": FieldInfo(label="distance in front")})
    ground: Ground | None = None
    microphones: Microphones | None = None
    battery: Battery | None = None
    selector: Selector | None = None
    button: Button | None = None
    sd_card: SdCard | None = field(default=None, metadata={"info": FieldInfo(label="SD card")})
    ir_receiver: IrCode | None = field(default=None, metadata={"info": FieldInfo(label="IR remote")})


# -- what is known of the fields --

_DESCRIBED: dict[type[Reading], tuple[FieldInfo, ...]] = {}


def describe(kind: type[Reading], *roles: Role) -> tuple[FieldInfo, ...]:
    """Return the facts about the fields of a reading, in order; a property that converts them comes last.

    Args:
        kind: Class of the reading.
        roles: Roles of the wanted fields; all fields are returned if none are given.
    """
    found = _DESCRIBED.get(kind)
    if found is None:
        named = [replace(item.metadata.get("info", FieldInfo()), name=item.name) for item in fields(kind)]
        getters = [getattr(member, "fget", None) for each in kind.__mro__ for member in vars(each).values()]
        physical = [info for getter in getters if isinstance(info := getattr(getter, "info", None), FieldInfo)]
        found = _DESCRIBED[kind] = (*named, *physical[:1])
    return tuple(info for info in found if info.role in roles) if roles else found


def physical_of(kind: type[Reading]) -> FieldInfo | None:
    """Return the property that holds all numbers of a reading in another unit, such as ``g``; None without one."""
    return next(iter(describe(kind, Role.PHYSICAL)), None)


def items(reading: Reading, *roles: Role) -> Iterator[tuple[FieldInfo, str, object]]:
    """Yield each number of a reading, with its field and its name.

    A field with several numbers yields each of them; a number beyond the known names has its index as its name.

    Args:
        reading: The reading.
        roles: Roles of the wanted fields, as for :func:`describe`.
    """
    for info in describe(type(reading), *roles):
        value = getattr(reading, info.name)
        if not info.names:
            yield info, info.name, value
            continue
        for place, number in enumerate(value):
            yield info, info.names[place] if place < len(info.names) else str(place), number


READING_TYPES: Final[Mapping[str, type[Reading]]] = {
    name: get_args(kind)[0] for name, kind in get_type_hints(Sensors).items() if type(None) in get_args(kind)
}
"""The class of each reading that :class:`Sensors` has, by its name."""


def reading_name(kind: type[Reading]) -> str:
    """Return the name of the reading of a class in :class:`Sensors`: ``ambient_light`` for AmbientLight."""
    return next(name for name, each in READING_TYPES.items() if each is kind)
