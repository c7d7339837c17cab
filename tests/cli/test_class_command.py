"""``elib simulate --class``: a robot and a page for every student, and one for the teacher."""

from __future__ import annotations

import html
import re
import signal
import socket
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from importlib.resources import files
from pathlib import Path
from urllib.request import ProxyHandler, build_opener

import pytest
from elib_process import PATIENCE, Running, Told, started

import elib
from elib.base.files import WORLDS
from elib.cli import main
from elib.panel.server.classroom import LETTERS, Student, sheet
from elib.simulator.emulator.loopback import reachable
from elib.simulator.emulator.server import Served
from shared import held_port, needs_page, wait_until

pytestmark = needs_page

posix = pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")

CLIENT = """
import asyncio, sys, elib

async def drive(url):
    async with elib.open(url) as opened:
        robot = opened.within(60)
        while True:
            await robot.set_speed(0.2, -0.2)  # on the spot: nothing is in the way
            await robot.proximity()
            print("drives", url, flush=True)
            await asyncio.sleep(0.2)

async def main():
    await asyncio.gather(*map(drive, sys.argv[1:]))

asyncio.run(main())
"""


@contextmanager
def a_class(number: int, *options: str) -> Iterator[tuple[Running, list[list[str]]]]:
    """Start a class on free ports, and yield it with the rows of its table, the teacher's last."""
    with started("simulate", "--class", str(number), "--tcp", "0", "--view", "0", *options) as server:
        server.out.until("student")
        yield server, [server.out.line().split() for _ in range(number + 1)]


@contextmanager
def client(file: Path, urls: Sequence[str]) -> Iterator[Running]:
    """Start a program that drives several robots, and wait until all of them drive."""
    file.write_text(CLIENT)
    with started("run", str(file), "--", *urls) as running:
        waiting = {*urls}
        while waiting:
            waiting.discard(running.out.line().split()[1])
        yield running


def is_standing(url: str) -> bool:
    """Return whether a robot is free and stands; it is left as it is, so that a look does not stop it."""
    try:
        opened = elib.connect(url, keep_moving=True)
    except elib.LinkBusy:
        return False
    with opened:
        robot = opened.within(PATIENCE)
        before = robot.encoders()
        for _ in range(25):  # 0.1 s of the robot's time, by the rate of its serial line
            robot.proximity()
        return robot.encoders() == before


def steps(url: str) -> tuple[int, ...]:
    with elib.connect(url) as robot:
        return robot.within(PATIENCE).encoders().numbers


@posix
@pytest.mark.long
def test_eight_students_drive_and_a_program_that_is_killed_leaves_its_robots_standing(tmp_path: Path) -> None:
    with ExitStack() as stack:
        server, (*rows, (who, teacher)) = stack.enter_context(a_class(8))
        urls = [row[1] for row in rows]
        assert [int(row[0]) for row in rows] == list(range(1, 9))
        assert len(set(urls)) == 8
        assert who == "teacher"
        assert [row[2] for row in rows] == [f"{teacher}student/{number}" for number in range(1, 9)], "one port"
        file = tmp_path / "drive.py"
        clients = [stack.enter_context(client(file, urls[first : first + 2])) for first in range(0, 8, 2)]
        clients[1].process.kill()
        clients[1].process.wait(PATIENCE)
        for url in urls[2:4]:
            wait_until(lambda url=url: is_standing(url))  # its watchdog stops the robot within a moment
            assert steps(url) != (0, 0), "it has driven, and is the same robot for the next program"
        for other in (clients[0], *clients[2:]):
            assert other.process.poll() is None
            other.out.seen.clear()
            assert other.out.line().startswith("drives")
        with pytest.raises(elib.LinkBusy):
            elib.connect(urls[0])
        for other in (clients[0], *clients[2:]):
            other.end(signal.SIGINT)
        wait_until(lambda: all(map(is_standing, urls[:2])))
        assert server.end() == 0


@posix
@pytest.mark.long
def test_each_student_has_a_world_of_his_own_or_all_share_one() -> None:
    with a_class(2, str(files("elib") / WORLDS / "soccer.toml"), "--robots", "2") as (server, rows):
        assert [len(row) for row in rows] == [4, 4, 2], "number, two robots, page; the teacher's page"
        assert server.end() == 0
    with started("simulate", "arena", "--class", "3", "--shared", "--tcp", "0", "--view", "0") as server:
        server.out.until("student")
        rows = [server.out.line().split() for _ in range(4)]
        assert [row[0] for row in rows] == ["1", "2", "3", "teacher"]
        assert [len(row) for row in rows] == [3, 3, 3, 2]
        assert server.end() == 0


@posix
@pytest.mark.long
def test_with_a_host_other_computers_are_let_in_and_addresses_are_those_that_they_can_open(tmp_path: Path) -> None:
    file = tmp_path / "class.html"
    with a_class(2, "square", "--host", "--sheet", str(file)) as (server, rows):
        assert server.err.line().startswith("Every computer in this network can drive these robots")
        own = reachable("0.0.0.0")
        *rows, (_, teacher, token) = rows
        for _, robot, page in rows:
            assert robot.startswith(f"tcp://{own}:")
            assert "0.0.0.0" not in page
            assert all(text in file.read_text() for text in (robot, page))
        assert re.fullmatch(f"[{LETTERS}]{{8}}", token)
        assert token not in file.read_text()
        with elib.connect(rows[0][1]) as robot:
            robot.selector()
        opener = build_opener(ProxyHandler({}))
        assert opener.open(rows[0][2], timeout=PATIENCE).status == 200
        with pytest.raises(OSError, match="401"):
            opener.open(teacher, timeout=PATIENCE)
        assert server.end() == 0


def test_without_a_host_nobody_else_is_let_in() -> None:
    with a_class(1) as (server, rows):
        (_, robot, page), _ = rows
        assert robot.startswith("tcp://127.0.0.1:")
        assert page.startswith("http://127.0.0.1:")
        own = reachable("0.0.0.0")
        if own != "127.0.0.1":
            with pytest.raises(OSError), socket.create_connection((own, int(robot.rpartition(":")[2])), 2):
                pass
        server.process.terminate()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--class", "0"], "--class is 0; it must be a whole number from 1 to 64"),
        (["--class", "65"], "--class is 65"),
        (["--class", "2", "--pty"], "--class does not go with --pty"),
        (["--class", "2", "--control", "-v"], "--class does not go with --control and --verbose"),
        (["--class", "2", "--tcp", "127.0.0.1:4000"], "with --class it is the port of the first student"),
        (["--class", "2", "--shared", "--robots", "3"], "--shared has a robot for each student"),
        (["--host"], "--host, --shared and --sheet belong to a class"),
        (["--class", "2", "--tcp", "65535", "--view", "0"], "student 2 would get the port 65536"),
        (["--class", "2", "--tcp", "0", "--view", "127.0.0.1:8600"], "with --class it is the port of the pages"),
        (["--class", "2", "nowhere"], "nowhere"),
    ],
)
def test_what_cannot_be_is_refused_with_the_reason(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", *words]) != 0
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err


def test_a_robot_cannot_have_the_port_of_a_page(refused: Told) -> None:
    with held_port() as number:
        port = str(number)
        said = refused("simulate", "--class", "2", "--tcp", port, "--view", port, code=1)
    assert f"port {port} of 127.0.0.1 is taken" in said


def test_a_sheet_has_a_piece_for_each_student_and_none_for_the_teacher() -> None:
    students = [
        Student(
            1,
            [Served("epuck-1", "tcp://10.0.0.1:4001"), Served("epuck-2", "tcp://10.0.0.1:4002")],
            "http://10.0.0.1:8600/student/1",
        ),
        Student(0, [], "http://10.0.0.1:8600/", "secret"),
    ]
    page = sheet(students, "<class>")
    assert page.count("<section>") == 1
    both = "tcp://10.0.0.1:4001 tcp://10.0.0.1:4002"
    for line in (f"export ELIB_ROBOT='{both}'", f'$env:ELIB_ROBOT = "{both}"', f"set ELIB_ROBOT={both}"):
        assert f"<code>{html.escape(line)}</code>" in page
    assert "secret" not in page
    assert "<title>&lt;class&gt;</title>" in page
