"""The live view in a real browser: it shows the world as it is, and what is done there happens in the world."""

import asyncio
import math
from collections.abc import AsyncIterator, Awaitable, Callable

import pytest
import pytest_asyncio

pytest.importorskip("websockets", reason="the extra web is not installed: pip install '.[web]'")

from live_rig import Rig, watched

from browser import Tab, browser, needs_browser
from elib.transport import open_transport

pytestmark = [needs_browser, pytest.mark.slow, pytest.mark.asyncio(loop_scope="module")]

SIZE = 1000, 700
NOSE = (250, 250, 246)
"""Colour of the arrow on a robot (elib.view.robot)."""


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def open_page() -> AsyncIterator[Callable[[str], Awaitable[Tab]]]:
    """A browser: it takes a second to start, so the tests share it."""
    async with browser() as opener:
        yield opener


@pytest_asyncio.fixture(loop_scope="module")
async def rig(tmp_path) -> AsyncIterator[Rig]:
    async with watched(tmp_path) as rig:
        yield rig


@pytest_asyncio.fixture(loop_scope="module")
async def tab(rig, open_page) -> AsyncIterator[Tab]:
    """The page, with frames on the screen."""
    tab = await open_page(rig.url)
    await tab.size(*SIZE)
    await tab.until("window.elib?.model.frame?.number > 2")
    yield tab
    await tab.close()


async def pixel(tab: Tab, x: float, y: float) -> tuple[int, ...]:
    """Return the colour on the canvas at a place of the world, m."""
    data = await tab.run(
        f"(() => {{ const {{ arena }} = window.elib, at = arena.toPixel({x}, {y});"
        " const copy = document.createElement('canvas');"
        " arena.draw(); copy.width = copy.height = 1; const pen = copy.getContext('2d');"
        " pen.drawImage(arena.canvas, ...at.map((place) => -Math.round(place * arena.density)));"
        " return [...pen.getImageData(0, 0, 1, 1).data]; })()"
    )
    return tuple(data)[:3]


async def on_page(tab: Tab, x: float, y: float) -> tuple[float, float]:
    """Return where on the page a place of the world is, pixels."""
    left, top = await tab.run(
        f"(() => {{ const box = window.elib.arena.canvas.getBoundingClientRect(),"
        f" [left, top] = window.elib.arena.toPixel({x}, {y}); return [box.left + left, box.top + top]; }})()"
    )
    return left, top


async def drag(tab: Tab, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Take what is at a place of the world and put it at another."""
    (left, top), (right, bottom) = await on_page(tab, *start), await on_page(tab, *end)
    await tab.mouse("mousePressed", left, top)
    for share in (0.1, 0.4, 0.7, 1.0):
        await tab.mouse("mouseMoved", left + share * (right - left), top + share * (bottom - top))
    await tab.mouse("mouseReleased", right, bottom)


async def until(condition) -> None:
    """Wait until something is so in the simulation."""
    async with asyncio.timeout(30):
        while True:
            if condition():
                return
            await asyncio.sleep(0.02)


def is_at(thing, x: float, y: float, *, within: float = 0.01) -> bool:
    return math.dist((thing.x, thing.y), (x, y)) < within


async def choose(tab: Tab, key: str) -> None:
    """Choose a thing in the list."""
    await tab.run(
        f"(() => {{ const list = document.getElementById('thing'); list.value = '{key}';"
        " list.dispatchEvent(new Event('change')); })()"
    )


async def set_slider(tab: Tab, name: str, value: float) -> None:
    """Put a slider of the panel to a value."""
    await tab.run(
        f"(() => {{ const knob = document.getElementById('{name}'); knob.value = {value};"
        " knob.dispatchEvent(new Event('input')); })()"
    )


async def test_the_page_shows_the_world_without_a_complaint_and_asks_nobody_else(rig, tab):
    world = rig.control.world
    for index in range(2):
        pose = world.pose(index)
        # The middle of the arrow, and the ring behind it where the arrow is not.
        tip = 0.1 * 0.037
        assert await pixel(tab, pose.x + tip * math.cos(pose.heading), pose.y + tip * math.sin(pose.heading)) == NOSE
        back = -0.45 * 0.037
        assert await pixel(tab, pose.x + back * math.cos(pose.heading), pose.y + back * math.sin(pose.heading)) != NOSE
    assert await pixel(tab, 0.97, 0.2) == (0xD0, 0x40, 0x30)
    assert await pixel(tab, 0.3, 0.25) != NOSE
    rig.control.move_robot(0, 0.2, 0.2, math.pi)
    await tab.until("Math.abs(window.elib.model.frame.poses[0] - 0.2) < 1e-3")
    assert await pixel(tab, 0.2 - tip, 0.2) == NOSE
    assert await pixel(tab, 0.4, 0.4) != NOSE
    assert await tab.run("document.getElementById('state').textContent") == "live"
    assert await tab.run("document.getElementById('world').textContent") == "room"
    assert {url.partition("://")[2].partition("/")[0] for url in tab.requests} == {rig.host}
    assert tab.complaints == []


async def test_a_robot_is_dragged_to_another_place_and_never_into_something(rig, tab):
    await drag(tab, (0.4, 0.4), (0.3, 0.2))
    await until(lambda: is_at(rig.control.world.pose(0), 0.3, 0.2))
    assert await tab.run("document.getElementById('thing').value") == "robot:0"
    await drag(tab, (0.8, 0.5), (1.0, 0.2))
    await tab.until("document.getElementById('say').textContent.includes('is in the way')")
    assert not is_at(rig.control.world.pose(1), 1.0, 0.2, within=0.05)
    await drag(tab, (1.0, 0.2), (0.9, 0.1))
    await until(lambda: is_at(rig.control.snapshot().boxes[0], 0.9, 0.1))
    await drag(tab, (1.1, 0.7), (0.6, 0.6))
    await until(lambda: is_at(rig.control.snapshot().lights[0], 0.6, 0.6))
    assert tab.complaints == []


async def test_the_panel_switches_link_faults_and_lights_and_shows_readings(rig, tab):
    rig.control.move_robot(0, 0.055, 0.4, math.pi)
    await choose(tab, "robot:0")
    await tab.until("+document.querySelectorAll('.bars span')[1].textContent > 500")  # the wall before its nose
    await set_slider(tab, "knob-loss", 0.25)
    await set_slider(tab, "knob-latency", 0.5)
    await until(lambda: (rig.control.link(0).loss, rig.control.link(0).latency) == (0.25, 0.5))
    await tab.run("document.getElementById('link').click()")
    await until(lambda: rig.control.is_cut(0))
    await tab.until("window.elib.model.isCut(0)")
    await tab.run("document.getElementById('link').click()")
    await until(lambda: not rig.control.is_cut(0))
    await (await open_transport(rig.robots[0].url)).close()
    await choose(tab, "light:0")
    await set_slider(tab, "knob-intensity", 3)
    await until(lambda: rig.control.snapshot().lights[0].intensity == 3)
    await set_slider(tab, "ambient", 1000)
    await until(lambda: rig.control.ambient == 1000)
    assert tab.complaints == []


async def test_what_was_switched_stays_so_until_the_simulation_has_answered(tab):
    await choose(tab, "robot:0")
    await tab.until("window.elib.model.readings?.link.cut === false")
    await tab.run("window.elib.wire.ask = () => new Promise((answer) => { window.late = answer; })")
    await tab.run("document.getElementById('link').click()")
    await set_slider(tab, "knob-loss", 0.25)
    before = await tab.run("window.elib.model.frame.number")
    await tab.until(f"window.elib.model.frame.number > {before} + 6")  # readings come with every third
    assert await tab.run("document.getElementById('link').checked") is False
    assert await tab.run("document.getElementById('knob-loss').valueAsNumber") == 0.25
    await tab.run("window.late({ ok: false, error: 'no' })")
    await tab.until("document.getElementById('knob-loss').valueAsNumber === 0")  # the truth again


async def test_the_keyboard_selects_moves_and_turns(rig, tab):
    await tab.run("document.getElementById('arena').focus()")
    await tab.key("n")
    assert await tab.run("document.getElementById('thing').value") == "robot:0"
    await tab.key("ArrowRight")
    await until(lambda: abs(rig.control.world.pose(0).x - 0.41) < 1e-6)
    await tab.key("ArrowUp", shift=True)
    await until(lambda: abs(rig.control.world.pose(0).y - 0.45) < 1e-6)
    await tab.key("[")
    await until(lambda: abs(rig.control.world.pose(0).heading - math.pi / 12) < 1e-6)
    await tab.key("p")
    assert await tab.run("document.getElementById('thing').value") == ""
    assert tab.complaints == []


@pytest.mark.parametrize(("width", "height", "dark"), [(390, 844, True), (390, 844, False), (320, 568, False)])
async def test_on_a_phone_nothing_sticks_out_and_both_themes_are_there(tab, width, height, dark):
    await tab.size(width, height, dark=dark, phone=True)
    await choose(tab, "robot:0")
    await tab.until(f"document.documentElement.clientWidth === {width}")
    assert await tab.run("document.documentElement.scrollWidth") <= width
    await tab.until(f"document.documentElement.dataset.theme === '{'dark' if dark else 'light'}'")
    await tab.until(f"window.elib.arena.width > {0.9 * width} && window.elib.arena.scale * 1.2 > {0.7 * width}")
    page = await tab.run("getComputedStyle(document.body).backgroundColor")
    assert page == ("rgb(21, 24, 29)" if dark else "rgb(244, 243, 238)")
    await tab.run("document.getElementById('theme').click()")
    assert await tab.run("getComputedStyle(document.body).backgroundColor") != page


async def test_everything_that_can_be_worked_has_a_name_for_those_who_listen(tab):
    await choose(tab, "robot:1")
    tree = (await tab.call("Accessibility.getFullAXTree"))["nodes"]
    worked = ("button", "slider", "checkbox", "switch", "combobox", "application")
    roles = [(node["role"]["value"], node.get("name", {}).get("value")) for node in tree if not node.get("ignored")]
    found = [(role, name) for role, name in roles if role in worked]
    assert {role for role, _ in found} >= {"button", "slider", "checkbox", "switch", "application"}
    assert [role for role, name in found if not name] == []


async def test_a_connection_that_breaks_is_said_and_made_anew(tab):
    await tab.run("window.elib.wire.socket.close()")
    await tab.until("document.getElementById('state').dataset.is === 'lost'")
    await tab.until("document.getElementById('state').dataset.is === 'live'")
    seen = await tab.run("window.elib.model.frame?.number ?? 0")
    await tab.until(f"window.elib.model.frame?.number > {seen}")
