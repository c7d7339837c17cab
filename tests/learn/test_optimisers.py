"""The optimisers find what is better, propose the same from the same seed, and say what they miss."""

import builtins
import importlib.util

import numpy as np
import pytest

from elib.base.errors import ArgumentError, Unsupported
from elib.learn.optimisers import ALGORITHMS, Genetic, Optimiser, optimiser, scaled

SIZE = 6
GOAL = np.linspace(-1, 1, SIZE)

needs_ribs = pytest.mark.skipif(
    importlib.util.find_spec("ribs") is None, reason="ribs is not installed: pip install ribs"
)
EACH = [pytest.param(name, marks=needs_ribs if name == "map-elites" else ()) for name in ALGORITHMS]


def toy(population: np.ndarray) -> np.ndarray:
    return -((population - GOAL) ** 2).sum(axis=1)


def told(search: Optimiser, generations: int) -> list[np.ndarray]:
    asked = []
    for _ in range(generations):
        population = search.ask().copy()
        asked.append(population)
        search.tell(toy(population), np.tanh(population[:, :2]))
    return asked


@pytest.mark.parametrize("name", EACH)
def test_a_population_becomes_better(name: str) -> None:
    asked = told(optimiser(name, SIZE, 40, seed=1), 60)
    assert all(population.shape == (40, SIZE) for population in asked)
    assert toy(asked[-1]).max() > toy(asked[0]).max() / 2
    assert toy(asked[-1]).mean() > toy(asked[0]).mean()


@pytest.mark.parametrize("name", EACH)
def test_the_same_seed_and_fitness_give_the_same_individuals_to_the_last_bit(name: str) -> None:
    one, again, other = (told(optimiser(name, SIZE, 10, seed), 12) for seed in (5, 5, 6))
    assert [each.tobytes() for each in one] == [each.tobytes() for each in again]
    assert one[0].tobytes() != other[0].tobytes()


def test_a_genetic_algorithm_begins_in_the_range_of_the_paper_and_may_leave_it() -> None:
    asked = told(optimiser("ga", SIZE, 100, seed=2), 40)
    assert abs(asked[0]).max() <= 0.5
    assert abs(asked[0]).max() > 0.49
    assert abs(asked[-1]).max() > 0.5


def test_a_gene_is_changed_with_the_probability_and_the_range_of_the_paper() -> None:
    search = Genetic(SIZE, 2000, seed=3)
    before = search.ask().copy()
    before[:] = before[0]  # All are equal, so crossing changes nothing.
    search._genes[:] = before
    search.tell(np.zeros(2000), np.zeros((2000, 2)))
    moves = search.ask() - before
    assert (moves != 0).mean() == pytest.approx(0.2, abs=0.02)
    assert abs(moves).max() == pytest.approx(0.5, abs=0.01)


def test_a_pair_is_crossed_at_one_point(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Genetic, "MUTATION", 0.0)
    search = Genetic(SIZE, 2000, seed=4)
    search._genes[:] = np.arange(2000)[:, None]
    search.tell(np.zeros(2000), np.zeros((2000, 2)))
    children = search.ask()
    changes = (np.diff(children, axis=1) != 0).sum(axis=1)
    assert set(changes.tolist()) == {0, 1}
    assert (changes == 1).mean() == pytest.approx(0.1, abs=0.03)
    for first, second in zip(children[::2], children[1::2], strict=True):
        assert {first[0], second[0]} == {first[-1], second[-1]}


def test_the_best_individual_has_two_copies_on_average_and_the_mean_one_has_one() -> None:
    assert scaled(np.array([1.0, 2.0, 3.0]), 2.0).tolist() == [0.0, 1.0, 2.0]
    assert scaled(np.full(5, 7.0), 2.0).tolist() == [1.0] * 5


def test_nobody_has_less_than_no_copies() -> None:
    # The mean is -1.5. Two copies for the best one would leave -1.1 for the worst one.
    assert scaled(np.array([-9.0, 0.0, 1.0, 2.0]), 2.0) == pytest.approx([0, 1.2, 4 / 3, 22 / 15])


def test_the_scale_and_the_zero_of_fitness_do_not_matter_to_selection() -> None:
    fitness = np.array([0.5, 3.0, -2.0, 8.0])
    assert scaled(fitness, 2.0) == pytest.approx(scaled(8 * fitness - 100, 2.0))


def test_a_search_that_has_converged_begins_again_elsewhere() -> None:
    search = optimiser("cma", SIZE, 20, seed=1)
    asked = []
    for _ in range(120):
        asked.append(search.ask().copy())
        search.tell(np.zeros(20), np.zeros((20, 2)))  # a plateau: nothing to find
    assert np.isfinite(asked).all()
    assert np.std(asked[-1]) > 0.1


def test_an_unknown_algorithm_is_refused_with_a_near_name() -> None:
    with pytest.raises(ArgumentError, match="there is no algorithm 'cmaes'") as error:
        optimiser("cmaes", SIZE, 10, seed=1)
    assert "cma" in error.value.hint


def test_a_population_that_is_too_small_for_cma_is_refused() -> None:
    with pytest.raises(ArgumentError, match="CMA-ES needs 4 or more"):
        optimiser("cma", SIZE, 3, seed=1)


@pytest.mark.parametrize(("name", "package"), [("map-elites", "ribs"), ("cma", "cmaes")])
def test_a_missing_package_is_named_with_what_to_type(name: str, package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(asked: str, *rest: object) -> object:
        if asked.split(".")[0] == package:
            raise ImportError(asked)
        return real(asked, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(Unsupported, match=f"needs the package {package}") as error:
        optimiser(name, SIZE, 10, seed=1)
    assert "install" in error.value.hint


@needs_ribs
def test_map_elites_keeps_the_best_of_each_kind_of_behaviour() -> None:
    search = ALGORITHMS["map-elites"](SIZE, 50, 1)
    told(search, 30)
    assert len(search.archive) > 50  # type: ignore[attr-defined]
