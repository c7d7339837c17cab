"""How behaviours are declared, found, run and ended."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Awaitable, Callable
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

import pytest

from elib.base.errors import ArgumentError
from elib.behaviours import Behaviour, RunContext, behaviour, behaviours, find, play, run_behaviour
from elib.link.protocol.quantities import SoundNumber, WheelSpeed
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.testing import simulation_of
from lanes import short

T = TypeVar("T")
SIM = "sim://square?speed=max"


async def drive(robot: Epuck, *, left: WheelSpeed = 0.3, right: WheelSpeed = 0.2, sound: SoundNumber = 1) -> None:
    """Drive for ever.

    In a circle.

    Args:
        robot: The robot.
        left: Its left wheel.
        right: Its right wheel.
        sound: Not played.
    """
    while True:
        await robot.set_speed(left, right)
        await asyncio.sleep(0.1)  # clock: simulated


def made(loop: Callable[..., Awaitable[None]]) -> Behaviour:
    return replace(behaviour(drive), function=loop)


def on_robot(main: Callable[[Epuck], Awaitable[T]]) -> T:
    return run_on(SIM, main, keep_moving=True)


async def wheels_turn(robot: Epuck) -> bool:
    """Return whether the robot is really moving: the encoders go on."""
    before = await robot.encoders()
    await asyncio.sleep(0.2)  # clock: simulated
    return await robot.encoders() != before


def test_a_behaviour_is_named_after_its_module_and_described_by_its_docstring() -> None:
    made_of = behaviour(drive)
    assert made_of.name == "test-behaviour"
    assert made_of.doc == "Drive for ever.\n\nIn a circle."
    assert made_of.summary == "Drive for ever."
    assert [(option.name, option.default) for option in made_of.options] == [
        ("left", 0.3),
        ("right", 0.2),
        ("sound", 1),
    ]


def test_a_parameter_without_a_quantity_is_refused_when_the_behaviour_is_declared() -> None:
    async def vague(robot: Epuck, *, speed: float = 1.0) -> None: ...

    with pytest.raises(TypeError, match="speed must be keyword-only, with a Quantity"):
        behaviour(vague)


def test_scanning_finds_every_behaviour_of_the_package() -> None:
    found = behaviours()
    assert "avoid" in found
    assert list(found) == sorted(found)
    assert all(name == each.name and each.summary for name, each in found.items())


def test_dashes_underscores_and_case_do_not_matter_in_a_name() -> None:
    assert find(" Avoid ") is find("avoid")


def test_an_unknown_name_suggests_the_nearest_one() -> None:
    with pytest.raises(ArgumentError, match="no behaviour 'avid'") as caught:
        find("avid")
    assert caught.value.hint == "did you mean avoid?"
    with pytest.raises(ArgumentError) as caught:
        find("zzz")
    assert "avoid" in caught.value.hint


def test_the_time_given_is_robot_time_and_the_robot_stands_afterwards() -> None:
    async def main(robot: Epuck) -> None:
        outcome = await run_behaviour(behaviour(drive), robot, seconds=5)
        assert outcome.duration == pytest.approx(5)
        assert outcome.was_limited
        assert outcome.statistics.count > 40
        assert not await wheels_turn(robot)

    on_robot(main)


def test_a_behaviour_that_comes_to_its_own_end_was_not_limited_and_is_stopped_too() -> None:
    async def once(robot: Epuck, **_: float) -> None:
        await robot.set_speed(0.5, 0.5)

    async def main(robot: Epuck) -> None:
        outcome = await run_behaviour(made(once), robot, seconds=5)
        assert not outcome.was_limited
        assert outcome.duration < 1
        assert not await wheels_turn(robot)

    on_robot(main)


def test_a_behaviour_that_fails_leaves_the_robot_stopped_and_its_error_unchanged() -> None:
    async def failing(robot: Epuck, **_: float) -> None:
        await robot.set_speed(0.5, 0.5)
        raise ZeroDivisionError("a defect")

    async def main(robot: Epuck) -> None:
        with pytest.raises(ZeroDivisionError, match="a defect"):
            await run_behaviour(made(failing), robot)
        assert not await wheels_turn(robot)

    on_robot(main)


def test_cancelling_leaves_the_robot_stopped() -> None:
    async def main(robot: Epuck) -> None:
        task = asyncio.create_task(run_behaviour(behaviour(drive), robot))
        await asyncio.sleep(2)  # clock: simulated
        assert await wheels_turn(robot)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert not await wheels_turn(robot)

    on_robot(main)


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        ({"left": 2.0}, "left is 2.0 rev/s; it must be a number from -1 to 1 rev/s"),
        ({"sound": 1.5}, "sound is 1.5; it must be a whole number from 0 to 6"),
        ({"colour": 1}, "has no option 'colour'"),
    ],
)
def test_a_wrong_option_is_refused_before_anything_is_sent(options: dict[str, object], rule: str) -> None:
    async def main(robot: Epuck) -> None:
        before = robot.statistics.count
        with pytest.raises(ArgumentError, match=rule):
            await run_behaviour(behaviour(drive), robot, seconds=1, options=options)
        assert robot.statistics.count == before

    on_robot(main)


@pytest.mark.parametrize("seconds", [0, -1, float("nan"), float("inf")])
def test_an_impossible_time_is_refused(seconds: float) -> None:
    async def main(robot: Epuck) -> None:
        with pytest.raises(ArgumentError, match=r"it must be a (finite )?number above 0 s"):
            await run_behaviour(behaviour(drive), robot, seconds=seconds)

    on_robot(main)


@pytest.mark.parametrize(
    ("name", "seconds"),
    short(product(behaviours(), (5, 30)), *product(behaviours(), (5,))),
)
def test_every_behaviour_runs_its_time_at_home_and_leaves_the_robots_standing(
    name: str, seconds: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # some write pictures
    what = find(name)
    url = what.url + ("&" if "?" in what.url else "?") + "speed=max"
    if seconds == 5:  # three robots are a swarm
        url = re.sub(r"robots=\d+", "robots=3", url)
    worlds = []

    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        worlds.extend(simulation_of(robot) for robot in robots[:1])

    outcome = play(what, url, seconds=seconds, watch=watch)
    assert outcome.duration < seconds + 3
    for simulation in worlds:
        world = simulation.world
        world.run_to(world.time + 0.1)  # the tick in which it was stopped comes to its end
        before = world.poses
        world.run_to(world.time + 1)
        assert world.poses == before


@pytest.mark.parametrize(
    ("name", "given", "opened"),
    [
        ("go-to-light", None, "sim://light"),
        ("go-to-light", "sim://?speed=max", "sim://light?speed=max"),
        ("go-to-light", "sim://maze?speed=max", "sim://maze?speed=max"),
        ("go-to-light", "tcp://127.0.0.1:4000", "tcp://127.0.0.1:4000"),
        ("avoid", "sim://?speed=max", "sim://?speed=max"),
        ("aggregation", "sim://?speed=max&loss=0.05", "sim://crowd?robots=10&speed=max&loss=0.05"),
        ("aggregation", "sim://?robots=3", "sim://crowd?robots=3"),
        ("aggregation", "sim://arena?speed=max", "sim://arena?speed=max"),
    ],
)
def test_a_simulation_that_names_no_world_is_the_behaviours_own_with_its_keys(
    name: str, given: str | None, opened: str
) -> None:
    assert find(name).resolve_url(given) == opened


@pytest.mark.parametrize(
    ("what", "message", "hint"),
    [
        ("avoid", "elib.play() takes a behaviour, not 'avoid'", "write: from elib.behaviours.avoid import "),
        ("avoyd", "there is no behaviour 'avoyd'", "did you mean avoid?"),
        (print, "elib.play() takes a behaviour, not <built-in function print>", "write @elib.behaviour before"),
        (3, "elib.play() takes a behaviour, not 3", ""),
    ],
)
def test_to_play_what_is_no_behaviour_is_answered_with_what_to_write(what: Any, message: str, hint: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        play(what, "sim://?speed=max")
    assert caught.value.message == message
    assert caught.value.hint.startswith(hint)
