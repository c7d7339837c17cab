"""Virtual robots beside real ones: each quantity that was measured on robots, measured on drawn virtual robots too.

The **score** is the mean over the quantities of the share of their conditions that are inside: where what is compared
lies within what robots have. All quantities weigh the same; those whose confidence is low do not count.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np

from elib.base.quantiles import quantile
from elib.base.rules import SEED, Whole
from elib.records.reader import Recording
from elib.robot.running import run_coroutine
from elib.simulator.physics import EpuckModel
from elib.studies.reality.bench import WHITE, NotMeasured, bench, url_of
from elib.studies.reality.figures import COUNTED, FIRMWARES, Figure, Quantity, reference
from elib.studies.reality.measures import WAYS, Of, colour_of
from elib.studies.reality.session import Recorded
from elib.studies.rerun import SEEDS

ROBOTS = 12
"""Virtual robots that are drawn, unless told otherwise."""

MAX_ROBOTS = 1000

SHARES = (0.05, 0.5, 0.95)


@dataclass(frozen=True, slots=True)
class Condition:
    """One condition of a quantity."""

    robots: Figure  # what real robots have
    # the 5th, 50th and 95th percentile of virtual robots; empty where all of them make one figure
    simulator: tuple[float, ...]
    compared: float  # the figure of the virtual robots that is compared; nan if none could be measured
    own: float  # the same figure of a robot that was recorded; nan without one

    @property
    def is_inside(self) -> bool:
        """Whether the simulator is within the limits of the robots."""
        return self.place_of(self.compared) == "inside"

    def place_of(self, value: float) -> str:
        """Return in a word where a value is beside the limits of the robots."""
        if math.isnan(value):
            return "none"
        return "below" if value < self.robots.low else "above" if value > self.robots.high else "inside"


@dataclass(frozen=True, slots=True)
class Beside:
    """One quantity of robots and simulator."""

    quantity: Quantity  # what robots have
    confidence: str  # how far that can be trusted
    conditions: tuple[Condition, ...]  # both sides in each condition

    @property
    def counts(self) -> bool:
        """Whether it counts in the score."""
        return self.confidence in COUNTED

    @property
    def why(self) -> str:
        """Why it is apart, as far as that is known of typical robots."""
        return reference().apart.get(self.quantity.key, "not known")

    @property
    def share(self) -> float:
        """The share of its conditions that are inside."""
        return sum(each.is_inside for each in self.conditions) / len(self.conditions)


@dataclass(frozen=True, slots=True)
class Realism:
    """All quantities."""

    quality: str  # how good the virtual robots were
    robots: int  # how many were drawn
    seed: int  # by which seed
    quantities: tuple[Beside, ...]  # every quantity that was measured
    own: str = ""  # name of the recording of a robot; empty without one

    @property
    def shown(self) -> list[Beside]:
        """The quantities of a table: those that the recording has, if there is one."""
        return [
            each for each in self.quantities if not self.own or not all(math.isnan(it.own) for it in each.conditions)
        ]

    @property
    def counted(self) -> list[Beside]:
        """The quantities that count."""
        return [each for each in self.quantities if each.counts]

    @property
    def apart(self) -> dict[str, list[str]]:
        """The keys of the quantities that count and are not inside in all conditions, by the reason."""
        found: dict[str, list[str]] = {}
        for each in self.counted:
            if each.share < 1:
                found.setdefault(each.why, []).append(each.quantity.key)
        return found

    @property
    def score(self) -> float:
        """The mean share of conditions inside, over the quantities that count."""
        return math.fsum(each.share for each in self.counted) / len(self.counted)


def realism(
    *,
    quality: str = "typical",
    robots: int = ROBOTS,
    seed: int = 1,
    recording: Recording | None = None,
    progress: Callable[[str], object] = lambda text: None,
) -> Realism:
    """Measure virtual robots as real ones were measured, and put both side by side.

    Args:
        quality: How good they are: ``ideal``, ``good``, ``typical`` or ``bad``.
        robots: How many are drawn, 1..1000.
        seed: By which seed; the same seed gives the same figures.
        recording: One robot that stands beside them, as ``elib record --reality`` recorded it.
        progress: Called with what is being done.
    """
    EpuckModel(quality=quality)
    Whole(1, MAX_ROBOTS).require(robots, "robots")
    SEED.require(seed, "seed")
    wanted = reference().quantities.values()
    own = empty(wanted) if recording is None else asyncio.run(of_recording(Recorded(recording), wanted))
    found = empty(wanted)

    async def measure(url: str, quantities: Sequence[Quantity]) -> None:
        async with bench(url) as stand:
            for it in quantities:
                for values, figure in zip(found[it.key], it.figures, strict=True):
                    values += map(float, await WAYS[it.key].measure(stand, figure.condition))

    with tempfile.TemporaryDirectory(prefix="elib-") as folder:
        for number in range(robots):
            progress(f"measuring virtual robot {number + 1} of {robots}")
            for (kind, papers), quantities in _sessions(wanted).items():
                drawn = (seed + number) % SEEDS
                url = url_of(FIRMWARES[kind], quality=quality, seed=drawn, papers=papers, folder=Path(folder))
                run_coroutine(partial(measure, url, quantities), "max")
    beside = tuple(_beside(it, found[it.key], own[it.key]) for it in wanted)
    return Realism(quality, robots, seed, beside, "" if recording is None else recording.name)


Found: TypeAlias = dict[str, list[list[float]]]
"""What was measured, by the keys of quantities: the values of each condition."""


def empty(wanted: Iterable[Quantity]) -> Found:
    """Return what was measured before anything was."""
    return {it.key: [[] for _ in it.figures] for it in wanted}


async def of_recording(robot: Recorded, wanted: Iterable[Quantity]) -> Found:
    """Return what a recording says of a robot; the values of a condition that it was not in are missing."""
    found = empty(wanted)
    for it in wanted:
        for values, figure in zip(found[it.key], it.figures, strict=True):
            with contextlib.suppress(NotMeasured):
                if robot.has(it):
                    values += map(float, await WAYS[it.key].measure(robot, figure.condition))
    return found


def _sessions(wanted: Iterable[Quantity]) -> dict[tuple[str, tuple[str, ...]], list[Quantity]]:
    """Return the quantities that one robot is measured for: by its kind, and the papers of its floor."""
    wanted = list(wanted)
    papers = {colour_of(each.condition) for it in wanted if it.sensor == "ground" for each in it.figures}
    sheets = tuple(sorted(each for each in papers if each.startswith("#") and each != WHITE))
    found: dict[tuple[str, tuple[str, ...]], list[Quantity]] = {}
    for it in wanted:
        found.setdefault((it.robot, sheets if it.sensor == "ground" else ()), []).append(it)
    return found


def _beside(quantity: Quantity, found: Sequence[Sequence[float]], own: Sequence[Sequence[float]]) -> Beside:
    of = WAYS[quantity.key].of
    cases = zip(quantity.figures, found, own, strict=True)
    conditions = tuple(
        Condition(figure, percentiles(values) if of == "median" else (), one_of(values, of), one_of(mine, of))
        for figure, values, mine in cases
    )
    return Beside(quantity, reference().confidence(quantity), conditions)


def percentiles(values: Sequence[float]) -> tuple[float, ...]:
    """Return the 5th, 50th and 95th; nothing of no values."""
    return tuple(quantile(values, share) for share in SHARES) if values else ()


def one_of(values: Sequence[float], of: Of) -> float:
    """Return the median, the mean or the standard deviation; nan of no values, or of one that has no deviation."""
    if len(values) < (2 if of == "spread" else 1):
        return math.nan
    return float(np.std(values) if of == "spread" else np.mean(values) if of == "mean" else np.median(values))
