"""The page of a study: what it is told of the evolution, and that the best controller drives in its world."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterator
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from browser import browser, needs_browser
from page_rig import Page, fetch, opened
from world_page_rig import Frame

from elib.learn.progress import Best, Progress
from elib.learn.studypage import REST, Life, Show, study_page
from elib.panel.panel import WORLD
from elib.simulator.physics import Controller, Pose, Scene
from elib.simulator.physics.task import Task
from elib.testing import simulated
from shared import needs_page, until

pytestmark = needs_page

STEP = 1 / 40


def go(robot, parameters, memory) -> None:
    memory[0] += 1
    robot.left = robot.right = parameters[0]


def make_task(**options: object) -> Task:
    scenes = tuple(Scene(1.0, 1.0, step=STEP, name=name) for name in ("first room", "second room"))
    return Task("go", "Drive on.", scenes, lambda world, i: 0.0, **options)  # type: ignore[arg-type]


def make_controller(parameters: object) -> Controller:
    return Controller(go, parameters, memory=1)  # type: ignore[arg-type]


@pytest.fixture
def progress() -> Progress:
    return Progress(make_task(), make_controller, 4, {"algorithm": "cma", "seed": 7})


@pytest.fixture
def url(progress: Progress) -> Iterator[str]:
    with study_page(progress, "0") as url:
        yield url


def pass_generation(progress: Progress, *fitness: float) -> None:
    """Add a generation whose individuals drive as fast as their fitness says: 1000 steps/s for 1."""
    progress.add(np.array(fitness), 1000 * np.array(fitness).reshape(-1, 1))


def study_of(page: Page) -> dict:
    """Return what a page knows of the study, put together as the browser does."""
    known: dict = {"generations": []}
    for told in [update["study"] for update in page.of("update") if "study" in update]:
        assert told["first"] == len(known["generations"])
        known = {**told, "generations": known["generations"] + told["generations"]}
    return known


# -- the progress --


def test_a_generation_is_told_by_its_best_its_quarters_its_mean_and_its_lowest(progress: Progress) -> None:
    pass_generation(progress, 0.1, 0.2, 0.3, 0.4, 0.9)
    assert progress.done == [pytest.approx((0.9, 0.4, 0.38, 0.2, 0.1))]


def test_only_a_controller_that_is_better_than_all_before_it_is_kept(progress: Progress) -> None:
    for fitness in ((0.1, 0.3), (0.2, 0.3), (0.5, 0.4)):
        pass_generation(progress, *fitness)
    assert [(best.generation, best.fitness, *best.parameters) for best in progress.bests] == [
        (1, 0.3, 300),
        (3, 0.5, 500),
    ]


def test_the_winner_of_the_final_test_is_the_best_whatever_luck_others_had(progress: Progress) -> None:
    pass_generation(progress, 0.5)
    progress.end("All generations are done.", Best(1, 0.3, np.array([300.0])))
    assert progress.bests[-1].fitness == 0.3


def test_the_time_left_is_that_of_the_generations_left_and_none_after_the_end(progress: Progress) -> None:
    assert progress.seconds_left == 0
    pass_generation(progress, 0.1)
    first = progress.seconds_left
    assert first > 0
    progress.end("Stopped by Ctrl-C.")
    assert progress.seconds_left == 0


# -- what the page is told --


async def test_a_page_that_is_opened_late_is_told_all_generations_and_then_each_new_one(progress, url) -> None:
    pass_generation(progress, 0.1, 0.2)
    pass_generation(progress, 0.3, 0.4)
    async with opened(url) as page:
        await page.ask("subscribe", what="study")
        await page.ask("subscribe", what="world", rate=25)
        assert page.hello["can"] == msgspec.structs.asdict(WORLD)
        assert page.hello["study"] == {
            "task": "go",
            "summary": "Drive on.",
            "count": 4,
            "seconds": 60.0,
            "settings": {"algorithm": "cma", "seed": "7"},
        }
        await until(lambda: len(study_of(page)["generations"]) == 2)
        pass_generation(progress, 0.5, 0.1)
        await until(lambda: len(study_of(page)["generations"]) == 3)
        assert [row[0] for row in study_of(page)["generations"]] == [0.2, 0.4, 0.5]
        assert study_of(page)["bests"] == [[1, 0.2], [2, 0.4], [3, 0.5]]
        assert study_of(page)["outcome"] == ""


async def test_the_page_says_why_the_evolution_ended_and_goes_on(progress, url) -> None:
    async with opened(url) as page:
        await page.ask("subscribe", what="study")
        await page.ask("subscribe", what="world", rate=25)
        pass_generation(progress, 0.3)
        progress.end("All generations are done.")
        await until(lambda: study_of(page).get("outcome") == "All generations are done.")
        assert study_of(page)["left"] == 0
        count = len(page.of("update"))
        await until(lambda: len(page.of("update")) > count)
    async with opened(url) as page:
        await page.ask("subscribe", what="study")
        await page.ask("subscribe", what="world", rate=25)
        await until(lambda: study_of(page).get("outcome"))


async def test_nothing_is_repeated_while_nothing_happens(progress, url) -> None:
    pass_generation(progress, 0.3)
    async with opened(url) as page:
        await page.ask("subscribe", what="study")
        await page.ask("subscribe", what="world", rate=25)
        await until(lambda: study_of(page).get("shown") == 1)
        told, count = len([each for each in page.of("update") if "study" in each]), len(page.of("update"))
        await until(lambda: len(page.of("update")) > count + 5)
        assert len([each for each in page.of("update") if "study" in each]) == told


async def test_the_page_answers_its_own_origin_alone(url) -> None:
    assert (await asyncio.to_thread(fetch, url))[0] == 200
    assert (await asyncio.to_thread(fetch, url, Origin="http://elsewhere.example"))[0] == 403
    assert (await asyncio.to_thread(fetch, url, Host="elsewhere.example"))[0] == 403


async def test_the_page_ends_with_its_block_although_a_browser_looks(progress) -> None:
    with study_page(progress, "0") as url:
        pass_generation(progress, 0.3)
        async with opened(url) as page:
            await page.ask("subscribe", what="world", rate=25)
            await until(lambda: page.frames)
    host, port = url.removeprefix("http://").rstrip("/").split(":")
    with pytest.raises(ConnectionRefusedError):
        await asyncio.open_connection(host, int(port))


# -- what drives --


async def test_the_best_controller_drives_in_the_world_of_the_task(progress, url) -> None:
    async with opened(url) as page:
        await page.ask("subscribe", what="study")
        await page.ask("subscribe", what="world", rate=25)
        await until(lambda: page.of("update"))
        assert not page.frames
        pass_generation(progress, 0.1, 0.3)
        await until(lambda: len(page.frames) > 20)
        assert page.of("scene")[-1]["scene"]["world"] == "first room"
        frames = list(map(Frame.parse, page.frames))
        ways = [(b.time - a.time, math.dist(a.poses[0][:2], b.poses[0][:2])) for a, b in pairwise(frames)]
        # On a busy computer it is at a wall before the last of them.
        assert max(way / time for time, way in ways if time) == pytest.approx(300 * 0.1288 / 1000, rel=0.1)


async def test_an_earlier_controller_drives_when_a_person_chooses_it(progress, url) -> None:
    pass_generation(progress, 0.1)
    pass_generation(progress, 0.3)
    async with opened(url) as page:
        await page.ask("subscribe", what="study")
        await page.ask("subscribe", what="world", rate=25)
        await until(lambda: study_of(page).get("shown") == 2)
        assert (await page.ask("choose_controller", number=0))["ok"]
        await until(lambda: study_of(page)["shown"] == 1)
        assert study_of(page)["chosen"] == 0
        assert (await page.ask("choose_controller", number=None))["ok"]
        await until(lambda: study_of(page)["shown"] == 2)


@simulated
async def test_a_life_decides_every_period_and_ends_with_its_time_and_its_wheels_stand() -> None:
    task = make_task(seconds=2.0, period=0.1, robots=2)
    life = Life(task, make_controller([200.0]), 1)
    world = life.simulation.world
    assert world is not None
    assert world.scene.name == "second room"
    life.simulation.close()
    world.run_to(1.0)
    assert [memory[0] for memory in life._memory] == [11, 11]
    world.run_to(2.0)
    assert [memory[0] for memory in life._memory] == [20, 20]
    assert world.wheel_speeds(1) == (0, 0)
    assert not life.is_over
    world.run_to(2.0 + REST + 2 * STEP)
    assert life.is_over
    assert [memory[0] for memory in life._memory] == [20, 20]


async def test_robots_of_a_life_read_nothing_in_the_open_as_those_of_the_evolution_do() -> None:
    life = Life(make_task(robots=2), make_controller([0.0]), 0)
    life.simulation.close()
    world = life.simulation.world
    assert world is not None
    for robot, x in enumerate((0.3, 0.7)):
        world.move_robot(robot, Pose(x, 0.5, 0.0))
    assert world.readings("proximity").max() < 40  # noise, and a little of the walls


async def test_a_life_ends_when_the_task_says_so() -> None:
    task = make_task(is_over=lambda world: world.robots[0].x > 0.6)
    life = Life(task, make_controller([1000.0]), 0)
    life.simulation.close()
    world = life.simulation.world
    assert world is not None
    world.move_robot(0, Pose(0.5, 0.5, 0.0))
    world.run_to(5.0)
    assert life.is_over
    assert 0.6 < world.pose(0).x < 0.61


async def test_a_better_controller_waits_until_the_one_that_drives_was_seen(progress, monkeypatch) -> None:
    monkeypatch.setattr("elib.learn.studypage.MIN_SHOWN_TIME", 1e9)
    show = Show(progress)
    playing = asyncio.create_task(show.play())
    pass_generation(progress, 0.1)
    for _ in range(20):
        await asyncio.sleep(0)
    assert show.state().shown is None  # nobody looks, so nothing is computed
    show.panel.on_visit()
    await until(lambda: show.state().shown == 1)
    pass_generation(progress, 0.2)
    simulation = show._life.simulation  # type: ignore[union-attr]
    await until(lambda: simulation.catch_up() or simulation.time > 1)
    assert show.state().shown == 1
    monkeypatch.setattr("elib.learn.studypage.MIN_SHOWN_TIME", 1)
    await until(lambda: show.state().shown == 2)
    show.panel.on_empty()
    playing.cancel()


# -- the browser --


def has_drawn(red: int, green: int, blue: int) -> str:
    """Return JavaScript that says whether the chart has a line of a colour: here that of the best individuals."""
    return f"""(() => {{
        const canvas = document.querySelector(".fitness canvas");
        if (!canvas) return false;
        const copy = new OffscreenCanvas(canvas.width, canvas.height);
        const pen = copy.getContext("2d", {{ willReadFrequently: true }});
        pen.drawImage(canvas, 0, 0);
        const {{ data }} = pen.getImageData(0, 0, canvas.width, canvas.height);
        return data.some((value, k) => k % 4 === 0 && data[k + 3] === 255 &&
            value === {red} && data[k + 1] === {green} && data[k + 2] === {blue});
    }})()"""


@needs_browser
@pytest.mark.long
async def test_a_browser_draws_the_curve_and_lets_a_person_choose_who_drives(progress, url) -> None:
    async with browser() as open_page:
        tab = await open_page(url)
        await tab.size(1200, 800)
        await tab.until("document.querySelector('.study .how-far')?.textContent.startsWith('0 of 4 generations')")
        pass_generation(progress, 0.1, 0.2)
        pass_generation(progress, 0.2, 0.4)
        await tab.until("document.querySelector('.study .how-far').textContent.startsWith('2 of 4 generations')")
        text = "document.querySelector('.study').textContent"
        for words in ("Drive on.", "Best so far: 0.400, of generation 2", "Generation 2best 0.400mean 0.300"):
            await tab.until(f"{text}.includes('{words}')")
        await tab.until("elib.worldOf().frame.value?.number > 2")
        await tab.until(has_drawn(217, 72, 15))
        await tab.size(1200, 800, dark=True)
        await tab.until(has_drawn(255, 157, 92))
        await tab.run(
            "(() => { const list = document.querySelector('.study select'); list.value = '0';"
            " list.dispatchEvent(new Event('change', { bubbles: true })); })()"
        )
        await tab.until(f"{text}.includes('Now you see the best of generation 1')")
        left, top, width = await tab.run(  # type: ignore[misc]
            "(() => { const box = document.querySelector('.fitness .u-over').getBoundingClientRect();"
            " return [box.left, box.top, box.width]; })()"
        )
        await tab.mouse("mouseMoved", left + 4, top + 60)
        await tab.until(f"{text}.includes('Generation 1best 0.200')")
        await tab.mouse("mouseMoved", left + width / 2, top + 600)
        progress.end("All generations are done.")
        await tab.until(f"{text}.includes('All generations are done.')")
        await tab.size(390, 844, phone=True)
        await tab.until("document.documentElement.scrollWidth === 390")
        assert [each for each in tab.requests if not each.startswith((url, url.replace("http", "ws"), "data:"))] == []
        assert tab.complaints == []
