"""The helm: one page drives, and nobody driving means standing still."""

from __future__ import annotations

import asyncio
import math

import pytest

from elib.errors import ArgumentError, ReplyTimeout
from elib.joystick.helm import DEAD_MAN, Helm
from elib.testing.simulated import simulated


class Wheels:
    """Takes commands as a robot does, each in a tenth of a second, and fails when told to."""

    def __init__(self) -> None:
        self.told: list[tuple[float, str]] = []
        self.failures = 0

    async def drive(self, left: float, right: float) -> None:
        await self._do(f"{left:g} {right:g}")

    async def stop(self) -> None:
        await self._do("stop")

    async def _do(self, word: str) -> None:
        self.told.append((asyncio.get_running_loop().time(), word))
        await asyncio.sleep(0.1)
        if self.failures:
            self.failures -= 1
            raise ReplyTimeout("no answer")

    @property
    def words(self) -> list[str]:
        return [word for _, word in self.told]


def helmed() -> tuple[Helm, Wheels]:
    wheels = Wheels()
    helm = Helm(wheels.drive, wheels.stop)
    helm.limit = 1.0
    return helm, wheels


async def hold(helm: Helm, page: str, left: float, right: float, seconds: float) -> None:
    """Keep saying the same, as a page does."""
    for _ in range(round(seconds / 0.1)):
        helm.steer(page, left, right)
        await asyncio.sleep(0.1)


@simulated
async def test_a_page_that_steers_drives() -> None:
    helm, wheels = helmed()
    await hold(helm, "one", 0.5, 0.25, 1.0)
    assert wheels.words == ["0.5 0.25"]
    assert (helm.captain, helm.may_move) == ("one", True)


@simulated
async def test_of_many_wishes_only_the_newest_is_sent() -> None:
    helm, wheels = helmed()
    for tenth in range(10):
        helm.steer("one", tenth / 10, 0)
    await asyncio.sleep(0.25)
    assert wheels.words == ["0.9 0"]


@simulated
async def test_a_page_that_falls_silent_stops_the_robot() -> None:
    helm, wheels = helmed()
    await hold(helm, "one", 1, 1, 1.0)
    silent = asyncio.get_running_loop().time() - 0.1
    await asyncio.sleep(1)
    (when,) = (time for time, word in wheels.told if word == "stop")
    assert when - silent == pytest.approx(DEAD_MAN)
    assert (helm.captain, helm.may_move) == ("", False)


@simulated
async def test_a_still_hand_drives_on_as_long_as_its_page_beats() -> None:
    helm, wheels = helmed()
    helm.steer("one", 1, 1)
    for _ in range(20):
        await asyncio.sleep(0.1)
        assert helm.beat("one")
    assert wheels.words == ["1 1"]


@simulated
async def test_a_page_that_is_closed_stops_the_robot_at_once() -> None:
    helm, wheels = helmed()
    await hold(helm, "one", 1, 1, 0.5)
    helm.leave("one")
    await asyncio.sleep(0.01)
    assert wheels.words[-1] == "stop"


@simulated
async def test_a_second_page_watches_and_takes_over_when_it_was_asked_for() -> None:
    helm, wheels = helmed()
    await hold(helm, "one", 1, 1, 0.3)
    assert not helm.steer("two", -1, -1)
    assert helm.take("two").captain == "one"
    assert helm.take("two", by_force=True).drives
    assert not helm.steer("one", 1, 1)
    await hold(helm, "two", -1, -1, 0.5)
    assert wheels.words == ["1 1", "stop", "-1 -1"]


@simulated
async def test_a_stop_that_is_not_confirmed_is_repeated_until_it_is() -> None:
    helm, wheels = helmed()
    await hold(helm, "one", 1, 1, 0.3)
    wheels.failures = 3
    helm.stop()
    await asyncio.sleep(0.25)
    assert helm.may_move
    assert helm.trouble
    await asyncio.sleep(2)
    assert wheels.words == ["1 1", "stop", "stop", "stop", "stop"]
    assert not helm.may_move
    assert not helm.trouble


@simulated
async def test_anybody_may_stop() -> None:
    helm, wheels = helmed()
    await hold(helm, "one", 1, 1, 0.3)
    helm.stop()
    await asyncio.sleep(0.05)
    assert wheels.words[-1] == "stop"


@simulated
async def test_the_limit_and_the_robots_own_fastest_scale_the_wheels() -> None:
    helm, wheels = helmed()
    helm.limit, helm.fastest = 0.5, 1.1
    helm.steer("one", 1, -0.001)
    await asyncio.sleep(0.2)
    assert wheels.words == ["0.55 0"]


@pytest.mark.parametrize("value", [math.nan, math.inf, "1", None, True, [1]])
def test_what_is_no_number_is_refused(value: object) -> None:
    @simulated
    async def refused() -> None:
        helm, wheels = helmed()
        with pytest.raises(ArgumentError, match="left is"):
            helm.steer("one", value, 0)  # type: ignore[arg-type]
        await asyncio.sleep(1)
        assert wheels.told == []

    refused()


@simulated
async def test_more_than_all_is_all() -> None:
    helm, wheels = helmed()
    helm.steer("one", 7, -1e9)
    await asyncio.sleep(0.2)
    assert wheels.words == ["1 -1"]


@simulated
async def test_a_closed_helm_drives_no_more() -> None:
    helm, wheels = helmed()
    await helm.close()
    assert not helm.steer("one", 1, 1)
    await asyncio.sleep(0.5)
    assert wheels.told == []


@simulated
async def test_a_stop_waits_for_no_drive_that_is_under_way() -> None:
    helm, wheels = helmed()
    helm.steer("one", 1, 1)
    await asyncio.sleep(0.05)
    helm.stop()
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert [round(time, 3) for time, word in wheels.told if word == "stop"] == [0.05]
