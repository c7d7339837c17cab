"""Fit of the response curve of a robot's infrared sensors to their readings on a path along known walls.

The usual curve is changed until it fits: a piecewise linear function between knots is added to its logarithm. That
function is stiff, so that the curve keeps its usual shape where nothing was read. Each sensor has a gain and a
level in the open of its own. The firmware cuts readings off at 0, so the mean of the noise in the open may be above 0:
the model predicts the mean of the cut-off reading. The method is Gauss-Newton; readings that do not fit lose their
weight.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elib.base.errors import ArgumentError
from elib.base.infrared import MAX_LIGHT, SPACING, USUAL_RESPONSE
from elib.simulator.emulator.robotprofile import Infrared
from elib.simulator.physics.profiles import COUNT
from elib.studies.series import Numbers

REACH = 0.12
"""Range of the sensors, m (Enki and GCtronic; e-puck.md, 3)."""
KNOTS = np.array([0.0, 0.006, 0.009, 0.012, 0.015, 0.018, 0.022, 0.027, 0.033, 0.04, 0.05, 0.06, 0.075, 0.095, REACH])
"""Distances between which the change of the curve is linear, m: denser where the curve is steep."""
STIFFNESS = 1.0
"""Expected change of slope of the curve's logarithm from knot to knot: published curves differ by so much."""
FREEDOM = 1.0
"""Expected difference of the logarithm from that of the usual curve."""
GAINS = 0.15
"""Expected spread of the gains of the sensors."""
DELAY = 0.02
"""Expected difference between the age of a reading and the age of the counters, s."""
SATURATED = 3400.0
"""Counts from which the ambient light limits readings (e-puck.md, 4)."""
NEAR = 70.0
"""Counts above the level in the open from which something is near: 5 cm by the usual curve."""
MIN_NEAR = 40
"""Least number of readings of something near, of all sensors together."""
POSE_ERROR = 2e-4
"""Error of the measured distance besides all noise, m."""
RELATIVE = 0.01
"""Share of a reading that no model of a sensor explains."""
USUAL_NOISE = 3.0
"""Usual standard deviation of a reading, counts (measured-robots: infrared.noise_at_rest)."""
TUKEY = 4.685
"""Deviations at which the biweight ends, as in :mod:`elib.studies.wheels`."""
ROUNDS, SOFT_ROUNDS = 16, 6
"""Most iterations, and those of them in which all readings keep some weight."""
SMALL = 1e-3
"""Change of a logarithm at which the iteration ends."""
MAX_READINGS = 900
"""Readings of all sensors that are used; of more, evenly chosen ones are enough."""
EVERY = 5
"""One reading in so many is not fitted but predicted, to test the fit."""
SHOWN = np.array(
    [0.0, *np.arange(0.001, 0.02, 0.001), *np.arange(0.02, 0.04, 0.0025), *np.arange(0.04, REACH + 0.001, 0.005)]
)
"""Distances at which a profile has the curve, m."""


@dataclass(frozen=True, slots=True)
class CurveFit:
    """The fitted infrared sensors."""

    infrared: Infrared  # curve, noise, gains and offsets
    nearest: float  # least distance at which something was read, m; below it the curve has the shape of the usual one
    error: float  # root mean square of predicted minus read counts, of readings that were not fitted
    near_error: float  # root mean square error of such readings more than NEAR above the open, as a share of them


def fit_curve(depths_at: Callable[[float], tuple[Numbers, Numbers]], read: Numbers, delay: float) -> CurveFit:
    """Fit the curve.

    Args:
        depths_at: Returns, for an age of the readings in s, the depths of the rays of each sensor at each reading, and
            the weights of the rays, as :func:`~elib.studies.rays.depths` does.
        read: Counts by reading and sensor.
        delay: First guess of the age of a reading, s.
    """
    depth, _ = depths_at(delay)
    near = int(np.sum((read - np.median(read, axis=0) > NEAR) & (depth.min(axis=-1) < REACH)))
    if near < MIN_NEAR:
        raise ArgumentError(
            f"only {near} infrared readings are of something nearer than about 5 cm; the curve needs {MIN_NEAR}",
            hint="drive slowly up to a wall and turn before it: elib run calibration-drive --record FILE",
        )
    place = np.arange(len(read))
    is_kept = (place % EVERY != 0) & (place * MAX_READINGS // len(read) != (place - 1) * MAX_READINGS // len(read))
    model = _Model(lambda age: _only(depths_at(age), is_kept), read[is_kept], delay)
    for number in range(ROUNDS):
        if model.improve() < SMALL and number > SOFT_ROUNDS:
            break
    is_test = place % EVERY == 0
    predicted, _ = _Model(lambda age: _only(depths_at(age), is_test), read[is_test], delay).predict(
        model.unknowns, model.noise
    )
    aim = read[is_test]
    fits = aim < SATURATED
    off = (predicted - aim)[fits]
    is_near = (aim - model.levels > NEAR)[fits]
    depth, _ = depths_at(float(model.unknowns[-1]))
    seen = depth[..., 0][(read - model.levels > NEAR) & (read < SATURATED)]
    return CurveFit(
        model.infrared(),
        float(seen.min()) if len(seen) else REACH,
        float(np.sqrt(np.mean(off**2))),
        float(np.sqrt(np.mean((off[is_near] / aim[fits][is_near]) ** 2))) if is_near.any() else math.nan,
    )


def _only(found: tuple[Numbers, Numbers], kept: NDArray[np.bool_]) -> tuple[Numbers, Numbers]:
    return found[0][kept], found[1]


class _Model:
    """The model and its unknowns: changes of the logarithm at the knots, logarithms of the gains, levels, age."""

    def __init__(self, depths_at: Callable[[float], tuple[Numbers, Numbers]], read: Numbers, delay: float) -> None:
        self._depths_at = depths_at
        self._read = read
        self._delay = delay
        self._rounds = 0
        self.noise = USUAL_NOISE
        # Most of a drive is in the open, where the mean is above 0 because readings are cut off at 0.
        levels = np.clip(np.median(read, axis=0) - USUAL_NOISE, 0.0, None)
        self.unknowns = np.concatenate([np.zeros(len(KNOTS) + COUNT), levels, [delay]])

    @property
    def levels(self) -> Numbers:
        """What each sensor reads in the open, counts."""
        return self.unknowns[len(KNOTS) + COUNT : -1]

    def predict(self, unknowns: Numbers, noise: float) -> tuple[Numbers, Numbers]:
        """Return the expected value of each reading, counts, and its derivatives by all unknowns except the age."""
        depth, shares = self._depths_at(float(unknowns[-1]))
        bends, gains = unknowns[: len(KNOTS)], np.exp(unknowns[len(KNOTS) : len(KNOTS) + COUNT])
        below = np.clip(np.searchsorted(KNOTS, depth, side="right") - 1, 0, len(KNOTS) - 2)
        part = (depth - KNOTS[below]) / (KNOTS[below + 1] - KNOTS[below])
        light = shares * usual(depth) * np.exp(bends[below] * (1 - part) + bends[below + 1] * part)
        whole = light.sum(axis=-1)
        mean = gains * whole + unknowns[len(KNOTS) + COUNT : -1]
        slopes = np.zeros((*mean.shape, len(unknowns) - 1))
        rows, columns = np.indices(mean.shape)
        for ray in range(depth.shape[-1]):
            for knot, weight in ((below[..., ray], 1 - part[..., ray]), (below[..., ray] + 1, part[..., ray])):
                slopes[rows, columns, knot] += gains * light[..., ray] * weight  # no place occurs twice
        slopes[rows, columns, len(KNOTS) + columns] = gains * whole
        slopes[rows, columns, len(KNOTS) + COUNT + columns] = 1
        share = _normal(mean / noise)
        cut = mean * share + noise * np.exp(-0.5 * np.square(mean / noise)) / math.sqrt(math.tau)
        return cut, slopes * share[..., None]

    def improve(self) -> float:
        """Do one step of Gauss-Newton; return the largest change of a logarithm."""
        ahead, behind = self.unknowns.copy(), self.unknowns.copy()
        ahead[-1] += 1e-3
        behind[-1] -= 1e-3
        mean, slopes = self.predict(self.unknowns, self.noise)
        by_age = (self.predict(ahead, self.noise)[0] - self.predict(behind, self.noise)[0]) / 2e-3
        slopes = np.concatenate([slopes, by_age[..., None]], axis=-1)
        missed = mean - self._read
        light = np.clip(mean - self.levels, 0, None)
        quiet = missed[(mean > 3 * USUAL_NOISE) & (light < 3 * NEAR)]
        if len(quiet) > MIN_NEAR:
            self.noise = max(1.4826 * float(np.median(np.abs(quiet - np.median(quiet)))), 1.0)
        # Near a wall a fraction of a millimetre matters. The curve falls about as 1/d^2, so its slope is 2/d of itself.
        steep = 2 * light / 0.012 * np.sqrt(light / 1250)
        deviation = np.sqrt(self.noise**2 + (RELATIVE * mean) ** 2 + (POSE_ERROR * steep) ** 2)
        # The errors near something are not known in advance, and most readings are of nothing.
        sees = (light > NEAR / 2) & (self._read < SATURATED)
        scale = np.ones(mean.shape)
        if sees.any():
            scale[sees] = max(1.0, 1.4826 * float(np.median(np.abs(missed / deviation)[sees])))
        off = np.abs(missed) / (deviation * scale) / TUKEY
        # In the first rounds the curve is far from the truth, and all readings keep some weight.
        pull = 1 / (1 + off) if self._rounds < SOFT_ROUNDS else np.where(off < 1, 1 - off**2, 0.0)
        self._rounds += 1
        weight = np.where(self._read < SATURATED, pull, 0.0) / deviation
        rows = (weight[..., None] * slopes).reshape(-1, len(self.unknowns))
        aims = -(weight * missed).ravel()
        prior_rows, prior_aims = self._prior()
        rows, aims = np.vstack([rows, prior_rows]), np.concatenate([aims, prior_aims])
        change = np.linalg.lstsq(rows, aims, rcond=None)[0]
        largest = float(np.abs(change[: len(KNOTS) + COUNT]).max())
        self.unknowns = self.unknowns + change * min(1.0, 1.0 / max(largest, 1e-12))
        self.levels[:] = np.maximum(self.levels, 0.0)  # below it all levels give the same readings
        return largest

    def _prior(self) -> tuple[Numbers, Numbers]:
        """Return what is known in advance, as rows and aims like those of the readings."""
        count, knots = len(self.unknowns), len(KNOTS)
        stiff = np.zeros((knots - 2, count))
        for k in range(knots - 2):
            stiff[k, k : k + 3] = np.array([1, -2, 1]) / STIFFNESS
        free = np.eye(count)[:knots] / FREEDOM
        gains = np.eye(count)[knots : knots + COUNT] / GAINS
        scale = np.zeros((1, count))
        scale[0, knots : knots + COUNT] = 1e3  # the mean gain is 1: a common factor belongs to the curve
        age = np.eye(count)[-1:] / DELAY
        rows = np.vstack([stiff, free, gains, scale, age])
        rest = self.unknowns.copy()
        rest[-1] -= self._delay
        return rows, -(rows @ rest)

    def infrared(self) -> Infrared:
        """Return the curve in the form of a profile."""
        bends = np.interp(SHOWN, KNOTS, self.unknowns[: len(KNOTS)])
        counts = usual(SHOWN) * np.exp(bends)
        # A nearer wall never gives fewer counts.
        counts = np.maximum.accumulate(np.clip(counts, 0, MAX_LIGHT)[::-1])[::-1]
        gains = np.exp(self.unknowns[len(KNOTS) : len(KNOTS) + COUNT])
        knots = tuple((round(float(d), 4), round(float(c), 1)) for d, c in zip(SHOWN, counts, strict=True))
        offsets = tuple(round(max(float(level), 0.0), 2) for level in self.levels)
        return Infrared(knots, round(self.noise, 2), tuple(round(float(gain), 4) for gain in gains), offsets)


def usual(distance: Numbers) -> Numbers:
    """Return the counts of the usual curve at distances in m."""
    found: Numbers = np.interp(distance, np.arange(len(USUAL_RESPONSE)) * SPACING, USUAL_RESPONSE)
    return found


def _normal(value: Numbers) -> Numbers:
    """Return the share of a standard normal distribution below *value* (Page 1977, wrong by 2e-4 at most)."""
    found: Numbers = 0.5 * (1 + np.tanh(0.7978846 * value * (1 + 0.044715 * value * value)))
    return found
