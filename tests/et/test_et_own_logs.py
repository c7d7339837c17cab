"""et on the logs that elib writes, and what its guide shows."""

import re
import shlex
from pathlib import Path

import pytest
from et_runs import result

import elib
from elib.records.et.pairing import Pairing
from elib.records.et.rows import Block
from elib.records.log import logged_name

GUIDE = Path(__file__).parents[2] / "docs" / "guides" / "logs.md"
SHOWN = re.findall(r"^\$ et (.*)\n((?:(?!\$ |```).*\n)*)", GUIDE.read_text(encoding="utf-8"), re.MULTILINE)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "run.log"
    with elib.connect("sim://?speed=max&latency=0.01&seed=1", name="Ada L") as robot, robot.log(path):
        for _ in range(20):
            robot.proximity()
            robot.set_speed(0.1, 0.1)
        robot.stop()
    return path


def test_a_log_of_elib_becomes_table_5_1(log: Path) -> None:
    heads, *rows = [line.split() for line in result("Latency", "-s", str(log)).splitlines()]
    found = {row[0]: dict(zip(heads[1:], row[1:], strict=True)) for row in rows}
    assert {logged_name("proximity"), logged_name("set_speed"), logged_name("stop")} <= set(found)
    assert found[logged_name("proximity")]["ok"] == "20"
    assert 20 <= float(found[logged_name("proximity")]["mean_ms"]) < 100


def test_every_row_of_a_log_of_elib_is_understood(log: Path) -> None:
    rows = [line for line in log.read_text().splitlines() if not line.startswith("#")]
    assert result("FromTo", "0", "0", "1e9", "-s", str(log)).splitlines() == rows
    assert len(result("Join", "-s", str(log)).splitlines()) == 1 + len(rows) // 2


HEADER = "# elib log 1, names: python\n"


@pytest.mark.parametrize("lines", [1, 2, 7])
def test_a_call_that_was_killed_gets_no_outcome_of_the_next_run_though_the_clock_goes_on(lines: int) -> None:
    killed = f"{HEADER}100.0 Ada call proximity 0 0\n"
    again = "".join(f"40{n}.{at} Ada {event} proximity 0 0\n" for n in (0, 1) for at, event in ((0, "call"), (5, "ok")))
    log = f"{killed}{HEADER}{again}".splitlines(keepends=True)
    pairing = Pairing()
    blocks = [Block("".join(log[place : place + lines]).encode()) for place in range(0, len(log), lines)]
    found = [(pair.time, pair.latency) for block in blocks for pair in pairing.pairs(block)]
    assert found == [(400, pytest.approx(0.5)), (401, pytest.approx(0.5))]
    assert pairing.notes == ["calls without ok or ko: 1; the log ended, or was begun again, before they did"]


def test_the_guide_shows_commands() -> None:
    assert len(SHOWN) >= 5


@pytest.mark.parametrize(("command", "output"), SHOWN, ids=[command for command, _ in SHOWN])
def test_the_guide_shows_what_et_prints(
    command: str, output: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text = GUIDE.read_text(encoding="utf-8")
    shown = re.search(r"^```text\n(# elib log .*?)^```", text, re.MULTILINE | re.DOTALL)
    assert shown
    Path("run.log").write_text(shown[1])
    printed = ""
    for part in command.split(" | "):
        printed = result(*shlex.split(part.removeprefix("et ")), log=printed)
    assert [line.rstrip() for line in printed.splitlines()] == output.rstrip().splitlines()
