"""A world as a page is told of it: what is served, to whom, and that it costs the simulation nothing it need not."""

import asyncio
import base64
import json
from collections.abc import AsyncIterator
from dataclasses import replace

import pytest
from world_page_rig import PAINT, ROOM, Page, Rig, opened, watched

from elib.link.transport import open_transport
from elib.panel.server import world
from elib.panel.server.page import AHEAD
from elib.simulator.worlds.files import load_file
from shared import PATIENCE, needs_page, until

pytestmark = needs_page


@pytest.fixture
async def rig(tmp_path) -> AsyncIterator[Rig]:
    async with watched(tmp_path) as rig:
        yield rig


@pytest.fixture
async def page(rig) -> AsyncIterator[Page]:
    async with opened(rig) as page:
        yield page


async def test_a_page_is_told_the_scene_and_then_sees_the_robots_where_the_world_has_them(rig, page):
    scene = await page.scene()
    assert (scene["world"], scene["width"], scene["depth"], scene["robots"]) == ("room", 1.2, 0.8, 2)
    assert scene["names"] == list(rig.control.names) == ["epuck-1", "epuck-2"]
    assert scene["own"] is None
    assert scene["clock"] == {"paused": False, "speed": 1.0, "fixed": ""}
    assert scene["walls"] == [[0.6, 0.0, 0.6, 0.2, "#204060", 0.1, []]]
    assert scene["boxes"][0]["colour"] == "#d04030"
    assert (scene["boxes"][0]["height"], scene["cylinders"][0]["height"]) == (0.1, 0.1)
    assert scene["boxes"][0]["pushable"] is True
    assert [len(scene[what]) for what in ("cylinders", "lights", "sounds")] == [1, 1, 1]
    frame = await page.frame()
    for seen, pose in zip(frame.poses, rig.control.world.poses, strict=True):
        assert seen == pytest.approx((pose.x, pose.y, pose.heading))
    assert frame.rays == []


async def test_frames_show_motion_lamps_and_a_cut_link(rig, page):
    robot = await open_transport(rig.robots[0].url)
    await robot.write(b"D,500,500\rL,0,1\rB,1\r")
    first = await page.frame()
    async with asyncio.timeout(PATIENCE):
        while (frame := await page.frame()).poses[0][0] < first.poses[0][0] + 0.01:
            pass
    assert frame.time > first.time
    assert frame.number > first.number
    assert frame.rings[0][:3] != bytes(3)
    assert frame.rings[0][3:] == bytes(21)
    assert [bits & 2 for bits in frame.bits] == [2, 0]
    assert (await page.ask("cut", robot=0))["ok"]
    async with asyncio.timeout(PATIENCE):
        while not (await page.frame()).bits[0] & 8:
            pass
    await robot.close()


async def test_rays_come_when_they_are_wanted_and_start_at_the_robots(page):
    assert (await page.ask("subscribe", what="world", rate=25, rays=True))["ok"]
    async with asyncio.timeout(PATIENCE):
        while not (frame := await page.frame()).rays:
            pass
    assert len(frame.rays) == 16
    for k, (x, y, *_, strength) in enumerate(frame.rays):
        centre = frame.poses[k // 8]
        assert ((x - centre[0]) ** 2 + (y - centre[1]) ** 2) ** 0.5 == pytest.approx(0.035, abs=0.003)
        assert 0 <= strength <= 1


async def test_who_watches_a_robot_gets_its_readings(page):
    assert (await page.ask("subscribe", what="readings", of="1"))["ok"]
    readings = await page.hear("readings")
    assert readings["robot"] == 1
    assert len(readings["proximity"]) == 8
    assert readings["encoders"] == [0, 0]
    link = {"connected": False, "cut": False, "latency": 0.0, "jitter": 0.0, "loss": 0.0, "script": []}
    assert readings["link"] == {**link, "broken": []}
    assert readings["base"] == {"latency": 0.0, "jitter": 0.0, "loss": 0.0}
    assert (readings["selector"], readings["button"]) == (3, None)
    assert (await page.ask("subscribe", what="readings", rate=0))["ok"]


async def test_what_a_fault_script_does_is_told(tmp_path):
    script = tmp_path / "script.toml"
    script.write_text('description = "Slow."\n[[fault]]\nkind = "delay"\ndelay = 0.02\n')
    async with watched(tmp_path, fault=str(script), loss=0.125) as rig, opened(rig) as page:
        robot = await open_transport(rig.robots[0].url)
        await robot.write(b"E\r")
        await page.say("subscribe", what="readings", of="0")
        async with asyncio.timeout(PATIENCE):
            while not (readings := await page.hear("readings"))["link"]["script"]:
                pass
        assert readings["link"]["script"] == ["delay"]
        assert (readings["link"]["loss"], readings["base"]["loss"]) == (0, 0.125)
        await robot.close()


async def test_looking_on_shows_what_the_robot_reads_and_leaves_the_world_s_hash_as_it_was(rig):
    rig.control.simulation.catch_up()
    before = rig.control.world.hash("proximity")
    seen = rig.control.world.snapshot(beams=True)
    world.frame(seen, 1, rig.control.is_cut, rays=True)
    shown = world.readings(rig.control, seen, 0).proximity
    assert rig.control.world.hash("proximity") == before
    assert shown == rig.control.world.proximity(0)
    assert all(shown), "a typical robot reads 0 nowhere"


async def test_what_is_moved_or_lit_otherwise_is_told_once(rig, page):
    await page.scene()
    rig.control.move_box(0, 0.9, 0.25)
    rig.control.set_light(0, intensity=4)
    rig.control.set_ambient(777)
    told = {}
    async with asyncio.timeout(PATIENCE):
        while not {"boxes", "lights", "ambient"} <= set(told):
            told |= await page.hear("change")
    assert told["boxes"] == [[0, 0.9, 0.25, 0.0]]
    assert told["lights"][0][1]["intensity"] == 4
    assert told["ambient"] == 777
    await page.frame()
    rig.control.move_cylinder(0, 0.25, 0.6)
    assert set(await page.hear("change")) == {"type", "channel", "cylinders"}


async def test_a_page_moves_things_and_hears_what_has_no_room(rig, page):
    assert (await page.ask("move_robot", robot="epuck-1", x=0.3, y=0.3))["result"] is None
    assert rig.control.world.pose(0).x == 0.3
    refused = await page.ask("move_robot", robot="epuck-1", x=0.8, y=0.5)
    assert refused["error"]["message"].endswith("epuck-2 is in the way")


async def test_boxes_and_walls_come_and_go_on_every_page(rig, page):
    await page.scene()
    async with opened(rig) as other:
        await other.scene()
        added = await page.ask("add_box", x=0.3, y=0.15, width=0.05, depth=0.06, angle=0.5, pushable=False)
        assert added["result"] == 1
        for each in (page, other):
            told = await each.hear("change")
            assert [(box["x"], box["width"], box["pushable"]) for box in told["all_boxes"]][1] == (0.3, 0.05, False)
        assert (await page.ask("add_wall", x1=0.9, y1=0.6, x2=1.1, y2=0.6))["result"] == 1
        assert [wall[:4] for wall in (await other.hear("change"))["walls"]][1] == [0.9, 0.6, 1.1, 0.6]
        refused = await page.ask("add_box", x=0.8, y=0.5)
        assert "epuck-2 is in the way" in refused["error"]["message"]
        assert (await page.ask("remove_box", box=0))["ok"]
        assert [box["x"] for box in (await other.hear("change"))["all_boxes"]] == [0.3]
        assert (await page.ask("remove_wall", wall=0))["ok"]
        assert len((await other.hear("change"))["walls"]) == 1
    assert "there is no wall 5" in (await page.ask("remove_wall", wall=5))["error"]["message"]


async def test_a_world_goes_back_to_a_frame_that_a_page_was_sent_and_every_page_sees_it(rig, page):
    await page.scene()
    async with opened(rig) as other:
        await other.scene()
        seen = await page.frame()
        assert seen.is_kept
        was = rig.control.world.moment()
        rig.control.move_robot(0, 0.3, 0.15, 2.0)
        rig.control.move_cylinder(0, 0.25, 0.6)
        rig.control.set_light(0, intensity=4)
        rig.control.set_ambient(777)
        rig.control.remove_box(0)
        rig.control.add_box(0.5, 0.7, width=0.05)  # as many as before, but another one
        rig.control.add_wall(0.9, 0.6, 1.1, 0.6)
        async with asyncio.timeout(PATIENCE):
            while len((await other.hear("change")).get("walls", ())) != 2:
                pass
        assert (await page.ask("go_back", time=seen.time)) == {"type": "answer", "id": 1, "ok": True, "result": None}
        assert replace(rig.control.world.moment(), time=was.time) == was
        told = {}
        async with asyncio.timeout(PATIENCE):
            while not {"all_boxes", "walls", "cylinders", "lights", "ambient"} <= set(told):
                told |= await other.hear("change")
        assert [(box["x"], box["width"]) for box in told["all_boxes"]] == [(1.0, 0.12)]
        assert (len(told["walls"]), told["cylinders"]) == (1, [[0, 0.2, 0.6]])
        assert (await other.frame()).poses[0] == pytest.approx(seen.poses[0])
        assert rig.control.world.time > seen.time


async def test_a_moment_that_the_world_does_not_know_is_refused_with_those_that_it_does(rig):
    await until(lambda: rig.control.snapshot().time > 0.3)  # there is a time before the first page
    async with opened(rig) as page:
        await page.scene()
        first = await page.frame()
        rig.control.move_box(0, 0.9, 0.25)
        was = rig.control.world.moment()
        for time in (first.time - 0.2, first.time + 1e6):
            refused = (await page.ask("go_back", time=time))["error"]
            assert refused["message"] == f"the world does not know how it was at {time:.1f} s"
            assert refused["hint"].startswith(f"it knows {first.time:.1f} to ")
        elsewhere = (await page.ask("go_back", time=first.time, channel=7))["error"]
        assert elsewhere["message"] == "there is no virtual world here"
        assert rig.control.world.moment().boxes == was.boxes


async def test_robots_of_other_programs_drive_on_from_where_they_are_put_back(rig, page):
    robot = await open_transport(rig.robots[0].url)
    await robot.write(b"D,500,500\r")
    first = await page.frame()
    async with asyncio.timeout(PATIENCE):
        while (await page.frame()).poses[0][0] < first.poses[0][0] + 0.01:
            pass
    wheels = rig.control.world.wheel_speeds(0)
    assert (await page.ask("go_back", time=first.time))["ok"]
    assert rig.control.world.wheel_speeds(0) == wheels != (0, 0)
    await robot.close()


async def test_a_paused_world_stands_still_and_every_page_says_so(rig, page):
    await page.scene()
    async with opened(rig) as other:
        await other.scene()
        assert (await page.ask("pause"))["ok"]
        assert (await other.hear("change"))["clock"] == {"paused": True, "speed": 1.0, "fixed": ""}
        time = (await other.frame()).time
        for _ in range(3 * AHEAD):
            assert (await other.frame()).time == time
        assert (await page.ask("step", seconds=0.25))["ok"]
        assert rig.control.snapshot().time == pytest.approx(time + 0.25, abs=0.02)
        assert (await page.ask("set_speed", speed=4))["ok"]
        assert (await page.ask("resume"))["ok"]
        assert (await page.ask("step"))["error"]["message"] == "only a paused world can be stepped"
        assert rig.control.simulation.clock.rate == 4
        began = rig.control.snapshot().time
        await until(lambda: rig.control.snapshot().time > began + 0.5)


async def test_a_world_is_saved_as_it_stands_and_opens_again_equal(rig, page, tmp_path):
    rig.control.move_robot(0, 0.3, 0.3, 1.0)
    rig.control.add_wall(0.9, 0.6, 1.1, 0.6)
    rig.control.set_ambient(2000)
    rig.control.set_light(0, intensity=4)
    saved = await page.ask("save_world", name="mine", about="My room.")
    assert saved["result"]["name"] == "mine.toml"
    path = tmp_path / "mine.toml"
    assert saved["result"]["url"] == f"sim://{path.resolve()}"
    file = load_file(str(path))
    assert file.about == "My room."
    wanted = rig.control.scene()
    assert (file.scene.walls, file.scene.boxes, file.scene.lights) == (wanted.walls, wanted.boxes, wanted.lights)
    assert file.scene.model.ambient == 2000
    assert [(pose.x, pose.y) for pose in file.scene.starts] == [(0.3, 0.3), (0.8, 0.5)]
    assert file.scene.starts[0].heading == pytest.approx(1.0, abs=1e-12)
    for name in ("mine", "../mine", "mine.log", ""):
        refused = await page.ask("save_world", name=name)
        assert refused["ok"] is False


async def test_a_hand_turns_the_selector_and_presses_the_remote_control(rig, page):
    assert (await page.ask("turn_selector", robot=0, position=9))["ok"]
    assert (await page.ask("press_remote", robot=0, key=5))["ok"]
    hardware = rig.control.hardware(0)
    assert hardware.selector() == 9
    assert hardware.infrared()[1:] == (0, 5)
    assert "has no button" in (await page.ask("press_button", robot=0))["error"]["message"]


async def test_a_page_that_draws_nothing_gets_no_more_frames_and_then_the_newest(rig, page):
    for _ in range(AHEAD):
        last = await page.frame(draw=False)
    async with opened(rig) as other:
        for _ in range(5):
            await other.frame()
    await page.say("stop", id=99)
    async with asyncio.timeout(PATIENCE):
        while isinstance(message := await page.socket.recv(), str) and json.loads(message)["type"] != "answer":
            pass
    assert isinstance(message, str), "a frame came while another page was sent five"
    began = rig.control.world.tick
    await page.drawn(last)
    newest = await page.frame()
    assert newest.number == last.number + 1, "none was made for nobody"
    assert newest.time >= began * rig.control.world.scene.step


async def test_a_page_shows_several_worlds_each_on_a_channel_of_its_own_and_as_often_as_it_wants(rig, page):
    await page.scene()
    await page.ask("subscribe", what="world", rate=5, channel=7)
    assert (await page.hear("scene"))["channel"] == 7
    async with asyncio.timeout(PATIENCE):
        while (await page.frame()).channel != 7:
            pass
    await page.ask("subscribe", what="world", rate=0)
    rig.control.move_box(0, 0.9, 0.25)
    while (told := await page.hear("change"))["channel"] != 7:
        pass
    assert told["boxes"] == [[0, 0.9, 0.25, 0.0]]
    refused = await page.ask("pause")
    assert refused["error"]["message"] == "there is no virtual world here"
    assert (await page.ask("pause", channel=7))["ok"]


async def test_a_slow_page_does_not_hold_up_a_quick_one(rig, page):
    async with opened(rig) as slow:
        for _ in range(AHEAD):
            await slow.frame(draw=False)
        numbers = [(await page.frame()).number for _ in range(5)]
        assert numbers == sorted(set(numbers))


async def test_while_nobody_looks_no_frame_is_made(rig, monkeypatch):
    made = []
    snapshot = rig.control.snapshot
    monkeypatch.setattr(rig.control, "snapshot", lambda **keys: made.append(keys) or snapshot(**keys))
    began = rig.control.world.time
    await until(lambda: rig.control.simulation.catch_up() or rig.control.world.time > began + 0.3)
    assert made == []
    async with opened(rig) as page:
        await page.frame()
    assert made


async def test_a_painted_floor_is_sent_as_a_picture_north_up(tmp_path):
    from io import BytesIO

    from PIL import Image

    async with watched(tmp_path, world=ROOM + PAINT) as rig, opened(rig) as page:
        scene = await page.scene()
    floor = scene["floor"]
    assert floor["colour"] == "#205030"
    assert (floor["width"], floor["depth"]) == pytest.approx((1.2, 0.8), abs=0.003)
    kind, _, body = scene["floor_png"].partition(",")
    assert kind == "data:image/png;base64"
    picture = Image.open(BytesIO(base64.b64decode(body))).convert("RGB")
    stripe = round(picture.height * (1 - 0.3 / 0.8))
    assert picture.getpixel((picture.width // 2, stripe)) == (255, 0, 0)
    assert picture.getpixel((picture.width // 2, picture.height - stripe)) == (0x20, 0x50, 0x30)
