"""Fit of a robot's wheels to a recorded drive: radii, axle and the age of the step counters, by robust least squares.

The counters say how far each wheel was stepped, and the measured poses how the robot moved. The drive is divided into
windows. Their ends are where the wheels turn at an even speed or stand, so that the exact time of a reading matters
little; the rest of that error is fitted as the age of the counters. Each window gives three equations, for the motion
as seen from its first pose, so that errors do not add up over the drive. Windows overlap: one begins at each suitable
pose, so that every pose counts.

A robot that slips or is stopped by an obstacle says nothing about its wheels, and that may be half of a drive. So the
first guess must not need the agreement of most windows: the headings alone give the ratios of radii and axle, by least
absolute residuals, because a robot that pushes straight against a wall keeps its heading. Then comes the size on which
most windows agree. From there Gauss-Newton with numerical derivatives finds the four unknowns; a window has less weight
the worse it fits (first the weights of Geman and McClure with a fixed width, then Tukey's biweight with the width of
the residuals). The residuals and the standard errors decide whether the result is accepted.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elib.base.body import AXLE, METRES_PER_STEP
from elib.base.errors import ArgumentError
from elib.studies.series import Numbers, Series

MIN_WAY = 1.0
"""m that the wheels must roll at least, forward and backward together."""
MIN_TURN = 4 * math.pi
"""rad that the robot must turn at least, left and right together: the rounding of a step counter is 0.02 % of that."""
MIN_WINDOWS = 20
"""Windows that a fit needs: with fewer, the four unknowns and their standard errors depend on single windows."""
WINDOW = 8.0
"""Shortest window, s: long enough that the rounding of counters and the errors of poses are small, short enough that
most windows have no slip."""
EVEN, EVEN_RATE = 0.12, 12.0
"""Largest change of a wheel's speed around the end of a window: a share of the speed, and steps/s for slow wheels."""
GAP = 0.6
"""s. In a longer gap between two readings of the counters it is not known what the wheels did."""
TUKEY = 4.685
"""Deviations at which the biweight ends: 95 % as efficient as least squares on good data (Holland, Welsch 1977)."""
COARSE_ROUNDS, ROUNDS = 10, 25
MIN_SIZE, GREATEST_SIZE, SIZE_STEP = 0.7, 1.4, 0.005
"""Range and step of the sizes that are tried for the first guess, as shares of the nominal axle; a step is 3 mm of what
a robot usually drives in a window."""
COARSE_POSITION, COARSE_HEADING = 0.005, math.radians(1.0)
"""m, rad. A window with such a residual has a quarter of its weight in the first rounds; good poses make less."""
MAX_POSITION, MAX_HEADING = 0.02, math.radians(3.0)
"""m, rad. After the first rounds, a window with a larger residual counts as slip or contact. If the others miss by half
of it (root mean square), some of the good windows are beyond it too, and the fit is refused."""
MIN_SHARE = 1 / 3
"""Share of the windows that must agree: with fewer, chance decides which ones do."""
MAX_ERROR = 0.003
"""Largest standard error of radii and axle, as a share of them: with more, a nominal robot is as good a guess."""
MIN_STEP = 1e-9
"""Change of the unknowns at which the iteration ends: far below any standard error."""
POSITION_FLOOR, HEADING_FLOOR = METRES_PER_STEP, METRES_PER_STEP / AXLE
"""m, rad. Effect of the rounding of the counters: a window that misses by less is never an outlier."""

TRUSTWORTHY = (
    "keep it off walls, and off what it slips on, drive slower, and check that poses are measured in m and rad, "
    "heading positive to the left"
)
"""Advice on how to drive so that the wheels can be fitted."""


@dataclass(frozen=True, slots=True)
class WheelFit:
    """The fitted wheels."""

    left: float  # radius of the left wheel as a share of the nominal radius
    right: float  # radius of the right wheel as a share of the nominal radius
    axle: float  # distance between the wheels' contact points, m
    delay: float  # age of a reading of the counters at its time, s
    errors: tuple[float, ...]  # standard errors of these four, in the same units
    windows: int  # number of windows that were used
    left_out: int  # number of windows that did not agree with these: the robot slipped or was stopped there
    position_error: float  # root mean square of the residual position over a window, m
    heading_error: float  # root mean square of the residual heading over a window, rad


def fit_wheels(steps: Series, poses: Series) -> WheelFit:
    """Find the radii of the wheels, the axle and the age of the counters.

    Args:
        steps: Step counters without jumps, at the times at which their readings arrived.
        poses: Measured poses; the headings have no jumps of a whole turn.
    """
    _check_motion(steps, poses)
    pairs = _windows(steps, poses)
    if len(pairs) < MIN_WINDOWS:
        breaks = int(steps.broken.sum())
        raise ArgumentError(
            f"the drive has only {len(pairs)} pieces of {WINDOW:g} s with counters all along and measured poses at "
            f"both ends, where the wheels turn evenly; it needs {MIN_WINDOWS}"
            + (f". The counters were set or reset {breaks} times, and no piece reaches over that" if breaks else ""),
            hint=("set the counters before driving only; " if breaks else "")
            + "read the counters twice a second or more, measure poses as often, and drive each movement for some "
            "seconds: elib run calibration-drive --record FILE does all that",
        )
    first, last = pairs[:, 0], pairs[:, 1]
    seen = _motions(poses.values[first], poses.values[last])

    def left_over(unknowns: Numbers) -> Numbers:
        left, right, axle, delay = unknowns
        path = integrated(steps, poses.times + delay, left, right, axle)
        missed: Numbers = _motions(path[first], path[last]) - seen
        missed[:, 2] = _angles(missed[:, 2])
        return missed

    blocks = ((poses.times[first] - poses.times[first[0]]) / WINDOW).astype(int)
    # How far the rims of a nominal robot had rolled at each pose, m.
    rolled = METRES_PER_STEP * np.column_stack([np.interp(poses.times, steps.times, each) for each in steps.values.T])
    guess = _guess(rolled[last] - rolled[first], seen[:, 2], left_over)
    found, covariance, weights, missed = _solve(left_over, guess, blocks)
    used = weights > 0
    left, right, axle, delay = map(float, found)
    errors = tuple(map(float, np.sqrt(np.diag(covariance))))
    place = float(np.sqrt(np.mean(np.sum(missed[used, :2] ** 2, axis=1)))) if used.any() else math.inf
    turn = float(np.sqrt(np.mean(missed[used, 2] ** 2))) if used.any() else math.inf
    fit = WheelFit(left, right, axle, delay, errors, int(used.sum()), int((~used).sum()), place, turn)
    _check_fit(fit)
    return fit


def _guess(rolled: Numbers, turned: Numbers, left_over: Callable[[Numbers], Numbers]) -> Numbers:
    """Return the first guess of the unknowns.

    A turn is ``right * b - left * a``, where *a* and *b* are the radii divided by the axle.

    Args:
        rolled: How far the nominal rims rolled in each window, m.
        turned: How far the robot turned in each window, rad.
        left_over: Returns the residuals of the windows for some unknowns.
    """
    table = rolled * [-1, 1]
    over_axle = np.array([1.0, 1.0]) / AXLE
    for _ in range(COARSE_ROUNDS):  # weights of 1/|r| make least squares least absolute residuals
        missed = _angles(table @ over_axle - turned)
        root = 1 / np.sqrt(np.maximum(np.abs(missed), HEADING_FLOOR))
        over_axle = over_axle - np.linalg.lstsq(table * root[:, None], missed * root, rcond=None)[0]
    sizes = AXLE * np.arange(MIN_SIZE, GREATEST_SIZE, SIZE_STEP)
    guesses = [np.array([*(over_axle * size), size, 0.0]) for size in sizes]
    return max(guesses, key=lambda guess: float(_coarse_weights(left_over(guess)).sum()))


def _coarse_weights(missed: Numbers) -> Numbers:
    """Return the weights of Geman and McClure."""
    off = missed / [COARSE_POSITION, COARSE_POSITION, COARSE_HEADING]
    found: Numbers = 1 / (1 + np.square(off).sum(axis=1)) ** 2
    return found


def _angles(values: Numbers) -> Numbers:
    found: Numbers = (values + math.pi) % math.tau - math.pi
    return found


def _check_fit(fit: WheelFit) -> None:
    """Refuse a fit that is not to be trusted."""
    count = fit.windows + fit.left_out
    if fit.windows < max(MIN_WINDOWS, MIN_SHARE * count):
        raise ArgumentError(
            f"only {fit.windows} of {count} pieces of the drive agree on the wheels, within "
            f"{1000 * MAX_POSITION:g} mm and {math.degrees(MAX_HEADING):g} degrees: in the others the robot probably "
            "slipped or pushed something, or the poses are wrong",
            hint=TRUSTWORTHY,
        )
    if fit.position_error > MAX_POSITION / 2 or fit.heading_error > MAX_HEADING / 2:
        raise ArgumentError(
            f"the wheels that fit the drive best still miss by {1000 * fit.position_error:.1f} mm and "
            f"{math.degrees(fit.heading_error):.1f} degrees over {WINDOW:g} s; {500 * MAX_POSITION:g} mm and "
            f"{math.degrees(MAX_HEADING) / 2:g} degrees are allowed: the robot probably slipped or pushed something, "
            "or the poses are not exact enough",
            hint=TRUSTWORTHY,
        )
    sizes = fit.left, fit.right, fit.axle
    worst = max(error / abs(size) for error, size in zip(fit.errors, sizes, strict=False))
    if not worst <= MAX_ERROR:
        known = f"known only within {100 * worst:.1f} % (standard error)" if math.isfinite(worst) else "hardly known"
        raise ArgumentError(
            f"the wheels are {known}; {100 * MAX_ERROR:g} % is allowed: the drive is short for such poses, "
            "or the robot often slipped or pushed something",
            hint=f"drive longer; {TRUSTWORTHY}",
        )


def integrated(steps: Series, times: Numbers, left: float, right: float, axle: float) -> Numbers:
    """Return x, y and heading at some times by the counters, from (0, 0, 0) at the first reading.

    Args:
        steps: Step counters; the wheels turn evenly between two readings.
        times: Times of the wanted poses, s on the clock of the counters.
        left: Radius of the left wheel as a share of the nominal radius.
        right: Radius of the right wheel as a share of the nominal radius.
        axle: Distance between the wheels' contact points, m.
    """
    grid = np.union1d(steps.times, times)
    scale = np.array([left, right]) * METRES_PER_STEP
    rolled = np.column_stack([np.interp(grid, steps.times, column) for column in steps.values.T]) * scale
    change = np.diff(rolled, axis=0)
    turn = (change[:, 1] - change[:, 0]) / axle
    heading = np.concatenate([[0.0], np.cumsum(turn)])
    # The chord of an arc, as in elib.base.pose.advanced; the sinc of NumPy has a factor of pi.
    chord = (change[:, 0] + change[:, 1]) / 2 * np.sinc(turn / math.tau)
    middle = heading[:-1] + turn / 2
    x = np.concatenate([[0.0], np.cumsum(chord * np.cos(middle))])
    y = np.concatenate([[0.0], np.cumsum(chord * np.sin(middle))])
    return np.column_stack([x, y, heading])[np.searchsorted(grid, times)]


def spread(values: Numbers) -> float:
    """Return the standard deviation estimated by the median absolute deviation, which ignores outliers."""
    return 1.4826 * float(np.median(np.abs(values - np.median(values)))) if len(values) else 0.0


def _check_motion(steps: Series, poses: Series) -> None:
    if len(steps.times) < 3 or len(poses.times) < 3:
        raise ArgumentError(
            f"there are {len(steps.times)} readings of the counters and {len(poses.times)} measured poses; "
            "the wheels need some of both",
            hint="elib run calibration-drive --record FILE reads the counters all the time",
        )
    change = steps.changes() * METRES_PER_STEP
    way = float(np.nansum(np.abs(change).mean(axis=1)))
    turn = float(np.nansum(np.abs(change[:, 1] - change[:, 0]))) / AXLE
    if way < MIN_WAY or turn < MIN_TURN:
        raise ArgumentError(
            f"the robot rolled {way:.2f} m and turned {turn / math.tau:.1f} times; "
            f"the wheels need {MIN_WAY:g} m and {MIN_TURN / math.tau:g} turns",
            hint="drive straight legs, and turns on the spot to both sides: elib run calibration-drive --record FILE",
        )


def _windows(steps: Series, poses: Series) -> NDArray[np.intp]:
    """Return the indices of the first and the last pose of each window."""
    after = np.clip(np.searchsorted(steps.times, poses.times), 2, len(steps.times) - 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = steps.changes() / np.diff(steps.times)[:, None]
    around = np.stack([rates[after - 2], rates[after - 1], rates[after]])
    spread = around.max(axis=0) - around.min(axis=0)
    is_even = np.all(spread <= np.maximum(EVEN * np.abs(around).max(axis=0), EVEN_RATE), axis=1)
    is_inside = (poses.times > steps.times[1]) & (poses.times < steps.times[-2])
    ends = np.flatnonzero(is_even & is_inside)
    is_hole = (np.diff(steps.times) > GAP) | np.isnan(rates).any(axis=1)
    holes = np.concatenate([[0], np.cumsum(is_hole)])[after - 1]
    # A window goes from each such pose to the first one that is far enough. Windows overlap, so every pose counts.
    last = np.searchsorted(poses.times[ends], poses.times[ends] + WINDOW)
    starts, last = ends[last < len(ends)], ends[last[last < len(ends)]]
    is_whole = holes[starts] == holes[last]
    pairs: NDArray[np.intp] = np.column_stack([starts[is_whole], last[is_whole]])
    return pairs


def _motions(first: Numbers, last: Numbers) -> Numbers:
    """Return the motions from the first poses to the last ones, as seen from the first: ahead, left, turned."""
    change = last - first
    cosine, sine = np.cos(first[:, 2]), np.sin(first[:, 2])
    ahead = cosine * change[:, 0] + sine * change[:, 1]
    aside = cosine * change[:, 1] - sine * change[:, 0]
    return np.column_stack([ahead, aside, change[:, 2]])


def _solve(
    left_over: Callable[[Numbers], Numbers], unknowns: Numbers, blocks: NDArray[np.intp]
) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    """Return the unknowns, their covariance, and the weight and the residual of each window."""
    steps = np.array([1e-6, 1e-6, 1e-7, 1e-4])
    weights: Numbers = np.ones(len(left_over(unknowns)))
    normal: Numbers = np.eye(4)
    rows, aims = np.zeros((0, 4)), np.zeros(0)
    for number in range(COARSE_ROUNDS + ROUNDS):
        missed = left_over(unknowns)
        fits = (np.hypot(missed[:, 0], missed[:, 1]) < MAX_POSITION) & (np.abs(missed[:, 2]) < MAX_HEADING)
        if number < COARSE_ROUNDS:
            scale = np.array([COARSE_POSITION, COARSE_POSITION, COARSE_HEADING])
            weights = _coarse_weights(missed)
        else:
            place, turn = spread(missed[fits, :2].ravel()), spread(missed[fits, 2])
            scale = np.array([*[max(place, POSITION_FLOOR)] * 2, max(turn, HEADING_FLOOR)])
            off = np.sqrt(np.mean((missed / scale) ** 2, axis=1)) / TUKEY
            weights = np.where(fits & (off < 1), (1 - off**2) ** 2, 0.0)
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
        if number >= COARSE_ROUNDS and np.all(np.abs(change) < MIN_STEP * np.array([1, 1, 1, 1e3])):
            break
    # Windows overlap, so the residuals of neighbours are correlated: they are added up over blocks of the drive before
    # they are squared (the cluster-robust covariance). With few blocks the unknowns absorb a part of the residuals.
    pulls = rows * aims[:, None]
    known = np.unique(blocks[weights > 0])
    sums = np.array([pulls[np.repeat(blocks == block, 3)].sum(axis=0) for block in known]).reshape(-1, 4)
    inverse = np.linalg.pinv(normal)
    share = len(known) / (len(known) - 4) if len(known) > 4 else math.inf
    covariance = np.asarray(inverse @ (sums.T @ sums) @ inverse, dtype=np.float64) * share
    return unknowns, covariance, weights, left_over(unknowns)


def _undetermined() -> ArgumentError:
    return ArgumentError(
        "the drive does not determine the wheels: its movements are too much alike",
        hint="drive legs, turns to both sides and arcs: elib run calibration-drive --record FILE",
    )
