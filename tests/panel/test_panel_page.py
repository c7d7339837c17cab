"""What becomes of the robots when pages do things at the same time, or leave."""

from __future__ import annotations

import asyncio
import gc
import os
from pathlib import Path

from guard_rig import guarded
from local_network import LocalLoop
from page_rig import opened

import elib
from elib.base.pose import Pose
from elib.panel.files import Folder
from elib.records.timeline import KINDS
from shared import needs_page, until

pytestmark = needs_page

# clock: simulated
LOOP = LocalLoop


async def test_a_tab_that_is_closed_by_two_fast_clicks_is_closed_once() -> None:
    complaints: list[dict[str, object]] = []
    asyncio.get_running_loop().set_exception_handler(lambda loop, context: complaints.append(context))
    async with guarded(urls=["sim://"]) as rig, opened(rig.url) as page:
        key = await page.connected()
        first, second = await asyncio.gather(page.ask("remove", robot=key), page.ask("remove", robot=key))
        assert first["ok"]
        assert (second["ok"], second["error"]["message"]) == (False, "there is no such robot in the panel")
        await until(lambda: not page.robots)
        gc.collect()
        assert complaints == []
        assert not rig.panel.slots


async def test_a_page_that_shows_a_robot_which_another_page_takes_out_is_told_of_the_rest() -> None:
    async with guarded(urls=["sim://", "sim://line"]) as rig, opened(rig.url) as one, opened(rig.url) as other:
        assert await one.connected() == "1"
        await one.ask("subscribe", what="overview")
        assert (await other.ask("remove", robot="1"))["ok"]
        await until(lambda: [robot["key"] for robot in one.robots] == ["2"])
        seen = len(one.heard)
        await until(lambda: any(list(each.get("overview", ())) == ["2"] for each in one.heard[seen:]))
        assert not any("robot" in each for each in one.heard[seen:])


async def test_a_page_that_shows_another_robot_stops_the_one_that_it_drove() -> None:
    async with guarded(urls=["sim://", "sim://line"]) as rig, opened(rig.url) as page:
        drive = rig.panel.slots[await page.connected()].drive
        await page.ask("steer", robot="1", left=1, right=1)
        assert (await page.ask("subscribe", what="robot", of="1", rate=2))["ok"]
        assert drive.driver
        await page.ask("subscribe", what="robot", of="2")
        assert not drive.driver
        await until(lambda: not drive.may_move)
        await until(lambda: page.of("update")[-1]["place"] == "2")


async def test_a_page_that_leaves_stops_what_it_drove() -> None:
    async with guarded(urls=["sim://"]) as rig:
        async with opened(rig.url) as page:
            key = await page.connected()
            slot = rig.panel.slots[key]
            await page.ask("steer", robot=key, left=1, right=1)
            await until(lambda: slot.drive.may_move)
        await until(lambda: not slot.drive.may_move)
        assert slot.drive.driver == ""


async def test_what_a_page_sent_while_the_program_ends_is_not_carried_out() -> None:
    async with guarded(urls=["sim://"]) as rig, opened(rig.url) as page:
        key = await page.connected()
        rig.panel.is_ending = True
        await page.tell("steer", robot=key, left=1, right=1)
        await page.tell("add", url="sim://line")
        assert (await page.ask("find"))["error"]["kind"] == "LinkClosed"
        assert len(rig.panel.slots) == 1
        assert not rig.panel.slot(key).drive.driver


async def test_a_page_is_told_a_title_for_lines_of_each_kind_also_those_of_a_recorder() -> None:
    async with guarded(urls=["sim://"]) as rig, opened(rig.url) as page:
        kinds = {*KINDS, "panel"}  # those of recordings, and the panel's own
        assert kinds <= page.hello["kinds"].keys()
        assert all(page.hello["kinds"].values())


async def test_a_map_of_what_a_robot_met_is_saved_as_a_picture_and_as_a_world() -> None:
    async with guarded(urls=["sim://"]) as rig, opened(rig.url) as page:
        key = await page.connected()
        refused = await page.ask("save_map", robot=key, name="room")
        assert refused["error"]["message"] == "there is no wall on the map yet"
        grid = rig.panel.slots[key].watcher.map = elib.Grid()
        for _ in range(5):
            grid.add(Pose(0, 0, 0), [0.03] * 8)
        saved = await page.ask("save_map", robot=key, name="room")
        folder = rig.panel.folder.path
        assert saved["result"] == {"name": "room.png", "url": f"sim://{folder / 'room-world.toml'}"}
        assert (elib.Grid.open(folder / "room.png").occupied == grid.occupied).all()
        assert elib.Grid.of_world(folder / "room-world.toml").occupied.sum() >= grid.occupied.sum()
        again = await page.ask("save_map", robot=key, name="room")
        assert again["error"]["hint"] == "'room-2.png' is free"


async def test_a_page_opens_and_a_log_begins_in_a_folder_whose_name_is_not_utf_8(tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"d\xff")
    folder.mkdir()
    async with guarded(urls=["sim://"]) as rig:
        rig.panel.folder = Folder(folder)
        async with opened(rig.url) as page:
            key = await page.connected()
            assert page.hello["folder"] == str(folder)
            assert (await page.ask("start_log", robot=key, name="run"))["ok"]
            await until(lambda: page.tick["log"] == str(folder / "run.log"))
