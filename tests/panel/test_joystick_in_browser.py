"""Driving in a real browser: a person drives a virtual robot, and the world tells what it truly did."""

import asyncio
import math
from collections.abc import AsyncIterator

import pytest
import pytest_asyncio
from panel_rig import TICK, Driver, browser, firefox, needs_browser, needs_firefox, turn

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


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def person(address, open_page) -> AsyncIterator[Driver]:
    """A person at the start page, where each test begins and ends."""
    person = Driver(await open_page(address))
    await person.tab.size(1440, 1000)
    yield person
    await person.tab.close()


@pytest_asyncio.fixture(loop_scope="module")
async def driver(person, robot) -> AsyncIterator[Driver]:
    """A person whose page shows the connected robot."""
    await person.connect(robot.url)
    yield person
    await person.remove()
    await person.tab.until("!!document.querySelector('.start')")
    assert person.tab.complaints == []


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
    for button, left, right in ((12, 1, 1), (13, -1, -1), (14, -1, 1), (15, 1, -1)):  # the cross
        pressed = f"Array.from({{length: 16}}, (_, k) => ({{pressed: k === {button}}}))"
        await driver.tab.run(f"pad.mapping = 'standard', pad.buttons = {pressed}, 0")
        await robot.until(lambda: all(robot.wheels))
        assert [math.copysign(1, wheel) for wheel in robot.wheels] == [left, right], button
        await driver.tab.run("pad.buttons = [], null")
        await robot.until_it_stands()
    await driver.tab.run("delete navigator.getGamepads, null")


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
