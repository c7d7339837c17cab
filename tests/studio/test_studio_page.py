"""The page of the studio: what a person writes, runs, stops and finds again, in Chromium with keyboard and mouse."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio
from browser import Tab, browser, needs_browser
from studio_rig import Server
from test_labs import zipped

from elib.lab import load_lab

pytestmark = [pytest.mark.long, needs_browser, pytest.mark.asyncio(loop_scope="module")]

ROOT = "document.querySelector('.code').shadowRoot"
STATE = "elib.program.value.state"
READY = "window.elib?.loading.value === '' && !elib.isWaiting.value"
OUTPUT = "elib.lines.value.map(({ text }) => text).join('\\n')"
WRONG = """import elib

with elib.connect("sim://arena") as robot:
    robot.set_speed(3, 0)
"""
STEPS = """import elib

with elib.connect("sim://arena") as robot:
    robot.set_speed(0.3, 0.3)
    for turn in range(1000):
        robot.sleep(0.05)
"""

STYLES = {
    "blocking": """import elib

with elib.connect("sim://arena?seed=1") as robot:
    robot.set_speed(0.3, 0.3)
    for turn in range(3):
        near = robot.proximity()
        robot.sleep(0.1)
    print(robot.encoders(), robot.time)
""",
    "async": """import elib

async def main(robot):
    await robot.set_speed(0.3, 0.3)
    for turn in range(3):
        near = await robot.proximity()
        await robot.sleep(0.1)
    print(await robot.encoders(), robot.time)

elib.run(main, robot="sim://arena?seed=1")
""",
    "callbacks": """import elib

def seen(near, turn):
    global last
    if turn < 3:
        last = near
        robot.callback(seen, print, turn + 1).proximity()

with elib.connect("sim://arena?seed=1") as robot:
    robot.set_speed(0.3, 0.3)
    robot.callback(seen, print, 0).proximity()
    robot.sleep(0.5)
    print(robot.encoders(), robot.time)
""",
    "swarm": """import elib

async def wander(robot):
    await robot.set_speed(0.3, 0.3)
    for turn in range(3):
        near = await robot.proximity()
        await robot.sleep(0.1)
    return await robot.encoders(), robot.time

async def main(robots):
    print(sorted((await robots.all.run(wander)).values()))

elib.swarm("sim://crowd?robots=3&seed=1").run(main)
""",
}
"""Programs in each way to speak to a robot; line 6 runs several times, and line 7 after it."""


class Page:
    """The studio in a tab, and a person at it.

    Attributes:
        tab: The tab.
    """

    def __init__(self, tab: Tab) -> None:
        self.tab = tab

    async def show(self, name: str, text: str) -> None:
        """Show a program as a sample is shown, and wait until its lines are where they stay."""
        await self.tab.run(f"elib.borrow({json.dumps(name)}, {json.dumps(text)}, 'a test')")
        await self.tab.drawn()

    async def click(self, element: str) -> None:
        """Click an element, which is there when a JavaScript expression gives it."""
        await self.tab.click(element)

    async def take(self, text: str) -> None:
        """Take what the completion proposes, by Enter.

        The editor takes no Enter for 75 ms after it has shown something to choose: it may have been meant for the line.
        """
        proposed = f"{ROOT}.querySelector('.cm-tooltip-autocomplete')"
        later = f"new Promise((done) => setTimeout(done, 100, {proposed}))"
        await self.tab.until(f"{proposed} && {later}.then((same) => same === {proposed})")
        await self.tab.key("Enter", "Enter")
        await self.tab.until(f"elib.textNow().includes({text!r})")

    async def run(self) -> None:
        """Press Run, and wait until the page has heard it."""
        await self.tab.run("void (window.before = elib.program.value)")
        await self.click("document.querySelector('#run')")
        await self.tab.until("elib.program.value !== window.before")

    async def ended(self) -> str:
        """Wait until the program has ended, and return what it printed."""
        await self.tab.until(f"{STATE} === 'idle' && {READY}")
        await self.tab.drawn()
        return str(await self.tab.run(OUTPUT))


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def page(studio: Path) -> AsyncIterator[Page]:
    server = Server(studio)
    async with browser() as opener:
        tab = await opener(server.url)
        await tab.size(1440, 900)
        await tab.until(READY)
        page = Page(tab)
        yield page
    server.close()


async def test_what_is_typed_is_completed_saved_and_run(page: Page) -> None:
    await page.show("typed.py", "import elib\n\nwith elib.connect() as robot:\n    \n")
    await page.click(f"{ROOT}.querySelectorAll('.cm-line')[3]")
    await page.tab.key("End", "End")
    for letter in "robot.set_s":
        await page.tab.type(letter)
    await page.tab.until(f"{ROOT}.querySelector('[aria-selected=true]')?.innerText.includes('set_speed')")
    assert "rev/s" in str(await page.tab.until(f"{ROOT}.querySelector('.cm-completionInfo')?.innerText"))
    await page.take("robot.set_speed()")
    await page.tab.type("0.2, 0.2")
    await page.tab.until("localStorage['elib-program:typed.py']?.includes('set_speed(0.2, 0.2)')")
    await page.tab.key("End", "End")
    await page.tab.type("\n    print('it drove')")
    await page.run()
    assert "it drove" in await page.ended()
    assert "print" in str(await page.tab.run("localStorage['elib-program:typed.py']"))


async def test_a_mistake_stands_at_its_line_and_the_output_leads_there(page: Page) -> None:
    await page.show("wrong.py", WRONG)
    await page.run()
    assert "line 4" in await page.ended()
    line = await page.tab.until(f"{ROOT}.querySelector('.cm-wrong')?.innerText")
    note = await page.tab.run(f"{ROOT}.querySelector('.cm-wrong').dataset.note")
    assert "set_speed(3, 0)" in str(line)
    assert "left is 3 rev/s" in str(note)
    await page.click("document.querySelector('.lines .line')")
    await page.tab.until(f"{ROOT}.querySelector('.cm-activeLine').innerText.includes('set_speed')")
    await page.tab.type(" ")
    await page.tab.until(f"!{ROOT}.querySelector('.cm-wrong')")


async def test_a_breakpoint_holds_the_robot_and_shows_the_variables(page: Page) -> None:
    await page.show("steps.py", STEPS)
    await page.click(f"[...{ROOT}.querySelectorAll('.cm-lineNumbers > *')].find((line) => line.innerText === '6')")
    assert await page.tab.until("elib.breakpoints.value.length && elib.breakpoints.value") == [6]
    await page.run()
    await page.tab.until(f"{STATE} === 'paused'")
    assert "turn\t0" in str(await page.tab.until("document.querySelector('table')?.innerText"))
    time = await page.tab.run("elib.program.value.time")
    await page.click("document.querySelector('.steps > :nth-child(2)')")
    await page.tab.until(f"{STATE} === 'paused' && elib.program.value.line === 5")
    await page.run()
    await page.tab.until("document.querySelector('table')?.innerText.includes('turn\\t1')")
    assert await page.tab.run("elib.program.value.time") > time
    await page.tab.key("Escape", "Escape")
    await page.ended()


async def test_what_runs_neither_marks_nor_obeys_lines_of_another_program_that_is_opened_meanwhile(page: Page) -> None:
    await page.show("runs.py", WRONG.replace("3, 0", "0, 0") + "    robot.sleep(0.1)\n    robot.set_speed(3, 0)\n")
    await page.click(f"[...{ROOT}.querySelectorAll('.cm-lineNumbers > *')].find((line) => line.innerText === '4')")
    await page.run()
    await page.tab.until(f"{STATE} === 'paused'")
    await page.show("meanwhile.py", STEPS)
    assert not await page.tab.run(f"!!{ROOT}.querySelector('.cm-paused')")
    await page.tab.run("elib.open('runs.py')")
    assert "set_speed(0, 0)" in str(await page.tab.until(f"{ROOT}.querySelector('.cm-paused')?.innerText"))
    await page.show("meanwhile.py", STEPS)
    await page.click(f"[...{ROOT}.querySelectorAll('.cm-lineNumbers > *')].find((line) => line.innerText === '5')")
    await page.run()
    assert "line 6" in await page.ended()
    assert not await page.tab.run(f"!!{ROOT}.querySelector('.cm-wrong')")
    assert await page.tab.run(f"{ROOT}.querySelector('.cm-activeLine').innerText") == "import elib"


@pytest.mark.parametrize("style", STYLES)
async def test_a_program_in_each_style_is_stepped_while_the_time_of_its_robots_stands_still(
    page: Page, style: str
) -> None:
    await page.show(f"{style}.py", STYLES[style])
    await page.run()
    undisturbed = await page.ended()
    await page.click(f"[...{ROOT}.querySelectorAll('.cm-lineNumbers > *')].find((line) => line.innerText === '6')")
    await page.run()
    await page.tab.until(f"{STATE} === 'paused' && elib.program.value.line === 6")
    assert "turn\t0" in str(await page.tab.until("document.querySelector('table')?.innerText"))
    for _ in range(20):  # a while: each answer waits until the held program looks around
        await page.tab.run("elib.ask('set_breakpoints', { lines: [] })")
    await page.click("document.querySelector('.steps > :nth-child(2)')")
    await page.tab.until(f"{STATE} === 'paused' && elib.program.value.line === 7")
    await page.run()
    assert await page.ended() == undisturbed, "the robots lived on"


@pytest.mark.parametrize("work", ["while True: pass", "sum(range(10**12))", "while True: print('flood')"])
async def test_escape_ends_any_program_and_the_next_one_runs(page: Page, work: str) -> None:
    await page.show("endless.py", f"print('begun')\n{work}\n")
    await page.run()
    await page.tab.until(f"{STATE} === 'running' && ({OUTPUT} !== '' || elib.isSilent.value)")
    await page.tab.key("Escape", "Escape")
    await page.ended()
    assert await page.tab.run("elib.lines.value.length") <= 2000
    await page.show("next.py", "print('it goes on')\n")
    await page.run()
    assert "it goes on" in await page.ended()


async def test_the_page_forgets_the_robots_of_earlier_programs(page: Page) -> None:
    await page.show("again.py", "import elib\nelib.connect().proximity()\n")
    for _ in range(3):
        await page.run()
        await page.ended()
        key = await page.tab.until("elib.listed.value[0]?.key")
        await page.tab.until(f"elib.robots.get({json.dumps(key)})?.tick.value")
    assert await page.tab.run("elib.robots.size") == 1


async def test_a_program_imports_another_one_of_this_browser(page: Page) -> None:
    await page.tab.run("localStorage['elib-program:helper.py'] = 'number = 7\\n', 0")
    await page.show("user.py", "from helper import number\n\nprint(number)\n1 / 0\n")
    await page.run()
    assert (await page.ended()).startswith("7")
    assert await page.tab.run("document.querySelectorAll('.lines .line').length") == 1


async def test_a_link_is_read_and_neither_run_nor_put_over_a_program(page: Page) -> None:
    await page.show("mine.py", "print('mine')\n")
    link = str(await page.tab.run("(elib.save(true), elib.link())"))
    await page.tab.run("elib.edit('print(2)\\n')")
    await page.tab.until("localStorage['elib-program:mine.py'] === 'print(2)\\n'")
    await page.tab.go(link)
    await page.tab.until("document.querySelector('.note').innerText.startsWith('From a link')")
    assert await page.tab.run(f"[elib.textNow(), {STATE}]") == ["print('mine')\n", "idle"]
    await page.run()
    assert "mine" in await page.ended()
    kept = "['mine', 'mine-2'].map((name) => localStorage[`elib-program:${name}.py`])"
    assert await page.tab.run(kept) == ["print(2)\n", "print('mine')\n"]
    assert await page.tab.run("location.hash") == ""


async def test_a_broken_link_is_named_and_changes_nothing(page: Page) -> None:
    before = await page.tab.run("elib.textNow()")
    await page.tab.run("void (location.hash = '#program=a.py,AAAA')")
    await page.tab.until("document.querySelector('.toast')?.innerText.includes('broken')")
    assert await page.tab.run("elib.textNow()") == before


async def test_what_cannot_be_kept_is_said(page: Page) -> None:
    await page.show("large.py", "")
    await page.tab.run("elib.edit('#'.repeat(6e6))")
    assert "storage is full" in str(await page.tab.until("document.querySelector('.note.bad')?.innerText"))
    await page.tab.run("elib.edit('# small\\n')")
    await page.tab.until("document.querySelector('.note').innerText.startsWith('Saved')")


async def test_a_reload_brings_the_program_back(page: Page) -> None:
    await page.show("again.py", "")
    await page.tab.run("elib.edit('print(3)\\n')")  # and no pause before the reload
    await page.tab.reload()
    assert await page.tab.until("window.elib?.textNow()") == "print(3)\n"
    await page.tab.until(READY)
    assert page.tab.complaints == []


LABS = "[...document.querySelectorAll('header button')].find((each) => each.innerText === 'Labs')"
LAB = "[...document.querySelectorAll('.labs button')].find((each) => each.innerText.endsWith('{}'))"
REACHED = "document.querySelectorAll('.goals .good').length"


async def test_chosen_brackets_are_not_doubled_and_a_reading_has_its_fields(page: Page) -> None:
    await page.show("brackets.py", "import elib\n\nwith elib.connect() as robot:\n    near = robot.proximity()\n    \n")
    await page.click(f"{ROOT}.querySelectorAll('.cm-line')[4]")
    await page.tab.key("End", "End")
    for letter in "robot.":
        await page.tab.type(letter)
    assert await page.tab.until(f"{ROOT}.querySelector('[aria-selected=true]')?.innerText") == "drive"
    await page.take("robot.drive()")
    await page.tab.type("(")
    await page.tab.type("near.")
    await page.tab.until(f"{ROOT}.querySelector('.cm-tooltip-autocomplete')?.innerText.includes('front_left')")
    assert "robot.drive(near.)\n" in str(await page.tab.run("elib.textNow()"))


async def test_the_world_follows_the_text(page: Page) -> None:
    await page.show("world.py", "import elib\n\nelib.connect('sim://arena')\n")
    scene = "document.querySelector('section.world')?.ariaLabel"
    await page.tab.until(f"{scene} === 'world arena'")
    await page.tab.run("elib.change({ from: 33, to: 38, insert: 'maze' })")
    await page.tab.until(f"{scene} === 'world maze'")


async def test_a_check_shows_what_is_reached_and_an_error_at_its_line(page: Page) -> None:
    await page.click(LABS)
    await page.click(LAB.format("Go 10 cm"))
    await page.tab.until("elib.lab.value?.name === 'go-10-cm'")
    text = "import elib\nwith elib.connect() as robot:\n    robot.drive(0.1)\n"
    await page.tab.run(f"elib.change({{ from: 0, to: elib.textNow().length, insert: {json.dumps(text)} }})")
    await page.click(LAB.format("Check"))
    await page.tab.until("elib.report.value?.points === elib.report.value?.most && elib.report.value")
    await page.tab.until(f"{REACHED} === 3")
    await page.tab.run("elib.change({ from: elib.textNow().indexOf('drive'), insert: 'x' })")
    await page.click(LAB.format("Check"))
    await page.tab.until(f"{ROOT}.querySelector('.cm-wrong')?.dataset.note.includes('xdrive')")
    await page.tab.until(f"{REACHED} === 0")
    assert "xdrive" in await page.ended()
    # Another program is in no lab, and has no output of the one before.
    await page.tab.run("localStorage['elib-program:own.py'] = 'print(7)\\n', 0")
    await page.tab.run("elib.open('own.py')")
    await page.tab.until(f"elib.lab.value === null && {OUTPUT} === ''")
    await page.tab.until("document.querySelector('.labs')?.innerText.includes('Best check')")
    await page.click(LABS)


async def test_a_zipped_lab_is_still_there_after_a_program_that_had_to_be_ended(page: Page) -> None:
    lab = load_lab("go-10-cm").folder
    content = b64encode(zipped(lab)).decode()
    await page.click(LABS)
    await page.tab.until("[...document.querySelectorAll('.labs button')].at(-1)?.disabled === false")
    await page.tab.run(
        f"((data, input) => (data.items.add(new File([Uint8Array.fromBase64('{content}')], 'a.zip')),"
        " input.files = data.files, input.dispatchEvent(new Event('change', { bubbles: true }))))"
        "(new DataTransfer(), document.querySelector('.labs input'))"
    )
    await page.tab.until("elib.lab.value?.name === 'my-go-10-cm'")
    await page.tab.run("elib.change({ from: 0, to: elib.textNow().length, insert: 'sum(range(10**12))' })")
    await page.run()
    await page.tab.until(f"{STATE} === 'running' && elib.isSilent.value")
    await page.tab.key("Escape", "Escape")
    await page.tab.until(f"{STATE} === 'idle'")
    text = (lab / "teacher/solution.py").read_text()
    await page.tab.run(f"elib.change({{ from: 0, to: elib.textNow().length, insert: {json.dumps(text)} }})")
    await page.run()  # at once: it waits for Python
    await page.ended()
    await page.tab.until(f"{REACHED} === 3")
    await page.click(LAB.format("Check"))
    await page.tab.until("elib.report.value?.points === elib.report.value?.most && elib.report.value")
    await page.click(LABS)


async def test_what_is_not_kept_cannot_delete_a_program_of_its_name(page: Page) -> None:
    await page.tab.run("localStorage['elib-program:square.py'] = '# mine\\n', 0")
    await page.show("square.py", "# borrowed\n")
    button = "[...document.querySelectorAll('[popover] button')].find((each) => each.innerText === 'Delete')"
    assert await page.tab.run(f"{button}.disabled")
    await page.tab.run("elib.forget()")
    assert await page.tab.run("localStorage['elib-program:square.py']") == "# mine\n"


async def test_a_new_name_for_what_is_not_kept_leaves_the_program_of_the_old_one(page: Page) -> None:
    kept = "['lab', 'begun', 'two', 'ours'].map((name) => localStorage[`elib-program:${name}.py`])"
    await page.tab.run("localStorage['elib-program:lab.py'] = '# solved\\n', 0")
    await page.show("lab.py", "# from the beginning\n")
    await page.tab.run("elib.rename('begun.py')")
    await page.show("two.py", "# as it was\n")
    await page.tab.run("elib.save(true)")
    key = "elib-program:two.py"
    await page.tab.run(f"localStorage['{key}'] = '# by another window\\n', 0")
    await page.tab.run(f"dispatchEvent(new StorageEvent('storage', {{ key: '{key}' }}))")
    await page.tab.run("elib.rename('ours.py')")
    assert await page.tab.run(kept) == [
        "# solved\n",
        "# from the beginning\n",
        "# by another window\n",
        "# as it was\n",
    ]
    await page.tab.run("elib.rename('theirs.py')")
    assert await page.tab.run("[elib.name.value, elib.names.value.includes('ours.py')]") == ["theirs.py", False]


async def test_on_a_phone_nothing_is_cut_off(page: Page) -> None:
    await page.show("phone.py", STEPS)
    await page.run()
    await page.tab.size(390, 844, phone=True)
    tab = "[...document.querySelectorAll('.parts .tab')].find((each) => each.innerText === '{}')"
    await page.click(tab.format("Sensors"))
    part, main = "document.querySelector('.part')", "document.querySelector('main')"
    await page.tab.until(f"{part}?.scrollHeight > 400")
    assert await page.tab.run(f"{part}.clientHeight <= {part}.parentElement.clientHeight"), (
        "it cannot be scrolled to its end"
    )
    assert await page.tab.run(f"{main}.scrollWidth <= {main}.clientWidth"), "the page is wider than the screen"
    await page.click(tab.format("World"))
    await page.tab.size(1440, 900)
    await page.tab.key("Escape", "Escape")
    await page.ended()


async def test_a_program_that_is_stopped_while_it_is_paused_ends_by_itself(page: Page) -> None:
    await page.show("paused.py", STEPS)
    await page.click(f"[...{ROOT}.querySelectorAll('.cm-lineNumbers > *')].find((line) => line.innerText === '6')")
    await page.run()
    await page.tab.until(f"{STATE} === 'paused'")
    await page.tab.key("Escape", "Escape")
    assert "The program was stopped." in await page.ended()
