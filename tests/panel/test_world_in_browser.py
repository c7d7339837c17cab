"""The page's world in a real browser: it shows the world as it is, and what is done there happens in the world."""

import contextlib
import io
import itertools
import math
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
import pytest_asyncio
from browser import Opener, Tab, needs_browser
from panel_rig import panel, virtual_robot
from PIL import Image
from world_page_rig import PAINT, ROOM, Rig, simulated, watched

from elib.link.protocol.tags import find
from elib.link.transport import open_transport
from elib.panel.panel import WORLD as RIGHTS
from elib.panel.panel import Panel
from elib.panel.server.http import own_address, served
from elib.simulator.emulator.control import Control
from elib.simulator.worlds.files import load_file
from shared import needs_page, until

pytestmark = [needs_browser, pytest.mark.long, pytest.mark.asyncio(loop_scope="module"), needs_page]

SIZE = 1440, 900
STAGE = "document.querySelector('canvas[role=application]')?.stage"
"""Where the page draws the world."""
WORLD = "elib.worldOf()"
"""What the page knows of the world."""
SELECTED = f"({WORLD}.selected.value?.key ?? '')"
NUMBER = f"({WORLD}.frame.value?.number ?? 0)"
NOSE = (250, 250, 246)
"""Colour of the arrow on a robot."""
HELD_BACK = """
    const real = WebSocket.prototype.send, held = [];
    WebSocket.prototype.send = function (text) {
        const message = JSON.parse(text);
        if (!["cut", "set_faults"].includes(message.do)) return real.call(this, text);
        held.push(() => {
            const answer = { type: "answer", id: message.id, ok: false, error: { code: "", message: "no", hint: "" } };
            this.dispatchEvent(new MessageEvent("message", { data: JSON.stringify(answer) }));
        });
    };
    window.refuse = () => {
        held.forEach((each) => each());
        WebSocket.prototype.send = real;
    };
"""
"""Lets what the page asks of a link wait until the test has it refused; then the page is as it was."""
NO_WEBGL = """
    for (const { prototype } of [HTMLCanvasElement, OffscreenCanvas]) {
        const real = prototype.getContext;
        prototype.getContext = function (kind, ...all) {
            return kind.includes("webgl") ? null : real.call(this, kind, ...all);
        };
    }
"""
STEPS_OF_PATH = """
    const robot = elib.robots.get("1"), { prototype } = CanvasRenderingContext2D;
    let steps = 0;
    for (const name of ["fillRect", "clearRect", "drawImage", "moveTo"]) {
        const real = prototype[name];
        prototype[name] = function (...all) { steps++; return real.apply(this, all); };
    }
    const tick = robot.tick.value;
    robot.take = () => {};  // only what the test says is drawn
    window.drive = async (ways) => {
        const found = [];
        for (const x of ways) {
            steps = 0;
            robot.trail = [...robot.trail, [x, 0]];
            robot.tick.value = { ...tick, pose: [x, 0, 0], trail: { whole: false, points: [] } };
            await new Promise((done) => setTimeout(done));
            robot.tick.value = { ...robot.tick.value };  // what is to be drawn is drawn before the next change
            await new Promise((done) => setTimeout(done));
            found.push(steps);
        }
        return found;
    };
    0
"""
"""Drives along the x axis, and counts for each place what is painted."""
MET = """
    (() => {
        const canvas = document.querySelector(".path canvas"), { width, height } = canvas,
            copy = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
        copy.drawImage(canvas, 0, 0);
        const { data } = copy.getImageData(0, 0, width, height),
            scale = Math.min(width - 40, height - 40) / 0.2, found = [];
        canvas.style.color = "var(--wall)";
        const wall = getComputedStyle(canvas).color.match(/\\d+/g).map(Number);
        for (let k = 0; k < data.length; k += 4)
            if (wall.every((part, each) => data[k + each] === part))
                found.push([((k / 4) % width - width / 2) / scale, (height / 2 - Math.floor(k / 4 / width)) / scale]);
        return found;
    })()
"""
"""Where the path of a robot that has not moved shows that something is there, m."""


AS_IT_WAS = """{
    const isOpen = "[aria-label=Details][aria-expanded=true], [aria-label=Rays]:checked";
    document.querySelectorAll(isOpen).forEach((each) => each.click());
    elib.toasts.value = [];
}"""
"""Closes what outlives a world on the page."""


def named(label: str) -> str:
    """Return where on the page something of that name is."""
    return f'document.querySelector(`[aria-label="{label}"]`)'


BACKGROUND = "getComputedStyle(document.body).backgroundColor"
DARK, LIGHT = "rgb(14, 17, 22)", "rgb(243, 244, 247)"
THINGS = named("thing in the world")
SPEED = named("speed of the world")
EYE = named("through the robot's camera")


@dataclass
class Screen:
    """A page that tests share: each of them gives it a world of its own.

    Attributes:
        panel: What serves the page.
        url: Where it is.
        tab: The page.
    """

    panel: Panel
    url: str
    tab: Tab
    _keys: Iterator[int] = field(default_factory=itertools.count)

    @contextlib.contextmanager
    def shows(self, control: Control) -> Iterator[None]:
        """Have the page show a world, and nothing that it knew of an earlier one."""
        self.panel.worlds = {f"world-{next(self._keys)}": control}
        try:
            yield
        finally:
            self.panel.worlds = {}  # the page then draws nothing more


@contextlib.asynccontextmanager
async def screen(folder: Path, open_page: Opener, before: str = "") -> AsyncIterator[Screen]:
    """Open a page of the usual size that has no world yet; a script may run before it."""
    panel = Panel(can=RIGHTS, folder=folder)
    async with served(panel, own_address("0")) as server, visiting(open_page, "about:blank") as tab:
        await tab.call("Page.addScriptToEvaluateOnNewDocument", source=before)
        await tab.go(server.url)
        yield Screen(panel, server.url, tab)


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def usual_screen(folder, open_page) -> AsyncIterator[Screen]:
    async with screen(folder, open_page) as found:
        yield found


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def flat_screen(folder, open_page) -> AsyncIterator[Screen]:
    async with screen(folder, open_page, NO_WEBGL) as found:
        yield found


@pytest.fixture
def is_flat() -> bool:
    """Whether the browser has no WebGL, unless a test says it."""
    return False


@pytest.fixture
def world() -> str:
    """The file of the world, unless a test says it."""
    return ROOM


@pytest.fixture
def shared_screen(request, is_flat) -> Screen:
    return request.getfixturevalue("flat_screen" if is_flat else "usual_screen")


@pytest_asyncio.fixture(loop_scope="module")
async def rig(shared_screen, world, tmp_path) -> AsyncIterator[Rig]:
    """A new world, which the page shows."""
    async with simulated(tmp_path, world) as (control, robots):
        with shared_screen.shows(control):
            yield Rig(control, robots, shared_screen.url)


@contextlib.asynccontextmanager
async def visiting(open_page: Opener, url: str) -> AsyncIterator[Tab]:
    """Open a page of the usual size, on which nothing may be complained of."""
    tab = await open_page(url)
    await tab.size(*SIZE)
    yield tab
    await tab.close()
    assert tab.complaints == []


@pytest_asyncio.fixture(loop_scope="module")
async def tab(rig, shared_screen, is_flat) -> AsyncIterator[Tab]:
    """The page, with frames on the screen, and the world from above."""
    tab = shared_screen.tab
    (key,) = shared_screen.panel.worlds
    await tab.until(f"window.elib && {WORLD}.of === '{key}' && {WORLD}.scene.value !== null")
    await shows_world(tab)
    if not is_flat:
        await from_above(tab)
    yield tab
    await tab.run(AS_IT_WAS)
    complaints, tab.complaints = tab.complaints, []  # each test answers for its own
    assert complaints == []


async def shows_world(tab: Tab) -> None:
    """Wait until a world with its robots is on the screen."""
    await tab.until(f"window.elib && {NUMBER} > 2 && {STAGE}?.drawn > 0")


async def from_above(tab: Tab) -> None:
    """Look from above, and wait until the camera rests and the picture has the size of its place."""
    await press(tab, "from above")
    await tab.until(f"{STAGE}.slant === 0 && {STAGE}.width === {STAGE}.canvas.clientWidth && {STAGE}.width > 0")


async def pixel(tab: Tab, x: float, y: float) -> tuple[int, ...]:
    """Return the colour on the screen at a place of the world, m."""
    data = await tab.run(
        f"(() => {{ const stage = {STAGE}, copy = document.createElement('canvas'); stage.draw();"
        f" const [left, top] = stage.toPixel({x}, {y}), pen = copy.getContext('2d');"
        " copy.width = copy.height = 1; pen.imageSmoothingEnabled = false;"
        " const shown = document.querySelector('canvas.world-picture') ?? stage.canvas;"
        " pen.drawImage(shown, -Math.floor(left), -Math.floor(top), stage.width, stage.height);"
        " return [...pen.getImageData(0, 0, 1, 1).data]; })()"
    )
    return tuple(data)[:3]


async def on_page(tab: Tab, x: float, y: float) -> tuple[float, float]:
    """Return where on the page a place of the world is, pixels."""
    left, top = await tab.run(
        f"(() => {{ const box = {STAGE}.canvas.getBoundingClientRect(), [left, top] = {STAGE}.toPixel({x}, {y});"
        " return [box.left + left, box.top + top]; })()"
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
    """Choose a thing in the list of the details, which are opened if they are not."""
    details = "[aria-label=Details]"
    if await tab.run(f"document.querySelector('{details}').ariaExpanded") != "true":
        await press(tab, "Details")
    await tab.until(THINGS)
    await set_value(tab, THINGS, key)


async def press(tab: Tab, text: str) -> None:
    """Click what is named so in the world's part of the page."""
    controls = "[...document.querySelectorAll('.world :is(button, input)')]"
    found = f"{controls}.find((each) => (each.ariaLabel ?? each.textContent) === {text!r} && !each.disabled)"
    await tab.until(f"!!{found}")
    await tab.run(f"{found}.click()")


async def unfold(tab: Tab, title: str) -> None:
    """Open a group of the details."""
    await tab.run(
        "[...document.querySelectorAll('.world summary')].find((each) => "
        f"each.textContent === {title!r}).parentElement.open = true"
    )


async def set_value(tab: Tab, control: str, value: object) -> None:
    """Put a slider or a list, given by a JavaScript expression, to a value."""
    await tab.run(
        f"(control => {{ control.value = '{value}';"
        f" for (const kind of ['input', 'change']) control.dispatchEvent(new Event(kind)); }})({control})"
    )


async def set_slider(tab: Tab, name: str, value: float) -> None:
    """Put a slider of the details to a value, as soon as it is there."""
    knob = f"document.getElementById('{name}')"
    await tab.until(f"!!{knob}")
    await set_value(tab, knob, value)


async def test_the_page_shows_the_world_without_a_complaint_and_asks_nobody_else(rig, tab):
    world = rig.control.world
    for index in range(2):
        pose = world.pose(index)
        # The middle of the arrow, and the board behind it where the arrow is not.
        tip = 0.1 * 0.037
        assert await pixel(tab, pose.x + tip * math.cos(pose.heading), pose.y + tip * math.sin(pose.heading)) == NOSE
        back = -0.45 * 0.037
        assert await pixel(tab, pose.x + back * math.cos(pose.heading), pose.y + back * math.sin(pose.heading)) != NOSE
    red, green, blue = await pixel(tab, 0.97, 0.2)
    assert red > 2 * green > 0, "the red box"
    assert red > 2 * blue
    assert await pixel(tab, 0.3, 0.25) != NOSE
    rig.control.move_robot(0, 0.2, 0.2, math.pi)
    await tab.until(f"Math.abs({WORLD}.shown('robot', performance.now() / 1000)[0] - 0.2) < 1e-3")
    assert await pixel(tab, 0.2 - tip, 0.2) == NOSE
    assert await pixel(tab, 0.4, 0.4) != NOSE
    assert await tab.run("!!document.querySelector(`section[aria-label='world room']`)")
    own = (f"http://{rig.host}/", f"ws://{rig.host}/", "data:")  # what "data:" names is in the address itself
    assert tab.requests
    assert [each for each in tab.requests if not each.startswith(own)] == []


async def test_a_robot_is_dragged_to_another_place_and_never_into_something(rig, tab):
    await drag(tab, (0.4, 0.4), (0.3, 0.2))
    await until(lambda: is_at(rig.control.world.pose(0), 0.3, 0.2))
    assert await tab.run(SELECTED) == "robot:0"
    await drag(tab, (0.8, 0.5), (1.0, 0.2))
    await tab.until("document.querySelector('.world-said').textContent.includes('is in the way')")
    assert not is_at(rig.control.world.pose(1), 1.0, 0.2, within=0.05)
    await drag(tab, (1.0, 0.2), (0.9, 0.1))
    await until(lambda: is_at(rig.control.snapshot().boxes[0], 0.9, 0.1))
    await drag(tab, (1.1, 0.7), (0.6, 0.6))
    await until(lambda: is_at(rig.control.snapshot().lights[0], 0.6, 0.6))


async def test_the_panel_switches_link_faults_and_lights_and_shows_readings(rig, tab):
    rig.control.move_robot(0, 0.045, 0.4, math.pi)
    await choose(tab, "robot:0")
    await tab.until("+document.querySelectorAll('.world .bars span')[1]?.textContent > 500")  # the wall at its nose
    await set_slider(tab, "knob-loss", 0.25)
    await set_slider(tab, "knob-latency", 0.5)
    await until(lambda: (rig.control.link(0).loss, rig.control.link(0).latency) == (0.25, 0.5))
    await tab.run("document.getElementById('world-link').click()")
    await until(lambda: rig.control.is_cut(0))
    await tab.until(f"{WORLD}.frame.value.bits[0] & 8")
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
    await tab.until(f"{WORLD}.readings.value?.link.cut === false")
    await tab.run(HELD_BACK)
    await tab.run("document.getElementById('world-link').click()")
    await set_slider(tab, "knob-loss", 0.25)
    before = await tab.run(NUMBER)
    await tab.until(f"{NUMBER} > {before} + 6")  # readings come with every third
    assert await tab.run("document.getElementById('world-link').checked") is True
    assert await tab.run("document.getElementById('knob-loss').valueAsNumber") == 0.25
    await tab.run("window.refuse()")
    await tab.until("document.getElementById('knob-loss').valueAsNumber === 0")  # the truth again
    await tab.until("document.getElementById('world-link').checked === false")


async def test_the_keyboard_selects_moves_and_turns(rig, tab):
    await tab.run(f"{STAGE}.canvas.focus()")
    await tab.key("n")
    assert await tab.run(SELECTED) == "robot:0"
    await tab.key("ArrowRight")
    await until(lambda: abs(rig.control.world.pose(0).x - 0.41) < 1e-6)
    await tab.until(f"Math.abs({WORLD}.frame.value.poses[0] - 0.41) < 1e-6")
    await tab.key("ArrowUp", shift=True)
    await until(lambda: abs(rig.control.world.pose(0).y - 0.45) < 1e-6)
    await tab.until(f"Math.abs({WORLD}.frame.value.poses[1] - 0.45) < 1e-6")
    await tab.key("[")
    await until(lambda: abs(rig.control.world.pose(0).heading - math.pi / 12) < 1e-6)
    await tab.key("p")
    assert await tab.run(SELECTED) == ""


async def test_on_a_phone_nothing_sticks_out_and_both_themes_are_there(open_page, tmp_path):
    # A page of its own: it remembers the theme that was chosen.
    async with watched(tmp_path) as rig, visiting(open_page, rig.url) as tab:
        await shows_world(tab)
        await from_above(tab)
        await choose(tab, "robot:0")
        for width, height, dark in ((390, 844, True), (390, 844, False), (320, 568, False)):
            await tab.size(width, height, dark=dark, phone=True)
            await tab.until(f"document.documentElement.clientWidth === {width}")
            await tab.until(f"document.documentElement.scrollWidth <= {width}")
            await tab.until(f"document.documentElement.dataset.theme === '{'dark' if dark else 'light'}'")
            await tab.until(f"{STAGE}.width > {0.8 * width} && {STAGE}.scale * 1.2 > {0.7 * width}")
            assert await tab.run(BACKGROUND) == (DARK if dark else LIGHT)
        for chosen in (DARK, LIGHT):
            await tab.run(f"{named('switch between light and dark')}.click()")
            await tab.until(f"{BACKGROUND} === '{chosen}'")


async def test_everything_that_can_be_worked_has_a_name_for_those_who_listen(tab):
    await choose(tab, "robot:1")
    await unfold(tab, "Link of this robot")
    tree = (await tab.call("Accessibility.getFullAXTree"))["nodes"]
    worked = ("button", "slider", "checkbox", "radio", "switch", "combobox", "application")
    roles = [(node["role"]["value"], node.get("name", {}).get("value")) for node in tree if not node.get("ignored")]
    found = [(role, name) for role, name in roles if role in worked]
    assert {role for role, _ in found} >= {"button", "slider", "checkbox", "radio", "switch", "application"}
    assert [role for role, name in found if not name] == []


async def test_a_connection_that_breaks_is_said_and_made_anew(tab):
    # It may be so short a time without a connection that no question from outside falls into it.
    await tab.run(
        "window.seen = new Set(); new MutationObserver(() => seen.add(document.documentElement.dataset.silent))"
        ".observe(document.documentElement, {attributes: true})"
    )
    await tab.run("const { send } = WebSocket.prototype; WebSocket.prototype.send = function () { this.close(); }")
    await tab.until("seen.has('yes')")
    await tab.run("WebSocket.prototype.send = send")
    await tab.until("document.documentElement.dataset.silent === 'no'")
    seen = await tab.run(NUMBER)
    await tab.until(f"{NUMBER} > {seen}")


async def test_the_wheel_the_buttons_and_a_drag_on_the_floor_change_what_is_in_view(rig, tab):
    whole = await tab.run(f"{STAGE}.scale")
    x, y = await on_page(tab, 0.4, 0.4)
    await tab.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-300)
    await tab.until(f"{STAGE}.scale > {1.5 * whole}")
    assert await on_page(tab, 0.4, 0.4) == pytest.approx((x, y), abs=1.5), "what is under the pointer stays there"
    await press(tab, "zoom in")
    await tab.until(f"{STAGE}.zoom > 2")
    before = rig.control.snapshot()
    left, top = await on_page(tab, 0.5, 0.3)
    await tab.mouse("mousePressed", left, top)
    await tab.mouse("mouseMoved", left - 20, top)
    await tab.mouse("mouseMoved", left - 40, top)
    await tab.mouse("mouseReleased", left - 40, top)
    assert await on_page(tab, 0.5, 0.3) == pytest.approx((left - 40, top), abs=1)
    after = rig.control.snapshot()
    assert [robot.pose for robot in after.robots] == [robot.pose for robot in before.robots]
    await press(tab, "zoom out")
    await press(tab, "Fit")
    await tab.until(f"{STAGE}.scale === {whole}")
    await tab.run(f"{STAGE}.canvas.focus()")
    await tab.key("+")
    assert await tab.run(f"{STAGE}.zoom") > 1
    await tab.key("0")
    assert await tab.run(f"{STAGE}.zoom") == 1


async def test_two_fingers_pinch(tab):
    x, y = await on_page(tab, 0.4, 0.25)
    for kind, apart in (("touchStart", 30), ("touchMove", 40), ("touchMove", 80), ("touchEnd", 0)):
        points = [{"x": x - apart, "y": y, "id": 1}, {"x": x + apart, "y": y, "id": 2}] if apart else []
        await tab.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)
    assert 1.8 < await tab.run(f"{STAGE}.zoom") < 3


async def test_a_followed_robot_stays_in_the_middle(rig, tab):
    await choose(tab, "robot:1")
    await press(tab, "Follow")
    assert await tab.run(f"{STAGE}.zoom") == pytest.approx(3)
    rig.control.move_robot(1, 0.75, 0.4)
    await tab.until(f"Math.hypot({STAGE}.middle[0] - 0.75, {STAGE}.middle[1] - 0.4) < 0.01")
    await press(tab, "Fit")
    await tab.until(f"{named('Follow')}.checked === false")


async def test_the_camera_goes_around_the_world_and_looks_through_that_of_a_robot(tab):
    await choose(tab, "robot:1")
    await press(tab, "in three dimensions")
    await tab.until(f"{STAGE}.slant === 1")
    left, top = await on_page(tab, 0.4, 0.2)
    turn = await tab.run(f"{STAGE}.turn")
    await tab.mouse("mousePressed", left, top)
    await tab.mouse("mouseMoved", left - 20, top)
    await tab.mouse("mouseMoved", left - 60, top)
    await tab.mouse("mouseReleased", left - 60, top)
    assert await tab.run(f"{STAGE}.turn") != turn
    assert await tab.run(SELECTED) == "robot:1", "to go around loses nothing"
    await tab.run(f"{STAGE}.canvas.focus()")
    drawn = await tab.run(f"{STAGE}.drawn")
    await tab.key("v")
    await tab.until(f"{EYE}.checked && {STAGE}.drawn > {drawn}")
    # It stands at 0.8, 0.5 and looks along y: what is right of it is on the right, what is behind it nowhere.
    middle = await tab.run(f"{STAGE}.width / 2")
    seen = f"{STAGE}.toPixel"
    # The picture that was counted may be one more of the old view.
    await tab.until(f"{seen}(0.9, 0.7)[0] > {middle} && {seen}(0.7, 0.7)[0] < {middle}")
    assert await tab.run(f"{seen}(0.8, 0.4)[2]") == 0


TAGS = """
[arena]
size = [1.2, 0.8]
[[robot]]
position = [0.3, 0.4]
[[wall]]
from = [0.8, 0.5]
to = [0.8, 0.42]
height = 0.08
face = "tag:7"
[[box]]
position = [0.84, 0.34]
size = [0.08, 0.08]
angle = 20
height = 0.08
face = "tag36h11:42"
pushable = true
"""


@pytest.mark.parametrize("world", [TAGS], ids=["tags"])
async def test_the_page_shows_the_tags_of_walls_and_boxes(tab):
    await choose(tab, "robot:0")
    drawn = await tab.run(f"{STAGE}.drawn")
    await press(tab, "through the robot's camera")
    await tab.until(f"{EYE}.checked && {STAGE}.drawn > {drawn}")

    async def are_seen() -> bool:
        pixels = np.asarray(Image.open(io.BytesIO(await tab.shot())).convert("RGB"))
        tags = (("16h5", 7), ("36h11", 42))
        return all(number in [tag.number for tag in find(pixels, 1, 0.06, family)] for family, number in tags)

    await until(are_seen)


STATES = """
[arena]
size = [1.2, 0.8]
[energy]
idle = 0
start = 0.5
[[robot]]
position = [0.2, 0.4]
pen = "#c02020"
[[zone]]
name = "plate"
position = [0.45, 0.4]
radius = 0.12
stays = true
score = 7
[[zone]]
name = "nest"
points = [[0.95, 0.1], [1.15, 0.1], [1.15, 0.3]]
colour = "#2878b4"
[[box]]
name = "gate"
position = [0.8, 0.4]
size = [0.02, 0.2]
colour = "#8a3ca0"
switch = "plate"
slide = [0.0, 0.25]
[[light]]
position = [1.1, 0.7]
switch = "plate"
[[cylinder]]
name = "puck"
position = [0.9, 0.6]
radius = 0.03
colour = "#d03020"
pushable = true
collect = "nest"
"""


@pytest.mark.parametrize("world", [STATES], ids=["states"])
@pytest.mark.parametrize("is_flat", [False, True])
async def test_a_door_opens_a_lamp_goes_on_and_a_puck_is_gone_on_the_page(rig, tab):
    world = f"{STAGE}.world"
    assert await tab.run(f"{world}.zones.value.map(({{ name, on }}) => `${{name}} ${{on}}`).join()") == (
        "plate false,nest false"
    )
    await choose(tab, "robot:0")
    floor = await pixel(tab, 0.7, 0.2)
    assert min(floor) > 200, floor
    robot = await open_transport(rig.robots[0].url)
    await robot.write(b"D,500,500\r")
    await tab.until(f"{world}.things.value.box[0].y > 0.649 && {world}.things.value.light[0].intensity === 1")
    await tab.until(f"{world}.lines[0].length > 1")
    rig.control.move_cylinder("puck", 1.1, 0.2)
    await tab.until(f"{world}.things.value.cylinder[0].x < 0")
    facts = "document.querySelector('.world-detail').textContent"
    await tab.until(f"/energy50 %points8/.test({facts})")
    await robot.close()


@pytest.mark.parametrize("is_flat", [True])
async def test_a_browser_without_webgl_shows_the_world_from_above(rig, tab):
    assert await tab.run(f"{named('camera')} === null && !document.querySelector('.world-picture')")
    assert await pixel(tab, 0.4 + 0.1 * 0.037, 0.4) == NOSE
    assert await pixel(tab, 0.97, 0.2) == (0xD0, 0x40, 0x30)
    await drag(tab, (0.4, 0.4), (0.3, 0.2))
    await until(lambda: is_at(rig.control.world.pose(0), 0.3, 0.2))


BLOCK = """
[arena]
size = [1.2, 0.8]
[[polygon]]
points = [[0.5, 0.2], [0.5, 0.6], [0.9, 0.6], [0.9, 0.5], [0.6, 0.5], [0.6, 0.2]]
colour = "#2050c0"
[[robot]]
position = [0.2, 0.4]
"""


@pytest.mark.parametrize("world", [BLOCK], ids=["block"])
@pytest.mark.parametrize("is_flat", [False, True])
async def test_a_block_of_any_outline_is_solid(tab):
    for x, y, is_inside in ((0.55, 0.4, True), (0.75, 0.55, True), (0.75, 0.35, False)):
        red, _, blue = await pixel(tab, x, y)
        assert (blue > red + 60) is is_inside, (x, y)


async def test_the_clock_is_stopped_stepped_and_changed_in_speed(rig, tab):
    await press(tab, "Pause world")
    await until(lambda: rig.control.simulation.clock.is_paused)
    await tab.until(f"!!{named('Continue world')}")
    await tab.until("document.querySelector('.world .time').textContent.endsWith('paused')")
    time = rig.control.snapshot().time
    await press(tab, "Step")
    await until(lambda: rig.control.snapshot().time == pytest.approx(time + 0.1, abs=0.02))
    await set_value(tab, SPEED, 2)
    await until(lambda: rig.control.simulation.clock.rate == 2)
    await press(tab, "Continue world")
    await until(lambda: not rig.control.simulation.clock.is_paused)
    await tab.until(f"{named('Step')}.disabled")
    rig.control.set_speed(0.5)  # as another page would
    await tab.until(f"{SPEED}.value === '0.5'")


async def test_boxes_and_walls_are_put_in_moved_and_taken_away_by_mouse_and_keys(rig, tab):
    await press(tab, "Add a box")
    await tab.until(f"{SELECTED} === 'box:1'")
    box = rig.control.snapshot().boxes[1]
    await drag(tab, (box.x, box.y), (0.3, 0.15))
    await until(lambda: is_at(rig.control.snapshot().boxes[1], 0.3, 0.15))
    await press(tab, "Delete")
    await until(lambda: len(rig.control.snapshot().boxes) == 1)
    await tab.run(f"{STAGE}.canvas.focus()")
    await tab.key("m")
    await tab.until(f"{SELECTED} === 'wall:1'")
    wall = rig.control.snapshot().walls[1]
    await tab.key("ArrowUp")
    await until(lambda: abs(rig.control.snapshot().walls[1].y1 - wall.y1 - 0.01) < 1e-6)
    await tab.key("]")
    await until(lambda: abs(rig.control.snapshot().walls[1].y1 - rig.control.snapshot().walls[1].y2) > 0.05)
    await tab.key("Delete")
    await until(lambda: len(rig.control.snapshot().walls) == 1)
    await tab.key("b")
    await until(lambda: len(rig.control.snapshot().boxes) == 2)


async def test_the_world_is_saved_under_a_name(tab, folder):
    await press(tab, "Save …")
    await tab.until("!!document.querySelector('dialog[open] input')")
    await set_value(tab, "document.querySelector('dialog input')", "after")
    await tab.run("document.querySelector('dialog button.primary').click()")
    await tab.until("document.querySelector('.toasts').textContent.includes('after.toml')")
    assert len(load_file(str(folder / "after.toml")).scene.starts) == 2


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


async def test_parts_of_the_selected_robot_are_broken_and_mended_and_the_page_says_what_is_broken(rig, tab):
    await choose(tab, "robot:1")
    await unfold(tab, "Parts of this robot")
    await set_value(tab, named("part"), "proximity 2")
    await set_value(tab, named("what is wrong with it"), "stuck")
    await tab.until("!!document.querySelector('details input[type=number]')")
    await set_value(tab, "document.querySelector('details input[type=number]')", 777)
    await press(tab, "Break")
    await until(lambda: rig.control.world.proximity(1)[2] == 777)
    assert rig.control.world.proximity(0)[2] != 777
    await tab.until("document.body.textContent.includes('Broken now: proximity 2 stuck at 777.')")
    rig.control.set_defect(1, "wheel", 0, factor=0.0)  # as another page would
    await tab.until("document.body.textContent.includes('proximity 2 stuck at 777; wheel 0 dead.')")
    await set_value(tab, named("part"), "clock")
    await tab.until(f"{named('what is wrong with it')}.value === 'factor 0.8'")
    await press(tab, "Mend all")
    await tab.until("document.body.textContent.includes('All its parts work.')")
    assert rig.control.link(1).broken == ()


async def test_selector_and_remote_control_of_the_robot_are_worked(rig, tab):
    await choose(tab, "robot:0")
    await tab.until("document.getElementById('world-selector')?.value === '3'")
    await set_value(tab, "document.getElementById('world-selector')", 7)
    await until(lambda: rig.control.hardware(0).selector() == 7)
    await set_value(tab, named("key of the remote control"), 8)
    await unfold(tab, "Robot's controls")
    await press(tab, "Press")
    await until(lambda: rig.control.hardware(0).infrared()[2] == 8)
    assert await tab.run("!document.getElementById('world-button')"), "the e-puck1 has none"


@pytest.mark.parametrize("world", [ROOM + PAINT], ids=["painted"])
async def test_rays_are_switched_on_and_can_be_read_on_every_floor(rig, tab):
    rays = f"{WORLD}.frame.value?.rays"
    assert await tab.run(rays) is None
    await tab.run(f"{STAGE}.zoomBy(1.2)")
    await press(tab, "Rays")
    rig.control.move_robot(0, 0.045, 0.4, math.pi)  # a wall before its nose: a ray that meets nothing is faint
    ray = await tab.until(f"{rays}?.[4] > 0.1 && [...{rays}.slice(0, 4)]")
    x, y = (ray[0] + ray[2]) / 2, (ray[1] + ray[3]) / 2
    red, green, _ = await pixel(tab, x, y)
    assert red > green + 40, "a ray on the green floor"
    assert await tab.run(f"{STAGE}.zoom") == 1.2, "the rays change nothing else"


async def test_at_a_usual_screen_the_world_is_large_and_its_controls_push_nothing_away(tab):
    room = await tab.run(
        f"(() => {{ const box = {STAGE}.canvas.getBoundingClientRect(); return [box.width, box.height]; }})()"
    )
    assert min(room) > 400
    assert await tab.run("document.documentElement.scrollWidth") <= SIZE[0]


async def test_a_double_click_opens_the_page_of_a_robot_and_a_pause_loses_no_link(tmp_path, open_page):
    async with panel(tmp_path, "sim://soccer") as url, visiting(open_page, url) as tab:
        await shows_world(tab)
        await from_above(tab)
        await choose(tab, "")
        names = await tab.run(f"[...{THINGS}.options].map((each) => each.textContent)")
        assert set(await tab.run("[...document.querySelectorAll('nav a')].map((each) => each.textContent)")) >= {
            name for name in names if name.startswith("epuck-")
        }, "a robot has one name everywhere"
        await press(tab, "close the details")
        robot = f"{WORLD}.pose({{ kind: 'robot', index: 2 }})"
        x, y = await tab.run(f"{robot}.slice(0, 2)")
        left, top = await on_page(tab, x, y)
        for clicks in (1, 2):
            for kind in ("mousePressed", "mouseReleased"):
                await tab.call("Input.dispatchMouseEvent", type=kind, x=left, y=top, button="left", clickCount=clicks)
        await tab.until("elib.place.value.robot === '3'")
        await tab.until(f"{SELECTED} === 'robot:2'")
        await shows_world(tab)
        before = await tab.run(f"{robot}.slice(0, 2)")
        await tab.run(f"{STAGE}.canvas.focus()")
        await tab.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowUp", code="ArrowUp")
        moved = f"Math.hypot({robot}[0] - {before[0]}, {robot}[1] - {before[1]})"
        tick = "elib.robots.get('3').tick.value"
        await tab.until(f"{tick}.drive.left > 0 && {moved} > 0.01")  # arrows drive the page's own robot
        await tab.call("Input.dispatchKeyEvent", type="keyUp", key="ArrowUp", code="ArrowUp")
        await press(tab, "Pause world")
        await tab.until(f"{WORLD}.clock.value.paused")
        paused = await tab.run(f"{tick}.time")
        await tab.until(f"{tick}.time > {paused} + 4")
        await press(tab, "Continue world")
        await tab.until(f"!{WORLD}.clock.value.paused")
        await tab.until(f"{tick}.readings.proximity?.stale === false")
        lines = await tab.run("elib.robots.get('3').lines.value.filter((each) => each.bad).map((each) => each.text)")
        assert (await tab.run(f"{tick}.phase"), lines) == ("connected", [])


async def test_the_last_minute_is_looked_at_while_the_robot_drives_and_the_world_goes_on_from_there(
    tmp_path, open_page
):
    async with panel(tmp_path, "sim://arena") as url, visiting(open_page, url) as tab:
        await tab.until("window.elib?.listed.value.length === 1")
        await tab.run("location.hash = '#/robot/1'")
        await shows_world(tab)
        tick, pose = "elib.robots.get('1').tick.value", f"{WORLD}.pose({{ kind: 'robot', index: 0 }})"
        line, past = named("time line of the last minute"), "document.querySelector('.world-past')?.textContent"
        await tab.until(f"{tick}?.phase === 'connected' && {WORLD}.span.value[1] > 0")
        (x, y, _), boxes = await tab.run(pose), await tab.run(f"{WORLD}.things.value.box.length")
        gone = f"Math.hypot({pose}[0] - {x}, {pose}[1] - {y})"
        await tab.key("w", "KeyW", kind="keyDown")
        await tab.until(f"{gone} > 0.03")
        await tab.run(f"elib.ask('add_box', {{ x: {x}, y: {y} - 0.15 }}).then(() => 0)")
        await tab.until(f"{WORLD}.things.value.box.length === {boxes + 1}")
        await tab.key("w", "KeyW", kind="keyUp")
        await tab.until(f"{tick}.drive.left === 0")
        assert await tab.run(f"!{past} && {line}.getAttribute('aria-valuetext')") == "now"

        await tab.run(f"{line}.focus()")
        await tab.key("Home", "Home")
        await tab.until(f"{past}?.startsWith('The world ') && {line}.getAttribute('aria-valuetext').endsWith(' s ago')")
        await tab.until(f"{gone} < 0.001 && {WORLD}.things.value.box.length === {boxes}")
        assert await tab.run("document.querySelector('[aria-label=\"Add a box\"]').disabled"), "the past is as it was"
        await tab.key("ArrowRight", "ArrowRight")
        assert await tab.run(f"{tick}.drive.left") == 0, "the arrows move the time line"
        await tab.key("w", "KeyW", kind="keyDown")
        await tab.until(f"!{past} && {gone} > 0.04 && {tick}.drive.left > 0")  # who drives sees where

        await tab.key("Home", "Home")  # the key is still held
        await tab.until(f"{past} && {gone} < 0.001")
        await press(tab, "Go on from here")
        await tab.until(f"!{past} && {gone} < 0.001")
        await tab.until("document.querySelector('.world-said').textContent.includes('Not put back: ')")
        time = await tab.run(f"{WORLD}.frame.value.time")
        await tab.until(f"{WORLD}.frame.value.time > {time} + 1")
        assert await tab.run(f"{gone}") < 0.001
        assert await tab.run(f"[{tick}.drive.left, {tick}.drive.right, {tick}.drive.may_move]") == [0, 0, False]
        assert await tab.run(f"{WORLD}.things.value.box.length") == boxes
        await tab.key("w", "KeyW", kind="keyUp")


async def test_without_a_virtual_world_the_path_and_what_the_sensors_met_are_drawn(tmp_path, open_page):
    async with virtual_robot(tmp_path) as robot, panel(tmp_path, robot.url) as url, visiting(open_page, url) as tab:
        await tab.until("document.querySelector('.path')?.textContent.includes('x 0.000 m')")
        assert await tab.run("!document.querySelector('.world')")
        robot.control.move_robot(0, 1.35, 0.85, 0.0)  # a box lies ahead; the robot still believes to be where it was
        found = await tab.until(f"(met => met.length > 0 && met)({MET})")
        assert all(math.dist(place, (0, 0)) < 0.09 for place in found), "within 9 cm of the robot"
        assert max(x for x, _ in found) >= 0.04, "ahead of it"


async def test_drawing_the_path_costs_no_more_the_longer_and_the_farther_a_robot_has_driven(tmp_path, open_page):
    async with virtual_robot(tmp_path) as robot, panel(tmp_path, robot.url) as url, visiting(open_page, url) as tab:
        await tab.until("document.querySelector('.path')?.textContent.includes('x 0.000 m')")
        await tab.until("elib.robots.get('1').tick.value.readings.proximity?.stale === false")
        await tab.run(STEPS_OF_PATH)
        first, *_, last = await tab.run("window.drive(Array.from({ length: 50 }, (_, step) => 0.1 * step))")  # type: ignore[misc]
        most = 4 * first + 50  # the browser may put off a picture, and then draw up to three at once
        assert 0 < last < most
        _, far = await tab.run("window.drive([5, 1e7])")  # type: ignore[misc]
        assert far < most, "the grid has few lines on a path of any length"


async def test_of_several_worlds_one_is_chosen_in_the_overview_and_a_world_outlives_the_link(tmp_path, open_page):
    async with panel(tmp_path, "sim://arena", "sim://square") as url, visiting(open_page, url) as tab:
        shown = f"window.elib && {WORLD}.scene.value?.world"
        choice = named("world that is shown")
        await tab.until(f"{shown} === 'arena' && {choice}?.length === 2")
        assert await tab.run(SELECTED) == "", "no robot is the one that the place is about"
        await set_value(tab, choice, "2")
        await tab.until(f"{shown} === 'square'")
        await tab.run("location.hash = '#/robot/2'")
        await shows_world(tab)
        tools = "document.querySelector('.world-tools')"
        await tab.until(f"elib.place.value.kind === 'robot' && {tools}?.inert === false && {SELECTED} === 'robot:0'")
        await tab.run("elib.ask('disconnect', { robot: '2' }).then(() => 0)")
        await tab.until(f"elib.robots.get('2').tick.value.phase === 'disconnected' && {tools}?.inert")
        assert await tab.run(f"{shown} === 'square' && {STAGE}.width > 0"), "it stays as it was seen last"
        await tab.run("elib.ask('connect', { robot: '2' }).then(() => 0)")
        await tab.until(f"{tools}?.inert === false")


async def test_the_news_of_one_world_are_not_taken_for_those_of_another(tmp_path, open_page):
    async with panel(tmp_path, "sim://arena", "sim://square") as url, visiting(open_page, url) as tab:
        await tab.until("window.elib?.listed.value.length === 2")
        await tab.run("location.hash = '#/robot/1'")
        await tab.until(f"elib.place.value.robot === '1' && {WORLD}.scene.value?.own === 0 && {NUMBER} > 2")
        await tab.run("elib.ask('move_box', { box: 1, x: 0.8, y: 0.2 }).then(() => 0)")
        await tab.until(f"Math.abs({WORLD}.things.value.box[1].x - 0.8) < 1e-6")
        await tab.run("location.hash = '#/robot/2'")
        await tab.until(f"elib.place.value.robot === '2' && {WORLD}.scene.value?.world === 'square'")
        seen = await tab.run(NUMBER)
        await tab.until(f"{NUMBER} > {seen}")
        await choose(tab, "")
        assert await tab.run(f"[...{THINGS}.options].map((each) => each.value)") == ["", "robot:0"]
