"""The flight recorder: everything that happens on a link is in the file, and recording changes nothing."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import hashlib
import io
import logging
import math
import os
import subprocess
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

import pytest
from mcap.reader import make_reader
from recordings import SIM, Read, complaints, of_topic, read, recorded, topics

import elib
from elib.base.errors import ArgumentError, ElibError, LinkClosed, LinkLost, ReplyTimeout, Unsupported
from elib.link.protocol.profiles import PROFILES
from elib.link.session import Called, Received, TraceEvent, Wrote
from elib.records import mcapfile
from elib.records.background import Background
from elib.records.messages import Message
from elib.records.reader import Entry, Recording, read_recording, summary_of
from elib.records.recorder import Recorder, check_new
from elib.records.topics import BYTES
from elib.robot.runner import run_on
from elib.testing.inside import transport_of
from shared import inside

FIRMWARES = tuple(PROFILES)


async def everything(robot: elib.Epuck, recorder: Recorder) -> None:
    """Do something of every kind."""
    await robot.set_speed(0.3, 0.2)
    await robot.sleep(0.2)
    await robot.set_camera(20, 20, 8, elib.CameraMode.GREY)
    await robot.image()
    await robot.set_camera(20, 20, 8, elib.CameraMode.COLOUR)
    await robot.image()
    await robot.encoders()
    await robot.sensors()
    absent = robot.context.profile.absent
    for name in ("proximity", "selector", "microphones", "attitude", "distance", "magnetometer", "button", "sd_card"):
        if name not in absent:
            await getattr(robot, name)()
    recorder.note("here")
    recorder.measured(1.0, 2.0, -0.5)


def run_of_everything(path: Path, firmware: str = "asercom-1.2.2") -> list[Read]:
    recorded(path, everything, f"{SIM}&firmware={firmware}")
    return read(path)


# -- what is in the file ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_every_message_is_as_its_schema_says(firmware: str, path: Path) -> None:
    found = run_of_everything(path, firmware)
    assert [(each.topic, text) for each in found for text in complaints(each.data, each.schema)] == []


def test_every_topic_is_written(path: Path) -> None:
    run_of_everything(path)
    expected = {"/bytes", "/calls", "/outcomes", "/pictures", "/pose/odometry", "/pose/measured", "/world", "/notes"}
    expected |= {f"/readings/{name}" for name in ("proximity", "encoders", "accelerometer", "battery", "selector")}
    assert expected <= topics(path)


def test_foxgloves_panels_know_the_schemas_by_name(path: Path) -> None:
    names = {each.topic: each.schema_name for each in run_of_everything(path)}
    assert names["/pictures"] == "foxglove.RawImage"
    assert names["/notes"] == "foxglove.Log"
    assert names["/pose/odometry"] == names["/pose/measured"] == "foxglove.PoseInFrame"
    assert names["/readings/ambient_light"] == "elib.AmbientLight"


def test_the_package_mcap_finds_index_statistics_and_about(path: Path) -> None:
    found = run_of_everything(path)
    with (path).open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        (about,) = reader.iter_metadata()
        (scene,) = reader.iter_attachments()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == len(found)
    assert sum(summary.statistics.channel_message_counts.values()) == len(found)
    assert summary.statistics.chunk_count == len(summary.chunk_indexes)
    assert summary.statistics.message_start_time == min(each.log_time for each in found)
    assert summary.statistics.message_end_time == max(each.log_time for each in found)
    assert (summary.statistics.metadata_count, summary.statistics.attachment_count) == (1, 1)
    assert about.metadata["robot"] == f"{SIM}&firmware=asercom-1.2.2"
    assert (about.metadata["world"], about.metadata["seed"]) == ("square", "5")
    assert scene.name == "world.toml"
    assert b"[" in scene.data


def test_the_index_leads_to_the_messages_of_a_time(path: Path) -> None:
    found = run_of_everything(path)
    middle = sorted(each.log_time for each in found)[len(found) // 2]
    with (path).open("rb") as stream:
        later = list(make_reader(stream).iter_messages(starting_at=middle))
    assert len(later) == sum(each.log_time >= middle for each in found)


def test_the_bytes_are_exactly_those_on_the_wire_from_the_opening_on(path: Path) -> None:
    heard: list[tuple[bool, bytes]] = []

    async def main(robot: elib.Epuck) -> None:
        heard.extend((isinstance(event, Wrote), event.data) for _, event in robot.session.opening)

        def hear(time: float, event: TraceEvent) -> None:
            if isinstance(event, Wrote | Received):
                heard.append((isinstance(event, Wrote), event.data))

        robot.trace(hear)
        robot.record(path)
        for _ in range(20):
            await robot.proximity()
            await robot.sensors()

    run_on(SIM, main)
    found = [(each.to_robot, each.data) for each in read_recording(path).exchange()]
    assert found == heard
    assert found[1] == (True, b"V\r")
    assert found[2][1].startswith(b"v,Version")


@inside(elib.open, SIM)
async def test_calls_and_outcomes_belong_together_by_number(robot: elib.Epuck, path: Path) -> None:
    with robot.record(path):
        await asyncio.gather(robot.proximity(), robot.set_speed(0.25, -0.5), robot.proximity())
        transport = transport_of(robot)
        transport.robot.link.lose_next_reply()
        with pytest.raises(ReplyTimeout):
            await robot.within(0.3).selector()
    calls = of_topic(path, "/calls")
    outcomes = {each["call"]: each for each in of_topic(path, "/outcomes")}
    assert [each["call"] for each in calls] == [1, 2, 3, 4]
    assert calls[1]["text"] == "set_speed(0.25, -0.5)"
    assert calls[1]["arguments"] == [250, -500]
    assert [outcomes[number]["command"] for number in (1, 2, 3, 4)] == [
        "proximity",
        "set_speed",
        "proximity",
        "selector",
    ]
    assert [outcomes[number]["ok"] for number in (1, 2, 3, 4)] == [True, True, True, False]
    assert outcomes[4]["error"].startswith("ReplyTimeout: selector() did not end within 0.3 s")
    assert outcomes[1]["waited"] == outcomes[1]["round_trip"] > 0


@inside(elib.open, SIM)
async def test_a_call_that_ends_before_an_older_one_of_its_command_has_its_own_number(
    robot: elib.Epuck, path: Path
) -> None:
    before = asyncio.create_task(robot.proximity())
    await robot.sleep(0.001)
    with robot.record(path):
        picture = asyncio.create_task(robot.image())
        await robot.sleep(0.001)
        patient = asyncio.create_task(robot.within(5).proximity())
        await robot.sleep(0.001)
        with pytest.raises(ReplyTimeout):
            await robot.within(0.02).proximity()
        await asyncio.gather(before, picture, patient)
    calls = {each["call"]: each["time"] for each in of_topic(path, "/calls")}
    outcomes = [each for each in of_topic(path, "/outcomes") if each["command"] == "proximity"]
    assert [(each["call"], each["ok"]) for each in outcomes] == [(0, True), (3, False), (2, True)]
    assert [each["time"] - each["waited"] for each in outcomes[1:]] == pytest.approx([calls[3], calls[2]])


@inside(elib.open, SIM)
async def test_readings_are_what_the_program_got_at_the_time_it_got_them(robot: elib.Epuck, path: Path) -> None:
    with robot.record(path):
        near = [await robot.proximity() for _ in range(5)]
    found = of_topic(path, "/readings/proximity")
    assert [each["front_left"] for each in found] == [each.front_left for each in near]
    assert [each["time"] for each in found] == [each.time for each in near]
    assert {each["origin"] for each in found} == {"simulator"}


@inside(elib.open, SIM)
async def test_a_picture_has_the_pixels_that_the_program_got(robot: elib.Epuck, path: Path) -> None:
    with robot.record(path):
        await robot.set_camera(40, 20, 8, elib.CameraMode.COLOUR)
        picture = await robot.image()
    (found,) = of_topic(path, "/pictures")
    assert (found["width"], found["height"], found["step"], found["encoding"]) == (40, 20, 120, "rgb8")
    assert base64.b64decode(found["data"]) == picture.pixels.tobytes()


def test_the_files_clock_runs_with_the_robots(path: Path) -> None:
    found = run_of_everything(path)
    offsets = {each.log_time - round(each.data["time"] * 1e9) for each in found if not each.topic.startswith("/pose")}
    assert len(offsets) == 1
    assert [each.sequence for each in found] == list(range(1, len(found) + 1))


@inside(elib.open, SIM)
async def test_a_note_or_a_pose_that_no_reader_takes_is_refused_and_the_recording_goes_on(
    robot: elib.Epuck, path: Path
) -> None:
    with robot.record(path) as recorder:
        for wrong in (object(), 5, None, {"a": 1}, b"x", "x" * 500_001):
            with pytest.raises(ArgumentError, match=r"^the note is .*it must be a text of at most 500000 characters$"):
                recorder.note(wrong)  # type: ignore[arg-type]
        with pytest.raises(ArgumentError, match=r"^kind is 5"):
            recorder.note("x", kind=5)  # type: ignore[arg-type]
        for wrong in ("a", 1e300, math.inf, None):
            with pytest.raises(ArgumentError, match=r"^y is .*it must be a number from"):
                recorder.measured(0, wrong, 0)  # type: ignore[arg-type]
        recorder.note("\0" * 500_000)
    assert len(of_topic(path, "/notes")[0]["message"]) >= 500_000
    assert summary_of(Recording(path)).is_complete


@inside(elib.open, SIM)
async def test_notes_and_measured_poses_stand_where_they_were_made(robot: elib.Epuck, path: Path) -> None:
    with robot.record(path) as recorder:
        await robot.sleep(1)
        recorder.note('a "line", ä, \ud800 and \n another')
        recorder.note("searching", kind="state")
        recorder.measured(0.25, -0.5, 1.5)
        with pytest.raises(ArgumentError):
            recorder.measured(float("nan"), 0, 0)
    assert [(each["name"], each["message"]) for each in of_topic(path, "/notes")][:2] == [
        ("note", 'a "line", ä, \\ud800 and \n another'),  # half of a pair is no text
        ("state", "searching"),
    ]
    pose = read_recording(path).path(measured=True)[-1]
    assert (pose.x, pose.y, pose.heading, pose.time) == (0.25, -0.5, 1.5, robot.time)


@inside(elib.open, SIM)
async def test_the_path_in_the_world_and_by_the_counters_is_the_same_but_for_its_beginning(
    robot: elib.Epuck, path: Path
) -> None:
    with robot.record(path):
        await robot.encoders()  # odometry begins with the first one
        await robot.set_speed(0.5, 0.5)
        for _ in range(10):
            await robot.sleep(0.1)
            await robot.encoders()
    found = read_recording(path)
    lengths = [
        sum(((b.x - a.x) ** 2 + (b.y - a.y) ** 2) ** 0.5 for a, b in pairwise(found.path(measured=measured)))
        for measured in (True, False)
    ]
    assert lengths[0] == pytest.approx(lengths[1], abs=0.002)
    assert lengths[0] > 0.05


@inside(elib.open, SIM)
async def test_what_a_simulated_world_holds_is_looked_at_ten_times_a_second(robot: elib.Epuck, path: Path) -> None:
    with robot.record(path):
        for _ in range(200):
            await robot.sleep(0.01)
            await robot.selector()
    assert 15 <= len(of_topic(path, "/world")) <= 22


@inside(elib.reconnecting, SIM)
async def test_a_reconnecting_robots_gap_and_its_second_opening_are_in_the_file(robot: elib.Epuck, path: Path) -> None:
    with robot.record(path):
        await robot.proximity()
        transport_of(robot).robot.link.cut()
        await robot.within(10).proximity()
    notes = [each["message"] for each in of_topic(path, "/notes")]
    assert any(text.startswith("the link is down") for text in notes)
    assert any(text.startswith("the link is back after") for text in notes)
    asked = [each.data for each in read_recording(path).exchange() if each.to_robot]
    assert asked.count(b"V\r") == 2


@inside(elib.open, SIM)
async def test_a_lost_link_ends_the_recording_and_says_why(robot: elib.Epuck, path: Path) -> None:
    recorder = robot.record(path)
    transport = transport_of(robot)
    transport.robot.link.cut()
    with pytest.raises(LinkLost):
        await robot.proximity()
    assert recorder.is_closed
    assert read_recording(path).about["url"] == SIM
    assert "the session ended" in of_topic(path, "/notes")[-1]["message"]


def test_the_blocking_begin_and_callback_styles_are_recorded_too(path: Path) -> None:
    told: list[object] = []
    with elib.connect(SIM) as robot, robot.record(path) as recorder:
        robot.set_speed(0.1, 0.1)
        pending = [robot.begin.proximity(), robot.begin.selector()]
        recorder.note("from the program's thread")
        assert [len(each.end()) if index == 0 else each.end() for index, each in enumerate(pending)]
        robot.callback(lambda value, state: told.append(value), lambda error, state: None, None).encoders()
        robot.sleep(0.5)
    commands = [each["command"] for each in of_topic(path, "/outcomes")]
    assert commands == ["set_speed", "proximity", "selector", "encoders"]
    assert len(told) == 1
    assert of_topic(path, "/notes")[0]["message"] == "from the program's thread"


# -- the beginning and the end ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        ("run.txt", {}, "its name must end in .mcap"),
        ("run", {}, "its name must end in .mcap"),
        ("run.mcap", {"part_bytes": 9_999}, "part_bytes is 9999 bytes; it must be a number from 10000 bytes on"),
        ("run.mcap", {"part_seconds": 0.5}, "part_seconds is 0.5 s; it must be a number from 1 s on"),
        ("run.mcap", {"part_seconds": float("nan")}, "part_seconds is nan s; it must be a number from 1 s on"),
        ("run.mcap", {"part_seconds": 1, "keep": 1}, "keep is 1; it must be a whole number from 2 on"),
        ("run.mcap", {"keep": 2}, "keep counts parts, but the recording has one file"),
    ],
)
@inside(elib.open, SIM)
async def test_what_cannot_be_recorded_is_refused(
    robot: elib.Epuck, name: str, settings: dict[str, float], message: str, tmp_path: Path
) -> None:
    with pytest.raises(ArgumentError, match=message):
        robot.record(tmp_path / name, **settings)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match=message):
        check_new(tmp_path / name, **settings)  # type: ignore[arg-type]
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("there", ["run.mcap", "run.part7.mcap"])
@inside(elib.open, SIM)
async def test_a_file_that_is_there_is_not_replaced(robot: elib.Epuck, there: str, tmp_path: Path, path: Path) -> None:
    (tmp_path / there).write_bytes(b"precious")
    with pytest.raises(ArgumentError, match="exists; a recording never replaces a file"):
        robot.record(path)
    assert (tmp_path / there).read_bytes() == b"precious"


def test_a_name_is_taken_letter_by_letter(tmp_path: Path) -> None:
    (tmp_path / "run1.part2.mcap").touch()

    async def main(robot: elib.Epuck, recorder: Recorder) -> None:
        await robot.proximity()

    recorded(tmp_path / "run[1].mcap", main)
    assert read_recording(tmp_path / "run[1].mcap").about["robot"] == SIM


@inside(elib.open, SIM)
async def test_a_folder_that_is_not_there_is_an_os_error_at_once(robot: elib.Epuck, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        robot.record(tmp_path / "none" / "run.mcap")
    await robot.proximity()


@inside(elib.open, SIM)
async def test_without_the_package_mcap_the_hint_says_how_to_install_it(
    robot: elib.Epuck, monkeypatch: pytest.MonkeyPatch, path: Path
) -> None:
    monkeypatch.setattr(mcapfile.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(Unsupported, match=r"pip install .*\[record\]"):
        robot.record(path)


@inside(elib.open, SIM)
async def test_closing_twice_is_allowed_and_after_it_nothing_is_recorded(robot: elib.Epuck, path: Path) -> None:
    recorder = robot.record(path)
    await robot.proximity()
    recorder.close()
    recorder.close()
    assert recorder.is_closed
    await robot.proximity()
    with pytest.raises(ElibError, match="is closed"):
        recorder.note("late")
    with pytest.raises(ElibError, match="is closed"):
        recorder.measured(0, 0, 0)
    assert len(of_topic(path, "/outcomes")) == 1


def test_a_recording_ends_with_its_robot_and_has_its_last_stop(path: Path) -> None:
    recorders: list[Recorder] = []

    async def main(robot: elib.Epuck) -> None:
        recorders.append(robot.record(path))
        await robot.set_speed(0.5, 0.5)

    run_on(SIM, main)
    assert recorders[0].is_closed
    assert [each["command"] for each in of_topic(path, "/outcomes")] == ["set_speed", "stop"]
    assert summary_of(read_recording(path)).is_complete


@inside(elib.open, SIM)
async def test_two_recorders_of_one_robot_do_not_know_of_each_other(robot: elib.Epuck, tmp_path: Path) -> None:
    with robot.record(tmp_path / "whole.mcap"):
        await robot.proximity()
        with robot.record(tmp_path / "later.mcap"):
            await robot.proximity()
    assert len(of_topic(tmp_path / "whole.mcap", "/outcomes")) == 2
    assert len(of_topic(tmp_path / "later.mcap", "/outcomes")) == 1
    assert read_recording(tmp_path / "later.mcap").about["calls_before"] == "1"


def test_a_robot_that_is_not_open_or_was_closed_cannot_be_recorded(tmp_path: Path, path: Path) -> None:
    with pytest.raises(LinkClosed):
        elib.open(SIM).record(path)

    async def main(robot: elib.Epuck) -> None:
        await robot.close()
        with pytest.raises(LinkClosed):
            robot.record(path)

    run_on(SIM, main)
    with elib.connect(SIM) as robot:
        pass
    with pytest.raises(LinkClosed):
        robot.record(path)
    assert list(tmp_path.iterdir()) == []


# -- parts -----------------------------------------------------------------------------------------------------------


async def drive(robot: elib.Epuck, recorder: Recorder) -> None:
    for turn in range(60):
        await robot.set_speed(0.2, 0.001 * turn)
        await robot.sleep(0.1)


def without_stamp(entry: Entry) -> dict[str, object]:
    return {name: value for name, value in entry.data.items() if name != "timestamp"}


def test_a_part_begins_whenever_its_time_is_over_and_nothing_is_lost_between(tmp_path: Path, path: Path) -> None:
    recorded(path, drive, part_seconds=2)
    recorded(tmp_path / "whole.mcap", drive)
    assert sorted(each.name for each in tmp_path.glob("run*")) == [
        "run.mcap",
        "run.part2.mcap",
        "run.part3.mcap",
    ]
    parts, whole = read_recording(path), read_recording(tmp_path / "whole.mcap")
    assert [without_stamp(each) for each in parts.entries()] == [without_stamp(each) for each in whole.entries()]
    last = read_recording(tmp_path / "run.part3.mcap")
    assert float(last.about["part_began"]) - last.began == pytest.approx(4, abs=0.2)
    assert last.scene == whole.scene != ""


def test_a_part_begins_whenever_it_is_large_enough(path: Path) -> None:
    recorded(path, drive, part_bytes=10_000)
    sizes = [each.stat().st_size for each in read_recording(path).paths]
    assert len(sizes) > 2
    assert all(10_000 <= size < 40_000 for size in sizes[:-1])
    assert len(of_topic(path, "/calls")) < 60
    assert summary_of(read_recording(path)).messages["/calls"] == 60


def test_only_the_newest_parts_are_kept_and_are_found_by_the_first_name(tmp_path: Path, path: Path) -> None:
    recorded(path, drive, part_seconds=1, keep=2)
    names = [each.name for each in sorted(tmp_path.iterdir())]
    assert len(names) == 2
    assert [each.name for each in read_recording(path).paths] == names
    assert [each.name for each in read_recording(tmp_path / names[1]).paths] == names[1:]


# -- a disk that does not take it ------------------------------------------------------------------------------------

FULL = """
import resource, signal, sys
import elib
from elib.base.errors import ElibError
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
with elib.connect("sim://square?speed=max") as robot:
    recorder = robot.record(sys.argv[1])
    robot.image()
    recorder.note("fits")
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), int(sys.argv[2])))
    for _ in range(12):
        robot.image()
    try:
        recorder.close()
    except ElibError as error:
        print(error)
    print(robot.proximity().origin)
    try:
        recorder.note("late")
    except ElibError as error:
        print(type(error).__name__)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits of file sizes are those of POSIX")
def test_a_full_disk_costs_the_recording_and_not_the_robot(path: Path) -> None:
    done = subprocess.run(
        # -B: a module that is imported under the limit would be cached cut off, and fail in every later process.
        [sys.executable, "-B", "-c", FULL, str(path), "12000"],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    lines = done.stdout.splitlines()
    assert f"the recording {path} could not be written: [Errno 27] File too large" in lines[0]
    assert "elib record repair" in done.stdout
    assert lines[-2:] == ["simulator", "ElibError"]
    assert path.stat().st_size == 12000
    assert "could not be written" in done.stderr
    assert "Traceback" not in done.stderr
    assert read_recording(path).about["origin"] == "simulator"


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no device that is always full")
@inside(elib.open, SIM)
async def test_a_disk_that_was_full_before_is_an_os_error_at_once(
    robot: elib.Epuck, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = io.FileIO("/dev/full", "wb")
    monkeypatch.setattr(mcapfile, "open", lambda *args, **kwargs: full, raising=False)
    with pytest.raises(OSError, match="No space left"):
        robot.record(path)
    await robot.proximity()
    assert full.closed


def test_a_file_whose_full_chunk_could_not_be_written_gets_no_index(path: Path) -> None:
    file = mcapfile.McapFile(path, {"format": "1"}, 0.0, datetime.now(UTC))
    before, write = file.size, file._write

    def full(data: bytes) -> None:
        raise OSError(28, "No space left on device")

    file._write = full  # type: ignore[method-assign]
    with pytest.raises(OSError, match="No space left"):
        while True:
            file.write(Message(0.0, BYTES, bytes(1000)))
    file._write = write  # type: ignore[method-assign]
    file.finish()
    assert (path).stat().st_size == before


# -- recording changes nothing ---------------------------------------------------------------------------------------


def trajectory(robot_url: str, record: Callable[[elib.Epuck], object]) -> str:
    """Return a hash of all a simulated run does and hears, to the last bit."""
    heard = hashlib.sha256()

    async def main(robot: elib.Epuck) -> None:
        record(robot)

        def hear(time: float, event: TraceEvent) -> None:
            if not isinstance(event, Called):
                heard.update(repr((time, getattr(event, "data", None), getattr(event, "value", None))).encode())

        robot.trace(hear)
        for turn in range(40):
            with contextlib.suppress(ReplyTimeout):
                near = await robot.proximity()
                await robot.set_speed(0.4, 0.4 if near.front_left < 100 else -0.4)
                await (robot.image() if turn % 20 == 0 else robot.encoders())
            await asyncio.sleep(0.05)  # clock: simulated
        transport = transport_of(robot)
        world = transport.simulation.world
        assert world is not None
        heard.update(repr(world.poses).encode())

    run_on(robot_url, main)
    return heard.hexdigest()


def test_recording_changes_nothing_of_a_simulated_run(tmp_path: Path, path: Path) -> None:
    url = SIM + "&loss=0.02&jitter=0.002"
    without = trajectory(url, lambda robot: None)
    assert trajectory(url, lambda robot: robot.record(path)) == without
    assert trajectory(url, lambda robot: robot.record(tmp_path / "parts.mcap", part_bytes=10_000, keep=2)) == without


# -- the thread behind -----------------------------------------------------------------------------------------------


@inside(elib.open, SIM)
async def test_what_comes_faster_than_it_can_be_written_is_counted(
    robot: elib.Epuck, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = robot.record(path)
    work = recorder._work
    assert isinstance(work, Background)
    work._most = 1  # all others of a batch find it full
    for number in range(50):
        recorder.note(f"{number}")
    work._most = 1000
    recorder.note("last")
    recorder.close()
    notes = of_topic(path, "/notes")
    assert any("events were lost: they came faster than they could be written" in each["message"] for each in notes)
    assert "last" in [each["message"] for each in notes]


def test_a_robot_that_ends_while_its_disk_hangs_says_so(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    async def main(robot: elib.Epuck) -> None:
        recorder = robot.record(path)

        def broken(*args: object) -> None:
            raise OSError(5, "Input/output error")

        recorder._parts._file._write = broken  # type: ignore[method-assign]
        await robot.proximity()

    run_on(SIM, main)
    assert [each.levelno for each in caplog.records if "could not be written" in each.message][:1] == [logging.ERROR]
