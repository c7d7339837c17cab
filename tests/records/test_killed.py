"""A recording outlives its program: the file of one that was killed has no gap, and can be made whole."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from killing import record_and_kill
from recordings import read

from elib.base.errors import ArgumentError
from elib.records.reader import read_recording, summary_of
from elib.records.repair import repair
from lanes import short
from shared import wait_until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")


def marks_in(path: Path) -> int:
    """Return how many marks can be read in a recording that is still written."""
    try:
        return sum(each.data["name"] == "mark" for each in read_recording(path).entries("/notes"))
    except ArgumentError:  # it is only just there
        return 0


@pytest.mark.parametrize("marks", short([1, 100], 1))
def test_what_was_recorded_is_in_the_file_soon_and_outlives_a_killed_program(marks: int, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    found = record_and_kill(path, lambda: wait_until(lambda: marks_in(path) >= marks))  # how soon is a benchmark
    assert found.kept >= marks
    assert found.health.damaged == 0
    assert not found.health.is_complete
    # The file as it was left is a recording like any other, and can be made a whole one.
    summary = summary_of(read_recording(path))
    assert summary.messages["/calls"] == found.calls >= 15 * found.kept
    done = repair(path)
    assert summary_of(read_recording(done.path)).is_complete
    assert sum(each.topic == "/calls" for each in read(done.path)) == found.calls
