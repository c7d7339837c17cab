"""The loop of an evolution: ask the optimiser, let its individuals play, record their fitness, tell the optimiser."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from elib.base.errors import ElibError
from elib.learn.champion import Champion
from elib.learn.executor import Executor
from elib.learn.optimisers import Floats
from elib.learn.progress import Best
from elib.learn.study import BEST, Evaluation, Generation, Settings, Study, check_fitness, digest_of, evaluate
from elib.simulator.physics.episodes import Scores

JOB_TICKS = 4_000_000
"""Robot-ticks of one job: about a second of one core, so that a bar moves and Ctrl-C does not wait long."""

JOBS_A_WORKER = 2
"""Jobs of a generation for each worker, at least: the last one to end keeps the others waiting less."""

FINALISTS = 10
"""How many of the best individuals play the final test: fitness in one generation is partly luck."""

TEST_EPISODES = 20
"""Episodes of the final test that each finalist plays, with seeds that no generation had."""

TEST = 1 << 31
"""Stands for the final test where a generation's number stands otherwise."""


class Result(NamedTuple):
    """How a study ended: the finalist with the highest mean fitness in the final test."""

    best: Best  # with the fitness in its own generation
    fitness: float  # mean over the episodes of the final test
    solved: float  # the part of these episodes in which the task was solved


class Evolution:
    """An evolution in the folder of an open study; what is recorded there is not played again.

    The result does not depend on the executor. *told* is called with how many jobs of a generation are done, and how
    many there are.

    Attributes:
        evaluation: What gives fitness; that of the study's settings unless it is given.
        bests: The best individuals of all generations so far, the highest fitness first, some of them.
    """

    def __init__(
        self,
        study: Study,
        executor: Executor,
        *,
        evaluation: Evaluation | None = None,
        told: Callable[[int, int], object] = lambda done, jobs: None,
    ) -> None:
        self.evaluation = study.settings.evaluation() if evaluation is None else evaluation
        self.bests: list[Best] = []
        self._study = study
        self._executor = executor
        self._told = told

    def run(self) -> Iterator[tuple[Generation, Floats]]:
        """Yield each generation, the recorded ones too, and the parameters of its individuals.

        Raises:
            ArgumentError: A reward is not a finite number.
            ElibError: A job fails, the folder cannot be written, or the optimiser does not propose what is recorded.
        """
        study = self._study
        settings = study.settings
        recorded = len(study.generations)
        for generation, population in replay(settings, study.generations, self.evaluation.controller.size, self._play):
            best = Best(generation.generation, generation.fitness[generation.best], population[generation.best].copy())
            is_better = not self.bests or best.fitness > self.bests[0].fitness
            # The sort is stable: of equal ones the earlier generation stays in front.
            self.bests = sorted([*self.bests, best], key=lambda each: -each.fitness)[:FINALISTS]
            if generation.generation == recorded or (is_better and generation.generation > recorded):
                self._save(self.bests[0], self.bests[0].fitness)
            yield generation, population

    def finish(self) -> Result:
        """Let the best individuals play the final test, save the winner as best.toml, and return the result.

        Raises:
            ArgumentError: A reward is not a finite number; best.toml stays as it is.
            ElibError: A job fails, or the folder cannot be written.
        """
        seeds = self._study.settings.seeds(TEST, TEST_EPISODES)
        scores = self._scores(np.array([each.parameters for each in self.bests]), seeds)
        means = scores.fitness.mean(axis=1)
        for each, mean in zip(self.bests, means.tolist(), strict=True):
            whose = f"of the best individual of generation {each.generation} in the final test"
            check_fitness(mean, whose, self.evaluation)
        winner = int(means.argmax())
        best, fitness = self.bests[winner], float(means[winner])
        solved = float((scores.fitness[winner] >= self.evaluation.task.solved).mean())
        self._save(best, fitness)
        counts = {"episodes": TEST_EPISODES, "generations": len(self._study.generations)}
        self._study.note({"generation": best.generation, "fitness": fitness, "solved": solved, **counts})
        return Result(best, fitness, solved)

    def _play(self, number: int, population: Floats) -> Generation:
        """Let a generation play, and record it."""
        settings, task = self._study.settings, self.evaluation.task
        seeds = settings.seeds(number, settings.scenarios)
        scores = self._scores(population, seeds)
        speeds = scores.steps.mean(axis=1) / (task.top_steps * task.seconds)
        played = (scores.fitness.mean(axis=1), speeds[:, 0], speeds[:, 1])
        generation = Generation(number, digest_of(population), seeds, *(each.tolist() for each in played))
        for individual, fitness in enumerate(generation.fitness):
            check_fitness(fitness, f"of individual {individual} in generation {number}", self.evaluation)
        self._study.append(generation)
        return generation

    def _scores(self, population: Floats, seeds: list[int]) -> Scores:
        """Return what individuals earn. They are evaluated in parts; the result does not depend on how many."""
        task, width = self.evaluation.task, self._executor.width
        ticks = len(population) * len(seeds) * task.ticks * task.robots
        count = max(math.ceil(ticks / JOB_TICKS), JOBS_A_WORKER * width if width > 1 else 1)
        parts = np.array_split(population, min(count, len(population)))
        jobs = [(self.evaluation, part, seeds, self._executor.threads) for part in parts]
        found: list[Scores] = [Scores(np.empty(0), np.empty(0))] * len(parts)
        self._told(0, len(parts))
        try:
            for done, (k, scores) in enumerate(self._executor.run(evaluate, jobs), start=1):
                found[k] = scores
                self._told(done, len(parts))
        except ElibError as error:
            if isinstance(error.__cause__, ElibError):  # It names the task; the number of the job says nothing more.
                raise error.__cause__ from None
            raise
        return Scores(*(np.concatenate([each[k] for each in found]) for k in (0, 1)))

    def _save(self, best: Best, fitness: float) -> None:
        settings, task = self._study.settings, self.evaluation.task
        champion = Champion(
            task=settings.task,
            controller=settings.controller,
            hidden=settings.hidden,
            sensors=self.evaluation.controller.sensors,
            period=task.period,
            top_speed=task.top_speed,
            parameters=tuple(best.parameters.tolist()),
            seed=settings.seed,
            generation=best.generation,
            fitness=fitness,
        )
        champion.save(self._study.folder / BEST)


def replay(
    settings: Settings,
    recorded: list[Generation],
    size: int,
    play: Callable[[int, Floats], Generation] | None = None,
) -> Iterator[tuple[Generation, Floats]]:
    """Yield each generation and the parameters of its individuals, which the optimiser finds again.

    *play* plays a generation that is not recorded, from its number and population; None means to end there.
    """
    search = settings.optimiser(size)
    before = len(recorded)  # *play* may add to the list.
    for number in range(1, settings.generations + 1):
        population = search.ask()
        if number <= before:
            generation = recorded[number - 1]
            if generation.population != digest_of(population):
                raise ElibError(
                    f"generation {number} cannot be found again: the optimiser proposes other individuals",
                    hint="install the versions that study.toml names, or begin another study",
                )
        elif play is None:
            return
        else:
            generation = play(number, population)
        yield generation, population
        search.tell(np.array(generation.fitness), np.array([generation.left, generation.right]).T)
