"""How far an evolution has come: what its page shows while it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from time import perf_counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elib.simulator.physics.controller import Controller
from elib.simulator.physics.task import Task

RECENT = 20
"""Generations from whose time the time left is told: earlier ones may have come from a checkpoint, at once."""


class Spread(NamedTuple):
    """How the fitness of one generation is spread over its individuals."""

    best: float
    upper: float  # A quarter of the individuals are better.
    mean: float
    lower: float  # A quarter of the individuals are worse.
    lowest: float


class Best(NamedTuple):
    """A controller that was better than all before it; the first generation is generation 1."""

    generation: int
    fitness: float
    parameters: NDArray[np.float64]


@dataclass
class Progress:
    """How far an evolution has come. The evolution writes it and waits for no one; any thread may read it."""

    task: Task
    controller: Callable[[NDArray[np.float64]], Controller]
    generations: int  # how many there will be
    settings: Mapping[str, object]  # what else a person wants to know: {"optimiser": "CMA-ES", "seed": 1}
    done: list[Spread] = field(default_factory=list)  # the generations so far, oldest first
    bests: list[Best] = field(default_factory=list)  # each better than all before it, at last the final test's winner
    outcome: str = ""  # why the evolution ended, for a person; empty while it runs
    _times: list[float] = field(default_factory=lambda: [perf_counter()])

    def add(self, fitness: NDArray[np.float64], population: NDArray[np.float64]) -> None:
        """Note one more generation: the fitness of each individual, (P,), and their parameters, (P, n)."""
        best = int(np.argmax(fitness))
        lowest, lower, upper = np.quantile(fitness, (0, 0.25, 0.75)).tolist()
        if not self.bests or fitness[best] > self.bests[-1].fitness:
            self.bests.append(Best(len(self.done) + 1, float(fitness[best]), population[best].copy()))
        self.done.append(Spread(float(fitness[best]), upper, float(fitness.mean()), lower, lowest))
        self._times = [*self._times[-RECENT:], perf_counter()]

    @property
    def seconds_left(self) -> float:
        """How long the rest will take if it goes on as it did, s; 0 before the first generation and after the end."""
        times = self._times
        remaining = 0 if self.outcome else self.generations - len(self.done)
        return remaining * (times[-1] - times[0]) / max(len(times) - 1, 1)

    def end(self, outcome: str, winner: Best | None = None) -> None:
        """Note why the evolution has ended, and who won the final test: that is the best from now on."""
        if winner is not None:
            self.bests.append(winner)
        self.outcome = outcome
