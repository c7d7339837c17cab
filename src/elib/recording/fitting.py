"""What a recorded drive tells about a robot's wheels and its link: least squares, with nothing but numbers in and out.

Wheels. The counters say how far each wheel was stepped, and measured poses how the robot moved. The drive is seen
through windows whose ends lie where the wheels turn evenly or stand, so that the moment at which a counter was truly
read does not matter much; what is left of it is fitted along. Each window gives three equations, the motion seen from
its first pose, so that errors do not add up over the drive. One begins at each such pose, so that every pose counts.
Gauss-Newton with numerical derivatives finds the four unknowns; windows that fit badly, where the robot was held up or
slipped, lose their weight (Tukey's biweight).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from elib.body import AXLE, METRES_PER_STEP
from elib.errors import ArgumentError

Numbers: TypeAlias = NDArray[np.float64]

LEAST_WAY = 1.0
"""m that the wheels must roll, forward and back together."""
LEAST_TURN = 4 * math.pi
"""rad that the robot must turn, left and right together: a step counter's rounding is then 0.02 % of it."""
LEAST_WINDOWS = 20
WINDOW = 8.0
"""s that a window lasts at least: long against the rounding of the counters and errors of poses, short against
slipping."""
EVEN = 0.12
"""Of its speed that a wheel's rate may change around a window's end, and steps/s below."""
EVEN_RATE = 12.0
GAP = 0.6
"""s between two readings of the counters beyond which nobody knows what the wheels did between."""
TUKEY = 4.685
"""Deviations at which the biweight ends: 95 % as good as least squares where all is well (Holland, Welsch 1977)."""
ROUNDS = 25
SMALLEST_STEP = 1e-9
POSITION_FLOOR, HEADING_FLOOR = METRES_PER_STEP, METRES_PER_STEP / AXLE
"""m, rad. What rounding of the counters makes: a window is no outlier for less, however exact the others are."""


@dataclass(frozen=True, slots=True)
class Course:
    """A robot's counters or poses over time.

    Attributes:
        times: s, rising.
        values: One row for each: steps left and right, or x, y and heading, without jumps.
    """

    times: Numbers
    values: Numbers


@dataclass(frozen=True, slots=True)
class WheelFit:
    """What was found about the wheels.

    Attributes:
        left: Radius of the left wheel over the nominal one.
        right: The same of the right wheel.
        axle: m.
        delay: s by which a reading of the counters is older than its time says.
        errors: Standard error of each of the four, in the same units.
        windows: Pieces of the drive that were used.
        left_out: Pieces that fitted so badly that they were not: the robot slipped or was held up.
        position_error: Root mean square of what is left over a window, m.
        heading_error: The same, rad.
    """

    left: float
    right: float
    axle: float
    delay: float
    errors: tuple[float, float, float, float]
    windows: int
    left_out: int
    position_error: float
    heading_error: float


@dataclass(frozen=True, slots=True)
class LinkFit:
    """What was found about the link.

    Attributes:
        latency: Each way, s.
        jitter: Standard deviation of that, s.
        error: Standard error of the latency, s.
        calls: That were compared.
    """

    latency: float
    jitter: float
    error: float
    calls: int


def unwrapped_steps(counts: Numbers) -> Numbers:
    """Return 16-bit counters as they would be without wrapping; steps by column, one row a reading."""
    change = (np.diff(counts, axis=0) + 32768) % 65536 - 32768
    return np.vstack([counts[:1], counts[0] + np.cumsum(change, axis=0)])


def fit_wheels(steps: Course, poses: Course) -> WheelFit:
    """Find the wheels' radii, the axle and the age of the counters.

    Args:
        steps: Counters, unwrapped, at the times at which they arrived.
        poses: Measured poses, headings without jumps of a turn.

    Raises:
        ArgumentError: The drive has too little motion; the message says what to drive.
    """
    _check_motion(steps, poses)
    pairs = _windows(steps, poses)
    if len(pairs) < LEAST_WINDOWS:
        raise ArgumentError(
            f"the drive has only {len(pairs)} pieces of {WINDOW:g} s with counters all along and measured poses at "
            f"both ends, where the wheels turn evenly; it needs {LEAST_WINDOWS}",
            hint="read the counters twice a second or more, measure poses as often, and drive each movement for some "
            "seconds: elib run calibration-drive --record FILE does all that",
        )
    first, last = pairs[:, 0], pairs[:, 1]
    seen = _motions(poses.values[first], poses.values[last])

    def left_over(unknowns: Numbers) -> Numbers:
        left, right, axle, delay = unknowns
        path = integrated(steps, poses.times + delay, left, right, axle)
        missed: Numbers = _motions(path[first], path[last]) - seen
        missed[:, 2] = (missed[:, 2] + math.pi) % math.tau - math.pi
        return missed

    blocks = ((poses.times[first] - poses.times[first[0]]) / (2 * WINDOW)).astype(int)
    found, covariance, weights, missed = _solve(left_over, np.array([1.0, 1.0, AXLE, 0.0]), blocks)
    used = weights > 0
    left, right, axle, delay = (float(each) for each in found)
    errors = np.sqrt(np.diag(covariance))
    place = float(np.sqrt(np.mean(np.sum(missed[used, :2] ** 2, axis=1)))) if used.any() else math.nan
    turn = float(np.sqrt(np.mean(missed[used, 2] ** 2))) if used.any() else math.nan
    return WheelFit(
        left,
        right,
        axle,
        delay,
        (float(errors[0]), float(errors[1]), float(errors[2]), float(errors[3])),
        int(used.sum()),
        int((~used).sum()),
        place,
        turn,
    )


def integrated(steps: Course, times: Numbers, left: float, right: float, axle: float) -> Numbers:
    """Return x, y and heading at some times by the counters, from (0, 0, 0) at the first reading.

    Args:
        steps: Counters; even between two readings.
        times: When the pose is wanted, s on the counters' clock.
        left: Radius of the left wheel over the nominal one.
        right: The same of the right wheel.
        axle: m.
    """
    grid = np.union1d(steps.times, times)
    scale = np.array([left, right]) * METRES_PER_STEP
    rolled = np.column_stack([np.interp(grid, steps.times, column) for column in steps.values.T]) * scale
    change = np.diff(rolled, axis=0)
    turn = (change[:, 1] - change[:, 0]) / axle
    heading = np.concatenate([[0.0], np.cumsum(turn)])
    # The chord of an arc, as in elib.pose.advanced; numpy's sinc has a factor of pi.
    chord = (change[:, 0] + change[:, 1]) / 2 * np.sinc(turn / math.tau)
    middle = heading[:-1] + turn / 2
    x = np.concatenate([[0.0], np.cumsum(chord * np.cos(middle))])
    y = np.concatenate([[0.0], np.cumsum(chord * np.sin(middle))])
    return np.column_stack([x, y, heading])[np.searchsorted(grid, times)]


def fit_link(recorded: Sequence[float], simulated: Sequence[float], before: LinkFit | None = None) -> LinkFit:
    """Find the latency with which the simulator's round trips become the recorded ones.

    Args:
        recorded: Round trips of the recording, s.
        simulated: Of the same calls in the simulator, s.
        before: What the simulator's link was set to for these; None for no delay at all.

    Raises:
        ArgumentError: There is nothing to compare.
    """
    if not len(recorded):
        raise ArgumentError(
            "no call of the recording was answered both there and in the simulator, so the link cannot be fitted",
            hint="record a drive that reads sensors: elib run calibration-drive --record FILE",
        )
    was = LinkFit(0.0, 0.0, 0.0, 0) if before is None else before
    there, here = np.asarray(recorded, dtype=float), np.asarray(simulated, dtype=float)
    # Two ways make a round trip. Medians: a lost answer's neighbour or a late one says nothing about the usual.
    latency = was.latency + (float(np.median(there)) - float(np.median(here))) / 2
    spread = _spread(there - _usual(there)) ** 2 - _spread(here - _usual(here)) ** 2
    jitter = math.sqrt(max(was.jitter**2 + spread / 2, 0.0))
    error = 1.2533 * _spread(there - _usual(there)) / 2 / math.sqrt(len(there))
    return LinkFit(max(latency, 0.0), jitter, error, len(there))


def _usual(values: Numbers) -> float:
    return float(np.median(values))


def _spread(values: Numbers) -> float:
    """Return the standard deviation by the median of what lies off the median: outliers do not count."""
    return 1.4826 * float(np.median(np.abs(values - np.median(values)))) if len(values) else 0.0


def _check_motion(steps: Course, poses: Course) -> None:
    if len(steps.times) < 3 or len(poses.times) < 3:
        raise ArgumentError(
            f"there are {len(steps.times)} readings of the counters and {len(poses.times)} measured poses; "
            "the wheels need some of both",
            hint="elib run calibration-drive --record FILE reads the counters all the time",
        )
    change = np.abs(np.diff(steps.values, axis=0)) * METRES_PER_STEP
    way = float(change.mean(axis=1).sum())
    turns = np.diff(steps.values, axis=0) * METRES_PER_STEP / AXLE
    turn = float(np.abs(turns[:, 1] - turns[:, 0]).sum())
    if way < LEAST_WAY or turn < LEAST_TURN:
        raise ArgumentError(
            f"the robot rolled {way:.2f} m and turned {turn / math.tau:.1f} times; "
            f"the wheels need {LEAST_WAY:g} m and {LEAST_TURN / math.tau:g} turns",
            hint="drive straight legs, and turns on the spot to both sides: elib run calibration-drive --record FILE",
        )


def _windows(steps: Course, poses: Course) -> NDArray[np.intp]:
    """Return the first and the last pose of each piece of the drive."""
    after = np.clip(np.searchsorted(steps.times, poses.times), 2, len(steps.times) - 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = np.diff(steps.values, axis=0) / np.diff(steps.times)[:, None]
    around = np.stack([rates[after - 2], rates[after - 1], rates[after]])
    spread = around.max(axis=0) - around.min(axis=0)
    is_even = np.all(spread <= np.maximum(EVEN * np.abs(around).max(axis=0), EVEN_RATE), axis=1)
    is_inside = (poses.times > steps.times[1]) & (poses.times < steps.times[-2])
    ends = np.flatnonzero(is_even & is_inside)
    holes = np.concatenate([[0], np.cumsum(np.diff(steps.times) > GAP)])[after - 1]
    # From each of them to the first one that is far enough: windows overlap, so that every pose counts.
    last = np.searchsorted(poses.times[ends], poses.times[ends] + WINDOW)
    starts, last = ends[last < len(ends)], ends[last[last < len(ends)]]
    is_whole = holes[starts] == holes[last]
    pairs: NDArray[np.intp] = np.column_stack([starts[is_whole], last[is_whole]])
    return pairs


def _motions(first: Numbers, last: Numbers) -> Numbers:
    """Return each motion from one pose to another, as seen from the first: ahead, to the left, turned."""
    change = last - first
    cosine, sine = np.cos(first[:, 2]), np.sin(first[:, 2])
    ahead = cosine * change[:, 0] + sine * change[:, 1]
    aside = cosine * change[:, 1] - sine * change[:, 0]
    return np.column_stack([ahead, aside, change[:, 2]])


def _solve(
    left_over: Callable[[Numbers], Numbers], unknowns: Numbers, blocks: NDArray[np.intp]
) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    """Return the unknowns, their covariance, each window's weight and what is left of it."""
    steps = np.array([1e-6, 1e-6, 1e-7, 1e-4])
    weights: Numbers = np.ones(len(left_over(unknowns)))
    normal: Numbers = np.eye(4)
    rows, aims = np.zeros((0, 4)), np.zeros(0)
    for _ in range(ROUNDS):
        missed = left_over(unknowns)
        scale = np.array(
            [*[max(_spread(missed[:, :2].ravel()), POSITION_FLOOR)] * 2, max(_spread(missed[:, 2]), HEADING_FLOOR)]
        )
        off = np.sqrt(np.mean((missed / scale) ** 2, axis=1)) / TUKEY
        weights = np.where(off < 1, (1 - off**2) ** 2, 0.0)
        slopes = np.stack(
            [(left_over(unknowns + step) - left_over(unknowns - step)) / (2 * step.sum()) for step in np.diag(steps)],
            axis=-1,
        )
        root = np.sqrt(weights)[:, None] / scale
        rows, aims = (root[:, :, None] * slopes).reshape(-1, 4), -(root * missed).ravel()
        normal = rows.T @ rows
        try:
            change = np.linalg.solve(normal + 1e-12 * np.diag(np.diag(normal)), rows.T @ aims)
        except np.linalg.LinAlgError:
            raise _undetermined() from None
        if not np.all(np.isfinite(change)):
            raise _undetermined()
        unknowns = unknowns + change
        if np.all(np.abs(change) < SMALLEST_STEP * np.array([1, 1, 1, 1e3])):
            break
    # Windows overlap, so what is left of neighbours is alike: it is added up over blocks of the drive before it is
    # squared (the cluster-robust covariance).
    pulls = rows * aims[:, None]
    sums = np.array([pulls[np.repeat(blocks == block, 3)].sum(axis=0) for block in np.unique(blocks)])
    inverse = np.linalg.pinv(normal)
    covariance = np.asarray(inverse @ (sums.T @ sums) @ inverse, dtype=np.float64)
    return unknowns, covariance, weights, left_over(unknowns)


def _undetermined() -> ArgumentError:
    return ArgumentError(
        "the drive does not determine the wheels: its movements are too much alike",
        hint="drive legs, turns to both sides and arcs: elib run calibration-drive --record FILE",
    )


__all__ = ["Course", "LinkFit", "WheelFit", "fit_link", "fit_wheels", "integrated", "unwrapped_steps"]
