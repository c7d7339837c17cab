"""The whole page in a real browser: robots come and go, and what is done with readings, behaviours and files."""

import asyncio
import json
import math
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio
from panel_rig import TICK, Driver, far, needs_browser, panel, program

import elib
from elib.base.body import SENSOR_DIRECTIONS
from elib.records.reader import read_recording
from elib.testing import simulated
from shared import held_port, needs_page, until

pytestmark = [needs_browser, pytest.mark.long, pytest.mark.asyncio(loop_scope="module"), needs_page]

CHIP = "document.querySelector('.play .chip').textContent"
OVERVIEW = "Object.values(elib.overview.value)"
START = "!!document.querySelector('.start')"
SAVING = """
    HTMLAnchorElement.prototype.click = function () { window.saved = this; };
    const makeUrl = URL.createObjectURL;
    URL.createObjectURL = (blob) => { window.blob = blob; return makeUrl.call(URL, blob); };
    0
"""
"""Keeps what the page saves, instead of a file of the browser."""

HELD_BACK = """
    const real = WebSocket.prototype.send;
    window.held = 0;
    WebSocket.prototype.send = function (text) {
        if (JSON.parse(text).do !== "files") return real.call(this, text);
        window.held++;
        window.send = () => real.call(this, text);
    };
    0
"""
"""Lets the question for files wait until the test sends it."""


@pytest_asyncio.fixture(loop_scope="module")
async def visitor(address, open_page) -> AsyncIterator[Driver]:
    """A person at the start page; all robots are taken out when the test ends."""
    person = Driver(await open_page(address))
    await person.tab.size(1440, 900)
    await person.tab.until(START)
    yield person
    everyone = "elib.listed.value.map(({ key }) => elib.ask('remove', { robot: key }))"
    await person.tab.run(f"Promise.all({everyone}).then(() => 0)")
    await person.tab.until(f"{START} && elib.listed.value.length === 0")
    await person.tab.close()
    assert person.tab.complaints == []


@pytest_asyncio.fixture(loop_scope="module")
async def driver(visitor, robot) -> Driver:
    """A person whose page shows the connected robot."""
    await visitor.connect(robot.url)
    return visitor


async def slide(person: Driver, knob: str, value: float) -> None:
    """Move a slider of the world's details."""
    await person.tab.until(f"!!document.getElementById({knob!r})")
    await person.tab.run(
        f"(k => {{ k.value = {value}; k.dispatchEvent(new Event('input')); }})(document.getElementById({knob!r}))"
    )


async def type_into(person: Driver, field: str, text: str) -> None:
    """Replace what stands in a field by a text, as one who types."""
    field += ":enabled"
    await person.tab.until(f"!!document.querySelector({field!r})")
    await person.tab.run(f"(field => {{ field.focus(); field.select(); }})(document.querySelector({field!r}))")
    await person.tab.type(text)


def remembered(folder: Path) -> list[str]:
    """Return the URLs of robots that the panel remembers."""
    path = folder / "elib" / "recent-robots.json"
    return json.loads(path.read_text())["robots"] if path.exists() else []


# -- robots come and go --


async def test_a_robot_is_connected_disconnected_remembered_and_removed(driver, robot, folder):
    assert await driver.tab.run("document.querySelector('.status .chip').textContent") == "connected"
    await robot.until(lambda: robot.url in remembered(folder))
    await driver.press("Disconnect")
    await driver.tab.until(f"{TICK}.phase === 'disconnected'")
    await driver.tab.until("!document.querySelector('.tile') && document.body.innerText.includes('Nothing is read')")
    await driver.press("Connect")
    await driver.tab.until(f"{TICK}.phase === 'connected'")
    await driver.remove()
    await driver.tab.until(START)
    used = "[...document.querySelectorAll('.used b')].map(each => each.textContent)"
    await driver.tab.until(f"{used}.includes({robot.url!r})")
    await driver.click(f"[aria-label='forget {robot.url}']")
    await driver.tab.until(f"!{used}.includes({robot.url!r})")
    await robot.until(lambda: robot.url not in remembered(folder))


async def test_a_robot_that_is_not_there_is_looked_at_by_the_doctor(visitor, folder):
    await visitor.enter("tcp://127.0.0.1:9")
    await visitor.tab.until("!!document.querySelector('.doctor li.failed')")
    await visitor.tab.until("document.querySelector('.trouble .fix')?.textContent.length > 10")  # what to try
    assert "tcp://127.0.0.1:9" not in remembered(folder), "it was never connected"
    shown = "[!!document.getElementById('stop'), document.querySelectorAll('[role=tab][aria-selected=true]').length]"
    assert await visitor.tab.run(shown) == [False, 1], "nothing can be stopped, and an instrument is open"


async def test_the_start_page_offers_robots_that_were_found_and_worlds_with_a_demo_that_runs(visitor, folder):
    async with program(folder, "simulate", "--tcp", "0") as served:
        url = served.split()[-1]
        await visitor.press("Look again")
        there = f"[...document.querySelectorAll('.first .choice')].find(each => each.textContent.startsWith({url!r}))"
        await visitor.tab.until(f"!!{there}")
        await visitor.tab.run(f"{there}.click()")
        await visitor.tab.until(f"{TICK}?.phase === 'connected'")
        await visitor.press("Disconnect")
    await visitor.click("[aria-label='another robot']")
    await visitor.tab.until("document.querySelector('.worlds img')?.naturalWidth > 100")
    card = "document.querySelector('.worlds [aria-label=arena]')"
    assert "Arena" in str(await visitor.tab.run(f"{card}.textContent"))
    assert len(str(await visitor.tab.run(f"{card}.querySelector('p').textContent"))) > 20
    await visitor.click(".worlds [aria-label=arena] button:nth-of-type(2)")  # its first demo
    await visitor.tab.until(
        f"[...elib.robots.values()].at(-1)?.play.value?.phase === 'running' && {TICK}.drive.may_move"
    )
    await visitor.key("Escape", "Escape")
    await visitor.tab.until("[...elib.robots.values()].at(-1).play.value.phase === 'stopped'")


async def test_two_pages_at_once_show_who_drives_and_hand_over(address, open_page, robot, driver):
    other = Driver(await open_page(address))
    await other.tab.size(1440, 900)
    await other.tab.until(f"!!document.querySelector('.pad') && {TICK}?.phase === 'connected'")
    await driver.push(0, 1)
    await other.tab.until("document.querySelector('.driver').textContent === 'Another browser drives this robot.'")
    await other.press("Take over …")
    await other.press("Take over")
    await robot.until_it_stands()
    await driver.tab.until("document.querySelector('.driver').textContent !== 'You drive.'")
    await driver.let_go()
    await other.click("[aria-label='another robot']")
    await other.tab.until(START)
    assert not await driver.tab.run(START), "each page shows what its person chose"
    assert other.tab.complaints == []
    await other.tab.close()


async def test_a_page_says_that_the_program_has_ended_and_connects_again_when_it_is_back(open_page, tmp_path):
    silent = "document.documentElement.dataset.silent"
    with held_port() as port:
        async with panel(tmp_path, port=port) as address:
            tab = await open_page(address)
            await tab.until(START)
            assert await tab.run(silent) != "yes"
        await tab.until(f"{silent} === 'yes'")
        await tab.until("document.querySelector('[role=alert]')?.textContent.includes('The program does not answer.')")
        async with panel(tmp_path, "sim://arena", port=port):
            await tab.until(f"{silent} === 'no' && {TICK}?.phase === 'connected'")
    await tab.close()


async def test_nothing_is_said_of_a_program_that_does_not_answer_while_the_page_opens(open_page, address):
    tab = await open_page("about:blank")
    await tab.call(
        "Page.addScriptToEvaluateOnNewDocument",
        source="const real = WebSocket; window.WebSocket = class extends real { constructor(...all) {"
        " const end = Date.now() + 1800; while (Date.now() < end); super(...all); } };"
        "window.seen = new Set(); new MutationObserver(() => seen.add(document.documentElement.dataset.silent))"
        ".observe(document, { attributes: true, subtree: true });",
    )
    await tab.go(address)
    await tab.until(START)
    assert await tab.run("[...seen].includes('yes')") is False
    await tab.close()


# -- what is in reach --


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
    assert {"STOP space", "Disconnect", "LED 0", "body light", "front LED", "Take picture", "Files"} <= seen
    assert any(str(each).startswith("driving pad") for each in seen)
    assert "unseen" not in seen


async def test_every_control_has_a_name_and_nothing_is_wider_than_the_screen(driver):
    unnamed = (
        "[...document.querySelectorAll('button, input, select, canvas, [role=switch], [role=application]')]"
        ".filter(e => e.offsetParent && e.getAttribute('aria-hidden') !== 'true' && !(e.getAttribute('aria-label')"
        " || e.textContent.trim() || e.labels?.length || e.closest('label') || e.title)).map(e => e.outerHTML)"
    )
    wide = (
        "[...document.querySelectorAll('.tile')].filter(t => t.offsetParent && t.scrollWidth > t.clientWidth)"
        ".map(t => t.getAttribute('aria-label'))"
    )
    unseen = (
        "[...document.querySelectorAll('.instruments .tile')].filter(t => !t.offsetParent)"
        ".map(t => t.getAttribute('aria-label'))"
    )
    for width in (1440, 1024, 390):
        await driver.tab.size(width, 800, phone=width < 720)
        await driver.tab.until(f"window.innerWidth === {width}")
        for tab in ("Sensors", "Charts", "Behaviours", "Console", "Events", "Link", "Files"):
            await driver.press(tab)
            assert await driver.tab.run(unnamed) == [], tab
            await driver.tab.until(f"document.documentElement.scrollWidth <= {width}")
            assert await driver.tab.run(wide) == [], (tab, width)
            if tab == "Sensors":
                assert await driver.tab.run(unseen) == [], width
        stop = await driver.tab.run(
            "(b => [b.top >= 0, b.bottom <= innerHeight])(document.getElementById('stop').getBoundingClientRect())"
        )
        assert stop == [True, True]


async def test_turning_a_phone_keeps_what_is_open(driver):
    await driver.tab.size(390, 844, phone=True)
    await driver.press("Charts")
    for width, height in ((844, 390), (390, 844), (1440, 900)):
        await driver.tab.size(width, height)
        await driver.tab.until(f"window.innerWidth === {width}")
        await driver.tab.until("document.querySelector('[role=tab][aria-selected=true]')?.textContent === 'Charts'")
        await driver.tab.until("!!document.querySelector('.chart canvas')")


async def test_a_button_that_goes_away_while_the_mouse_looks_for_it_is_clicked_when_it_is_back(open_page):
    tab = await open_page("about:blank")
    await tab.run(
        "void (window.button = document.createElement('button'), button.textContent = 'here', window.looks = 0,"
        " document.body.append(button), button.onclick = () => window.was = 'clicked',"
        " window.found = () => { if (++looks === 1) setTimeout(() => button.remove());"
        " else if (!button.isConnected) document.body.append(button); return button; })"
    )
    await tab.click("found()")
    assert await tab.run("was") == "clicked"
    await tab.close()


# -- charts, pictures and files --


async def test_a_chart_can_be_paused_before_anything_was_drawn(visitor):
    await visitor.enter("tcp://127.0.0.1:9")
    await visitor.press("Charts")
    await visitor.press("Pause charts")
    await visitor.press("Continue charts")
    await visitor.tab.until("!!document.querySelector('.chart canvas')")


async def test_a_chart_stands_while_it_is_paused_shows_a_longer_time_and_is_saved(driver):
    await driver.press("Charts")
    await driver.tab.until("!!document.querySelector('.chart canvas')")
    drawn = "document.querySelector('.chart canvas').toDataURL()"
    await driver.press("Pause charts")
    paused = "[...document.querySelectorAll('.charts button')].some(b => b.textContent === 'Continue charts')"

    async def half_a_second() -> None:
        ticks = await driver.tab.run(f"{TICK}.time")
        await driver.tab.until(f"{paused} && {TICK}.time > {ticks} + 0.5")
        await driver.tab.drawn()

    await half_a_second()  # what is shown from now on is drawn
    before = await driver.tab.run(drawn)
    await half_a_second()
    assert await driver.tab.run(drawn) == before
    await driver.press("Continue charts")
    await driver.tab.until(f"{drawn} !== {before!r}")
    await driver.click("[aria-label='show a longer time']")
    await driver.tab.until("document.querySelector('.charts output').textContent === '1 min'")
    await driver.tab.run(SAVING)
    await driver.press("CSV")
    await driver.tab.until("window.saved?.download === 'proximity.csv'")
    head, first, *_ = str(await driver.tab.run("blob.text()")).splitlines()
    assert head.startswith("seconds,")
    assert len(head.split(",")) == len(first.split(",")) == 9
    await driver.press("PNG")
    await driver.tab.until("window.saved.download === 'proximity.png'")
    assert await driver.tab.run("blob.type") == "image/png"


async def test_a_picture_is_saved_larger_and_as_png(driver):
    await driver.tab.run(SAVING)
    await driver.click("[aria-label='Take picture']")
    await driver.tab.until(f"{TICK}.picture !== null")
    await driver.click("[aria-label='Save PNG']:enabled")
    await driver.tab.until("window.saved?.download.endsWith('.png')")
    width = await driver.tab.run(
        "new Promise((done) => { const picture = new Image(); picture.onload = () => done(picture.width);"
        " picture.src = window.saved.href; })"
    )
    assert width > 40  # type: ignore[operator]
    assert width % 40 == 0, "each pixel is as large as every other"  # type: ignore[operator]


async def test_nobody_can_type_the_name_of_a_file_before_a_free_name_is_proposed(driver):
    await driver.tab.run(HELD_BACK)
    await driver.press("Files")
    field, start = (f"document.querySelector('section[aria-label=log] {each}')" for each in ("input", "button"))
    await driver.tab.until(f"window.held > 0 && !!{field}")
    assert await driver.tab.run(f"[{field}.disabled, {start}.disabled, {field}.value]") == [True, True, ""]
    await driver.tab.run("window.send()")
    await driver.tab.until(f"!{field}.disabled && {field}.value.endsWith('.log')")
    await type_into(driver, "section[aria-label=log] input", "drive")
    assert await driver.tab.run(f"[{field}.value, {start}.disabled]") == ["drive", False]


async def test_a_log_and_a_recording_are_written_to_the_files_that_were_named_also_when_armed_before(driver, folder):
    log, recording = "section[aria-label=log]", "section[aria-label=recording]"

    async def turn(section: str) -> None:
        # Not with the mouse: on a busy computer what is above may still move under it.
        button = f"document.querySelector('{section} button:enabled')"
        await driver.tab.until(f"!!{button}")
        await driver.tab.run(f"{button}.click()")

    await driver.press("Disconnect")
    await driver.tab.until(f"{TICK}.phase === 'disconnected'")
    await driver.press("Files")
    await type_into(driver, f"{log} input", "drive")
    await turn(log)
    await driver.tab.until(f"{TICK}.log !== null")
    await driver.press("Connect")
    await driver.tab.until(f"{TICK}.phase === 'connected'")
    await type_into(driver, f"{recording} input", "drive")
    await turn(recording)
    await driver.tab.until(f"{TICK}.recorder > 0")
    said = "document.querySelector('.status').textContent"
    await driver.tab.until(f"{said}.includes('writing a log') && {said}.includes('recording')")
    await driver.press("Console")
    await type_into(driver, "[aria-label=command]", "set_led 0 on")
    await driver.key("Enter", "Enter")
    await driver.tab.until(f"{TICK}.lamps.ring[0] === 1")
    await driver.press("Files")
    for row in (log, recording):
        await turn(row)
    await driver.tab.until(f"{TICK}.log === null && {TICK}.recorder === null")
    assert "set_led" in (folder / "drive.log").read_text()
    calls = [entry.data["command"] for entry in read_recording(folder / "drive.mcap").entries("/calls")]
    assert "set_led" in calls
    await driver.press("drive.mcap")
    shown = "elib.listed.value.find(({ key }) => key === elib.place.value.robot)"
    await driver.tab.until(f"{shown}?.url.includes('drive.mcap')")  # it opens in the same page


async def test_a_recording_is_held_scrubbed_and_goes_on(driver, folder):
    @simulated
    async def record_minutes() -> None:  # it does not end under the hands of a busy computer
        async with elib.open("sim://") as recorded:
            with recorded.record(folder / "minutes.mcap"):
                for second in range(600):
                    await recorded.set_led(0, second % 2)
                    await asyncio.sleep(1)

    await asyncio.to_thread(record_minutes)
    await driver.press("Files")
    await driver.press("minutes.mcap")
    await driver.tab.until(f"{TICK}?.phase === 'playing' && {TICK}.playback.length > 500")
    # A recording has nothing to stop: STOP is for the robots.
    await driver.tab.until("document.getElementById('stop').textContent.includes('STOP ALL')")
    await driver.click("[aria-label='Pause recording']")
    await driver.tab.until(f"{TICK}.playback.paused")
    line = "document.querySelector('.playback input')"
    await driver.tab.until(f"Number({line}.max) > 0")
    events = f"['input', 'change'].forEach(name => {line}.dispatchEvent(new Event(name)))"
    await driver.tab.run(f"{line}.value = {line}.max / 2, {events}, 0")
    await driver.tab.until(f"Math.abs({TICK}.playback.at - {TICK}.playback.length / 2) < 0.1")
    await driver.click("[aria-label='Go on']")
    await driver.tab.until(f"!{TICK}.playback.paused && {TICK}.playback.at > {TICK}.playback.length / 2 + 0.2")


async def test_what_a_recorder_noted_stands_among_the_events_of_its_recording(driver, folder):
    async with elib.open("sim://") as recorded:
        with recorded.record(folder / "noted.mcap") as recorder:
            recorder.note("three readings were not written", kind="recorder")
    await driver.press("Files")
    await driver.press("noted.mcap")
    await driver.tab.until("elib.listed.value[1]?.key === elib.place.value.robot")
    await driver.press("Events")
    said = "document.querySelector('.events .lines')?.textContent"
    await driver.tab.until(f"{said}?.includes('three readings were not written')")
    assert "playing noted.mcap" in str(await driver.tab.run(said)), "the very first line is there, too"


async def test_events_that_repeat_themselves_are_one_line_that_counts_and_opens(driver):
    await driver.press("Events")
    for led in range(3):
        lit = f"{{ robot: elib.place.value.robot, name: 'set_led', arguments: [{led}, 1] }}"
        await driver.tab.run(f"elib.ask('command', {lit})")
    line = "[...document.querySelectorAll('.events summary')].find(each => each.textContent.includes('set_led: ok'))"
    await driver.tab.until(f"{line}?.textContent.includes('set_led: ok × 3')")
    await driver.tab.run(f"{line}.click()")
    await driver.tab.until(f"{line}.parentElement.innerText.includes('set_led(2, 1): ok')")
    await type_into(driver, ".events input[type=search]", "set_led(1")
    await driver.tab.until("document.querySelectorAll('.events summary').length === 1")
    await driver.press("Clear")
    await driver.tab.until("document.querySelector('.events .lines').textContent === 'Nothing yet.'")


async def test_a_file_name_cannot_lead_out_of_the_folder(driver, folder):
    await driver.press("Files")
    await type_into(driver, "[aria-label='file of the log']", "../out")
    await driver.click("section[aria-label=log] button")
    await driver.tab.until("document.querySelector('.toast')?.textContent.includes('is not a name for a file')")
    assert not (folder.parent / "out.log").exists()


async def test_a_robot_can_be_stopped_while_the_page_asks_something(driver, robot):
    await driver.press("Behaviours")
    await driver.press("Start")
    await robot.until_it_moves(0.03)
    await driver.tab.run("document.querySelector(\"[aria-label='Remove from this page']\").click()")
    await driver.click("dialog button.stop")
    await robot.until_it_stands()
    assert await driver.tab.run("!!document.querySelector('dialog[open]')"), "the question is still there"


# -- the console and behaviours --


async def test_the_console_completes_sends_and_answers_in_text_and_never_in_markup(driver):
    await driver.press("Console")
    await type_into(driver, ".console input", "sele")
    await driver.tab.until("document.querySelector('.console li[role=option]')?.textContent === 'selector'")
    await driver.key("Tab", "Tab")
    assert await driver.tab.run("document.querySelector('.console input').value") == "selector "
    await driver.key("Enter", "Enter")
    await driver.tab.until("!!document.querySelector('.console .came')")
    await type_into(driver, ".console input", "<img src=x onerror=alert(1)>")
    await driver.key("Enter", "Enter")
    await driver.tab.until("!!document.querySelector('.console .bad')")
    assert await driver.tab.run("document.querySelectorAll('.console img').length") == 0


async def test_a_behaviour_drives_until_it_is_ended_and_space_never_sets_a_robot_in_motion(driver, robot):
    await driver.press("Behaviours")
    await driver.press("Start")
    await robot.until_it_moves(0.03)
    await driver.press("Show code")
    code = "document.querySelector('.code')?.shadowRoot?.querySelector('.cm-content')"
    await driver.tab.until(f"{code}?.textContent.includes('import Epuck') && !!{code}.querySelector('span')")
    seen = f"[{code}, {code}.querySelector('span')].map(each => getComputedStyle(each).color)"
    text, word = await driver.tab.run(seen)  # type: ignore[misc]
    assert text != word, "the policy of the page lets it have its colours"
    await driver.press("Pause behaviour")
    await robot.until_it_stands()
    await driver.press("Continue behaviour")
    await robot.until_it_moves(0.02)
    await driver.press("Pause behaviour")
    await robot.until_it_stands()
    await driver.tab.until("document.activeElement.textContent.trim() === 'Continue behaviour'")
    stood = robot.pose
    await driver.key(" ", "Space")  # once it was a click on the button that has the focus
    await driver.tab.until(f"{CHIP}.endsWith('stopped')")
    start = "[...document.querySelectorAll('button')].find(each => each.textContent.trim() === 'Start')"
    await driver.tab.until(f"!!{start}")
    await driver.tab.run(f"{start}.focus()")
    await driver.key(" ", "Space")
    await driver.press("Console")
    await type_into(driver, ".console input", "set_speed 1 1")
    await driver.tab.run("document.querySelector('.console button').focus()")
    await driver.key(" ", "Space")
    await robot.until_it_stands()
    assert far(stood, robot.pose) < 1e-6
    await driver.key("Enter", "Enter")
    await robot.until_it_moves()


async def test_options_of_a_behaviour_are_a_form_and_end_ends_it(driver, robot):
    await driver.press("Behaviours")
    await driver.tab.until("document.querySelectorAll('.options input').length > 0")
    await driver.press("Start")
    await robot.until_it_moves(0.02)
    await driver.press("End behaviour")
    await driver.tab.until(f"{CHIP}.endsWith('stopped')")
    await robot.until_it_stands()


async def test_the_lines_of_a_behaviour_stand_once_also_after_a_look_at_another_place(driver):
    robot = "[...elib.robots.values()][0]"
    one = "robots: [elib.listed.value[0].key]"
    await driver.tab.run(
        f"elib.ask('behave', {{ {one}, name: 'go-and-turn', options: {{ side: 0.02 }} }}).then(() => 0)"
    )
    await driver.tab.until(f"{robot}.play.value?.count > 0")
    await driver.tab.run(f"elib.ask('end_behaviour', {{ {one} }}).then(() => 0)")
    place = await driver.tab.run("location.hash")
    await driver.tab.run("location.hash = '#/start'")
    await driver.tab.until(START)
    ticks = await driver.tab.run(f"{robot}.history.length")
    await driver.tab.run(f"location.hash = {place!r}")
    await driver.tab.until(f"{robot}.history.length > {ticks} + 5")
    assert await driver.tab.run(f"{robot}.play.value.lines.length === {robot}.play.value.count")


# -- what is drawn --


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


# -- several robots --


async def test_each_robot_s_world_is_about_its_own_link_and_what_was_made_worse_is_taken_back(visitor):
    await visitor.connect_all("sim://crowd?robots=3", 3)
    tick = "elib.robots.get(elib.place.value.robot)?.tick.value"
    things = "document.querySelector(`[aria-label='thing in the world']`)"

    async def show(name: str) -> None:
        # In one step: the tabs are made again when the page shows another robot.
        tab = f"[...document.querySelectorAll('.place')].find(tab => tab.textContent === {name!r})"
        await visitor.tab.run(f"{tab}.click()")
        await visitor.tab.until(f"{things}?.selectedOptions[0]?.textContent === {name!r} && !!{tick}")

    async def choose(thing: str) -> None:
        await visitor.tab.run(f"(l => {{ l.value = {thing!r}; l.dispatchEvent(new Event('change')); }})({things})")

    await visitor.click(".world [aria-label=Details]")
    await show("epuck-3")
    await visitor.tab.until(f"{tick}.phase === 'connected'")
    own = str(await visitor.tab.run(f"{things}.value"))
    await choose("")
    await slide(visitor, "knob-ambient", 1000)
    await choose(own)
    await visitor.tab.until(f"{tick}.readings.ambient_light.values[0] < 1500")
    await slide(visitor, "knob-loss", 1)
    await visitor.tab.until(f"{tick}.readings.proximity.stale && {tick}.link.lost > 0")
    await show("epuck-1")
    await visitor.tab.until(f"{tick}.phase === 'connected' && !{tick}.readings.proximity.stale")
    await show("epuck-3")
    await visitor.tab.until("document.getElementById('knob-loss')?.value === '1'")
    await slide(visitor, "knob-loss", 0)
    await visitor.tab.until(f"{tick}.phase === 'connected' && !{tick}.readings.proximity.stale")
    await visitor.tab.run("document.getElementById('world-link').closest('details').open = true")
    await visitor.click("#world-link")
    await visitor.tab.until(f"{tick}.phase === 'gap'")
    await show("epuck-1")
    await show("epuck-3")
    await visitor.tab.until("document.getElementById('world-link')?.checked === true")
    await visitor.tab.run("document.getElementById('world-link').closest('details').open = true")
    await visitor.click("#world-link")
    await visitor.tab.until(f"{tick}.phase === 'connected'")


async def test_an_overview_of_twenty_robots_starts_blinks_opens_and_stops_them(visitor):
    await visitor.connect_all("sim://crowd?robots=20", 20)
    await visitor.tab.until("elib.worldOf().scene.value?.robots === 20")
    world, cards = [
        await visitor.tab.run(
            f"(b => [b.left, b.width, b.height])(document.querySelector({each!r}).getBoundingClientRect())"
        )
        for each in (".stage", ".cards")
    ]
    assert world[0] < cards[0]  # type: ignore[index]
    assert world[1] > 700  # type: ignore[index]
    other, choices = (
        "document.querySelector(`[aria-label='another robot']`)",
        "document.querySelector('.bar select').options",
    )
    assert await visitor.tab.run(f"{choices}.length") == 21, "twenty robots have one list, which begins with a hint"
    at = await visitor.middle("[aria-label='another robot']")
    there = f"{other}.contains(document.elementFromPoint({at[0]}, {at[1]}))"
    assert await visitor.tab.run(there), "another robot is in reach"
    # It blinks for two seconds: what was lit is noted by the page, because a look from outside may come too late.
    lit = "[...Array(20).keys()].filter(k => frame.ring.subarray(24 * k, 24 * k + 24).some(Boolean))"
    note = f"elib.worldOf().frame.subscribe(frame => frame && lit.add({lit}.join()))"
    await visitor.tab.run(f"window.lit = new Set(), {note}, 0")
    await visitor.click("[aria-label='let epuck-3 blink']")
    await visitor.tab.until("lit.has('2')")
    await visitor.tab.until("!document.querySelector('.cards [aria-busy]')")
    await visitor.press("Start for all")
    await visitor.tab.until(f"{OVERVIEW}.every(robot => robot.behaviour === 'avoid' && robot.may_move)")
    await visitor.key(" ", "Space")
    await visitor.tab.until(f"{OVERVIEW}.every(robot => robot.behaviour === '' && !robot.may_move)")
    poses = f"JSON.stringify({OVERVIEW}.map(robot => robot.pose))"
    await visitor.tab.run("window.heard = 0, elib.overview.subscribe(() => window.heard++), 0")

    async def stand() -> bool:
        before = await visitor.tab.run(poses)
        await visitor.tab.until("window.heard > 3")
        await visitor.tab.run("window.heard = 0")
        return await visitor.tab.run(poses) == before

    await until(stand)
    await visitor.press("epuck-20")  # its tab, which is scrolled there
    await visitor.tab.until(f"!!document.querySelector('.pad') && {TICK}.phase === 'connected'")
    assert await visitor.tab.run("document.querySelector('.status h1').textContent") == "epuck-20"
