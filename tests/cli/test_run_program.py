"""``elib run FILE.py``: a program of the user, in every style, however it ends."""

from __future__ import annotations

import asyncio
import contextlib
import json
import signal
import subprocess
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from elib_process import COMMAND, Told, elib, environment, started

from elib.records.reader import read_recording
from elib.robot.watchdog import is_supported
from elib.simulator.emulator.motors import StepMotor
from elib.simulator.emulator.server import serve
from elib.simulator.emulator.settings import SimulationSettings
from lanes import short
from shared import run, until, wait_until

FAST = "sim://square?speed=max"

BLOCKING = f"""
import elib
with elib.connect({FAST!r}) as robot:
    robot.set_speed(0.4, 0.4)
    robot.sleep(2)
"""
WITHOUT_WITH = f"""
import elib
robot = elib.connect({FAST!r})
robot.set_speed(0.4, 0.4)
robot.sleep(2)
"""
ASYNC = f"""
import asyncio, elib
async def main(robot):
    await robot.set_speed(0.4, 0.4)
    await asyncio.sleep(2)
if __name__ == "__main__":
    elib.run(main, default={FAST!r})
"""
OWN_LOOP = """
import asyncio, elib
async def main():
    async with elib.open("sim://square") as robot:
        await robot.set_speed(1, 1)
        await asyncio.sleep(0.5)
asyncio.run(main())
"""
ONLY_MAIN = """
import asyncio
async def main(robot):
    await robot.set_speed(0.4, 0.4)
    await asyncio.sleep(2)
"""
BEHAVIOUR = """
import asyncio, elib
@elib.behaviour(world="square?speed=max")
async def go(robot: elib.Epuck) -> None:
    await robot.set_speed(0.4, 0.4)
    await asyncio.sleep(2)
"""
PLAYED = BEHAVIOUR + "elib.play(go)\n"
SWARM = """
import asyncio, elib
async def main(robots):
    await robots.all.set_speed(0.4, 0.4)
    await asyncio.sleep(2)
elib.swarm("sim://crowd?robots=3&speed=max").run(main)
"""
CALLBACK = f"""
import elib, threading
robot = elib.connect({FAST!r})
came = threading.Event()
robot.callback(lambda value, state: came.set()).set_speed(0.4, 0.4)
came.wait()
robot.sleep(2)
"""
RECONNECTING = BLOCKING.replace("connect", "reconnecting")
STYLES = {
    "blocking": BLOCKING,
    "reconnecting": RECONNECTING,
    "without with": WITHOUT_WITH,
    "async": ASYNC,
    "own loop": OWN_LOOP,
    "only main": ONLY_MAIN,
    "behaviour": BEHAVIOUR,
    "played": PLAYED,
    "swarm": SWARM,
    "callback": CALLBACK,
}
LATE = """
import signal, time
kill = signal.pthread_kill
signal.pthread_kill = lambda *to: (time.sleep(0.2), kill(*to))
"""
"""What lets the signal that ends a program come late, as on a busy computer."""
LONG = pytest.mark.long


def written(folder: Path, text: str, name: str = "my_robot.py") -> Path:
    path = folder / name
    path.write_text(text)
    return path


@contextlib.asynccontextmanager
async def served_robot() -> AsyncIterator[tuple[str, list[StepMotor]]]:
    """Serve a robot on a TCP port; yield its URL and its motors."""
    motors: list[StepMotor] = []
    meet = lambda control: motors.extend(control.simulation.robots[0].emulator.firmware.motors)  # noqa: E731
    async with serve(SimulationSettings("square"), tcp="0", control=meet) as served:
        yield served[0].url, motors


@pytest.mark.parametrize("style", short(STYLES, "without with", "async", "only main", "played", "swarm"))
def test_a_program_of_any_style_runs_on_the_robot_that_is_named(style: str, tmp_path: Path) -> None:
    written(tmp_path, STYLES[style])
    robot = "sim://arena?speed=max"
    done = elib("run", "my_robot.py", "--robot", robot, "--json", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    summary = json.loads(done.stdout)
    assert summary["outcome"] == "done"
    assert [each["url"] for each in summary["robots"]] == [robot]
    assert summary["robots"][0]["path"] == "world"
    assert summary["distance"] == summary["robots"][0]["distance"] > 0.03
    assert summary["seconds"] == pytest.approx(0.5 if style == "own loop" else 2, abs=0.4)
    assert summary["robots"][0]["link"]["lost"] == 0
    assert summary["robots"][0]["contacts"] == 0


@pytest.mark.parametrize("style", short(STYLES, "blocking", "own loop", "swarm"))
def test_its_time_ends_it_as_ctrl_c_does_and_the_robot_stands(style: str, tmp_path: Path) -> None:
    text = STYLES[style].replace("sleep(2)", "sleep(60)").replace("sleep(0.5)", "sleep(60)")
    written(tmp_path, LATE + text)
    robot = ["--robot", FAST] if style == "own loop" else []
    options = ["--for", "1", "--json", "--log", "run.log"]
    named = {} if style == "swarm" else {"ELIB_ROBOT": FAST}  # the swarm names its robots
    done = elib("run", "my_robot.py", *robot, *options, cwd=tmp_path, **named)
    assert (done.returncode, done.stderr) == (0, "")
    summary = json.loads(done.stdout)
    assert (summary["outcome"], summary["exit_code"]) == ("time", 0)
    assert summary["seconds"] == pytest.approx(1, abs=0.01)
    assert len(summary["robots"]) == (3 if style == "swarm" else 1)
    assert " ok stop " in (tmp_path / "run.log").read_text()


@pytest.mark.skipif(not is_supported(), reason="there is no watchdog here")
@pytest.mark.parametrize("style", short(STYLES, "async", "behaviour", "callback"))
async def test_a_program_of_any_style_that_is_killed_leaves_a_robot_that_stands(style: str, tmp_path: Path) -> None:
    file = written(tmp_path, STYLES[style].replace("sleep(2)", "sleep(600)").replace("sleep(0.5)", "sleep(600)"))
    async with served_robot() as (url, motors):
        with started("run", str(file), "--robot", url) as running:
            await until(lambda: all(motor.speed for motor in motors))
            running.process.kill()
            await until(lambda: not any(motor.speed for motor in motors))


WATCHED = "import elib\nfrom elib.robot.emergency import OPEN_STOPS\n"


@pytest.mark.skipif(not is_supported(), reason="there is no watchdog here")
@pytest.mark.parametrize("named", ["watchdog=False", "'sim://'", "keep_moving=True"])
async def test_a_program_that_says_so_has_no_watchdog_and_neither_has_a_robot_that_dies_with_it(
    named: str, tmp_path: Path
) -> None:
    text = f"{WATCHED}with elib.connect({named}):\n    print(any(each.watchdog for each in OPEN_STOPS))\n"
    file = written(tmp_path, text)
    async with serve(SimulationSettings("square"), tcp="0") as served:
        robot = {} if "sim" in named else {"ELIB_ROBOT": served[0].url}
        done = await asyncio.to_thread(elib, "run", str(file), **robot)
    assert (done.returncode, done.stdout) == (0, "False\n")


def test_the_summary_is_like_that_of_a_behaviour_and_the_files_are_there(tmp_path: Path) -> None:
    written(tmp_path, BLOCKING + "print('hello')\n")
    files = ["--plot", "p.png", "--record", "r.mcap", "--log", "l.log"]
    done = elib("run", "my_robot.py", *files, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "hello\n")
    assert [line.split()[0] for line in done.stderr.splitlines()] == [
        "robot",
        "distance",
        "commands",
        "round",
        "log",
        "recording",
        "plot",
    ]
    assert "by itself" in done.stderr
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "l.log").read_text().count("set_speed") == 2
    recording = read_recording(tmp_path / "r.mcap")
    assert recording.about["url"] == FAST
    assert repr(recording) == f"<Recording r.mcap of {FAST}>"


def test_robots_after_the_first_have_recordings_of_their_own(tmp_path: Path) -> None:
    written(tmp_path, SWARM)
    done = elib("run", "my_robot.py", "--record", "r.mcap", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    names = ["r-2.mcap", "r-3.mcap", "r.mcap"]
    assert sorted(each.name for each in tmp_path.glob("*.mcap")) == names
    assert sorted(json.loads(done.stdout)["recordings"]) == names


def test_the_command_line_and_the_folder_are_those_of_the_program(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    written(tmp_path / "lib", "X = 7\n", "helper.py")
    program = """
import argparse, sys, elib, helper
parser = argparse.ArgumentParser()
parser.add_argument("--speed", type=float)
parser.add_argument("word")
options = parser.parse_args()
print(sys.argv, options.speed, options.word, helper.X, __name__)
with elib.connect() as robot:
    print(robot.url)
"""
    written(tmp_path / "lib", program)
    done = elib("run", "lib/my_robot.py", "--robot", FAST, "--", "--speed", "3", "left", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [
        "['lib/my_robot.py', '--speed', '3', 'left'] 3.0 left 7 __main__",
        FAST,
    ]
    done = elib("run", "lib/my_robot.py", "--json", "--", "left", cwd=tmp_path, ELIB_ROBOT=FAST)
    assert "left 7 __main__" in done.stderr
    assert json.loads(done.stdout)["outcome"] == "done"


def test_the_file_of_a_program_has_its_whole_path_as_in_python(tmp_path: Path) -> None:
    written(tmp_path, "import os, sys\nos.chdir('/')\nprint(__file__, sys.modules['__main__'].__file__)\n")
    done = elib("run", "my_robot.py", cwd=tmp_path)
    assert done.stdout == f"{tmp_path / 'my_robot.py'} {tmp_path / 'my_robot.py'}\n", done.stderr


def test_a_package_is_run_as_python_m_does(tmp_path: Path) -> None:
    (tmp_path / "wall").mkdir()
    written(tmp_path / "wall", "", "__init__.py")
    written(tmp_path / "wall", f"import elib\ndef go():\n    elib.connect({FAST!r}).sleep(0.1)\n", "core.py")
    written(tmp_path / "wall", "import sys\nfrom .core import go\ngo()\nprint(sys.argv[1:], __name__)\n", "__main__.py")
    for name in ("wall/", "wall"):
        done = elib("run", name, "--", "--fast", cwd=tmp_path)
        assert (done.returncode, done.stdout) == (0, "['--fast'] __main__\n"), done.stderr
        assert "robot time  0.1 s" in done.stderr


def test_a_program_with_an_event_loop_of_its_own_runs_at_the_speed_that_is_named(tmp_path: Path) -> None:
    written(tmp_path, OWN_LOOP.replace("0.5", "600"))
    done = elib("run", "my_robot.py", "--robot", FAST, "--json", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["seconds"] == pytest.approx(600, abs=1)


def test_an_exception_group_has_the_lines_of_the_program_only(tmp_path: Path) -> None:
    written(
        tmp_path,
        """
import asyncio, elib
async def main(robot):
    async with asyncio.TaskGroup() as tasks:
        tasks.create_task(robot.text(""))
        tasks.create_task(fail(robot))
async def fail(robot):
    robot.stopp()
elib.run(main)
""",
    )
    done = elib("run", "my_robot.py", cwd=tmp_path, ELIB_ROBOT=FAST)
    assert done.returncode == 1
    assert 'File "my_robot.py", line 8, in fail' in done.stderr
    assert "Did you mean: 'stop'?" in done.stderr
    assert "src/elib" not in done.stderr


@pytest.mark.parametrize(
    ("ending", "code", "said"),
    [
        pytest.param("sys.exit()", 0, "by itself", marks=LONG),
        ("sys.exit(3)", 3, "by an error"),
        pytest.param("sys.exit('no more')", 1, "no more\n", marks=LONG),
        pytest.param("robot.set_speed(99, 0)", 1, "ArgumentError: left is 99 rev/s", marks=LONG),
        ("1 / 0", 1, "ZeroDivisionError"),
        ("robot.proximty()", 1, "no attribute 'proximty'. Did you mean: 'proximity'?\n"),
        ("speed = 1; robt", 1, "NameError: name 'robt' is not defined. Did you mean: 'robot'?\n"),
        ("raise KeyboardInterrupt", 130, "by Ctrl-C or a signal"),
    ],
)
def test_a_program_may_end_as_it_likes(ending: str, code: int, said: str, tmp_path: Path) -> None:
    written(tmp_path, f"import sys, elib\nrobot = elib.connect({FAST!r})\ndef go():\n    {ending}\ngo()\n")
    done = elib("run", "my_robot.py", cwd=tmp_path)
    assert done.returncode == code
    assert said in done.stderr
    assert "robot time" in done.stderr
    if "Error" in said:
        lines = [line for line in done.stderr.splitlines() if line.startswith("  File ")]
        assert lines == [f'  File "my_robot.py", line {n}, in {name}' for n, name in ((5, "<module>"), (4, "go"))]


def test_a_traceback_of_an_async_program_has_its_own_lines_only(tmp_path: Path) -> None:
    written(tmp_path, "import elib\nasync def main(robot):\n    await robot.drive('far')\nelib.run(main)\n")
    done = elib("run", "my_robot.py", cwd=tmp_path, ELIB_ROBOT=FAST)
    assert done.returncode in (1, 2)
    assert "src/elib" not in done.stderr
    assert "asyncio" not in done.stderr
    written(tmp_path, "import elib\nasync def main(robot):\n    {}['key']\nelib.run(main)\n")
    done = elib("run", "my_robot.py", cwd=tmp_path, ELIB_ROBOT=FAST)
    assert done.returncode == 1
    assert [line for line in done.stderr.splitlines() if line.startswith("  File ")] == [
        '  File "my_robot.py", line 4, in <module>',
        '  File "my_robot.py", line 3, in main',
    ]


def test_a_mistake_in_the_syntax_is_shown_as_python_does(tmp_path: Path) -> None:
    written(tmp_path, "import elib\nrobot = = 3\n")
    done = elib("run", "my_robot.py", cwd=tmp_path)
    assert done.returncode == 1
    assert "SyntaxError" in done.stderr
    assert "src/elib" not in done.stderr


def test_a_traceback_leaves_out_the_lines_that_dataclasses_make(tmp_path: Path) -> None:
    written(tmp_path, "import elib\nelib.connect('sim://?loss=3')\n")
    done = elib("run", "my_robot.py", cwd=tmp_path)
    assert [line for line in done.stderr.splitlines() if line.startswith("  File ")] == [
        '  File "my_robot.py", line 2, in <module>'
    ]


def test_what_a_program_prints_comes_before_its_summary(tmp_path: Path) -> None:
    def told() -> list[str]:
        command = [*COMMAND, "run", "my_robot.py"]
        return run(
            command, cwd=tmp_path, env=environment(PYTHONUNBUFFERED=""), stderr=subprocess.STDOUT
        ).stdout.splitlines()

    written(tmp_path, BLOCKING + "print('arrived')\n")
    assert told()[0] == "arrived"
    written(tmp_path, BLOCKING + "print('arrived')\n1 / 0\n")
    assert told()[:2] == ["arrived", "Traceback (most recent call last):"]


@pytest.mark.parametrize(
    ("style", "number"),
    [
        ("without with", signal.SIGINT),
        ("async", signal.SIGTERM),
        pytest.param("own loop", signal.SIGTERM, marks=LONG),
        ("swarm", signal.SIGTERM),
        ("behaviour", signal.SIGINT),
        pytest.param("without with", signal.SIGTERM, marks=LONG),
        pytest.param("async", signal.SIGINT, marks=LONG),
        pytest.param("own loop", signal.SIGINT, marks=LONG),
        pytest.param("swarm", signal.SIGINT, marks=LONG),
        pytest.param("behaviour", signal.SIGTERM, marks=LONG),
    ],
)
def test_signals_stop_the_robot(style: str, number: signal.Signals, tmp_path: Path) -> None:
    text = STYLES[style].replace("sleep(2)", "sleep(60)").replace("sleep(0.5)", "sleep(60)")
    written(tmp_path, text.replace("?speed=max", "").replace("&speed=max", ""))
    log = tmp_path / "run.log"
    with started("run", "my_robot.py", "--log", str(log), cwd=tmp_path) as running:

        def is_driving() -> bool:
            assert running.process.poll() is None
            return log.exists() and " ok set_speed " in log.read_text()

        wait_until(is_driving)
        assert running.end(number) == 128 + number
    assert "by Ctrl-C or a signal" in running.err.rest()
    assert "Traceback" not in running.err.rest()
    assert " ok stop " in log.read_text()


@pytest.mark.long  # It is given 5 s.
def test_a_program_that_catches_everything_is_ended_by_force(tmp_path: Path) -> None:
    written(
        tmp_path,
        f"import elib, threading\nrobot = elib.connect({FAST!r})\ndo = lambda: robot.sleep(9)\nwhile True:\n"
        "    try:\n        do()\n    except BaseException:\n        do = threading.Event().wait\n",
    )
    done = elib("run", "my_robot.py", "--for", "2", cwd=tmp_path)
    assert done.returncode == 1
    assert "it is ended now" in done.stderr


@pytest.mark.parametrize(("ending", "code"), [("raise", 0), ("raise SystemExit(3)", 3)])
def test_a_thread_that_waits_for_ever_does_not_outlive_the_time(ending: str, code: int, tmp_path: Path) -> None:
    program = f"""
import queue, threading, elib
threading.Thread(target=queue.Queue().get, name="consumer").start()
try:
    with elib.connect({FAST!r}) as robot:
        robot.sleep(60)
except KeyboardInterrupt:
    print("interrupted")
    {ending}
"""
    written(tmp_path, program)
    done = elib("run", "my_robot.py", "--for", "2", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (code, "interrupted\n")
    assert done.stderr.splitlines()[-1] == "consumer goes on after the time of the program, and is ended now"


@pytest.mark.parametrize(
    ("pool", "work"),
    [
        ("ThreadPoolExecutor", "robot.sleep, 2"),
        pytest.param("ProcessPoolExecutor", "pow, 9, 9", marks=LONG),
    ],
)
def test_a_pool_that_a_program_leaves_open_ends_when_its_work_is_done(pool: str, work: str, tmp_path: Path) -> None:
    program = f"""
import concurrent.futures, elib
if __name__ == "__main__":
    robot = elib.connect({FAST!r})
    pool = concurrent.futures.{pool}(1)
    pool.submit({work}).add_done_callback(lambda done: print(robot.proximity() and "its work is done"))
"""
    written(tmp_path, program)
    done = elib("run", "my_robot.py", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "its work is done\n")
    assert "ended by itself" in done.stderr


async def test_a_program_ends_although_the_name_of_a_computer_was_looked_up_for_it(tmp_path: Path) -> None:
    file = written(tmp_path, "import elib\nrobot = elib.connect()\nrobot.set_speed(0.4, 0.4)\n")
    async with served_robot() as (url, motors):
        done = await asyncio.to_thread(elib, "run", str(file), ELIB_ROBOT=url.replace("127.0.0.1", "localhost"))
        assert [motor.speed for motor in motors] == [0, 0]
    assert "ended by itself" in done.stderr


@pytest.mark.parametrize(
    ("tokens", "message"),
    [
        (["my_robt.py"], "hint: did you mean my_robot.py?"),
        (["other/x.py"], "there is no folder other"),
        (["avoid.py"], "hint: elib run avoid runs the behaviour that comes with elib"),
        (["my_robot"], "there is no behaviour 'my_robot'\nhint: to run the file: elib run my_robot.py"),
        (["./"], "is a folder"),
        (["my_folder"], "my_folder is a folder\nhint: name a program in it: elib run my_folder/my_robot.py"),
        (["notes.txt"], "notes.txt is not a program: its name does not end in .py"),
        (["my_robot.py", "--bogus"], "what belongs to the program stands after --"),
        (["my_robot.py", "--for", "0"], "--for is 0.0 s"),
        (["my_robot.py", "--plot", "x.gif"], "its name must end in .png"),
        (["my_robot.py", "--log", "no/x.log"], "there is no folder 'no' for the log 'no/x.log'"),
        (["my_robot.py", "--record", "no/x.mcap"], "there is no folder 'no' for the recording 'no/x.mcap'"),
        (["my_robot.py", "--robot", "maze"], "hint: write sim://maze"),
    ],
)
def test_a_wrong_call_says_what_is_meant_and_where_it_looked(
    refused: Told, tokens: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path, "raise SystemExit('must not run')\n")
    (tmp_path / "my_folder").mkdir()
    (tmp_path / "notes.txt").touch()
    monkeypatch.chdir(tmp_path)
    error = refused("run", *tokens)
    assert message in error
    assert "must not run" not in error
    if tokens[0].startswith("my_robt"):
        assert f"there is no file my_robt.py in {tmp_path}" in error


def test_a_view_without_its_packages_is_refused_before_the_program_runs(tmp_path: Path) -> None:
    written(tmp_path, "raise SystemExit('must not run')\n")
    (tmp_path / "without").mkdir()
    written(tmp_path / "without", "raise ImportError\n", "aiohttp.py")
    done = elib("run", "my_robot.py", "--view", cwd=tmp_path, PYTHONPATH=str(tmp_path / "without"))
    assert done.returncode == 1
    assert done.stderr.startswith("error: the page in the browser needs the package aiohttp")
    assert "hint: install the extra web" in done.stderr
    assert "must not run" not in done.stderr


def test_more_robots_than_urls_is_an_error_that_says_so(tmp_path: Path) -> None:
    written(tmp_path, "import elib\na = elib.connect('tcp://a:1')\nb = elib.connect('tcp://b:1')\n")
    done = elib("run", "my_robot.py", "--robot", FAST, cwd=tmp_path)
    assert done.returncode == 1
    assert "opens one more robot, tcp://b:1, but elib run --robot names only one" in done.stderr
    done = elib("run", "my_robot.py", "--robot", FAST, "--robot", FAST, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "robots      2 opened" in done.stderr


def test_robots_that_are_opened_one_after_another_share_one_time(tmp_path: Path) -> None:
    text = f"with elib.connect({FAST!r}) as robot:\n    robot.set_speed(0.5, 0.4)\n    robot.sleep(SECONDS)\n"
    written(tmp_path, "import elib\n" + text.replace("SECONDS", "3") + text.replace("SECONDS", "2"))
    done = elib("run", "my_robot.py", "--json", cwd=tmp_path)
    summary = json.loads(done.stdout)
    assert summary["seconds"] == pytest.approx(5, abs=0.1)
    assert [each["opened"] for each in summary["robots"]] == pytest.approx([0, 3], abs=0.1)
    assert [each["seconds"] for each in summary["robots"]] == pytest.approx([3, 2], abs=0.1)
    assert summary["distance"] == pytest.approx(0.45 * 0.1288 * 5, rel=0.05)


def test_a_program_without_a_robot_is_told_so(tmp_path: Path) -> None:
    written(tmp_path, "print('no robot here')\n")
    done = elib("run", "my_robot.py", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "no robot here\n")
    assert done.stderr == "robots  none was opened\n"


def test_a_file_with_several_behaviours_that_runs_none_says_how(tmp_path: Path) -> None:
    written(tmp_path, BEHAVIOUR + BEHAVIOUR.replace("go(", "come("))
    done = elib("run", "my_robot.py", cwd=tmp_path)
    assert done.returncode == 2
    assert "the file defines 2 behaviours, go, come, and runs none" in done.stderr
