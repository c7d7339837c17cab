"""Programs where Python has neither threads nor sockets, as in a page of a browser: the host waits for them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
ALONE = """
import _thread, asyncio, runpy, socket, sys, threading, time
from elib.base.timebase import Host, move_into

class Alone(Host):
    def wait(self, seconds):
        if seconds > 0:
            time.sleep(seconds)

def refuse(*_):
    raise RuntimeError("there are no threads and no sockets here")

move_into(Alone())
_thread.start_new_thread = threading.Thread.start = socket.socketpair = refuse
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
"""
NEEDS_FILES = {"17_record.py", "18_replay.py", "19_learn.py"}


def output_of(*command: str, where: Path) -> tuple[str, int]:
    ended = subprocess.run([sys.executable, *command], cwd=where, capture_output=True, text=True, check=False)
    return ended.stdout + ended.stderr, ended.returncode


@pytest.mark.parametrize(
    "program",
    [
        pytest.param(each, marks=[] if each[:2] in ("06", "08", "09") else pytest.mark.long)
        for each in sorted({path.name for path in EXAMPLES.glob("*.py")} - NEEDS_FILES)
    ],
)
def test_an_example_prints_the_same_with_one_thread(program: str, tmp_path: Path) -> None:
    file = str(EXAMPLES / program)
    assert output_of("-c", ALONE, file, where=tmp_path) == output_of(file, where=tmp_path)


PROGRAMS = {
    "calls to two robots that were begun": """
import elib
with elib.connect("sim://arena?speed=max") as a, elib.connect("sim://arena?speed=max&seed=5") as b:
    calls = [a.begin.proximity(), b.begin.selector(), a.begin.encoders()]
    done, pending = elib.wait(calls)
    print(len(done), len(pending), [call.result() for call in calls])
    with elib.connect("sim://arena") as slow:  # in its own time: its ten minutes have not gone by before an answer
        done, pending = elib.wait([slow.begin.sleep(600), b.begin.proximity()], first=True)
        print(len(done), len(pending))
""",
    "a blocking call within a loop of another robot": """
import asyncio, elib
async def main(robot):
    with elib.connect("sim://arena?speed=max&seed=5") as other:
        await robot.set_speed(0.3, 0.3)
        print(other.proximity(), await robot.encoders(), other.time)
elib.run(main, robot="sim://arena?speed=max")
""",
    "a thread of asyncio": """
import asyncio, elib
async def main(robot):
    print(await asyncio.to_thread(sum, [1, 2]), await robot.selector())
elib.run(main, robot="sim://arena?speed=max")
""",
    "a robot that nothing refers to": """
import elib
robot = elib.connect("sim://arena?speed=max")
robot.set_speed(0.3, 0.3)
del robot
print(elib.connect("sim://arena?speed=max").encoders())
""",
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_does_the_same_with_one_thread(name: str, tmp_path: Path) -> None:
    file = tmp_path / "program.py"
    file.write_text(PROGRAMS[name])
    output, code = output_of("-c", ALONE, str(file), where=tmp_path)
    assert code == 0, output
    assert output == output_of(str(file), where=tmp_path)[0]
