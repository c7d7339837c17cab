"""``elib find``: what it prints, and when it fails."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from elib_process import Told, elib, started

from elib.cli import find as command
from elib.cli import main
from elib.tools.discovery import Found, Survey

ROBOT = Found("serial:///dev/rfcomm0", "bluetooth", "e-puck_3021", "btcom-2.0", "Version 2.0.0 January 2008")
BUSY = Found(
    "serial:///dev/ttyACM0", "serial", "USB", reason="ModemManager (process 812) holds it, so it was left alone"
)


@pytest.fixture
def finds(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, object]]:
    """Let the search find what ``finds.append({"answer": ...})`` says; its arguments are kept there too."""
    asked: list[dict[str, object]] = []

    async def survey(**arguments: object) -> Survey:
        asked.append(arguments)
        found = asked[0].get("answer", Survey(()))
        assert isinstance(found, Survey)
        return found

    monkeypatch.setattr(command, "survey", survey)
    return asked


def test_robots_go_to_stdout_and_remarks_to_stderr(
    finds: list[dict[str, object]], capsys: pytest.CaptureFixture[str]
) -> None:
    finds.append({"answer": Survey((ROBOT, BUSY), ("/dev/ttyS0",), ("there is no bluetoothctl here",))})
    assert main(["find"]) == 0
    out, err = capsys.readouterr()
    assert out.split("\n\n") == [
        "serial:///dev/rfcomm0\n    e-puck_3021\n    btcom-2.0: Version 2.0.0 January 2008",
        "serial:///dev/ttyACM0\n    USB\n    no answer: ModemManager (process 812) holds it, so it was left alone\n",
    ]
    assert "Not tried: /dev/ttyS0." in err
    assert "There is no bluetoothctl here." in err
    assert "`elib doctor URL`" in err


def test_json_is_one_line_with_everything(finds: list[dict[str, object]], capsys: pytest.CaptureFixture[str]) -> None:
    finds.append({"answer": Survey((ROBOT,), ("/dev/ttyS0",), ("a note",))})
    assert main(["find", "--json"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert out.count("\n") == 1
    assert json.loads(out) == {
        "found": [
            {
                "url": "serial:///dev/rfcomm0",
                "kind": "bluetooth",
                "description": "e-puck_3021",
                "firmware": "btcom-2.0",
                "answer": "Version 2.0.0 January 2008",
                "reason": "",
            }
        ],
        "not_tried": ["/dev/ttyS0"],
        "notes": ["a note"],
    }


@pytest.mark.parametrize("found", [Survey(()), Survey((BUSY,))])
def test_without_a_robot_that_answers_it_fails_and_offers_a_virtual_one(
    found: Survey, finds: list[dict[str, object]], capsys: pytest.CaptureFixture[str]
) -> None:
    finds.append({"answer": found})
    with pytest.raises(SystemExit) as end:
        main(["find"])
    assert end.value.code == 1
    assert "`elib demo` needs no robot" in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="needs ptys and POSIX signals")
def test_a_simulation_of_another_program_is_found_while_it_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with started("simulate", "square", "--pty", str(tmp_path / "robot")) as server:
        _, url = server.out.line().split()
        found = json.loads(elib("find", "--json", "--within", "60").stdout)["found"]
        assert server.end() == 0
    assert found == [
        {
            "url": url,
            "kind": "simulation",
            "description": f"epuck-1 of elib simulate square (process {server.process.pid})",
            "firmware": "asercom-1.2.2",
            "answer": "Version 1.2.2 August 2008 GCtronic",
            "reason": "",
        }
    ]
    assert list(tmp_path.glob("*/*")) == []


def test_options_reach_the_search(finds: list[dict[str, object]]) -> None:
    finds.append({"answer": Survey((ROBOT,))})
    assert main(["find", "--all", "--within", "2"]) == 0
    assert finds[1] == {"timeout": 2.0, "all_ports": True, "network": None}


def test_an_impossible_time_is_wrong_usage(refused: Told) -> None:
    assert "--within is -1.0 s; it must be a number from 0 to 3600 s" in refused("find", "--within", "-1")


def test_the_network_is_asked_only_if_the_caller_says_so(finds: list[dict[str, object]]) -> None:
    finds.append({"answer": Survey((ROBOT,))})
    for words in ([], ["--wifi"], ["--network", "192.168.1.0/24"]):
        assert main(["find", *words]) == 0
    assert [each["network"] for each in finds[1:]] == [None, "local", "192.168.1.0/24"]
