"""A person opens the panel's page in a real browser, drives a robot, and stops it."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("aiohttp", reason="the extra web is not installed: pip install '.[web]'")
pytest.importorskip("websockets", reason="the extra web is not installed: pip install '.[web]'")

from panel_rig import Driver, browser, far, needs_browser, panel, virtual_robot

from shared import needs_page

pytestmark = [needs_browser, needs_page]


async def test_a_person_connects_a_robot_drives_it_and_stops_it(tmp_path: Path) -> None:
    async with virtual_robot(tmp_path) as robot, panel(tmp_path) as address, browser() as open_page:
        person = Driver(await open_page(address))
        await person.tab.size(1440, 1000)
        await person.connect(robot.url)
        began = robot.pose
        await person.push(0, 1)
        await robot.until_it_moves()
        await person.key(" ", "Space")  # the stick is still held
        await robot.until_it_stands()
        assert robot.pose.x - began.x > 0.005
        await person.let_go()
        await person.key("s", "KeyS", kind="keyDown")
        stood = robot.pose
        await robot.until(lambda: far(stood, robot.pose) > 0.01)
        await person.key("s", "KeyS", kind="keyUp")
        await robot.until_it_stands()
        assert robot.pose.x < stood.x
        assert person.tab.complaints == []
        place = address.removeprefix("http://")
        own = (f"http://{place}", f"ws://{place}", "data:", "blob:")
        assert [each for each in person.tab.requests if not each.startswith(own)] == []
