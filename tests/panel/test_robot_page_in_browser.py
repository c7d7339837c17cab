"""The page of one robot in a real browser: what is in view, how it is named, and what a click shows at once."""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

import pytest
import pytest_asyncio
from panel_rig import TICK, Driver, browser, needs_browser, panel

from shared import needs_page, until

pytestmark = [needs_browser, pytest.mark.long, pytest.mark.asyncio(loop_scope="module"), needs_page]

BOX = "(s => (b => [b.left, b.top, b.right, b.bottom])(document.querySelector(s).getBoundingClientRect()))"
TABS = ("Sensors", "Charts", "Behaviours", "Lights and sounds", "Console", "Events", "Link", "Files")
PICTURE = "!!document.querySelector('.frame canvas:not([hidden])')"


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def shown(tmp_path_factory) -> AsyncIterator[Callable]:
    async with browser() as open_page:

        @asynccontextmanager
        async def show(url: str, width: int = 1440, height: int = 900, *, phone: bool = False) -> AsyncIterator[Driver]:
            async with panel(tmp_path_factory.mktemp("panel"), url) as address:
                person = Driver(await open_page("about:blank"))
                await person.tab.size(width, height, phone=phone)
                await person.tab.go(address)
                await person.tab.until(
                    f"!!window.elib && {TICK}?.phase === 'connected' && !!document.querySelector('.pad')"
                )
                yield person
                assert person.tab.complaints == []
                await person.tab.close()

        yield show


async def is_in_view(person: Driver, selector: str, height: float) -> bool:
    left, top, right, bottom = await person.tab.run(f"{BOX}({selector!r})")  # type: ignore[misc]
    return 0 <= left < right <= await person.tab.run("innerWidth") and 0 <= top < bottom <= height


@pytest.mark.parametrize(("size", "world"), [((1440, 900), 450), ((1024, 768), 350)])
async def test_what_is_needed_while_driving_is_in_view_together(shown, size, world):
    async with shown("sim://arena", *size) as person:
        await person.tab.until(PICTURE)
        for tab in TABS:
            await person.press(tab)
            for part in (".stage", ".pad-card", ".pad", ".limit", ".camera-card", ".instrument", ".rail", "#stop"):
                await until(lambda part=part: is_in_view(person, part, size[1]))
        for part, height in ((".stage", world), (".instrument", 600)):
            box = await person.tab.run(f"{BOX}({part!r})")
            assert box[3] - box[1] > height  # type: ignore[index]
        assert await person.tab.run("document.documentElement.scrollWidth") <= size[0]


async def test_pad_camera_and_stop_are_in_view_on_a_phone_and_the_rest_behind_tabs(shown):
    async with shown("sim://arena", 390, 844, phone=True) as person:
        views = "[...document.querySelectorAll('.stage, .camera-card, .instrument')].map(each => each.ariaLabel)"
        for tab in ("World", *TABS, "Camera"):
            await person.press(tab)
            await person.tab.until(f"{views}.join().toLowerCase() === {tab.lower()!r}")
            for part in (".pad", "#stop", ".rail"):
                await until(lambda part=part: is_in_view(person, part, 844))
            await person.tab.until("document.documentElement.scrollWidth <= 390")
        await person.tab.until(PICTURE)
        await until(lambda: is_in_view(person, ".frame", 844))
        pad, stop = [await person.tab.run(f"{BOX}({part!r})") for part in (".pad", "#stop")]
        assert pad[2] < stop[0], "one thumb drives, the other one stops"  # type: ignore[index]


async def test_a_click_is_acknowledged_at_once_on_a_slow_link(shown):
    async with shown("sim://arena?latency=0.1") as person:
        await person.tab.run("location.hash = '#/robot/1/lights'")
        await person.tab.until("!!document.querySelector('.lights button:enabled')")
        # The page draws what a click changed before it hears anything: only then no answer can have come.
        seen = await person.tab.run(
            "(async () => { const buttons = ['All on', 'Ha', 'Take picture'].map(text =>"
            " [...document.querySelectorAll('button')].find(b => [b.textContent, b.ariaLabel].includes(text)));"
            " buttons.forEach(b => b.click()); for (let k = 0; k < 10; k++) await null;"
            " return buttons.map(b => b.getAttribute('aria-busy')); })()"
        )
        assert seen == ["true"] * 3
        await person.tab.until("!document.querySelector('.lights [aria-busy]')")
        await person.tab.until(f"{TICK}.lamps.ring.every(Boolean)")


async def test_space_stops_and_switches_nothing_that_has_the_focus(shown):
    async with shown("sim://arena") as person:
        await person.tab.run("location.hash = '#/robot/1/lights'")
        await person.tab.until("!!document.querySelector('.lights button:enabled')")
        for selector in ("[aria-label='LED 2']", ".lights button", ".status button"):
            await person.tab.run(f"document.querySelector({selector!r}).focus()")
            await person.key(" ", "Space")
        # Had a space switched anything, the robot would have been told before it is told this.
        await person.tab.run("document.querySelector(`[aria-label='LED 2']`).focus()")

        async def alone_is_lit() -> bool:
            if await person.tab.run(f"{TICK}.lamps.ring.join() === '0,0,1,0,0,0,0,0'"):
                return True
            await person.key("Enter", "Enter")  # again, where a stop that is still under way has put the ring out
            await person.tab.until("!document.querySelector('.robot [aria-busy]')")
            ticks = await person.tab.run(f"{TICK}.time")
            await person.tab.until(f"{TICK}.time > {ticks}")
            return False

        await until(alone_is_lit)
        assert await person.tab.run(f"{TICK}.phase") == "connected"


@pytest.mark.parametrize("firmware", ["btcom-1.1.3", "epuck2"])
async def test_the_live_picture_is_in_colour_and_leds_stay_lit_when_it_is_changed(shown, firmware):
    async with shown(f"sim://arena?firmware={firmware}") as person:
        await person.tab.until(f"{TICK}.picture?.mode === 'COLOUR' && {TICK}.live === 0.5")
        await person.click("[aria-label='LED 2']")
        await person.tab.until(f"{TICK}.lamps.ring[2] === 1")
        await person.tab.run(
            "(() => { const mode = document.querySelector('.camera-card option[value=GREY]').parentElement;"
            " mode.value = 'GREY'; mode.dispatchEvent(new Event('change')); return 0; })()"
        )
        await person.tab.until(f"{TICK}.picture.mode === 'GREY'")
        await person.tab.until(f"{TICK}.lamps.ring[2] === 1")


async def test_sensors_and_leds_are_named_in_the_drawing_and_sounds_and_colours_have_controls(shown):
    async with shown("sim://arena?firmware=epuck2") as person:
        await person.tab.until("document.querySelector('.status .facts').textContent.includes('battery')")
        assert " V" in str(await person.tab.run("document.querySelector('.status .facts span').title"))
        names = await person.tab.run(
            "[...document.querySelectorAll('.robot text, .robot .lamp title')].map(t => t.textContent)"
        )
        assert {f"{kind}{number}" for kind in ("IR", "LED ") for number in range(8)} <= set(names)  # type: ignore[arg-type]
        title = str(await person.tab.run("document.querySelectorAll('.robot .sensor title')[2].textContent"))
        assert title.startswith("IR2, right: ")
        tiles = await person.tab.run("[...document.querySelectorAll('.tile')].map(t => t.textContent)")
        assert any("Button" in tile and "no" in tile for tile in tiles)  # type: ignore[union-attr]
        assert any("SD card" in tile and "no" in tile for tile in tiles)  # type: ignore[union-attr]
        assert any("steps" in tile and "cm" in tile for tile in tiles)  # type: ignore[union-attr]
        await person.tab.run("location.hash = '#/robot/1/lights'")
        await person.tab.until("!!document.querySelector(`[aria-label='colour of LED3']:enabled`)")
        await person.tab.run(
            "(() => { const colour = document.querySelector(`[aria-label='colour of LED3']`);"
            " colour.value = '#00ff00'; colour.dispatchEvent(new Event('change')); return 0; })()"
        )
        await person.tab.until(f"{TICK}.lamps.rgb[1].join() === '0,100,0'")
        await person.press("Star Wars")
        await person.press("Stop sound")
