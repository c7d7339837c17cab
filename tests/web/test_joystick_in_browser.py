"""The panel in a real browser: a person drives a virtual robot, and the world tells what it truly did."""

import asyncio
import json
import math
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio

pytest.importorskip("websockets", reason="the extra web is not installed: pip install '.[web]'")

from panel_rig import TICK, Driver, Opener, Rig, browser, far, needs_browser, panel, turn, virtual_robot

from elib.body import SENSOR_DIRECTIONS
from elib.recording.reader import load

pytestmark = [needs_browser, pytest.mark.slow, pytest.mark.asyncio(loop_scope="module")]

DEAD_MAN_WAY = 0.10
"""m. At half its speed the robot goes 3.2 cm in the 0.5 s it may take to stand; a busy machine gets thrice that."""


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def open_page() -> AsyncIterator[Opener]:
    async with browser() as opener:
        yield opener


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("panel")


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def address(folder) -> AsyncIterator[str]:
    """The panel: it takes seconds to start, so the tests share it."""
    async with panel(folder) as url:
        yield url


@pytest_asyncio.fixture(loop_scope="module")
async def robot(tmp_path) -> AsyncIterator[Rig]:
    async with virtual_robot(tmp_path) as rig:
        yield rig


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


async def test_a_robot_is_connected_and_disconnected(driver, robot):
    assert await driver.tab.run("document.querySelector('.chip').textContent") == "connected"
    await driver.press("Disconnect")
    await driver.tab.until(f"{TICK}.phase === 'disconnected'")
    assert await driver.tab.until("document.querySelector('.instruments .tile b').textContent === '?'")
    await driver.press("Connect")
    await driver.tab.until(f"{TICK}.phase === 'connected'")


def remembered(folder: Path) -> list[str]:
    """Return the URLs of robots that the panel remembers."""
    path = folder / "elib" / "recent-robots.json"
    return json.loads(path.read_text())["robots"] if path.exists() else []


async def test_a_robot_that_was_connected_is_remembered(driver, robot, folder):
    await robot.until(lambda: robot.url in remembered(folder))


async def test_a_robot_that_is_not_there_is_looked_at_by_the_doctor(address, open_page, folder):
    person = Driver(await open_page(address))
    await person.tab.until("!!document.querySelector('form input')")
    await person.tab.run("document.querySelector('form input').focus()")
    await person.tab.call("Input.insertText", text="tcp://127.0.0.1:9")
    await person.key("Enter", "Enter")
    await person.tab.until("!!document.querySelector('.doctor li.failed')")
    assert await person.tab.run("document.querySelector('.doctor .fix').textContent.length > 10")
    assert "tcp://127.0.0.1:9" not in remembered(folder), "it was never connected"
    await person.press("Remove")
    await person.tab.until("!!document.querySelector('.start')")
    await person.tab.close()


@pytest.mark.parametrize(
    ("right", "ahead", "goes", "turns"), [(0, 1, 1, 0), (0, -1, -1, 0), (1, 0, 0, -1), (-1, 0, 0, 1)]
)
async def test_the_stick_drives_in_four_directions(driver, robot, right, ahead, goes, turns):
    began = robot.pose
    await driver.push(right, ahead)
    await robot.until_it_moves()
    await driver.let_go()
    await robot.until_it_stands()
    ended = robot.pose
    along = (ended.x - began.x) * math.cos(began.heading) + (ended.y - began.y) * math.sin(began.heading)
    assert (along > 0.005) - (along < -0.005) == goes
    assert (turn(began, ended) > 0.1) - (turn(began, ended) < -0.1) == turns


@pytest.mark.parametrize(("key", "code"), [("w", "KeyW"), ("ArrowUp", "ArrowUp")])
async def test_keys_drive_while_they_are_held(driver, robot, key, code):
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
    left = robot.pose
    await other.tab.close()
    await robot.until_it_stands()
    assert far(left, robot.pose) < DEAD_MAN_WAY


async def test_a_page_that_is_hidden_while_driving_stops_the_robot(robot, driver):
    await driver.push(0, 1)
    await robot.until_it_moves()
    left = robot.pose
    await driver.tab.run(
        "Object.defineProperty(document, 'hidden', {value: true, configurable: true}),"
        "document.dispatchEvent(new Event('visibilitychange')), 0"
    )
    await robot.until_it_stands()
    assert far(left, robot.pose) < DEAD_MAN_WAY
    await driver.tab.run("delete document.hidden, 0")
    await driver.let_go()


async def test_a_page_whose_scripts_hang_stops_the_robot(robot, driver):
    await driver.push(0, 1)
    await robot.until_it_moves()
    left = robot.pose
    hang = asyncio.ensure_future(
        driver.tab.run("(() => { const end = Date.now() + 3000; while (Date.now() < end); })()")
    )
    await robot.until_it_stands()
    assert far(left, robot.pose) < DEAD_MAN_WAY
    await hang
    await driver.let_go()


async def test_a_second_browser_watches_and_takes_over_after_asking(address, open_page, robot, driver):
    other = Driver(await open_page(address))
    await other.tab.size(1440, 1000)
    await other.tab.until(f"!!document.querySelector('.pad') && {TICK}?.phase === 'connected'")
    await driver.push(0, 1)
    await other.tab.until("document.querySelector('.driver').textContent === 'Another browser drives this robot.'")
    await other.press("Take over …")
    await other.press("Take over")
    await robot.until_it_stands()
    await driver.tab.until("document.querySelector('.driver').textContent !== 'You drive.'")
    await driver.let_go()
    await other.tab.close()


async def test_a_lamp_is_lit_by_a_click_and_by_the_keyboard(driver, robot):
    await driver.click("[aria-label='LED 2']")
    await robot.until(lambda: any(robot.control.snapshot().robots[0].lamps.ring[2]))
    await driver.tab.until("document.querySelector(`[aria-label='LED 2']`).getAttribute('aria-checked') === 'true'")
    await driver.tab.run("document.querySelector(`[aria-label='body light']`).focus()")
    await driver.key("Enter", "Enter")
    await robot.until(lambda: robot.control.snapshot().robots[0].lamps.body)
    await driver.press("All off")
    await robot.until(lambda: not any(robot.control.snapshot().robots[0].lamps.ring[2]))


async def test_a_lamp_shows_that_it_was_clicked_until_the_robot_has_answered(driver, robot):
    robot.control.set_faults(0, latency=0.15)
    lamp = "document.querySelector(`[aria-label='LED 2']`)"
    await driver.tab.run(f"{lamp}.focus()")
    # In one go with the click: a machine that is slow otherwise may have the answer before it looks.
    seen = await driver.tab.run(
        f"{lamp}.dispatchEvent(new MouseEvent('click')),"
        f"[{lamp}.getAttribute('aria-busy'), {lamp}.getAttribute('aria-checked')]"
    )
    assert seen == ["true", "false"]
    await driver.tab.until(f"!{lamp}.hasAttribute('aria-busy') && {lamp}.getAttribute('aria-checked') === 'true'")
    robot.control.set_faults(0, loss=1)
    await driver.tab.run(f"{lamp}.dispatchEvent(new MouseEvent('click'))")
    await driver.tab.until("!!document.querySelector('.toast')")
    await driver.tab.until(f"!{lamp}.hasAttribute('aria-busy')")  # no answer came: it is given up
    robot.control.set_faults(0, loss=0, latency=0)
    await driver.tab.until(f"{TICK}.phase === 'connected' && !{TICK}.readings.proximity.stale")


async def test_the_sensors_are_drawn_where_the_robot_has_them(driver):
    places = await driver.tab.run(
        "[...document.querySelectorAll('.robot text.count')].map(t => [+t.getAttribute('x'), +t.getAttribute('y')])"
    )
    directions = [math.atan2(-x, -y) for x, y in places]
    assert directions == [pytest.approx(angle, abs=0.001) for angle in SENSOR_DIRECTIONS]


async def test_numbers_are_told_as_a_person_would(driver):
    page = (
        "(async () => { const { degrees, Model } = await import('/model.js');"
        " const { Part } = await import('/instruments.js');"
        " const model = new Model(), frame = (time, x) => ({ time, count: 1, poses: new Float32Array([x, 0, 0]) });"
        " model.setScene({ robots: 1, walls: [], boxes: [], cylinders: [], lights: [], sounds: [] });"
        " for (let k = 0; k < 10; k++) model.setFrame(frame(k / 10, k / 100), k / 10);"
        " const speed = model.speeds[0];"
        " for (let k = 0; k < 6; k++) model.setFrame(frame(1 + k / 10, 0.09), 1 + k / 10);"
        " const box = document.createElement('div'), part = new Part(box);"
        " const ground = { name: 'ground', title: 'Ground', labels: ['left'], units: ['counts'], absent: '' };"
        " const button = { name: 'button', title: 'Button', labels: ['pressed'], units: [''], absent: '' };"
        " const battery = { name: 'battery', title: 'Battery', labels: ['charge'], units: ['%'], absent: '' };"
        " const reading = (value) => ({ values: [value], age: 0.1, stale: false });"
        " part.show({ scheme: { scheme: 1, instruments: [ground, button, battery] },"
        "  tick: { readings: { ground: reading(null), button: reading(false), battery: reading(37.2) } } });"
        " return [degrees(2 * Math.PI - 0.001), degrees(-0.001), degrees(Math.PI / 2), degrees(-Math.PI / 2), speed,"
        "  model.speeds[0], ...[...box.querySelectorAll('.tile')].map((tile) => tile.textContent)]; })()"
    )
    found = await driver.tab.run(page)
    assert found[:4] == [0, 0, 90, 270]  # type: ignore[index]
    assert found[4] == pytest.approx(0.1, rel=0.01)  # type: ignore[index]
    assert found[5] < 0.001, "it has stood for half a second"  # type: ignore[index, operator]
    assert found[6:] == ["Groundleft?counts", "Button0.1 spressedno", "Battery0.1 scharge37%"]  # type: ignore[index]


async def test_a_chart_can_be_paused_before_anything_was_drawn(driver):
    page = (
        "(async () => { const { Part } = await import('/charts.js');"
        " const box = document.createElement('div'); new Part(box);"
        " [...box.querySelectorAll('button')].find((button) => button.textContent === 'Pause').click();"
        " return [...box.querySelectorAll('button')].map((button) => button.textContent); })()"
    )
    assert "Pause" in await driver.tab.run(page)  # type: ignore[operator]


async def test_the_picture_is_upright_as_the_world_is(driver, robot):
    await driver.press("Take picture")
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
    await driver.tab.until("!document.querySelector('.instruments .tile').classList.contains('stale')")
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
        "window.pad = {id: 'test pad', index: 0, connected: true, axes: [0, 0], buttons: [{pressed: false}]};"
        "navigator.getGamepads = () => [window.pad]; null"
    )
    await driver.tab.run("pad.axes = [0, -1]; null")
    await robot.until_it_moves()
    await driver.tab.run("pad.buttons = [{pressed: true}]; null")
    await robot.until_it_stands()
    await driver.tab.run("pad.buttons = [{pressed: false}]; null")
    await robot.until_it_stands()  # the stick is still held: it has to be let go first
    await driver.tab.run("pad.axes = [0, 0]; null")
    await driver.tab.until("document.querySelector('.pad').classList.contains('on') === false")
    await asyncio.sleep(0.3)
    await driver.tab.run("pad.axes = [0, -1]; null")
    await robot.until_it_moves()
    await driver.tab.run("pad.axes = [0, 0]; null")
    await robot.until_it_stands()


async def test_a_log_is_written_to_the_file_that_was_named(driver, folder):
    await driver.press("Files")
    await driver.tab.until("!!document.querySelector('.files input[type=text]')")
    await driver.tab.run("document.querySelector('.files input[type=text]').select()")
    await driver.tab.call("Input.insertText", text="drive")
    await driver.click(".files section:nth-of-type(1) button")
    await driver.tab.until(f"{TICK}.log !== null")
    await driver.press("All on")
    await driver.tab.until(f"{TICK}.lamps.ring[0] === 1")
    await driver.click(".files section:nth-of-type(1) button")
    await driver.tab.until(f"{TICK}.log === null")
    assert len((folder / "drive.log").read_text().splitlines()) > 1


async def test_the_flight_recorder_writes_what_can_be_replayed(driver, folder):
    await driver.press("Files")
    await driver.tab.until("!!document.querySelectorAll('.files input[type=text]')[1]")
    await driver.tab.run("document.querySelectorAll('.files input[type=text]')[1].select()")
    await driver.tab.call("Input.insertText", text="drive")
    await driver.click(".files section:nth-of-type(2) button")
    await driver.tab.until(f"{TICK}.recorder !== null")
    await driver.press("All on")
    await driver.tab.until(f"{TICK}.lamps.ring[0] === 1")
    await driver.click(".files section:nth-of-type(2) button")
    await driver.tab.until(f"{TICK}.recorder === null")
    calls = [entry.data["command"] for entry in load(folder / "drive.mcap").entries("/calls")]
    assert "set_led" in calls


async def test_a_file_name_cannot_lead_out_of_the_folder(driver, folder):
    await driver.press("Files")
    await driver.tab.until("!!document.querySelector('.files input[type=text]')")
    await driver.tab.run("document.querySelector('.files input[type=text]').select()")
    await driver.tab.call("Input.insertText", text="../out")
    await driver.click(".files section:nth-of-type(1) button")
    await driver.tab.until("document.querySelector('.toast')?.textContent.includes('is not a name for a file')")
    assert not (folder.parent / "out.log").exists()


async def test_a_chart_stands_while_it_is_paused_and_shows_a_longer_time(driver, robot):
    await driver.press("Charts")
    await driver.tab.until("!!document.querySelector('.chart canvas')")
    drawn = "document.querySelector('.chart canvas').toDataURL()"
    await driver.press("Pause")
    before = await driver.tab.run(drawn)
    ticks = await driver.tab.run(f"{TICK}.time")
    await driver.tab.until(f"{TICK}.time > {ticks} + 0.5")
    assert await driver.tab.run(drawn) == before
    await driver.press("Continue")
    await driver.tab.until(f"{drawn} !== {before!r}")
    await driver.click("[aria-label='show a longer time']")
    await driver.tab.until("document.querySelector('.chart output').textContent === '1 min'")


async def test_a_picture_is_saved_larger_and_as_png(driver):
    await driver.tab.run("HTMLAnchorElement.prototype.click = function () { window.saved = this; }, 0")
    await driver.press("Take picture")
    await driver.tab.until(f"{TICK}.picture !== null")
    await driver.press("Save PNG")
    await driver.tab.until("window.saved?.download.endsWith('.png')")
    width = await driver.tab.run(
        "new Promise((done) => { const picture = new Image(); picture.onload = () => done(picture.width);"
        " picture.src = window.saved.href; })"
    )
    assert width > 40
    assert width % 40 == 0  # each pixel as large as every other


async def test_wheel_sliders_that_stay_drive_until_stop(driver, robot):
    await driver.tab.run("document.querySelector('.stick .check input, .check input').click(), 0")
    began = robot.pose
    await driver.tab.run(
        "document.querySelectorAll('.handles input[type=range]').forEach((wheel) => {"
        " wheel.value = 60; wheel.dispatchEvent(new Event('input', {bubbles: true})); })"
    )
    await robot.until_it_moves()
    assert abs(turn(began, robot.pose)) < 0.1
    await driver.key(" ", "Space")
    await robot.until_it_stands()


async def test_the_console_completes_sends_and_answers(driver):
    await driver.press("Console")
    await driver.tab.until("!!document.querySelector('.console input')")
    await driver.tab.run("document.querySelector('.console input').focus()")
    await driver.tab.call("Input.insertText", text="sele")
    await driver.tab.until("document.querySelector('.console li[role=option]')?.textContent === 'selector'")
    await driver.key("Tab", "Tab")
    assert await driver.tab.run("document.querySelector('.console input').value") == "selector "
    await driver.key("Enter", "Enter")
    await driver.tab.until("!!document.querySelector('.console .came')")


async def test_what_a_console_says_is_text_and_never_markup(driver):
    await driver.press("Console")
    await driver.tab.until("!!document.querySelector('.console input')")
    await driver.tab.run("document.querySelector('.console input').focus()")
    await driver.tab.call("Input.insertText", text="<img src=x onerror=alert(1)>")
    await driver.key("Enter", "Enter")
    await driver.tab.until("!!document.querySelector('.console .bad')")
    assert await driver.tab.run("document.querySelectorAll('.console img').length") == 0


async def test_a_behaviour_drives_until_it_is_stopped(driver, robot):
    await driver.press("Behaviours")
    await driver.press("Start")
    await robot.until_it_moves(0.03)
    await driver.tab.run("document.querySelector('.source').open = true")
    await driver.tab.until("document.querySelector('.source code').textContent.includes('async def')")
    await driver.press("Pause")
    await robot.until_it_stands()
    await driver.press("Continue")
    await robot.until_it_moves(0.02)
    await driver.key(" ", "Space")
    await robot.until_it_stands()
    await driver.tab.until("document.querySelector('.play .chip').textContent.endsWith('stopped')")


async def test_space_never_sets_a_robot_in_motion(driver, robot):
    await driver.press("Behaviours")
    await driver.press("Start")
    await robot.until_it_moves(0.03)
    await driver.press("Pause")
    await robot.until_it_stands()
    await driver.tab.until("document.activeElement.textContent.trim() === 'Continue'")
    stood = robot.pose
    await driver.key(" ", "Space")  # once it was a click on the button that has the focus
    await driver.tab.until("document.querySelector('.play .chip').textContent.endsWith('stopped')")
    await driver.tab.run("[...document.querySelectorAll('button')].find(b => b.textContent.trim() === 'Start').focus()")
    await driver.key(" ", "Space")
    await driver.press("Console")
    await driver.tab.until("!!document.querySelector('.console input')")
    await driver.tab.run("document.querySelector('.console input').focus()")
    await driver.tab.call("Input.insertText", text="set_speed 1 1")
    await driver.tab.run("document.querySelector('.console button').focus()")
    await driver.key(" ", "Space")
    await robot.until_it_stands()
    assert far(stood, robot.pose) < 1e-6
    await driver.key("Enter", "Enter")
    await robot.until_it_moves()


async def test_everything_comes_from_this_computer(driver, address):
    host = address.removeprefix("http://").rstrip("/")
    own = (f"http://{host}/", f"ws://{host}/", "data:", "blob:")
    assert driver.tab.requests
    assert [each for each in driver.tab.requests if not each.startswith(own)] == []


async def test_the_keyboard_alone_reaches_every_control_and_shows_where_it_is(driver):
    await driver.tab.run("document.activeElement.blur()")
    seen = set()
    for _ in range(80):
        await driver.key("Tab", "Tab")
        seen.add(
            await driver.tab.run(
                "(() => { const e = document.activeElement; if (e === document.body) return 'the end of the page';"
                " if (!e.matches(':focus-visible')) return 'unseen';"
                " return e.getAttribute('aria-label') || e.textContent.trim() || e.parentElement.textContent; })()"
            )
        )
    assert {"STOP space", "Disconnect", "LED 0", "body light", "front LED", "Take picture"} <= seen
    assert any(str(each).startswith("driving pad") for each in seen)
    assert "unseen" not in seen


async def test_every_control_has_a_name(driver):
    for room in ("Sensors", "Charts", "Behaviours", "Console", "Events", "Link", "Files"):
        await driver.press(room)
        await asyncio.sleep(0.3)
        unnamed = await driver.tab.run(
            "[...document.querySelectorAll('button, input, select, canvas, [role=switch], [role=application]')]"
            ".filter(e => e.offsetParent && e.getAttribute('aria-hidden') !== 'true' && !(e.getAttribute('aria-label')"
            " || e.textContent.trim() || e.labels?.length || e.closest('label') || e.title)).map(e => e.outerHTML)"
        )
        assert unnamed == [], room


@pytest.mark.parametrize("width", [360, 768, 1440])
async def test_nothing_is_wider_than_the_screen(driver, width):
    await driver.tab.size(width, 800, phone=width < 720)
    await driver.tab.until(f"window.innerWidth === {width}")
    assert await driver.tab.run("document.documentElement.scrollWidth") <= width
    stop = await driver.tab.run(
        "(b => [b.top >= 0, b.bottom <= innerHeight])(document.querySelector('button.stop').getBoundingClientRect())"
    )
    assert stop == [True, True]
    wide = "[...document.querySelectorAll('.tile')].filter(t => t.offsetParent && t.scrollWidth > t.clientWidth)"
    assert await driver.tab.run(f"{wide}.map(t => t.getAttribute('aria-label'))") == []


async def test_a_robot_is_dragged_in_its_world_and_its_link_made_worse(address, open_page):
    person = Driver(await open_page(address))
    await person.tab.size(1440, 1000)
    await person.connect("sim://square")
    await person.tab.until(f"!!document.querySelector('.world canvas') && {TICK}.pose !== null")
    await person.tab.until("!!document.querySelector('.world .bars')")
    x, y = await person.middle(".world canvas")
    side = await person.tab.run("document.querySelector('.world canvas').clientHeight - 50")
    await person.tab.until("elib.news.world?.frame !== undefined")
    # The robot stands in the middle of the room, which lies a little right of and above that of the canvas.
    await person.tab.mouse("mousePressed", x + 8, y - 9)
    await person.tab.mouse("mouseMoved", x + 8 + 0.1 * side, y - 9)
    await person.tab.mouse("mouseMoved", x + 8 + 0.25 * side, y - 9)
    await person.tab.until(f"{TICK}.pose[0] > 0.65")
    await person.tab.mouse("mouseReleased", x + 8 + 0.25 * side, y - 9)
    await person.tab.run(
        "(k => { k.value = 1000; k.dispatchEvent(new Event('input')); })(document.getElementById('world-ambient'))"
    )
    await person.tab.until(f"{TICK}.readings.ambient_light.values[0] < 1500")
    await person.tab.run(
        "(k => { k.value = 1; k.dispatchEvent(new Event('input')); })(document.getElementById('knob-loss'))"
    )
    await person.tab.until(f"{TICK}.link.lost > 0 && {TICK}.readings.proximity.stale")
    await person.press("Charts")  # the page still does what it is told
    await person.tab.until("!!document.querySelector('.chart canvas')")
    await person.remove()
    await person.tab.until("!!document.querySelector('.start')")
    assert person.tab.complaints == []
    await person.tab.close()


def slide(knob: str, value: float) -> str:
    """Return what moves a slider of the world's panel, as JavaScript."""
    return f"(k => {{ k.value = {value}; k.dispatchEvent(new Event('input')); }})(document.getElementById('{knob}'))"


async def test_each_robot_s_world_is_about_its_own_link_and_what_was_made_worse_is_taken_back(address, open_page):
    person = Driver(await open_page(address))
    await person.tab.size(1440, 1000)
    for number in (1, 3):
        await person.tab.until("!!document.querySelector('.tabs')")
        if number == 3:
            await person.press("+")
        await person.connect(f"sim://crowd?robots=3&robot={number}")
    chosen = "document.querySelector('.world .side select')?.selectedOptions[0]?.textContent"
    await person.tab.until(f"elib.robots.size === 2 && {TICK}.phase === 'connected' && {chosen} === 'epuck-3'")
    await person.tab.run(slide("knob-loss", 1))
    await person.tab.until(f"{TICK}.readings.proximity.stale")
    await person.press("Charts")
    await person.tab.until("!!document.querySelector('.chart canvas')")
    await person.press("World")
    await person.tab.until("document.getElementById('knob-loss')?.value === '1'")
    await person.tab.run(slide("knob-loss", 0))
    await person.tab.until(f"{TICK}.phase === 'connected' && !{TICK}.readings.proximity.stale")

    await person.click("#world-link")
    await person.tab.until(f"{TICK}.phase === 'gap'")
    await person.press("Charts")
    await person.tab.until("!!document.querySelector('.chart canvas')")
    await person.press("World")
    await person.tab.until("document.getElementById('world-link')?.checked === false")
    await person.click("#world-link")
    await person.tab.until(f"{TICK}.phase === 'connected'")

    await person.press("All robots")
    await person.tab.until("document.querySelectorAll('.overview .chip[data-phase=connected]').length === 2")
    for left in (2, 1):
        await person.tab.until(f"document.querySelectorAll('.overview article').length === {left}")
        await person.click(".overview .name")
        await person.remove()
    await person.tab.until("!!document.querySelector('.start')")
    assert person.tab.complaints == []
    await person.tab.close()


async def test_an_overview_shows_all_robots_and_stops_them_all(address, open_page):
    person = Driver(await open_page(address))
    await person.tab.size(1440, 1000)
    for number in (1, 2):
        await person.tab.until("!!document.querySelector('.tabs')")
        if number == 2:
            await person.press("+")
        await person.connect(f"sim://crowd?robots=2&robot={number}")
        await person.press("Behaviours")
        await person.press("Start")
        await person.tab.until(f"{TICK}.drive.may_move || true")
    await person.press("All robots")
    await person.tab.until("document.querySelectorAll('.overview .chip[data-phase=connected]').length === 2")
    await person.tab.until("Object.values(elib.news.overview).length === 2")
    await person.press("STOP ALL space")
    before = await person.tab.run("JSON.stringify(Object.values(elib.news.overview).map(r => r.pose))")
    async with asyncio.timeout(30):
        while True:
            await asyncio.sleep(0.6)
            now = await person.tab.run("JSON.stringify(Object.values(elib.news.overview).map(r => r.pose))")
            if now == before:
                break
            before = now
    for left in (2, 1):
        await person.tab.until(f"document.querySelectorAll('.overview article').length === {left}")
        await person.click(".overview .name")
        await person.remove()
    await person.tab.until("!!document.querySelector('.start')")
    await person.tab.close()
