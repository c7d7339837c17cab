"""Driving in a real browser: a person drives a virtual robot, and the world tells what it truly did."""

import asyncio
import math
from collections.abc import AsyncIterator

import pytest
import pytest_asyncio

pytest.importorskip("websockets", reason="the extra web is not installed: pip install '.[web]'")

from panel_rig import TICK, Driver, browser, firefox, needs_browser, needs_firefox, turn

from elib.base.body import SENSOR_DIRECTIONS

pytestmark = [
    pytest.mark.long,
    pytest.mark.asyncio(loop_scope="module"),
    pytest.mark.parametrize(
        "open_page",
        [
            pytest.param(browser, id="chromium", marks=needs_browser),
            pytest.param(firefox, id="firefox", marks=needs_firefox),
        ],
        indirect=True,
        scope="module",
    ),
]


@pytest_asyncio.fixture(loop_scope="module")
async def driver(address, open_page, robot) -> AsyncIterator[Driver]:
    """A person whose page shows the connected robot."""
    person = Driver(await open_page(address))
    await person.tab.size(1440, 1000)
    await person.connect(robot.url)
    yield person
    await person.remove()
    await person.tab.until("!!document.querySelector('.start')")
    assert person.tab.complaints == []
    await person.tab.close()


async def test_the_stick_drives_in_four_directions(driver, robot):
    for right, ahead, goes, turns in ((0, 1, 1, 0), (0, -1, -1, 0), (1, 0, 0, -1), (-1, 0, 0, 1)):
        await driver.push(right, ahead)
        # What the wheels do, and not where it is: on a busy computer it turns so far that left looks like right.
        await robot.until(lambda: all(robot.wheels))
        signs = [math.copysign(1, wheel) for wheel in robot.wheels]
        await robot.until_it_moves()
        await driver.let_go()
        await robot.until_it_stands()
        assert signs == [goes - turns, goes + turns], (right, ahead)


async def test_keys_drive_while_they_are_held(driver, robot):
    for key, code in (("w", "KeyW"), ("ArrowUp", "ArrowUp")):
        await driver.key(key, code, kind="keyDown")
        await robot.until_it_moves()
        await driver.key(key, code, kind="keyUp")
        await robot.until_it_stands()


async def test_space_stops_a_robot_whose_stick_is_held(driver, robot):
    await driver.push(0, 1)
    await robot.until_it_moves()
    await driver.key(" ", "Space")
    await robot.until_it_stands()
    await driver.let_go()
    await driver.push(0, -1)
    await robot.until_it_moves()
    await driver.let_go()


async def test_a_page_closed_while_driving_stops_the_robot(address, open_page, robot, driver):
    other = Driver(await open_page(address))
    await other.tab.size(1440, 1000)
    await other.tab.until("!!document.querySelector('.pad')")
    await other.tab.until(f"{TICK}?.phase === 'connected'")
    await other.push(0, 1)
    await robot.until_it_moves()
    await other.tab.close()
    await robot.until_it_stands()


async def test_a_page_that_is_hidden_while_driving_stops_the_robot(robot, driver):
    await driver.push(0, 1)
    await robot.until_it_moves()
    await driver.tab.run(
        "Object.defineProperty(document, 'hidden', {value: true, configurable: true}),"
        "document.dispatchEvent(new Event('visibilitychange')), 0"
    )
    await robot.until_it_stands()
    await driver.tab.run("delete document.hidden, 0")
    await driver.let_go()


async def test_a_page_whose_scripts_hang_stops_the_robot(robot, driver):
    await driver.push(0, 1)
    await robot.until_it_moves()
    hang = asyncio.ensure_future(
        driver.tab.run("(() => { const end = Date.now() + 3000; while (Date.now() < end); })()")
    )
    await robot.until_it_stands()
    await hang
    await driver.let_go()


async def test_a_lamp_is_lit_by_a_click_and_by_the_keyboard(driver, robot):
    await driver.click("[aria-label='LED 2']")
    await robot.until(lambda: any(robot.control.snapshot().robots[0].lamps.ring[2]))
    await driver.tab.until("document.querySelector(`[aria-label='LED 2']`).getAttribute('aria-checked') === 'true'")
    await driver.tab.run("document.querySelector(`[aria-label='body light']`).focus()")
    await driver.key("Enter", "Enter")
    await robot.until(lambda: robot.control.snapshot().robots[0].lamps.body)
    await driver.press("Lights and sounds")
    await driver.press("All off")
    await robot.until(lambda: not any(robot.control.snapshot().robots[0].lamps.ring[2]))


async def test_a_lamp_shows_that_it_was_clicked_until_the_robot_has_answered(driver, robot):
    robot.control.set_faults(0, latency=0.15)
    lamp = "document.querySelector(`[aria-label='LED 2']`)"
    await driver.tab.run(f"{lamp}.focus()")
    # Before the page hears anything: a machine that is slow otherwise may have the answer before it looks.
    seen = await driver.tab.run(
        f"(async () => {{ {lamp}.dispatchEvent(new MouseEvent('click')); for (let k = 0; k < 10; k++) await null;"
        f" return [{lamp}.getAttribute('aria-busy'), {lamp}.getAttribute('aria-checked')]; }})()"
    )
    assert seen == ["true", "false"]
    await driver.tab.until(f"!{lamp}.hasAttribute('aria-busy') && {lamp}.getAttribute('aria-checked') === 'true'")
    robot.control.set_faults(0, loss=1)
    await driver.tab.run(f"{lamp}.dispatchEvent(new MouseEvent('click'))")
    await driver.tab.until("!!document.querySelector('.toast')")
    await driver.tab.until(f"!{lamp}.hasAttribute('aria-busy')")  # no answer came: it is given up
    robot.control.set_faults(0, loss=0, latency=0)
    await driver.tab.until(f"{TICK}.phase === 'connected' && !{TICK}.readings.proximity.stale")


async def test_every_part_of_the_page_opens(driver):
    names = "[...document.querySelectorAll('[role=tab]')].filter(tab => tab.offsetParent).map(tab => tab.textContent)"
    found = await driver.tab.run(names)
    assert {"Charts", "Behaviours", "Console", "Files"} <= set(found)
    for name in found:
        await driver.press(name)
        await driver.tab.until(f"document.querySelector('[role=tabpanel][aria-label=\"{name}\"]')?.offsetHeight > 40")


async def test_the_sensors_are_drawn_where_the_robot_has_them(driver):
    places = await driver.tab.run(
        "[...document.querySelectorAll('.robot text.count')].map(t => [+t.getAttribute('x'), +t.getAttribute('y')])"
    )
    directions = [math.atan2(-x, -y) for x, y in places]
    assert directions == [pytest.approx(angle, abs=0.001) for angle in SENSOR_DIRECTIONS]


async def test_numbers_are_told_as_a_person_would(driver):
    page = (
        "(async () => { const { degrees, World, robots } = elib, world = new World(), { scheme, tick } ="
        " [...robots.values()].at(-1), about = scheme.value;"
        " const frame = (time, x) => { const bytes = new ArrayBuffer(64), view = new DataView(bytes);"
        "  view.setFloat64(8, time, true), view.setUint32(16, 1, true), view.setFloat32(24, x, true); return bytes; };"
        " world.enter({ robots: 1, walls: [], boxes: [], cylinders: [], lights: [], sounds: [], zones: [], pens: [],"
        "  names: ['one'], clock: {} });"
        " for (let k = 0; k < 10; k++) world.takeFrame(frame(k / 10, k / 100));"
        " const speed = world.speeds[0];"
        " for (let k = 0; k < 6; k++) world.takeFrame(frame(1 + k / 10, 0.09));"
        " const one = (name, title, label, unit) => ({ name, title, labels: [label], units: [unit], absent: '' });"
        " const reading = (value, age = 0.1) => ({ values: [value], physical: null, age, stale: false });"
        " scheme.value = { ...about, instruments: [one('ground', 'Ground', 'left', 'counts'),"
        "  one('button', 'Button', 'pressed', ''), one('battery', 'Battery', 'charge', '%')] };"
        " tick.value = { ...tick.value, readings:"
        "  { ground: reading(null), button: reading(false), battery: reading(37.2, 2.4) } };"
        " for (let k = 0; k < 10; k++) await null;"
        " const tiles = [...document.querySelectorAll('.tile')].map((tile) => tile.textContent);"
        " scheme.value = about;"
        " return [degrees(2 * Math.PI - 0.001), degrees(-0.001), degrees(Math.PI / 2), degrees(-Math.PI / 2), speed,"
        "  world.speeds[0], ...tiles.slice(-3)]; })()"
    )
    await driver.tab.until("document.querySelectorAll('.tile').length > 3")
    found = await driver.tab.run(page)
    assert found[:4] == [0, 0, 90, 270]  # type: ignore[index]
    assert found[4] == pytest.approx(0.1, rel=0.01)  # type: ignore[index]
    assert found[5] < 0.001, "it has stood for half a second"  # type: ignore[index, operator]
    said = ["Ground no valueleft?counts", "Button pressedno", "Battery 2.4 s oldcharge37%"]
    assert [" ".join(each.split()) for each in found[6:]] == said  # type: ignore[index]


async def test_the_picture_is_upright_as_the_world_is(driver, robot):
    await driver.click("[aria-label='Take picture']")
    await driver.tab.until("!document.querySelector('.frame canvas').hidden")
    shown = await driver.tab.run(
        "(() => { const c = document.querySelector('.frame canvas');"
        " const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
        " return [c.width, c.height, [...d].filter((_, k) => k % 4 === 0)]; })()"
    )
    width, height, grey = shown
    assert (width, height) == (40, 40)
    offsets = [(k + 0.5) * 8 - 160 for k in range(40)]
    world = robot.control.world.picture(0, offsets, [-each for each in offsets])
    truth = world.astype(float) @ (0.299, 0.587, 0.114)
    rows = [grey[width * row : width * row + width] for row in range(height)]

    def error(picture: list[list[int]]) -> float:
        return sum(abs(picture[r][c] - truth[r][c]) for r in range(40) for c in range(40)) / 1600

    mirrored, upside_down = [row[::-1] for row in rows], rows[::-1]
    assert error(rows) < 4 < 8 < min(error(mirrored), error(upside_down))


async def test_stale_values_are_grey_after_the_link_is_cut_and_fresh_when_it_is_back(driver, robot):
    await driver.tab.until("document.querySelector('.instruments .tile')?.classList.contains('stale') === false")
    robot.control.cut(0)
    await driver.tab.until(
        "[...document.querySelectorAll('.instruments .tile')].every(t => t.classList.contains('stale'))"
    )
    assert await driver.tab.run("document.querySelector('.chip').dataset.phase") == "gap"
    robot.control.mend(0)
    await driver.tab.until(
        "[...document.querySelectorAll('.instruments .tile')].every(t => !t.classList.contains('stale'))"
    )


async def test_the_page_says_that_a_robot_beyond_reach_may_still_move(driver, robot):
    await driver.push(0, 1)
    await robot.until_it_moves()
    robot.control.cut(0)
    await driver.tab.until("document.querySelector('.alarm').textContent.includes('may still be moving')")
    await driver.let_go()
    robot.control.mend(0)
    await robot.until_it_stands()
    await driver.tab.until("document.querySelector('.alarm').hidden")


async def test_a_gamepad_drives_and_its_button_stops(driver, robot):
    await driver.tab.run(
        "window.pad = {id: 'test pad', index: 0, connected: true, axes: [0, 0], buttons: [{pressed: false}]},"
        "window.looks = 0, navigator.getGamepads = () => { window.looks++; return [window.pad]; }, null"
    )

    async def is_seen() -> None:
        """Wait until the page has looked at the gamepad often, and told the server what it saw."""
        await driver.tab.until(f"looks > {await driver.tab.run('looks')} + 4")
        await driver.tab.run("elib.ask('files', {})")

    await driver.tab.run("pad.axes = [0, -1], null")
    await robot.until_it_moves()
    await driver.tab.run("pad.buttons = [{pressed: true}], null")
    await robot.until_it_stands()
    await driver.tab.run("pad.buttons = [{pressed: false}], null")
    await is_seen()
    assert robot.wheels == (0, 0)  # the stick is still held: it has to be let go first
    await driver.tab.run("pad.axes = [0, 0], null")
    await driver.tab.until("document.querySelector('.pad').classList.contains('on') === false")
    await is_seen()
    await driver.tab.run("pad.axes = [0, -1], null")
    await robot.until_it_moves()
    await driver.tab.run("pad.axes = [0, 0], null")
    await robot.until_it_stands()


async def test_wheel_sliders_that_stay_drive_until_stop(driver, robot):
    await driver.tab.run("document.querySelector('.drive .check input').click(), 0")
    await driver.tab.run(
        "document.querySelectorAll('.drive .popup input[type=range]').forEach((wheel) => {"
        " wheel.value = 60; wheel.dispatchEvent(new Event('input', {bubbles: true})); })"
    )
    await robot.until(lambda: min(robot.wheels) > 0)  # the first slider is heard a moment before the second
    began = robot.pose
    await robot.until_it_moves()
    assert abs(turn(began, robot.pose)) < 0.1
    await driver.key(" ", "Space")
    await robot.until_it_stands()
