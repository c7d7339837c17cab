"""Files that elib 0.1.0 wrote still open: a log, a recording, a world, a fault script, a robot profile."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import elib
from elib.cli import main
from elib.records.et import main as et
from elib.records.mcapreader import Health
from elib.records.reader import read_recording
from elib.records.state import state_at
from elib.records.timeline import timeline
from elib.studies.comparison import compare, run_of

FILES = Path(__file__).parents[1] / "golden" / "files"


def test_a_log_with_the_names_of_2011(capsys: pytest.CaptureFixture[str]) -> None:
    assert et(["Latency", "-s", str(FILES / "calls-2011.log"), "--format", "json"]) == 0
    found = {row["command"]: row for row in json.loads(capsys.readouterr().out)}
    assert found["GetIR(..)"]["ok"] == 4
    assert found["Reset()"]["ok"] == 1
    assert sum(row["ok"] for row in found.values()) == 17


def test_a_recording_is_read_in_every_way() -> None:
    recording, health = read_recording(FILES / "drive.mcap"), Health()
    entries = list(recording.entries(health=health))
    assert (health.is_complete, health.damaged, len(entries)) == (True, 0, health.messages)
    assert recording.about["robot"] == "Ada Lovelace"
    assert [pose.time for pose in recording.path(measured=True)]
    assert any(moment.text.startswith("set_speed(") for moment in timeline(recording))
    assert state_at(recording, 0.3).speed == (300, 200)
    run = run_of(recording)
    assert run.readings["accelerometer"].fields == ("x", "y", "z")
    assert compare(run, run).path is not None


def test_a_recording_is_replayed() -> None:
    with elib.connect(f"replay://{FILES / 'drive.mcap'}?speed=max") as robot:
        robot.set_speed(0.3, 0.2)
        near = robot.proximity()
    (first, *_) = read_recording(FILES / "drive.mcap").entries("/readings/proximity")
    assert near == tuple(first.data.values())[1:-1]


def test_a_recording_is_shown_by_the_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["record", "info", str(FILES / "drive.mcap"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["complete"] is True
    assert main(["replay", str(FILES / "drive.mcap"), "--only", "state"]) == 0
    assert capsys.readouterr().out.endswith("state: turning\n")


def test_a_world_file() -> None:
    world = elib.World.load(FILES / "room.toml")
    assert len(world.poses) == 2
    world.run(10)


def test_a_fault_script_cuts_the_link_when_it_says() -> None:
    with elib.connect(f"sim://?speed=max&fault={FILES / 'faults.toml'}") as robot, pytest.raises(elib.LinkLost):
        robot.sleep(51)
        robot.selector()


def test_a_robot_profile_sets_the_latency_that_it_says() -> None:
    with elib.connect(f"sim://?speed=max&baud=0&profile={FILES / 'robot.toml'}") as robot:
        for _ in range(50):
            robot.selector()
        assert robot.statistics.median == pytest.approx(2 * 0.0214, abs=0.004)
