"""Optimisers that propose a population of parameters and learn from its fitness: CMA-ES, genetic algorithm, MAP-Elites.

All have two methods: ``ask()`` returns the next population, ``tell()`` takes its fitness. Between equal seeds and equal
fitness they propose the same numbers, so a study resumes by telling an optimiser again what was recorded.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from elib.base.errors import ArgumentError, Unsupported
from elib.base.extras import install
from elib.base.rules import nearest

Floats: TypeAlias = NDArray[Any]


class Optimiser(Protocol):
    """What proposes individuals and is told how good they are."""

    def ask(self) -> Floats:
        """Return the next population, a row of parameters for each individual."""

    def tell(self, fitness: Floats, descriptors: Floats) -> None:
        """Learn from the population that was asked for last.

        Args:
            fitness: One number for each individual; higher is better.
            descriptors: Two numbers for each individual which say how it behaves, each from -1 to 1.
        """


class Genetic:
    """The genetic algorithm of Floreano and Mondada (1994, table 1; 1996 with other numbers of individuals).

    The genes are real numbers. Fitness is scaled linearly, parents are drawn by a roulette wheel, pairs of them are
    crossed at one point, and genes are changed by small random numbers. A new population takes the place of the whole
    old one: the best is not kept.

    D. Floreano and F. Mondada, "Automatic creation of an autonomous agent: genetic evolution of a neural-network driven
    robot", From Animals to Animats 3, 1994; and "Evolution of homing navigation in a real mobile robot", IEEE
    Transactions on Systems, Man, and Cybernetics B 26(3), 1996.
    """

    CROSSOVER = 0.1
    """Probability that a pair of parents is crossed (1994, table 1)."""
    MUTATION = 0.2
    """Probability that a gene is changed (1994, table 1)."""
    MUTATION_RANGE = 0.5
    """A changed gene moves by a number drawn evenly from -0.5 to 0.5 (1994, table 1)."""
    INITIAL_RANGE = 0.5
    """First genes are drawn evenly from -0.5 to 0.5; later ones are not bounded (1994, table 1)."""
    BEST_COPIES = 2.0
    """Copies that the best individual gets on average. The papers do not give it; Goldberg (1989) has 1.2 to 2."""

    def __init__(self, size: int, population: int, seed: int) -> None:
        """Draw the first population of *population* individuals with *size* genes."""
        self._random = np.random.default_rng(seed)
        self._genes: Floats = self._random.uniform(-self.INITIAL_RANGE, self.INITIAL_RANGE, (population, size))

    def ask(self) -> Floats:
        """Return the next population."""
        return self._genes

    def tell(self, fitness: Floats, descriptors: Floats) -> None:
        """Make the next population from this one."""
        count, size = self._genes.shape
        shares = scaled(fitness, self.BEST_COPIES)
        genes = self._genes[self._random.choice(count, count, p=shares / shares.sum())]
        pairs = count // 2
        is_crossed = self._random.random(pairs) < self.CROSSOVER
        cuts = self._random.integers(1, max(size, 2), pairs)
        for pair in is_crossed.nonzero()[0]:
            first, second, cut = 2 * pair, 2 * pair + 1, cuts[pair]
            genes[[first, second], cut:] = genes[[second, first], cut:]
        is_changed = self._random.random((count, size)) < self.MUTATION
        genes += is_changed * self._random.uniform(-self.MUTATION_RANGE, self.MUTATION_RANGE, (count, size))
        self._genes = genes


def scaled(fitness: Floats, best_copies: float) -> Floats:
    """Return how many copies each individual gets on average, by Goldberg's linear scaling.

    The mean individual gets one copy and the best one *best_copies*; less if the worst one would get less than none.
    """
    mean, low, high = fitness.mean(), fitness.min(), fitness.max()
    if not high > mean > low:  # All are equally good, or differ by less than a float can tell.
        return np.ones(len(fitness))
    slope = min((best_copies - 1) / (high - mean), 1 / (mean - low))
    copies: Floats = np.maximum(1 + slope * (fitness - mean), 0.0)
    return copies


class CmaEs:
    """CMA-ES by the package ``cmaes``. If a search has converged, the next one begins somewhere else."""

    SIGMA = 0.5
    """Standard deviation of the first weights. Twice as much saturates most neurons, where a search learns little: 7 of
    10 seeds learned to follow a line, and 9 do so with this one."""

    def __init__(self, size: int, population: int, seed: int) -> None:
        """Begin around zero weights."""
        self._random = np.random.default_rng(seed)
        self._population = population
        self._search = self._begin(np.zeros(size))

    def _begin(self, mean: Floats) -> Any:
        try:
            from cmaes import CMA
        except ImportError:
            raise Unsupported("CMA-ES needs the package cmaes, which is not installed", hint=install("learn")) from None
        seed = int(self._random.integers(1 << 32))
        return CMA(mean=mean, sigma=self.SIGMA, population_size=self._population, seed=seed)

    def ask(self) -> Floats:
        """Return the next population."""
        self._asked = np.array([self._search.ask() for _ in range(self._population)])
        return self._asked

    def tell(self, fitness: Floats, descriptors: Floats) -> None:
        """Move the search to where the fitness is higher."""
        # cmaes looks for the lowest value.
        self._search.tell([(row, -value) for row, value in zip(self._asked, fitness.tolist(), strict=True)])
        if self._search.should_stop():
            self._search = self._begin(self._random.normal(0.0, self.SIGMA, self._search.dim))


class MapElites:
    """MAP-Elites by the package ``ribs``: of each kind of behaviour the best one is kept.

    The archive is a grid over the mean speeds of the left and the right wheel. New individuals are elites, moved by
    noise and towards another elite.

    J.-B. Mouret and J. Clune, "Illuminating search spaces by mapping elites", 2015; V. Vassiliades and J.-B. Mouret,
    "Discovering the elite hypervolume by leveraging interspecies correlation", GECCO 2018.
    """

    CELLS = 20
    """Cells of the archive in each direction: 0.1 of the top speed."""
    NOISE = 0.1
    """Standard deviation of what is added to each weight."""
    TOWARDS = 0.2
    """Standard deviation of how far an elite is moved towards another one (Vassiliades and Mouret 2018)."""

    def __init__(self, size: int, population: int, seed: int) -> None:
        """Begin with random weights."""
        try:
            from ribs.archives import GridArchive
            from ribs.emitters import IsoLineEmitter
        except ImportError:
            raise Unsupported(
                "MAP-Elites needs the package ribs, which is not installed",
                hint="install it with pip install ribs, or choose --algorithm cma or ga",
            ) from None
        draws = np.random.default_rng(seed)
        first, second = (int(each) for each in draws.integers(1 << 32, size=2))
        square = [(-1.0, 1.0), (-1.0, 1.0)]
        self.archive = GridArchive(solution_dim=size, dims=(self.CELLS, self.CELLS), ranges=square, seed=first)
        self._emitter = IsoLineEmitter(
            self.archive,
            iso_sigma=self.NOISE,
            line_sigma=self.TOWARDS,
            initial_solutions=draws.normal(0.0, 1.0, (population, size)),
            batch_size=population,
            seed=second,
        )

    def ask(self) -> Floats:
        """Return the next population."""
        asked: Floats = self._emitter.ask()
        self._asked = asked
        return asked

    def tell(self, fitness: Floats, descriptors: Floats) -> None:
        """Put those into the archive that are better than what is in their cell."""
        self.archive.add(self._asked, fitness, descriptors)


ALGORITHMS: dict[str, Callable[[int, int, int], Optimiser]] = {"cma": CmaEs, "ga": Genetic, "map-elites": MapElites}
"""The optimisers by the names that ``elib evolve --algorithm`` takes: functions of size, population and seed."""


def optimiser(algorithm: str, size: int, population: int, seed: int) -> Optimiser:
    """Return a new optimiser, for individuals of *size* parameters. All its random numbers follow from the seed.

    Raises:
        ArgumentError: There is no such algorithm, or it cannot work with so few individuals or parameters.
        Unsupported: Its package is not installed.
    """
    if algorithm not in ALGORITHMS:
        raise ArgumentError(f"there is no algorithm {algorithm!r}", hint=nearest(algorithm, ALGORITHMS))
    if algorithm == "cma" and population < 4:
        raise ArgumentError(f"the population is {population}; CMA-ES needs 4 or more", hint="give --population 20")
    return ALGORITHMS[algorithm](size, population, seed)
