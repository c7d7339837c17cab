"""``elib run best.toml``: the best controller of a study drives, and the wheels stand at the end, however it ends."""

from __future__ import annotations

import json
import re
import signal
import sys
from pathlib import Path

import pytest
from elib_process import Ran, started

import elib
from elib.learn import Champion
from elib.robot.watchdog import is_supported
from elib.simulator.emulator.motors import StepMotor
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from shared import until

NEAR = [-3.6, -2.8, -1.6, 0.0, 0.0, 0.8, 2.0, 2.4]
FAST = "sim://square?speed=max"

TASK = """
from elib import Scene
from elib.learn import Task

TASK = Task("nothing", "Do nothing.", (Scene(0.77, 0.6, step=1 / 40),), reward=lambda world, i: 0.0, robots=2)
"""


@pytest.fixture
def best(tmp_path: Path) -> Path:
    """Return the file of a champion that drives and avoids; its task is in a file beside it."""
    (tmp_path / "my_task.py").write_text(TASK)
    file = tmp_path / "best.toml"
    parameters = (0.7, *NEAR, 0.7, *NEAR[::-1])
    Champion(f"{tmp_path}/my_task.py:TASK", "braitenberg", ("proximity",), parameters).save(file)
    return file


def test_without_a_robot_it_drives_virtual_ones_in_the_world_of_its_task(best: Path, ran: Ran) -> None:
    code, out, err = ran("run", str(best), "--for", "1", "--json")
    assert code == 0, err
    summary = json.loads(out)
    assert summary["outcome"] == "time"
    assert [robot["path"] for robot in summary["robots"]] == ["world", "world"]
    assert all("world.toml?robots=2" in robot["url"] for robot in summary["robots"])
    assert summary["distance"] > 0.05


@pytest.mark.parametrize(
    ("end", "fitness", "seconds", "judged"),
    [
        ("lambda world: world.robots[1].x > 0.35", 0.15, 2.2, "solved"),
        ("None", 0.28, 4.0, "solved"),
        ("lambda world: world.robots[1].x > 0.25", 0.05, 0.8, "not solved"),
    ],
)
def test_in_the_world_of_its_task_it_drives_an_episode_and_says_its_fitness(
    best: Path, ran: Ran, end: str, fitness: float, seconds: float, judged: str
) -> None:
    task = (
        "from elib import EpuckModel, Pose, Scene\nfrom elib.learn import Task\n"
        "starts = (Pose(0.2, 0.2), Pose(0.2, 0.4))\n"
        "TASK = Task('go', 'Go.', (Scene(0.77, 0.6, step=1 / 40, starts=starts, model=EpuckModel(quality='ideal')),),\n"
        "    reward=lambda world, i: world.robots[i].x - world.robots[i].before_x,\n"
        f"    is_over={end}, robots=2, fitness='sum', solved=0.1, seconds=4.0)\n"
    )
    (best.parent / "my_task.py").write_text(task)
    code, _, err = ran("run", str(best), "--for", "60")
    assert code == 0, err
    found = re.search(r"^fitness (.*), (.*) \(from 0.1 on\)\nrobot time  (.*) s, ended by itself$", err, re.MULTILINE)
    assert found is not None, err
    assert float(found[1]) == pytest.approx(fitness, abs=0.01)
    assert found[2] == judged
    assert seconds - 0.2 < float(found[3]) < 60  # on a busy computer the first decision comes late


def test_scene_and_seed_choose_the_world_of_its_task_and_the_starts(best: Path, ran: Ran) -> None:
    task = (
        "from elib import Scene\nfrom elib.learn import Task\n"
        "scenes = tuple(Scene(width, 0.6, step=1 / 40) for width in (0.77, 3.0))\n"
        "TASK = Task('where', 'Say where the wall is.', scenes, seconds=0.1, fitness='sum',\n"
        "    reward=lambda world, i: world.robots[i].x + 10 * (world.setting[0].width > 1))\n"
    )
    (best.parent / "my_task.py").write_text(task)

    def fitness(*chosen: str) -> float:
        code, _, err = ran("run", str(best), "--", *chosen)
        assert code == 0, err
        return float(err.split()[err.split().index("fitness") + 1].rstrip(","))

    assert 0 < fitness() < 4 * 0.77
    found = [fitness("--scene", "2", "--seed", seed) for seed in ("1", "2", "1")]
    assert all(40 < each < 40 + 4 * 3 for each in found)
    assert found[0] == found[2] != found[1]
    assert ran("run", str(best), "--", "--help")[0] == 0


def test_a_robot_that_is_named_needs_no_task(best: Path, ran: Ran) -> None:
    (best.parent / "my_task.py").unlink()
    plot, log = best.with_name("drive.svg"), best.with_name("drive.log")
    options = ("--for", "10", "--plot", str(plot), "--log", str(log))
    code, _, err = ran("run", str(best), "--robot", FAST, "--robot", FAST + "&firmware=epuck2", *options)
    assert code == 0, err
    assert "robot time  10.0 s, its time was over" in err
    assert "robots      2 opened" in err
    assert plot.stat().st_size > 1000
    assert log.stat().st_size > 1000
    code, _, err = ran("run", str(best), "--for", "1")
    assert code == 2
    assert "there is no file" in err


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("best.toml", "--", "--fast"), 2, "hint: elib run best.toml -- --help"),
        (("best.toml", "--", "--scene", "2"), 2, "hint: nothing has the worlds 1 to 1: "),
        (("best.toml", "--robot", FAST, "--", "--seed", "2"), 2, "takes no arguments on a robot that you name"),
        (("bets.toml",), 2, "hint: did you mean best.toml?"),
        (("else/no.toml",), 2, "hint: elib evolve TASK writes the best controller"),
        (("bad.toml",), 1, "error: bad.toml:5: hiden is not a key of a controller's file\nhint: did you mean hidden?"),
        (("best.toml", "--robot", "tcp://127.0.0.1:1"), 1, "error: "),
        (("best.toml", "--robot", "sim://?speed=max", "--for", "0"), 2, "error: --for is 0.0 s"),
    ],
)
def test_what_cannot_run_is_refused_with_a_cure(
    best: Path,
    arguments: list[str],
    code: int,
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    ran: Ran,
) -> None:
    (best.parent / "else").mkdir()
    (best.parent / "bad.toml").write_text(best.read_text().replace("hidden", "hiden"))
    monkeypatch.chdir(best.parent)

    ended, _, err = ran("run", *arguments)
    assert ended == code
    assert message in err
    assert "Traceback" not in err


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.parametrize(
    "end",
    [
        None,
        pytest.param(signal.SIGINT, marks=pytest.mark.long),
        signal.SIGTERM,
        pytest.param(signal.SIGKILL, marks=pytest.mark.skipif(not is_supported(), reason="there is no watchdog here")),
    ],
)
async def test_the_wheels_stand_at_its_end_whatever_ends_it(best: Path, end: signal.Signals | None) -> None:
    motors: list[StepMotor] = []
    meet = lambda control: motors.extend(control.simulation.robots[0].emulator.firmware.motors)  # noqa: E731
    limit = ["--for", "1"] if end is None else []
    async with serve(SimulationSettings("square"), tcp="0", control=meet) as served:
        url = served[0].url
        with started("run", str(best), "--robot", url, *limit) as running:
            await until(lambda: any(motor.speed for motor in motors))
            if end is not None:
                running.process.send_signal(end)
            code = await until(lambda: running.process.poll() is not None and [running.process.poll()])
            assert code == [{None: 0, signal.SIGKILL: -signal.SIGKILL}.get(end, 128 + (end or 0))]
        await until(lambda: not any(motor.speed for motor in motors))
        await until(lambda: answers(url))  # what the program sent before is carried out before this is answered
        assert not any(motor.speed for motor in motors)


async def answers(url: str) -> bool:
    """Return whether a robot answers: not while the program, or what stops the robot after it, has it open."""
    try:
        async with elib.open(url) as robot:
            return bool(await robot.version())
    except elib.LinkBusy:
        return False
