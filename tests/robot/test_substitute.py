"""Which robot a program opens, whatever it names: in every style, swarm and runner."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable

import pytest

import elib
from elib.base.errors import ArgumentError, LinkNotFound
from elib.base.timebase import new_loop
from elib.robot.aio import on_open
from elib.robot.substitute import choose_robot, substituted
from shared import PATIENCE

FAST = "sim://square?speed=max"
OTHER = "sim://corridor?speed=max"


async def url_of(robot: elib.Epuck) -> str:
    await robot.selector()
    return robot.url


def opened_async(url: str | None = None) -> str:
    async def main() -> str:
        async with elib.open(url) as robot:
            return await url_of(robot)

    loop = new_loop("max")
    with asyncio.Runner(loop_factory=lambda: loop) as runner:
        return runner.run(main())


def opened_blocking(url: str | None = None) -> str:
    with elib.connect(url) as robot:
        robot.selector()
        return robot.url


def opened_begun(url: str | None = None) -> str:
    with elib.connect(url) as robot:
        robot.begin.selector().end()
        return robot.url


def opened_by_callback(url: str | None = None) -> str:
    came = threading.Event()
    with elib.connect(url) as robot:
        robot.callback(lambda value, state: came.set(), print).selector()
        assert came.wait(PATIENCE)
        return robot.url


def opened_reconnecting(url: str | None = None) -> str:
    with elib.reconnecting(url) as robot:
        robot.selector()
        return robot.url


def opened_by_run(url: str | None = None) -> str:
    return elib.run(url_of, robot=url) if url else elib.run(url_of, argv=[])


def opened_by_swarm(url: str | None = None) -> str:
    async def main(robots: elib.Swarm) -> str:
        return (await robots.all.run(url_of))[robots.names[0]]

    return elib.swarm(url).run(main)


def opened_by_play(url: str | None = None) -> str:
    urls: list[str] = []

    @elib.behaviour
    async def look(robot: elib.Epuck) -> None:
        urls.append(await url_of(robot))

    elib.play(look, url)
    return urls[0]


WAYS = [
    opened_async,
    opened_blocking,
    opened_begun,
    opened_by_callback,
    opened_reconnecting,
    opened_by_run,
    opened_by_swarm,
    opened_by_play,
]


@pytest.mark.parametrize("opened", WAYS)
def test_a_substitute_takes_the_place_of_whatever_a_program_names(opened: Callable[..., str]) -> None:
    with substituted([FAST]):
        assert opened(OTHER) == FAST
        assert opened(OTHER) == FAST, "the same robot again"
    assert opened(OTHER) == OTHER


@pytest.mark.parametrize("opened", WAYS)
def test_a_program_that_names_nothing_gets_the_robot_of_the_variable(
    opened: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ELIB_ROBOT", FAST)
    assert opened() == FAST
    assert opened(OTHER) == OTHER, "what a program names counts more"
    with substituted([OTHER]):
        assert opened() == OTHER, "what stands in for it counts most"


def test_a_program_that_names_its_robot_is_told_once_that_the_variable_is_not_used(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("elib.robot.substitute._has_warned", False)
    monkeypatch.setenv("ELIB_ROBOT", FAST)
    choose_robot(FAST)
    with substituted([OTHER]):
        choose_robot("sim://maze")
    assert not caplog.messages
    choose_robot(OTHER)
    choose_robot(OTHER)
    [said] = caplog.messages
    assert said.startswith(f"{OTHER} was named, so {FAST} of ELIB_ROBOT is not used; leave the URL out of the program")


def test_without_any_word_the_robot_is_a_virtual_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ELIB_ROBOT", raising=False)
    assert choose_robot() == elib.robot_url(argv=[]) == "sim://"
    assert choose_robot(None, OTHER) == OTHER
    with elib.connect() as robot:
        assert robot.url == "sim://"


def test_the_variable_counts_more_than_the_default_of_a_program(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ELIB_ROBOT", f"{FAST} {OTHER}")
    assert elib.run(url_of, argv=[], default="sim://maze") == FAST
    assert elib.run(url_of, argv=[OTHER]) == OTHER
    assert elib.robot_url("sim://maze", argv=[]) == FAST
    assert elib.robot_urls("sim://maze", argv=[]) == [FAST, OTHER]


def test_robots_get_the_urls_in_the_order_in_which_they_are_opened() -> None:
    with substituted([FAST, OTHER], source="elib run --robot"):
        first, second = elib.connect("tcp://127.0.0.1:1"), elib.connect("tcp://127.0.0.1:2")
        with first, second:
            assert (first.url, second.url) == (FAST, OTHER)
        with elib.connect("tcp://127.0.0.1:2") as again:
            assert again.url == OTHER
        with pytest.raises(ArgumentError, match=r"opens one more robot, tcp://127.0.0.1:3, but elib run --robot names"):
            elib.connect("tcp://127.0.0.1:3")


def test_one_name_for_two_robots_at_the_same_time_means_two_robots() -> None:
    with substituted([FAST, OTHER]):
        with elib.connect() as first, elib.connect() as second:
            assert (first.url, second.url) == (FAST, OTHER)
            with pytest.raises(ArgumentError, match=r"only 2\nhint: .* not only sim://square"):
                elib.connect()
        with elib.connect() as first:
            assert first.url == FAST


def test_robots_that_are_made_before_one_is_opened_are_different_ones() -> None:
    with substituted([FAST, OTHER]):
        assert elib.open().url == FAST, "this one is dropped at once"
        robots = [elib.open(), elib.open()]
        assert [robot.url for robot in robots] == [FAST, OTHER]


def test_the_same_url_twice_is_two_virtual_robots() -> None:
    with substituted([FAST, FAST]), elib.connect("sim://"), elib.connect("sim://"), pytest.raises(ArgumentError):
        elib.connect("sim://")


def test_a_program_may_open_what_robot_url_told_it() -> None:
    with substituted([FAST, OTHER]):
        for _ in range(2):
            with elib.connect(elib.robot_url(argv=["sim://maze"])) as robot:
                assert robot.url == FAST
        assert elib.robot_urls(argv=["sim://maze"]) == [FAST, OTHER]
        with elib.connect(OTHER) as robot:
            assert robot.url == OTHER


def test_a_robot_that_could_not_be_opened_may_be_tried_again() -> None:
    with substituted(["tcp://127.0.0.1:1"]):
        kept = []
        for _ in range(2):
            with pytest.raises(LinkNotFound) as caught:
                elib.connect("sim://")
            kept.append(caught.value)


def test_a_swarm_gets_all() -> None:
    async def urls(robots: elib.Swarm) -> list[str]:
        return [robot.url for robot in robots]

    with substituted([FAST, OTHER]):
        assert elib.swarm("sim://crowd?robots=5").run(urls) == [FAST, OTHER]
        assert elib.swarm().run(urls) == [FAST, OTHER]


def test_a_wrong_url_is_refused_with_the_one_who_named_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ELIB_ROBOT", "corridor")
    with pytest.raises(ArgumentError, match=r"the variable ELIB_ROBOT: 'corridor' is neither") as caught:
        elib.connect()
    assert caught.value.hint == "write sim://corridor"
    with pytest.raises(SystemExit) as ended:
        elib.robot_url(argv=[])
    assert ended.value.code == 2
    assert "ELIB_ROBOT" in capsys.readouterr().err
    with pytest.raises(ArgumentError, match="does not name a robot"), substituted([]):
        pass


@pytest.mark.parametrize("opened", WAYS)
def test_a_hook_sees_every_robot_that_is_opened(opened: Callable[..., str]) -> None:
    seen: list[str] = []

    def note(robot: elib.Epuck) -> None:
        seen.append(f"{robot.name} {robot.firmware}")

    with on_open(note):
        opened(FAST)
    opened(FAST)
    assert len(seen) == 1
    assert seen[0].endswith(" asercom-1.2.2")


def test_an_error_of_a_hook_ends_the_opening() -> None:
    def refuse(robot: elib.Epuck) -> None:
        raise ArgumentError("not this one")

    with on_open(refuse), pytest.raises(ArgumentError, match="not this one"):
        elib.connect(FAST)
