"""The drive: one page drives, and nobody driving means standing still."""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections import deque
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from elib.base.errors import ArgumentError, ElibError, ReplyTimeout
from elib.base.timebase import SimulatedLoop
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context
from elib.link.protocol.profiles import PROFILES
from elib.link.protocol.table import Request
from elib.link.session import Hooks
from elib.panel.drivelock import AGAIN, DEAD_MAN, STANDING, DriveLock, Speeds
from elib.panel.interlock import Interlock
from elib.testing import simulated
from lanes import few_and_many
from shared import now

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


def locked() -> tuple[DriveLock, Wheels]:
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
    drive, wheels = locked()
    await hold(drive, "one", 0.5, 0.25, 1.0)
    assert wheels.words == ["0.5 0.25"]
    assert (drive.driver, drive.may_move) == ("one", True)


async def test_of_many_wishes_only_the_newest_is_sent() -> None:
    drive, wheels = locked()
    for tenth in range(10):
        drive.steer("one", tenth / 10, 0)
    await asyncio.sleep(0.25)
    assert wheels.words == ["0.9 0"]


async def test_a_page_that_falls_silent_stops_the_robot() -> None:
    drive, wheels = locked()
    await hold(drive, "one", 1, 1, 1.0)
    silent = asyncio.get_running_loop().time() - 0.1
    await asyncio.sleep(1)
    (when,) = (time for time, word in wheels.told if word == "stop")
    assert when - silent == pytest.approx(DEAD_MAN)
    assert (drive.driver, drive.may_move) == ("", False)


async def test_a_still_hand_drives_on_as_long_as_its_page_beats() -> None:
    drive, wheels = locked()
    drive.steer("one", 1, 1)
    for _ in range(20):
        await asyncio.sleep(0.1)
        assert drive.beat("one")
    assert wheels.words == ["1 1"]


async def test_a_page_that_is_closed_stops_the_robot_at_once() -> None:
    drive, wheels = locked()
    await hold(drive, "one", 1, 1, 0.5)
    drive.leave("one")
    await asyncio.sleep(0.01)
    assert wheels.words[-1] == "stop"


async def test_a_second_page_watches_and_takes_over_when_it_was_asked_for() -> None:
    drive, wheels = locked()
    await hold(drive, "one", 1, 1, 0.3)
    assert not drive.steer("two", -1, -1)
    assert not drive.take("two")
    assert drive.driver == "one"
    assert drive.take("two", by_force=True)
    assert not drive.steer("one", 1, 1)
    await hold(drive, "two", -1, -1, 0.5)
    assert wheels.words == ["1 1", "stop", "-1 -1"]


async def test_a_stop_that_is_not_confirmed_is_repeated_until_it_is() -> None:
    drive, wheels = locked()
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
    drive, wheels = locked()
    await hold(drive, "one", 1, 1, 0.3)
    drive.stop()
    await asyncio.sleep(0.05)
    assert wheels.words[-1] == "stop"


async def test_the_limit_and_the_robots_own_fastest_scale_the_wheels() -> None:
    drive, wheels = locked()
    drive.limit, drive.fastest = 0.5, 1.1
    drive.steer("one", 1, -0.001)
    await asyncio.sleep(0.2)
    assert wheels.words == ["0.55 0"]


async def test_what_is_no_number_is_refused() -> None:
    drive, wheels = locked()
    for value in (math.nan, math.inf, "1", None, True, [1]):
        with pytest.raises(ArgumentError, match="left is"):
            drive.steer("one", value, 0)  # type: ignore[arg-type]
        await asyncio.sleep(1)
        assert wheels.told == [], value


async def test_more_than_all_is_all() -> None:
    drive, wheels = locked()
    drive.steer("one", 7, -1e9)
    await asyncio.sleep(0.2)
    assert wheels.words == ["1 -1"]


async def test_a_closed_lock_drives_no_more() -> None:
    drive, wheels = locked()
    await drive.close()
    assert not drive.steer("one", 1, 1)
    await asyncio.sleep(0.5)
    assert wheels.told == []


async def test_a_stop_waits_for_no_drive_that_is_under_way() -> None:
    drive, wheels = locked()
    drive.steer("one", 1, 1)
    await asyncio.sleep(0.05)
    drive.stop()
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert [round(time, 3) for time, word in wheels.told if word == "stop"] == [0.05]


async def test_after_a_stop_a_held_stick_moves_nothing_until_it_was_let_go() -> None:
    drive, wheels = locked()
    await hold(drive, "one", 1, 1, 0.3)
    drive.stop()
    await hold(drive, "one", 1, 1, 1.0)
    assert wheels.words == ["1 1", "stop"]
    assert (drive.driver, drive.is_latched) == ("one", True)
    await hold(drive, "one", 0, 0, 0.2)
    await hold(drive, "one", 1, 1, 0.3)
    assert wheels.words == ["1 1", "stop", "1 1"]


@pytest.mark.parametrize("is_silent_before", [False, True])
async def test_a_stick_that_was_held_at_a_stop_moves_nothing_also_after_its_page_was_silent(is_silent_before) -> None:
    drive, wheels = locked()
    await hold(drive, "one", 1, 1, 0.3)
    if is_silent_before:
        await asyncio.sleep(1)
    drive.stop()
    await asyncio.sleep(1)
    assert drive.driver == ""
    told = len(wheels.words)
    await hold(drive, "one", 1, 1, 0.5)
    assert (wheels.words[told:], drive.is_latched, drive.may_move) == ([], True, False)
    await hold(drive, "one", 0, 0, 0.1)
    await hold(drive, "one", 1, 1, 0.3)
    assert wheels.words[-1] == "1 1"
    drive.leave("one")
    drive.stop()
    await hold(drive, "two", 0.5, 0.5, 0.3)
    assert wheels.words[-1] == "0.5 0.5", "another hand was not on a stick"


async def test_who_takes_over_and_says_nothing_drives_no_more() -> None:
    drive, wheels = locked()
    assert drive.take("one")
    await asyncio.sleep(DEAD_MAN + 0.1)
    assert drive.driver == ""
    assert drive.steer("two", 1, 1)
    await asyncio.sleep(0.2)
    assert wheels.words == ["1 1"]


async def test_a_command_past_the_stick_has_the_same_dead_man() -> None:
    drive, wheels = locked()
    assert drive.note_command("one")
    assert not drive.note_command("two")
    for _ in range(10):
        await asyncio.sleep(0.1)
        assert drive.beat("one")
    assert (wheels.words, drive.may_move) == ([], True)
    await asyncio.sleep(1)
    assert (wheels.words, drive.may_move, drive.driver) == (["stop"], False, "")


async def test_a_drive_that_a_stop_took_the_place_of_is_not_taken_for_done() -> None:
    drive, wheels = locked()

    async def coalesced(left: float, right: float) -> None:
        await asyncio.sleep(0.15)  # it ends with the stop that overtook it

    drive._drive = coalesced
    drive.steer("one", 1, 1)
    await asyncio.sleep(0.05)
    drive.halt()
    await asyncio.sleep(0.2)
    assert not drive.may_move
    drive._drive = wheels.drive
    await hold(drive, "one", 1, 1, 0.3)
    assert wheels.words == ["stop", "1 1"]


async def test_a_stop_while_another_is_under_way_is_sent_as_well() -> None:
    drive, wheels = locked()
    drive.stop()
    await asyncio.sleep(0.05)
    drive.stop()
    await drive.wait_until_stopped()
    assert wheels.words == ["stop", "stop"]


async def test_without_a_robot_nobody_drives_and_no_stop_is_repeated() -> None:
    drive, wheels = locked()
    await hold(drive, "one", 1, 1, 0.3)
    wheels.failures = 99
    drive.stop()
    await asyncio.sleep(0.2)
    drive.detach()
    sent = len(wheels.told)
    await asyncio.sleep(3)
    assert len(wheels.told) == sent
    assert not drive.steer("one", 1, 1)
    assert not drive.take("one", by_force=True)
    assert drive.may_move
    drive.attach(1.1)
    wheels.failures = 0
    await hold(drive, "one", 1, 1, 0.3)
    assert drive.is_latched, "the stick was held at the stop, and is still"
    await hold(drive, "one", 0, 0, 0.1)
    await hold(drive, "one", 1, 1, 0.3)
    assert wheels.words[-1] == "1.1 1.1"


async def test_a_speed_limit_that_cannot_be_is_refused() -> None:
    drive, _ = locked()
    drive.limit_to(0.25)
    for share in (math.nan, -0.1, 1.1, "1", None, True):
        with pytest.raises(ArgumentError, match="the speed limit is"):
            drive.limit_to(share)  # type: ignore[arg-type]
        assert drive.limit == 0.25, share


async def test_hands_and_stops_are_told_to_what_drives_by_itself() -> None:
    drive, _ = locked()
    told: list[str] = []
    drive.on_hand = told.append
    drive.steer("one", 0, 0)
    drive.steer("one", 1, 0)
    drive.stop()
    drive.leave("one")
    assert told == ["steer", "stop"]


async def test_a_command_behind_a_stop_has_its_dead_man_also_on_a_slow_line() -> None:
    line = Line([("answered", 0.1), ("answered", 1.0)])
    drive = DriveLock(lambda *speeds: line.send(speeds), line.stop)
    drive.stop()
    await asyncio.sleep(0)
    assert drive.note_command("one")
    command = line.send(SPEED)
    await asyncio.sleep(0.2)  # the stop is confirmed, and the command is on its way
    assert drive.may_move
    await command
    assert (line.speeds, drive.driver, drive.may_move) == (STANDING, "", False)


async def test_a_program_that_is_ended_while_it_is_to_continue_moves_nothing() -> None:
    line = Line([])
    drive = DriveLock(lambda *speeds: line.send(speeds), line.stop)
    program = Interlock(line, drive)  # type: ignore[arg-type]
    await program.execute(SPECS["set_speed"].request(CONTEXT, *SPEED), 1.0)
    program.pause()
    await line.stop()
    program.end()
    await program.resume()
    assert not line.may_turn


async def test_a_speed_limit_of_zero_releases_no_stick() -> None:
    drive, wheels = locked()
    await hold(drive, "one", 1, 1, 0.3)
    drive.stop()
    for drive.limit in (0.0, 1.0):
        await hold(drive, "one", 1, 1, 0.3)
    assert wheels.words == ["1 1", "stop"]


# -- any schedule of events and failures --

SPEED = (0.5, 0.5)
UNANSWERED = 0.4
"""s after which a command without an answer has failed."""
TICK, LATE = 0.01, 0.015

"""s between two looks at what must be true, and s that one of them may come late."""
CONTEXT = Context(PROFILES["asercom-1.2.2"])


class Line:
    """A robot at the end of a line. Commands arrive in the order in which they were sent, or not at all.

    Attributes:
        speeds: How the wheels truly turn.
        stopping: How many stops are under way.
        stopped: When the last of them ended.
    """

    def __init__(self, fates: list[tuple[str, float]]) -> None:
        self.speeds = STANDING
        self.stopping = 0
        self.stopped = -math.inf
        self.hooks, self.error = Hooks(), None
        self.fates = iter(fates)
        self._arriving: deque[Speeds] = deque()
        self._free = 0.0

    @property
    def may_turn(self) -> bool:
        """Whether the wheels turn, or will because of what is on its way."""
        return any(map(any, (self.speeds, *self._arriving)))

    def send(self, speeds: Speeds) -> asyncio.Future[None]:
        fate, trip = next(self.fates, ("answered", 0.02))
        if fate != "lost":
            self._free = max(self._free, now() + trip / 2)
            self._arriving.append(speeds)
            asyncio.get_running_loop().call_at(self._free, self._arrive, self._arriving)
        return asyncio.ensure_future(self._answer(self._free + trip / 2 - now() if fate == "answered" else None))

    async def _answer(self, seconds: float | None) -> None:
        await asyncio.sleep(UNANSWERED if seconds is None else seconds)
        if seconds is None:
            raise ReplyTimeout("no answer")

    def _arrive(self, arriving: deque[Speeds]) -> None:
        if arriving is self._arriving:
            self.speeds = arriving.popleft()

    def restart(self) -> None:
        """Stand, and know nothing of what is on its way."""
        self.speeds, self._arriving = STANDING, deque()

    async def stop(self) -> None:
        self.stopping += 1
        try:
            await self.send(STANDING)
        finally:
            self.stopping -= 1
            self.stopped = now()

    async def execute(self, request: Request[Any], timeout: float) -> None:
        await self.send((request.numbers[0] / 1000, request.numbers[1] / 1000) if request.numbers else STANDING)


class Story:
    """Two pages, a console and a program at one robot, and what must be true of them whatever happens."""

    def __init__(self, fates: list[tuple[str, float]]) -> None:
        self.line = Line(fates)
        self.lock = DriveLock(self._drive, self.line.stop)
        self.lock.limit = 1.0
        self.lock.on_hand = self._on_hand
        self.is_attached = True
        self.program: Interlock | None = None
        self.resuming: asyncio.Task[None] | None = None
        self.said: asyncio.Task[None] | None = None
        self.held = ""  # the page that drove at the last stop, until its stick was released or it drives no more
        self.halted = -math.inf
        self.signs = dict.fromkeys(("", "one", "two"), -math.inf)

    async def _drive(self, left: float, right: float) -> None:
        if left or right:
            assert self.lock.driver, "it moves and nobody drives"
            assert self.lock.driver != self.held, "after a stop it moves, and its stick was not released"
            assert self.program is None or self.program.is_paused, "a person's hand did not pause the program"
        await self.line.send((left, right))

    def _on_hand(self, what: str) -> None:
        """Do what the runner of behaviours does."""
        if self.program is None:
            return
        self.halted = now()
        if self.resuming is not None:
            self.resuming.cancel()
        if what == "stop":
            self.program.end()
            self.program = None
            self.lock.halt()
        elif not self.program.is_paused:
            self.program.pause()
            self.lock.halt()

    @property
    def is_person_away(self) -> bool:
        return self.is_attached and not self.lock.is_driven_by_hand

    # -- what may happen --

    def steer(self, page: str, share: float) -> None:
        if share == 0 and page == self.held:
            self.held = ""
        if self.lock.steer(page, share, share):
            self.signs[page] = now()

    def take(self, page: str) -> None:
        if page != self.lock.driver:
            self.held = ""
        self.lock.take(page, by_force=True)
        self.signs[page] = now()

    def beat(self, page: str) -> None:
        if self.lock.beat(page):
            self.signs[page] = now()

    def leave(self, page: str) -> None:
        if page == self.held:
            self.held = ""
        self.lock.leave(page)

    def stop(self, page: str) -> None:
        self.held = self.lock.driver
        self.halted = now()
        self.lock.stop()

    def command(self, page: str) -> None:
        """Turn the wheels by a command of the console."""
        if self.lock.note_command(page):
            self.signs[page] = now()
            self.line.send(SPEED).add_done_callback(asyncio.Future.exception)

    def run(self, page: str) -> None:
        """Begin a program, or let it go on."""
        if self.is_person_away and (self.program is None or self.program.is_paused) and self.resuming is None:
            self.held = ""
            self.lock.release()
            program = self.program = self.program or Interlock(self.line, self.lock)  # type: ignore[arg-type]
            program.pause()
            self.resuming = asyncio.ensure_future(self._resume(program))
            self.resuming.add_done_callback(self._resumed)

    async def _resume(self, program: Interlock) -> None:
        try:
            await self.lock.wait_until_stopped()
            await program.resume()
        except ReplyTimeout:
            self.halted = now()
            self.lock.halt()

    def _resumed(self, task: asyncio.Task[None]) -> None:
        if self.resuming is task:
            self.resuming = None

    def program_moves(self, page: str) -> None:
        self._program_says(SPECS["set_speed"].request(CONTEXT, *SPEED))

    def program_rests(self, page: str) -> None:
        self._program_says(SPECS["set_speed"].request(CONTEXT, 0, 0))

    def program_stops(self, page: str) -> None:
        self._program_says(SPECS["stop"].request(CONTEXT))

    def _program_says(self, request: Request[Any]) -> None:
        if self.program is not None:
            self.said = asyncio.ensure_future(self._say(self.program, request))

    async def _say(self, program: Interlock, request: Request[Any]) -> None:
        with contextlib.suppress(ElibError):
            await program.execute(request, 1.0)

    def restart(self, page: str) -> None:
        """Let the robot start again."""
        self.line.restart()
        self.lock.invalidate()

    def detach(self, page: str) -> None:
        self._on_hand("stop")
        self.is_attached = False
        self.lock.detach()

    def attach(self, page: str) -> None:
        """Connect the robot again, which stops it first of all."""
        if not self.is_attached:
            self.line.restart()
            self.is_attached = True
            self.lock.attach(1.0)

    # -- what must be true --

    def check(self) -> None:
        lock, line = self.lock, self.line
        if not lock.driver:
            self.held = ""
        if not self.is_attached:
            assert not lock.driver
            return
        assert lock.may_move or not line.may_turn, "it is said to stand, and that was not confirmed"
        assert not lock.driver or now() <= max(self.signs[lock.driver], self.halted) + DEAD_MAN + LATE, (
            "a silent page drives"
        )
        is_run = self.program is not None and (not self.program.is_paused or self.resuming is not None)
        if lock.may_move and not lock.driver and not is_run and now() > self.signs[""] + DEAD_MAN + LATE:
            assert line.stopping or now() <= line.stopped + AGAIN + LATE, (
                "it may move, nobody drives, and no stop is repeated"
            )


EVENTS = (
    *((name, page) for name in ("take", "beat", "leave", "command") for page in ("one", "two")),
    *(("steer", page, share) for page in ("one", "one", "two") for share in (0, 1, 1)),
    *((name, "") for name in ("stop", "run", "program_moves", "attach") for _ in range(3)),
    *((name, "") for name in ("command", "program_rests", "program_stops", "restart", "detach")),
)
"""What may happen, the more often the more it stands here."""
PAUSES = (-TICK, -TICK, 0.0, 0.05, 0.1, 0.25, 0.35)
FATES = ("answered", "answered", "answered", "lost", "late")


SILENT_AT_A_LOOK = (
    [
        *((0.0, (name, "one")) for name in ("take", "leave", "take")),
        (0.1, ("take", "two")),
        (0.25, ("take", "one")),
        *[(0.35, ("beat", "one"))] * 2,
        (0.05, ("command", "two")),
        (0.25, ("beat", "one")),
        (0.25, ("command", "two")),
        (-TICK, ("steer", "two", 0)),
        (-TICK, ("beat", "one")),
    ],
    [*[("answered", 0.02)] * 5, ("answered", 0.5), ("answered", 0.1)],
)
"""A schedule in which a page falls silent at the very moment of a look, and the stop is sent right after it."""


@few_and_many(100, 600)
def test_any_schedule_of_pages_programs_and_failures_leaves_no_robot_moving_that_nobody_drives(examples: int) -> None:
    @settings(max_examples=examples)
    @example(*SILENT_AT_A_LOOK)
    @given(
        st.lists(st.tuples(st.sampled_from(PAUSES), st.sampled_from(EVENTS)), min_size=20, max_size=40),
        st.lists(st.tuples(st.sampled_from(FATES), st.sampled_from((0.02, 0.1, 0.5))), max_size=20),
    )
    @simulated
    async def story(events: list[tuple[float, tuple[Any, ...]]], fates: list[tuple[str, float]]) -> None:
        it = Story(fates)
        faults: list[object] = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: faults.append(context))

        async def watch(seconds: float) -> None:
            for _ in range(round(seconds / TICK) + 1):
                await asyncio.sleep(0)  # what has happened by now leads to a task of its own, which begins
                it.check()
                await asyncio.sleep(TICK)

        for pause, (name, *arguments) in events:
            await watch(pause)
            getattr(it, name)(*arguments)
        it._on_hand("stop")
        it.attach("")
        it.line.fates = iter(())
        await watch(3)
        assert (it.line.speeds, it.lock.may_move, it.lock.trouble) == (STANDING, False, "")
        await it.lock.close()
        assert not faults, faults

    story()
