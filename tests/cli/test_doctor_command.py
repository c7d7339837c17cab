"""``elib doctor``: the page, its JSON, its exit codes."""

from __future__ import annotations

import json
import sys

import pytest
from elib_process import Told, elib, started

from elib.cli import main
from elib.cli.doctor import lines
from elib.tools.diagnosis import CHECKS, DiagnosisStep, doctor

DEAD = "/dev/ttyUSB77"


def fails(*tokens: str) -> None:
    with pytest.raises(SystemExit) as end:
        main(["doctor", *tokens])
    assert end.value.code == 1


def test_the_page_of_a_healthy_robot_fits_a_screen(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "sim://?speed=max&firmware=epuck2"]) == 0
    out, err = capsys.readouterr()
    page = out.splitlines()
    assert err == ""
    assert len(page) < 60
    assert all(len(line) <= 80 for line in page)
    assert page[0].startswith("elib ")
    assert "link: sim://?speed=max&firmware=epuck2" in page
    assert [line.split()[1] for line in page if line.startswith("  ok    ")] == [
        check.name.split()[0] for check in CHECKS
    ]
    assert page[-1] == "The robot answers, and everything is as it should be."
    assert "elib demo" not in out


def test_the_page_of_a_dead_link_says_what_to_do_and_offers_a_virtual_robot(
    capsys: pytest.CaptureFixture[str],
) -> None:
    fails(DEAD)
    page = capsys.readouterr().out
    assert "  FAIL  link            there is no port /dev/ttyUSB77" in page
    assert "                        > is the cable plugged in" in page
    assert "  -     picture         needs answer" in page
    assert "It does not connect: the step 'link' failed." in page
    assert "`elib demo`" in page
    assert "sim://" in page
    assert len(page.splitlines()) < 60
    assert all(len(line) <= 80 for line in page.splitlines())


@pytest.mark.parametrize("tokens", [[DEAD, "--json"], ["--json", "--robot", DEAD], [f"--robot={DEAD}", "--json"]])
def test_the_report_has_every_step_with_its_fix(tokens: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    fails(*tokens)
    report = json.loads(capsys.readouterr().out)
    assert report["ok"] is False
    assert report["url"] == f"serial://{DEAD}"
    assert [step["name"] for step in report["steps"]] == [check.name for check in CHECKS]
    assert all(step.keys() == {"name", "ok", "detail", "fix"} for step in report["steps"])
    assert [step["ok"] for step in report["steps"]] == [False] + [None] * (len(CHECKS) - 1)
    assert report["steps"][0]["fix"]


def test_the_report_of_a_healthy_robot_is_ok(printed: Told) -> None:
    report = json.loads(printed("doctor", "sim://?speed=max", "--json"))
    assert report["ok"] is True
    assert {step["ok"] for step in report["steps"]} == {True}


@pytest.mark.parametrize(
    ("tokens", "message"),
    [
        (["serail:///dev/rfcomm0"], "did you mean serial://?"),
        (["a", "b"], "elib doctor"),
        ([DEAD, "--robot", "sim://"], "two robots were named"),
    ],
)
def test_text_that_is_not_a_url_is_wrong_usage(refused: Told, tokens: list[str], message: str) -> None:
    assert message in refused("doctor", *tokens)


def test_without_a_url_and_without_a_link_the_search_itself_is_the_page(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from elib.tools.discovery import Survey

    async def nothing(**_: object) -> Survey:
        return Survey(())

    monkeypatch.setattr(doctor, "candidates", nothing)
    fails()
    page = capsys.readouterr().out
    assert "link: none was named, so it is looked for" in page
    assert "there is no port, paired robot or running simulation" in " ".join(page.split())


def test_advice_stands_below_what_was_found() -> None:
    assert lines(DiagnosisStep("round trip", True, "median 212 ms", "come nearer")) == [
        "  warn  round trip      median 212 ms",
        "                        > come nearer",
    ]


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="needs ptys and POSIX signals")
def test_another_program_finds_and_examines_a_simulated_robot() -> None:
    with started("simulate", "square") as server:
        _, url = server.out.line().split()
        done = elib("doctor", url)
        assert server.end() == 0
    assert done.returncode == 0, done.stdout
    assert "\x1b" not in done.stdout
    assert done.stderr == ""


def test_a_process_ends_with_one_and_no_traceback() -> None:
    done = elib("doctor", DEAD)
    assert (done.returncode, done.stderr) == (1, "")
