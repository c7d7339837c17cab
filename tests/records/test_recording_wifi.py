"""A robot on Wi-Fi is recorded with what it sends by itself, replayed, gone on with, and logged."""

from pathlib import Path

import pytest

import elib
from elib.base.errors import ReplayDiffers
from elib.records.reader import read_recording
from elib.records.state import state_at
from elib.simulator.emulator.sim_transport import SimTransport

SIM = "sim://arena?firmware=epuck2-wifi&speed=max&quality=ideal"


def drive(robot: elib.BlockingEpuck) -> list[object]:
    """Call, watch and take pictures; return all that came."""
    robot.set_speed(0.5, 0.4)
    found: list[object] = [robot.sensors(), robot.within(3).image().raw]
    for count, snapshot in enumerate(robot.watch("proximity", "image", rate=20)):
        found.append((snapshot.time, snapshot.proximity, snapshot.image.raw))
        if count == 5:
            break
    robot.set_led(3, 1)
    found.append(robot.encoders())
    return found


@pytest.fixture
def recorded(tmp_path: Path) -> tuple[Path, list[object]]:
    path = tmp_path / "run.mcap"
    with elib.connect(SIM) as robot:
        robot.record(path)
        return path, drive(robot)


def test_a_replayed_program_gets_the_same_packets_at_the_same_times(recorded: tuple[Path, list[object]]) -> None:
    path, first = recorded
    with elib.connect(f"replay://{path}?speed=max") as robot:
        assert robot.firmware == "epuck2-wifi"
        assert drive(robot) == first


def test_a_program_that_does_something_else_is_told(recorded: tuple[Path, list[object]]) -> None:
    path, _ = recorded
    with (
        elib.connect(f"replay://{path}?speed=max") as robot,
        pytest.raises(ReplayDiffers, match=r"it sent 80 00 00 f4 01 f4 01.* for set_speed\(0\.5, 0\.4\)"),
    ):
        robot.set_speed(0.5, 0.5)


def test_what_was_watched_is_in_the_recording_as_readings_and_pictures(recorded: tuple[Path, list[object]]) -> None:
    path, first = recorded
    recording = read_recording(str(path))
    pictures = list(recording.entries("/pictures"))
    near = list(recording.entries("/readings/proximity"))
    watched = {each[1].time for each in first if isinstance(each, tuple)}
    assert len(pictures) >= 3
    assert watched <= {entry.data["time"] for entry in near}
    calls = [entry.data["command"] for entry in recording.entries("/calls")]
    assert calls == ["set_speed", "sensors", "image", "set_led", "encoders", "stop"]


def test_a_recording_goes_on_in_the_simulator(recorded: tuple[Path, list[object]]) -> None:
    path, _ = recorded
    with elib.connect(f"replay://{path}?speed=max&fork=0.3") as robot:
        assert robot.firmware == "epuck2-wifi"
        assert robot.sensors().proximity is not None


def drive_away(robot: elib.BlockingEpuck) -> None:
    """Drive a bow with two lamps on."""
    robot.set_led(2, 1)
    robot.set_rgb_led(3, 0.5, 0.0, 1.0)
    robot.set_speed(0.5, 0.4)
    robot.sleep(2.0)


def test_a_fork_drives_on_with_the_recorded_speeds_and_lamps(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with elib.connect(SIM) as robot:
        robot.record(path)
        drive_away(robot)
    with elib.connect(f"replay://{path}?speed=max&fork=1.5", keep_moving=True) as robot:
        before = robot.encoders()
        assert (before.left, before.right) == pytest.approx((720, 576), abs=60)
        robot.sleep(1.0)
        after = robot.encoders()
        assert (after.left - before.left, after.right - before.right) == pytest.approx((500, 400), abs=40)
        robot.set_led(0, 1)  # a command has all actuators: the wheels go on
        robot.sleep(1.0)
        assert robot.encoders().left - after.left == pytest.approx(500, abs=40)
        transport = robot._link.session.transport
        assert isinstance(transport, SimTransport)
        lights = transport.robot.emulator.firmware.lights
        assert (lights.ring[0], lights.ring[2], list(lights.rgb[3:6])) == (1, 1, [50, 0, 100])


def test_the_recording_of_a_fork_is_replayed(tmp_path: Path) -> None:
    path, again = tmp_path / "run.mcap", tmp_path / "again.mcap"
    with elib.connect(SIM) as robot:
        robot.record(path)
        drive_away(robot)
    found = []
    for url in (f"replay://{path}?speed=max&fork=1.5", f"replay://{again}?speed=max"):
        with elib.connect(url) as robot:
            if not again.exists():
                robot.record(again)
            found.append((robot.encoders(), robot.set_body_led(1), robot.sensors().encoders))
    steps = [tuple((each.left, each.right) for each in row if each is not None) for row in found]
    assert steps[0] == steps[1]


def test_what_only_streams_has_its_poses_and_its_world(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with elib.connect(SIM) as robot:
        robot.set_speed(0.5, 0.5)
        with robot.record(path):
            for count, _ in enumerate(robot.watch("encoders", rate=10)):
                if count == 20:
                    break
    recording = read_recording(str(path))
    measured, counted = recording.path(measured=True), recording.path(measured=False)
    assert len(measured) >= 10
    assert len(counted) >= 20
    assert len(list(recording.entries("/world"))) == len(measured)
    assert counted[-1].x == pytest.approx(2.0 * 0.5 * 0.129, abs=0.02)
    assert state_at(recording, 1.5).pose.time == pytest.approx(recording.began + 1.5)


def test_a_log_has_a_line_for_each_call_and_none_for_packets(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    with elib.connect(SIM) as robot:
        robot.log(path)
        for _ in robot.watch("proximity"):
            break
        robot.set_body_led(1)
    words = [line.split()[2:4] for line in path.read_text().splitlines() if not line.startswith("#")]
    assert words == [["call", "set_body_led"], ["ok", "set_body_led"], ["call", "stop"], ["ok", "stop"]]
