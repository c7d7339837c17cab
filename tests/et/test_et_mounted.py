"""``elib et`` is ``et``: every word is handed on as it is."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from et_runs import SAMPLE, Run, result, run

from elib import __version__
from elib.cli import main
from elib.cli.program import build, parse
from shared import PATIENCE


def mounted(*words: str) -> Run:
    return run("et", *words, program=main)


@pytest.mark.parametrize(
    "words",
    [
        ("Avg", "5"),
        ("Join",),
        ("Join", "--format", "json"),
        ("Latency", "--by=robot"),
        ("FromCollection", "3", "--", "--json", "Stop(..)", "--"),
        ("FromTo", "0", "-5", "812.2"),
        ("FromCollection", "2", "send", "run", "ko"),
    ],
)
def test_results_are_those_of_et(words: tuple[str, ...]) -> None:
    assert mounted(*words) == Run(0, result(*words), "")


@pytest.mark.parametrize("words", [(), ("--help",), ("Rate", "-h"), ("-s", "no.log", "--help")])
def test_the_help_names_the_program_that_was_called(words: tuple[str, ...]) -> None:
    found = mounted(*words)
    assert found.out.startswith("Usage: elib et ")
    assert found.out == result(*words).replace("Usage: et ", "Usage: elib et ", 1)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("Avg",), "Avg needs COLUMN"),
        (("Avg", "5", "--json"), "--json needs a value"),
        (("Avg", "5", "--robot", "sim://"), "Avg has no option '--robot'"),
        (("-s",), "-s needs a value"),
        (("send", "stop"), "et has no action 'send'"),
    ],
)
def test_errors_are_those_of_et(words: tuple[str, ...], said: str) -> None:
    found = mounted(*words)
    assert found == run(*words)
    assert found.code == 2
    assert said in found.err


def test_the_version_is_told() -> None:
    assert mounted("--version").out == f"elib et {__version__}\n"


def test_no_word_is_moved() -> None:
    words = ["et", "--robot", "U", "Avg", "--json", "5", "--pty", "run"]
    _, bound = parse(build(words), words)
    assert list(bound.args) == words[1:]


def test_a_reader_that_closes_the_pipe_early_ends_elib_et_quietly(tmp_path: Path) -> None:
    (tmp_path / "run.log").write_text(SAMPLE * 1000)
    command = [sys.executable, "-m", "elib", "et", "FromTo", "0", "0", "999", "-s", str(tmp_path / "run.log")]
    reader, writer = os.pipe()
    os.close(reader)
    found = subprocess.run(command, stdout=writer, stderr=-1, timeout=PATIENCE)
    os.close(writer)
    assert (found.returncode, found.stderr) == (1, b"")
