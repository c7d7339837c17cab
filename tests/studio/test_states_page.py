"""A machine of states, drawn in the studio by mouse alone and by keyboard alone: text and picture follow each other."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio
from browser import Tab, browser, needs_browser
from studio_rig import Server

pytestmark = [pytest.mark.long, needs_browser, pytest.mark.asyncio(loop_scope="module")]

READY = "window.elib?.loading.value === '' && !elib.isWaiting.value"
NOTHING = """import elib


def stand(robot, run):  # größer
    pass


elib.play(elib.states(stand), "sim://arena")
"""
AVOIDER = """import elib


def drive(robot, run):  # größer
    if run.entered:
        robot.set_speed(0.4, 0.4)
    distances = robot.distances()
    if distances.ahead < 0.04:
        return "turn"


def turn(robot, run):
    robot.turn(1)
    return "drive"


elib.play(elib.states(drive, turn), "sim://arena")
"""


class Hand:
    """What a person does with the picture.

    Attributes:
        tab: The page.
        is_mouse: Whether by the mouse, and not by keys.
    """

    def __init__(self, tab: Tab, *, is_mouse: bool) -> None:
        self.tab = tab
        self.is_mouse = is_mouse

    async def press(self, element: str) -> None:
        """Press what a JavaScript expression gives."""
        await self.settled()
        await self.tab.until(f"!!({element}) && !({element}).disabled")
        if self.is_mouse:
            await self.tab.click(element)
        else:
            await self.tab.run(f"({element}).focus()")  # as Tab does, as often as it takes
            await self.tab.key("Enter", "Enter")

    async def settled(self) -> None:
        """Wait until the picture shows the text as it is, and is drawn."""
        await self.tab.until("document.querySelector('.states')?.ariaBusy === 'false'")
        await self.tab.drawn()

    async def button(self, text: str) -> None:
        await self.press(
            f"[...document.querySelectorAll('.states button')].find((each) => each.innerText === '{text}')"
        )

    async def state(self, name: str) -> None:
        await self.press(f"document.querySelector('[data-state={name}]')")

    async def arrow(self, number: int) -> None:
        await self.press(f"document.querySelector('[data-arrow=\"{number}\"]')")

    async def field(self, label: str, value: str, nth: int = 0) -> None:
        """Write into the field with a label, and press Enter."""
        await self.settled()
        fields = f"[...document.querySelectorAll('.states .field')].filter((each) => each.innerText === '{label}')"
        await self.tab.until(f"{fields}.length > {nth}")
        await self.tab.run(f"(({{ lastChild: each }}) => (each.focus(), each.select()))({fields}[{nth}])")
        await self.tab.type(value)
        await self.tab.key("Enter", "Enter")

    async def choose(self, value: str, nth: int) -> None:
        """Choose from a list: its own menu is the browser's, so it is told what was chosen."""
        await self.settled()
        lists = "document.querySelectorAll('.states select')"
        await self.tab.until(f"[...({lists}[{nth}]?.options ?? [])].some((each) => each.value === '{value}')")
        change = "each.dispatchEvent(new Event('change', { bubbles: true }))"
        await self.tab.run(f"((each) => {{ each.value = '{value}'; {change}; }})({lists}[{nth}])")

    async def form(self, name: str) -> None:
        """Wait until the form of a state is shown."""
        await self.tab.until(f"!!document.querySelector('.form[aria-label=\"state {name}\"]')")

    async def reads(self, part: str) -> None:
        """Wait until the program has a part."""
        await self.tab.until(f"elib.textNow().includes({json.dumps(part)})")


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def tab(studio: Path) -> AsyncIterator[Tab]:
    server = Server(studio)
    async with browser() as opener:
        tab = await opener(server.url)
        await tab.size(1440, 900)
        await tab.until(READY)
        yield tab
    server.close()


async def show(tab: Tab, text: str) -> None:
    await tab.run(f"elib.borrow('drawn.py', {json.dumps(text)}, 'a test')")
    await tab.until("!!document.querySelector('.machine svg')")


@pytest.mark.parametrize("way", ["mouse", "keyboard"])
async def test_the_avoider_is_drawn_from_nothing_run_and_seen(tab: Tab, way: str) -> None:
    await show(tab, NOTHING)
    hand = Hand(tab, is_mouse=way == "mouse")
    await hand.state("stand")
    await hand.field("State", "drive")
    await hand.form("drive")
    await hand.choose("set_speed", 0)
    await hand.reads("set_speed(0.5, 0.25)")
    await hand.field("left, rev/s", "0.4")
    await hand.reads("set_speed(0.4, 0.25)")
    await hand.field("right, rev/s", "0,4")
    await hand.reads("set_speed(0.4, 0.4)")
    await hand.button("State")
    await hand.form("state_2")
    await hand.field("State", "turn")
    await hand.form("turn")
    await hand.press("document.querySelector('.states li [aria-label=Remove]')")
    await hand.reads("def turn(robot, run):\n    pass")
    await hand.choose("turn", 1)
    await hand.reads("    robot.turn(1.57)")
    await hand.field("angle, degrees", "57.2958")
    await hand.reads("    robot.turn(1)")
    await hand.button("Arrow")
    await hand.state("drive")
    await hand.reads('    robot.turn(1)\n    return "drive"')
    await hand.state("drive")
    await hand.button("Arrow")
    await hand.state("turn")
    await hand.choose("distances", 1)
    await hand.reads("distances.ahead < 0.04")
    assert await tab.run("elib.textNow()") == AVOIDER
    await tab.run("document.querySelector('#run').click()")
    await tab.until("document.querySelector('.lit')?.dataset.state === 'turn'")
    await tab.until("document.querySelector('.taken')?.dataset.source === 'drive'")
    await tab.until("document.querySelector('.lit')?.dataset.state === 'drive'")
    await tab.run("document.querySelector('#stop').click()")
    await tab.until("elib.program.value.state === 'idle'")


async def test_the_picture_follows_the_typing_and_one_history_takes_back_both(tab: Tab) -> None:
    await show(tab, AVOIDER)
    root = "document.querySelector('.code').shadowRoot"
    await tab.until(f"{root}.querySelectorAll('.cm-line').length > 8")
    hand = Hand(tab, is_mouse=True)
    await hand.press(f"[...{root}.querySelectorAll('.cm-line')].find((each) => each.innerText.includes('0.04'))")
    await tab.key("End", "End")
    await tab.key("ArrowLeft", "ArrowLeft")
    await tab.type("9")
    await tab.until("document.querySelector('[data-arrow=\"0\"]').textContent.includes('4.9 cm')")
    await hand.arrow(0)
    await hand.field("cm", "3")
    await hand.reads("distances.ahead < 0.03")
    await hand.press("document.querySelector('.states [aria-label=Undo]')")
    await hand.reads("distances.ahead < 0.049")
    await hand.press("document.querySelector('.states [aria-label=Undo]')")
    await tab.until(f"elib.textNow() === {json.dumps(AVOIDER)}")
    await tab.until("document.querySelector('[data-arrow=\"0\"]').textContent.includes('4 cm')")


@pytest.mark.parametrize("way", ["mouse", "keyboard"])
async def test_an_arrow_takes_several_conditions_that_must_all_hold(tab: Tab, way: str) -> None:
    await show(tab, AVOIDER)
    hand = Hand(tab, is_mouse=way == "mouse")
    await hand.arrow(0)
    await hand.button("And …")
    await hand.reads("if distances.ahead < 0.04 and run.time_in_state > 1:")
    await hand.field("seconds", "2.5")
    await hand.reads("if distances.ahead < 0.04 and run.time_in_state > 2.5:")
    await hand.choose("ground", 5)
    await hand.reads("ground = robot.ground()")
    await hand.reads("and ground[0] > 1:")
    await hand.choose("always", 1)
    await hand.reads("    if ground[0] > 1:")
    await hand.choose("image", 1)
    await hand.reads('    image = robot.image()\n    if image.find("red"):')
    await hand.choose("not seen", 3)
    await hand.reads('    if not image.find("red"):')
    assert "distances" not in await tab.run("elib.textNow()")


@pytest.mark.parametrize("target", ["turn", "drive"])
async def test_a_new_arrow_before_a_last_return_is_the_one_that_is_chosen(tab: Tab, target: str) -> None:
    last = 'return "turn" if distances.ahead < 0.04 else None'
    await show(tab, AVOIDER.replace('if distances.ahead < 0.04:\n        return "turn"', last))
    hand = Hand(tab, is_mouse=False)
    await hand.state("drive")
    await hand.button("Arrow")
    await hand.state(target)
    await hand.reads("run.time_in_state > 1")
    await hand.field("seconds", "2.5")
    await hand.reads(f'    if run.time_in_state > 2.5:\n        return "{target}"\n    {last}')


async def test_numbers_that_need_no_other_unit_stay_as_they_are_written(tab: Tab) -> None:
    counts = "encoders = robot.encoders()\n    if encoders.left > 12345:"
    await show(tab, AVOIDER.replace("distances = robot.distances()\n    if distances.ahead < 0.04:", counts))
    hand = Hand(tab, is_mouse=False)
    await hand.arrow(0)
    shown = "document.querySelector('[aria-label=\"condition 1\"] input')?.value"
    assert await tab.until(shown) == "12345"
    await hand.field("steps", "123456")
    await hand.reads("encoders.left > 123456:")
    await hand.button("And …")
    await hand.field("seconds", "100,25")
    await hand.reads("encoders.left > 123456 and run.time_in_state > 100.25:")


async def test_what_is_chosen_on_a_phone_stays_in_view(tab: Tab) -> None:
    await show(tab, AVOIDER + "#\n" * 50)
    await tab.size(390, 844, phone=True)
    await tab.drawn()
    await tab.run("document.querySelector('main').scrollTo(0, 0)")
    hand = Hand(tab, is_mouse=False)
    for name in ("turn", "drive"):
        await hand.state(name)
        await hand.form(name)
        await tab.drawn()
        line = "document.querySelector('.code').shadowRoot.querySelector('.cm-activeLine')?.innerText"
        await tab.until(f"{line}.startsWith('def {name}')")
    assert await tab.run("document.querySelector('main').scrollTop") == 0
    await tab.size(1440, 900)


async def test_a_text_that_is_wrong_keeps_the_last_picture_and_says_why(tab: Tab) -> None:
    await show(tab, AVOIDER)
    await show_text(tab, AVOIDER.replace('return "turn"', 'return "turn'))
    await tab.until("document.querySelector('.states [role=status]').innerText.includes('line 9')")
    assert await tab.run("!!document.querySelector('[data-state=drive]')")
    await show_text(tab, AVOIDER.replace('return "turn"', 'return "trun"'))
    await tab.until("document.querySelector('.states [role=status]').innerText.includes('trun')")


async def show_text(tab: Tab, text: str) -> None:
    """Write another text in place of the one before, as if it was typed."""
    await tab.run(f"elib.change({{ from: 0, to: elib.textNow().length, insert: {json.dumps(text)} }})")


async def test_a_state_that_is_dragged_stays_where_it_is_put(tab: Tab) -> None:
    await show(tab, AVOIDER)
    place = "(({ x, y, width, height }) => [x + width / 2, y + height / 2])"
    where = f"{place}(document.querySelector('[data-state=turn] rect').getBoundingClientRect())"
    x, y = await tab.run(where)
    for kind, dx in (("mouseMoved", 0), ("mousePressed", 0), ("mouseMoved", -30), ("mouseReleased", -30)):
        await tab.mouse(kind, x + dx, y - 2 * dx)
    await tab.until(f"{where}[1] > {where.replace('turn', 'drive')}[1] + 20")
    await tab.run("elib.borrow('other.py', 'import elib', 'a test')")
    assert "turn" in str(await tab.run("localStorage['elib-places:drawn.py']"))
