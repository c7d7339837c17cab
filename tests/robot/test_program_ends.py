"""Programs that end without closing their robot: it stands still, nothing waits, and nothing is written to stderr."""

import subprocess
import sys
import textwrap
from itertools import product
from pathlib import Path

import pytest

from lanes import short
from shared import PATIENCE

MAX, REAL = "sim://square?speed=max&firmware=btcom-2.0", "sim://square?baud=0"
PRELUDE = """
import atexit, asyncio, threading
motors = []
# Registered before elib's own, so they are called after it.
atexit.register(lambda: print("wheels", [motor.speed for motor in motors]))
afterwards = []
atexit.register(lambda: [each() for each in afterwards])
import elib
from elib.testing import emulator_of

def connect(url):
    robot = elib.connect(url)
    motors.extend(emulator_of(robot).firmware.motors)
    return robot
"""
ENDINGS = {
    "it is left open": """
        robot = connect(URL)
        robot.set_speed(0.5, 0.5)
        robot.proximity()
        """,
    "it was used in a with block": """
        with connect(URL) as robot:
            robot.set_speed(0.5, 0.5)
        """,
    "a second thread has used it": """
        robot = connect(URL)
        thread = threading.Thread(target=robot.set_speed, args=(0.5, 0.5))
        thread.start()
        thread.join()
        robot.proximity()
        """,
    "a thread that has called goes on after the main thread's end": """
        robot = connect(URL)
        ended = threading.main_thread()
        def drive():
            ended.join()
            robot.set_speed(0.5, 0.5)
            robot.sleep(0.1)
        threading.Thread(target=drive).start()
        """,
    "a thread opens it after the main thread's end": """
        def drive():
            threading.main_thread().join()
            robot = keep = connect(URL)
            globals()["robot"] = robot
            robot.set_speed(0.5, 0.5)
        threading.Thread(target=drive).start()
        """,
    "a thread drives by a map after the main thread's end": """
        robot = connect(URL)
        def drive():
            threading.main_thread().join()
            robot.set_pose(0.1, 0.1)
            robot.go_to(0.11, 0.1, map=elib.Grid.of_world("square"))
        threading.Thread(target=drive).start()
        """,
    "it was opened in a running loop": """
        async def cell():
            global robot
            robot = connect(URL)
            robot.set_speed(0.5, 0.5)
        asyncio.run(cell())
        """,
    "several are left open": """
        robots = [connect(URL) for _ in range(3)]
        for robot in robots:
            robot.set_speed(0.5, 0.5)
        """,
    "calls and callbacks are pending": """
        robot = connect(URL)
        robot.set_speed(0.5, 0.5)
        pending = [robot.begin.calibrate_proximity() for _ in range(3)]
        robot.callback(lambda value, state: None).calibrate_proximity()
        """,
    "a thread that nobody waits for is in a call": """
        robot = connect(URL)
        robot.set_speed(0.5, 0.5)
        entered = threading.Event()
        def wait():
            entered.set()
            for snapshot in robot.watch("selector", rate=1000):
                pass
        threading.Thread(target=wait, daemon=True).start()
        entered.wait()
        robot.sleep(0.1)
        """,
    "a thread that nobody waits for calls after its end": """
        robot = connect(URL)
        robot.set_speed(0.5, 0.5)
        end = threading.Event()
        def call(each):
            end.wait()
            each()
        for each in (robot.selector, robot.begin.selector):
            thread = threading.Thread(target=call, args=[each], daemon=True)
            afterwards.append(lambda thread=thread: (end.set(), thread.join(0.2)))
            thread.start()
        """,
}


def program(body: str, url: str) -> str:
    """Return the text of a program that drives the robot *url*."""
    return f"URL = {url!r}\n{PRELUDE}{textwrap.dedent(body)}"


def run(*arguments: str, lines: str = "") -> subprocess.CompletedProcess[str]:
    """Run Python and wait for its end."""
    return subprocess.run(
        [sys.executable, *arguments], input=lines, capture_output=True, text=True, timeout=PATIENCE, check=False
    )


def wheels(count: int) -> str:
    """Return what a program prints at its end if its robots all stand."""
    return f"wheels {[0, 0] * count}\n"


def endings() -> list[object]:
    """Return each ending in simulated and in real time, some of them in one of both for the quick form."""
    quick = {
        ("it is left open", REAL),
        ("a thread that has called goes on after the main thread's end", REAL),
        ("a thread opens it after the main thread's end", MAX),
        ("a thread drives by a map after the main thread's end", MAX),
        ("it was opened in a running loop", REAL),
        ("several are left open", MAX),
        ("calls and callbacks are pending", MAX),
        ("a thread that nobody waits for is in a call", REAL),
        ("a thread that nobody waits for calls after its end", MAX),
    }
    cases = list(product(ENDINGS, (MAX, REAL)))
    return short(cases, *quick)


@pytest.mark.parametrize(("ending", "url"), endings())
def test_the_robot_stands_and_nobody_complains_when(ending: str, url: str, tmp_path: Path) -> None:
    script = tmp_path / "program.py"
    script.write_text(program(ENDINGS[ending], url))
    done = run(str(script))
    assert (done.returncode, done.stdout, done.stderr) == (0, wheels(3 if "several" in ending else 1), "")


@pytest.mark.parametrize("url", short([MAX, REAL], MAX))
def test_the_robot_stands_when_an_interactive_python_is_left(url: str, tmp_path: Path) -> None:
    script = tmp_path / "program.py"
    script.write_text(program("robot = connect(URL)", url))
    done = run("-i", str(script), lines="robot.set_speed(0.5, 0.5)\nrobot.speed()\n")
    assert (done.returncode, done.stdout) == (0, f"Wheels(left=0.5, right=0.5)\n{wheels(1)}")
    assert done.stderr.replace(">>> ", "").strip() == ""


@pytest.mark.long
@pytest.mark.parametrize("url", [MAX, REAL])
def test_the_shortest_program_of_all_ends_at_once(url: str) -> None:
    done = run("-c", f"import elib; elib.connect({url!r})")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_ctrl_c_in_a_call_shows_where_the_program_was_and_nothing_of_the_inside() -> None:
    program = f"""
import _thread, elib
with elib.connect({MAX!r}) as robot:
    robot.trace(lambda time, event: _thread.interrupt_main())
    robot.proximity()
"""
    ended = run("-c", program)
    assert ended.stderr.count("Traceback") == 1
    assert ended.stderr.endswith("KeyboardInterrupt\n")
