"""``elib evolve``: the same result whatever interrupts it and wherever its jobs run, and what it says."""

import json
import random
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_study import run, settings_for, task_file

from elib.base.errors import ArgumentError
from elib.cli import main
from elib.cli.evolve import plotted
from elib.learn.evolution import Evolution
from elib.learn.executor import Executor, open_executor
from elib.learn.networks import Network
from elib.learn.progress import Spread
from elib.learn.study import Settings, Study, evaluate, read_study
from shared import PATIENCE

SMALL = ["--population", "3", "--generations", "3", "--scenarios", "1", "--algorithm", "ga"]


def content_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture
def task(tmp_path: Path) -> Path:
    return task_file(tmp_path)


@pytest.fixture
def interpreted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Commands of this test need no compiler, and write below its folder."""
    whole = Settings.evaluation
    monkeypatch.setattr(Settings, "evaluation", lambda self: whole(self, "interpreted"))
    monkeypatch.chdir(tmp_path)


def exit_of(*line: str) -> int:
    try:
        return main(["evolve", *line])
    except SystemExit as ending:
        return int(ending.code or 0)


ONCE = [("torn", 2)], []
OFTEN = [("replaced", 1), ("torn", 2), ("written", 2), ("replaced", 2)], [("replaced", 5)]
"""Kinds of moments in the evolution, and then while the tables at its end are written."""


@pytest.mark.parametrize(
    ("early", "late"), [pytest.param(*ONCE, id="once"), pytest.param(*OFTEN, id="often", marks=pytest.mark.long)]
)
def test_killed_at_any_moment_a_study_goes_on_to_the_same_bytes(
    early: list[tuple[str, int]], late: list[tuple[str, int]], task: Path, tmp_path: Path
) -> None:
    run(tmp_path / "whole", settings_for(task))
    program = [sys.executable, str(Path(__file__).with_name("small_study.py")), str(tmp_path / "killed"), str(task)]
    # The moments are counted anew in each run, which begins where the last one was killed.
    for moment, number in early:
        assert subprocess.run([*program, moment, str(number)], timeout=PATIENCE).returncode == -signal.SIGKILL
    assert 0 < len(read_study(tmp_path / "killed")[1]) < 5
    for moment, number in late:
        assert subprocess.run([*program, moment, str(number)], timeout=PATIENCE).returncode == -signal.SIGKILL
    run(tmp_path / "killed", settings_for(task))
    assert content_of(tmp_path / "killed") == content_of(tmp_path / "whole")


class Shuffled(Executor):
    """Runs the jobs in another order, and takes itself for many workers."""

    def __init__(self, width: int) -> None:
        self.width = width

    def run(self, function: Callable[..., Any], jobs: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        order = list(range(len(jobs)))
        random.Random(self.width).shuffle(order)
        for k in order:
            yield k, function(*jobs[k])


def test_the_result_does_not_depend_on_how_many_work_and_in_which_order(task: Path, tmp_path: Path) -> None:
    settings = settings_for(task, generations=2, scenarios=2)
    run(tmp_path / "here", settings)
    run(tmp_path / "many", settings, Shuffled(5))
    assert content_of(tmp_path / "many") == content_of(tmp_path / "here")


def test_two_evaluations_at_a_time_do_not_mix(tmp_path: Path, task: Path) -> None:
    """As on a worker with several threads: another evaluation begins while this one looks for its worlds."""
    one, other = (settings_for(task, seconds=seconds).evaluation("interpreted") for seconds in (0.5, 1.0))
    population = np.full((1, one.controller.size), 0.1)

    class Meanwhile(str):
        def __eq__(self, key: object) -> bool:
            evaluate(other, population, [1])
            return str.__eq__(self, key)

        __hash__ = str.__hash__

    expected = evaluate(one, population, [1]).steps.tolist()
    assert evaluate(replace(one, key=Meanwhile(one.key)), population, [1]).steps.tolist() == expected
    assert evaluate(other, population, [1]).steps.tolist() != expected


def test_another_seed_gives_another_result(task: Path, tmp_path: Path) -> None:
    for seed in (1, 2):
        run(tmp_path / str(seed), settings_for(task, seed=seed, generations=2))
    one, other = (read_study(tmp_path / str(seed))[1] for seed in (1, 2))
    assert one[0].fitness != other[0].fitness
    assert one[0].seeds != other[0].seeds


def test_more_generations_go_on_as_if_they_had_been_asked_for_at_first(task: Path, tmp_path: Path) -> None:
    run(tmp_path / "long", settings_for(task, generations=3))
    run(tmp_path / "short", settings_for(task, generations=1))
    run(tmp_path / "short", settings_for(task, generations=3))
    assert content_of(tmp_path / "short") == content_of(tmp_path / "long")


def test_the_fitness_grows_and_the_best_has_the_fitness_of_new_episodes(task: Path, tmp_path: Path) -> None:
    settings = settings_for(task, population=12, generations=10)
    run(tmp_path / "study", settings)
    _, generations = read_study(tmp_path / "study")
    assert np.mean(generations[-1].fitness) > np.mean(generations[0].fitness) + 0.02
    assert "solved = 1.0" in (tmp_path / "study" / "study.toml").read_text()


def test_a_reward_that_is_not_finite_is_named_and_not_recorded(tmp_path: Path, task: Path) -> None:
    text = task.read_text()
    task.write_text(
        text.replace("    return ", "    if world.setting[0].tick > 3:\n        return 1e308 * 1e308\n    return ")
    )
    settings = settings_for(task)
    with open_executor() as here, Study(tmp_path / "study", settings) as study:
        evolution = Evolution(study, here, evaluation=settings.evaluation("interpreted"))
        with pytest.raises(ArgumentError, match="the fitness of individual 0 in generation 1 is inf"):
            next(evolution.run())
    assert (tmp_path / "study" / "generations.jsonl").read_bytes() == b""


def test_a_reward_that_is_not_finite_in_the_final_test_alone_is_named(
    tmp_path: Path, task: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = settings_for(task)
    folder = tmp_path / "study"
    with open_executor() as here, Study(folder, settings) as study:
        evolution = Evolution(study, here, evaluation=settings.evaluation("interpreted"))
        for _ in evolution.run():
            pass
        before = content_of(folder)
        scores = evolution._scores

        def diverged(population: Any, seeds: list[int]) -> Any:
            found = scores(population, seeds)
            return found._replace(fitness=found.fitness * np.nan)

        monkeypatch.setattr(evolution, "_scores", diverged)
        with pytest.raises(ArgumentError, match=r"of generation \d in the final test is nan\nhint: the reward of"):
            evolution.finish()
        assert content_of(folder) == before


def test_a_reward_that_fails_is_told_without_the_job_that_met_it(tmp_path: Path, task: Path) -> None:
    task.write_text(task.read_text().replace("    return ", "    1 / 0\n    return "))
    settings = settings_for(task)
    with open_executor() as here, Study(tmp_path / "study", settings) as study:
        evolution = Evolution(study, here, evaluation=settings.evaluation("interpreted"))
        with pytest.raises(ArgumentError, match=r"^a function of task 'straight' fails in the first tick"):
            next(evolution.run())


def test_a_task_file_that_exits_is_named(task: Path) -> None:
    task.write_text("import sys\nsys.exit(3)\n")
    with pytest.raises(ArgumentError, match=r"straight\.py:2 fails: SystemExit\(3\)"):
        settings_for(task).evaluation()


def test_a_task_file_that_is_not_python_is_named_with_its_line(task: Path, tmp_path: Path) -> None:
    (tmp_path / "beside.py").write_text("def reward(world, i)\n    return 1.0\n")
    task.write_text("import beside\n")
    with pytest.raises(ArgumentError, match=r"beside\.py:1 is not Python: .*\nhint: mend this line: def reward\(world"):
        settings_for(task).evaluation()
    task.write_text("\n\nTASK = = 1\n")
    with pytest.raises(
        ArgumentError, match=r"straight\.py:3 is not Python: invalid syntax\nhint: mend this line: TASK"
    ):
        settings_for(task).evaluation()
    task.write_text("text = '\0'\n")
    with pytest.raises(ArgumentError, match=r"straight\.py"):
        settings_for(task).evaluation()


@pytest.mark.usefixtures("interpreted")
def test_a_study_from_command_to_best(task: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_of(f"{task}:TASK", *SMALL) == 0
    out, err = capsys.readouterr()
    assert "best     straight-study/best.toml, from generation" in out
    assert "solved" in out
    assert "generation 3: best" in err
    assert {path.name for path in (tmp_path / "straight-study").iterdir()} == {
        "study.toml",
        "generations.jsonl",
        "best.toml",
        "generations.parquet",
        "individuals.parquet",
        "fitness.svg",
    }


@pytest.mark.usefixtures("interpreted")
def test_the_same_command_goes_on_and_so_does_the_folder_alone(
    task: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = [f"{task}:TASK", *SMALL, "--out", "mine", "--json"]
    assert exit_of(*line) == 0
    first, before = json.loads(capsys.readouterr().out), content_of(tmp_path / "mine")
    assert exit_of(*line) == 0
    again = capsys.readouterr()
    assert json.loads(again.out) == first
    assert "mine: goes on after 3 of 3 generations" in again.err
    assert "generation 1: best" not in again.err
    assert content_of(tmp_path / "mine") == before
    assert exit_of("--out", "mine", "--generations", "4") == 0
    assert len(read_study(tmp_path / "mine")[1]) == 4
    without_generations = [*SMALL[:2], *SMALL[4:]]
    assert exit_of(f"{task}:TASK", *without_generations, "--out", "mine") == 0


@pytest.mark.usefixtures("interpreted")
def test_ctrl_c_leaves_a_study_that_goes_on(
    task: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    line = [f"{task}:TASK", *SMALL, "--out", "mine"]
    append = Study.append

    def interrupted(self: Study, generation: Any) -> None:
        append(self, generation)
        if generation.generation == 2:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Study, "append", interrupted)
        assert exit_of(*line) == 130
    said = capsys.readouterr().err
    assert "stopped after generation 2; this goes on: elib evolve --out mine" in said
    assert {"best.toml", "fitness.svg", "generations.parquet"} <= set(content_of(tmp_path / "mine"))
    assert exit_of("--out", "mine") == 0
    assert exit_of(*line[:-1], "undisturbed") == 0
    assert content_of(tmp_path / "mine") == content_of(tmp_path / "undisturbed")


@pytest.mark.usefixtures("interpreted")
def test_the_tables_hold_every_individual(task: Path, tmp_path: Path) -> None:
    import duckdb

    assert exit_of(f"{task}:TASK", *SMALL) == 0
    folder = tmp_path / "straight-study"
    settings, generations = read_study(folder)
    size = Network("recurrent", ("proximity",)).size
    with duckdb.connect() as database:
        rows = database.execute(f"SELECT * FROM '{folder}/individuals.parquet'").fetchall()
        summary = database.execute(f"SELECT * FROM '{folder}/generations.parquet'").fetchall()
    assert [row[:5] for row in rows] == [
        (each.generation, k, each.fitness[k], each.left[k], each.right[k]) for each in generations for k in range(3)
    ]
    first = settings.optimiser(size).ask()
    assert [list(row[5:]) for row in rows[:3]] == first.tolist()
    assert [row[0] for row in summary] == [1, 2, 3]
    assert [row[1] for row in summary] == [max(each.fitness) for each in generations]


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize(
    ("line", "said"),
    [
        ([], "elib evolve needs a task"),
        (["--out", "nothing"], "there is no study in nothing"),
        (["voiding"], "there is no task 'voiding'"),
        (["cover.py"], "cover.py is a file: which task of it?"),
        (["nothing.py:TASK"], "nothing.py"),
        (["{task}:TUSK"], "straight.py has no 'TUSK'"),
        (["{task}:TASK", "--controller", "forward"], "there is no controller 'forward'"),
        (["{task}:TASK", "--algorithm", "gaa"], "there is no algorithm 'gaa'"),
        (["{task}:TASK", "--population", "1"], "population is 1; it must be"),
        (["{task}:TASK", "--hidden", "3", "--controller", "braitenberg"], "no hidden neurons"),
        (["{task}:TASK", "--workers", "2", "--cluster", "tcp://127.0.0.1:1"], "exclude each other"),
        (["{task}:TASK", "--cluster", "tcp://127.0.0.1:1"], "no Dask scheduler answers"),
        (["{task}:TASK", "--view", "WRONG"], "WRONG"),
        (["{task}:TASK", "--view", "0.0.0.0:0"], "0.0.0.0"),
    ],
)
def test_a_wrong_command_line_is_refused_with_a_reason_before_a_folder_is_made(
    line: list[str], said: str, task: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert exit_of(*(word.format(task=task) for word in line)) in (1, 2)
    error = capsys.readouterr().err
    assert said in error
    assert "Traceback" not in error
    assert not (tmp_path / "straight-study").exists()


@pytest.mark.usefixtures("interpreted")
def test_a_law_of_your_own_evolves(task: Path, tmp_path: Path) -> None:
    law = tmp_path / "my_law.py"
    law.write_text(
        "from elib.learn.networks import Law\n"
        "def turn(robot, parameters, memory):\n"
        "    robot.left = 700 * parameters[0]\n"
        "    robot.right = 700 * parameters[1]\n"
        "LAW = Law(turn, size=2)\n"
    )
    assert exit_of(f"{task}:TASK", *SMALL, "--controller", "my_law.py:LAW", "--out", "mine") == 0
    assert 'controller = "my_law.py:LAW"' in (tmp_path / "mine" / "study.toml").read_text()


def test_the_plot_shows_the_mean_as_a_surface_and_the_best_as_points() -> None:
    done = [Spread(best, best, mean, 0, 0) for best, mean in ((0.5, 0.0), (1.0, 0.5), (1.0, 1.0))]
    assert plotted(done, 4, width=10, height=4) == [
        "        1  ••",
        "          • █",
        "           ██",
        "        0  ██",
        "          • best ▄ mean fitness",
    ]
    assert plotted([], 4, width=10) == []
    assert plotted([Spread(0, 0, 0, 0, 0)], 4, width=10, height=3)[2].endswith("•")
    assert max(map(len, plotted(done * 300, 900, width=50))) == 60
