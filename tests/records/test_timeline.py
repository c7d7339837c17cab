"""A recording as lines: calls with what they brought, and what happened besides."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

import elib
from elib.records.encoding import numbers_in
from elib.records.reader import Recording
from elib.records.timeline import Moment, timeline
from elib.robot.aio import Epuck
from elib.robot.runner import run_on


@pytest.fixture(name="recording", scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    path = tmp_path_factory.mktemp("runs") / "run.mcap"

    async def program(robot: Epuck) -> None:
        with robot.record(path) as recorder:
            recorder.note("searching", kind="state")
            await robot.set_speed(0.25, -0.5)
            await robot.proximity()
            await robot.set_camera(20, 20, 8, elib.CameraMode.GREY)
            await robot.image()
            recorder.note("here")
            await robot.sensors()
            with pytest.raises(elib.ReplyTimeout):
                await robot.within(0.0).encoders()
            await asyncio.sleep(1)  # clock: simulated
            await robot.stop()

    run_on("sim://?speed=max", program)
    return Recording(path)


def of(recording: Recording, start: str) -> Moment:
    """Return the one moment whose text begins so."""
    (found,) = (moment for moment in timeline(recording) if moment.text.startswith(start))
    return found


def test_a_call_is_a_line_with_its_outcome_and_what_it_brought(recording: Recording) -> None:
    near = of(recording, "proximity()")
    assert near.kind == "call"
    assert near.text.startswith("proximity()  ok, ")
    numbers = near.text.partition(": ")[2].split()
    assert tuple(map(float, numbers)) == near.readings["proximity"]
    assert len(numbers) == 8


def test_a_call_that_sets_the_speed_tells_it(recording: Recording) -> None:
    assert of(recording, "set_speed").speed == (0.25, -0.5)
    assert of(recording, "stop()  ok").speed == (0.0, 0.0)


def test_a_picture_is_described_by_its_size(recording: Recording) -> None:
    assert of(recording, "image()").text.endswith(": 20x20 mono8")


def test_of_all_sensors_each_reading_is_named(recording: Recording) -> None:
    moment = of(recording, "sensors()")
    assert {"proximity", "encoders", "accelerometer"} <= set(moment.readings)
    assert "encoders " in moment.text


def test_a_failure_is_marked_with_its_reason(recording: Recording) -> None:
    moment = of(recording, "encoders()")
    assert moment.is_bad
    assert "ReplyTimeout" in moment.text


def test_notes_and_states_are_lines_too_and_can_be_chosen(recording: Recording) -> None:
    assert [moment.text for moment in timeline(recording, ["state"])] == ["searching"]
    assert [moment.text for moment in timeline(recording, ["note"])] == ["here"]
    assert {moment.kind for moment in timeline(recording)} >= {"call", "note", "state"}


def test_times_count_from_the_beginning_of_the_recording(recording: Recording) -> None:
    times = [moment.time for moment in timeline(recording)]
    assert times[0] == 0.0
    assert times == sorted(times)
    assert 1.0 < times[-1] < 3.0


def test_where_the_robot_is_goes_with_each_moment(recording: Recording) -> None:
    pose = of(recording, "stop()  ok").pose
    assert pose is not None
    assert 0 < pose.x < 1


def test_a_call_whose_outcome_is_missing_is_said_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"

    async def program(robot: Epuck) -> None:
        recorder = robot.record(path)
        waiting = asyncio.create_task(robot.proximity())
        await asyncio.sleep(0)
        recorder.close()
        await waiting

    run_on("sim://?speed=max", program)
    (moment,) = timeline(Recording(path), ["call"])
    assert moment.is_bad
    assert moment.text == "proximity()  no outcome was recorded"


def test_the_numbers_of_a_reading_leave_out_scales_and_time() -> None:
    data = {"time": 1.0, "x": 1, "y": 2, "z": 3, "zero": 2048, "counts_per_g": 768, "g": [0, 0, 1], "origin": "robot"}
    assert tuple(numbers_in(data).values()) == (1.0, 2.0, 3.0)
    assert tuple(numbers_in({"counts": [4, 5], "time": 0.0}).values()) == (4.0, 5.0)
