"""``elib run``: behaviours from the command line."""

from __future__ import annotations

import asyncio
import re
import signal
from collections.abc import Sequence
from pathlib import Path

import pytest
from elib_process import Told, started

from elib.base.errors import ArgumentError, LinkLost
from elib.behaviours import RunContext, behaviours
from elib.cli import main
from elib.cli.live import RunDisplay, beside, period_of
from elib.cli.run import SAMPLES
from elib.studies.drive import RobotReport
from elib.testing import link_of
from lanes import short

FAST = "sim://?speed=max"


def test_the_list_has_every_behaviour_with_what_it_does(printed: Told) -> None:
    out = printed("run", "--list")
    names = [line.split()[0] for line in out.splitlines() if not line.startswith(" ")]
    assert names == list(behaviours())
    assert "Wander without hitting anything." in out


def test_a_page_shows_the_options_of_a_behaviour_with_their_rules(printed: Told) -> None:
    out = printed("run", "avoid", "--help")
    assert "--cruise C" in out
    assert "Speed on free ground: rev/s, a number from 0.05 to 1 (default: 0.6)." in " ".join(out.split())
    assert "--for S" in out


def test_a_run_ends_by_the_robots_time_and_is_summed_up_on_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "avoid", "--for", "10", "--robot", FAST]) == 0
    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines()[0] == "robot time  10.0 s, its time was over"
    assert err.splitlines()[1].startswith("distance    ")
    assert "m, by the simulated world" in err
    assert "answered, 0 answers lost" in err
    assert "median" in err
    assert "\r" not in err
    assert "\x1b" not in err


def test_a_simulation_without_a_world_has_what_the_behaviour_needs(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "go-to-light", "--for", "60", "--robot", FAST]) == 0
    assert "arrived" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("tokens", "message"),
    [
        (["avid"], "there is no behaviour 'avid'\nhint: did you mean avoid?"),
        (["avoid", "--for", "0"], "--for is 0.0 s; it must be a number above 0 s"),
        (["avoid", "--cruise", "7"], "cruise is 7 rev/s; it must be a number from 0.05 to 1 rev/s"),
        (["avoid", "--cruise", "fast"], "cruise is 'fast'"),
        (["avoid", "--speed", "1"], "--speed"),
        (["--list", "--bogus"], "--bogus"),
        (["avoid", "--plot", "run.gif"], "its name must end in .png, .svg, .pdf"),
        (["avoid", "--plot", "nowhere/run.png"], "there is no folder"),
    ],
)
def test_a_wrong_call_is_told_so_before_anything_runs(refused: Told, tokens: list[str], message: str) -> None:
    assert message in refused("run", *tokens, *(["--robot", "tcp://127.0.0.1:9"] if tokens[0] == "avoid" else []))


def test_a_lost_robot_is_a_failure_that_is_summed_up_too(refused: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    begin = RunDisplay.begin

    def begin_and_cut(self: RunDisplay, context: RunContext, robots: Sequence[RobotReport]) -> None:
        begin(self, context, robots)
        link_of(robots[0].robot).cut_after(to_robot=200)

    monkeypatch.setattr(RunDisplay, "begin", begin_and_cut)
    err = refused("run", "avoid", "--for", "60", "--robot", FAST, code=1)
    assert "answered" in err
    assert err.splitlines()[-1].startswith(("error: ", "hint: "))
    assert "Traceback" not in err


@pytest.mark.parametrize("words", [["go-x-cm"], ["my_drive.py"]])
def test_a_link_that_is_lost_tells_a_person_what_to_do_also_without_a_terminal(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cut.toml").write_text('description = "a cut"\n[[fault]]\nkind = "cut"\nat = 2.5\nfor = 3\n')
    (tmp_path / "my_drive.py").write_text(
        "import elib\nwith elib.reconnecting('sim://') as robot:\n    robot.sleep(9)\n    robot.selector()\n"
    )
    assert main(["run", *words, "--robot", f"{FAST}&fault={tmp_path}/cut.toml"]) == 0
    told = capsys.readouterr().err
    assert told.count("the link is lost, and opened again as soon as the robot answers: ") == 1
    assert "hint: switch the robot on" in told
    assert re.search(r"the link of sim://.* is back after [2-4]\.\d s", told)


def test_frames_of_the_live_line_follow_a_persons_time() -> None:
    assert period_of("real") == pytest.approx(0.1)
    assert period_of(10.0) == pytest.approx(1.0)


def test_the_live_line_of_one_robot_shows_what_it_senses_and_how_its_wheels_turn(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shown: list[object] = []
    lines: list[str] = []
    monkeypatch.setattr(RunDisplay, "begin", lambda self, *run: shown.extend(run))
    monkeypatch.setattr(RunDisplay, "end", lambda self: lines.append("".join(text for text, _ in self._parts(*shown))))
    assert main(["run", "avoid", "--for", "2", "--robot", FAST]) == 0
    assert re.fullmatch(r" +2\.\d s  .* m   left \S+ right   wheels [+-]\d\.\d\d [+-]\d\.\d\d rev/s", "".join(lines)), (
        lines
    )


async def test_a_task_beside_a_run_ends_with_the_block_and_its_errors_are_raised() -> None:
    async def broken(error: Exception) -> None:
        raise error

    async def wait() -> None:
        await asyncio.Event().wait()

    async with beside(wait()):
        pass
    with pytest.raises(ZeroDivisionError):
        async with beside(broken(ZeroDivisionError())):
            await asyncio.sleep(0)
    async with beside(broken(LinkLost("the robot is gone"))):
        await asyncio.sleep(0)
    with pytest.raises(ArgumentError):
        async with beside(wait()):
            raise ArgumentError("of the block")


@pytest.mark.long
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_stops_the_robot_and_ends_quietly(number: signal.Signals, code: int) -> None:
    with (
        started("simulate", "square", "--tcp", "0", "-v") as server,
        started("run", "avoid", "--robot", server.out.line().split()[1]) as client,
    ):
        server.err.until("set_speed")
        assert client.end(number) == code
        said = client.err.rest()
        assert "Traceback" not in said
        assert "robot time" in said
        server.err.until("stop")
        assert server.end() == 0


@pytest.mark.parametrize("suffix", short([".svg", ".png", ".pdf"], ".svg"))
def test_a_plot_shows_path_speeds_readings_and_states(
    suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / f"run{suffix}"
    assert main(["run", "go-and-turn", "--side", "0.05", "--robot", FAST, "--plot", str(file)]) == 0
    assert f"plot        {file}" in capsys.readouterr().err
    content = file.read_bytes()
    assert content.startswith({".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}[suffix])
    if suffix == ".svg":
        assert b"wheels, rev/s" in content or len(content) > 20_000  # text may be drawn as curves


def test_the_summary_says_how_long_each_state_lasted(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "go-x-cm", "--cm", "3", "--robot", FAST]) == 0
    err = capsys.readouterr().err
    assert "3.00 cm driven" in err
    assert "by itself" in err
    assert re.search(r"states +driving \d\.\d s", err)
    assert "distance    0.03 m, by the simulated world" in err


@pytest.mark.long
def test_enter_ends_a_behaviour_and_the_robot_stands() -> None:
    with (
        started("simulate", "square", "--tcp", "0", "-v") as server,
        started("run", "avoid", "--robot", server.out.line().split()[1]) as client,
    ):
        server.err.until("set_speed")
        client.press_enter()
        assert client.err.until("robot time").endswith("by Enter")
        server.err.until("stop")
        assert server.end() == 0


def test_run_all_takes_the_samples_of_2011_in_their_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", "all", "--robot", "sim://light?speed=max", "--for", "1"]) == 0
    err = capsys.readouterr().err
    headings = [line.split()[1].rstrip(":") for line in err.splitlines() if line.startswith("== ")]
    assert headings == list(SAMPLES)
    assert len(SAMPLES) == 13


def test_every_kind_of_reading_has_its_chart(tmp_path: Path) -> None:
    file = tmp_path / "line.png"
    assert main(["run", "line-following", "--for", "3", "--robot", "sim://line?speed=max", "--plot", str(file)]) == 0
    assert file.stat().st_size > 20_000
