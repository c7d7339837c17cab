"""A full disk: the program goes on driving, and ends with an error that names the file and exit code 1.

The limit is the system's own on the size of a file: real writes fail, in the middle, as on a full disk.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from elib_process import COMMAND, environment

from elib.cli import main
from shared import run

resource = pytest.importorskip("resource")

ROOM = 4096
"""Bytes that a file may have."""
RUN = ["run", "avoid", "--robot", "sim://square?speed=max", "--for", "30"]


def cramped(here: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run ``elib`` where no file can grow beyond :data:`ROOM` bytes."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM, ROOM))

    return run([*COMMAND, *words], cwd=here, env=environment(PYTHONDONTWRITEBYTECODE="1"), preexec_fn=limit)


def long(*values: object) -> object:
    """Return a case of the long lane: another command, on the way that another case goes too."""
    return pytest.param(*values, marks=pytest.mark.long)


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (RUN, "--record"),
        long(RUN, "--log"),
        long(["demo", "--for", "30"], "--record"),
        long(["demo", "--for", "30"], "--log"),
        (["send", "help_text", "--robot", "sim://square?speed=max"], "--log"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else value,
)
def test_what_could_not_be_kept_is_an_error_at_the_end(words: list[str], option: str, tmp_path: Path) -> None:
    file = "kept.mcap"
    if option == "--log":
        file = "kept.log"
        (tmp_path / file).write_bytes(b"#" * (ROOM - 10) + b"\n")
    done = cramped(tmp_path, *words, option, file)
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert f"{file} could not be written: " in done.stderr.rpartition("error: ")[2]
    if words[0] == "run":
        assert "robot time  30.0 s" in done.stderr, "it drove to its end"


@pytest.mark.parametrize(
    ("words", "file"),
    [
        long([*RUN, "--plot", "out.png"], "out.png"),
        long(["demo", "--for", "3"], "elib-demo.png"),
        (["record", "repair", "run.mcap", "-o", "out.mcap"], "out.mcap"),
        long(["replay", "run.mcap", "--plot", "out.svg"], "out.svg"),
        long(["compare", "run.mcap", "run.mcap", "--plot", "out.pdf"], "out.pdf"),
        (["world", "show", "crowd", "--png", "out.png"], "out.png"),
        (["record", "out.mcap", "--robot", "sim://square?speed=max", "--for", "20"], "out.mcap"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_a_file_that_cannot_be_written_whole_is_an_error_without_a_traceback(
    words: list[str], file: str, tmp_path: Path
) -> None:
    if "run.mcap" in words:
        assert main([*RUN, "--record", str(tmp_path / "run.mcap")]) == 0
    is_kept = words[0] == "record" and words[1] != "repair"  # what a recording has is kept
    if not is_kept and words[1] != "repair":
        (tmp_path / file).write_text("what was there")
    done = cramped(tmp_path, *words)
    assert "Traceback" not in done.stderr
    assert done.returncode == 1, done.stderr
    assert file in done.stderr[done.stderr.index("error: ") :]
    if words[1] == "repair":
        assert not (tmp_path / file).exists()
    elif not is_kept:
        assert (tmp_path / file).read_text() == "what was there"
    assert not [each.name for each in tmp_path.iterdir() if each.name.startswith(".")], "nothing is left beside it"
