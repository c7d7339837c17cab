"""Sweeps: what is run, what is measured, and that an interrupted one goes on to the same table."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import duckdb
import pytest

from elib.base.errors import ArgumentError, ElibError
from elib.cli import main
from elib.learn import sweep as module
from elib.learn.champion import Champion
from elib.learn.executor import open_executor
from elib.learn.networks import Network
from elib.learn.study import Evaluation
from elib.learn.sweep import Range, Sweep, parse_grid, parse_sample, read_program, run_sweep
from elib.learn.sweepplot import draw_sweep
from shared import PATIENCE, wait_until

PROGRAM = """
from typing import Annotated
import elib
from elib.behaviours import Quantity

Base = Annotated[float, Quantity("base", "rev/s", 0.05, 1.0, scale=1000)]

@elib.behaviour(world="arena")
async def straight(robot: elib.Epuck, *, base: Base = 0.3) -> None:
    if base == 0.5:
        raise RuntimeError("half is bad luck")
    print("this would spoil the output")
    await robot.set_speed(base, base)
    await robot.sleep(100)
"""


@pytest.fixture
def program(tmp_path: Path) -> str:
    path = tmp_path / "straight.py"
    path.write_text(PROGRAM)
    return str(path)


def sweep_of(program: str, *bases: float, seeds: int = 2) -> Sweep:
    return Sweep(program, (("base", bases),), seeds=seeds, seconds=1.0, source=read_program(program))


def rows_of(sweep: Sweep, folder: Path) -> list[dict[str, object]]:
    with open_executor() as executor:
        return list(run_sweep(sweep, folder, executor))


def table(folder: Path) -> list[tuple[object, ...]]:
    return duckdb.sql(f"SELECT * FROM '{folder / 'runs.parquet'}'").fetchall()


def test_a_grid_is_run_in_every_combination_the_seed_last() -> None:
    sweep = Sweep("avoid", (("cruise", (0.2, 0.4)),), worlds=("arena", "maze"), faults=("none", "loss=0.1"), seeds=2)
    runs = sweep.check()
    assert len(runs) == 16
    assert [(run.world, run.fault, run.seed) for run in runs[:4]] == [
        ("arena", "none", 1),
        ("arena", "none", 2),
        ("arena", "loss=0.1", 1),
        ("arena", "loss=0.1", 2),
    ]
    assert runs[8].parameters == (("cruise", 0.4),)
    assert runs[3].url == "sim://arena?loss=0.1&speed=max&seed=2"
    assert [run.number for run in runs] == list(range(16))


def test_samples_cover_their_ranges_evenly_and_are_always_the_same() -> None:
    sweep = Sweep("avoid", samples=(("cruise", Range(0.1, 0.9, 8)), ("other", Range(0.0, 8.0, 8))))
    points = [dict(run.parameters) for run in sweep.runs()]
    assert sorted(int((float(each["cruise"]) - 0.1) / 0.1) for each in points) == list(range(8))
    assert sorted(int(each["other"]) for each in points) == list(range(8))
    assert points == [dict(run.parameters) for run in sweep.runs()]


def test_parameters_are_read_from_words() -> None:
    assert parse_grid("cruise=0.2,0.4") == ("cruise", (0.2, 0.4))
    assert parse_grid("top-speed=0..1:5") == ("top_speed", (0.0, 0.25, 0.5, 0.75, 1.0))
    assert parse_grid("side=left,right") == ("side", ("left", "right"))
    assert parse_grid("cruise=0.1..0.5:5") == ("cruise", (0.1, 0.2, 0.3, 0.4, 0.5))
    assert max(parse_grid("cruise=0.1..1.0:8")[1]) == 1.0
    assert parse_sample("base=0.1..0.5:20") == ("base", Range(0.1, 0.5, 20))
    for wrong in ("cruise", "cruise=", "=1", "cruise=1,,2", "cruise=2..1:3", "cruise=0..1:0", "cruise=0..inf:3"):
        with pytest.raises(ArgumentError):
            parse_grid(wrong)


@pytest.mark.parametrize(
    ("sweep", "message"),
    [
        (Sweep("avoid", (("cruse", (0.2,)),)), "no option 'cruse'"),
        (Sweep("avoid", (("cruise", (0.2, 99.0)),)), "cruise is 99.0 rev/s"),
        (Sweep("avoid", (("cruise", (0.2,)), ("cruise", (0.3,)))), "given twice"),
        (Sweep("avoid", worlds=("nowhere",)), "nowhere"),
        (Sweep("avoid", faults=("noisy",)), "noisy"),
        (Sweep("avoid", faults=("loss=2",)), "loss is 2"),
        (Sweep("avoid", seeds=0), "seeds is 0"),
        (Sweep("avoid", seeds=2_000_000), "the limit is"),
        (Sweep("avoyd"), "did you mean avoid"),
        (Sweep("avoid", samples=(("cruise", Range(0.1, 0.2, 3)), ("b", Range(0, 1, 4)))), "different numbers"),
    ],
)
def test_a_mistake_is_found_before_the_first_run(sweep: Sweep, message: str, tmp_path: Path) -> None:
    with pytest.raises(ElibError, match=message):
        rows_of(sweep, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_run_is_measured_in_the_true_world(program: str, tmp_path: Path) -> None:
    rows = rows_of(sweep_of(program, 0.2, 0.4), tmp_path / "out")
    assert [row["run"] for row in rows] == [0, 1, 2, 3]
    for row in rows:
        assert row["world"] == "arena"
        assert row["ended"] == "time"
        assert row["error"] is None
        # A wheel of 41 mm turns base times a second; the link takes its time at the beginning.
        assert row["path"] == pytest.approx(math.pi * 0.041 * float(str(row["base"])), rel=0.1)
        assert row["distance"] == pytest.approx(row["path"], rel=0.01)
        assert row["timeouts"] == 0


def test_another_seed_is_another_noise_and_the_same_seed_the_same_run(tmp_path: Path) -> None:
    sweep = Sweep("avoid", worlds=("maze",), seeds=2, seconds=1.0)
    one, two = rows_of(sweep, tmp_path / "one")
    assert one["path"] != two["path"]
    assert rows_of(sweep, tmp_path / "two") == [one, two]


def test_a_run_that_fails_is_a_row_and_the_others_go_on(program: str, tmp_path: Path) -> None:
    rows = rows_of(sweep_of(program, 0.2, 0.5, 0.6, seeds=1), tmp_path / "out")
    assert [row["ended"] for row in rows] == ["time", "error", "time"]
    assert rows[1]["error"] == "RuntimeError: half is bad luck"
    assert len(table(tmp_path / "out")) == 3


def test_an_interrupted_sweep_goes_on_to_the_same_table(program: str, tmp_path: Path) -> None:
    sweep = sweep_of(program, 0.2, 0.4)
    rows_of(sweep, tmp_path / "whole")
    with open_executor() as executor:
        rows = run_sweep(sweep, tmp_path / "parts", executor)
        next(rows), next(rows)
        rows.close()
    journal = tmp_path / "parts" / "runs.jsonl"
    kept = journal.read_bytes()
    journal.write_bytes(kept + b'{"run": 2, "ba')  # torn: the program was killed while it wrote
    assert len(rows_of(sweep, tmp_path / "parts")) == 4
    assert journal.read_bytes() == (tmp_path / "whole" / "runs.jsonl").read_bytes()
    assert table(tmp_path / "parts") == table(tmp_path / "whole")


def test_a_sweep_that_was_killed_before_its_settings_were_written_begins_again(program: str, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "runs.jsonl").touch()
    assert len(rows_of(sweep_of(program, 0.2, seeds=1), tmp_path / "out")) == 1
    (tmp_path / "out" / "sweep.json").unlink()
    with pytest.raises(ArgumentError, match=r"holds other files and no sweep"):
        rows_of(sweep_of(program, 0.2, seeds=1), tmp_path / "out")
    (tmp_path / "out" / "runs.parquet").unlink()
    with pytest.raises(ArgumentError, match=r"has runs\.jsonl but no sweep\.json"):
        rows_of(sweep_of(program, 0.2, seeds=1), tmp_path / "out")


def test_a_folder_with_another_sweep_is_refused(program: str, tmp_path: Path) -> None:
    rows_of(sweep_of(program, 0.2, seeds=1), tmp_path / "out")
    assert {"elib", "python", "numpy"} <= json.loads((tmp_path / "out" / "sweep.json").read_text())["versions"].keys()
    with pytest.raises(ArgumentError, match=r"holds another sweep: grid is .* there, and .* now"):
        rows_of(sweep_of(program, 0.3, seeds=1), tmp_path / "out")
    Path(program).write_text(PROGRAM + "\n# changed\n")
    with pytest.raises(ArgumentError, match="was changed"):
        rows_of(sweep_of(program, 0.2, seeds=1), tmp_path / "out")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("two years of work")
    with pytest.raises(ArgumentError, match="holds other files"):
        rows_of(sweep_of(program, 0.2, seeds=1), tmp_path / "mine")


def test_a_program_that_drives_at_import_is_told_so(tmp_path: Path) -> None:
    path = tmp_path / "eager.py"
    path.write_text(PROGRAM + '\nelib.play(straight, "sim://square?speed=max", seconds=1)\n')
    with pytest.raises(ArgumentError, match="as soon as it is imported"):
        Sweep(str(path), source=read_program(str(path))).check()


def test_a_program_without_a_behaviour_or_with_several_is_told_so(tmp_path: Path) -> None:
    path = tmp_path / "many.py"
    path.write_text(PROGRAM + PROGRAM.replace("straight", "other"))
    with pytest.raises(ArgumentError, match="2 behaviours: straight, other"):
        Sweep(str(path), source=read_program(str(path))).check()
    assert len(Sweep(f"{path}:other", source=read_program(f"{path}:other")).check()) == 1
    with pytest.raises(ArgumentError, match="no behaviour 'third'"):
        Sweep(f"{path}:third", source=read_program(f"{path}:third")).check()


def test_the_command_writes_table_and_plot(
    program: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    line = [*"sweep straight.py --grid base=0.2,0.5 --seeds 2 --for 1 --out out --plot mean-speed --json".split()]
    assert main(line) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["runs"], said["errors"], said["metric"]) == (4, 2, "mean_speed")
    assert len(table(tmp_path / "out")) == 4
    assert "mean speed, m/s" in Path("out/sweep.svg").read_text()
    assert main(line) == 0  # nothing is left to do
    assert main([*line[:-3], "--plot", "beauty"]) == 2


def test_a_plot_is_drawn_of_words_and_of_many_values(program: str, tmp_path: Path) -> None:
    rows = [
        {"run": k, "base": 0.1 + k / 100, "world": world, "fault": "none", "seed": 1, "path": k / 10 if k else None}
        for k in range(30)
        for world in ("arena", "$maze")
    ]
    draw_sweep(tmp_path / "many.svg", sweep_of(program, *(0.1 + k / 100 for k in range(30))), rows)
    draw_sweep(tmp_path / "words.svg", Sweep("avoid", worlds=("arena", "$maze")), rows)
    assert "$maze" in (tmp_path / "words.svg").read_text()


def test_a_full_disk_leaves_the_runs_and_is_an_error_with_a_reason(program: str, tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    sweep = sweep_of(program, 0.2, 0.3)
    rows = rows_of(sweep, tmp_path / "out")
    (tmp_path / "out" / "runs.parquet").unlink()
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200, before[1]))
    try:
        with pytest.raises(ElibError, match=r"runs.parquet cannot be written: .*\nhint: is there room on the disk"):
            rows_of(sweep, tmp_path / "out")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert rows_of(sweep, tmp_path / "out") == rows
    assert len(table(tmp_path / "out")) == 4


def test_a_champion_is_run_in_the_physics_with_what_its_task_draws(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "Evaluation", partial(Evaluation, engine="interpreted"))
    path = tmp_path / "best.toml"
    size = Network("braitenberg", ("proximity",)).size
    Champion("avoid", "braitenberg", ("proximity",), tuple(k / 100 for k in range(size))).save(path)
    sweep = Sweep(str(path), (("motor_noise", (0.0, 0.2)),), seeds=2, seconds=1.0, source=read_program(str(path)))
    rows = rows_of(sweep, tmp_path / "out")
    assert len({row["fitness"] for row in rows}) == 4
    assert {row["solved"] for row in rows} <= {0.0, 1.0}
    for wrong, message in (
        (replace(sweep, grid=(("motor_nose", (0.1,)),)), "did you mean motor_noise"),
        (replace(sweep, grid=(("motor_noise", (7.0,)),)), "the range of motor_noise"),
        (replace(sweep, faults=("loss=0.1",)), "without a link"),
    ):
        with pytest.raises(ArgumentError, match=message):
            wrong.check()
    path.write_text(path.read_text() + "# changed\n")
    with pytest.raises(ElibError, match=r"best\.toml is not what it was when the sweep began"):
        rows_of(replace(sweep, seeds=3), tmp_path / "other")


def test_a_champion_whose_fitness_is_not_a_number_is_an_error_with_a_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "Evaluation", partial(Evaluation, engine="interpreted"))
    (tmp_path / "far.py").write_text(
        "import math\nfrom dataclasses import replace\nimport elib\nfrom elib.learn import Task\n"
        "def reward(world, i):\n    return math.inf if world.setting[0].tick > 9 else 0.0\n"
        "SCENE = replace(elib.Scene.load('square'), step=0.05)\n"
        "TASK = Task('far', 'Drive far.', (SCENE,), reward)\n"
    )
    path = tmp_path / "best.toml"
    size = Network("braitenberg", ("proximity",)).size
    Champion(f"{tmp_path}/far.py:TASK", "braitenberg", ("proximity",), (0.1,) * size).save(path)
    with pytest.raises(
        ElibError, match=r"the fitness of run 0 is inf\nhint: the reward of the task far must be a finite number"
    ):
        rows_of(Sweep(str(path), seconds=1.0, source=read_program(str(path))), tmp_path / "out")


@pytest.mark.long
def test_a_killed_sweep_with_workers_goes_on_to_the_same_table(program: str, tmp_path: Path) -> None:
    hold = tmp_path / "hold"
    hold.touch()
    Path(program).write_text(
        PROGRAM.replace(
            "    print(",
            "    import pathlib, threading\n"
            f"    while base == 0.4 and pathlib.Path({str(hold)!r}).exists():\n"  # the last four runs wait to be killed
            "        threading.Event().wait(0.01)\n"
            "    print(",
        )
    )
    sweep = Sweep(program, (("base", (0.2, 0.3, 0.4)),), seeds=4, seconds=2.0, source=read_program(program))
    line = f"sweep {program} --grid base=0.2,0.3,0.4 --seeds 4 --for 2 --workers 2 --out {tmp_path / 'killed'}"
    first = subprocess.Popen([sys.executable, "-m", "elib", *line.split()], stderr=subprocess.DEVNULL)
    journal = tmp_path / "killed" / "runs.jsonl"
    wait_until(lambda: journal.exists() and journal.read_bytes().count(b"\n") >= 3)
    os.kill(first.pid, signal.SIGKILL)
    first.wait(PATIENCE)
    hold.unlink()
    assert 3 <= journal.read_bytes().count(b"\n") < 12
    rows_of(sweep, tmp_path / "killed")
    rows_of(sweep, tmp_path / "whole")
    assert table(tmp_path / "killed") == table(tmp_path / "whole")


def test_two_programs_on_one_folder_are_refused(program: str, tmp_path: Path) -> None:
    sweep = sweep_of(program, 0.2)
    with open_executor() as executor:
        rows = run_sweep(sweep, tmp_path / "out", executor)
        next(rows)
        with pytest.raises(ElibError, match="another program writes"):
            rows_of(sweep, tmp_path / "out")
        rows.close()
