"""The page of an environment that a program learns in: it shows every step, and changes nothing."""

from __future__ import annotations

import asyncio
import copy
import struct
from collections.abc import Iterator

import pytest
from page_rig import opened

from elib.learn.liveview import LiveView
from elib.simulator.physics import Box, Scene, World
from shared import needs_page, until

pytestmark = needs_page

PERIOD = 0.05


@pytest.fixture
def world() -> World:
    return World(Scene(0.6, 0.6, boxes=(Box(0.1, 0.1, 0.1, 0.1),), step=1 / 40, name="first"), robots=2, seed=3)


@pytest.fixture
def view() -> Iterator[LiveView]:
    view = LiveView(PERIOD)
    yield view
    view.close()
    view.close()


async def url_of(view: LiveView, world: World, capsys, monkeypatch) -> str:
    monkeypatch.setenv("ELIB_BROWSER", "no")
    await asyncio.to_thread(view.show, copy.deepcopy(world), is_new=True)
    word, url = capsys.readouterr().err.split()
    assert word == "view"
    return url


def time_of(frame: bytes) -> float:
    return struct.unpack_from("<IIdI", frame)[2]


async def test_the_page_shows_every_step_and_every_new_episode(world, view, capsys, monkeypatch) -> None:
    async with opened(await url_of(view, world, capsys, monkeypatch)) as page:
        await page.ask("subscribe", what="world", rate=25)
        await until(lambda: page.frames)
        scene = page.of("scene")[0]["scene"]
        assert (scene["world"], scene["robots"], len(scene["boxes"])) == ("first", 2, 1)
        await page.ask("subscribe", what="overview")
        await until(lambda: any(each.get("worlds") for each in page.of("update")))
        world.run(4)
        await asyncio.to_thread(view.show, copy.deepcopy(world))
        await until(lambda: time_of(page.frames[-1]) == world.time)
        await asyncio.to_thread(view.show, World(Scene(0.5, 0.5, name="second"), robots=1), is_new=True)
        await until(lambda: len(page.of("scene")) == 2)
        assert page.of("scene")[1]["scene"]["world"] == "second"


async def test_the_page_tells_what_a_robot_reads(world, view, capsys, monkeypatch) -> None:
    world.set_step_rates(1, 400, 300)
    world.run(40)
    async with opened(await url_of(view, world, capsys, monkeypatch)) as page:
        await page.ask("subscribe", what="world", rate=25)
        await page.ask("subscribe", what="readings", of="1")
        await until(lambda: page.of("readings"))
        told = page.of("readings")[-1]
        assert told["encoders"] == list(world.encoders(1))
        assert len(told["proximity"]) == 8


async def test_the_page_can_change_nothing(world, view, capsys, monkeypatch) -> None:
    before = world.hash()
    async with opened(await url_of(view, world, capsys, monkeypatch)) as page:
        assert not any(page.hello["can"].values())
        for what, values in {
            "move_robot": {"robot": 0, "x": 0.3, "y": 0.3},
            "move_box": {"box": 0, "x": 0.3, "y": 0.3},
            "set_ambient": {"ambient": 100},
            "pause": {},
            "set_speed": {"speed": 2},
            "cut": {"robot": 0},
            "go_back": {"time": 0},
        }.items():
            refused = await page.ask(what, **values)
            assert not refused["ok"]
            assert refused["error"]["message"].startswith("this page cannot ")
        await page.ask("subscribe", what="world")
        await until(lambda: page.frames)
    assert world.hash() == before


async def test_steps_take_as_long_as_in_reality(world, view, capsys, monkeypatch) -> None:
    await url_of(view, world, capsys, monkeypatch)
    loop = asyncio.get_running_loop()
    began = loop.time()
    for _ in range(5):
        await asyncio.to_thread(view.show, world)
    assert loop.time() - began > 3.9 * PERIOD
