"""Make the pictures of the tutorial and of the panel; ``make pictures`` runs it.

The tutorial's pictures come from the programs of its pages, which are run here with an eye on their virtual world. They
come out the same each time, and a test compares them. The pictures of the panel are taken with chromium and differ a
little each time: ``--panel`` makes them too, and the film of the README.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import io
import json
import math
import os
import re
import sys
import tempfile
from collections.abc import AsyncIterator, Callable, Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

from generator.drawings import AXIS, INFRARED, INK, QUIET, RIM, Picture, Point
from PIL import Image, ImageOps

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs/images"
SAMPLE = ROOT / "src/elib/behaviours/samples/states.py"
"""The machine of states that the studio begins with."""
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests/docs"), str(ROOT / "tests/panel")]

from browser import Tab, browser  # noqa: E402
from pages import programs  # noqa: E402  # the blocks of a page, as the tests read them

import elib.cli  # noqa: E402
from elib.simulator.drawing import draw  # noqa: E402
from elib.simulator.physics import Pose, World  # noqa: E402
from elib.tools.states.drawing import draw as draw_machine  # noqa: E402
from elib.tools.states.text import MachineText as Machine  # noqa: E402

STEP = 0.1
"""s from one point of a path to the next."""
SHOWN = 450
"""Pixels of a world's longer side."""

Followed = tuple[World, list[tuple[float, list[Pose]]]]
"""A world, and where its robots were at which time."""


@contextlib.contextmanager
def followed() -> Iterator[list[Followed]]:
    """Follow every world that is made meanwhile."""
    worlds: list[Followed] = []
    make = World.__init__

    def made(world: World, *args: Any, **options: Any) -> None:
        make(world, *args, **options)
        moments: list[tuple[float, list[Pose]]] = []
        worlds.append((world, moments))

        def note() -> None:
            if not moments or world.time > moments[-1][0] + STEP - 1e-9:
                moments.append((world.time, [world.pose(robot) for robot in range(world.robots)]))

        note()
        world.follow(note)

    World.__init__ = made  # type: ignore[method-assign]
    try:
        yield worlds
    finally:
        World.__init__ = make  # type: ignore[method-assign]


@cache
def runs_of(page: str) -> list[tuple[str, list[Followed]]]:
    """Run the programs of a page of the tutorial, once; return the text and the worlds of each."""
    path = ROOT / f"docs/tutorial/{page}.md"
    names: dict[str, object] = {"__name__": page}
    found = []
    for block, _ in programs(path):
        with followed() as worlds, contextlib.redirect_stdout(io.StringIO()):
            exec(compile("\n" * (block.line - 1) + block.text, str(path), "exec", dont_inherit=True), names)
        found.append((block.text, worlds))
    return found


def worlds_of(page: str, marker: str) -> list[Followed]:
    """Return the worlds of the first program of a page that has *marker*."""
    for text, worlds in runs_of(page):
        if marker in text:
            return worlds
    sys.exit(f"{page} has no program with {marker!r}")


def world_picture(page: str, marker: str) -> str:
    """Return the drawing of where the robots went in a program, seen from above."""
    world, moments = worlds_of(page, marker)[-1]
    trails = [[poses[robot] for _, poses in moments] for robot in range(world.robots)]
    document = draw(world.snapshot(beams=True), trails=trails, size=SHOWN)
    assert document is not None
    return document


def map_picture() -> Image.Image:
    """Return the map that the program of page 7 leaves, without most of what is unknown."""
    worlds_of("07-where-am-i", "elib.play(explore")
    with Image.open("explored.png") as image:
        left, top, right, bottom = ImageOps.invert(image).point(lambda grey: 255 * (abs(grey - 127) > 20)).getbbox()
        known = image.crop((left - 4, top - 4, right + 4, bottom + 4))
        return known.resize((4 * known.width, 4 * known.height), Image.Resampling.NEAREST)


def home_picture() -> Image.Image:
    """Return the way home of page 7, from where the robot was carried to."""
    world, moments = worlds_of("07-where-am-i", "elib.Localiser(grid)")[-1]
    path = [poses[0] for _, poses in moments]
    carried = next(k for k, (a, b) in enumerate(pairwise(path), 1) if math.dist((a.x, a.y), (b.x, b.y)) > 2 * STEP)
    draw(world.snapshot(), "home.png", trails=[path[carried:]], size=SHOWN)
    with Image.open("home.png") as image:
        return image.convert("P", palette=Image.Palette.ADAPTIVE)


def machine_picture(page: str, marker: str) -> str:
    """Return the picture of the state machine that a program of a page has, with the programs before it."""
    text = ""
    for block, _ in programs(ROOT / f"docs/tutorial/{page}.md"):
        text += block.text + "\n"
        if marker in block.text:
            return draw_machine(Machine(text))
    sys.exit(f"{page} has no program with {marker!r}")


def gap_picture() -> str:
    """Return the chart of a drive whose link is cut for three seconds."""
    _, moments = worlds_of("03-when-things-fail", "robot.drive(0.25)")[-1]
    began = moments[0][1][0]
    left, right, top, bottom, seconds, reach = 70.0, 700.0, 50.0, 280.0, 11.0, 0.5
    picture = Picture(740, 340, "How far the robot went: it drives on while the link is cut, and then comes back")

    def at(time: float, metres: float) -> Point:
        return Point(left + (right - left) * time / seconds, bottom - (bottom - top) * metres / reach)

    picture.area([at(3, 0), at(6, 0), at(6, reach), at(3, reach)], INFRARED, opacity=0.12)
    picture.text(at(4.5, 0.46), "no link", colour=INFRARED, anchor="middle", is_bold=True)
    for centimetres in range(0, 51, 10):
        picture.line([at(0, centimetres / 100), at(seconds, centimetres / 100)], RIM, 1)
        place = at(0, centimetres / 100)
        picture.text(Point(left - 10, place.y + 5), str(centimetres), size=14, colour=QUIET, anchor="end")
    for second in range(12):
        place = at(second, 0)
        picture.text(Point(place.x, place.y + 24), str(second), size=14, colour=QUIET, anchor="middle")
    picture.line([at(0, 0.25), at(seconds, 0.25)], INK, 1, is_dashed=True)
    picture.text(at(0.1, 0.265), "25 cm: where it was told to go", size=14)
    ahead = [at(time, poses[0].x - began.x) for time, poses in moments if time <= seconds]
    picture.line(ahead, AXIS, 3)
    picture.text(Point(left - 10, 28), "cm", size=14, colour=QUIET, anchor="end")
    picture.text(Point((left + right) / 2, bottom + 48), "seconds", anchor="middle")
    return picture.svg()


def camera_picture() -> Image.Image:
    """Return what the program of page 1 saves."""
    worlds_of("01-first-robot", "picture.save")
    with Image.open("ahead.png") as image:
        return image.convert("P", palette=Image.Palette.ADAPTIVE)


def demo_picture() -> Image.Image:
    """Return the picture that ``elib demo`` leaves, smaller."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        elib.cli.main(["demo"])
    with Image.open("elib-demo.png") as image:
        image.thumbnail((640, 640), Image.Resampling.LANCZOS)
        return image.convert("P", palette=Image.Palette.ADAPTIVE, colors=256)


PICTURES: dict[str, Callable[[], str | Image.Image]] = {
    "tutorial-demo.png": demo_picture,
    "tutorial-square.svg": lambda: world_picture("01-first-robot", "for side in range(4)"),
    "tutorial-look.svg": lambda: world_picture("01-first-robot", "while max(robot.proximity())"),
    "tutorial-camera.png": camera_picture,
    "tutorial-roam.svg": lambda: world_picture("02-first-behaviour", "result.states[:5]"),
    "tutorial-gap.svg": gap_picture,
    "tutorial-swarm.svg": lambda: world_picture("04-first-swarm", "async def wander"),
    "tutorial-states-begin.svg": lambda: draw_machine(Machine(SAMPLE.read_text(encoding="utf-8"))),
    "tutorial-states-back-up.svg": lambda: machine_picture("06-first-states", "result.states"),
    "tutorial-states-path.svg": lambda: world_picture("06-first-states", "result.states"),
    "tutorial-where-drift.svg": lambda: world_picture("07-where-am-i", "range(12)"),
    "tutorial-where-map.png": map_picture,
    "tutorial-where-home.png": home_picture,
}
"""The pictures that come out the same each time."""


def make(folder: Path) -> None:
    """Write the tutorial's pictures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    here = Path.cwd()
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)  # the programs leave files
        try:
            for file, picture in PICTURES.items():
                made = picture()
                if isinstance(made, str):
                    (folder / file).write_text(made.rstrip() + "\n", encoding="utf-8")
                else:
                    made.save(folder / file, optimize=True)
        finally:
            os.chdir(here)


PANEL = (1440, 900)
PHONE = (390, 844)
FILM = (960, 600)
"""Sizes of the pages, and of the film, pixels."""
STUDY_TIME = 900.0
"""s within which 60 generations have been tried out, after the code was compiled."""
FILM_TIME = 9.0
"""How much of the robot's time the film shows, s."""
FRAME_PAUSE = 0.5
"""s between two frames; the world goes on by a tenth of that."""
SPEED = "document.querySelector('[aria-label=\"speed of the world\"]')"
TIME = "document.querySelector('.world-tools .time')"
STAGE = "document.querySelector('.world canvas:not(.world-picture)')?.stage"
REST = f"""(() => {{
  const kind = Object.getPrototypeOf({STAGE}), {{ draw }} = kind;
  kind.draw = () => {{}};
  kind.drawWell = function () {{ this.isStill = true; draw.call(this); }};
}})()"""
"""Draw the world only when a picture is taken, but then as well as with a graphics card: without one it takes long."""
PROGRAM = """import elib


def avoid(near):
    \"\"\"Return the speeds: what is near slows the other wheel.\"\"\"
    left = near.front_left + near.diagonal_left
    right = near.front_right + near.diagonal_right
    return 0.5 - right / 800, 0.5 - left / 800


with elib.connect("sim://arena?seed=1") as robot:
    robot.calibrate_proximity()  # nothing is near
    said = ""
    while robot.time < 60:
        near = robot.proximity()
        word = "an obstacle" if max(near) > 150 else "free"
        if word != said:
            print(f"{robot.time:5.1f} s: {word}")
        said = word
        robot.set_speed(*avoid(near), clip=True)
        robot.sleep(0.05)
"""
"""What runs in the picture of the studio."""
TICK = "[...elib.robots.values()].at(-1)?.tick.value"


def press(label: str) -> str:
    """Return the JavaScript that clicks on a button or a box by its label."""
    return f"document.querySelector('[aria-label=\"{label}\"]').click(), 0"


def behave(robots: str) -> str:
    """Return the JavaScript that lets robots avoid obstacles; *robots* is an expression for their keys."""
    return f"elib.ask('behave', {{robots: {robots}, name: 'avoid'}}).then(() => 0)"


@contextlib.asynccontextmanager
async def page(*words: str) -> AsyncIterator[Tab]:
    """Start a command of ``elib`` that serves a page, and open that."""
    with tempfile.TemporaryDirectory() as folder:
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "elib", *words),
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
            cwd=folder,
            env={**os.environ, "XDG_STATE_HOME": folder},
        )
        assert process.stdout is not None
        try:
            address = None
            while address is None:
                address = re.search(r"http://\S+", (await process.stdout.readline()).decode())
            async with browser() as opened:
                tab = await opened(address[0])
                await tab.size(*PANEL)
                await tab.until("!!window.elib?.hello.value")
                yield tab
        finally:
            process.terminate()
            await process.wait()


async def take(tab: Tab, name: str, size: tuple[int, int] = PANEL, **options: bool) -> None:
    """Save a picture of the page."""
    await tab.size(*size, **options)
    await asyncio.sleep(1.5)
    await tab.until(f"!elib.isSilent.value && !{TIME}?.textContent.includes('only')")  # a busy computer is late
    await shot(tab)
    await asyncio.sleep(1)  # what is painted on a floor is loaded
    (IMAGES / name).write_bytes(await shot(tab))


async def shot(tab: Tab) -> bytes:
    """Return a picture of the page, whose world is drawn now."""
    await tab.run(f"{STAGE}?.drawWell(), 0")
    return await tab.shot()


async def panel_pictures() -> None:
    """Take the pictures of the panel, of the live view, of the page of a study and of the studio."""
    for pictures in (robot_pictures, overview_picture, start_picture, live_pictures, study_picture, studio_picture):
        await pictures()


JOYSTICK = ("joystick", "--no-browser", "--port", "0")


async def robot_pictures() -> None:
    """Take the pictures of the page of a robot."""
    async with page(*JOYSTICK, "sim://arena") as tab:
        await start(tab)
        await asyncio.sleep(12)
        await take(tab, "joystick.png")
        await take(tab, "joystick-phone.png", PHONE, phone=True)
        await tab.size(*PANEL)
        await tab.run("location.hash = '#/robot/1/charts'")
        await asyncio.sleep(20)
        await take(tab, "joystick-dark.png", dark=True)


async def overview_picture() -> None:
    """Take the picture of all robots."""
    async with page(*JOYSTICK, "sim://crowd?robots=20") as tab:
        await rest(tab)
        await asyncio.sleep(5)
        await tab.run(behave("elib.listed.value.map(({key}) => key)"))
        await asyncio.sleep(8)
        await take(tab, "joystick-overview.png")


async def start_picture() -> None:
    """Take the picture of the start page."""
    async with page(*JOYSTICK) as tab:
        await asyncio.sleep(6)
        await take(tab, "joystick-start.png")


async def live_pictures() -> None:
    """Take the pictures of a world whose robots belong to other programs."""
    async with page("simulate", "soccer", "--robots", "4", "--tcp", "0", "--view", "0") as tab:
        await rest(tab)
        await tab.run(press("Rays"))
        await take(tab, "live-view.png", (1280, 800))
        await take(tab, "live-view-phone.png", PHONE, phone=True, dark=True)


async def study_picture() -> None:
    """Take the picture of the page of a study."""
    async with page("evolve", "avoid", "--view", "0") as tab:
        async with asyncio.timeout(STUDY_TIME):
            while not await tab.run("elib.study.value?.first + elib.study.value?.generations.length >= 60"):  # noqa: ASYNC110  # a page
                await asyncio.sleep(1)
        await rest(tab)
        await asyncio.sleep(25)
        await take(tab, "evolve.png", (1280, 800))


async def studio_picture() -> None:
    """Take the picture of the studio, with a program that runs."""
    async with page("studio", "--no-browser", "--port", "0") as tab:
        await tab.run(f"elib.borrow('avoid.py', {json.dumps(PROGRAM)}, 'A sample')")
        await rest(tab)
        await tab.run(press("Rays"))
        await tab.run("elib.run(), 0")
        await tab.until("elib.program.value.time > 12")
        await take(tab, "studio.png", (1280, 800))


async def rest(tab: Tab) -> None:
    """Wait until the page has a world, and draw it from now on only when a picture is taken."""
    await tab.until(f"!!{STAGE}")
    await tab.run(REST)


async def start(tab: Tab) -> None:
    """Let the first robot avoid obstacles, with the rays of its sensors."""
    await tab.until(f"{TICK}?.phase === 'connected'")
    await rest(tab)
    await tab.run(press("Rays"))
    await tab.run(behave("['1']"))


async def film() -> None:
    """Film the panel of a robot that avoids obstacles; the world is slow, so that every picture is on time."""
    frames, times = [], []
    async with page("joystick", "--no-browser", "--port", "0", "sim://arena?seed=1") as tab:
        await start(tab)
        await asyncio.sleep(1)
        await tab.run(f"{SPEED}.value = '0.1', {SPEED}.dispatchEvent(new Event('change', {{bubbles: true}})), 0")
        while not times or times[-1] < times[0] + FILM_TIME:
            times.append(float(str(await tab.run("elib.worldOf().frame.value.time"))))
            with Image.open(io.BytesIO(await shot(tab))) as image:
                frames.append(image.convert("RGB").resize(FILM, Image.Resampling.LANCZOS))
            await asyncio.sleep(FRAME_PAUSE)
    durations = [max(round(1000 * (b - a)), 20) for a, b in pairwise(times)] + [1500]
    first, *others = frames
    options = {"duration": durations, "loop": 0, "quality": 60, "method": 6}
    first.save(IMAGES / "panel.webp", save_all=True, append_images=others, **options)


def main() -> None:
    """Read the command line and make the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--panel", action="store_true", help="the pictures of the panel too; needs chromium")
    parser.add_argument("--film", action="store_true", help="only the film of the README; needs chromium")
    parser.add_argument("--to", type=Path, default=IMAGES, help="the folder to write to")
    options = parser.parse_args()
    if not options.film:
        make(options.to.resolve())
    if options.panel:
        asyncio.run(panel_pictures())
    if options.panel or options.film:
        asyncio.run(film())


if __name__ == "__main__":
    main()
