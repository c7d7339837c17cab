"""A recorded drive beside the simulator: what is played, and how alike is scored."""

import math
import random
from pathlib import Path

import numpy as np
import pytest
from parity_drives import drive

from elib.base.errors import ArgumentError, LinkNotFound
from elib.base.pose import Pose
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context
from elib.link.protocol.profiles import PROFILES, profile_named
from elib.records.reader import Recording
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.simulator.emulator.robotprofile import LinkDelay, RobotProfile
from elib.studies.comparison import Run, compare, run_of
from elib.studies.rerun import RecordedCall, request_of, rerun
from elib.studies.scores import field_parts, latency_score, parity, path_score
from elib.studies.series import Series
from elib.testing import world_of
from lanes import short


def test_a_nominal_drive_scores_near_one_though_its_noise_is_another(nominal: Path) -> None:
    alike = parity(Recording(nominal))
    scores = {score.name: score.value for score in alike.scores}
    assert scores.keys() == {"encoders", "proximity", "path", "latency"}
    assert min(scores.values()) > 0.97
    assert all(score.value > 0.9 for score in alike.fields.values())
    assert alike.left_out == ()


def test_another_link_lowers_the_score_of_the_latency_alone(nominal: Path) -> None:
    slow = RobotProfile(link=LinkDelay(0.03))
    scores = {score.name: score.value for score in parity(Recording(nominal), profile=slow).scores}
    assert scores["latency"] < 0.1
    assert scores["encoders"] > 0.9


def test_the_same_seed_plays_the_same_drive(nominal: Path) -> None:
    recording = Recording(nominal)
    with rerun(recording, seed=int(recording.about["seed"])) as again:
        found = compare(run_of(recording), run_of(again.recording))
    assert found.path is not None
    assert found.path.largest < 1e-3
    assert found.first.calls == found.second.calls
    assert again.numbers == tuple(range(1, len(again.numbers) + 1))


def test_every_call_that_a_program_may_make_is_made_again(tmp_path: Path) -> None:
    async def main(robot: Epuck) -> None:
        with robot.record(tmp_path / "all.mcap"):
            await robot.sensors()
            await robot.set_led(1, 1)
            await robot.text("N")
            async with robot.watch("proximity", "encoders", rate=20) as stream:
                await anext(stream)
            await robot.set_camera(20, 20, 8)
            await robot.image()

    run_on("sim://arena?speed=max", main)
    recording = Recording(tmp_path / "all.mcap")
    with rerun(recording) as again:
        assert again.left_out == ()
        runs = run_of(recording), run_of(again.recording)
    assert runs[0].commands.keys() == runs[1].commands.keys()
    assert runs[1].failed == 0
    assert runs[0].readings.keys() == runs[1].readings.keys()


def test_a_call_that_cannot_be_made_again_is_left_out() -> None:
    context = Context(profile_named("asercom-1.2.2"))
    for command, text in (("unheard", "unheard()"), ("set_speed", "set_speed(1)"), ("text", "text(oops")):
        assert request_of(RecordedCall(0.0, 0.0, 1, command, text, ()), context) is None


def recorded(url: str, file: Path, place: Pose | None = None) -> Recording:
    """Record a second of a robot that stands, if asked at a place to which it was moved."""

    async def main(robot: Epuck) -> None:
        if place is not None:
            world_of(robot).move_robot(0, place)
        await robot.sleep(0.1)
        with robot.record(file):
            for _ in range(10):
                await robot.encoders()
                await robot.sleep(0.1)

    run_on(url, main)
    return Recording(file)


def test_a_drive_begins_where_it_was_recorded(tmp_path: Path) -> None:
    with rerun(recorded("sim://square?speed=max", tmp_path / "elsewhere.mcap", Pose(0.3, 0.7, 1.0))) as again:
        pose = again.recording.path(measured=True)[0]
    assert (pose.x, pose.y, pose.heading) == (pytest.approx(0.3), pytest.approx(0.7), pytest.approx(1.0))


def test_a_recording_without_a_world_needs_one(nominal: Path) -> None:
    recording = Recording(nominal)
    recording.scene = ""
    with pytest.raises(ArgumentError, match=r"(?s)cannot be run again.*--world"), rerun(recording):
        pass
    with pytest.raises(LinkNotFound, match="no world 'moon'"), rerun(recording, world="moon"):
        pass


def test_a_world_in_which_the_robot_has_no_room_is_refused(nominal: Path, tmp_path: Path) -> None:
    world = tmp_path / "small.toml"
    world.write_text("[arena]\nsize = [0.4, 0.4]\n[[robot]]\nposition = [0.2, 0.2]\n", encoding="utf-8")
    with (
        pytest.raises(ArgumentError, match=r"(?s)cannot begin at its place.*--world"),
        rerun(Recording(nominal), world=str(world)),
    ):
        pass


def series(values: list[float]) -> Series:
    return Series(("count",), np.arange(len(values)) * 0.1, np.array(values)[:, None])


def test_the_score_is_the_difference_beyond_noise_over_the_spread() -> None:
    ((name, parts),) = field_parts(series([0, 10] * 50), series([3, 13] * 50), series([4, 14] * 50))
    assert name == "count"
    assert parts == pytest.approx([9, 1, 25])


def test_rules_that_the_simulated_drive_does_not_have_are_not_scored() -> None:
    other = Series(("else",), np.arange(3.0), np.zeros((3, 1)))
    assert list(field_parts(series([1, 2, 3]), series([1, 2, 3]), other)) == []


def test_a_recording_without_path_or_calls_has_no_score_for_them(nominal: Path) -> None:
    import dataclasses

    run = run_of(Recording(nominal))
    bare = dataclasses.replace(run, measured=None, odometry=None, commands={})
    assert math.isnan(path_score(bare, run, run).value)
    assert math.isnan(latency_score(bare, run, run).value)


def test_a_second_robot_of_a_world_is_played_as_the_second(tmp_path: Path) -> None:
    recording = recorded("sim://crowd?speed=max&robots=3&robot=2&seed=2", tmp_path / "second.mcap")
    with rerun(recording) as again:
        first, second = recording.path(measured=True)[0], again.recording.path(measured=True)[0]
    assert (first.x, first.y) == (pytest.approx(second.x), pytest.approx(second.y))


FIRST_SEED, *SEEDS = random.Random(4).sample(range(1000), 3)


@pytest.mark.parametrize("seed", short([FIRST_SEED, *SEEDS], FIRST_SEED))
def test_wheels_are_told_on_time_however_late_answers_are(seed: int, tmp_path: Path) -> None:
    """With jitter every second answer comes later than it did; a call that waits must not delay all that follow."""
    file = drive(f"sim://square?speed=max&seed={seed}&latency=0.023&jitter=0.01", tmp_path / "a.mcap", duration=60)
    recording = Recording(file)
    profile = RobotProfile(link=LinkDelay(0.023, 0.01))
    told = sent_times(recording)
    with rerun(recording, profile=profile, seed=seed + 1) as again:
        late = [time - told[again.numbers[call - 1]] for call, time in sent_times(again.recording).items()]
        assert 0 < again.skipped < 0.15 * len(again.numbers)
    assert len(late) == len(told) >= 12, "every call that acts was made"
    # One answer may be waited for, and that is all: it takes 60 ms, and with the late ones of both runs twice that.
    assert max(late) < 0.15


def sent_times(recording: Recording) -> dict[int, float]:
    """Return when each set_speed was sent, s since the beginning, by the number of the call."""
    return {
        entry.data["call"]: entry.time - entry.data["round_trip"] - recording.began
        for entry in recording.entries("/outcomes")
        if entry.data["command"] == "set_speed"
    }


def test_a_path_that_chance_decides_has_no_score() -> None:
    times = np.arange(0.0, 10.0, 0.1)
    runs = []
    for off in (0.0, 0.3, -0.1):
        values = np.column_stack([times * 0.1, off * times / 10, np.zeros(len(times))])
        run = run_of_path(Series(("x", "y", "heading"), times, values))
        runs.append(run)
    real, model, twin = runs
    score = path_score(real, model, twin)
    assert score.noise > 0.25 * score.spread
    assert math.isnan(score.value)
    assert path_score(real, real, real).value == 1.0


def run_of_path(path: Series) -> Run:
    return Run("x", "epuck2", "simulator", 10.0, True, 0, {}, {}, path, None)


@pytest.mark.parametrize("firmware", PROFILES)
def test_crafted_calls_are_left_out(firmware: str) -> None:
    crafted: list[tuple[str, str, tuple[int, ...]]] = [
        ("set_led", "set_led(70000, ON)", (70000, 1)),
        ("set_speed", "set_speed(1e9, 0)", (10**12, 0)),
        ("set_speed", "set_speed()", ()),
        ("text", f"text({'(' * 10_000})", ()),
        ("text", "text(b'x')", ()),
        ("proximity", "watch(nonsense)", ()),
        ("proximity", "watch()", ()),
    ]
    context = Context(profile_named(firmware))
    made = [call for call in crafted if request_of(RecordedCall(0.0, 0.0, 1, *call), context) is not None]
    assert made == []


@pytest.mark.parametrize("firmware", PROFILES)
def test_every_recorded_call_is_the_same_request_again(firmware: str) -> None:
    context = Context(profile_named(firmware))
    for name, arguments in (
        ("set_speed", (0.123, -1)),
        ("set_led", (8, "toggle")),
        ("stop", ()),
        ("set_encoders", (-5, 7)),
    ):
        request = SPECS[name].request(context, *arguments)
        again = request_of(RecordedCall(0.0, 0.0, 1, name, request.text, request.numbers), context)
        assert again is not None
        assert (again.text, again.data, again.numbers) == (request.text, request.data, request.numbers)
