"""The live view on the wire: what it serves, to whom, and that it costs the simulation nothing it need not."""

import asyncio
import json
import re
import sys
from collections.abc import AsyncIterator

import pytest

pytest.importorskip("websockets", reason="the extra web is not installed: pip install '.[web]'")

from elib.view.live import AHEAD, MOST_PAGES, watchable
from live_rig import PAINT, PATIENCE, ROOM, Page, Rig, opened, watched
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosedError, InvalidStatus

from elib.emulator.server import serve
from elib.emulator.settings import SimulationSettings
from elib.errors import LinkBusy, SimulationError, Unsupported
from elib.transport import open_transport
from elib.view import wire


@pytest.fixture
async def rig(tmp_path) -> AsyncIterator[Rig]:
    async with watched(tmp_path) as rig:
        yield rig


@pytest.fixture
async def page(rig) -> AsyncIterator[Page]:
    async with opened(rig) as page:
        yield page


async def get(rig: Rig, path: str, host: str | None = None) -> tuple[int, dict[str, str], bytes]:
    """Ask for a file as a browser does."""
    reader, writer = await asyncio.open_connection(*rig.host.split(":"))
    writer.write(f"GET {path} HTTP/1.1\r\nHost: {rig.host if host is None else host}\r\n\r\n".encode())
    async with asyncio.timeout(PATIENCE):
        answer = await reader.read()
    writer.close()
    head, _, body = answer.partition(b"\r\n\r\n")
    first, *lines = head.decode().split("\r\n")
    headers = {name.lower(): value for name, _, value in (line.partition(": ") for line in lines)}
    return int(first.split()[1]), headers, body


async def test_the_page_and_its_parts_come_from_here_and_name_no_other_place(rig):
    status, headers, body = await get(rig, "/")
    assert status == 200
    assert headers["content-type"] == "text/html; charset=utf-8"
    assert "default-src 'self'" in headers["content-security-policy"]
    parts = re.findall(rb'(?:href|src)="([^"]+)"', body)
    assert {b"style.css", b"main.js", b"icon.svg"} <= set(parts)
    seen = {"main.js"}
    waiting = [f"/{part.decode()}" for part in parts]
    while waiting:
        path = waiting.pop()
        status, headers, body = await get(rig, path)
        assert status == 200, path
        assert int(headers["content-length"]) == len(body)
        imported = re.findall(rb'from "\./([^"]+)"', body)
        waiting += [f"/{name.decode()}" for name in imported if name.decode() not in seen]
        seen |= {name.decode() for name in imported}
        assert set(re.findall(rb"https?://[^\"'` ]+", body)) <= {b"http://www.w3.org/2000/svg"}, path
    assert seen == {"main.js", "arena.js", "model.js", "panel.js", "robot.js", "wire.js"}


@pytest.mark.parametrize(
    "path", ["/nothing", "/../live.py", "/..%2flive.py", "//etc/passwd", "/main.js/", "/floor.png"]
)
async def test_what_is_no_part_of_the_page_is_not_there(rig, path):
    status, _, body = await get(rig, path)
    assert (status, body) == (404, b"there is no such page\n")


async def test_a_request_with_two_names_of_the_host_gets_nothing(rig):
    assert (await get(rig, "/", host=f"{rig.host}\r\nHost: {rig.host}"))[0] == 403


@pytest.mark.parametrize("host", ["example.org", "example.org:80", "", "127.0.0.1"])
async def test_a_page_that_calls_this_computer_by_another_name_gets_nothing(rig, host):
    assert (await get(rig, "/", host=host))[0] == 403


@pytest.mark.parametrize("origin", ["http://example.org", "null", None, "http://127.0.0.1:1"])
async def test_a_stranger_s_page_cannot_open_the_socket(rig, origin):
    with pytest.raises(InvalidStatus) as caught:
        async with connect(f"ws://{rig.host}/live", origin=origin):
            pass
    assert caught.value.response.status_code == 403


async def test_a_page_is_told_the_scene_and_then_sees_the_robots_where_the_world_has_them(rig, page):
    scene = await page.hear("scene")
    assert (scene["world"], scene["width"], scene["depth"], scene["robots"]) == ("room", 1.2, 0.8, 2)
    assert scene["walls"] == [[0.6, 0.0, 0.6, 0.2, "#204060"]]
    assert scene["boxes"][0]["colour"] == "#d04030"
    assert scene["boxes"][0]["pushable"] is True
    assert [len(scene[what]) for what in ("cylinders", "lights", "sounds", "leds")] == [1, 1, 1, 8]
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
    assert (await page.ask(do="cut", robot=0))["ok"]
    async with asyncio.timeout(PATIENCE):
        while not (await page.frame()).bits[0] & 8:
            pass
    await robot.close()


async def test_rays_come_when_they_are_wanted_and_start_at_the_robots(page):
    assert (await page.ask(do="rays", on=True, id=3)) == {"ok": True, "id": 3}
    async with asyncio.timeout(PATIENCE):
        while not (frame := await page.frame()).rays:
            pass
    assert len(frame.rays) == 16
    for k, (x, y, *_, strength) in enumerate(frame.rays):
        centre = frame.poses[k // 8]
        assert ((x - centre[0]) ** 2 + (y - centre[1]) ** 2) ** 0.5 == pytest.approx(0.035, abs=0.003)
        assert 0 <= strength <= 1


async def test_who_watches_a_robot_gets_its_readings(page):
    assert (await page.ask(do="watch", robot=1))["ok"]
    readings = await page.hear("readings")
    assert readings["robot"] == 1
    assert len(readings["proximity"]) == 8
    assert readings["encoders"] == [0, 0]
    assert readings["link"] == {"connected": False, "cut": False, "latency": 0.0, "jitter": 0.0, "loss": 0.0}
    assert (await page.ask(do="watch", robot=None))["ok"]


async def test_looking_on_leaves_the_world_s_hash_as_it_was(rig):
    rig.control.simulation.catch_up()
    before = rig.control.world.hash()
    seen = rig.control.world.snapshot(beams=True)
    wire.frame(seen, 1, rig.control.is_cut)
    wire.readings(rig.control, seen, 0)
    assert rig.control.world.hash() == before


async def test_what_is_moved_or_lit_otherwise_is_told_once(rig, page):
    await page.hear("scene")
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
    assert set(await page.hear("change")) == {"kind", "cylinders"}


async def test_a_page_moves_things_through_the_door_and_hears_what_has_no_room(rig, page):
    assert await page.ask(do="move_robot", robot="epuck-1", x=0.3, y=0.3, id=9) == {"id": 9, "ok": True}
    assert rig.control.world.pose(0).x == 0.3
    refused = await page.ask(do="move_robot", robot="epuck-1", x=0.8, y=0.5)
    assert refused["error"].endswith("epuck-2 is in the way")


@pytest.mark.parametrize(
    "text",
    [
        "nonsense",
        "[]",
        '{"do": "rays", "on": 1}',
        '{"do": "watch", "robot": 2}',
        '{"do": "watch", "robot": true}',
        '{"do": "watch"}',
        '{"do": "fly"}',
    ],
)
async def test_a_message_with_a_mistake_is_answered_and_the_view_goes_on(page, text):
    await page.socket.send(text)
    assert (await page.hear("reply"))["ok"] is False
    await page.socket.send(b"no number of a frame")
    assert (await page.frame()).poses


async def test_a_message_beyond_all_measure_ends_that_page_and_no_other(rig, page):
    async with opened(rig) as other:
        await other.hear("scene")
        await other.socket.send("x" * 10_000)
        with pytest.raises(ConnectionClosedError) as caught:
            await other.hear("never")
        assert caught.value.rcvd.code == 1009
    assert (await page.frame()).poses


async def test_a_page_that_draws_nothing_gets_no_more_frames_and_then_the_newest(rig, page):
    for _ in range(AHEAD):
        last = await page.frame(draw=False)
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.15):
            await page.frame(draw=False)
    began = rig.control.world.tick
    await page.socket.send(last.number.to_bytes(4, "little"))
    newest = await page.frame()
    assert newest.number == last.number + 1, "none was made for nobody"
    assert newest.time >= began * rig.control.world.scene.step


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
    await asyncio.sleep(0.1)
    assert made == []
    async with opened(rig) as page:
        await page.frame()
    assert made


async def test_only_so_many_pages_at_once(rig):
    pages = [await connect(f"ws://{rig.host}/live", origin=f"http://{rig.host}") for _ in range(MOST_PAGES)]
    for each in pages:
        assert json.loads(await each.recv())["kind"] == "scene"
    with pytest.raises(InvalidStatus) as caught:
        async with opened(rig):
            pass
    assert caught.value.response.status_code == 503
    for each in pages:
        await each.close()


async def test_a_painted_floor_is_sent_as_a_picture_north_up(tmp_path):
    from io import BytesIO

    from PIL import Image

    async with watched(tmp_path, world=ROOM + PAINT) as rig:
        async with opened(rig) as page:
            floor = (await page.hear("scene"))["floor"]
        assert floor["picture"] is True
        assert floor["colour"] == "#205030"
        assert (floor["width"], floor["depth"]) == pytest.approx((1.2, 0.8), abs=0.003)
        status, headers, body = await get(rig, "/floor.png")
        assert (status, headers["content-type"]) == (200, "image/png")
        picture = Image.open(BytesIO(body)).convert("RGB")
    stripe = round(picture.height * (1 - 0.3 / 0.8))
    assert picture.getpixel((picture.width // 2, stripe)) == (255, 0, 0)
    assert picture.getpixel((picture.width // 2, picture.height - stripe)) == (0x20, 0x50, 0x30)


async def test_leaving_ends_the_pages_and_frees_the_port(tmp_path):
    async with watched(tmp_path) as rig, opened(rig) as page:
        await page.hear("scene")
    with pytest.raises(ConnectionRefusedError):
        await asyncio.open_connection(*rig.host.split(":"))


async def test_a_taken_port_constant_readings_and_a_missing_package_are_said(rig, tmp_path, monkeypatch):
    with pytest.raises(LinkBusy, match="is taken"):
        async with watchable(rig.control, rig.host):
            pass
    path = tmp_path / "readings.json"
    path.write_text("{}")
    doors = []
    async with serve(SimulationSettings(hardware=str(path)), tcp="0", control=doors.append):
        with pytest.raises(SimulationError, match="no world"):
            async with watchable(doors[0], "0"):
                pass
    monkeypatch.setitem(sys.modules, "websockets.asyncio.server", None)
    with pytest.raises(Unsupported, match=r'pip install "\.\[web\]"'):
        async with watchable(rig.control, "0"):
            pass
