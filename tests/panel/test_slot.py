"""A robot's place in the panel: connected, watched, lost, found again."""

from __future__ import annotations

import asyncio
import dataclasses
import random
from pathlib import Path

import pytest
from event_lines import lines_of

import elib
from elib.base.errors import ArgumentError, LinkClosed
from elib.base.pose import Pose
from elib.base.timebase import SimulatedLoop
from elib.link.protocol.profiles import FIRMWARES, PROFILES
from elib.link.transport import parse_url
from elib.panel.lifecycle import live_camera
from elib.panel.playback import Playback
from elib.panel.slot import Phase, Slot
from elib.records.reader import Entry
from elib.testing.inside import transport_of
from lanes import short

# clock: simulated
LOOP = SimulatedLoop
SIM = "sim://square?speed=max&quality=ideal"


async def test_connecting_stops_the_robot_sets_its_camera_and_puts_its_lamps_out() -> None:
    slot = Slot(SIM)
    connecting = asyncio.ensure_future(slot.connect())
    await asyncio.sleep(0)
    assert slot.phase is Phase.CONNECTING
    assert await connecting
    memory = slot.robot.context.last_set
    assert (memory.speed, memory.lamps) == ((0, 0), [0] * 10)
    assert memory.camera is not None
    assert (memory.camera.width, memory.camera.height, memory.camera.mode) == (24, 18, elib.CameraMode.COLOUR)
    assert slot.phase is Phase.CONNECTED
    await slot.disconnect()
    assert slot.phase is Phase.DISCONNECTED


async def test_readings_come_by_themselves_and_know_their_age() -> None:
    slot = Slot(SIM)
    assert slot.watcher.age("proximity") == float("inf")
    await slot.connect()
    await asyncio.sleep(1)
    assert slot.watcher.age("proximity") < 0.2
    assert not slot.is_stale("proximity")
    assert {"proximity", "accelerometer", "encoders", "selector"} <= set(slot.readings)
    await slot.disconnect()
    assert slot.is_stale("proximity")


async def test_the_camera_is_watched_when_it_is_asked_for(slot: Slot) -> None:
    await asyncio.sleep(1)
    assert "image" not in slot.readings
    slot.watch_camera(0.5)
    await asyncio.sleep(3)
    assert slot.watcher.age("image") < 1.5
    with pytest.raises(ArgumentError, match=r"from 0\.4 to 60"):
        slot.watch_camera(0.1)


@pytest.mark.parametrize("firmware", FIRMWARES)
async def test_the_camera_of_a_virtual_robot_is_live_while_a_page_shows_it_and_holds_up_no_stop(
    slot: Slot, firmware: str
) -> None:
    slot.look("page")
    assert slot.control is not None
    world, confirmed_after = slot.control.world, []

    def place() -> Pose:
        assert slot.control is not None
        slot.control.snapshot()
        return world.pose(0)

    for pause in range(30):
        for _ in range(3):
            slot.drive.steer("page", 0.5, 0.5)
            await asyncio.sleep(0.1 + 0.006 * pause)  # the stop comes at another moment of a picture each time
        assert slot.drive.may_move
        began = slot.now
        slot.stop()
        # 0.1 s of a picture, and the line's own time; over Wi-Fi a picture takes 0.14 s.
        await asyncio.sleep(0.2 if firmware == "epuck2-wifi" else 0.105)
        stood_at = place()
        await slot.drive.wait_until_stopped()
        confirmed_after.append(slot.now - began)
        assert not slot.drive.may_move
        await asyncio.sleep(0.1)
        assert place() == dataclasses.replace(stood_at, time=place().time)
        slot.drive.steer("page", 0, 0)
    assert slot.watcher.age("image") < 1
    assert isinstance(slot.readings["image"], elib.Image)
    assert slot.readings["image"].mode is elib.CameraMode.COLOUR
    assert max(confirmed_after) > 0.15, "no stop met a picture"
    slot.look_away("page")
    assert slot.watcher.pictures is None
    slot.watch_camera(2)
    slot.look("page")
    assert slot.watcher.pictures == 2, "a person chose it"


def test_a_live_picture_leaves_any_line_within_a_tenth_of_a_second() -> None:
    for baud in (0, 38400, 57600, 115200, 230400, 1_000_000):
        for zooms in (None, (1, 2, 4, 8)):
            camera = live_camera(baud, zooms)
            assert camera is not None
            width, height, zoom, _ = camera
            assert 0.022 + (2 * width * height + 3) * (10 / baud if baud else 0) <= 0.1, (baud, zooms)
            assert width * min(zoom, 4 if zooms else zoom) <= 480, (baud, zooms)


def test_a_line_that_is_too_slow_carries_no_live_picture() -> None:
    assert live_camera(9600, None) is None


async def test_driving_moves_the_robot_and_letting_go_stops_it(slot: Slot) -> None:
    for _ in range(20):
        slot.drive.steer("page", 1, 1)
        await asyncio.sleep(0.1)
    assert slot.watcher.trail[-1].x - slot.watcher.trail[0].x == pytest.approx(2 * 0.5 * 0.1288, rel=0.1)
    slot.drive.leave("page")
    await asyncio.sleep(0.3)
    place = slot.watcher.trail[-1]
    await asyncio.sleep(1)
    assert slot.watcher.trail[-1] == place


async def test_a_link_that_breaks_is_said_and_comes_back(slot: Slot) -> None:
    slot.drive.steer("page", 1, 1)
    await asyncio.sleep(0.2)
    transport_of(slot.robot).lose("pulled")
    await asyncio.sleep(0.05)
    assert slot.phase is Phase.GAP
    assert slot.is_stale("proximity")
    await asyncio.sleep(3)
    assert slot.phase is Phase.CONNECTED
    assert slot.watcher.age("proximity") < 0.2
    assert [line.is_bad for line in lines_of(slot.log.lines, ["link"], "link is")] == [True, False]


async def test_a_link_that_was_cut_in_the_world_stays_cut_until_it_is_mended(slot: Slot) -> None:
    door = slot.control
    assert door is not None
    door.cut(0)
    await asyncio.sleep(10)
    assert slot.phase is Phase.GAP
    assert slot.control is not None
    assert slot.control.is_cut(0)
    slot.control.mend(0)
    await asyncio.sleep(5)
    assert slot.phase is Phase.CONNECTED
    assert slot.control.simulation is door.simulation


async def test_commands_of_the_table_are_checked_and_answered() -> None:
    slot = Slot(SIM)
    with pytest.raises(LinkClosed, match="not connected"):
        await slot.command("proximity")
    await slot.connect()
    assert isinstance(await slot.command("proximity"), elib.Proximity)
    await slot.command("set_led", 3, 1)
    assert slot.robot.context.last_set.lamps[3] == 1
    with pytest.raises(ArgumentError):
        await slot.command("set_led", 99, 1)
    with pytest.raises(ArgumentError, match="no command"):
        await slot.command("__class__")
    await slot.disconnect()


async def test_what_is_told_is_in_the_event_log_and_readings_are_not(slot: Slot) -> None:
    await slot.command("set_body_led", 1)
    await asyncio.sleep(1)
    calls = lines_of(slot.log.lines, ["call"])
    assert [line.text for line in calls] == ["set_body_led(1): ok"]


async def test_log_and_recording_are_written_and_end_with_the_connection(slot: Slot, tmp_path: Path) -> None:
    slot.records.log.start(str(tmp_path / "run.log"))
    slot.records.recording.start(str(tmp_path / "run.mcap"))
    await asyncio.sleep(0.5)
    with pytest.raises(ArgumentError, match="exists"):
        slot.records.recording.start(str(tmp_path / "run.mcap"))
    with pytest.raises(ArgumentError, match="cannot be written"):
        slot.records.log.start(str(tmp_path / "no" / "run.log"))
    await slot.disconnect()
    assert "GetIR" in (tmp_path / "run.log").read_text() or (tmp_path / "run.log").stat().st_size > 0
    assert (tmp_path / "run.mcap").stat().st_size > 1000


async def test_the_world_of_a_simulated_robot_can_be_reached() -> None:
    slot = Slot(SIM)
    assert slot.control is None
    await slot.connect()
    assert slot.control is not None
    slot.control.move_robot(0, 0.5, 0.5)
    await asyncio.sleep(0.5)
    assert (slot.watcher.trail[-1].x, slot.watcher.trail[-1].y) == (0.5, 0.5)
    await slot.disconnect()


async def test_a_speed_from_the_console_stops_when_its_page_falls_silent(slot: Slot) -> None:
    await slot.command("set_speed", 0.5, 0.5, page="page")
    for _ in range(10):
        await asyncio.sleep(0.1)
        assert slot.drive.beat("page")
    moving = slot.watcher.trail[-1].x
    with pytest.raises(ArgumentError, match="another page drives"):
        await slot.command("set_speed", 0.5, 0.5, page="other")
    await asyncio.sleep(1)
    stood = slot.watcher.trail[-1]
    assert stood.x > moving
    await asyncio.sleep(1)
    assert (slot.watcher.trail[-1], slot.drive.may_move) == (stood, False)
    await slot.command("text", "D,300,300")
    assert slot.drive.may_move
    await asyncio.sleep(1)
    assert not slot.drive.may_move


async def test_a_connection_can_be_given_up_while_it_is_being_made() -> None:
    slot = Slot("sim://square?speed=max&latency=2")
    connecting = asyncio.create_task(slot.connect())
    await asyncio.sleep(1)
    assert slot.phase is Phase.CONNECTING
    await slot.disconnect()
    assert not await connecting
    assert (slot.phase, slot.is_connected) == (Phase.DISCONNECTED, False)


async def test_a_robot_that_is_disconnected_without_a_link_may_still_move() -> None:
    slot = Slot("sim://square?speed=max")
    await slot.connect()
    await asyncio.sleep(0.5)
    slot.drive.steer("page", 1, 1)
    await asyncio.sleep(0.2)
    transport_of(slot.robot).lose("pulled")
    await asyncio.sleep(0.05)
    await slot.disconnect()
    assert slot.drive.may_move
    assert lines_of(slot.log.lines, ["link"], "may still be moving")
    await slot.connect()
    assert not slot.drive.may_move
    await slot.disconnect()
    assert not slot.drive.may_move


@pytest.mark.parametrize("latency", [0.45, 0.7, 1])
@pytest.mark.parametrize("firmware", FIRMWARES)
async def test_a_robot_on_a_very_slow_line_is_connected_and_confirms_a_stop(firmware: str, latency: float) -> None:
    slot = Slot(f"sim://square?speed=max&firmware={firmware}&latency={latency}")
    assert await slot.connect(), slot.error
    await slot.command("set_led", 2, 1)
    slot.drive.steer("page", 1, 1)
    await asyncio.sleep(0.1)
    slot.stop()
    async with asyncio.timeout(20):
        await slot.drive.wait_until_stopped()
    assert not slot.drive.may_move
    await slot.disconnect()


@pytest.mark.parametrize("latency", [0.1, 0.3, 0.45])
@pytest.mark.parametrize("firmware", FIRMWARES)
async def test_a_robot_on_a_slow_line_is_not_said_to_move_when_it_has_confirmed_its_stop(
    firmware: str, latency: float
) -> None:
    slot = Slot(f"sim://square?speed=max&firmware={firmware}&latency={latency}")
    await slot.connect()
    for _ in range(20):
        slot.drive.steer("page", 1, 1)
        await asyncio.sleep(0.1)
    await slot.disconnect()
    assert not slot.drive.may_move
    assert not lines_of(slot.log.lines, ["link"], "may still be moving")


@pytest.mark.parametrize("firmware", FIRMWARES)
async def test_a_robot_that_did_not_confirm_its_last_stop_may_still_move(slot: Slot, firmware: str) -> None:
    slot.drive.steer("page", 1, 1)
    await asyncio.sleep(0.2)
    assert slot.control is not None
    if firmware.endswith("wifi"):
        slot.control.cut(0)  # TCP sends what was lost again, so that the stop would be confirmed in the end
    else:
        slot.control.set_faults(0, loss=1)
    await slot.disconnect()
    assert slot.drive.may_move
    assert lines_of(slot.log.lines, ["link"], "may still be moving")


@pytest.mark.parametrize("seed", short(range(10), 0, 1, 2))
@pytest.mark.parametrize("firmware", FIRMWARES)
async def test_a_robot_stands_0_3_s_after_the_page_s_last_word_though_no_answer_of_it_comes(
    slot: Slot, seed: int
) -> None:
    drawn = random.Random(seed)
    door = slot.control
    assert door is not None
    deaf = round(drawn.uniform(0, 2), 1)
    for tenth in range(25):
        if tenth == round(10 * deaf):
            door.set_faults(0, loss=1)
        slot.drive.steer("page", 1, 0.9)
        await asyncio.sleep(0.1)
    # Its last word was a tenth of a second ago; and the world shows what happened two of its ticks later at most.
    await asyncio.sleep(0.35 - 0.1 + 2 / 64)
    stood = door.snapshot().robots[0].pose
    await asyncio.sleep(3)
    there = door.snapshot().robots[0].pose
    assert (there.x, there.y, there.heading) == (stood.x, stood.y, stood.heading)


async def test_readings_that_are_taken_once_a_second_are_old_after_three(monkeypatch) -> None:
    watcher = Slot(SIM).watcher
    watcher.watch_sensors(1)
    for age, is_stale in ((2.9, False), (3.1, True)):
        monkeypatch.setattr(watcher, "age", lambda name, age=age: age)
        assert watcher.is_stale("proximity") is is_stale


async def test_a_picture_that_was_asked_for_once_does_not_become_stale_and_a_live_one_does(slot: Slot) -> None:
    await slot.take_picture()
    await asyncio.sleep(10)
    assert slot.watcher.age("image") > 9
    assert not slot.is_stale("image")
    slot.watch_camera(1)
    assert slot.is_stale("image"), "until the first live picture"
    await slot.disconnect()
    assert slot.is_stale("image")


async def test_a_picture_that_is_taken_rarely_is_old_later(slot: Slot) -> None:
    slot.watch_camera(3)
    await asyncio.sleep(5)
    assert not slot.is_stale("image")
    for seconds in ("1", True, float("nan"), [1]):
        with pytest.raises(ArgumentError, match=r"from 0\.4 to 60"):
            slot.watch_camera(seconds)  # type: ignore[arg-type]


async def test_a_stick_fills_no_event_log(slot: Slot) -> None:
    for tenth in range(30):
        slot.drive.steer("page", tenth / 30, 0.1)
        await asyncio.sleep(0.1)
    assert len(lines_of(slot.log.lines, ["call"], "set_speed")) in (3, 4)


async def test_arguments_of_the_wrong_number_and_kind_are_refused_for_every_command(slot: Slot) -> None:
    bad: list[tuple[str, list[object]]] = [
        ("text", []),
        ("text", [7]),
        ("text", ["a" * 300]),
        ("text", ["D,1,1\rR"]),
        ("sensors", [1]),
        ("set_body_led", ["x"]),
        ("set_speed", [1]),
        ("set_speed", [1, None]),
        ("set_speed", [1, float("nan")]),
    ]
    for name, arguments in bad:
        with pytest.raises(ArgumentError):
            await slot.command(name, *arguments, page="page")
    assert (slot.drive.driver, slot.drive.may_move) == ("", False)


@pytest.mark.parametrize("firmware", PROFILES)
async def test_lamps_burn_on_when_the_camera_is_set(slot: Slot, firmware: str) -> None:
    await slot.command("set_led", 3, 1)
    await slot.command("set_body_led", 1)
    await slot.set_camera(40, 40, 8, elib.CameraMode.COLOUR)
    assert slot.robot.context.last_set.lamps == [0, 0, 0, 1, 0, 0, 0, 0, 1, 0]
    lamps = transport_of(slot.robot).simulation.world.snapshot().robots[0].lamps
    assert [any(colour) for colour in lamps.ring] == [led == 3 for led in range(8)]
    assert lamps.body


async def test_with_the_last_page_polling_ends_and_begins_again_with_the_next(slot: Slot) -> None:
    slot.join("one")
    slot.join("other")
    slot.watch_camera(0.5)
    await asyncio.sleep(1)
    slot.leave("one")
    await asyncio.sleep(1)
    assert slot.watcher.age("proximity") < 0.2
    slot.leave("other")
    await asyncio.sleep(0.1)
    robot, count = slot.robot, slot.robot.statistics.count
    await asyncio.sleep(10)
    assert robot.statistics.count == count
    assert slot.phase is Phase.CONNECTED
    slot.join("one")
    await asyncio.sleep(0.6)
    assert slot.watcher.age("proximity") < 0.2
    assert slot.watcher.age("image") < 0.6


async def test_a_recording_goes_on_when_nobody_watches(slot: Slot, tmp_path: Path) -> None:
    slot.join("page")
    slot.records.recording.start(str(tmp_path / "run.mcap"))
    slot.leave("page")
    await asyncio.sleep(3)
    assert slot.watcher.age("proximity") < 0.2


async def test_a_robot_that_nobody_watches_is_not_polled_when_it_is_connected_again() -> None:
    slot = Slot(SIM)
    slot.join("page")
    await slot.connect()
    await slot.disconnect()
    slot.leave("page")
    await slot.connect()
    await asyncio.sleep(0.1)
    count = slot.robot.statistics.count
    await asyncio.sleep(3)
    assert slot.robot.statistics.count == count
    await slot.disconnect()


# -- recordings --


@pytest.mark.parametrize("firmware", PROFILES)
async def test_the_panel_s_own_recording_is_played_as_it_happened(firmware: str, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"

    slot = Slot(f"{SIM}&firmware={firmware}")
    await slot.connect()
    slot.records.recording.start(str(path))
    await asyncio.sleep(1)
    await slot.command("set_camera", 40, 40, 8, elib.CameraMode.COLOUR)
    picture = await slot.take_picture()
    await slot.command("set_led", 3, 1)
    for _ in range(10):
        slot.drive.steer("page", 1, 1)
        await asyncio.sleep(0.1)
    slot.drive.leave("page")
    await asyncio.sleep(1)
    seen, place = dict(slot.readings), slot.watcher.trail[-1]
    await slot.disconnect()

    replayed = Slot(f"replay://{path}")
    assert await replayed.connect()
    assert (replayed.phase, replayed.is_connected, replayed.firmware) == (Phase.PLAYING, False, firmware)
    await asyncio.sleep(0.5)
    assert replayed.watcher.age("proximity") < 0.2
    assert not replayed.is_stale("proximity")
    with pytest.raises(LinkClosed, match="is a recording: it can be watched, and told nothing"):
        await replayed.command("set_led", 1, 1)
    assert not replayed.drive.steer("page", 1, 1)
    told = set()
    while replayed.phase is Phase.PLAYING:
        if replayed.context is not None:
            told.add((replayed.context.last_set.lamps[3], replayed.context.last_set.speed[0] > 0))
        await asyncio.sleep(0.1)
    assert {(0, False), (1, True)} <= told
    assert replayed.phase is Phase.DISCONNECTED
    assert replayed.error is None
    assert (replayed.readings["image"].pixels == picture.pixels).all()
    assert {name: type(value) for name, value in replayed.readings.items()} == {
        name: type(value) for name, value in seen.items()
    }
    assert replayed.readings["encoders"] == seen["encoders"], "it stood at the end"
    assert (replayed.watcher.trail[-1].x, replayed.watcher.trail[-1].y) == pytest.approx((place.x, place.y))
    assert "set_led(3, 1): ok" in [line.text for line in replayed.log.lines]
    assert replayed.is_stale("proximity")

    assert await replayed.connect(), "it begins anew"
    await asyncio.sleep(0.5)
    await replayed.disconnect()
    assert (replayed.phase, replayed.readings, replayed.firmware) == (Phase.DISCONNECTED, {}, "")


async def test_a_recording_that_is_not_there_is_said() -> None:
    slot = Slot("replay:///elib/nowhere.mcap")
    assert not await slot.connect()
    assert slot.phase is Phase.FAILED
    assert slot.error is not None
    assert "nowhere.mcap" in slot.error.message
    await slot.disconnect()


async def test_a_recording_can_be_gone_on_with_in_the_panel(tmp_path: Path) -> None:
    slot = Slot(SIM)
    await slot.connect()
    slot.records.recording.start(str(tmp_path / "run.mcap"))
    await asyncio.sleep(1)
    await slot.disconnect()
    forked = Slot(f"replay://{tmp_path}/run.mcap?fork=0.5&speed=max")
    assert await forked.connect()
    assert forked.phase is Phase.CONNECTED
    assert forked.control is not None
    await forked.disconnect()


async def test_what_elib_did_not_write_into_a_recording_is_passed_over(tmp_path: Path) -> None:
    entries = [
        Entry(0.1, "/readings/proximity", {"front_right": "<script>"}),
        Entry(0.1, "/readings/selector", {"position": "<script>"}),
        Entry(0.1, "/readings/nothing", {}),
        Entry(float("nan"), "/pictures", {"width": 40, "height": 40, "data": "", "encoding": "mono8"}),
        Entry(0.1, "/pose/measured", {"pose": 7}),
        Entry(0.1, "/calls", {"call": [], "text": 7, "arguments": ["x"]}),
        Entry(0.1, "/outcomes", {"call": 1, "command": "set_led", "ok": True}),
        Entry(0.2, "/readings/selector", {"position": 3}),
    ]
    slot = Slot(SIM)
    await slot.connect()
    slot.records.recording.start(str(tmp_path / "run.mcap"))
    await slot.disconnect()
    playback = Playback(parse_url(f"replay://{tmp_path}/run.mcap"))
    playback.recording.began = 0.0
    playback.recording.entries = lambda *topics, health=None: iter(entries)  # type: ignore[method-assign]
    seen: list[object] = []
    playback.on_reading = lambda name, value: seen.append(value)
    await playback.play()
    assert seen == [elib.Selector(3)]
