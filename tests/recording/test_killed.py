"""A recording outlives its program: what is older than a second is in the file, however the program ended."""

from __future__ import annotations

import random
import sys
import threading
from pathlib import Path

import pytest
from killing import record_and_kill
from recordings import read

from elib.recording import read_recording, summary_of
from elib.recording.repair import repair

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")

MOMENTS = [random.Random(seed).uniform(0.1, 2.5) for seed in range(4)]


@pytest.mark.long
@pytest.mark.parametrize("seconds", MOMENTS)
def test_what_is_older_than_a_second_outlives_a_killed_program(seconds: float, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    found = record_and_kill(path, lambda: threading.Event().wait(seconds))
    assert found.marks > 3
    assert found.worst < 1.0
    assert found.health.damaged == 0
    assert not found.health.is_complete
    # The file as it was left is a recording like any other, and can be made a whole one.
    summary = summary_of(read_recording(path))
    assert summary.messages["/calls"] == found.calls >= 15 * found.kept
    done = repair(path)
    assert summary_of(read_recording(done.path)).is_complete
    assert sum(each.topic == "/calls" for each in read(done.path)) == found.calls
