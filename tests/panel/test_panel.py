"""The robots of a panel: added, stopped together and removed, in simulated time; and its files."""

from __future__ import annotations

import asyncio
import gc
import math
import os
import re
from collections.abc import AsyncIterator
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest
import pytest_asyncio

import elib
from elib.base.errors import ArgumentError, LinkClosed, LinkLost, RobotSilent
from elib.base.timebase import SimulatedLoop
from elib.panel import lifecycle
from elib.panel.behaviours import RunPhase
from elib.panel.panel import MAX_ROBOTS, Panel
from elib.panel.recents import MAX_URL, RecentRobots
from elib.panel.server.messages import MESSAGES
from elib.panel.slot import Phase, Slot
from elib.records.reader import read_recording
from elib.simulator.emulator import past
from elib.simulator.emulator.control import Control
from elib.simulator.physics import Scene, World
from shared import until

# clock: simulated
LOOP = SimulatedLoop
SIM = "sim://square?speed=max"


@pytest_asyncio.fixture
async def panel() -> AsyncIterator[Panel]:
    panel = Panel()
    yield panel
    await panel.close()


async def connected(panel: Panel, *urls: str) -> list[Slot]:
    """Take robots in and wait until they are connected."""
    slots = [panel.slot(panel.add(url)) for url in urls]
    for key in panel.slots:
        panel.connect(key)
    await until(lambda: all(slot.phase is Phase.CONNECTED for slot in slots))
    return slots


async def test_robots_come_with_keys_in_order_and_go() -> None:
    panel = Panel()
    first, second = panel.add("sim://maze"), panel.add(SIM)
    assert [(key, slot.name) for key, slot in panel.slots.items()] == [(first, "sim://maze"), (second, SIM)]
    await panel.remove(first)
    assert list(panel.slots) == [second]
    assert panel.add(SIM) not in (first, second)  # a page that still shows the first would act on another
    await panel.close()
    assert not panel.slots


async def test_a_panel_may_close_while_a_robot_is_being_connected() -> None:
    panel = Panel()
    slot = panel.slot(key := panel.add(SIM))
    panel.connect(key)
    await asyncio.sleep(0)
    assert slot.phase is Phase.CONNECTING
    assert await panel.close() == []
    assert slot.phase is Phase.DISCONNECTED
    assert not slot.is_connected


async def test_stop_is_for_all_and_leaving_for_what_one_has_driven(panel: Panel) -> None:
    one, two = await connected(panel, SIM, SIM)
    one.drive.steer("page-1", 1, 1)
    two.drive.steer("page-2", 1, 1)
    await asyncio.sleep(0.1)
    for slot in (one, two):
        slot.leave("page-1")
    await asyncio.sleep(0.1)
    assert (one.drive.driver, two.drive.driver) == ("", "page-2")
    assert (one.drive.may_move, two.drive.may_move) == (False, True)
    one.drive.steer("page-1", 1, 1)
    await asyncio.sleep(0.1)
    panel.stop_all()
    await asyncio.sleep(0.1)
    assert (one.drive.may_move, two.drive.may_move) == (False, False)


async def test_closing_stops_every_robot_and_names_those_that_did_not_confirm_it() -> None:
    panel = Panel()
    one, two = await connected(panel, SIM, SIM)
    controls = [slot.control for slot in (one, two)]
    for slot in (one, two):
        slot.drive.steer("page", 1, 1)
    await asyncio.sleep(0.1)
    assert controls[1] is not None
    controls[1].cut(0)
    assert await panel.close() == [two.name]
    assert not one.is_connected
    assert not two.is_connected


async def test_a_robot_that_does_not_confirm_its_stop_is_named_to_the_page_that_removes_it(panel: Panel) -> None:
    one, two = await connected(panel, SIM, SIM)
    page = SimpleNamespace(panel=panel)
    await MESSAGES["remove"].act(page, robot=one.key)
    two.drive.steer("page", 1, 1)
    await asyncio.sleep(0.1)
    assert two.control is not None
    two.control.cut(0)
    with pytest.raises(LinkLost, match="may still be moving"):
        await MESSAGES["remove"].act(page, robot=two.key)
    assert not panel.slots


async def test_a_behaviour_of_all_robots_passes_over_those_that_refuse_and_tells_why(panel: Panel) -> None:
    one, two = await connected(panel, SIM, SIM)
    robots, page = ["gone", panel.add(SIM), one.key, two.key], SimpleNamespace(panel=panel)
    for name, more, phase in (
        ("behave", {"name": "avoid"}, RunPhase.RUNNING),
        ("pause_behaviour", {}, RunPhase.PAUSED),
        ("resume_behaviour", {}, RunPhase.RUNNING),
        ("end_behaviour", {}, RunPhase.STOPPED),
    ):
        with pytest.raises(ArgumentError, match="no such robot"):
            MESSAGES[name].act(page, robots=robots, **more)
        await until(lambda phase=phase: [each.runner.phase for each in (one, two)] == [phase] * 2)  # type: ignore[misc]
    await asyncio.gather(one.runner.stop(), two.runner.stop())
    robots[0] = panel.add(SIM)
    with pytest.raises(LinkClosed, match="not connected") as caught:
        MESSAGES["behave"].act(page, robots=robots, name="avoid")
    first, second = (re.escape(each.label) for each in panel.labels() if each.key in robots[:2])
    assert re.match(rf"{second} \({first} failed too\): ", str(caught.value))
    assert one.runner.is_active
    assert two.runner.is_active


async def test_on_a_typical_wifi_nearly_every_stop_that_waits_behind_late_pictures_is_still_confirmed() -> None:
    panel = Panel()
    urls = [f"sim://square?firmware=epuck2-wifi&quality=typical&seed={seed}" for seed in range(20)]
    for slot in await connected(panel, *urls):
        slot.watch_camera(0.4)
        slot.drive.steer("page", 1, 1)
    await asyncio.sleep(3)
    assert len(await panel.close()) <= 1  # two late pictures in a row may take longer than anybody waits; 6 with 0.5 s


async def test_what_a_page_sends_for_a_robot_is_checked(panel: Panel) -> None:
    for url in (
        "",
        "javascript:alert(1)",
        "http://evil.example/",
        "sim://?nonsense=1",
        "sim://?robots=1e99",
        "tcp://host:99999",
        "sim://\x1b[2J",
        "sim://\u202eevil",
        "sim://a\nb",
        "sim://" + "a" * MAX_URL,
    ):
        with pytest.raises(ArgumentError):
            panel.add(url)
        assert not panel.slots, url


async def test_the_robot_of_a_program_has_the_name_that_the_program_gave_it(panel: Panel) -> None:
    for name in ("<script>alert('hello')</script>", "a" * 200, "first line\nsecond line"):
        async with elib.open(SIM, name=name) as robot:
            slot = panel.watch(robot)
        assert slot is not None
        assert slot.name == name


async def test_a_key_of_no_robot_is_refused(panel: Panel) -> None:
    panel.add(SIM)
    for key in (None, 1, "", "2", "__class__", ["1"], {"1": 1}):
        with pytest.raises(ArgumentError):
            panel.slot(key)
        with pytest.raises(ArgumentError):
            panel.connect(key)
        with pytest.raises(ArgumentError):
            await panel.remove(key)
        assert [*panel.slots] == ["1"], key


async def test_a_panel_has_room_for_so_many_robots(panel: Panel) -> None:
    for _ in range(MAX_ROBOTS):
        panel.add(SIM)
    with pytest.raises(ArgumentError, match="room for no more"):
        panel.add(SIM)


FILES = [
    "replay:///etc/passwd",
    "replay://run.mcap",
    "sim:///etc/passwd",
    "sim://../secret.toml",
    "sim://%2e%2e/secret.toml",
    "sim://arena?hardware=/etc/passwd",
    "sim://arena?profile=me.json",
    "sim://arena?fault=/etc/passwd",
    "sim://arena?fault=..%2Fsecret",
    "sim://arena?fault=secret.toml",
]


async def test_a_page_of_a_shared_panel_opens_no_files_of_the_computer() -> None:
    for url in FILES:
        shared = Panel(is_shared=True)
        with pytest.raises(ArgumentError, match="may not open files"):
            shared.add(url)
        assert not shared.slots, url
        shared.add(url, is_trusted=True)
        Panel().add(url)


async def test_a_shared_panel_opens_the_shipped_worlds_and_every_port() -> None:
    shared = Panel(is_shared=True)
    for url in ("sim://", "sim://maze?robots=2&fault=flaky-bluetooth", "tcp://192.168.1.7:4000", "COM3"):
        shared.add(url)
    await shared.close()


async def test_the_url_of_a_world_adds_each_of_its_robots_in_one_world_and_is_remembered_once(tmp_path: Path) -> None:
    panel = Panel(recents=RecentRobots(tmp_path / "recents.json"))
    keys = panel.add_all("sim://crowd?robots=3&speed=max")
    for key in keys:
        panel.connect(key)
    while any(panel.slot(key).phase is not Phase.CONNECTED for key in keys):  # noqa: ASYNC110  # in simulated time
        await asyncio.sleep(0.1)
    assert [each.label for each in panel.labels()] == ["epuck-1", "epuck-2", "epuck-3"]
    controls = [panel.slot(key).control for key in keys]
    assert [panel.slot(key).index for key in keys] == [0, 1, 2]
    assert len({id(control.simulation) for control in controls if control is not None}) == 1
    assert panel.recents.urls == ["sim://crowd?robots=3&speed=max"]
    await panel.close()


async def test_a_world_with_more_robots_than_there_is_room_for_adds_none(panel: Panel) -> None:
    with pytest.raises(ArgumentError, match=f"room for {MAX_ROBOTS} in all"):
        panel.add_all(f"sim://crowd?robots={MAX_ROBOTS + 1}")
    assert not panel.slots


async def test_no_two_robots_have_the_same_label(panel: Panel) -> None:
    for url in (SIM, SIM, "tcp://192.168.1.7:4000", "serial:///dev/rfcomm0", "serial:///dev/" + "a" * 60):
        panel.add(url)
    labels = [each.label for each in panel.labels()]
    assert labels[:4] == ["epuck-1 (square)", "epuck-1 (square) (2)", "192.168.1.7:4000", "rfcomm0"]
    assert labels[4].endswith("a…")


async def test_the_folder_offers_the_recordings_that_can_be_opened_and_names_that_are_free(tmp_path: Path) -> None:
    for name in ("a.mcap", "run.mcap", "run.log", "other.txt"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "link.mcap").symlink_to(tmp_path / "a.mcap")
    (tmp_path / "dangling.mcap").symlink_to(tmp_path / "nothing")
    (tmp_path / os.fsdecode(b"bad\xff.mcap")).write_bytes(b"")
    panel = Panel(folder=tmp_path)
    files = panel.files()
    assert {name for name, _, _ in files.recordings} == {"a.mcap", "run.mcap"}
    assert (files.log, files.recording) == ("run-2.log", "run-2.mcap")
    assert panel.slot(panel.add_recording("a.mcap")).url == f"replay://{tmp_path}/a.mcap"
    for name in ("none.mcap", "../a.mcap", "a.txt"):
        with pytest.raises(ArgumentError):
            panel.add_recording(name)
    await panel.close()


async def test_a_log_and_a_recording_can_be_asked_for_before_the_robot_is_connected(tmp_path: Path) -> None:
    panel = Panel(folder=tmp_path)
    slot = panel.slot(key := panel.add(SIM))
    slot.records.log.start(str(tmp_path / "run.log"))
    slot.records.recording.start(str(tmp_path / "run.mcap"))
    assert not any(tmp_path.iterdir())  # noqa: ASYNC240
    assert (slot.records.log.armed, slot.records.recording.armed) == (f"{tmp_path}/run.log", f"{tmp_path}/run.mcap")
    panel.connect(key)
    while slot.phase is not Phase.CONNECTED:  # noqa: ASYNC110  # in simulated time
        await asyncio.sleep(0.1)
    await slot.command("set_led", 1, 1)
    await panel.close()
    called = [row.split()[3] for row in (tmp_path / "run.log").read_text().splitlines() if " call " in row]
    assert called[:5] == ["stop", "set_camera", "set_led", "set_body_led", "set_front_led"], "what prepares the robot"
    assert called.count("set_led") == 2
    recorded = [each.data["command"] for each in read_recording(tmp_path / "run.mcap").entries("/calls")]
    assert recorded[:5] == called[:5]


async def test_a_log_of_a_robot_that_could_not_be_prepared_goes_on_at_the_next_connection(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def refuse(*_: object) -> float:
        raise RobotSilent("nothing answered")

    panel = Panel(folder=tmp_path)
    slot = panel.slot(panel.add(SIM))
    slot.records.log.start(str(tmp_path / "run.log"))
    with monkeypatch.context() as patch:
        patch.setattr(lifecycle, "prepare", refuse)
        assert not await slot.connect()
    assert slot.records.log.armed
    assert await slot.connect()
    await panel.close()
    assert " ok stop " in (tmp_path / "run.log").read_text()


async def test_the_leds_of_a_robot_blink_and_then_show_what_they_showed(panel: Panel) -> None:
    (slot,) = await connected(panel, SIM)
    await slot.command("set_led", 3, 1)
    blinking = asyncio.ensure_future(slot.blink())
    await asyncio.sleep(0.2)
    assert slot.context is not None
    assert slot.context.last_set.lamps[:8] == [1] * 8
    await blinking
    assert slot.context.last_set.lamps[:8] == [0, 0, 0, 1, 0, 0, 0, 0]


async def test_leds_that_blink_show_what_they_showed_also_when_the_page_is_closed_meanwhile(panel: Panel) -> None:
    (slot,) = await connected(panel, SIM)
    await slot.command("set_led", 3, 1)
    page = asyncio.ensure_future(slot.blink())
    await asyncio.sleep(0.2)
    page.cancel()
    await asyncio.sleep(4)
    assert slot.context is not None
    assert slot.context.last_set.lamps[:8] == [0, 0, 0, 1, 0, 0, 0, 0]


async def test_a_robot_that_is_disconnected_while_it_blinks_says_so_to_who_waits_for_it(panel: Panel) -> None:
    (slot,) = await connected(panel, SIM)
    blinking = asyncio.ensure_future(slot.blink())
    await asyncio.sleep(0.2)
    await slot.disconnect()
    with pytest.raises(LinkClosed, match="disconnected"):
        await blinking


async def test_a_robot_that_is_lost_while_it_blinks_for_a_page_that_was_closed_leaves_no_error_behind() -> None:
    complaints: list[dict[str, object]] = []
    asyncio.get_running_loop().set_exception_handler(lambda loop, context: complaints.append(context))
    panel = Panel()
    (slot,) = await connected(panel, SIM)
    page = asyncio.ensure_future(slot.blink())
    await asyncio.sleep(0.2)
    page.cancel()
    assert slot.control is not None
    slot.control.cut(0)
    await asyncio.sleep(10)
    await panel.close()
    gc.collect()
    assert complaints == []


def test_a_panel_that_closes_lets_a_paused_world_go_on_so_that_its_robot_confirms_the_stop() -> None:
    async def story() -> None:  # simulated time cannot be paused
        panel = Panel()
        (slot,) = await connected(panel, "sim://square")
        await slot.robot.set_speed(0.3, 0.3)
        assert slot.control is not None
        slot.control.pause()
        assert await panel.close() == []

    asyncio.run(story())


async def test_the_world_of_a_study_does_not_go_back(panel: Panel, monkeypatch: pytest.MonkeyPatch) -> None:
    (slot,) = await connected(panel, SIM)
    assert slot.control
    time = look(slot.control)
    monkeypatch.setattr(panel, "study", object())
    with pytest.raises(ArgumentError, match="the world of a study does not go back"):
        await panel.go_back(slot.control, time)


def look(control: Control) -> float:
    """Keep the world of now, as a page does that looks at it, and return its time, s."""
    found = control.snapshot().time
    control.keep()
    return found


def place(control: Control) -> tuple[float, float, float]:
    pose = control.snapshot().robots[0].pose
    return pose.x, pose.y, pose.heading


async def test_a_world_goes_back_when_its_robots_stand_and_nothing_sent_before_moves_them_after(panel: Panel) -> None:
    one, two, elsewhere = await connected(panel, f"{SIM}&robots=2&robot=1", f"{SIM}&robots=2&robot=2", f"{SIM}&seed=3")
    control = one.control
    assert control
    one.drive.steer("page-1", 1, 0.5)
    elsewhere.drive.steer("page-1", 1, 1)
    two.runner.start("avoid", {"cruise": 0.5})
    await until(lambda: two.drive.may_move)
    await asyncio.sleep(0.1)
    time, was = look(control), control.snapshot()
    for _ in range(10):
        await asyncio.sleep(0.1)
        one.drive.steer("page-1", 1, 0.5)
        elsewhere.drive.beat("page-1")
    assert control.world.pose(0).x != pytest.approx(was.robots[0].pose.x, abs=0.01)
    one.drive.steer("page-1", -1, 1)  # not sent yet
    await panel.go_back(control, time)
    for _ in range(5):
        one.drive.steer("page-1", 1, 0.5)  # a stick that is still held: it has to be let go first
        elsewhere.drive.beat("page-1")
        assert control.world.wheel_speeds(0) == control.world.wheel_speeds(1) == (0, 0)
        for now, before in zip(control.snapshot().robots, was.robots, strict=True):
            assert now.pose == before.pose
        await asyncio.sleep(0.1)
    assert not two.runner.is_active
    assert elsewhere.drive.may_move


async def test_a_world_whose_robot_does_not_confirm_that_it_stands_does_not_go_back(panel: Panel) -> None:
    (slot,) = await connected(panel, SIM)
    assert slot.control
    time = look(slot.control)
    slot.drive.steer("page-1", 1, 1)
    await asyncio.sleep(0.2)
    slot.control.set_faults(0, loss=1.0)
    before = place(slot.control)
    with pytest.raises(LinkLost, match=f"did not go back: {re.escape(SIM)} did not confirm that it stands"):
        await panel.go_back(slot.control, time)
    assert place(slot.control)[0] >= before[0]
    with pytest.raises(ArgumentError, match="does not know how it was"):
        await panel.go_back(slot.control, time - 1)


def test_a_paused_world_goes_back_and_is_paused_as_before() -> None:
    async def story() -> None:  # simulated time cannot be paused
        panel = Panel()
        (slot,) = await connected(panel, "sim://square")
        assert slot.control
        time, was = look(slot.control), place(slot.control)
        await slot.robot.set_speed(0.3, 0.3)
        await until(lambda: slot.control and place(slot.control)[0] > was[0] + 0.01)
        slot.control.pause()
        await panel.go_back(slot.control, time)
        assert slot.control.simulation.clock.is_paused
        assert place(slot.control) == was
        assert slot.control.world.wheel_speeds(0) == (0, 0)
        await panel.close()

    asyncio.run(story())


async def test_a_world_keeps_a_minute_and_of_many_robots_fewer_moments(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(past, "MAX_KEPT", 1200)
    for robots, gap in ((1, 1 / 16), (20, 17 / 16)):
        world, kept, times = World(Scene(2, 2), robots=robots), past.Past(), [-math.inf]
        for _ in range(100 * 16):
            world.run(4)
            if past.is_due(robots, world.time, times[-1]):
                kept.keep(world)
                times.append(world.time)
        assert min(later - time for time, later in pairwise(times)) == pytest.approx(gap)
        assert kept.at(41).time == pytest.approx(41, abs=gap)
        with pytest.raises(ArgumentError, match=r"does not know how it was at 37\.0 s"):
            kept.at(37)
        assert len(kept._moments) * robots <= 1200
    world.reset()
    assert past.is_due(20, world.time, times[-1])
    kept.keep(world)
    with pytest.raises(ArgumentError) as refused:
        kept.at(41)
    assert refused.value.hint == "it knows 0.0 to 0.0 s"
