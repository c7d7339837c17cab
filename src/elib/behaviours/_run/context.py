"""The context of a run: names for the states of a behaviour, messages to the user, seeded random, and the end."""

from __future__ import annotations

import contextlib
import random
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from elib.link.protocol.styles import Pending
from elib.link.session import MachineBegan, Noted
from elib.robot.events import RobotEvent

T = TypeVar("T")

POLL_INTERVAL = 0.25
"""s of robot time between two checks whether the run is over, while a call is waited for."""
DEFAULT_SEED = 0
"""Seed of ``run.random`` by default: the same program then does the same."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StateChanged(RobotEvent):
    """A behaviour entered another state.

    Attributes:
        state: Name of the state, like ``searching``.
    """

    state: str

    def traced(self) -> Noted:
        """Return the line that logs and recordings keep of it."""
        return Noted(self.state, "state")


@dataclass(frozen=True, slots=True, kw_only=True)
class MachineStarted(RobotEvent):
    """A machine of states began.

    Attributes:
        program: The text of the program that holds its states.
    """

    program: str

    def traced(self) -> MachineBegan:
        """Return what recordings keep of it."""
        return MachineBegan(self.program)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunMessage(RobotEvent):
    """A behaviour told the user something.

    Attributes:
        text: The message, one line.
    """

    text: str

    def traced(self) -> Noted:
        """Return the line that logs and recordings keep of it."""
        return Noted(self.text)


RunEvent = StateChanged | MachineStarted | RunMessage


class RunContext:
    """The context of one run of a behaviour. Any thread may use it.

    Args:
        clock: Function that returns the robot's time, s.
        seconds: Robot time after which the run is over; None for no limit.
        seed: Seed of :attr:`random`.

    Attributes:
        began: When the run began, s on the robot's clock.
        random: Random numbers; the same seed gives the same run.
        reason: Why the run ended: ``time``, ``enter`` or another word given to :meth:`finish`; empty before.
        listeners: Functions that are called with every StateChanged, MachineStarted and RunMessage, in the thread where
            it happens.
        entered: Whether this is the first step in the state of an ``elib.states`` machine.
        previous_state: The state that the behaviour was in before; empty in the first.
    """

    def __init__(self, clock: Callable[[], float], *, seconds: float | None = None, seed: int = DEFAULT_SEED) -> None:
        self.random = random.Random(seed)
        self.reason = ""
        self.listeners: list[Callable[[RunEvent], object]] = []
        self._clock = clock
        self.began = clock()
        self._end = None if seconds is None else self.began + seconds
        self._events: list[StateChanged | RunMessage] = []
        self._lock = threading.Lock()
        self.entered = False
        self.previous_state = self._current = ""
        self._entered_at = self.began
        self._on_end: Callable[[], object] | None = None

    @property
    def time(self) -> float:
        """Robot time since the run began, s."""
        return self._clock() - self.began

    @property
    def time_left(self) -> float | None:
        """Robot time until the run is over, s, never below 0; None without a limit."""
        return None if self._end is None else max(0.0, self._end - self._clock())

    @property
    def current_state(self) -> str:
        """The state that the behaviour is in; empty before the first."""
        return self._current

    @property
    def time_in_state(self) -> float:
        """Robot time since the state was entered, s."""
        return self._clock() - self._entered_at

    @property
    def states(self) -> tuple[tuple[float, str], ...]:
        """When each state was entered, s since the run began, and its name, in order."""
        return tuple(
            (event.time - self.began, event.state) for event in self._events if isinstance(event, StateChanged)
        )

    @property
    def messages(self) -> tuple[str, ...]:
        """The messages to the user, in order."""
        return tuple(event.text for event in self._events if isinstance(event, RunMessage))

    @property
    def is_over(self) -> bool:
        """Whether the run is to end. A behaviour in the blocking style must check this at least every two seconds."""
        if not self.reason and self._end is not None and self._clock() >= self._end:
            self.finish("time")
        return bool(self.reason)

    def state(self, name: str) -> None:
        """Enter the state *name*, like ``searching``; nothing happens if the behaviour is in it already."""
        if name != self._current:
            self.enter(name)

    def enter(self, name: str) -> None:
        """Enter the state *name*, again if the behaviour is in it already."""
        with self._lock:
            self.previous_state, self._current = self._current, name
            self.entered, self._entered_at = True, self._clock()
            event = StateChanged(time=self._clock(), state=name)
            self._events.append(event)
        self._emit(event)

    def say(self, text: str) -> None:
        """Tell the user a line of text."""
        event = RunMessage(time=self._clock(), text=text)
        self._events.append(event)
        self._emit(event)

    def begin_machine(self, program: str) -> None:
        """Tell logs and recordings of the *program*, its text, whose machine of states begins."""
        self._emit(MachineStarted(time=self._clock(), program=program))

    def wait_for(self, pending: Pending[T]) -> T | None:
        """Wait for the result of a call that was begun, in the blocking style.

        Returns:
            The result; None if the run was over before, and the call was cancelled.
        """
        while not self.is_over:
            with contextlib.suppress(TimeoutError):
                if pending.done():
                    break
                return pending.result(timeout=POLL_INTERVAL)
        if pending.done():
            return pending.end()
        pending.cancel()
        return None

    def finish(self, reason: str) -> None:
        """End the run for this *reason*; only the first reason counts."""
        with self._lock:
            if self.reason:
                return
            self.reason = reason
            on_end = self._on_end
        if on_end is not None:
            on_end()

    def on_finish(self, function: Callable[[], object]) -> None:
        """Call *function* when the run is to end, in the thread that ends it; at once if it has been ended already."""
        with self._lock:
            self._on_end = function
            is_late = bool(self.reason)
        if is_late:
            function()

    def _emit(self, event: RunEvent) -> None:
        for listener in tuple(self.listeners):
            listener(event)
