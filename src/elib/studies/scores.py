"""Parity: scores of how well a simulated robot matches a recorded one, for each sensor, the path and the link.

The recorded drive is run again on two virtual robots that differ only in the seed of their noise. There are

* ``difference``, the root mean square of recorded minus simulated readings,
* ``noise``, the same between the two simulated robots: the effect of noise alone,
* ``spread``, the standard deviation of the recorded readings over the drive,

each as the root mean square over the fields of a sensor. The score is

    1 - (difference - noise) / max(spread, noise, 1)

limited to 0..1. A robot that differs from the simulated robot no more than the second simulated robot scores 1; one
that differs as much as the readings change over the whole drive scores 0. The number 1 in the formula is one count. For
the path, the same is done with positions in m, without the 1; for the link, with the medians of the round trips of each
command, and the spread is the longer of both medians. A path has no score if noise alone is more than a quarter of the
spread: a random delay of the link turns the robot by a random angle, and that changes all positions after it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from elib.records.reader import Recording
from elib.simulator.emulator.robotprofile import RobotProfile
from elib.studies.comparison import Comparison, Run, compare, distances, run_of
from elib.studies.rerun import SEEDS, rerun
from elib.studies.series import Numbers, Series, common_fields

COUNT = 1.0
"""Resolution of the readings."""
MAX_CHANCE = 0.25
"""Largest distance of two simulated robots, as a share of a path's spread. If it is larger, chance decides where a
robot goes, and the path does not show whether the simulator is right."""


@dataclass(frozen=True, slots=True)
class Score:
    """The score of a sensor, the path or the link.

    Attributes:
        name: Name of the sensor, or ``path`` or ``latency``.
        value: The score, 0..1; nan if there is nothing to compare.
        difference: Root mean square of recorded minus simulated, in counts of the sensor; m for the path; for the
            latency, the mean difference of the medians, s, weighted by the number of calls.
        noise: The difference between the two simulated robots, computed in the same way.
        spread: The number by which the difference is divided.
    """

    name: str
    value: float
    difference: float
    noise: float
    spread: float


@dataclass(frozen=True, slots=True)
class Parity:
    """Comparison of a recorded drive with the simulator.

    Attributes:
        comparison: Comparison of the drive with the first simulated one.
        scores: Scores of the sensors, then of the path and the link.
        fields: Score of each field of a sensor, by reading and field.
        left_out: Texts of the calls that could not be made again.
        skipped: Number of readings that were not asked for because the line was busy.
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
        recording: Recording of the drive.
        profile: Profile of the simulated robot; a nominal robot unless given.
        world: World in which it drives; the recorded world unless given.
        progress: Called with what is being done.

    Raises:
        ArgumentError: There is no world, or the robot has no room at its recorded place.
        LinkNotFound: The world does not exist.
        SimulationError: The world file breaks a rule.
    """
    seed = int(recording.about.get("seed", "0"))
    progress("reading the recording")
    real = run_of(recording)
    runs: list[Run] = []
    left_out: tuple[str, ...] = ()
    skipped = 0
    for number in (1, 2):
        progress(f"driving again on virtual robot {number} of 2")
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
    """Yield the name of each field and the mean squares of difference, noise and spread."""
    for field, (ours, theirs, others) in common_fields(real, model, twin):
        if len(ours):
            off, noise = ours - theirs, theirs - others
            yield field, np.array([np.mean(off**2), np.mean(noise**2), max(float(np.var(ours)), COUNT)])


def path_score(real: Run, model: Run, twin: Run) -> Score:
    """Return the score of the measured path, or of the path by the step counters if none was measured."""
    is_measured = real.measured is not None
    ours, theirs, others = ((run.measured if is_measured else run.odometry) for run in (real, model, twin))
    if ours is None or theirs is None or others is None:
        return Score("path", math.nan, math.nan, math.nan, math.nan)
    off, noise = distances(ours, theirs), distances(theirs, others)
    if not len(off) or not len(noise):
        return Score("path", math.nan, math.nan, math.nan, math.nan)
    spread = float(ours.values[:, :2].var(axis=0).sum())
    score = _score("path", np.array([np.mean(off**2), np.mean(noise**2), spread]), floor=0.0)
    return replace(score, value=math.nan) if score.noise > MAX_CHANCE * score.spread else score


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
    calls, *sums = map(float, np.sum(rows, axis=0))
    off, noise, spread = (each / calls for each in sums)
    return Score("latency", _value(off, noise, spread), off, noise, spread)


def _score(name: str, squares: Numbers, *, floor: float = COUNT) -> Score:
    difference, noise, spread = (math.sqrt(float(each)) for each in squares)
    return Score(name, _value(difference, noise, max(spread, noise, floor)), difference, noise, spread)


def _value(difference: float, noise: float, spread: float) -> float:
    if spread == 0:
        return 1.0 if difference <= noise else 0.0
    return min(max(1 - max(difference - noise, 0.0) / spread, 0.0), 1.0)
