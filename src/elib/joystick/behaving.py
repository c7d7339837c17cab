"""Behaviours in the panel: chosen, started, paused and stopped, on the robot that is connected anyhow.

Who touches the stick has the robot: the behaviour pauses, and goes on when it is told to. Stop ends it, whoever presses
it, and so does the last page that goes away: nothing drives that nobody watches.
"""

from __future__ import annotations

import asyncio
import contextlib
import enum
import inspect
import sys
import threading
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

from elib.behaviours import (
    Behaviour,
    BehaviourStyle,
    RunContext,
    RunMessage,
    RunResult,
    StateChanged,
    behaviours,
    find,
    run_behaviour,
    run_behaviour_blocking,
)
from elib.errors import ArgumentError, ElibError
from elib.joystick.gate import Bridge, Gate, Puppet
from elib.robot.blocking import BlockingEpuck

if TYPE_CHECKING:
    from elib.joystick.pilot import Pilot

Json: TypeAlias = "bool | int | float | str | list[Json] | dict[str, Json] | None"

KEPT = 500
"""Lines of a behaviour's own log."""
LONGEST_NAME = 80
"""Characters of a behaviour's name."""
ENDING_TIME = 10.0
"""s that a behaviour may take to end when it is told to: three stops that are not confirmed take 7.5 s. It drives no
more meanwhile."""
ELSEWHERE: Mapping[BehaviourStyle, str] = {
    BehaviourStyle.SWARM: "it needs several robots",
    BehaviourStyle.BYTES: "it opens the line itself, without the library",
}
"""Why a behaviour cannot run on a robot of the panel."""


class Act(enum.Enum):
    """How it stands with the behaviour."""

    IDLE = "none has run"
    RUNNING = "running"
    PAUSED = "paused"
    ENDED = "came to its end"
    STOPPED = "stopped"
    FAILED = "failed"


class Performer:
    """Behaviours on one robot, one at a time.

    Args:
        pilot: The robot's place.

    Attributes:
        name: Of the behaviour that runs, or ran last; empty before.
        act: How it stands.
        state: What it is doing by its own words, like ``turning``; empty where it does not say.
        error: Why it failed; empty if it did not.
        reason: Why it pauses; empty if it does not.
        lines: What it said: the time since it began, s, and the text.
        line_count: How many that were.
    """

    def __init__(self, pilot: Pilot) -> None:
        self.name = self.state = self.error = self.reason = ""
        self.act = Act.IDLE
        self.lines: deque[tuple[float, str]] = deque(maxlen=KEPT)
        self.line_count = 0
        self._pilot = pilot
        self._pages: set[str] = set()
        self._loop = asyncio.get_running_loop()
        self._task: asyncio.Task[None] | None = None
        self._going_on: asyncio.Task[None] | None = None
        self._gate: Gate | None = None
        self._context: RunContext | None = None
        self._ended = 0.0
        pilot.helm.on_hand = self._on_hand

    @property
    def is_active(self) -> bool:
        """Whether a behaviour runs or pauses."""
        return self.act in (Act.RUNNING, Act.PAUSED)

    @property
    def time(self) -> float:
        """How long it has been going on, or went on, s."""
        return 0.0 if self._context is None else self._ended if not self.is_active else self._context.time

    @property
    def is_watched(self) -> bool:
        """Whether a page looks on."""
        return bool(self._pages)

    # -- what a page does --

    def start(self, name: str, options: Mapping[str, object] | None = None) -> None:
        """Let the robot behave.

        Args:
            name: Of the behaviour.
            options: Its options by name.

        Raises:
            ArgumentError: There is no such behaviour or option, it cannot run here, or something else drives.
            LinkClosed: The robot is not connected.
        """
        what = find(_checked(name))
        if what.style in ELSEWHERE:
            raise ArgumentError(
                f"{what.name} cannot run in the panel: {ELSEWHERE[what.style]}", hint=f"elib run {what.name}"
            )
        chosen = what.check({} if options is None else dict(options))
        if self.is_active or self._task is not None:
            raise ArgumentError(f"{self.name} is still {self.act.value}", hint="stop it first")
        if self._pilot.helm.has_hand:
            raise ArgumentError(f"{what.name} was not started: somebody drives by hand", hint="let go of the stick")
        robot = self._pilot.robot
        self._pilot.helm.relieve()
        gate = self._gate = Gate(robot.session, self._pilot.helm)
        context = self._context = RunContext(self._loop.time)
        self.name, self.state, self.error, self.reason = what.name, "", "", ""
        self.act = Act.RUNNING
        self.lines.clear()
        self.line_count = 0
        self._pilot.note(f"{what.name} begins", kind="state")
        self._task = self._loop.create_task(
            self._run(what, Puppet(robot, gate), gate, context, chosen), name=f"elib behaviour {what.name}"
        )

    def pause(self, reason: str = "paused") -> None:
        """Let the robot stand, and the behaviour wait until :meth:`resume`. Safe to repeat."""
        if self._going_on is not None:
            self._going_on.cancel()
        if self.act is Act.RUNNING and self._gate is not None:
            self._gate.shut()
            self.act, self.reason = Act.PAUSED, reason
            self._pilot.helm.still()
            self._pilot.note(f"{self.name}: {reason}", kind="state")

    def resume(self) -> None:
        """Let the behaviour go on: its wheels turn again as they did, as soon as the stop before is confirmed.

        Raises:
            ArgumentError: Somebody drives by hand.
        """
        if self.act is not Act.PAUSED or self._gate is None or self._going_on is not None:
            return
        if self._pilot.helm.has_hand:
            raise ArgumentError(f"{self.name} cannot go on: somebody drives by hand", hint="let go of the stick")
        self._pilot.helm.relieve()
        self._going_on = self._loop.create_task(self._go_on(self._gate), name="elib behaviour goes on")

    def halt(self, reason: str = "stopped") -> None:
        """End the behaviour without waiting for it: nothing of it reaches the robot any more, which is stopped."""
        if not self.is_active or self._gate is None or self._context is None:
            return
        self._ended = self._context.time
        self.act, self.reason = Act.STOPPED, ""
        self._gate.end()
        self._context.finish("stopped")
        self._pilot.helm.still()
        self._pilot.note(f"{self.name}: {reason}", kind="state")

    async def stop(self) -> None:
        """End the behaviour, and wait for its end for at most 10 s. Safe to repeat."""
        self.halt()
        task = self._task
        if task is not None:
            await asyncio.wait([task], timeout=ENDING_TIME)

    def join(self, page: str) -> None:
        """Note that a page looks on."""
        self._pages.add(page)

    def leave(self, page: str) -> None:
        """Note that a page is gone; with the last one the behaviour ends."""
        self._pages.discard(page)
        if not self._pages:
            self.halt("stopped, for nobody looks on any more")

    # -- how --

    def _on_hand(self, what: str) -> None:
        if what == "stop":
            self.halt()
        else:
            self.pause("pauses, for somebody drives by hand")

    async def _run(
        self, what: Behaviour, robot: Puppet, gate: Gate, context: RunContext, options: Mapping[str, object]
    ) -> None:
        context.listeners.append(lambda event: self._loop.call_soon_threadsafe(self._heard, event))
        failure: BaseException | None = None
        try:
            await self._pilot.helm.settle()
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
            gate.end()
            if self._going_on is not None:
                self._going_on.cancel()
            with contextlib.suppress(ElibError):
                await robot.close()
            self._task = None
        self._finish(context, failure)

    def _finish(self, context: RunContext, failure: BaseException | None) -> None:
        if self.act is Act.STOPPED:  # what went wrong with its end is the helm's business
            self._pilot.helm.on_change()
            return
        self._ended = context.time
        self.reason = ""
        self.act = Act.ENDED if failure is None else Act.FAILED
        if failure is None:
            self._pilot.note(f"{self.name} came to its end", kind="state")
            return
        self.error = str(failure) if isinstance(failure, ElibError) else f"{type(failure).__name__}: {failure}"
        self._pilot.note(f"{self.name} failed: {self.error.partition(chr(10))[0]}", kind="state", is_bad=True)
        if self._pilot.helm.may_move:
            self._pilot.helm.still()

    async def _in_thread(
        self, what: Behaviour, robot: Puppet, context: RunContext, options: Mapping[str, object]
    ) -> None:
        """Perform a behaviour in the blocking style, in a thread of its own."""
        bridge = Bridge(self._loop)
        bridge.before_close = robot.close
        done: asyncio.Future[RunResult] = self._loop.create_future()
        hold = bridge.hold()

        def work() -> None:
            try:
                outcome = run_behaviour_blocking(what, BlockingEpuck(robot, bridge), options=options, run=context)
            except BaseException as error:
                self._deliver(done, partial(done.set_exception, error))
            else:
                self._deliver(done, partial(done.set_result, outcome))

        threading.Thread(target=lambda: bridge.run(work, hold), name=f"elib behaviour {what.name}", daemon=True).start()
        try:
            await done
        finally:
            bridge.close()

    def _deliver(self, done: asyncio.Future[RunResult], put: Callable[[], None]) -> None:
        def deliver() -> None:
            if not done.done():
                put()

        with contextlib.suppress(RuntimeError):  # the panel has closed meanwhile
            self._loop.call_soon_threadsafe(deliver)

    async def _go_on(self, gate: Gate) -> None:
        try:
            await self._pilot.helm.settle()
            await gate.reopen()
        except ElibError as error:
            self._pilot.helm.still()
            self._pilot.note(f"{self.name} cannot go on: {error.message}", kind="state", is_bad=True)
        else:
            if self.act is Act.PAUSED:
                self.act, self.reason = Act.RUNNING, ""
                self._pilot.note(f"{self.name} goes on", kind="state")
        finally:
            self._going_on = None

    def _heard(self, event: StateChanged | RunMessage) -> None:
        if isinstance(event, StateChanged):
            self.state = event.state
            self._pilot.note(f"{self.name}: {event.state}", kind="state")
        else:
            self.lines.append((event.time, event.text))
            self.line_count += 1
            self._pilot.note(event.text)


def performance(performer: Performer, seen: int = 0) -> dict[str, Json]:
    """Return how it stands, for the page: as JSON.

    ``{"name", "act": "idle", "running", "paused", "ended", "stopped" or "failed", "act_text", "state", "reason",
    "error", "time": s, "count": lines that there ever were, "lines": [[s, "text"], ...]}``

    Args:
        performer: Whose.
        seen: Lines that the page has; only later ones come.
    """
    new = min(len(performer.lines), max(0, performer.line_count - seen) if seen <= performer.line_count else KEPT)
    lines: list[Json] = [[round(time, 3), text] for time, text in list(performer.lines)[len(performer.lines) - new :]]
    return {
        "name": performer.name,
        "act": performer.act.name.lower(),
        "act_text": performer.act.value,
        "state": performer.state,
        "reason": performer.reason,
        "error": performer.error,
        "time": round(performer.time, 3),
        "count": performer.line_count,
        "lines": lines,
    }


def catalogue() -> list[dict[str, Json]]:
    """Return all behaviours, for the page to choose from: as JSON.

    ``[{"name", "summary", "doc", "world": where it is at home, "elsewhere": why it cannot run here; else empty,
    "options": [{"name", "unit", "low", "high", "default", "whole": only whole numbers, "rule"}]}]``
    """
    return [
        {
            "name": each.name,
            "summary": each.summary,
            "doc": each.doc,
            "world": each.world,
            "elsewhere": ELSEWHERE.get(each.style, ""),
            "options": [
                {
                    "name": option.name,
                    "unit": option.quantity.unit,
                    "low": option.quantity.low,
                    "high": option.quantity.high,
                    "default": option.default if isinstance(option.default, int | float | str) else None,
                    "whole": not option.quantity.scale,
                    "rule": option.quantity.rule,
                }
                for option in each.options
            ],
        }
        for each in behaviours().values()
    ]


def source_of(name: str) -> str:
    """Return the text of the file that a behaviour is written in.

    Raises:
        ArgumentError: There is no such behaviour, or its file is not at hand.
    """
    what = find(_checked(name))
    try:
        return inspect.getsource(sys.modules[what.function.__module__])
    except (OSError, TypeError):
        raise ArgumentError(f"the source of {what.name} is not installed") from None


def _checked(name: object) -> str:
    """Return the name of a behaviour as a page sent it.

    Raises:
        ArgumentError: It is no text, or a long one.
    """
    if not isinstance(name, str) or len(name) > LONGEST_NAME:
        raise ArgumentError("a behaviour is named by a short text")
    return name


__all__ = ["Act", "Performer", "catalogue", "performance", "source_of"]
