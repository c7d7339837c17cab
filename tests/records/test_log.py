"""The log of a robot's calls: its columns, its moments, and that it never holds a robot up."""

from __future__ import annotations

import asyncio
import io
import re
import threading
from collections import Counter
from pathlib import Path
from typing import TypeVar
from urllib.parse import unquote

import pytest

import elib
from elib.base.errors import ArgumentError, ElibError, LinkClosed, ReplyTimeout
from elib.link.protocol.commands import SPECS
from elib.records import writer
from elib.records.log import HEADER, Log, escaped, logged_name
from elib.records.lognames import NAMES_OF_2011
from elib.robot.runner import run_on
from elib.testing import simulated
from elib.testing.inside import transport_of
from shared import GREETING, PATIENCE, inside

T = TypeVar("T")

SIM = "sim://square?speed=max&firmware=btcom-2.0"
LINE = re.compile(r"\d+\.\d{8} \S+ (call|ok|ko) \w+ \d+ \d+")
HEAD = f"{HEADER.format('python')}\n"


def rows(text: str) -> list[list[str]]:
    """Return the columns of every line that is not a comment."""
    return [line.split(" ") for line in text.splitlines() if not line.startswith("#")]


def events(text: str) -> list[str]:
    """Return the columns three to six of every line."""
    return [" ".join(columns[2:]) for columns in rows(text)]


class Gate(io.StringIO):
    """A stream that takes nothing while it is shut, and says when it took a row."""

    def __init__(self) -> None:
        super().__init__()
        self.is_open = threading.Event()
        self.took = threading.Event()

    def write(self, text: str, /) -> int:
        if text:
            assert self.is_open.wait(PATIENCE)
        count = super().write(text)
        if rows(text):
            self.took.set()
        return count


# -- the lines -------------------------------------------------------------------------------------------------------


@inside(elib.open, SIM)
async def test_a_call_and_its_answer_are_two_lines_of_six_columns(robot: elib.Epuck) -> None:
    stream = io.StringIO()
    await robot.sleep(1)
    with Log(robot, stream):
        called = robot.time
        await robot.proximity()
    assert stream.getvalue() == HEAD + (
        f"{called:.8f} {SIM} call proximity 0 0\n{robot.time:.8f} {SIM} ok proximity 0 0\n"
    )
    assert all(LINE.fullmatch(line) for line in stream.getvalue().removeprefix(HEAD).splitlines())


@inside(elib.open, SIM)
async def test_what_waits_and_what_is_unanswered_is_counted_without_the_call_itself(robot: elib.Epuck) -> None:
    stream = io.StringIO()
    with Log(robot, stream):
        await asyncio.gather(robot.proximity(), robot.ambient_light(), robot.selector())
    assert events(stream.getvalue()) == [
        "call proximity 0 0",
        "call ambient_light 0 1",
        "call selector 1 2",
        "ok proximity 2 2",
        "ok ambient_light 1 1",
        "ok selector 0 0",
    ]


@inside(elib.open, SIM)
async def test_a_call_whose_answer_was_lost_or_that_was_given_up_is_a_ko(robot: elib.Epuck) -> None:
    stream = io.StringIO()
    with Log(robot, stream):
        transport_of(robot).robot.link.lose_next_reply()
        with pytest.raises(ReplyTimeout):
            await robot.set_speed(0.1, 0.1)
        await robot.speed()
        call = asyncio.create_task(robot.reset())
        await robot.sleep(0.1)
        call.cancel()
        await asyncio.wait([call])
    assert events(stream.getvalue())[::2] == ["call set_speed 0 0", "call speed 0 0", "call reset 0 0"]
    assert events(stream.getvalue())[1::2] == ["ko set_speed 0 0", "ok speed 0 0", "ko reset 0 0"]


def test_all_four_styles_and_text_log_the_same_names() -> None:
    stream = io.StringIO()
    answered = threading.Event()
    with elib.connect(SIM) as robot:
        log = Log(robot.robot, stream)
        robot.set_speed(0, 0)
        robot.begin.set_speed(0, 0).end()
        robot.callback(lambda value, state: answered.set()).set_speed(0, 0)
        while not answered.is_set():
            robot.sleep(0.01)
        robot.text("D,0,0")
        log.close()
    assert [row[3] for row in rows(stream.getvalue())] == ["set_speed"] * 8


def test_every_command_of_2011_has_its_name_and_the_others_have_their_own() -> None:
    assert len(NAMES_OF_2011) == 22
    assert set(NAMES_OF_2011) <= set(SPECS)
    assert logged_name("reset", "2011") == "Reset()"
    assert logged_name("version", "2011") == "BTComVersion(..)"
    assert logged_name("gyroscope", "2011") == "gyroscope(..)"
    assert {logged_name(name) for name in SPECS} == set(SPECS)


def test_a_log_says_its_vocabulary_in_its_first_line() -> None:
    for names, shown in (("python", "proximity"), ("2011", "GetIR(..)")):
        stream = io.StringIO()
        with elib.connect(SIM) as robot, robot.log(stream, names=names):  # type: ignore[arg-type]  # both are Vocabulary
            robot.proximity()
        lines = stream.getvalue().splitlines()
        assert lines[0] == f"# elib log 1, names: {names}"
        assert [line.split(" ")[3] for line in lines[1:]] == [shown] * 2


def test_a_vocabulary_that_nobody_knows_is_refused() -> None:
    stream = io.StringIO()
    with elib.connect(SIM) as robot, pytest.raises(ArgumentError, match="names is 'latin'; it must be \"python\" or"):
        robot.log(stream, names="latin")  # type: ignore[arg-type]
    assert stream.getvalue() == ""


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("Ada", "Ada"),
        ("Ada L.", "Ada%20L."),
        ("100%", "100%25"),
        ("a\tb\nc", "a%09b%0Ac"),
        ("no\u00a0break", "no%C2%A0break"),
        ("Žofie", "Žofie"),
        ("sim://x?a=%20", "sim://x?a=%2520"),
    ],
)
def test_a_name_is_one_word_and_can_be_turned_back(name: str, word: str) -> None:
    assert escaped(name) == word
    assert unquote(word) == name


# -- comments, starting and stopping -----------------------------------------------------------------------------------


@inside(elib.open, SIM)
async def test_a_comment_is_marked_on_each_of_its_lines(robot: elib.Epuck) -> None:
    stream = io.StringIO()
    with Log(robot, stream) as log:
        log.comment("start of second round")
        log.comment("two\nlines\r\nand\u2028more\n")
        log.comment("")
        with pytest.raises(ArgumentError, match=r"^the comment is 5; it must be a text"):
            log.comment(5)  # type: ignore[arg-type]
    assert stream.getvalue() == HEAD + "#start of second round\n#two\n#lines\n#and\n#more\n#\n"


@inside(elib.open, SIM)
async def test_a_log_can_be_stopped_and_started_and_takes_comments_meanwhile(robot: elib.Epuck) -> None:
    stream = io.StringIO()
    log = Log(robot, stream)
    await robot.selector()
    log.stop()
    assert not log.is_running
    await robot.proximity()
    log.comment("paused")
    log.start()
    await robot.speed()
    log.close()
    await robot.encoders()
    assert [line.split(" ")[-3] for line in stream.getvalue().splitlines() if line[0] != "#"] == [
        *["selector"] * 2,
        *["speed"] * 2,
    ]
    assert "#paused\n" in stream.getvalue()


@inside(elib.open, SIM)
async def test_a_call_that_is_logged_gets_its_outcome_though_the_log_stops_and_no_other_call_does(
    robot: elib.Epuck,
) -> None:
    stream = io.StringIO()
    early = asyncio.create_task(robot.proximity())
    await asyncio.sleep(0)
    log = Log(robot, stream)
    logged = asyncio.create_task(robot.proximity())
    await early
    log.stop()
    unlogged = asyncio.create_task(robot.proximity())
    await logged
    log.start()
    await unlogged
    await robot.proximity()
    log.close()
    assert [row[2] for row in rows(stream.getvalue())] == ["call", "ok", "call", "ok"]


@inside(elib.open, SIM)
async def test_a_closed_log_says_so(robot: elib.Epuck) -> None:
    log = Log(robot, io.StringIO())
    log.close()
    log.close()
    for use in (log.start, lambda: log.comment("late")):
        with pytest.raises(ElibError, match="the log StringIO is closed"):
            use()
    assert "closed" in repr(log)
    log.stop()


@inside(elib.open, SIM)
async def test_a_robot_without_a_log_has_no_hook_left(robot: elib.Epuck) -> None:
    before = dict(robot.session.hooks)
    Log(robot, io.StringIO()).close()
    assert robot.session.hooks == before


# -- where it goes -----------------------------------------------------------------------------------------------------


def test_a_file_is_appended_to_and_complete_when_the_robot_is_closed(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    path.write_text("#before\n")
    for _ in range(2):
        with elib.connect(SIM, name="Ada") as robot:
            log = Log(robot.robot, path)
            assert log.target == str(path)
            for _ in range(100):
                robot.selector()
        assert "closed" in repr(log)
    text = path.read_text()
    assert text.startswith(f"#before\n{HEAD}")
    assert text.count(HEAD) == 2
    assert Counter(row[2] for row in rows(text)) == {"call": 202, "ok": 202}  # each run ends in a stop


def test_lines_reach_a_stream_while_the_robot_is_open_without_being_asked_for_and_leave_it_open() -> None:
    stream = Gate()
    stream.is_open.set()
    with elib.connect(SIM, name="Ada and\nCharles") as robot:
        Log(robot.robot, stream)
        robot.selector()
        assert stream.took.wait(PATIENCE)
        assert events(stream.getvalue()) == ["call selector 0 0", "ok selector 0 0"]
    stream.write("#mine\n")
    assert stream.getvalue().endswith("ok stop 0 0\n#mine\n")
    assert {row[1] for row in rows(stream.getvalue())} == {"Ada%20and%0ACharles"}, "a blank adds no column"


@inside(elib.open, SIM)
async def test_what_takes_no_text_is_refused(robot: elib.Epuck, tmp_path: Path) -> None:
    closed = io.StringIO()
    closed.close()
    for target in (3, None, io.BytesIO()):
        with pytest.raises(ArgumentError, match="takes no text"):
            Log(robot, target)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="closed file"):
        Log(robot, closed)
    with pytest.raises(FileNotFoundError):
        Log(robot, tmp_path / "nowhere" / "run.log")


def test_a_robot_that_is_not_open_or_was_closed_cannot_be_logged(tmp_path: Path) -> None:
    with pytest.raises(LinkClosed, match="not open"):
        Log(elib.open(SIM), io.StringIO())
    file = tmp_path / "run.log"
    closed: list[elib.Epuck] = []

    async def main(robot: elib.Epuck) -> None:
        closed.append(robot)
        await robot.close()
        with pytest.raises(LinkClosed, match="not open any more"):
            robot.log(file)

    run_on(SIM, main)
    with pytest.raises(LinkClosed, match="not open any more"):
        closed[0].log(file)
    with elib.connect(SIM) as robot:
        pass
    with pytest.raises(LinkClosed, match="not open any more"):
        robot.log(file)
    assert not file.exists()


# -- threads, slow disks and full ones ---------------------------------------------------------------------------------


def test_lines_from_many_threads_stay_whole() -> None:
    stream = io.StringIO()
    with elib.connect(SIM) as robot:
        log = Log(robot.robot, stream)

        def work(number: int) -> None:
            for turn in range(25):
                robot.selector()
                log.comment(f"thread {number}, turn {turn}")

        threads = [threading.Thread(target=work, args=(number,)) for number in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
    lines = stream.getvalue().removeprefix(HEAD).splitlines()
    assert sum(line.startswith("#thread ") for line in lines) == 200
    assert all(line.startswith("#thread ") or LINE.fullmatch(line) for line in lines)
    assert Counter(row[2] for row in rows(stream.getvalue())) == {"call": 201, "ok": 201}


class Slow(io.StringIO):
    """A stream that lets other threads in between any two characters."""

    def write(self, text: str, /) -> int:
        for each in text:
            super().write(each)
            threading.Event().wait(0)
        return len(text)


def test_two_robots_may_share_a_stream() -> None:
    stream = Slow()

    def drive(name: str) -> None:
        with elib.connect(SIM, name=name) as robot:
            Log(robot.robot, stream)
            for _ in range(10):
                robot.selector()

    threads = [threading.Thread(target=drive, args=(name,)) for name in ("Ada", "Bob")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
    lines = stream.getvalue().splitlines()
    assert lines.count(HEAD.strip()) == 2
    lines = [line for line in lines if line != HEAD.strip()]
    assert all(LINE.fullmatch(line) for line in lines)
    assert Counter(line.split(" ")[1] for line in lines) == {"Ada": 22, "Bob": 22}


@inside(elib.open, SIM)
async def test_a_target_that_accepts_no_text_does_not_hold_the_robot_up(
    robot: elib.Epuck, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer, "MAX_LINES", 10)
    monkeypatch.setattr(writer, "MANY_LINES", 1)
    stream = Gate()
    log = Log(robot, stream)
    for _ in range(100):
        await robot.selector()
    stream.is_open.set()
    log.close()
    text = stream.getvalue()
    lost = [int(count) for count in re.findall(r"^#(\d+) lines were lost", text, re.MULTILINE)]
    assert lost
    assert sum(lost) + len(rows(text)) == 200


@inside(elib.open, SIM)
async def test_a_full_disk_ends_the_log_and_not_the_robot(robot: elib.Epuck) -> None:
    class Full(io.StringIO):
        def write(self, text: str, /) -> int:
            if text:
                raise OSError(28, "No space left on device")
            return 0

    log = Log(robot, Full())
    await robot.selector()
    with pytest.raises(ElibError, match=r"could not be written: .*No space left") as caught:
        log.close()
    assert isinstance(caught.value.__cause__, OSError)
    with pytest.raises(ElibError, match="No space left"):
        log.comment("more")
    await robot.selector()


# -- links that fail ---------------------------------------------------------------------------------------------------


@simulated
async def test_a_reconnecting_robot_is_logged_across_the_gap() -> None:
    stream = io.StringIO()
    async with elib.reconnecting(SIM, name="Ada") as robot:
        Log(robot, stream)
        await robot.selector()
        transport_of(robot).robot.link.cut()
        await robot.within(20).proximity()
        await robot.selector()
    text = stream.getvalue()
    assert re.search(r"^#\d+\.\d{8} Ada the link is down: ", text, re.MULTILINE)
    assert re.search(r"^#\d+\.\d{8} Ada the link is back after \d+\.\d{3} s$", text, re.MULTILINE)
    assert [row[2:4] for row in rows(text)][-4:-2] == [["call", "selector"], ["ok", "selector"]]


@inside(elib.open, SIM)
async def test_a_restart_nobody_asked_for_is_noted(robot: elib.Epuck) -> None:
    stream = io.StringIO()
    with Log(robot, stream):
        transport_of(robot).robot.link.inject_noise(GREETING)
        await robot.sleep(1)
    assert stream.getvalue().endswith(f" {SIM} the robot has restarted unasked\n")
    assert stream.getvalue().startswith("#")


@inside(elib.open, SIM)
async def test_a_robot_forgets_the_logs_that_were_closed_before_it(robot: elib.Epuck) -> None:
    for _ in range(3):
        robot.log(io.StringIO()).close()
    last = robot.log(io.StringIO())
    assert robot._link.records == [last]
