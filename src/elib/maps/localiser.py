"""Where a robot is on a map: many guesses (particles), which move as its wheels did and die where its readings fail."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from elib.base.body import (
    AXLE,
    AXLE_SPREAD,
    GROUND_SENSORS,
    LENS,
    RADIUS,
    SENSOR_DIRECTIONS,
    SENSOR_RADIUS,
    WHEEL_SPREAD,
)
from elib.base.errors import ArgumentError
from elib.base.infrared import LIGHT, MIN_COUNT, NINE_IN_TEN, REACH, SETBACK, wall_distance
from elib.base.pose import Pose, apart
from elib.maps.grid import Grid, check_grid

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from elib.link.protocol.tags import Tag

    Floats = NDArray[np.float64]
    Indices = NDArray[np.intp]

BINS: Final = 72
"""Directions in which the readings on the map are calculated beforehand: every 5 degrees."""
FAN: Final = ((0, 0.5), (6, 0.25), (-6, 0.25))
"""What a sensor sees: directions from its axis, in bins, and their shares of the light; 30 degrees to each side, as in
the simulator (elib.simulator.physics.profiles)."""
DIRECTIONS: Final = np.array(SENSOR_DIRECTIONS, np.float32)[:, None]
AHEAD, BESIDE = np.cos(DIRECTIONS), np.sin(DIRECTIONS)
"""Where the sensors look, rad, as a column, and the parts of that ahead and to the left."""
FARTHEST: Final = wall_distance(MIN_COUNT)
"""m. What is farther is not seen."""
NOISE, WRONG = 0.004, 0.12
"""m, and part of a distance, by which it differs from that on the map: squares, gains (measured-robots:
infrared.distance_8_sensors) and the open air."""
STRAY: Final = 0.1
"""Share of readings that have nothing to do with the map: things that it does not have, glitches."""
MISTAKEN: Final = 0.01
"""Share of tags and looks at the floor that are mistaken. Chosen."""
UNKNOWN: Final = 0.9
"""How well what is read on unknown ground fits: nearly as well as what is right."""
TRUST: Final = 0.12
"""Weight of the eight readings of one place: the errors of gains come again at the next. With 0.15 one place beat
another that looked alike by 300 to 1 in 40 cm, only because it fitted wrong gains a little better."""
HEDGE: Final = 0.6
"""Power of a guess's weight that says how often it is drawn again; the rest of the weight it keeps. So a place that
seems unlikely now is still among the guesses when the readings speak for it."""
DARK: Final = 0.8
"""Part of the most that a ground sensor has read, below which it is over something dark: over black, 95 in 100 read 0.6
of what they read over white (measured-robots: ground.thirty_robots), and pale floors 0.9."""
SAME, SAME_TURN = 0.005, 0.02
"""m and rad by which a place stays wrong, however often the robot looks: gains do not change."""
STRIDE, TURN = 0.005, math.radians(3)
"""m driven or rad turned from one look to the next: the same reading again says nothing new."""
BEND: Final = math.sqrt(2) * WHEEL_SPREAD / AXLE
"""rad/m by which robots turn while they should drive straight, as a standard deviation."""
ROLL: Final = math.hypot(AXLE_SPREAD, WHEEL_SPREAD / math.sqrt(2))
"""Part of a turn by which they turn too far."""
SLIP, SKID = 0.02, 0.03
"""Part of a way, and of a turn, that is lost or won by chance, of a step of 1 cm or 10 degrees."""
MAX_GUESSES, MIN_GUESSES, PER_PLACE = 8_000, 300, 15
"""Guesses where nothing is known, at least, and for each place of 5 cm and 15 degrees that still has some."""
FIRST_LOOKS, CANDIDATES, DRAWN = 10, 60_000, 2_000
"""The first looks each try so many places, and draw so many guesses from those that fit. Of guesses that are spread
evenly, one in 60,000 is within 1 cm and 4 degrees of the robot, in the maze: after a metre none would be left."""
TOGETHER: Final = 4_000
"""Guesses that are weighed together: what that takes in between stays in the processor's cache, twice as fast."""
TELLING: Final = 0.04
"""m from something at which a look tells enough to draw guesses by it."""
SOUND: Final = 0.75
"""Mean fit of the readings, 0 to 1, below which the robot is lost. Where it should be it has 0.8."""
MEMORY: Final = 0.1
"""Weight of a look in the mean fit: after 10 looks, 5 cm, they count."""
NEAR, ASIDE = 0.06, math.radians(30)
"""m and rad from the likeliest place within which guesses are for the same one."""
WIDEST, APART = 0.25, 0.1
"""m from the likeliest place to which guesses for it are looked for if they lie that wide, as after a way in the open;
and share of all guesses from which on: fewer are spread over the map."""
SURE, SETTLED = 0.95, 0.35
"""Share of the guesses in one place from which it is believed, and m that the robot must have driven since."""
FITTING, KNOWN = 0.85, 0.03
"""Mean fit of the readings all along those, and uncertainty, m, from which a place is believed that was not before:
single readings tell places apart that look alike, and along a corridor none does."""
DOUBT: Final = np.array((0.015, 0.015, 0.05))
"""m, m and rad by which the guesses are spread once more, while they settle: those that were left of a search of the
whole map may all be some centimetres off, along a corridor, and yet be close together."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """Where a robot probably is.

    Attributes:
        pose: The likeliest place, with ``uncertainty`` and ``heading_uncertainty``: 19 times in 20 it is nearer, if
            the place is the right one.
        share: How much speaks for that place rather than for others, 0 to 1.
        fit: How well the last readings fit the map there, 0 to 1.
        is_sure: Whether to believe it: 95 % of the guesses are there, for 35 cm already, and what the robot reads fits.
    """

    pose: Pose
    share: float
    fit: float
    is_sure: bool


class Localiser:
    """Finds a robot on a map, and notices when it was put elsewhere.

    Wheels tell how the robot moved, infrared sensors what is near. Each guess has its own wheels: how much they differ
    is learned on the way.

    Args:
        map: The map. What is added to it later is seen by :meth:`renew`.
        pose: Where the robot is on the map, with its uncertainty; None if that is not known.
        seed: Seed of its random numbers.
        is_carried: Whether it may be put elsewhere. False keeps the guesses together while the map itself is drawn.

    Attributes:
        nearer: Share of the readings that are nearer than the map says: what stands there and is not on it.

    Example:
        >>> grid = elib.Grid.of_world("maze")
        >>> localiser = elib.Localiser(grid, elib.Pose(0.1, 0.1, math.pi / 2))
        >>> with elib.connect("sim://maze?speed=max") as robot:
        ...     for _ in range(10):
        ...         robot.drive(0.01)
        ...         estimate = localiser.update(robot.pose(), robot.distances())
        >>> round(estimate.pose.y, 1), estimate.is_sure
        (0.2, True)
    """

    def __init__(self, map: Grid, pose: Pose | None = None, *, seed: int = 0, is_carried: bool = True) -> None:  # noqa: A002
        check_grid(map)
        self.map = map
        self.nearer = STRAY
        self._random = np.random.default_rng(seed)
        self._is_carried = is_carried
        self._at: Pose | None = None
        self._moved = self._turned = 0.0
        self._settled = 0.0 if pose is None else math.inf
        self._fit, self._to_draw = 1.0, 0
        self._is_sure = False
        self._is_doubted = pose is not None
        self._palest = 0.0
        self.renew()
        if pose is None:
            self._forget()
        else:
            self._guesses = self._around(pose, MIN_GUESSES)
            if is_carried and self._is_nowhere():
                raise ArgumentError(
                    f"the robot's place ({pose.x:.2f}, {pose.y:.2f}) m is not on the map, or something stands there",
                    hint="poses are in the coordinates of the map; without one the robot is looked for",
                )
            self._weights = np.full(MIN_GUESSES, 1 / MIN_GUESSES)
        self.estimate = self._judge()

    def _is_nowhere(self) -> bool:
        """Return whether all guesses are off the map, or where something stands."""
        at = np.rint((self._guesses[:, 1::-1] - (self._y, self._x)) / self.map.cell).astype(int)
        is_on = ((at >= 0) & (at < self.map.odds.shape)).all(1)
        return bool(self.map.occupied[tuple(at[is_on].T)].all())

    @property
    def is_lost(self) -> bool:
        """Whether the robot is not known to be anywhere, or its readings do not fit to where it should be."""
        return not self.estimate.is_sure

    def renew(self) -> None:
        """Take the map as it is now."""
        self._far = np.pad(expected(self.map), ((0, 0), (1, 1), (1, 1)), constant_values=math.nan)
        self._clear = self.map.clearance(RADIUS + self.map.cell)
        self._x, self._y = self.map.x, self.map.y  # those of a map that grows change

    def turn_to(self, heading: float, deviation: float) -> None:
        """Take into account that something else tells the heading, rad: a compass, or a wall whose direction is known.

        Args:
            heading: In the coordinates of the map.
            deviation: Its standard deviation.
        """
        off = wrapped(self._guesses[:, 2] - heading)
        self._weights *= np.exp(-0.5 * np.minimum((off / deviation) ** 2, 50.0))
        self._weights /= self._weights.sum()
        self.estimate = self._judge()

    @property
    def wheels(self) -> Floats:
        """What it has learned of the robot's wheels, guess by guess: for the next localiser of the same robot."""
        return self._random.choice(self._guesses[:, 3:], MIN_GUESSES, p=self._weights)

    @wheels.setter
    def wheels(self, known: Floats) -> None:
        self._guesses[:, 3:] = self._random.choice(known, len(self._guesses))

    def see_tag(self, tag: Tag, x: float, y: float) -> Estimate:
        """Take a tag into account whose place is known. A robot that is lost is looked for where it would see it so.

        Args:
            tag: One of ``robot.tags()``.
            x: Where that tag is on the map, m.
            y: The same.
        """
        far, aside = tag.distance_error / NINE_IN_TEN, tag.bearing_error / NINE_IN_TEN
        if self._to_draw == FIRST_LOOKS:
            guesses = self._anywhere(MAX_GUESSES)
            towards = guesses[:, 2]
            gap = tag.distance + far * self._random.standard_normal(MAX_GUESSES)
            heading = towards - tag.bearing - aside * self._random.standard_normal(MAX_GUESSES)
            guesses[:, 0] = x - gap * np.cos(towards) - LENS * np.cos(heading)
            guesses[:, 1] = y - gap * np.sin(towards) - LENS * np.sin(heading)
            guesses[:, 2] = heading
            self._guesses = guesses[self._has_room(guesses)]
            self._weights = np.full(len(self._guesses), 1 / max(1, len(self._guesses)))
            self._to_draw = 0
            if not len(self._guesses):
                self._forget()
        else:
            at_x, at_y, heading = self._guesses.T[:3]
            right, up = x - at_x - LENS * np.cos(heading), y - at_y - LENS * np.sin(heading)
            off = np.hypot(right, up) - tag.distance
            turned = wrapped(np.arctan2(up, right) - heading - tag.bearing)
            self._weigh(np.hypot(off / far, turned / aside))
        self.estimate = self._judge()
        return self.estimate

    def see_floor(self, ground: Sequence[float]) -> Estimate:
        """Take the ground sensors into account, on a map that says where the floor is dark (``Grid.dark``).

        Args:
            ground: ``robot.ground()``.
        """
        self._palest = max(self._palest, *ground[:3])
        if self.map.dark is not None and self._to_draw != FIRST_LOOKS and self._moved == self._turned == 0:
            x, y, heading = self._guesses.T[:3]
            wrong = np.zeros(len(x))
            for count, (ahead, left) in zip(ground, GROUND_SENSORS[:3], strict=False):
                row, column = self._squares(
                    x + ahead * np.cos(heading) - left * np.sin(heading),
                    y + ahead * np.sin(heading) + left * np.cos(heading),
                )
                wrong += self.map.dark[row, column] != (count < DARK * self._palest)
            self._weigh(wrong)
            self.estimate = self._judge()
        return self.estimate

    def _weigh(self, off: Floats) -> None:
        """Weigh the guesses by how far they are off, in standard deviations; what is far off may be a mistake."""
        self._weights *= MISTAKEN + (1 - MISTAKEN) * np.exp(-0.5 * off * off)
        self._weights /= self._weights.sum()
        if 1 / (self._weights @ self._weights) < len(self._weights) / 2:
            self._draw()

    # -- what moves and what is seen -----------------------------------------------------------------------------------

    def update(self, pose: Pose, distances: Sequence[float] | None) -> Estimate:
        """Take a reading into account, and return where the robot is.

        Args:
            pose: ``robot.pose()``: only how it changed since the last call counts, so odometry may begin anywhere.
            distances: ``robot.distances()``, with nan for those that say nothing, such as what sees another robot; None
                if nothing was read.
        """
        if self._at is not None:
            self._move(self._at, pose)
        is_first, self._at = self._at is None, pose
        if distances is not None and (is_first or self._moved >= STRIDE or self._turned >= TURN):
            self._moved = self._turned = 0.0
            self._look(np.minimum(np.asarray(tuple(distances), float), FARTHEST))
        self.estimate = self._judge()
        return self.estimate

    def _move(self, before: Pose, now: Pose) -> None:
        """Let the guesses move as the wheels did, each with its own wheels and some slip."""
        way, turn = apart(before, now), math.remainder(now.heading - before.heading, math.tau)
        if way == 0 and turn == 0:
            return
        aside = math.atan2(now.y - before.y, now.x - before.x) - before.heading
        self._moved, self._turned = self._moved + way, self._turned + abs(turn)
        self._settled += way
        x, y, heading, bend, roll = self._guesses.T
        forward = math.copysign(way, math.cos(aside))
        slip = self._random.standard_normal((2, len(x)))
        far = forward + SLIP * math.sqrt(0.01 * way) * slip[0]
        by = turn * roll + bend * forward
        by += (SKID * math.sqrt(abs(turn) * 0.17) + BEND * math.sqrt(0.01 * way)) * slip[1]
        middle = heading + by / 2
        x += far * np.cos(middle)
        y += far * np.sin(middle)
        heading += by

    def _look(self, seen: Floats) -> None:
        """Weigh the guesses by a reading."""
        if self._to_draw:
            if np.nanmin(seen, initial=math.inf) < TELLING:
                self._add(seen)
            return
        found = self._likelihoods(seen, self._guesses, self._coarseness)
        self._weights *= found ** (TRUST * len(seen))
        whole = self._weights.sum()
        if whole > 0:
            self._weights /= whole
            self._fit += MEMORY * (float(found @ self._weights) - self._fit)
        if whole <= 0 or (self._is_carried and self._fit < SOUND):
            self._forget()
        elif 1 / (self._weights @ self._weights) < len(self._weights) / 2:
            self._draw()
        if self._settled > SETTLED / 2 and not self._is_doubted:
            self._is_doubted = True
            self._guesses[:, :3] += DOUBT * self._random.standard_normal((len(self._guesses), 3))

    def _likelihoods(self, seen: Floats, guesses: Floats, coarseness: float) -> Floats:
        """Return for each guess how well a look fits, 0 to 1: the geometric mean of its eight distances."""
        if len(guesses) > TOGETHER:
            parts = (guesses[first : first + TOGETHER] for first in range(0, len(guesses), TOGETHER))
            return np.concatenate([self._likelihoods(seen, part, coarseness) for part in parts])
        told = np.nonzero(~np.isnan(seen))[0]
        far = self._expected(guesses)[told]
        off = (seen[told, None].astype(np.float32) - far) / ((NOISE + WRONG * far) * (1 + coarseness))
        stray = np.where(off < 0, np.float32(self.nearer), np.float32(STRAY))
        fits = stray + (1 - stray) * np.exp(-0.5 * off * off)
        fits[np.isnan(far)] = UNKNOWN
        is_standing = self._has_room(guesses)
        found: Floats = np.where(is_standing, fits.prod(0) ** (1 / len(seen)), STRAY)
        return found

    def _has_room(self, guesses: Floats) -> NDArray[np.bool_]:
        """Return at which places a robot has room."""
        found: NDArray[np.bool_] = self._clear[self._squares(*guesses.T[:2])] >= RADIUS - self.map.cell
        return found

    def _squares(self, x: Floats, y: Floats) -> tuple[Indices, Indices]:
        """Return rows and columns of places; those of the nearest squares outside of the map."""
        row, column = np.rint((y - self._y) / self.map.cell), np.rint((x - self._x) / self.map.cell)
        rows, columns = self._clear.shape
        return np.clip(row, 0, rows - 1).astype(np.intp), np.clip(column, 0, columns - 1).astype(np.intp)

    def expected(self, pose: Pose) -> Floats:
        """Return the eight distances that the map tells of a pose, m, at most 5.7 cm; nan where it is unknown."""
        return self._expected(np.array([[pose.x, pose.y, pose.heading]]))[:, 0].astype(np.float64)

    def _expected(self, places: Floats) -> NDArray[np.float32]:
        """Return what each sensor, by rows, would read at each place, by columns; with half the digits, for speed."""
        x, y, heading = places.T[:3].astype(np.float32, order="C")
        cosine, sine = np.cos(heading), np.sin(heading)
        cosines, sines = AHEAD * cosine - BESIDE * sine, AHEAD * sine + BESIDE * cosine
        _, rows, columns = self._far.shape
        across = (x - self._x) / self.map.cell + 1 + SENSOR_RADIUS / self.map.cell * cosines
        up = (y - self._y) / self.map.cell + 1 + SENSOR_RADIUS / self.map.cell * sines
        row, column = np.clip(np.rint(up), 0, rows - 1), np.clip(np.rint(across), 0, columns - 1)
        sector = np.rint((heading + DIRECTIONS) * (BINS / math.tau))
        sector -= BINS * np.floor(sector / BINS)
        far = self._far.take(
            (sector.astype(np.int32) * rows + row.astype(np.int32)) * columns + column.astype(np.int32)
        )
        # From the place of the sensor instead of the middle of its square.
        far -= self.map.cell * ((across - column) * cosines + (up - row) * sines)
        found: NDArray[np.float32] = np.clip(far, 0, FARTHEST)
        return found

    @property
    def _coarseness(self) -> float:
        """How far apart the guesses are, 0 to 1: many are spread widely, and none is exactly right."""
        return min(1.0, math.sqrt(len(self._weights) / MAX_GUESSES)) if len(self._weights) > 4 * MIN_GUESSES else 0.0

    # -- guesses -------------------------------------------------------------------------------------------------------

    def _around(self, pose: Pose, count: int) -> Floats:
        """Return guesses near a pose."""
        wide = max(pose.uncertainty / 2, 0.003), max(pose.heading_uncertainty / 2, 0.02)
        spread = np.array((wide[0], wide[0], wide[1], BEND, ROLL))
        middle = np.array((pose.x, pose.y, pose.heading, 0.0, 1.0))
        return middle + spread * self._random.standard_normal((count, 5))

    def _anywhere(self, count: int) -> Floats:
        """Return guesses wherever the robot can be."""
        rows, columns = np.nonzero((self._clear >= RADIUS) & self.map.free)
        if not len(rows):
            raise ArgumentError(
                "the map has no place where a robot has room", hint="make a map first: grid.add(), elib.Grid.of_world()"
            )
        chosen = self._random.integers(len(rows), size=count)
        guesses = self._around(Pose(0.0, 0.0), count)
        inside = self._random.uniform(-0.5, 0.5, (2, count))
        guesses[:, 0] = self._x + self.map.cell * (columns[chosen] + inside[0])
        guesses[:, 1] = self._y + self.map.cell * (rows[chosen] + inside[1])
        guesses[:, 2] = self._random.uniform(-math.pi, math.pi, count)
        return guesses

    def _forget(self) -> None:
        """Forget where the robot is: the next looks that tell something draw the guesses."""
        self._guesses = self._anywhere(MIN_GUESSES)
        self._weights = np.full(MIN_GUESSES, 1 / MIN_GUESSES)
        self._fit, self._to_draw = 1.0, FIRST_LOOKS
        self._is_doubted = False

    def _add(self, seen: Floats) -> None:
        """Draw guesses by one look: each knows that look alone, so those of all looks have the same weight."""
        places = self._anywhere(CANDIDATES)
        fits = np.cumsum(self._likelihoods(seen, places, 1.0) ** len(seen))
        chosen = np.searchsorted(fits, self._random.uniform(0, fits[-1], DRAWN))
        drawn = places[np.minimum(chosen, CANDIDATES - 1)]
        self._guesses = drawn if self._to_draw == FIRST_LOOKS else np.concatenate((self._guesses, drawn))
        self._weights = np.full(len(self._guesses), 1 / len(self._guesses))
        self._to_draw -= 1

    def _draw(self) -> None:
        """Draw the guesses again, the likelier the more often; fewer, the fewer places they are for."""
        heads = np.floor(self._guesses[:, :3] / (0.05, 0.05, math.radians(15))).astype(np.int64)
        often = self._weights**HEDGE
        often /= often.sum()
        places = len(np.unique(heads[often * len(heads) > 0.1] @ (1, 1_000, 1_000_000)))
        count = min(max(MIN_GUESSES, PER_PLACE * places), MAX_GUESSES)
        points = (self._random.uniform() + np.arange(count)) / count
        chosen = np.minimum(np.searchsorted(np.cumsum(often), points), len(often) - 1)
        self._guesses, kept = self._guesses[chosen], self._weights[chosen] / often[chosen]
        jitter = np.array((0.001, 0.001, 0.01, BEND / 20, ROLL / 20)) * (1 + 5 * self._coarseness)
        self._guesses += jitter * self._random.standard_normal((count, 5))
        self._weights = kept / kept.sum()

    def _judge(self) -> Estimate:
        """Return the likeliest place: the heaviest square of 6 cm and 30 degrees, and what belongs to it around it."""
        x, y, heading = np.ascontiguousarray(self._guesses.T[:3])
        squares = [np.rint((each - each.min()) / NEAR).astype(np.intp) for each in (x, y)]
        sectors = np.rint(heading / ASIDE).astype(np.intp) % round(math.tau / ASIDE)
        of = (squares[0] * (squares[1].max() + 1) + squares[1]) * round(math.tau / ASIDE) + sectors
        best = of == np.argmax(np.bincount(of, self._weights))

        def around() -> tuple[float, float, float, Floats, Floats]:
            weights, there = self._weights[best], heading[best]
            whole = weights.sum()
            at_x, at_y = float(weights @ x[best] / whole), float(weights @ y[best] / whole)
            angle = math.atan2(weights @ np.sin(there), weights @ np.cos(there))
            return at_x, at_y, angle, np.hypot(x - at_x, y - at_y), wrapped(heading - angle)

        *_, away, off = around()
        reach, near = NEAR, 0.0
        while True:
            best = (away < reach) & (np.abs(off) < ASIDE)
            weights = self._weights[best]
            share = float(weights.sum())
            near = near or share
            at_x, at_y, angle, away, off = around()
            wide = math.sqrt(weights @ away[best] ** 2 / share)
            if 3 * wide <= reach or reach == WIDEST or share < APART:
                break
            reach = min(3 * wide, WIDEST)  # one place that is known badly, not one of several
        pose = Pose(
            at_x,
            at_y,
            angle,
            time=self._at.time if self._at else math.nan,
            uncertainty=2 * math.hypot(wide, SAME),
            heading_uncertainty=2 * math.sqrt(weights @ off[best] ** 2 / share + SAME_TURN**2),
        )
        if near <= SURE or self._fit <= (SOUND if self._is_sure else FITTING):
            self._settled = 0.0
        self._is_sure = self._settled >= SETTLED and (self._is_sure or pose.uncertainty < KNOWN)
        return Estimate(pose, share, self._fit, self._is_sure)


def wrapped(angle: Floats) -> Floats:
    """Return angles between minus and plus half a turn; five times as fast as a remainder."""
    return angle - math.tau * np.rint(angle / math.tau)


def expected(grid: Grid) -> NDArray[np.float32]:
    """Return what a sensor reads on a map, m: by its direction, and the row and column of its place.

    It is nan where unknown ground lies before whatever is there.
    """
    step = grid.cell / 2
    reach = math.ceil(REACH / grid.cell)
    padded = np.pad(grid.occupied, reach)
    unknown = np.pad(grid.unknown, reach, constant_values=True)
    rows, columns = grid.odds.shape
    light = np.zeros((BINS, rows, columns), np.float32)
    for direction in range(BINS):
        cosine, sine = math.cos(direction * math.tau / BINS), math.sin(direction * math.tau / BINS)
        bright = np.zeros((rows, columns), np.float32)
        for k in range(int(REACH / step), -1, -1):
            up, aside = round(k * step * sine / grid.cell), round(k * step * cosine / grid.cell)
            part = np.s_[reach + up : reach + up + rows, reach + aside : reach + aside + columns]
            bright[padded[part]] = LIGHT / (k * step + SETBACK) ** 2
            if k * step <= FARTHEST:
                bright[unknown[part]] = np.nan
        light[direction] = bright
    mixed = sum(share * np.roll(light, -by, axis=0) for by, share in FAN)
    with np.errstate(divide="ignore"):
        return np.minimum(np.sqrt(LIGHT / mixed) - SETBACK, 2 * FARTHEST).astype(np.float32)
