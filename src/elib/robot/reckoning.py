"""Dead reckoning: the path of a robot from the speeds that it took, fitted to its step counters. No I/O, no clock.

The wheels turn evenly between two changes of their speed, so each piece of the path is an arc. What is not known
exactly is when a change took effect: some time between the sending of the command and its answer. So the moments of the
changes are moved, as little as needed, until each wheel has made the steps that were counted (least squares). A command
without an answer was done or was not done; the explanation that fits the counters is taken. Speed and time also say how
often a counter has wrapped. What no explanation fits is stated as uncertainty of the pose.

No robot has nominal wheels. How much the pose changes with the radius of each wheel and with the axle is followed along
the path, and the spread of these between real robots is stated as uncertainty, too.
"""

from __future__ import annotations

import itertools
import math
from bisect import insort
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from elib.base.body import AXLE, AXLE_SPREAD, FASTEST_2, METRES_PER_STEP, WHEEL_SPREAD, wrapped
from elib.base.pose import Pose, advanced, apart

FASTEST = 1.1 * FASTEST_2
"""steps/s that no wheel exceeds (e-puck.md, 1)."""
TOLERANCE, DRIFT = 60.0, 0.005
"""Steps, and part of the way, by which a counter may differ from what its wheel was told: 60 ms at full speed."""
LOST_STEPS = 1.0
"""Steps that a wheel may lose or win at each change of its speed: the motor's timer goes on (wire-protocol.md, 5.1)."""
SLACK = 1.0
"""Steps by which a counter differs from its wheel's even turning, as a standard deviation."""
EXACT = 0.01
"""Steps by which counters are wrong from one reading to the next: the part of a step is made up by the next reading."""
STEP = METRES_PER_STEP / AXLE
"""rad: the heading is never known better than to a step of one wheel."""
PUNCTUAL = 0.005
"""s by which the way of most commands to the robot differs; a few come much later."""
MAX_FITS = 10
"""How often the moments are fitted, each time without those that reached a limit."""
UNLIKELY = 25.0
"""Cost of an explanation beyond that of the best, from which it is out of the question: five standard deviations."""
MAX_CHANGES = 1000
"""Changes between two readings, above which neighbours are joined into one with their mean speed."""
MAX_UNSURE = 4
"""Commands without an answer, above which the oldest counts as done: each one doubles the explanations to compare."""
MAX_BEND, MAX_BENDS = 0.5, 64
"""rad of a turn in one part of an arc, and parts of an arc, in which the lean of a pose is followed."""
MAX_RESTARTS = 20
"""Changes before a reading between which a restart is looked for that no greeting showed."""

Pair = tuple[float, float]
Lean = tuple[float, float, float]
"""How x, y, m, and the heading, rad, change with the part by which a wheel or the axle exceeds the nominal one."""
LEVEL: Lean = (0.0, 0.0, 0.0)
STILL: Pair = (0.0, 0.0)
UNKNOWN: Pair = (math.nan, math.nan)


class Moment(NamedTuple):
    """When something happened at the robot, s: probably *at*, surely between *began* and *ended*."""

    began: float
    at: float
    ended: float

    @property
    def variance(self) -> float:
        """Mean square of the time's distance from *at*, s2: any time between is as likely."""
        before, after = self.at - self.began, self.ended - self.at
        return (before**3 + after**3) / (3 * (before + after)) if before + after > 0 else 0.0


@dataclass(frozen=True, slots=True)
class Change:
    """What happened to the wheels or to their counters."""

    when: Moment  # when the robot did it
    speeds: Pair | None = None  # speeds from then on, left and right, steps/s; nan if unknown, None as before
    counters: Pair | None = None  # what the step counters were set to; nan if unknown, None if they were left alone
    is_sure: bool = True  # whether it was confirmed


@dataclass(frozen=True, slots=True)
class Explanation:
    """The path between two readings as some changes make it."""

    fits: bool  # whether it makes the steps that were counted
    cost: float  # how improbable it is; the least is the best
    pose: Pose  # where the path ends, with its uncertainty for a robot with nominal wheels
    swing: Pair  # how that of the place hangs together with that of the heading
    steps: tuple[int, int]  # what each wheel made
    speeds: Pair  # speeds at the end
    read_at: float  # when the counters were read, as it fits best
    pieces: Sequence[Sequence[float]] = ()  # steps of both wheels in each piece of the path


class Reckoning:
    """The pose of a robot, from changes of its wheels' speeds and readings of their counters, both in order of time.

    Args:
        pose: Where it is at the beginning; its wheels stand.
        time: When that is, s.

    Attributes:
        left: Steps of the left wheel since the beginning, backwards negative.
        right: Steps of the right wheel since the beginning, backwards negative.
    """

    # relative standard deviations, around nominal, of a robot's left wheel, right wheel and axle. Where they have been
    # measured, smaller ones can be set.
    spreads = WHEEL_SPREAD, WHEEL_SPREAD, AXLE_SPREAD

    def __init__(self, pose: Pose, time: float) -> None:
        self.pose = pose  # where it was at the last reading, with the time and the uncertainty
        self.left = self.right = 0
        self.restarts = 0  # how often the counters told that the robot had restarted
        self.startup = 0.0  # time from a restart until it answers, most likely, s
        self._start = Change(Moment(time, time, time), STILL, UNKNOWN)
        self._changes: list[Change] = []
        self._count = 0
        self._swing: Pair = (0.0, 0.0)
        """Covariance of x and y with the heading, m rad, of :attr:`_nominal`, in squares of its uncertainties."""
        self._leans = [LEVEL] * len(self.spreads)
        self._reckoned = self._nominal = pose
        """The last pose, and the same with the uncertainty that it has for a robot with nominal wheels."""

    def change(self, change: Change) -> None:
        """Take a change into account; it may have come before others that are known already, not before a reading."""
        last = self._changes[-1] if self._changes else self._start
        if change.speeds == last.speeds and change.counters is None and last.is_sure and change.is_sure:
            return
        began, at, ended = change.when
        at = max(at, self._start.when.at)
        change = replace(change, when=Moment(min(began, at), at, max(at, ended)))
        if change.counters is not None and change.is_sure:  # what they were set to before was never read
            before = [each for each in self._changes if each.when.at <= at]
            kept = [replace(each, counters=None) for each in before if each.speeds is not None]
            self._changes[: len(before)] = kept
        insort(self._changes, change, key=_moment)
        self._count += 1
        unsure = [] if change.is_sure else [i for i, each in enumerate(self._changes) if not each.is_sure]
        if len(unsure) > MAX_UNSURE:
            self._changes[unsure[0]] = replace(self._changes[unsure[0]], is_sure=True)
        if len(self._changes) > MAX_CHANGES:
            self._changes = list(_joined(self._changes))

    def read(self, counters: tuple[int, int], when: Moment, bits: int, time: float) -> None:
        """Take a reading of the counters into account.

        Args:
            counters: What they showed, left and right.
            when: When the robot read them.
            bits: Width of the counters.
            time: The time of the new pose, s.
        """
        if self.pose is not self._reckoned:  # it was set
            self._nominal, self._swing, self._leans = self.pose, (0.0, 0.0), [LEVEL] * len(self.spreads)
        last = self._changes[-1] if self._changes else self._start
        at = max(when.at, last.when.at)
        if self._stands(counters):  # most readings of most robots: only the time is another
            self._start = replace(self._start, when=Moment(min(when.began, at), at, max(at, when.ended)))
            self._nominal = replace(self._nominal, time=time)
            self._reckoned = self.pose = replace(self.pose, time=time)
            return
        reading = Change(Moment(min(when.began, at), at, max(at, when.ended)), None, counters)
        fitting = [each for kept in self._histories() if (each := self._explain(kept, reading, bits)).fits]
        for restarted in () if fitting else self._with_restart(reading):
            fitting = [each for kept in restarted if (each := self._explain(kept, reading, bits)).fits]
            if fitting:
                self.restarts += 1
                break
        best = min(fitting, key=lambda each: each.cost) if fitting else self._guess(reading, bits)
        fitting = [each for each in fitting if each.cost <= best.cost + UNLIKELY]
        doubt = max((apart(best.pose, e.pose) for e in fitting), default=0.0)
        turned = max((abs(_turn(best.pose, each.pose)) for each in fitting), default=0.0)
        self.left += best.steps[0]
        self.right += best.steps[1]
        self._leans = list(_leant(self._leans, self._nominal.heading, best.pieces))
        self._nominal = _spread(best.pose, doubt, turned, time)
        self._reckoned = self.pose = self._of_real_wheels(self._nominal)
        self._swing = best.swing
        self._start = Change(reading.when._replace(at=best.read_at), best.speeds, counters)
        # What is still undecided is decided by a later reading.
        others = dict.fromkeys(each.speeds for each in fitting if each.speeds != best.speeds)
        self._changes = [Change(self._start.when, each, None, is_sure=False) for each in others]
        self._count = 0

    def _stands(self, counters: tuple[int, int]) -> bool:
        """Return whether the robot was read where it stood before, and nothing was said to it since."""
        if self._changes or self.pose is not self._reckoned or self._nominal.heading_uncertainty < STEP:
            return False
        return self._start.speeds == STILL and self._start.counters == counters

    def _of_real_wheels(self, pose: Pose) -> Pose:
        """Return *pose* with the uncertainty that it has because no robot's wheels and axle are nominal."""
        x, y, heading = (
            2 * math.hypot(*(spread * lean[k] for spread, lean in zip(self.spreads, self._leans, strict=True)))
            for k in range(3)
        )
        whole = math.hypot(pose.heading_uncertainty, heading)
        return replace(pose, uncertainty=math.hypot(pose.uncertainty, x, y), heading_uncertainty=min(whole, math.pi))

    def _histories(self) -> Iterator[list[Change]]:
        """Yield the changes, with each choice of the unsure ones."""
        unsure = [each for each in self._changes if not each.is_sure]
        for count in range(len(unsure) + 1):
            for dropped in itertools.combinations(map(id, unsure), count):
                yield [each for each in self._changes if id(each) not in dropped]

    def _with_restart(self, reading: Change) -> Iterator[list[list[Change]]]:
        """Yield the changes with a restart of the robot in all places, first those that leave time for its start."""
        marks = [self._start, *self._changes, reading]
        likely: list[list[Change]] = []
        hasty: list[list[Change]] = []
        for place in range(len(self._changes), max(-1, len(self._changes) - MAX_RESTARTS), -1):
            before, after = marks[place].when, marks[place + 1].when
            answered = next(mark.when.at for mark in marks[place + 1 :] if mark.is_sure)
            latest = max(before.at, min(after.at, answered - self.startup))
            restart = Change(Moment(before.began, (before.at + latest) / 2, after.ended), STILL, STILL)
            kept = [*self._changes[:place], restart, *self._changes[place:]]
            (likely if answered - before.at >= self.startup else hasty).append(kept)
        yield likely
        yield hasty

    def _explain(self, changes: Sequence[Change], reading: Change, bits: int) -> Explanation:
        """Return the path that *changes* make, fitted to *reading*."""
        marks = [self._start, *changes, reading]
        rates = _rates(marks)
        first = _numbered(marks)
        base = marks[first].counters or UNKNOWN
        is_counted = not math.isnan(base[0])
        spans = [after.when.at - before.when.at for before, after in itertools.pairwise(marks)]
        # By how many steps the counters grow if a mark comes a second later: speeds before it less those behind it.
        behind = [*rates, STILL]
        gains = [
            STILL
            if i < first or not is_counted
            else (
                (rates[i - 1][0] if i > first else 0.0) - behind[i][0],
                (rates[i - 1][1] if i > first else 0.0) - behind[i][1],
            )
            for i in range(len(marks))
        ]
        variances = [mark.when.variance for mark in marks]
        told = [sum(rates[i][w] * spans[i] for i in range(first, len(spans))) for w in (0, 1)]
        ways = [sum(abs(rates[i][w]) * spans[i] for i in range(first, len(spans))) for w in (0, 1)]
        slack = [SLACK + LOST_STEPS / 8 * self._count + DRIFT / 16 * way for way in ways]
        most = [TOLERANCE + LOST_STEPS * self._count + DRIFT * way for way in ways]
        times = [mark.when.at for mark in marks]
        missing = [0.0, 0.0]
        if is_counted:
            assert reading.counters is not None
            missing = [wrapped(reading.counters[w] - base[w] - told[w], bits) for w in (0, 1)]
            times = _fitted(marks, gains, missing, slack)
        cost = sum((t - m.when.at) ** 2 / v for t, m, v in zip(times, marks, variances, strict=True) if v)
        times = list(itertools.accumulate(times, max))
        pieces = [[rates[i][w] * (times[i + 1] - times[i]) for w in (0, 1)] for i in range(len(spans))]
        left_over = [0.0, 0.0]
        if is_counted:
            for w in (0, 1):
                left_over[w] = told[w] + missing[w] - sum(piece[w] for piece in pieces[first:])
                weights = [abs(piece[w]) for piece in pieces[first:]]
                if sum(weights) <= abs(left_over[w]):
                    weights = [max(times[i + 1] - times[i], 1e-9) for i in range(first, len(spans))]
                whole = sum(weights)
                for piece, weight in zip(pieces[first:], weights, strict=True):
                    piece[w] += left_over[w] * weight / whole
        if any(math.isnan(rate[0]) for rate in rates):
            return Explanation(False, math.inf, self._nominal, self._swing, (0, 0), rates[-1], reading.when.at)
        poses = list(itertools.accumulate(pieces, lambda pose, piece: advanced(pose, *piece), initial=self._nominal))
        place, heading, swing = _variances(poses, rates, gains, variances)
        # Steps that were made are counted; only where the robot looked meanwhile is unknown.
        turned = min(1.0, STEP * sum(ways))
        place += (METRES_PER_STEP * (abs(left_over[0]) + abs(left_over[1])) / 2 * turned) ** 2
        # On the way the heading wanders by half a step at each change; what comes behind turns with it.
        wandered = STEP * LOST_STEPS / 2 * METRES_PER_STEP * sum(ways) / 2
        place += wandered**2 * self._count / 3
        steps = [round(sum(piece[w] for piece in pieces)) for w in (0, 1)]
        spread = _spread_of(gains, variances)
        return Explanation(
            all(abs(left_over[w]) <= most[w] and 4 * math.sqrt(spread[2 * w]) < 2 ** (bits - 1) for w in (0, 1)),
            cost + sum((left_over[w] / slack[w]) ** 2 for w in (0, 1)),
            *self._blurred(poses[-1], 2 * math.sqrt(place), 2 * math.sqrt(heading), (4 * swing[0], 4 * swing[1])),
            (steps[0], steps[1]),
            rates[-1],
            times[-1],
            pieces,
        )

    def _guess(self, reading: Change, bits: int) -> Explanation:
        """Return the path where something else drove the wheels: one arc, and how far it may be wrong."""
        marks = [self._start, *self._changes, reading]
        first = _numbered(marks)
        base = marks[first].counters or UNKNOWN
        unseen = FASTEST * (marks[first].when.at - marks[0].when.at)
        reach = FASTEST * (reading.when.at - marks[first].when.at)
        assert reading.counters is not None
        left, right = 0, 0
        is_counted = not math.isnan(base[0]) and reach < 2 ** (bits - 1)
        if is_counted:
            left, right = (round(wrapped(reading.counters[w] - base[w], bits)) for w in (0, 1))
            if max(abs(left), abs(right)) > reach + TOLERANCE:
                left, right, is_counted = 0, 0, False
        if not is_counted:  # they may have wrapped, or were set
            unseen, reach = unseen + reach, 0.0
        turned = min(1.0, STEP * reach)
        place = METRES_PER_STEP * (unseen + reach * turned)
        pose, swing = self._blurred(advanced(self._nominal, left, right), place, 2 * STEP * unseen)
        return Explanation(True, 0.0, pose, swing, (left, right), _rates(marks)[-1], reading.when.at, [(left, right)])

    def _blurred(self, pose: Pose, place: float, heading: float, swing: Pair = (0.0, 0.0)) -> tuple[Pose, Pair]:
        """Return *pose* with the uncertainty that it had before and that of a path to it, and the swing of both."""
        before = self._nominal
        x, y, turned = pose.x - before.x, pose.y - before.y, before.heading_uncertainty**2
        # An error of the heading turns all that comes behind it, however often the counters are read meanwhile.
        swept = 2 * (x * self._swing[1] - y * self._swing[0]) + (x * x + y * y) * turned
        whole = math.sqrt(max(0.0, before.uncertainty**2 + swept + place**2))
        # The counters' own step does not add up from reading to reading.
        known = math.sqrt(max(0.0, turned - STEP**2))
        return replace(pose, uncertainty=whole, heading_uncertainty=min(math.hypot(known, heading, STEP), math.pi)), (
            self._swing[0] - y * turned + swing[0],
            self._swing[1] + x * turned + swing[1],
        )


def _leant(leans: Sequence[Lean], heading: float, pieces: Sequence[Sequence[float]]) -> Iterator[Lean]:
    """Yield how much further each lean is after *pieces* of a path that begins with this heading."""
    arcs = []
    for left, right in pieces:
        left, right = METRES_PER_STEP * left, METRES_PER_STEP * right
        turn = (right - left) / AXLE
        parts = min(MAX_BENDS, 1 + int(abs(turn) / MAX_BEND))
        for part in range(parts):
            middle = heading + turn * (part + 0.5) / parts
            arcs.append((left / parts, right / parts, math.cos(middle), math.sin(middle)))
        heading += turn
    for k, (x, y, turned) in enumerate(leans):
        for left, right, cosine, sine in arcs:
            way = (left + right) / 2
            longer, further = ((left / 2, -left / AXLE), (right / 2, right / AXLE), (0.0, (left - right) / AXLE))[k]
            aside = turned + further / 2
            x += longer * cosine - way * aside * sine
            y += longer * sine + way * aside * cosine
            turned += further
        yield x, y, turned


def _moment(change: Change) -> float:
    return change.when.at


def _rates(marks: Sequence[Change]) -> list[Pair]:
    """Return the speeds behind each mark but the last."""
    rates: list[Pair] = []
    for mark in marks[:-1]:
        rates.append(rates[-1] if mark.speeds is None else mark.speeds)
    return rates


def _numbered(marks: Sequence[Change]) -> int:
    """Return which mark set the counters last, before the reading."""
    return max(i for i, mark in enumerate(marks[:-1]) if i == 0 or mark.counters is not None)


def _fitted(
    marks: Sequence[Change], gains: Sequence[Pair], missing: Sequence[float], slack: Sequence[float]
) -> list[float]:
    """Return when the marks were, so that the wheels make the steps that are missing, each mark within its moment."""
    times = [mark.when.at for mark in marks]
    free = [mark.when.variance for mark in marks]
    for _ in range(MAX_FITS):
        pull = _times(_inverse(_spread_of(gains, free), slack), missing)
        shifts = [v * (gain[0] * pull[0] + gain[1] * pull[1]) for v, gain in zip(free, gains, strict=True)]
        is_within = True
        for i, (mark, gain) in enumerate(zip(marks, gains, strict=True)):
            least, most = mark.when.began - mark.when.at, mark.when.ended - mark.when.at
            if free[i] and not least <= shifts[i] <= most:  # it stays at its limit, and the others are fitted again
                times[i], free[i], is_within = mark.when.at + min(max(shifts[i], least), most), 0.0, False
                shift = times[i] - mark.when.at
                missing = missing[0] - gain[0] * shift, missing[1] - gain[1] * shift
        if is_within:
            times = [m.when.at + s if v else t for t, m, s, v in zip(times, marks, shifts, free, strict=True)]
            # One change that came very late is more likely than many that came a bit late.
            closer = [min(v, max(shift**2, PUNCTUAL**2)) for v, shift in zip(free, shifts, strict=True)]
            if closer == free:
                break
            free = closer
    return times


def _spread_of(gains: Sequence[Pair], variances: Sequence[float]) -> tuple[float, float, float]:
    """Return variances and covariance of the steps of both wheels: left, both, right."""
    a, b, c = (
        sum(v * gain[i] * gain[k] for v, gain in zip(variances, gains, strict=True))
        for i, k in ((0, 0), (0, 1), (1, 1))
    )
    return a, b, c


def _inverse(spread: tuple[float, float, float], slack: Sequence[float]) -> tuple[Pair, Pair]:
    """Return the inverse of the matrix of variances of the steps of both wheels, those of *slack* added."""
    a, b, c = spread[0] + slack[0] ** 2, spread[1], spread[2] + slack[1] ** 2
    whole = a * c - b * b
    return (c / whole, -b / whole), (-b / whole, a / whole)


def _times(matrix: tuple[Pair, Pair], vector: Sequence[float]) -> Pair:
    (a, b), (c, d) = matrix
    return a * vector[0] + b * vector[1], c * vector[0] + d * vector[1]


def _variances(
    poses: Sequence[Pose],
    rates: Sequence[Pair],
    gains: Sequence[Pair],
    variances: Sequence[float],
) -> tuple[float, float, Pair]:
    """Return what the uncertain times leave at the end: variances of place, m2, and heading, rad2, and covariances."""
    end = poses[-1]
    inverse = _inverse(_spread_of(gains, variances), (EXACT, EXACT))
    pairs = ((0, 0), (1, 1), (2, 2), (0, 2), (1, 2))  # of x, y and heading
    totals = [0.0] * len(pairs)
    crossed = [[0.0, 0.0] for _ in range(3)]
    for pose, before, behind, gain, variance in zip(
        poses, [STILL, *rates], [*rates, STILL], gains, variances, strict=True
    ):
        ahead = METRES_PER_STEP * (before[0] - behind[0] + before[1] - behind[1]) / 2
        turning = METRES_PER_STEP * (before[1] - behind[1] - before[0] + behind[0]) / AXLE
        shifts = (
            ahead * math.cos(pose.heading) - turning * (end.y - pose.y),
            ahead * math.sin(pose.heading) + turning * (end.x - pose.x),
            turning,
        )
        for n, (k, m) in enumerate(pairs):
            totals[n] += variance * shifts[k] * shifts[m]
        for k, shift in enumerate(shifts):
            crossed[k][0] += variance * shift * gain[0]
            crossed[k][1] += variance * shift * gain[1]
    for n, (k, m) in enumerate(pairs):  # less what the counters tell
        seen = _times(inverse, crossed[k])
        totals[n] -= crossed[m][0] * seen[0] + crossed[m][1] * seen[1]
    x, y, heading = (max(0.0, total) for total in totals[:3])
    return x + y, heading, (totals[3], totals[4])


def _joined(changes: Sequence[Change]) -> Iterator[Change]:
    """Yield *changes* with each two neighbours as one, with their mean speed, if only sure speeds change."""
    i = 0
    while i < len(changes):
        change, after = changes[i], changes[i + 1] if i + 1 < len(changes) else None
        beyond = changes[i + 2] if i + 2 < len(changes) else None
        i += 1
        if after is not None and beyond is not None and _is_plain(change) and _is_plain(after):
            whole, part = beyond.when.at - change.when.at, after.when.at - change.when.at
            share = part / whole if whole > 0 else 0.5
            assert change.speeds is not None
            assert after.speeds is not None
            mean = tuple(share * a + (1 - share) * b for a, b in zip(change.speeds, after.speeds, strict=True))
            change = replace(change, speeds=(mean[0], mean[1]))
            i += 1
        yield change


def _is_plain(change: Change) -> bool:
    return change.is_sure and change.counters is None and change.speeds is not None


def _turn(before: Pose, after: Pose) -> float:
    return math.remainder(after.heading - before.heading, math.tau)


def _spread(pose: Pose, place: float, heading: float, time: float) -> Pose:
    """Return *pose* with its time, and as much more uncertainty."""
    return replace(
        pose,
        time=time,
        uncertainty=pose.uncertainty + place,
        heading_uncertainty=min(pose.heading_uncertainty + heading, math.pi),
    )
