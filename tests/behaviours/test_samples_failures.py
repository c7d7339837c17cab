"""The samples about failure and about logs."""

from __future__ import annotations

from itertools import islice, pairwise
from pathlib import Path

import pytest

from elib.base.errors import ArgumentError, LinkLost
from elib.behaviours import RunContext, find, play
from elib.behaviours.logging_example import candidates, make_free
from elib.behaviours.sensors_tour import STEPS
from elib.link.session import Called, TraceEvent
from elib.records.log import logged_name
from elib.robot.aio import Epuck
from elib.testing.inside import transport_of
from lanes import short
from shared import with_fault

SIM = "sim://square?speed=max"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to keep logs in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


# -- failure by exceptions ---------------------------------------------------------------------------------------------


def test_success_and_failure_follow_each_other_until_the_time_is_over() -> None:
    outcome = play(find("failure-by-exceptions"), SIM, seconds=10)
    names = [state for _, state in outcome.states]
    assert names[:2] == ["okf", "kof"]
    assert all(one != other for one, other in pairwise(names))
    assert outcome.reason == "time"
    assert sum(text == "repaired" for text in outcome.messages) == names.count("kof")
    assert outcome.duration < 12


def test_a_stop_that_is_not_confirmed_is_told_and_repaired_too() -> None:
    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        def lose(time: float, event: TraceEvent) -> None:
            transport = transport_of(robots[0])
            failed = sum(text.startswith("stop() did not end") for text in run.messages)
            if failed == 2:  # the one that a failure begins, and the one that repairs
                transport.robot.link.end_silence()
            elif isinstance(event, Called) and event.request.name == "stop":
                transport.robot.link.silence()

        robots[0].trace(lose)

    lines = play(find("failure-by-exceptions"), SIM, seconds=15, watch=watch).messages
    told = [index for index, text in enumerate(lines) if text.startswith("stop() did not end")]
    assert len(told) == 2
    assert "repaired" in lines[told[-1] :]


@pytest.mark.parametrize(
    "keys",
    short(["loss=0.05&seed=3", "latency=0.2", "latency=0.2&loss=0.05"], "latency=0.2&loss=0.05"),
)
def test_a_bad_link_is_repaired_again_and_again(keys: str) -> None:
    outcome = play(find("failure-by-exceptions"), f"{SIM}&{keys}", seconds=120)
    assert outcome.reason == "time"
    assert sum(text == "repaired" for text in outcome.messages) > 20
    assert outcome.states[-1][0] > 110


def test_a_link_that_is_cut_ends_it_with_a_clear_error(folder: Path) -> None:
    with pytest.raises(LinkLost, match="the link was cut at 5 s"):
        play(find("failure-by-exceptions"), with_fault(folder, 'kind = "cut"\nfrom = 5\nuntil = 8', SIM), seconds=120)


def test_a_robot_that_restarts_meanwhile_does_not_end_it(folder: Path) -> None:
    outcome = play(find("failure-by-exceptions"), with_fault(folder, 'kind = "reset"\nat = 5', SIM), seconds=20)
    assert outcome.reason == "time"


# -- the log -----------------------------------------------------------------------------------------------------------


def test_names_are_numbered_before_the_ending() -> None:
    assert list(islice(candidates("run.log"), 3)) == ["run.log", "run1.log", "run2.log"]
    assert list(islice(candidates("log"), 3)) == ["log", "log1", "log2"]


def test_the_first_free_name_is_taken(folder: Path) -> None:
    (folder / "run.log").write_text("mine")
    assert make_free("run.log") == Path("run1.log")
    assert make_free("run.log") == Path("run2.log")
    assert (folder / "run.log").read_text() == "mine"


def test_a_folder_where_no_file_can_be_written_is_an_error_with_a_hint() -> None:
    with pytest.raises(ArgumentError, match="cannot be written: No such file") as caught:
        make_free("nowhere/run.log")
    assert "folder" in caught.value.hint


def test_the_log_has_both_tours_and_a_comment_before_each(folder: Path) -> None:
    outcome = play(find("logging-example"), SIM)
    lines = (folder / "elib.log").read_text().splitlines()
    comments = [text for text in lines if text.startswith("#")]
    assert [text.rpartition("state: ")[2] for text in comments if "state: " in text][:2] == [
        logged_name(step.command).replace("_", "-") for step in STEPS[:2]
    ]
    assert [text for text in comments if "state: " not in text] == [
        "# elib log 1, names: python",
        "#every answer may take 1 s",
        "#every answer may take 0.5 s",
    ]
    rows = [text.split() for text in lines if not text.startswith("#")]
    names = [logged_name(step.command) for step in STEPS] * 2
    assert [row[2:] for row in rows] == [[word, name, "0", "0"] for name in names for word in ("call", "ok")]
    assert {row[1] for row in rows} == {SIM}
    assert outcome.messages[-1] == f"the log is in {folder / 'elib.log'}"
    assert len(outcome.messages) == 2 * len(STEPS) + 1


def test_another_run_has_another_log(folder: Path) -> None:
    for _ in range(2):
        play(find("logging-example"), SIM)
    assert {path.name for path in folder.iterdir()} == {"elib.log", "elib1.log"}
    assert len((folder / "elib.log").read_text().splitlines()) == 2 * 3 * len(STEPS) + 3


def test_a_link_that_is_cut_ends_the_log_with_what_happened_in_it(folder: Path) -> None:
    with pytest.raises(LinkLost, match=r"the link was cut at 0\.3 s"):
        play(find("logging-example"), with_fault(folder, 'kind = "cut"\nfrom = 0.3\nuntil = 3.3', SIM), seconds=120)
    assert " ko " in (folder / "elib.log").read_text().splitlines()[-1]
