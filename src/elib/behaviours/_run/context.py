"""What a behaviour has beside its robot: names for its states, a word to the person, chance, and the end."""

from __future__ import annotations

import contextlib
import random
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from elib.robot.blocking import PendingCall
from elib.robot.events import RobotEvent

T = TypeVar("T")

LOOK_UP = 0.25
"""s of robot time between two looks at whether it is over, while a call is waited for."""
SEED = 0
"""Of a behaviour's chance, unless a run sets another: the same program then takes the same path."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StateChanged(RobotEvent):
    """A behaviour entered another state.

    Attributes:
        state: Its name, like ``searching``.
    """

    state: str


@dataclass(frozen=True, slots=True, kw_only=True)
class RunMessage(RobotEvent):
    """A behaviour told the person something.

    Attributes:
        text: A line.
    """

    text: str


class RunContext:
    """One performance of a behaviour. Any thread may use it.

    Args:
        clock: Returns the robot's time, s.
        seconds: Robot time after which the performance is over; None for as long as it likes.
        seed: Of :attr:`random`.

    Attributes:
        began: When it began, s on the robot's clock.
        random: The behaviour's chance: the same seed gives the same run.
        reason: Why it ended: ``time``, ``enter`` or another word given to :meth:`finish`; empty before.
        listeners: Called with every StateChanged and RunMessage as they happen, in the thread where they happen.
    """

    def __init__(self, clock: Callable[[], float], *, seconds: float | None = None, seed: int = SEED) -> None:
        self.random = random.Random(seed)
        self.reason = ""
        self.listeners: list[Callable[[StateChanged | RunMessage], object]] = []
        self._clock = clock
        self.began = clock()
        self._end = None if seconds is None else self.began + seconds
        self._happened: list[StateChanged | RunMessage] = []
        self._lock = threading.Lock()
        self._current = ""
        self._on_end: Callable[[], object] | None = None

    @property
    def time(self) -> float:
        """Robot time since it began, s."""
        return self._clock() - self.began

    @property
    def left(self) -> float | None:
        """Robot time it still has, s, never below 0; None without a limit."""
        return None if self._end is None else max(0.0, self._end - self._clock())

    @property
    def current(self) -> str:
        """The state it is in; empty before the first."""
        return self._current

    @property
    def states(self) -> tuple[tuple[float, str], ...]:
        """When each state was entered, s since it began, and its name, in order."""
        return tuple((event.time, event.state) for event in self._happened if isinstance(event, StateChanged))

    @property
    def lines(self) -> tuple[str, ...]:
        """What was said, in order."""
        return tuple(event.text for event in self._happened if isinstance(event, RunMessage))

    @property
    def is_over(self) -> bool:
        """Whether it is time to end: a behaviour that is not cancelled looks at it at least every two seconds."""
        if not self.reason and self._end is not None and self._clock() >= self._end:
            self.finish("time")
        return bool(self.reason)

    def state(self, name: str) -> None:
        """Enter the state called *name*, like ``searching``; where it is in it already, nothing happens."""
        with self._lock:
            if name == self._current:
                return
            self._current = name
            event = StateChanged(time=self.time, state=name)
            self._happened.append(event)
        self._tell(event)

    def say(self, text: str) -> None:
        """Tell the person a line."""
        event = RunMessage(time=self.time, text=text)
        self._happened.append(event)
        self._tell(event)

    def end(self, pending: PendingCall[T]) -> T | None:
        """Wait for the outcome of a call that was begun, in the blocking style.

        Returns:
            The value; None where the performance was over before, and the call was cancelled.
        """
        while not self.is_over:
            with contextlib.suppress(TimeoutError):
                if pending.done():
                    break
                return pending.result(timeout=LOOK_UP)
        if pending.done():
            return pending.end()
        pending.cancel()
        return None

    def finish(self, reason: str) -> None:
        """Let the performance end, for *reason*; the first one counts."""
        with self._lock:
            if self.reason:
                return
            self.reason = reason
            on_end = self._on_end
        if on_end is not None:
            on_end()

    def on_finish(self, function: Callable[[], object]) -> None:
        """Call *function* when it is to end, in the thread that says so; at once if that was already."""
        with self._lock:
            self._on_end = function
            is_late = bool(self.reason)
        if is_late:
            function()

    def _tell(self, event: StateChanged | RunMessage) -> None:
        for listener in tuple(self.listeners):
            listener(event)
