"""Robot profiles: how one robot differs from the nominal one, as ``elib fit`` finds it and the simulator uses it.

::

    about = "fitted from drive.mcap"

    [wheels]
    left_radius = 0.020534      # m
    right_radius = 0.020471     # m
    axle = 0.05312              # m, between the wheels' contact points

    [link]
    latency = 0.0214            # s, each way
    jitter = 0.0031             # s, standard deviation of that

    [infrared]
    curve = [[0.0, 9000], [0.01, 1630], [0.02, 430], [0.05, 71], [0.12, 0]]    # m to a white wall, counts
    noise = 3.0                 # counts, standard deviation
    gains = [1.0, 0.97, 1.02, 1.0, 1.01, 0.99, 1.0, 1.03]                      # factor of each sensor
    offsets = [210.0, 95.0, 140.0, 180.0, 330.0, 120.0, 90.0, 260.0]           # counts that each reads in the open

Every table may be left out. Its values are then nominal, or those of the world.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import fmean
from typing import Annotated, cast

from elib.base.body import AXLE, WHEEL_DIAMETER
from elib.base.curves import interpolated
from elib.base.files import read_file, write_file
from elib.base.infrared import MAX_LIGHT, response_table, usual_light
from elib.base.rules import Delay, Number, Rule, Several, Text, is_number
from elib.base.tables import MAX_FILE, Table, keys_of, read_toml
from elib.simulator.physics import profiles
from elib.simulator.physics.body import EpuckModel

NOMINAL_RADIUS = WHEEL_DIAMETER / 2
"""m (e-puck.org)."""
MIN_SCALE, MAX_SCALE = 0.8, 1.25
"""Limits of wheels and axle, as factors of the nominal value. Beyond them a robot is not an e-puck, and most likely a
unit is wrong."""
MAX_KNOTS = 1000
MAX_REACH = 0.25
"""m. The infrared sensors of an e-puck do not see further (e-puck.md, 3: 12 cm at most)."""


def _around(nominal: float) -> Number:
    low, high = (round(scale * nominal, 5) for scale in (MIN_SCALE, MAX_SCALE))
    return Number(low, high, "m", example=f"{nominal:g}")


Radius = Annotated[float, _around(NOMINAL_RADIUS)]


@dataclass(frozen=True, slots=True)
class CurveRule(Rule):
    """Distances and readings."""

    def __str__(self) -> str:
        return (
            f"2 to {MAX_KNOTS} pairs of a distance, m, from 0 and rising to {MAX_REACH:g} at most, and a reading,"
            f" 0 to {MAX_LIGHT:g} counts"
        )

    def accept(self, value: object) -> tuple[tuple[float, ...], ...]:
        """Return *value* as a tuple of pairs."""
        if not isinstance(value, list) or not 2 <= len(value) <= MAX_KNOTS or not all(map(_is_pair, value)):
            raise self.refuse(value)
        knots = tuple(tuple(map(float, pair)) for pair in value)
        if knots[0][0] != 0.0 or any(near >= far for (near, _), (far, _) in pairwise(knots)):
            raise self.refuse(value)
        return knots


def _is_pair(pair: object) -> bool:
    if not isinstance(pair, list) or len(pair) != 2 or not all(map(is_number, pair)):
        return False
    return bool(0 <= pair[0] <= MAX_REACH and 0 <= pair[1] <= MAX_LIGHT)


Curve = Annotated[
    tuple[tuple[float, float], ...], CurveRule(example="[[0.0, 9000], [0.01, 1630], [0.03, 190], [0.12, 0]]")
]
Gains = Annotated[
    tuple[float, ...],
    Several(Number(0.1, 10), profiles.COUNT, example="[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]"),
]
Offsets = Annotated[
    tuple[float, ...],
    Several(
        Number(0, profiles.FULL_SCALE, "counts"), profiles.COUNT, example="[200, 200, 200, 200, 200, 200, 200, 200]"
    ),
]


@dataclass(frozen=True, slots=True)
class Wheels:
    """How the robot rolls.

    Attributes:
        left_radius: Radius of the left wheel, m.
        right_radius: Radius of the right wheel, m.
        axle: Distance between the wheels' contact points, m.
    """

    left_radius: Radius = NOMINAL_RADIUS
    right_radius: Radius = NOMINAL_RADIUS
    axle: Annotated[float, _around(AXLE)] = AXLE


@dataclass(frozen=True, slots=True)
class LinkDelay:
    """The delay of the robot's link.

    Attributes:
        latency: Delay each way, s.
        jitter: Standard deviation of that delay, s.
    """

    latency: Delay
    jitter: Delay = 0.0


@dataclass(frozen=True, slots=True)
class Infrared:
    """How the robot's infrared sensors respond to a white flat surface straight ahead.

    Attributes:
        curve: Light, counts, at distances, m, that begin at 0 and rise. Between them the curve is straight, beyond
            the last one it is constant. What is more than the room's light saturates the sensor.
        noise: Standard deviation of a reading, counts.
        gains: Factor of each sensor on the curve, clockwise from the front right one.
        offsets: What each sensor reads in the open, counts, in the same order.
    """

    curve: Curve
    noise: Annotated[float, Number(0, 500, "counts")] = 3.0
    gains: Gains = (1.0,) * profiles.COUNT
    offsets: Offsets = (0.0,) * profiles.COUNT

    def counts(self, distance: float) -> float:
        """Return the light at a distance, m, in counts."""
        return interpolated(self.curve, distance)

    def response(self, world: str | profiles.Profile) -> profiles.Profile:
        """Return the curve as the physics takes it, for sensors that look as widely as those of a *world*'s profile."""
        counts = response_table(self.curve[-1][0], self.counts)
        aperture = profiles.profile(world).aperture
        return profiles.Profile("fitted", counts, (self.noise,) * len(counts), "a robot profile", aperture)


@dataclass(frozen=True, slots=True)
class RobotProfile:
    """One robot as a file describes it.

    Attributes:
        about: Where the profile comes from.
        wheels: How it rolls, or None for nominal wheels.
        link: The delay of its link, or None.
        infrared: How its infrared sensors respond, or None for those of the world.
    """

    about: Annotated[str, Text(example='"my robot"', otherwise="nothing")] = ""
    wheels: Wheels | None = None
    link: LinkDelay | None = None
    infrared: Infrared | None = None

    @property
    def infrared_gains(self) -> tuple[float, ...] | None:
        """Factor of each infrared sensor on the usual light, from 1 to 5 cm; None if it was not fitted."""
        if self.infrared is None:
            return None
        level = fmean(self.infrared.counts(each) / usual_light(each) for each in (0.01, 0.02, 0.03, 0.04, 0.05))
        return tuple(level * gain for gain in self.infrared.gains)

    def model(self, model: EpuckModel) -> EpuckModel:
        """Return a world's *model* with what this profile says of all its robots.

        The profile replaces the quality and the spread between robots, since it describes one of them.
        """
        model = replace(model, quality="ideal", wheel_spread=0.0, axle_spread=0.0, gain_spread=0.0, offset_spread=0.0)
        if self.infrared is None:
            return model
        return replace(model, profile=self.infrared.response(model.profile))


def _table(name: str, makes: type, meaning: str) -> Table:
    return Table(name, meaning, makes, keys_of(makes), is_array=False)


TOP = _table("", RobotProfile, "What stands at the top of the file.")
TABLES = (
    _table("wheels", Wheels, "How the robot rolls. The nominal robot without it."),
    _table(
        "link", LinkDelay, "How long the link takes. A `latency` or `jitter` of the URL that is not 0 overrides it."
    ),
    _table(
        "infrared",
        Infrared,
        "How the infrared sensors respond to a white flat surface straight ahead. As the world has it without it.",
    ),
)
"""In the order of the reference page."""


def load_profile(path: str) -> RobotProfile:
    """Read a profile.

    Args:
        path: Path of its file.

    Raises:
        ArgumentError: The file cannot be read.
        SimulationError: The file breaks a rule; the message names the file, the line, the key and a cure.
    """
    hint = "check its path; elib fit RECORDING -o FILE writes one"
    return parse(read_file(path, "the robot profile", largest=MAX_FILE, hint=hint), path)


def parse(content: bytes, filename: str) -> RobotProfile:
    """Return the profile that *content*, TOML in UTF-8, describes; *filename* is for messages.

    Raises:
        SimulationError: *content* breaks a rule.
    """
    source, document = read_toml(content, filename, "a robot profile")
    parts = source.read_all(document, TOP, TABLES)
    found = {table.name: parts[table.name][0] for table in TABLES if parts[table.name]}
    return replace(cast("RobotProfile", parts[""][0]), **found)  # type: ignore[arg-type]


def written(profile: RobotProfile) -> str:
    """Return *profile* as the text of its file, with enough digits to read the same values again."""
    lines = []
    if profile.about:
        about = profile.about.replace("\\", "\\\\").replace('"', '\\"')
        lines.append(f'about = "{about}"')
    if profile.wheels is not None:
        wheels = profile.wheels
        lines += ["", "[wheels]", *(f"{name} = {_exact(getattr(wheels, name))}  # m" for name in Wheels.__slots__)]
    if profile.link is not None:
        lines += ["", "[link]", f"latency = {_exact(profile.link.latency)}  # s, each way"]
        lines.append(f"jitter = {_exact(profile.link.jitter)}  # s, standard deviation of that")
    if profile.infrared is not None:
        infrared = profile.infrared
        lines += ["", "[infrared]", "curve = [  # m to a white wall, counts"]
        lines += [f"  [{_exact(distance)}, {_exact(counts)}]," for distance, counts in infrared.curve]
        lines += ["]", f"noise = {_exact(infrared.noise)}  # counts, standard deviation"]
        lines += [f"{name} = [{', '.join(map(_exact, getattr(infrared, name)))}]" for name in ("gains", "offsets")]
    return "\n".join(lines).lstrip("\n") + "\n"


def _exact(value: float) -> str:
    return repr(float(value))


def write(profile: RobotProfile, path: str | os.PathLike[str]) -> None:
    """Write *profile* into a file; an existing one is replaced, whole or not at all.

    Raises:
        ArgumentError: The file cannot be written there.
        ElibError: The disk is full.
    """
    write_file(path, written(profile).encode())
