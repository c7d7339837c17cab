"""Behaviours on a robot of the panel: started, paused, continued and ended.

When a person drives, the behaviour pauses until it is continued. A stop ends it, from any page, and so does the closing
of the last page: no behaviour drives a robot that no one watches.
"""

from __future__ import annotations

import asyncio
import contextlib
import enum
import inspect
import sys
import threading
from collections import deque
from collections.abc import Mapping
from concurrent.futures import Future
from typing import Annotated, Protocol

from msgspec import Meta, Struct

from elib.base.errors import ArgumentError, ElibError
from elib.behaviours import (
    Behaviour,
    BehaviourStyle,
    RunContext,
    RunEvent,
    RunMessage,
    RunResult,
    StateChanged,
    behaviours,
    find,
    run_behaviour,
    run_behaviour_blocking,
)
from elib.link.session import Channel
from elib.panel.drivelock import DriveLock
from elib.panel.events import EventLog
from elib.panel.interlock import Bridge, Interlock, ProxiedRobot
from elib.panel.machine import RunningMachine
from elib.robot.aio import Epuck
from elib.robot.blocking import BlockingEpuck

KEPT = 500
"""Lines of a behaviour's own log that are kept."""
ENDING_TIME = 10.0
"""s that a behaviour may take to end: three stops that are not confirmed take 7.5 s. It cannot drive meanwhile."""
GROUPS = {"vehicles": 0, "samples of 2011": 1, "swarm": 2, "tools": 3}
"""The order of the groups; others come first, because they are the user's own."""
ELSEWHERE: Mapping[BehaviourStyle, str] = {
    BehaviourStyle.SWARM: "it needs several robots",
    BehaviourStyle.BYTES: "it opens the line itself, without the library",
}
"""Why a behaviour cannot run on a robot of the panel."""


class Host(Protocol):
    """What a behaviour needs of the place that it runs in: who drives the robot, the robot, and its event log."""

    drive: DriveLock
    log: EventLog

    @property
    def robot(self) -> Epuck:
        """The robot."""

    @property
    def machine(self) -> RunningMachine:
        """What a page shows of the states of the behaviour."""


class RunPhase(enum.Enum):
    """Where a behaviour is in its life."""

    IDLE = "none has run"
    RUNNING = "running"
    PAUSED = "paused"
    ENDED = "came to its end"
    STOPPED = "stopped"
    FAILED = "failed"


class BehaviourRunner:
    """Behaviours on one robot, one at a time.

    Attributes:
        name: The name of the behaviour that runs, or ran last; empty before the first.
        state: What it is doing in its own words, like ``turning``; empty where it does not say.
        error: Why it failed; empty if it did not.
        reason: Why it pauses; empty if it does not.
    """

    def __init__(self, slot: Host) -> None:
        self.name = self.state = self.error = self.reason = ""
        self.phase = RunPhase.IDLE  # where it is in its life
        # what it said: the time since its start, s, and the text
        self.lines: deque[tuple[float, str]] = deque(maxlen=KEPT)
        self.line_count = 0  # how many lines there ever were
        self.is_held = False  # whether what pauses is a program that a person has stopped, until a person continues it
        self._slot = slot
        self._loop = asyncio.get_running_loop()
        self._task: asyncio.Task[None] | None = None
        self._going_on: asyncio.Task[None] | None = None
        self._interlock: Interlock | None = None
        self._context: RunContext | None = None
        self._ended = 0.0
        slot.drive.on_hand = self._on_hand

    @property
    def is_active(self) -> bool:
        """Whether a behaviour runs or pauses."""
        return self.phase in (RunPhase.RUNNING, RunPhase.PAUSED)

    @property
    def time(self) -> float:
        """How long it has been running, or ran, s."""
        return 0.0 if self._context is None else self._ended if not self.is_active else self._context.time

    # -- what a page does --

    def start(self, name: str, options: Mapping[str, object] | None = None, *, channel: Channel | None = None) -> None:
        """Start a behaviour with some of its options.

        Args:
            name: Name of the behaviour.
            options: Its options that have other values than their defaults.
            channel: A channel in front of the robot's own that limits what the behaviour may do; None for no limits.

        Raises:
            ArgumentError: There is no such behaviour or option, it cannot run here, or a behaviour or a person drives.
            LinkClosed: The robot is not connected.
        """
        what = find(name)
        if what.style in ELSEWHERE:
            raise ArgumentError(
                f"{what.name} cannot run in the panel: {ELSEWHERE[what.style]}", hint=f"elib run {what.name}"
            )
        chosen = what.check({} if options is None else dict(options))
        if self.is_active or self._task is not None:
            raise ArgumentError(f"{self.name} is still {self.phase.value}", hint="stop it first")
        if self._slot.drive.is_driven_by_hand:
            raise ArgumentError(f"{what.name} was not started: a person drives", hint="let go of the stick")
        robot = self._slot.robot
        self._slot.drive.release()
        interlock = self._interlock = Interlock(robot.session if channel is None else channel, self._slot.drive)
        context = self._context = RunContext(self._loop.time)
        self.name = what.name
        self.state = self.error = self.reason = ""
        self._slot.machine.forget()
        self.phase = RunPhase.RUNNING
        self.lines.clear()
        self.line_count = 0
        self._slot.log.note(f"{what.name} begins", "state")
        self._task = self._loop.create_task(
            self._run(what, ProxiedRobot(robot, interlock), interlock, context, chosen),
            name=f"elib behaviour {what.name}",
        )

    def pause(self, reason: str = "paused") -> None:
        """Stop the robot, and let the behaviour wait until :meth:`resume`. Safe to repeat."""
        goes_on, self._going_on = self._going_on, None
        if goes_on is not None:
            goes_on.cancel()  # the old speed may be on its way to the robot, so the wheels are stopped below
        if (self.phase is RunPhase.RUNNING or goes_on is not None) and self._interlock is not None:
            self._interlock.pause()
            self.phase, self.reason = RunPhase.PAUSED, reason
            self._slot.drive.halt()
            self._slot.log.note(f"{self.name}: {reason}", "state")

    def resume(self) -> None:
        """Continue the behaviour: the wheels turn again as before, as soon as the stop is confirmed.

        An ArgumentError says that a person drives.
        """
        if self.is_held:
            self.is_held, self.phase, self.reason = False, RunPhase.IDLE, ""
            self._slot.log.note(f"{self.name} may drive again", "state")
            return
        if self.phase is not RunPhase.PAUSED or self._interlock is None or self._going_on is not None:
            return
        if self._slot.drive.is_driven_by_hand:
            raise ArgumentError(f"{self.name} cannot continue: a person drives", hint="let go of the stick")
        self._slot.drive.release()
        self._going_on = self._loop.create_task(self._go_on(self._interlock), name="elib behaviour goes on")

    def hold(self, name: str, reason: str) -> None:
        """Show a program that a person has stopped as paused until a person continues it; nothing starts before."""
        self.halt()
        self.name, self.state, self.error, self.reason = name, "", "", reason
        self.phase, self.is_held = RunPhase.PAUSED, True
        self._slot.log.note(f"{name}: {reason}", "state")

    def halt(self, reason: str = "stopped") -> None:
        """End the behaviour and stop the robot, without waiting: no command of it reaches the robot any more."""
        if not self.is_active or self._interlock is None or self._context is None or self.is_held:
            return
        self._ended = self._context.time
        self.phase, self.reason = RunPhase.STOPPED, ""
        self._interlock.end()
        self._context.finish("stopped")
        self._slot.drive.halt()
        self._slot.log.note(f"{self.name}: {reason}", "state")

    async def stop(self) -> None:
        """End the behaviour, and wait for its end for at most 10 s. Safe to repeat."""
        self.halt()
        await self.finished(ENDING_TIME)

    async def finished(self, timeout: float) -> bool:
        """Wait for the behaviour's end for so many seconds; return whether it has ended."""
        task = self._task
        if task is not None:
            await asyncio.wait([task], timeout=timeout)
        return self._task is None

    # -- how --

    def _on_hand(self, what: str) -> None:
        if what == "stop":
            self.halt()
        else:
            self.pause("paused, because a person drives")

    async def _run(
        self,
        what: Behaviour,
        robot: ProxiedRobot,
        interlock: Interlock,
        context: RunContext,
        options: Mapping[str, object],
    ) -> None:
        context.listeners.append(lambda event: self._loop.call_soon_threadsafe(self._heard, event, context.began))
        failure: BaseException | None = None
        try:
            await self._slot.drive.wait_until_stopped()
            if what.style is BehaviourStyle.BLOCKING:
                await self._in_thread(what, robot, context, options)
            else:
                await run_behaviour(what, robot, options=options, run=context)
        except asyncio.CancelledError:
            self.halt()
            raise
        except Exception as error:
            failure = error
        finally:
            interlock.end()
            if self._going_on is not None:
                self._going_on.cancel()
            with contextlib.suppress(ElibError):
                await robot.close()
            self._task = None
        self._finish(context, failure)

    def _finish(self, context: RunContext, failure: BaseException | None) -> None:
        if self.phase is RunPhase.STOPPED or self.is_held:
            return  # what went wrong with its end is the drive's business
        self._ended = context.time
        self.reason = ""
        self.phase = RunPhase.ENDED if failure is None else RunPhase.FAILED
        if failure is None:
            self._slot.log.note(f"{self.name} came to its end", "state")
            return
        self.error = str(failure) if isinstance(failure, ElibError) else f"{type(failure).__name__}: {failure}"
        self._slot.log.note(f"{self.name} failed: {self.error.partition(chr(10))[0]}", "state", is_bad=True)
        if self._slot.drive.may_move:
            self._slot.drive.halt()

    async def _in_thread(
        self, what: Behaviour, robot: ProxiedRobot, context: RunContext, options: Mapping[str, object]
    ) -> None:
        """Run a behaviour in the blocking style, in a thread of its own."""
        bridge = Bridge(self._loop)
        bridge.before_close = robot.close
        outcome: Future[RunResult] = Future()
        outcome.set_running_or_notify_cancel()  # from now on no one cancels it
        hold = bridge.hold()

        def work() -> None:
            try:
                done = run_behaviour_blocking(what, BlockingEpuck(robot, bridge), options=options, run=context)
            except BaseException as error:
                outcome.set_exception(error)
            else:
                outcome.set_result(done)

        threading.Thread(target=lambda: bridge.run(work, hold), name=f"elib behaviour {what.name}", daemon=True).start()
        try:
            await asyncio.wrap_future(outcome)
        finally:
            bridge.close()

    async def _go_on(self, interlock: Interlock) -> None:
        try:
            await self._slot.drive.wait_until_stopped()
            await interlock.resume()
        except ElibError as error:
            self._slot.drive.halt()
            self._slot.log.note(f"{self.name} cannot continue: {error.message}", "state", is_bad=True)
        else:
            if self.phase is RunPhase.PAUSED:
                self.phase, self.reason = RunPhase.RUNNING, ""
                self._slot.log.note(f"{self.name} continues", "state")
        finally:
            if self._going_on is asyncio.current_task():
                self._going_on = None

    def _heard(self, event: RunEvent, began: float) -> None:
        if isinstance(event, StateChanged):
            self.state = event.state
        elif isinstance(event, RunMessage):
            self.lines.append((event.time - began, event.text))
            self.line_count += 1


class Play(Struct):
    """How a behaviour stands: s that it has run, lines that it ever said, and those that the page does not have yet."""

    name: str
    phase: Annotated[str, Meta(extra_json_schema={"enum": [each.name.lower() for each in RunPhase]})]
    phase_text: str
    state: str
    reason: str
    error: str
    time: float
    count: int
    lines: list[tuple[float, str]]


def runner_state(runner: BehaviourRunner, seen: int = 0) -> Play:
    """Return where a behaviour is in its life; *seen* says how many lines the page has."""
    new = min(len(runner.lines), max(0, runner.line_count - seen) if seen <= runner.line_count else KEPT)
    return Play(
        name=runner.name,
        phase=runner.phase.name.lower(),
        phase_text=runner.phase.value,
        state=runner.state,
        reason=runner.reason,
        error=runner.error,
        time=round(runner.time, 3),
        count=runner.line_count,
        lines=[(round(time, 3), text) for time, text in list(runner.lines)[len(runner.lines) - new :]],
    )


class BehaviourOption(Struct):
    """An option of a behaviour; a whole one takes only whole numbers."""

    name: str
    unit: str
    low: float | None
    high: float | None
    default: float | str | None
    whole: bool
    rule: str


class BehaviourAbout(Struct):
    """A behaviour to choose: the world that it is made for, and why it cannot run here, if it cannot."""

    name: str
    group: str
    summary: str
    world: str
    elsewhere: str
    options: list[BehaviourOption]


def catalogue() -> list[BehaviourAbout]:
    """Return all behaviours, for the page to choose from."""
    return [
        BehaviourAbout(
            name=each.name,
            group=each.group,
            summary=each.summary,
            world=each.world,
            elsewhere=ELSEWHERE.get(each.style, ""),
            options=[
                BehaviourOption(
                    name=option.name,
                    unit=option.quantity.unit,
                    low=option.quantity.low,
                    high=option.quantity.high,
                    default=option.default if isinstance(option.default, int | float | str) else None,
                    whole=not option.quantity.scale,
                    rule=option.quantity.rule,
                )
                for option in each.options
            ],
        )
        for each in sorted(behaviours().values(), key=lambda each: (GROUPS.get(each.group, -1), each.name))
    ]


def source_of(name: str) -> str:
    """Return the text of the file that a behaviour is written in; an ArgumentError says that there is none."""
    what = find(name)
    try:
        return inspect.getsource(sys.modules[what.function.__module__])
    except (OSError, TypeError):
        raise ArgumentError(f"the source of {what.name} is not installed") from None
