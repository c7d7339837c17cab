"""``sim://WORLD?view``: a robot whose world is shown live by a process of its own, which ends with the program."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

import elib
from elib.base.errors import ArgumentError, SimulationError, Unsupported
from elib.link.transport import parse_url
from lanes import short
from shared import PATIENCE, needs_page, wait_until

pytestmark = [pytest.mark.skipif(sys.platform == "win32", reason="it looks for processes by ps"), needs_page]


@pytest.fixture(autouse=True)
def no_browser(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ELIB_BROWSER", "no")


def children_of(process: int) -> list[int]:
    """Return the processes that simulate for *process*, also when it has died: their command line tells them."""
    listed = subprocess.run(["ps", "-wweo", "pid=,ppid=,args="], capture_output=True, text=True, check=True).stdout
    rows = [line.split(None, 2) for line in listed.splitlines()]
    return [int(pid) for pid, parent, words in rows if int(parent) == process and "--until-eof" in words]


def wait_until_gone(process: int) -> None:
    def is_gone() -> bool:
        try:
            return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
        except OSError:
            return True

    wait_until(is_gone)


def test_the_url_has_a_key_without_a_value() -> None:
    assert str(parse_url("sim://corridor?view&seed=3")) == "sim://corridor?view&seed=3"
    assert str(parse_url("sim://?seed=3&view")) == "sim://?seed=3&view"
    for wrong, message in (
        ("sim://corridor?view=2", "view is '2'; it takes no value"),
        ("sim://corridor?view&speed=max", "a person watches a view in real time"),
        ("sim://corridor?seed", "seed has no value"),
        ("sim://corridor?view=", "view has no value"),
        ("tcp://127.0.0.1:4000?view", "tcp:// has no key 'view'"),
    ):
        with pytest.raises(ArgumentError, match=re.escape(message)):
            parse_url(wrong)


@pytest.mark.parametrize(
    "keys",
    [
        "&speed=4&latency=0.01&firmware=btcom-2.0",
        pytest.param("", marks=pytest.mark.long),
        pytest.param("&seed=3&firmware=epuck2-wifi", marks=pytest.mark.long),
    ],
)
def test_a_blocking_program_drives_a_robot_that_can_be_watched(keys: str, capsys: pytest.CaptureFixture[str]) -> None:
    with elib.connect(f"sim://corridor?view{keys}") as robot:
        [child] = children_of(os.getpid())
        page = capsys.readouterr().err.split()[1]
        with urllib.request.urlopen(page, timeout=PATIENCE) as answer:
            assert b"<html" in answer.read().lower()
        robot.set_speed(0.5, 0.5)
        wait_until(lambda: robot.encoders().left > 300)
        assert robot.proximity().origin == "simulator"
        assert robot.url.startswith("sim://corridor?view")
    wait_until_gone(child)


@pytest.mark.long
def test_a_swarm_shares_one_view_and_a_robot_can_be_opened_again(capsys: pytest.CaptureFixture[str]) -> None:
    async def main(robots: elib.Swarm) -> list[int]:
        await robots.all.set_speed(0.1, 0.1)
        assert len(robots) == 3
        return children_of(os.getpid())

    [child] = elib.swarm("sim://crowd?robots=3&view").run(main)
    assert capsys.readouterr().err.count("view http") == 1
    wait_until_gone(child)
    with elib.connect("sim://square?view"), elib.connect("sim://square?view"):
        both = children_of(os.getpid())
        assert len(both) == 2
    for child in both:
        wait_until_gone(child)


def test_a_world_that_cannot_be_shown_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SimulationError, match="the view could not be started: there is no world 'nowhere'") as caught:
        elib.connect("sim://nowhere?view")
    assert "choose one of arena" in caught.value.hint
    monkeypatch.setitem(sys.modules, "aiohttp", None)  # the import fails
    with pytest.raises(Unsupported, match="not installed"):
        elib.connect("sim://?view")


@pytest.mark.parametrize(
    "number",
    short([signal.SIGKILL, signal.SIGTERM, signal.SIGINT], signal.SIGKILL),
)
def test_the_process_ends_with_its_program_however_that_ends(number: signal.Signals, tmp_path: Path) -> None:
    program = tmp_path / "my_robot.py"
    program.write_text(
        "import elib\nrobot = elib.connect('sim://square')\nrobot.set_speed(0.5, 0.5)\n"
        "print('drives', flush=True)\nwhile True:\n    robot.sleep(1)\n"
    )
    command = [sys.executable, "-m", "elib", "run", str(program), "--view"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "drives\n"
            [child] = children_of(process.pid)
            process.send_signal(number)
            _, said = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
    wait_until_gone(child)
    assert said.startswith("view http://127.0.0.1:")
    assert process.returncode == (-number if number == signal.SIGKILL else 128 + number)


def test_the_option_is_refused_for_a_robot_without_a_world(tmp_path: Path) -> None:
    program = tmp_path / "my_robot.py"
    program.write_text("import elib\nelib.connect('tcp://127.0.0.1:1')\n")
    command = [sys.executable, "-m", "elib", "run", str(program), "--view"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 1
    assert "tcp://127.0.0.1:1 is not a simulation: there is no world to view" in done.stderr


@pytest.mark.long
@pytest.mark.parametrize(
    "program",
    [
        "import elib\nwith elib.connect('sim://square?speed=max&seed=3') as robot:\n    print(robot.url, flush=True)\n",
        "import elib\nasync def main(robot):\n    print(robot.url)\nelib.run(main, robot='sim://square?speed=max&seed=3')\n",
    ],
)
def test_the_option_shows_a_program_in_real_time_whatever_speed_it_names(program: str, tmp_path: Path) -> None:
    (tmp_path / "my_robot.py").write_text(program)
    command = [sys.executable, "-m", "elib", "run", str(tmp_path / "my_robot.py"), "--view"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert (done.returncode, done.stdout) == (0, "sim://square?seed=3&view\n"), done.stderr
