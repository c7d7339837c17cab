"""The transfer report: physics against the wire, what breaks a controller, and a robot at the end of a link."""

from __future__ import annotations

import importlib.util
import json
import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pytest

import elib
import elib.cli.transfer as command
from elib.base.errors import ArgumentError
from elib.cli import main
from elib.learn import transfer as module
from elib.learn.champion import Champion
from elib.learn.executor import open_executor
from elib.learn.linked import can_be_measured, play_on_robot, play_on_wire
from elib.learn.transfer import FIRST, TransferPlan, Trouble, bootstrap, crossing, transfer
from elib.learn.transferreport import COLUMNS, row_of, to_json, write_folder
from elib.robot.aio import Epuck
from elib.simulator.emulator.robotprofile import NOMINAL_RADIUS, RobotProfile, Wheels, write
from elib.simulator.physics import Episodes, SensorView, World
from elib.simulator.worlds.writer import written_scene
from elib.testing import world_of

TASKS = """
from elib.simulator.physics import Pose, Scene, Task

def speed(world, i):
    return (world.robots[i].left_speed + world.robots[i].right_speed) / 0.2

def clear(world, i):
    return speed(world, i) * (1.0 - world.views[i].proximity[0] / 400)

def place(world, i):
    return world.robots[i].x - world.robots[i].before_x

def is_far(world):
    return world.robots[0].x > 0.3

ROOM = Scene(1.0, 0.5, starts=(Pose(0.2, 0.15, 0.0), Pose(0.2, 0.35, 0.0)), step=0.025)
FAST = Task("fast", "Drive fast.", (ROOM,), speed, seconds=2.0, on_board=True, solved=0.7)
CLEAR = Task("clear", "Drive where nothing is near.", (ROOM,), clear, reward_sensors=("proximity",), seconds=1.0)
BOTH = Task("both", "Drive fast, two of them.", (ROOM,), speed, robots=2, seconds=1.0)
FAR = Task("far", "Drive 10 cm.", (ROOM,), place, is_over=is_far, fitness="sum", seconds=20.0, solved=0.09)
NEAR = Task("near", "See.", (ROOM,), clear, reward_sensors=("proximity",), seconds=0.5, on_board=True)
WAY = Task("way", "Drive far.", (ROOM,), place, fitness="sum", seconds=2.0)
EYES = Task("eyes", "See far.", (ROOM,), speed, sensors=("proximity", "distance"), seconds=0.5)
"""
SHORT = TransferPlan(runs=2, firmwares=(FIRST,), profiles=(), sensitivity=False, engine="interpreted")
"""Physics, randomised, one firmware and a poor link."""
ROBOT = "sim://square?speed=max"
STRAIGHT = 0.75
"""Part of the top speed at which the controller below drives, whatever it sees; 0.0751 m/s are what the motors make."""


Made = Callable[[str], Champion]
"""The fixture ``champion``."""


@pytest.fixture
def champion(tmp_path: Path) -> Made:
    """Return a controller for one of the tasks above that drives straight on."""
    file = tmp_path / "my_tasks.py"
    file.write_text(TASKS)

    def make(name: str) -> Champion:
        task = elib.learn.find_task(f"{file}:{name}")
        wheel = [STRAIGHT, *[0.0] * (9 if "distance" in task.sensors else 8)]
        return Champion(f"{file}:{name}", "braitenberg", task.sensors, (*wheel, *wheel))

    return make


@pytest.fixture
def driven(monkeypatch: pytest.MonkeyPatch) -> list[World]:
    """The worlds in which champions drive robots."""
    worlds: list[World] = []
    drive = Champion.drive

    async def noted(self: Champion, robot: Epuck, *rest: Any, **options: Any) -> None:
        worlds.append(world_of(robot))
        await drive(self, robot, *rest, **options)

    monkeypatch.setattr(Champion, "drive", noted)
    return worlds


def came_to_a_stand(world: World) -> bool:
    """Return whether the robot has driven, and stands still while the world goes on."""
    world.step()  # what the wheels rolled in the tick of the stop
    before = world.encoders(0)
    world.run(64)
    return world.encoders(0) == before != (0, 0)


def test_a_bootstrap_interval_is_as_wide_as_theory_says() -> None:
    values = np.random.default_rng(4).normal(5.0, 2.0, 400)
    low, high = bootstrap(values.tolist())
    half = 1.96 * values.std() / math.sqrt(400)
    assert low == pytest.approx(values.mean() - half, abs=0.1 * half)
    assert high == pytest.approx(values.mean() + half, abs=0.1 * half)
    assert bootstrap(values.tolist()) == (low, high)


def test_runs_of_one_seed_are_drawn_together_for_the_ratio() -> None:
    values = [0.2, 0.5, 0.9, 0.4]
    assert bootstrap([each / 2 for each in values], values) == pytest.approx((0.5, 0.5))
    low, high = bootstrap([each / 2 for each in values], values, paired=False)
    assert low < 0.4 < 0.6 < high


@pytest.mark.parametrize(("values", "reference"), [([0.5], None), ([0.5, 0.6], [-0.1, 0.1]), ([0.5, 0.6], [0.5])])
def test_there_is_no_interval_of_one_run_or_over_a_mean_that_may_be_0(
    values: list[float], reference: list[float] | None
) -> None:
    assert all(map(math.isnan, bootstrap(values, reference)))


def test_the_limit_is_where_the_line_between_two_values_falls_below_the_least() -> None:
    assert crossing([0.0, 1.0, 2.0], [1.0, 0.9, 0.5], 0.8) == pytest.approx(1.25)
    assert crossing([0.0, 1.0], [1.0, 0.9], 0.8) == math.inf
    assert crossing([0.0], [0.7], 0.8) == 0.0


def test_physics_and_the_quiet_wire_agree_where_the_controller_needs_no_sensor(champion: Made) -> None:
    report = transfer(champion("FAST"), SHORT)
    physics, randomised, wire, poor = report.stages
    assert [stage.name for stage in report.stages] == ["physics", "randomised", f"wire {FIRST}", "poor link"]
    assert physics.fitness == pytest.approx((STRAIGHT, STRAIGHT), abs=0.01)
    assert wire.fitness == pytest.approx(physics.fitness, abs=0.01)
    assert wire.ratio == pytest.approx(1.0, abs=0.02)
    assert randomised.solved == physics.solved == wire.solved == 2
    assert poor.mean < 1.01 * wire.mean


def test_the_reward_of_the_wire_reads_the_sensors_of_the_virtual_world_calibrated_as_those_of_physics(
    champion: Made,
) -> None:
    best = champion("CLEAR")
    scores = Episodes(best.find_task(), engine="interpreted").play(
        best.network.controller(best.parameters), [best.parameters], [3]
    )
    fitness, is_lost = play_on_wire(best, written_scene(best.find_task().scenes[0]), {"robots": 1, "seed": 3})
    assert not is_lost
    assert fitness == pytest.approx(float(scores.fitness[0][0]), rel=0.02)


def test_an_episode_on_the_wire_ends_when_the_task_says_so(champion: Made) -> None:
    best = champion("FAR")
    fitness, _ = play_on_wire(best, written_scene(best.find_task().scenes[0]), {"robots": 1})
    assert 0.098 < fitness < 0.104


def test_several_robots_share_a_world_and_the_fitness_is_their_mean(champion: Made) -> None:
    best = champion("BOTH")
    fitness, _ = play_on_wire(best, written_scene(best.find_task().scenes[0]), {"robots": 2})
    assert fitness == pytest.approx(STRAIGHT, abs=0.01)


def test_a_link_that_cannot_be_opened_counts_as_a_lost_run(champion: Made) -> None:
    best = champion("FAST")
    assert play_on_wire(best, written_scene(best.find_task().scenes[0]), {"robots": 1, "loss": 1.0}) == (0.0, True)


def test_a_firmware_without_the_sensors_is_left_out(champion: Made) -> None:
    report = transfer(champion("EYES"), replace(SHORT, firmwares=(FIRST, "epuck2")))
    assert [stage.name for stage in report.stages] == ["physics", "randomised", "wire epuck2", "poor link"]
    (left_out,) = report.left_out
    assert left_out.startswith(f"wire {FIRST}: the controller sees distance")


def test_robots_of_other_profiles_are_tried(champion: Made, tmp_path: Path) -> None:
    file = tmp_path / "small-wheels.toml"
    write(RobotProfile(wheels=Wheels(0.9 * NOMINAL_RADIUS, 0.9 * NOMINAL_RADIUS)), file)
    report = transfer(champion("WAY"), replace(SHORT, profiles=("webots", str(file))))
    webots, small = report.stages[-2:]
    assert (webots.name, small.name) == ("profile webots", "profile small-wheels")
    assert webots.ratio == pytest.approx(1.0)
    assert small.ratio == pytest.approx(0.9, abs=0.02)


def test_what_breaks_the_controller_first_stands_first(champion: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    troubles = (
        Trouble("motor noise", "of the travel", "physics", "motor_noise", 0.03, (0.1, 0.3)),
        Trouble("loss", "of the answers", "wire", "loss", 0.02, (0.3, 0.6, 0.9)),
    )
    monkeypatch.setattr(module, "TROUBLES", troubles)
    report = transfer(champion("FAST"), replace(SHORT, sensitivity=True, runs=3))
    loss, motor = report.sensitivities
    assert (loss.trouble.name, motor.trouble.name) == ("loss", "motor noise")
    assert motor.values == (0.0, 0.1, 0.3)
    assert motor.limit == math.inf
    assert motor.text == "motor noise: not broken by 0.3 of the travel, the most that was tried"
    assert 0.0 < loss.limit <= 0.9
    assert len(loss.values) == len(loss.stages) <= 4
    assert loss.stages[-1].mean < 0.8 * report.stages[0].mean <= loss.stages[-2].mean
    assert loss.margin == loss.limit / 0.02


def test_the_same_seed_gives_the_same_report_and_another_seed_other_runs(champion: Made) -> None:
    best, plan = champion("CLEAR"), replace(SHORT, seed=5, latency=0.03, loss=0.1)
    report = transfer(best, plan)
    with open_executor() as executor:
        assert transfer(best, plan, executor=executor) == report
    assert transfer(best, replace(plan, seed=6)).stages[0].seeds != report.stages[0].seeds


def test_the_folder_holds_a_page_a_plot_and_all_runs(champion: Made, tmp_path: Path) -> None:
    report = transfer(champion("FAST"), SHORT)
    title = "a$_$ caf\udce9"  # Matplotlib would read a formula; the last sign is one of a name that is not UTF-8.
    page, plot, runs = write_folder(report, tmp_path, title)
    assert page.read_text().startswith("# Transfer of a$_$ caf?")
    assert "<!-- Transfer of a$_$ caf? -->" in plot.read_text()
    assert f"| {' | '.join(COLUMNS)} |" in page.read_text()
    assert f"| {' | '.join(row_of(report.stages[0]))} |" in page.read_text()
    assert plot.read_text().count("<svg") == 1
    assert write_folder(report, tmp_path, title)[1].read_bytes() == plot.read_bytes()
    rows = duckdb.sql(f"SELECT stage, seed, fitness, solved FROM '{runs}'").fetchall()
    assert len(rows) == 8
    assert rows[0] == ("physics", report.stages[0].seeds[0], report.stages[0].fitness[0], 1)
    assert json.loads(json.dumps(to_json(report)))["stages"][0]["success"] == 1.0


def test_a_robot_is_measured_by_its_readings_and_speeds_and_stands_at_the_end(
    champion: Made, driven: list[World]
) -> None:
    asked: list[str] = []
    plan = replace(SHORT, runs=1, firmwares=(), robot=ROBOT, robot_runs=2)
    robot = transfer(champion("FAST"), plan, ask=asked.append).stages[-1]
    assert list(map(came_to_a_stand, driven[-2:])) == [True, True]
    assert robot.fitness == pytest.approx((STRAIGHT, STRAIGHT), abs=0.02)
    assert robot.seeds == ()
    assert asked == ["Run 1 of 2: put the robot at a start.", "Run 2 of 2: put the robot at a start."]


def test_a_reward_that_needs_the_place_is_not_measured_on_a_robot(champion: Made) -> None:
    best = champion("CLEAR")
    plan = replace(SHORT, runs=1, firmwares=(), robot=ROBOT, robot_runs=1)
    robot = transfer(best, plan).stages[-1]
    assert math.isnan(robot.mean)
    assert row_of(robot)[:3] == ("robot", "1", "not measured")
    assert "not measured" in robot.about


def test_a_reward_that_needs_a_sensor_that_the_controller_does_not_see_is_not_measured(champion: Made) -> None:
    best = champion("NEAR")
    assert can_be_measured(best)
    blind = Champion(best.task, "braitenberg", ("ambient_light",), best.parameters)
    assert not can_be_measured(blind)
    assert math.isnan(play_on_robot(blind, ROBOT))
    assert play_on_robot(best, ROBOT) > 0.0


def test_a_robot_is_stopped_when_the_controller_fails(champion: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    worlds: list[World] = []

    async def drive(self: Champion, robot: Epuck, watch: Callable[[SensorView], object], **_: object) -> None:
        worlds.append(world_of(robot))
        await robot.set_speed(0.5, 0.5)
        await robot.sleep(0.5)
        raise ZeroDivisionError("in the controller")

    monkeypatch.setattr(Champion, "drive", drive)
    with pytest.raises(ZeroDivisionError):
        play_on_robot(champion("FAST"), ROBOT)
    assert came_to_a_stand(worlds[0])


def test_a_task_of_several_robots_is_not_for_one_robot(champion: Made) -> None:
    with pytest.raises(ArgumentError, match="task 'both' has 2 robots"):
        transfer(champion("BOTH"), replace(SHORT, robot="sim://"))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--profile", "khepera"], "there is no robot profile 'khepera'"),
        (["--profile", "no.toml"], "no.toml"),
        (["--runs", "0"], "runs"),
        (["--loss", "2"], "loss"),
        (["--latency", "soon"], "--latency is 'soon'"),
        (["--robot", "robot"], "robot"),
    ],
)
def test_a_wrong_option_is_refused_before_anything_runs(
    champion: Made, tmp_path: Path, options: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    champion("FAST").save(tmp_path / "best.toml")
    assert main(["transfer", str(tmp_path / "best.toml"), *options]) == 2
    assert words in capsys.readouterr().err


def test_times_may_be_given_in_milliseconds() -> None:
    assert command.seconds_of("50ms", "--latency") == pytest.approx(0.05)
    assert command.seconds_of("0.05", "--latency") == command.seconds_of("0.05s", "--latency") == 0.05


def test_the_command_prints_a_table_and_writes_the_folder(
    champion: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    champion("FAST").save(tmp_path / "best.toml")
    monkeypatch.setattr(module, "TROUBLES", ())
    monkeypatch.setattr(command, "TransferPlan", partial(TransferPlan, engine="interpreted"))
    assert main(["transfer", str(tmp_path / "best.toml"), "--runs", "2", "--out", str(tmp_path / "out")]) == 0
    out = capsys.readouterr().out
    assert "physics" in out
    assert "wire epuck2-wifi" in out
    assert "profile gctronic" in out
    assert {path.name.split(".")[0] for path in (tmp_path / "out").iterdir()} == {"report", "transfer", "runs"}


def test_without_numba_the_command_says_that_it_is_slow(
    champion: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    champion("FAST").save(tmp_path / "best.toml")
    monkeypatch.setattr(command, "TransferPlan", partial(TransferPlan, firmwares=(), profiles=(), engine="interpreted"))
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "numba" else found(name))
    assert main(["transfer", str(tmp_path / "best.toml"), "--runs", "1", "--no-breaks"]) == 0
    assert "Numba is not installed: the physics runs interpreted" in capsys.readouterr().err


def test_the_command_prints_json(
    champion: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    champion("FAST").save(tmp_path / "best.toml")
    monkeypatch.setattr(command, "TransferPlan", partial(TransferPlan, firmwares=(FIRST,), engine="interpreted"))
    assert main(["transfer", str(tmp_path / "best.toml"), "--runs", "2", "--no-breaks", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["task"] == "fast"
    assert found["stages"][0]["mean"] == pytest.approx(STRAIGHT, abs=0.01)
    assert found["breaks"] == []


def test_a_controller_is_tried_under_the_fault_scripts_that_are_named(champion: Made, tmp_path: Path) -> None:
    file = tmp_path / "half.toml"
    file.write_text('description = "x"\n[[fault]]\nkind = "wheel"\nfactor = 0.5\n')
    report = transfer(champion("WAY"), replace(SHORT, faults=(str(file),)))
    assert report.stages[-1].name == "fault half"
    assert report.stages[-1].ratio == pytest.approx(0.5, abs=0.02)
    with pytest.raises(ArgumentError, match="there is no fault script 'storm'"):
        TransferPlan(faults=("storm",))
