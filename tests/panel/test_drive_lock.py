"""The drive: one page drives, and nobody driving means standing still."""

from __future__ import annotations

import asyncio
import math

import pytest

from elib.base.errors import ArgumentError, ReplyTimeout
from elib.base.timebase import SimulatedLoop
from elib.panel.drivelock import DEAD_MAN, DriveLock

# clock: simulated
LOOP = SimulatedLoop


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


def helmed() -> tuple[DriveLock, Wheels]:
    wheels = Wheels()
    drive = DriveLock(wheels.drive, wheels.stop)
    drive.limit = 1.0
    return drive, wheels


async def hold(drive: DriveLock, page: str, left: float, right: float, seconds: float) -> None:
    """Keep saying the same, as a page does."""
    for _ in range(round(seconds / 0.1)):
        drive.steer(page, left, right)
        await asyncio.sleep(0.1)


async def test_a_page_that_steers_drives() -> None:
    drive, wheels = helmed()
    await hold(drive, "one", 0.5, 0.25, 1.0)
    assert wheels.words == ["0.5 0.25"]
    assert (drive.driver, drive.may_move) == ("one", True)


async def test_of_many_wishes_only_the_newest_is_sent() -> None:
    drive, wheels = helmed()
    for tenth in range(10):
        drive.steer("one", tenth / 10, 0)
    await asyncio.sleep(0.25)
    assert wheels.words == ["0.9 0"]


async def test_a_page_that_falls_silent_stops_the_robot() -> None:
    drive, wheels = helmed()
    await hold(drive, "one", 1, 1, 1.0)
    silent = asyncio.get_running_loop().time() - 0.1
    await asyncio.sleep(1)
    (when,) = (time for time, word in wheels.told if word == "stop")
    assert when - silent == pytest.approx(DEAD_MAN)
    assert (drive.driver, drive.may_move) == ("", False)


async def test_a_still_hand_drives_on_as_long_as_its_page_beats() -> None:
    drive, wheels = helmed()
    drive.steer("one", 1, 1)
    for _ in range(20):
        await asyncio.sleep(0.1)
        assert drive.beat("one")
    assert wheels.words == ["1 1"]


async def test_a_page_that_is_closed_stops_the_robot_at_once() -> None:
    drive, wheels = helmed()
    await hold(drive, "one", 1, 1, 0.5)
    drive.leave("one")
    await asyncio.sleep(0.01)
    assert wheels.words[-1] == "stop"


async def test_a_second_page_watches_and_takes_over_when_it_was_asked_for() -> None:
    drive, wheels = helmed()
    await hold(drive, "one", 1, 1, 0.3)
    assert not drive.steer("two", -1, -1)
    assert not drive.take("two")
    assert drive.driver == "one"
    assert drive.take("two", by_force=True)
    assert not drive.steer("one", 1, 1)
    await hold(drive, "two", -1, -1, 0.5)
    assert wheels.words == ["1 1", "stop", "-1 -1"]


async def test_a_stop_that_is_not_confirmed_is_repeated_until_it_is() -> None:
    drive, wheels = helmed()
    await hold(drive, "one", 1, 1, 0.3)
    wheels.failures = 3
    drive.stop()
    await asyncio.sleep(0.25)
    assert drive.may_move
    assert drive.trouble
    await asyncio.sleep(2)
    assert wheels.words == ["1 1", "stop", "stop", "stop", "stop"]
    assert not drive.may_move
    assert not drive.trouble


async def test_anybody_may_stop() -> None:
    drive, wheels = helmed()
    await hold(drive, "one", 1, 1, 0.3)
    drive.stop()
    await asyncio.sleep(0.05)
    assert wheels.words[-1] == "stop"


async def test_the_limit_and_the_robots_own_fastest_scale_the_wheels() -> None:
    drive, wheels = helmed()
    drive.limit, drive.fastest = 0.5, 1.1
    drive.steer("one", 1, -0.001)
    await asyncio.sleep(0.2)
    assert wheels.words == ["0.55 0"]


async def test_what_is_no_number_is_refused() -> None:
    drive, wheels = helmed()
    for value in (math.nan, math.inf, "1", None, True, [1]):
        with pytest.raises(ArgumentError, match="left is"):
            drive.steer("one", value, 0)  # type: ignore[arg-type]
        await asyncio.sleep(1)
        assert wheels.told == [], value


async def test_more_than_all_is_all() -> None:
    drive, wheels = helmed()
    drive.steer("one", 7, -1e9)
    await asyncio.sleep(0.2)
    assert wheels.words == ["1 -1"]


async def test_a_closed_helm_drives_no_more() -> None:
    drive, wheels = helmed()
    await drive.close()
    assert not drive.steer("one", 1, 1)
    await asyncio.sleep(0.5)
    assert wheels.told == []


async def test_a_stop_waits_for_no_drive_that_is_under_way() -> None:
    drive, wheels = helmed()
    drive.steer("one", 1, 1)
    await asyncio.sleep(0.05)
    drive.stop()
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert [round(time, 3) for time, word in wheels.told if word == "stop"] == [0.05]


async def test_after_a_stop_a_held_stick_moves_nothing_until_it_was_let_go() -> None:
    drive, wheels = helmed()
    await hold(drive, "one", 1, 1, 0.3)
    drive.stop()
    await hold(drive, "one", 1, 1, 1.0)
    assert wheels.words == ["1 1", "stop"]
    assert (drive.driver, drive.is_latched) == ("one", True)
    await hold(drive, "one", 0, 0, 0.2)
    await hold(drive, "one", 1, 1, 0.3)
    assert wheels.words == ["1 1", "stop", "1 1"]


async def test_who_takes_over_and_says_nothing_loses_the_helm() -> None:
    drive, wheels = helmed()
    assert drive.take("one")
    await asyncio.sleep(DEAD_MAN + 0.1)
    assert drive.driver == ""
    assert drive.steer("two", 1, 1)
    await asyncio.sleep(0.2)
    assert wheels.words == ["1 1"]


async def test_a_command_past_the_stick_has_the_same_dead_man() -> None:
    drive, wheels = helmed()
    assert drive.watch_over("one")
    assert not drive.watch_over("two")
    for _ in range(10):
        await asyncio.sleep(0.1)
        assert drive.beat("one")
    assert (wheels.words, drive.may_move) == ([], True)
    await asyncio.sleep(1)
    assert (wheels.words, drive.may_move, drive.driver) == (["stop"], False, "")


async def test_a_drive_that_a_stop_took_the_place_of_is_not_taken_for_done() -> None:
    drive, wheels = helmed()

    async def coalesced(left: float, right: float) -> None:
        await asyncio.sleep(0.15)  # it ends with the stop that overtook it

    drive._drive = coalesced
    drive.steer("one", 1, 1)
    await asyncio.sleep(0.05)
    drive.still()
    await asyncio.sleep(0.2)
    assert not drive.may_move
    drive._drive = wheels.drive
    await hold(drive, "one", 1, 1, 0.3)
    assert wheels.words == ["stop", "1 1"]


async def test_a_stop_while_another_is_under_way_is_sent_as_well() -> None:
    drive, wheels = helmed()
    drive.stop()
    await asyncio.sleep(0.05)
    drive.stop()
    await drive.settle()
    assert wheels.words == ["stop", "stop"]


async def test_without_a_robot_nobody_drives_and_no_stop_is_repeated() -> None:
    drive, wheels = helmed()
    await hold(drive, "one", 1, 1, 0.3)
    wheels.failures = 99
    drive.stop()
    await asyncio.sleep(0.2)
    drive.detach()
    sent = len(wheels.told)
    await asyncio.sleep(3)
    assert len(wheels.told) == sent
    assert not drive.steer("one", 1, 1)
    assert drive.may_move
    drive.attach(1.1)
    wheels.failures = 0
    await hold(drive, "one", 1, 1, 0.3)
    assert wheels.words[-1] == "1.1 1.1"


async def test_a_speed_limit_that_cannot_be_is_refused() -> None:
    drive, _ = helmed()
    drive.limit_to(0.25)
    for share in (math.nan, -0.1, 1.1, "1", None, True):
        with pytest.raises(ArgumentError, match="the speed limit is"):
            drive.limit_to(share)  # type: ignore[arg-type]
        assert drive.limit == 0.25, share


async def test_hands_and_stops_are_told_to_what_drives_by_itself() -> None:
    drive, _ = helmed()
    told: list[str] = []
    drive.on_hand = told.append
    drive.steer("one", 0, 0)
    drive.steer("one", 1, 0)
    drive.stop()
    drive.leave("one")
    assert told == ["steer", "stop"]
