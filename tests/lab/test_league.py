"""Games of two programs in one world, and the table of a league."""

from __future__ import annotations

import csv
import json
import re
import shutil
import socket
import sys
from pathlib import Path

import pytest
from labs_for_tests import Talker

from elib.base.errors import SimulationError
from elib.lab import Lab, load_lab, run_together, running
from elib.lab.goal import Trace, Zone
from elib.lab.goals import Catches, Outdoes
from elib.lab.league import outcome, pairs, standings, to_html, to_json, to_rows
from elib.lab.marker import RunOver, wall_over
from elib.lab.marking import Mark, mark, play, play_all
from elib.lab.running import PlainProgram
from elib.lab.sandbox import Limits
from elib.lab.submissions import Submission, find_submissions
from shared import PATIENCE, run

isolated = pytest.mark.usefixtures("walls")

GAME = """
title = "A race"
summary = "Come to the nest."
time = 3
opponent = "opponent.py"

[[variant]]
name = "given"
world = "world.toml"

[[goal]]
name = "wins"
kind = "outdoes"
"""
WORLD = """
[arena]
size = [1.0, 0.6]

[epuck]
quality = "ideal"

[[zone]]
name = "right nest"
position = [0.4, 0.15]
radius = 0.05
score = 3

[[zone]]
name = "left nest"
position = [0.4, 0.45]
radius = 0.05
score = 3

[[robot]]
position = [0.3, 0.15]

[[robot]]
position = [0.3, 0.45]
"""
FAST = "import elib\nwith elib.connect() as robot:\n    robot.drive(0.1)\n"
STANDS = "import elib\nwith elib.connect() as robot:\n    robot.sleep(0.2)\n"
CRASHES = f"{FAST}raise RuntimeError('no more')\n"
SILENT = "print('nothing to do')\n"
HANGS = "import elib, time\nwith elib.connect() as robot:\n    robot.drive(0.1)\n    while True: pass\n"


@pytest.fixture
def game(tmp_path: Path) -> Lab:
    folder = tmp_path / "race"
    folder.mkdir()
    for name, text in (("lab.toml", GAME), ("world.toml", WORLD), ("opponent.py", STANDS)):
        (folder / name).write_text(text)
    return load_lab(folder)


def programs(folder: Path, **texts: str) -> list[Submission]:
    """Return submissions with these texts."""
    folder.mkdir()
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(text)
    return find_submissions(folder)


def league(game: Lab, submissions: list[Submission]) -> list[list[Mark]]:
    return [play(game.folder, each, safe=False, draws=False) for each in pairs(submissions)]


@pytest.mark.parametrize(
    ("own", "other", "holds", "text"),
    [
        ([0.0, 0.2, 0.3], [0.5, 0.5, 0.39], True, "caught the other one after 0.5 s"),
        ([0.0, 0.2, 0.2], [0.5, 0.5, 0.5], False, "did not catch the other one: 0.30 m at the nearest, after 0.2 s"),
        ([0.5, 0.5, 0.39], [0.0, 0.2, 0.3], False, "caught after 0.5 s"),
        ([0.5, 0.5, 0.5], [0.0, 0.2, 0.2], True, "got away: 0.30 m at the nearest, after 0.2 s"),
    ],
)
def test_who_begins_in_the_zone_must_catch_the_other_one_and_who_does_not_must_get_away(
    own: list[float], other: list[float], holds: bool, text: str
) -> None:
    paths = [[[(x, 0.0, 0.0)] for x in path] for path in (own, other)]
    trace = Trace(step=0.25, poses=paths[0], others=paths[1], zones={"seeker": Zone("seeker", 0.0, 0.0, radius=0.1)})
    assert Catches(name="catches", zones=("seeker",), within=0.1).judge(trace) == (holds, text)


def test_a_league_shows_no_goals_of_a_program_that_failed(game: Lab, tmp_path: Path) -> None:
    found = play(game.folder, programs(tmp_path / "class", crashes=CRASHES, stands=STANDS), safe=False, draws=False)
    page, values = to_html(game, standings([found]), [found]), to_json(game, standings([found]), [found])
    crashed, stood = page.partition("crashes.py lost")[2].split("stands.py won")
    assert "<li" not in crashed
    assert "RuntimeError" in crashed
    assert "wins</b> fails" in stood
    assert values["games"][0]["goals"][0] == {}


def test_the_faster_of_two_programs_wins_on_either_side_and_each_has_one_robot(game: Lab, tmp_path: Path) -> None:
    games = league(game, programs(tmp_path / "class", fast=FAST, stands=STANDS))
    assert [[each.name for each in marks] for marks in games] == [["fast.py", "stands.py"], ["stands.py", "fast.py"]]
    assert [outcome(marks, 0) for marks in games] == [("won", "lost"), ("lost", "won")]
    assert [(row.name, row.games, row.won, row.points) for row in standings(games)] == [
        ("fast.py", 2, 2, 6),
        ("stands.py", 2, 0, 0),
    ]
    assert "3 points" in games[0][0].runs[0].goals[0].text


def test_a_program_that_fails_loses_although_it_has_more_points(game: Lab, tmp_path: Path) -> None:
    found = play(game.folder, programs(tmp_path / "class", crashes=CRASHES, stands=STANDS), safe=False, draws=False)
    assert [each.points for each in found] == [1, 0]
    assert outcome(found, 0) == ("lost", "won")
    [_, last] = standings([found])
    assert last.remarks == ["it ended with exit code 1 in line 4 of crashes.py: RuntimeError: no more (given)"]


@pytest.mark.parametrize(
    ("reached", "found"),
    [
        ((1, 1), ("drawn", "drawn")),
        ((0, 2), ("lost", "won")),
        ((-1, 0), ("lost", "won")),
        ((-1, -1), ("lost", "lost")),
    ],
)
def test_a_game_in_which_both_fail_is_lost_for_both(reached: tuple[float, float], found: tuple[str, str]) -> None:
    marks = [Mark(name, 0.0, 1.0, reached=[value]) for name, value in zip("ab", reached, strict=True)]
    assert outcome(marks, 0) == found


def test_points_come_before_time_with_energy_and_that_before_what_is_left() -> None:
    goal = Outdoes(name="wins")
    for own, other, wins in (
        ((1.0, 2.0, 0.0), (0.0, 9.0, 1.0), True),
        ((0.0, 9.0, 0.1), (0.0, 8.0, 0.9), True),
        ((0.0, 9.0, 0.4), (0.0, 9.0, 0.5), False),
        ((0.0, 9.0, 0.5), (0.0, 9.0, 0.5), False),
    ):
        trace = Trace(step=1 / 64, poses=[[(0, 0, 0)]], earned=[own], rivals=[other])
        assert goal.judge(trace)[0] == wins
    holds, text = goal.judge(Trace(step=1 / 64, poses=[[(0, 0, 0)]], earned=[(9.0, 1.0, 1.0)]))
    assert (holds, text) == (False, "there is no other program")


class CountingClock:
    """A clock for the marker: each look at it takes a second, until the first program has used up its time."""

    def __init__(self) -> None:
        self._now, self._look = 0.0, 1.0

    def monotonic(self) -> float:
        self._now += self._look
        return self._now

    def wall_over(self, limit: float) -> RunOver:
        self._look = 0.0
        return wall_over(limit)

    sleep = staticmethod(running.time.sleep)


def test_a_silent_program_takes_nothing_of_the_time_of_the_other(game: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = CountingClock()
    monkeypatch.setattr(running, "time", clock)
    monkeypatch.setattr(running, "wall_over", clock.wall_over)
    monkeypatch.setattr(running, "LOOK", 0.01)

    def hangs(link: socket.socket) -> None:
        while link.recv(65536):
            pass

    path = game.folder / "fast.py"
    path.write_text(FAST)
    silent, fast = run_together(
        game, game.variants[0], [lambda link: Talker(link, hangs), lambda link: PlainProgram(path, link)], wall=PATIENCE
    )
    assert (silent.ending, fast.ending) == ("wall", "ended")
    assert (silent.passed, fast.passed) == (False, True)


def test_a_lab_in_which_two_programs_cannot_share_the_robots_is_refused(game: Lab) -> None:
    for name, old, new, said in (
        ("world.toml", "[[robot]]\nposition = [0.3, 0.45]\n", "", "1 robot, which two programs cannot share"),
        ("lab.toml", '"opponent.py"', '"nobody.py"', "there is no such file"),
    ):
        text = (game.folder / name).read_text()
        (game.folder / name).write_text(text.replace(old, new))
        with pytest.raises(SimulationError, match=said):
            load_lab(game.folder)
        (game.folder / name).write_text(text)


@isolated
@pytest.mark.long
def test_a_league_is_the_same_on_every_run_whoever_hangs_crashes_or_is_silent(game: Lab, tmp_path: Path) -> None:
    texts = {"fast": FAST, "crashes": CRASHES, "silent": SILENT, "hangs": HANGS}
    submissions = programs(tmp_path / "class", **texts)
    limits = Limits(cpu=1)
    first = play_all(game.folder, pairs(submissions), jobs=1, limits=limits, draws=False)
    assert play_all(game.folder, pairs(submissions), jobs=3, limits=limits, draws=False) == first
    table = standings(first)
    assert [(row.won, row.drawn, row.lost) for row in table] == [(6, 0, 0), *[(0, 0, 6)] * 3]
    told = {row.name: "; ".join(row.remarks) for row in table}
    assert "computed for more than 1 s" in told["hangs.py"]
    assert "it opened no robot" in told["silent.py"]
    assert told["fast.py"] == ""


@isolated
@pytest.mark.long
def test_the_command_ranks_the_programs_of_the_energy_game(tmp_path: Path) -> None:
    shipped = load_lab("energy-game")
    shutil.copytree(shipped.folder, tmp_path / "lab", ignore=shutil.ignore_patterns("teacher"))
    file = tmp_path / "lab" / "lab.toml"
    file.write_text(file.read_text().replace("time = 90", "time = 60"))
    lab = load_lab(tmp_path / "lab")
    texts = {
        "feeds": (shipped.folder / "teacher/solution.py").read_text(),
        "wanders": (shipped.folder / "teacher/mistakes/never_eats.py").read_text(),
        "rests": lab.opponent.read_text() if lab.opponent else "",
        "<b>rash": CRASHES,
    }
    programs(tmp_path / "class", **texts)
    table, page = tmp_path / "t.csv", tmp_path / "t.html"
    words = [sys.executable, "-m", "elib", "lab", "mark", str(tmp_path / "class"), "--lab", str(lab.folder), "--league"]
    done = run([*words, "--csv", str(table), "--html", str(page), "--json"])
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert [row["submission"] for row in rows] == ["feeds.py", "rests.py", "wanders.py", "<b>rash.py"]
    assert all(row["games"] == "6" for row in rows)
    assert sum(int(row["won"]) + int(row["drawn"]) / 2 for row in rows) == 12
    found = json.loads(done.stdout)
    assert [row["points"] for row in found["table"]] == [int(row["points"]) for row in rows]
    assert len(found["games"]) == 12
    text = page.read_text()
    assert text.count("<svg") == 12
    assert "<b>rash" not in text
    assert not re.search(r"(?:src|href)=\"(?!#|data:)", text)


def test_the_page_and_the_table_name_both_programs(game: Lab, tmp_path: Path) -> None:
    submissions = programs(tmp_path / "class", fast=FAST, gone="")
    (tmp_path / "class" / "gone.py").unlink()
    (tmp_path / "class" / "gone.py").symlink_to("fast.py")
    games = league(game, find_submissions(tmp_path / "class"))
    assert len(submissions) == 2
    table = standings(games)
    assert to_rows(table)[1:] == [
        ["fast.py", "2", "2", "0", "0", "6", "", ""],
        ["gone.py", "2", "0", "0", "2", "0", "it is a link, not a file", ""],
    ]
    assert "fast.py against gone.py" in to_html(game, table, games)
    assert json.dumps(to_json(game, table, games))


def test_a_submission_alone_plays_against_the_opponent_of_the_lab(game: Lab, tmp_path: Path) -> None:
    [submission] = programs(tmp_path / "class", fast=FAST)
    found = mark(game.folder, submission, safe=False)
    assert (found.points, found.goals) == (1, {"wins": 1})


@pytest.mark.parametrize(
    ("lab", "said"),
    [
        ("square", "is no game of two programs"),
        pytest.param("energy-game", "needs two submissions or more", marks=pytest.mark.long),
    ],
)
def test_a_league_that_cannot_be_is_refused(tmp_path: Path, lab: str, said: str) -> None:
    programs(tmp_path / "class", fast=FAST)
    words = [sys.executable, "-m", "elib", "lab", "mark", str(tmp_path / "class"), "--lab", lab, "--league", "--unsafe"]
    done = run(words)
    assert done.returncode == 2
    assert said in done.stderr
