"""Snapshots: what ``robot.watch()`` gives, the newest readings, each with its own time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING

from elib.base.errors import ArgumentError, ElibError, Unsupported
from elib.link.protocol import values as v
from elib.link.protocol.context import Profile
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode, Quantity
from elib.link.protocol.values import in_words

IMAGE = "image"
SENSORS = tuple(v.READING_TYPES)
"""The readings of :class:`~elib.Sensors`, in its order."""
WATCHABLE = (*SENSORS, IMAGE)

PICTURE_PERIOD = 0.4
"""Shortest time between two pictures, s: a 40 x 40 picture in colour takes 0.28 s of line (wire-protocol.md, 5.14), and
commands and sensors need the line between two pictures."""
STALE_PERIODS = 3
"""Periods after which a reading is stale: a single lost answer does not matter, three in a row do."""


class Readings:
    """Typed attributes for the readings of a snapshot."""

    __slots__ = ()

    if TYPE_CHECKING:
        speed: v.Wheels
        encoders: v.Steps
        proximity: v.Proximity
        ambient_light: v.AmbientLight
        accelerometer: v.Acceleration
        attitude: v.Attitude
        gyroscope: v.AngularVelocity
        magnetometer: v.MagneticField
        temperature: v.Temperature
        distance: v.Distance
        ground: v.Ground
        microphones: v.Microphones
        battery: v.Battery
        selector: v.Selector
        button: v.Button
        sd_card: v.SdCard
        ir_receiver: v.IrCode
        image: Image
    else:

        def __getattr__(self, name: str) -> object:
            if name in WATCHABLE:
                readings = self.readings
                if name in readings:
                    return readings[name]
                raise AttributeError(
                    f"{name} is not watched; this snapshot has {', '.join(readings)}: robot.watch({name!r}, ...)"
                )
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Snapshot(Readings):
    """The newest of each reading that is watched: ``snapshot.proximity``, ``snapshot.image`` and so on.

    Attributes:
        time: When the snapshot was made, s on the clock of the robot's event loop.
        origin: ``robot``, ``simulator`` or ``replay``.
        sequence: Number of the snapshot for this watcher, from 0; dropped snapshots count.
        dropped: Number of snapshots that this watcher has missed so far because it was slow.
        period: Time between two snapshots, s, as asked for.
        readings: The readings by name, each with its own ``.time``, in a dict that no other snapshot shares.
        error: Why the newest answer is missing and an older reading is here; None if there was no error.
    """

    time: float
    origin: str
    sequence: int
    dropped: int
    period: float
    readings: Mapping[str, v.Reading | Image]
    error: ElibError | None = None

    def age(self, name: str, now: float | None = None) -> float:
        """Return how old a reading is, s.

        Args:
            name: Name of the reading.
            now: Time of the robot, s, as in ``robot.time``; the time of the snapshot if None.

        Raises:
            ArgumentError: The reading is not watched.
        """
        try:
            reading = self.readings[name]
        except KeyError:
            raise ArgumentError(
                f"{name!r} is not watched; this snapshot has {', '.join(self.readings)}", hint="name it in watch()"
            ) from None
        return (self.time if now is None else now) - reading.time

    def is_stale(self, name: str, now: float | None = None) -> bool:
        """Return whether a reading is older than three periods, because answers were lost or the link is slow.

        Args:
            name: Name of the reading.
            now: Time of the robot, s; the time of the snapshot if None.

        Raises:
            ArgumentError: The reading is not watched.
        """
        period = max(self.period, PICTURE_PERIOD) if name == IMAGE else self.period
        return self.age(name, now) > STALE_PERIODS * period

    def _repr_html_(self) -> str:
        """Show the snapshot in a notebook."""
        from elib.base.plaintext import html_table  # here: only notebooks need it

        rows = [
            (in_words(name), _cell(reading), f"{self.age(name):.2f} s old" + " (stale)" * self.is_stale(name))
            for name, reading in self.readings.items()
        ]
        return html_table(rows, f"snapshot {self.sequence} at {self.time:.2f} s")


def _cell(reading: v.Reading | Image) -> str:
    """Return a reading as the cell of a table."""
    from elib.base.pictures import as_address
    from elib.base.plaintext import Html

    if isinstance(reading, Image) and reading.mode != CameraMode.YUV:
        return Html(f"<img src='{as_address(reading._repr_png_())}' alt='picture'>")
    return str(reading)


def check_names(names: Iterable[object]) -> tuple[str, ...]:
    """Return each of *names* once, in the order of :data:`WATCHABLE`.

    Raises:
        ArgumentError: A name is not the name of a reading.
    """
    asked = list(names)
    for name in asked:
        if not isinstance(name, str) or name not in WATCHABLE:
            near = get_close_matches(name, WATCHABLE, 1) if isinstance(name, str) else []
            meant = f"did you mean {near[0]!r}?" if near else "one of " + ", ".join(WATCHABLE)
            raise ArgumentError(f"there is no reading {name!r} to watch", hint=meant)
    return tuple(name for name in WATCHABLE if name in asked)


def watched_names(names: Iterable[object], profile: Profile) -> tuple[str, ...]:
    """Return *names* as :func:`check_names` does, or all sensors of the firmware if *names* is empty.

    Raises:
        ArgumentError: A name is not the name of a reading.
        Unsupported: The firmware does not have a reading.
    """
    asked = check_names(names)
    for name in asked:
        reason = profile.absent.get(name)
        if reason is not None:
            raise Unsupported(f"{name} cannot be watched: it does not exist on {profile.name}: {reason}")
    return asked or tuple(name for name in SENSORS if name not in profile.absent)


_RATE = Quantity("rate", "Hz", 0.001, 1000, scale=1)
"""Range of rates, Hz. No link is faster (a text command takes 1.2 ms at 115200 baud, wire-protocol.md, 5.14), and a
period of more than a quarter of an hour is probably a mistake."""


def period_of(rate: object) -> float:
    """Return the seconds between two snapshots at *rate*, Hz.

    Raises:
        ArgumentError: The rate is not a number from 0.001 to 1000.
    """
    return 1 / _RATE.check("rate", rate)
