"""How much a simulated robot is like a recorded one: a score for each sensor, for the path and for the link.

The recorded drive is played to two virtual robots that differ in nothing but the seed of their noise. With

* ``difference``, the root mean square of recorded minus simulated readings,
* ``noise``, the same between the two simulated robots: what noise alone makes,
* ``spread``, the standard deviation of the recorded readings over the drive,

all as the root mean square over the fields of a sensor, the score is

    1 - (difference - noise) / max(spread, noise, 1)

cut to 0..1: 1 for a robot that differs from the simulated one no more than that from its twin, 0 for one that differs
as much as the readings change over the whole drive. The 1 is one count. For the path the same is done with places in
the plane, in m and without the 1; for the link with the medians of the round trips of each command, where the spread
is the longer one of both medians. A path has no score where noise alone is more than a quarter of the spread: a link
that is late by chance turns the robot by chance, and everything behind each turn with it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from elib.calibration.comparison import Comparison, Run, compare, distances, run_of
from elib.calibration.rerun import SEEDS, rerun
from elib.calibration.series import Numbers, Series
from elib.emulator.robotprofile import RobotProfile
from elib.recording import Recording

COUNT = 1.0
"""Resolution of the readings."""
MOST_CHANCE = 0.25
"""Share of a path's spread by which two simulated robots may be apart: with more, chance decides where a robot comes
to, and no path says whether the simulator is right."""


@dataclass(frozen=True, slots=True)
class Score:
    """How much one thing is alike.

    Attributes:
        name: Of the sensor; ``path`` or ``latency``.
        value: 0..1; nan where there is nothing to compare.
        difference: Recorded minus simulated, root mean square, in the sensor's own counts; m for the path; s for the
            latency, as the mean over calls of what the medians differ by.
        noise: The same between two simulated robots.
        spread: What the difference is measured by.
    """

    name: str
    value: float
    difference: float
    noise: float
    spread: float


@dataclass(frozen=True, slots=True)
class Parity:
    """A recorded drive beside the simulator.

    Attributes:
        comparison: Of the drive and the first simulated one.
        scores: Sensors first, then the path and the link.
        fields: Scores of each field of a sensor, by reading and field.
        left_out: Texts of calls that could not be played.
        skipped: Readings that were not played, for the line was still busy.
    """

    comparison: Comparison
    scores: tuple[Score, ...]
    fields: dict[tuple[str, str], Score]
    left_out: tuple[str, ...]
    skipped: int = 0


def parity(
    recording: Recording,
    *,
    profile: RobotProfile | None = None,
    world: str | None = None,
    progress: Callable[[str], object] = lambda text: None,
) -> Parity:
    """Compare a recorded drive with the simulator.

    Args:
        recording: Of the drive.
        profile: What the simulated robot is like; a nominal one unless given.
        world: Where it drives; the recorded world unless given.
        progress: Told what is being done.

    Raises:
        ArgumentError: There is no world, or the robot cannot stand where it was recorded.
        LinkNotFound: There is no such world.
        SimulationError: The world's file breaks a rule.
    """
    seed = int(recording.about.get("seed", "0"))
    progress("reading the recording")
    real = run_of(recording)
    runs: list[Run] = []
    left_out: tuple[str, ...] = ()
    skipped = 0
    for number in (1, 2):
        progress(f"playing it to virtual robot {number} of 2")
        with rerun(recording, profile=profile, world=world, seed=(seed + number) % SEEDS) as drive:
            runs.append(run_of(drive.recording))
            left_out, skipped = drive.left_out, max(skipped, drive.skipped)
    model, twin = runs
    fields: dict[tuple[str, str], Score] = {}
    scores = []
    for name in sorted(real.readings.keys() & model.readings.keys() & twin.readings.keys()):
        parts = list(field_parts(real.readings[name], model.readings[name], twin.readings[name]))
        if not parts:
            continue
        fields |= {(name, field): _score(field, part) for field, part in parts}
        scores.append(_score(name, np.mean([part for _, part in parts], axis=0)))
    scores += [path_score(real, model, twin), latency_score(real, model, twin)]
    return Parity(compare(real, model), tuple(scores), fields, left_out, skipped)


def field_parts(real: Series, model: Series, twin: Series) -> Iterator[tuple[str, Numbers]]:
    """Yield for each field its name and the mean squares of difference, noise and spread; zeros without readings."""
    theirs, others = model.at(real.times), twin.at(real.times)
    for k, field in enumerate(real.fields):
        if field not in model.fields or field not in twin.fields:
            continue
        ours = real.values[:, k]
        first, second = theirs[:, model.fields.index(field)], others[:, twin.fields.index(field)]
        is_known = ~(np.isnan(ours) | np.isnan(first) | np.isnan(second))
        if is_known.any():
            off, noise = (ours - first)[is_known], (first - second)[is_known]
            spread = float(np.var(ours[is_known]))
            yield field, np.array([np.mean(off**2), np.mean(noise**2), max(spread, COUNT)])


def path_score(real: Run, model: Run, twin: Run) -> Score:
    """Return the score of the path: measured where the recording has it, else by the step counters."""
    is_measured = real.measured is not None
    ours, theirs, others = ((run.measured if is_measured else run.odometry) for run in (real, model, twin))
    if ours is None or theirs is None or others is None:
        return Score("path", math.nan, math.nan, math.nan, math.nan)
    off, noise = distances(ours, theirs), distances(theirs, others)
    if not len(off) or not len(noise):
        return Score("path", math.nan, math.nan, math.nan, math.nan)
    spread = float(ours.values[:, :2].var(axis=0).sum())
    score = _score("path", np.array([np.mean(off**2), np.mean(noise**2), spread]), floor=0.0)
    return replace(score, value=math.nan) if score.noise > MOST_CHANCE * score.spread else score


def latency_score(real: Run, model: Run, twin: Run) -> Score:
    """Return the score of the link."""
    rows = []
    for name in sorted(real.commands.keys() & model.commands.keys() & twin.commands.keys()):
        ours, theirs, others = (run.commands[name].quantile(0.5) for run in (real, model, twin))
        if not math.isnan(ours + theirs + others):
            weight = real.commands[name].calls
            rows.append(
                [weight, weight * abs(ours - theirs), weight * abs(theirs - others), weight * max(ours, theirs)]
            )
    if not rows:
        return Score("latency", math.nan, math.nan, math.nan, math.nan)
    weight, off, noise, spread = np.sum(rows, axis=0)
    return Score(
        "latency",
        _value(float(off / weight), float(noise / weight), float(spread / weight)),
        float(off / weight),
        float(noise / weight),
        float(spread / weight),
    )


def _score(name: str, squares: Numbers, *, floor: float = COUNT) -> Score:
    difference, noise, spread = (math.sqrt(float(each)) for each in squares)
    return Score(name, _value(difference, noise, max(spread, noise, floor)), difference, noise, spread)


def _value(difference: float, noise: float, spread: float) -> float:
    if spread == 0:
        return 1.0 if difference <= noise else 0.0
    return min(max(1 - max(difference - noise, 0.0) / spread, 0.0), 1.0)
