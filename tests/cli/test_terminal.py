"""Text for a terminal, and for a stream that is not one."""

from __future__ import annotations

import io
import json
import math
import os
import pty
import subprocess
from pathlib import Path

import pytest
from elib_process import COMMAND, PATIENCE, Told, elib, environment

from elib.base.plaintext import plain
from elib.cli import find, send
from elib.cli.live import bars
from elib.cli.terminal import BLOCKS, GREEN, LiveLine, paint, print_json, say, table
from elib.tools.discovery import Found, Survey
from shared import Terminal


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.delenv("NO_COLOR", raising=False)
    return Terminal()


def test_a_table_is_aligned_and_wraps_its_second_column() -> None:
    shown = table([("a", "one two three"), ("long", "four")], width=16)
    assert shown == "  a     one two\n        three\n  long  four"


def test_a_label_longer_than_half_the_width_gets_a_line_of_its_own() -> None:
    assert table([("a", "x"), ("much-too-long", "y")], width=20) == "  a  x\n  much-too-long\n     y"


def test_a_terminal_of_one_column_is_written_to_as_one_of_twenty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "1")
    assert table([("much-too-long", "one two three four")]) == "  much-too-long\n    one two three\n    four"


def test_a_path_that_is_longer_than_a_line_stays_whole_to_be_copied() -> None:
    assert table([("plot", "in /tmp/a-long-folder/a.png")], width=16) == "  plot  in\n        /tmp/a-long-folder/a.png"


def test_json_is_one_line_of_records_and_numbers_that_json_has(capsys: pytest.CaptureFixture[str]) -> None:
    found = Found("sim://", "simulation", "caf\u00e9")
    print_json({"found": (found,), "rate": math.nan, "path": Path("a")})
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    assert "caf\u00e9" in out
    shown = json.loads(out)
    assert (shown["rate"], shown["path"]) == (None, "a")
    assert shown["found"][0]["url"] == "sim://"


def test_bars_rise_with_the_value_and_stay_within_the_blocks() -> None:
    shown = bars([-5, 0, 60, 500, 4000, 9999])
    assert list(shown) == sorted(shown)
    assert shown[0] == shown[1] == BLOCKS[0]
    assert shown[-2:] == BLOCKS[-1] * 2


def test_colours_are_for_terminals_whose_user_wants_them(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    assert paint("x", GREEN, terminal) == "\x1b[32mx\x1b[0m"
    assert paint("x", GREEN, io.StringIO()) == "x"
    monkeypatch.setenv("NO_COLOR", "1")
    assert paint("x", GREEN, terminal) == "x"


def test_a_live_line_is_written_over_cut_to_the_width_and_taken_away(terminal: Terminal) -> None:
    line = LiveLine(terminal)
    line.show([("a" * 30, ""), ("b" * 30, "")])
    assert terminal.getvalue() == "\r" + "a" * 30 + "b" * 9 + "\x1b[K"
    line.clear()
    line.clear()
    assert terminal.getvalue().endswith("\x1b[K\r\x1b[K")
    assert terminal.getvalue().count("\r") == 2


@pytest.mark.parametrize("kind", ["file", "dumb"])
def test_without_a_terminal_there_is_no_live_line(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "dumb" if kind == "dumb" else "xterm")
    stream = Terminal() if kind == "dumb" else io.StringIO()
    line = LiveLine(stream)
    line.show([("text", GREEN)])
    line.clear()
    assert stream.getvalue() == ""


# -- text from outside -----------------------------------------------------------------------------------------------

HOSTILE = "a\x1b]0;title\x07\x1b[2Jb\x9b31m\u202ec\td"
SHOWN = "a\\x1b]0;title\\x07\\x1b[2Jb\\x9b31m\\u202ec\td"


def test_text_from_outside_cannot_control_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    assert plain(HOSTILE) == SHOWN
    assert plain("Ünïcode, 日本\n\tand two lines") == "Ünïcode, 日本\n\tand two lines"
    say(HOSTILE)
    assert capsys.readouterr().err == f"{SHOWN}\n"
    assert "\x1b" not in table([(HOSTILE, HOSTILE)])


def test_text_from_a_robot_cannot_control_the_terminal(printed: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(send, "run_on", lambda *arguments, **options: f"Version 1.1.3 {HOSTILE}")
    assert printed("send", "help_text") == f"Version 1.1.3 {SHOWN}\n"


def test_a_bluetooth_name_cannot_control_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    find.show(Survey((Found("rfcomm://10:00:E8:AD:78:5B", "bluetooth", HOSTILE, answer=HOSTILE, reason=HOSTILE),)))
    out, err = capsys.readouterr()
    assert "\x1b" not in out + err
    assert "title" in out


def test_a_log_shown_on_a_terminal_cannot_control_it_and_a_pipe_gets_every_byte(tmp_path: Path) -> None:
    log = tmp_path / "run.log"
    row = "1.0 Ada\x1b[2J call Stop() 0 0\n"
    log.write_text(row)
    ours, theirs = pty.openpty()
    words = ["et", "Count", "1", "-s", str(log)]
    assert subprocess.Popen([*COMMAND, *words], stdout=theirs, env=environment()).wait(PATIENCE) == 0
    os.close(theirs)
    assert b"Ada\\x1b[2J" in os.read(ours, 4096)
    os.close(ours)
    piped = elib(*words)
    assert piped.returncode == 0
    assert "Ada\x1b[2J" in piped.stdout
