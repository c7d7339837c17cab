"""A recorded drive tells what its robot is like: the promise of ``elib fit``."""

import math
from pathlib import Path

import pytest
from parity_drives import Hidden, hidden_robot, off

from elib.base.body import AXLE
from elib.base.errors import ArgumentError
from elib.records.reader import Recording
from elib.records.topics import MEASURED, READINGS
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.simulator.emulator.robotprofile import RobotProfile, load_profile, write
from elib.studies.fit import Fitted, fit_robot
from elib.studies.scores import parity


@pytest.fixture(scope="module")
def found(hidden: Hidden) -> Fitted:
    return fit_robot(Recording(hidden.file))


def require_recovered(found: Fitted, hidden: Hidden) -> None:
    assert found.wheels is not None
    assert found.link is not None
    assert off(found.wheels.left, hidden.left) < 0.002
    assert off(found.wheels.right, hidden.right) < 0.002
    assert off(found.wheels.axle, hidden.axle) < 0.002
    assert abs(found.link.latency - hidden.latency) < 0.002


def test_a_minute_of_driving_gives_wheels_axle_and_latency_back(found: Fitted, hidden: Hidden) -> None:
    require_recovered(found, hidden)
    assert found.missing == ()
    assert found.link is not None
    # Answers of other lengths would look like a slower link with jitter.
    assert found.link.latency == pytest.approx(hidden.latency, abs=1e-5)
    assert found.link.jitter < 1e-5


def test_it_gives_the_curve_the_gains_and_the_open_air_of_a_typical_robot_back(found: Fitted, hidden: Hidden) -> None:
    assert found.curve is not None
    infrared = found.curve.infrared
    for distance in (0.012, 0.015, 0.02, 0.025, 0.03, 0.04):
        assert off(infrared.counts(distance), hidden.light(distance)) < 0.06
    assert infrared.gains == pytest.approx(hidden.shares, rel=0.03)
    assert infrared.offsets == pytest.approx(hidden.open_air, abs=1)
    assert found.curve.nearest < 0.013
    assert max(hidden.gains) > 1.2 * min(hidden.gains)
    assert min(hidden.open_air) > 50


@pytest.mark.long
def test_another_infrared_curve_and_a_link_with_jitter_are_found_too(tmp_path: Path) -> None:
    hidden = hidden_robot(tmp_path, 14, profile="gctronic", keys="&jitter=0.004", duration=60)
    found = fit_robot(Recording(hidden.file))
    require_recovered(found, hidden)
    assert found.link is not None
    assert found.link.jitter == pytest.approx(0.004, abs=0.001)
    assert found.curve is not None
    assert found.curve.near_error < 0.1
    for distance in (0.015, 0.02, 0.025, 0.03, 0.04):
        assert off(found.curve.infrared.counts(distance), hidden.light(distance)) < 0.06
    assert found.curve.infrared.offsets == pytest.approx(hidden.open_air, abs=4)


@pytest.mark.long
def test_the_fitted_robot_is_predicted_on_another_drive_within_the_stated_error(
    found: Fitted, hidden: Hidden, tmp_path: Path
) -> None:
    assert found.curve is not None
    again = hidden_robot(tmp_path, 11, duration=45)
    alike = parity(Recording(again.file), profile=found.profile)
    scores = {score.name: score for score in alike.scores}
    assert {"encoders", "proximity", "path", "latency"} <= scores.keys()
    assert min(score.value for score in scores.values()) > 0.95
    assert scores["proximity"].difference < 2 * math.hypot(found.curve.error, scores["proximity"].noise)


def test_a_profile_survives_its_file(found: Fitted, tmp_path: Path) -> None:
    write(found.profile, tmp_path / "p.toml")
    again = load_profile(str(tmp_path / "p.toml"))
    assert again.wheels is not None
    assert found.profile.wheels is not None
    assert again.wheels.axle == pytest.approx(found.profile.wheels.axle, rel=1e-5)
    assert again.infrared == found.profile.infrared


def without_topics(monkeypatch: pytest.MonkeyPatch, *topics: str) -> None:
    entries = Recording.entries

    def fewer(self: Recording, *wanted: str, **more: object) -> object:
        return (each for each in entries(self, *wanted, **more) if each.topic not in topics)  # type: ignore[arg-type]

    monkeypatch.setattr(Recording, "entries", fewer)


@pytest.mark.long
def test_without_measured_poses_the_link_is_fitted_and_the_rest_said(
    nominal: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_topics(monkeypatch, MEASURED.name)
    found = fit_robot(Recording(nominal))
    assert found.wheels is None
    assert found.link is not None
    assert [each.what for each in found.missing] == ["wheels", "infrared"]
    assert all("no measured poses" in each.why and "recorder.measured" in each.cure for each in found.missing)
    assert found.profile == RobotProfile(found.profile.about, link=found.profile.link)


def test_without_counters_the_wheels_are_not_fitted(nominal: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    without_topics(monkeypatch, f"{READINGS.name}encoders")
    wheels, infrared = fit_robot(Recording(nominal)).missing
    assert (wheels.what, infrared.what) == ("wheels", "infrared")
    for each in (wheels, infrared):
        assert "no readings of the step counters" in each.why
        assert "robot.encoders()" in each.cure


def test_a_drive_without_turns_is_refused_with_what_to_drive(tmp_path: Path) -> None:
    async def main(robot: Epuck) -> None:
        with robot.record(tmp_path / "straight.mcap"):
            for speed in (0.5, -0.5) * 3:
                await robot.set_speed(speed, speed)
                for _ in range(40):
                    await robot.encoders()
                    await robot.sleep(0.05)

    run_on("sim://square?speed=max", main)
    with pytest.raises(ArgumentError, match=r"(?s)turned 0\.0 times.*turns on the spot.*calibration-drive"):
        fit_robot(Recording(tmp_path / "straight.mcap"))


async def driven(robot: Epuck, file: Path, legs: list[tuple[float, float]], seconds: float) -> None:
    """Drive some legs; the counters are set before each of them."""
    with robot.record(file):
        for left, right in legs:
            await robot.set_encoders(0, 0)
            await robot.set_speed(left, right)
            until = robot.time + seconds
            while robot.time < until:
                await robot.encoders()
                await robot.proximity()
                await robot.sleep(0.1)


WAYS = [(0.3, 0.3), (-0.3, -0.3), (0.25, -0.25), (-0.25, 0.25), (0.3, 0.2), (-0.3, -0.2)]


@pytest.mark.long
def test_counters_that_are_set_on_the_way_are_not_taken_for_motion_and_open_space_is_not_taken_for_a_wall(
    tmp_path: Path,
) -> None:
    world, file = tmp_path / "large.toml", tmp_path / "set.mcap"
    world.write_text(
        "[arena]\nsize = [3.0, 3.0]\n[epuck]\nwheel_spread = 0.0\naxle_spread = 0.0\n"
        "[[robot]]\nposition = [1.5, 1.5]\n",
        encoding="utf-8",
    )
    run_on(f"sim://{world}?speed=max", lambda robot: driven(robot, file, WAYS, 12.0))
    found = fit_robot(Recording(file))
    assert found.wheels is not None
    assert found.wheels.left_out == 0
    assert off(found.wheels.left, 1) < 0.002
    assert off(found.wheels.right, 1) < 0.002
    assert off(found.wheels.axle, AXLE) < 0.002
    (missing,) = found.missing
    assert missing.what == "infrared"
    assert "slowly up to a wall" in missing.cure


def test_counters_that_are_set_every_few_seconds_are_refused_with_the_reason(tmp_path: Path) -> None:
    file = tmp_path / "often.mcap"
    run_on("sim://square?speed=max", lambda robot: driven(robot, file, WAYS * 2, 4.0))
    with pytest.raises(ArgumentError, match=r"set or reset 11 times"):
        fit_robot(Recording(file))
