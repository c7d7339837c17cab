"""The page's world in a real browser: it shows the world as it is, and what is done there happens in the world."""

import contextlib
import math
from collections.abc import AsyncIterator

import pytest
import pytest_asyncio

pytest.importorskip("aiohttp", reason="the extra web is not installed: pip install '.[web]'")

from browser import Opener, Tab, needs_browser
from panel_rig import panel, virtual_robot
from world_page_rig import PAINT, ROOM, Rig, watched

from elib.link.transport import open_transport
from elib.simulator.worlds.files import load_file
from shared import needs_page, until

pytestmark = [needs_browser, pytest.mark.long, pytest.mark.asyncio(loop_scope="module"), needs_page]

SIZE = 1440, 900
PART = "window.app.place.world"
"""The part of the page that shows the world."""
NOSE = (250, 250, 246)
"""Colour of the arrow on a robot (elib.simulator.drawing.robot)."""


@pytest_asyncio.fixture(loop_scope="module")
async def rig(tmp_path) -> AsyncIterator[Rig]:
    async with watched(tmp_path) as rig:
        yield rig


@contextlib.asynccontextmanager
async def visiting(open_page: Opener, url: str) -> AsyncIterator[Tab]:
    """Open a page of the usual size, on which nothing may be complained of."""
    tab = await open_page(url)
    await tab.size(*SIZE)
    yield tab
    await tab.close()
    assert tab.complaints == []


@pytest_asyncio.fixture(loop_scope="module")
async def tab(rig, open_page) -> AsyncIterator[Tab]:
    """The page, with frames on the screen and the details unfolded."""
    async with visiting(open_page, rig.url) as tab:
        await tab.until("window.app?.place?.world?.model.frame?.number > 2")
        await press(tab, "Details")
        await fitted(tab)
        yield tab


async def fitted(tab: Tab) -> None:
    """Wait until the arena has the size of its canvas."""
    await tab.until(f"{PART}.arena.width === {PART}.canvas.clientWidth && {PART}.arena.width > 0")


async def pixel(tab: Tab, x: float, y: float) -> tuple[int, ...]:
    """Return the colour on the canvas at a place of the world, m."""
    data = await tab.run(
        f"(() => {{ const {{ arena }} = window.app.place.world, at = arena.toPixel({x}, {y});"
        " const copy = document.createElement('canvas');"
        " arena.draw(); copy.width = copy.height = 1; const pen = copy.getContext('2d');"
        " pen.drawImage(arena.canvas, ...at.map((place) => -Math.round(place * arena.density)));"
        " return [...pen.getImageData(0, 0, 1, 1).data]; })()"
    )
    return tuple(data)[:3]


async def on_page(tab: Tab, x: float, y: float) -> tuple[float, float]:
    """Return where on the page a place of the world is, pixels."""
    left, top = await tab.run(
        f"(() => {{ const box = window.app.place.world.arena.canvas.getBoundingClientRect(),"
        f" [left, top] = window.app.place.world.arena.toPixel({x}, {y}); return [box.left + left, box.top + top]; }})()"
    )
    return left, top


async def drag(tab: Tab, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Take what is at a place of the world and put it at another."""
    (left, top), (right, bottom) = await on_page(tab, *start), await on_page(tab, *end)
    await tab.mouse("mousePressed", left, top)
    for share in (0.1, 0.4, 0.7, 1.0):
        await tab.mouse("mouseMoved", left + share * (right - left), top + share * (bottom - top))
    await tab.mouse("mouseReleased", right, bottom)


def is_at(thing, x: float, y: float, *, within: float = 0.01) -> bool:
    return math.dist((thing.x, thing.y), (x, y)) < within


async def choose(tab: Tab, key: str) -> None:
    """Choose a thing in the list."""
    await tab.run(
        f"(() => {{ const list = window.app.place.world.list; list.value = '{key}';"
        " list.dispatchEvent(new Event('change')); })()"
    )


async def press(tab: Tab, text: str) -> None:
    """Click a button of the part."""
    await tab.run(
        "[...document.querySelectorAll('.world-part button')].find((each) => "
        f"each.textContent === '{text}' && each.offsetParent).click()"
    )


async def unfold(tab: Tab, title: str) -> None:
    """Open a group of the details."""
    await tab.run(
        "[...document.querySelectorAll('.world-part summary')].find((each) => "
        f"each.textContent === {title!r}).parentElement.open = true"
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
    await tab.until("Math.abs(window.app.place.world.model.frame.poses[0] - 0.2) < 1e-3")
    assert await pixel(tab, 0.2 - tip, 0.2) == NOSE
    assert await pixel(tab, 0.4, 0.4) != NOSE
    assert await tab.run(f"{PART}.model.scene.world") == "room"
    assert {url.partition("://")[2].partition("/")[0] for url in tab.requests} == {rig.host}


async def test_a_robot_is_dragged_to_another_place_and_never_into_something(rig, tab):
    await drag(tab, (0.4, 0.4), (0.3, 0.2))
    await until(lambda: is_at(rig.control.world.pose(0), 0.3, 0.2))
    assert await tab.run("window.app.place.world.list.value") == "robot:0"
    await drag(tab, (0.8, 0.5), (1.0, 0.2))
    await tab.until("document.querySelector('.said').textContent.includes('is in the way')")
    assert not is_at(rig.control.world.pose(1), 1.0, 0.2, within=0.05)
    await drag(tab, (1.0, 0.2), (0.9, 0.1))
    await until(lambda: is_at(rig.control.snapshot().boxes[0], 0.9, 0.1))
    await drag(tab, (1.1, 0.7), (0.6, 0.6))
    await until(lambda: is_at(rig.control.snapshot().lights[0], 0.6, 0.6))


async def test_the_panel_switches_link_faults_and_lights_and_shows_readings(rig, tab):
    rig.control.move_robot(0, 0.045, 0.4, math.pi)
    await choose(tab, "robot:0")
    await tab.until("+document.querySelectorAll('.bars span')[1].textContent > 500")  # the wall before its nose
    await set_slider(tab, "knob-loss", 0.25)
    await set_slider(tab, "knob-latency", 0.5)
    await until(lambda: (rig.control.link(0).loss, rig.control.link(0).latency) == (0.25, 0.5))
    await tab.run("document.getElementById('world-link').click()")
    await until(lambda: rig.control.is_cut(0))
    await tab.until(f"{PART}.model.frame.bits[0] & 8")
    await tab.run("document.getElementById('world-link').click()")
    await until(lambda: not rig.control.is_cut(0))
    await (await open_transport(rig.robots[0].url)).close()
    await choose(tab, "light:0")
    await set_slider(tab, "knob-intensity", 3)
    await until(lambda: rig.control.snapshot().lights[0].intensity == 3)
    await choose(tab, "")
    await set_slider(tab, "knob-ambient", 1000)
    await until(lambda: rig.control.ambient == 1000)


async def test_what_was_switched_stays_so_until_the_simulation_has_answered(tab):
    await choose(tab, "robot:0")
    await tab.until("window.app.place.world.model.readings?.link.cut === false")
    await tab.run("window.app.connection.ask = () => new Promise((answer) => { window.late = answer; })")
    await tab.run("document.getElementById('world-link').click()")
    await set_slider(tab, "knob-loss", 0.25)
    before = await tab.run("window.app.place.world.model.frame.number")
    await tab.until(f"window.app.place.world.model.frame.number > {before} + 6")  # readings come with every third
    assert await tab.run("document.getElementById('world-link').checked") is True
    assert await tab.run("document.getElementById('knob-loss').valueAsNumber") == 0.25
    await tab.run("window.late({ ok: false, error: 'no' })")
    await tab.until("document.getElementById('knob-loss').valueAsNumber === 0")  # the truth again


async def test_the_keyboard_selects_moves_and_turns(rig, tab):
    await tab.run("window.app.place.world.canvas.focus()")
    await tab.key("n")
    assert await tab.run("window.app.place.world.list.value") == "robot:0"
    await tab.key("ArrowRight")
    await until(lambda: abs(rig.control.world.pose(0).x - 0.41) < 1e-6)
    await tab.key("ArrowUp", shift=True)
    await until(lambda: abs(rig.control.world.pose(0).y - 0.45) < 1e-6)
    await tab.key("[")
    await until(lambda: abs(rig.control.world.pose(0).heading - math.pi / 12) < 1e-6)
    await tab.key("p")
    assert await tab.run("window.app.place.world.list.value") == ""


@pytest.mark.parametrize(("width", "height", "dark"), [(390, 844, True), (390, 844, False), (320, 568, False)])
async def test_on_a_phone_nothing_sticks_out_and_both_themes_are_there(tab, width, height, dark):
    await tab.size(width, height, dark=dark, phone=True)
    await choose(tab, "robot:0")
    await tab.until(f"document.documentElement.clientWidth === {width}")
    assert await tab.run("document.documentElement.scrollWidth") <= width
    await tab.until(f"document.documentElement.dataset.theme === '{'dark' if dark else 'light'}'")
    await tab.until(f"{PART}.arena.width > {0.8 * width} && {PART}.arena.scale * 1.2 > {0.7 * width}")
    page = await tab.run("getComputedStyle(document.body).backgroundColor")
    assert page == ("rgb(21, 24, 29)" if dark else "rgb(244, 243, 238)")
    await tab.run("document.getElementById('theme').click()")
    assert await tab.run("getComputedStyle(document.body).backgroundColor") != page


async def test_everything_that_can_be_worked_has_a_name_for_those_who_listen(tab):
    await choose(tab, "robot:1")
    await unfold(tab, "Link of this robot")
    tree = (await tab.call("Accessibility.getFullAXTree"))["nodes"]
    worked = ("button", "slider", "checkbox", "switch", "combobox", "application")
    roles = [(node["role"]["value"], node.get("name", {}).get("value")) for node in tree if not node.get("ignored")]
    found = [(role, name) for role, name in roles if role in worked]
    assert {role for role, _ in found} >= {"button", "slider", "checkbox", "switch", "application"}
    assert [role for role, name in found if not name] == []


async def test_a_connection_that_breaks_is_said_and_made_anew(tab):
    # It may be so short a time without a connection that no question from outside falls into it.
    await tab.run(
        "window.seen = new Set(); new MutationObserver(() => seen.add(document.documentElement.dataset.silent))"
        ".observe(document.documentElement, {attributes: true})"
    )
    await tab.run("window.app.connection.socket.close()")
    await tab.until("seen.has('yes') && document.documentElement.dataset.silent === 'no'")
    seen = await tab.run(f"{PART}.model.frame?.number ?? 0")
    await tab.until(f"{PART}.model.frame?.number > {seen}")


async def test_the_wheel_the_buttons_and_a_drag_on_the_floor_change_what_is_in_view(rig, tab):
    whole = await tab.run(f"{PART}.arena.scale")
    x, y = await on_page(tab, 0.4, 0.4)
    await tab.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-300)
    await tab.until(f"{PART}.arena.scale > {1.5 * whole}")
    assert await on_page(tab, 0.4, 0.4) == pytest.approx((x, y), abs=1.5), "what is under the pointer stays there"
    await press(tab, "+")
    assert await tab.run(f"{PART}.arena.zoom") > 2
    before = rig.control.snapshot()
    left, top = await on_page(tab, 0.5, 0.3)
    await tab.mouse("mousePressed", left, top)
    await tab.mouse("mouseMoved", left - 20, top)
    await tab.mouse("mouseMoved", left - 40, top)
    await tab.mouse("mouseReleased", left - 40, top)
    assert await on_page(tab, 0.5, 0.3) == pytest.approx((left - 40, top), abs=1)
    after = rig.control.snapshot()
    assert [robot.pose for robot in after.robots] == [robot.pose for robot in before.robots]
    await press(tab, "−")
    await press(tab, "Fit")
    assert await tab.run(f"{PART}.arena.scale") == whole
    await tab.run(f"{PART}.canvas.focus()")
    await tab.key("+")
    assert await tab.run(f"{PART}.arena.zoom") > 1
    await tab.key("0")
    assert await tab.run(f"{PART}.arena.zoom") == 1


async def test_two_fingers_pinch(tab):
    x, y = await on_page(tab, 0.4, 0.25)
    for kind, apart in (("touchStart", 30), ("touchMove", 40), ("touchMove", 80), ("touchEnd", 0)):
        points = [{"x": x - apart, "y": y, "id": 1}, {"x": x + apart, "y": y, "id": 2}] if apart else []
        await tab.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)
    assert 1.8 < await tab.run(f"{PART}.arena.zoom") < 3


async def test_a_followed_robot_stays_in_the_middle(rig, tab):
    await choose(tab, "robot:1")
    await tab.run(f"{PART}.followBox.click()")
    assert await tab.run(f"{PART}.arena.zoom") == pytest.approx(3)
    rig.control.move_robot(1, 0.75, 0.4)
    await tab.until(f"Math.abs({PART}.arena.middle[0] - 0.75) < 0.01 && Math.abs({PART}.arena.middle[1] - 0.4) < 0.01")
    await press(tab, "Fit")
    assert await tab.run(f"{PART}.followBox.checked") is False


async def test_the_clock_is_stopped_stepped_and_changed_in_speed(rig, tab):
    await press(tab, "Pause world")
    await until(lambda: rig.control.simulation.clock.is_paused)
    await tab.until(
        f"{PART}.pauseButton.textContent === 'Continue world' && {PART}.time.textContent.endsWith('paused')"
    )
    time = rig.control.snapshot().time
    await press(tab, "Step")
    await until(lambda: rig.control.snapshot().time == pytest.approx(time + 0.1, abs=0.02))
    await tab.run(f"(() => {{ {PART}.speed.value = '2'; {PART}.speed.onchange(); }})()")
    await until(lambda: rig.control.simulation.clock.rate == 2)
    await press(tab, "Continue world")
    await until(lambda: not rig.control.simulation.clock.is_paused)
    await tab.until(f"{PART}.stepButton.disabled")
    rig.control.set_speed(0.5)  # as another page would
    await tab.until(f"{PART}.speed.value === '0.5'")


async def test_boxes_and_walls_are_put_in_moved_and_taken_away_by_mouse_and_keys(rig, tab):
    await press(tab, "+ Box")
    await tab.until(f"{PART}.list.value === 'box:1'")
    box = rig.control.snapshot().boxes[1]
    await drag(tab, (box.x, box.y), (0.3, 0.15))
    await until(lambda: is_at(rig.control.snapshot().boxes[1], 0.3, 0.15))
    await press(tab, "Delete")
    await until(lambda: len(rig.control.snapshot().boxes) == 1)
    await tab.run(f"{PART}.canvas.focus()")
    await tab.key("m")
    await tab.until(f"{PART}.list.value === 'wall:1'")
    wall = rig.control.snapshot().walls[1]
    await tab.key("ArrowUp")
    await until(lambda: abs(rig.control.snapshot().walls[1].y1 - wall.y1 - 0.01) < 1e-6)
    await tab.key("]")
    await until(lambda: abs(rig.control.snapshot().walls[1].y1 - rig.control.snapshot().walls[1].y2) > 0.05)
    await tab.key("Delete")
    await until(lambda: len(rig.control.snapshot().walls) == 1)
    await tab.key("b")
    await until(lambda: len(rig.control.snapshot().boxes) == 2)


async def test_the_world_is_saved_under_a_name(rig, tab, tmp_path):
    await press(tab, "Save …")
    await tab.until("!!document.querySelector('dialog[open] input')")
    await tab.run("document.querySelector('dialog input').value = 'after'")
    await tab.run("document.querySelector('dialog button.primary').click()")
    await tab.until("document.getElementById('toasts').textContent.includes('after.toml')")
    assert len(load_file(str(tmp_path / "after.toml")).scene.starts) == 2


async def test_faults_are_of_the_selected_robot_shown_as_they_are_and_taken_back(rig, tab):
    await choose(tab, "robot:1")
    await set_slider(tab, "knob-jitter", 0.1)
    await until(lambda: rig.control.link(1).jitter == 0.1)
    assert rig.control.link(0).jitter == 0
    rig.control.set_faults(1, loss=0.5)  # as another page would
    await tab.until("document.getElementById('knob-loss').valueAsNumber === 0.5")
    await choose(tab, "robot:0")
    await tab.until("document.getElementById('knob-loss').valueAsNumber === 0")
    await choose(tab, "robot:1")
    await tab.until("document.getElementById('knob-loss').valueAsNumber === 0.5")
    await set_slider(tab, "knob-loss", 0)
    await until(lambda: rig.control.link(1).loss == 0)
    rig.control.cut(1)
    await tab.until("document.getElementById('world-link').checked === true")
    await unfold(tab, "Link of this robot")
    await press(tab, "Undo all faults")
    await until(lambda: not rig.control.is_cut(1) and rig.control.link(1).jitter == 0)


async def test_selector_and_remote_control_of_the_robot_are_worked(rig, tab):
    await choose(tab, "robot:0")
    await tab.until("document.getElementById('world-selector').value === '3'")
    await tab.run(
        "(() => { const knob = document.getElementById('world-selector'); knob.value = '7'; knob.onchange(); })()"
    )
    await until(lambda: rig.control.hardware(0).selector() == 7)
    await tab.run("document.querySelector('[aria-label^=key]').value = 8")
    await unfold(tab, "Robot's controls")
    await press(tab, "Press")
    await until(lambda: rig.control.hardware(0).infrared()[2] == 8)
    assert await tab.run("document.getElementById('world-button').offsetParent === null"), "the e-puck1 has none"


async def test_rays_are_switched_on_and_can_be_read_on_every_floor(tmp_path, open_page):
    folder = tmp_path / "painted"
    folder.mkdir()
    async with watched(folder, world=ROOM + PAINT) as rig, visiting(open_page, rig.url) as tab:
        await tab.until("window.app?.place?.world?.model.frame?.number > 2")
        assert await tab.run(f"{PART}.model.frame.rays") is None
        await tab.run(f"{PART}.raysBox.click()")
        rig.control.move_robot(0, 0.045, 0.4, math.pi)  # a wall before its nose: a ray that meets nothing is faint
        rays = f"{PART}.model.frame.rays"
        ray = await tab.until(f"{rays}?.[4] > 0.1 && [...{rays}.slice(0, 4)]")
        x, y = (ray[0] + ray[2]) / 2, (ray[1] + ray[3]) / 2
        red, green, _ = await pixel(tab, x, y)
        assert red > green + 40, "a ray on the green floor"


async def test_at_a_usual_screen_the_world_is_large_and_its_controls_push_nothing_away(tab):
    await press(tab, "Details")
    await fitted(tab)
    room = await tab.run(
        f"(() => {{ const box = {PART}.canvas.getBoundingClientRect(); return [box.width, box.height]; }})()"
    )
    assert min(room) > 400
    assert await tab.run("document.documentElement.scrollWidth") <= SIZE[0]


async def test_a_double_click_opens_the_page_of_a_robot_and_a_pause_loses_no_link(tmp_path, open_page):
    async with panel(tmp_path, "sim://soccer") as url, visiting(open_page, url) as tab:
        await tab.until("window.app?.place?.world?.model.frame?.number > 2")
        await fitted(tab)
        names = await tab.run(f"[...{PART}.list.options].map((each) => each.textContent)")
        assert set(await tab.run("[...document.querySelectorAll('.tab')].map((each) => each.textContent)")) >= {
            name for name in names if name.startswith("epuck-")
        }, "a robot has one name everywhere"
        x, y = await tab.run(f"[...{PART}.model.pose({{ kind: 'robot', index: 2 }})].slice(0, 2)")
        left, top = await on_page(tab, x, y)
        for clicks in (1, 2):
            for kind in ("mousePressed", "mouseReleased"):
                await tab.call("Input.dispatchMouseEvent", type=kind, x=left, y=top, button="left", clickCount=clicks)
        await tab.until("window.app.shown === '3'")
        own = "window.app.place.parts.find((each) => each.arena)"
        await tab.until(f"{own}.list.value === 'robot:2' && {own}.model.frame?.number > 2")
        before = await tab.run(f"[...{own}.model.pose({{ kind: 'robot', index: 2 }})].slice(0, 2)")
        await tab.run(f"{own}.canvas.focus()")
        await tab.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowUp", code="ArrowUp")
        moved = f"Math.hypot({own}.model.pose({{ kind: 'robot', index: 2 }})[0] - {before[0]},"
        moved += f" {own}.model.pose({{ kind: 'robot', index: 2 }})[1] - {before[1]})"
        await tab.until(f"elib.robot('3').tick.drive.left > 0 && {moved} > 0.01")  # arrows drive the page's own robot
        await tab.call("Input.dispatchKeyEvent", type="keyUp", key="ArrowUp", code="ArrowUp")
        await tab.run(f"{own}.pauseButton.click()")
        await tab.until(f"{own}.isPaused")
        paused = await tab.run("elib.robot('3').tick.time")
        await tab.until(f"elib.robot('3').tick.time > {paused} + 4")
        await tab.run(f"{own}.pauseButton.click()")
        await tab.until(f"!{own}.isPaused")
        await tab.until("elib.robot('3').tick.readings.proximity?.stale === false")
        lines = await tab.run("elib.robot('3').lines.filter((each) => each.bad).map((each) => each.text)")
        assert (await tab.run("elib.robot('3').tick.phase"), lines) == ("connected", [])


async def test_without_a_virtual_world_the_path_and_what_the_sensors_met_are_drawn(tmp_path, open_page):
    async with virtual_robot(tmp_path) as robot, panel(tmp_path, robot.url) as url, visiting(open_page, url) as tab:
        own = "window.app?.place?.parts?.find((each) => each.path)"
        await tab.until(f"{own}?.path.pose")
        assert await tab.run(f"{own}.live.hidden && !{own}.map.hidden")
        met = f"[...{own}.path.cells].filter(([, weight]) => weight > 2).map(([key]) => key.split(' ').map(Number))"
        robot.control.move_robot(0, 1.35, 0.85, 0.0)  # a box lies ahead; the robot still believes to be where it was
        found = await tab.until(f"{met}.length > 0 && {met}")
        assert all(math.dist((column, row), (0, 0)) < 9 for column, row in found), "within 9 cm of the robot"
        assert max(column for column, _ in found) >= 4, "ahead of it"


async def test_of_several_worlds_one_is_chosen_in_the_overview_and_a_world_outlives_the_link(tmp_path, open_page):
    async with panel(tmp_path, "sim://arena", "sim://square") as url, visiting(open_page, url) as tab:
        shown = "window.app?.place?.world?.model.scene?.world"
        choice = "document.querySelector(`[aria-label='world that is shown']`)"
        await tab.until(f"{shown} === 'arena' && {choice}.length === 2")
        await tab.run(f"(list => {{ list.selectedIndex = 1; list.onchange(); }})({choice})")
        await tab.until(f"{shown} === 'square'")
        await tab.run("window.app.open('2')")
        own = "window.app.place.parts?.find((each) => each.arena)"
        await tab.until(f"{own}?.model.frame?.number > 2")
        await tab.run("window.app.ask('disconnect', { robot: '2' })")
        await tab.until(f"{own}.live.inert")
        assert await tab.run(f"!{own}.live.hidden && {own}.map.hidden"), "it stays as it was seen last"
        await tab.run("window.app.ask('connect', { robot: '2' })")
        await tab.until(f"!{own}.live.inert")


async def test_the_news_of_one_world_are_not_taken_for_those_of_another(tmp_path, open_page):
    async with panel(tmp_path, "sim://arena", "sim://square") as url, visiting(open_page, url) as tab:
        await tab.until("window.app?.robots.length === 2")
        await tab.run("window.app.open('1')")
        own = "window.app.place.parts?.find((each) => each.arena)"
        await tab.until(f"window.app.shown === '1' && {own}.model.frame?.number > 2")
        await tab.run("window.app.ask('world', { message: { do: 'move_box', box: 1, x: 0.8, y: 0.2 } })")
        await tab.until(f"Math.abs({own}.model.things.box[1].x - 0.8) < 1e-6")
        await tab.run("window.app.open('2')")
        await tab.until(f"window.app.shown === '2' && {own}.model.scene?.world === 'square'")
        seen = await tab.run(f"{own}.model.frame?.number ?? 0")
        await tab.until(f"{own}.model.frame?.number > {seen}")
        assert await tab.run(f"[...{own}.list.options].map((each) => each.value)") == ["", "robot:0"]
