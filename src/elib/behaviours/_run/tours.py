"""One command after the other in the callback style, each told with its outcome: what both tours share."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated

from elib.behaviours._run.context import RunContext
from elib.errors import ElibError, LinkError, Unsupported
from elib.protocol.commands import SPECS
from elib.protocol.image import Image
from elib.protocol.quantities import Quantity
from elib.protocol.values import Numbers, Selector, Version
from elib.robot.blocking import BlockingEpuck, CallbackEpuck
from elib.session import GRACE, LONGEST_SILENCE_WAIT

Patience = Annotated[float, Quantity("timeout", "s", 0.0, 60.0, scale=1)]

TIMEOUT = 1.0
"""s that each answer may take, unless the command itself is slower."""
SLOW = 1.0
"""s. A command whose own time is longer keeps it: no robot restarts in a second (protocol.md, 5.13)."""
LOOK = 0.005
"""s between two looks whether the answer has come (elib-2011, 6.2)."""
NAP = 0.5
"""s of a pause after which the tour looks whether it is over."""


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a tour.

    Attributes:
        command: Name of the command's row.
        call: Calls it, on the style it is given.
        pause: s to wait after it.
    """

    command: str
    call: Callable[[CallbackEpuck[object]], None]
    pause: float = 0.0


def patience_for(command: str, timeout: float) -> float:
    """Return how long the answer to *command* may take, s: *timeout*, or its own time where the robot is slow."""
    own = SPECS[command].timeout
    return max(timeout, own) if own > SLOW else timeout


def shown(value: object) -> str:
    """Return an answer as a few words; empty where it says only that it was done."""
    match value:
        case None:
            return ""
        case str():
            return f"{len(value.splitlines())} lines"
        case Image():
            return f"{value.width} x {value.height} pixels, {value.mode.name.lower()}"
        case Version():
            return " ".join(value.text.split())
        case Selector():
            return str(value.position)
        case Numbers():
            return ", ".join(f"{number:g}" for number in value)
    return str(value)


def line(time: float, outcome: str, command: str, words: str) -> str:
    """Return what is said about one answer: when it came, OK or KO, whose it is and what it says."""
    return f"{time:8.3f} s  {outcome}  {command}{': ' if words else ''}{words}"


class Answer:
    """The two callbacks of one call, and what became of it. They run in other threads than the tour.

    Attributes:
        time: When it came, s since the performance began.
        error: Why there is none, or None.
    """

    def __init__(self, run: RunContext) -> None:
        self.time = math.nan
        self.error: ElibError | None = None
        self._run = run
        self._has_come = threading.Event()

    def on_reply(self, value: object, command: str) -> None:
        """Tell the answer to *command*, the state that was handed through."""
        self._tell("OK", command, shown(value))

    def on_error(self, error: ElibError, command: str) -> None:
        """Tell why *command* has none, and keep the error for who waits: raised in here nobody would see it."""
        self.error = error
        self._tell("KO", command, error.message)

    def wait(self, robot: BlockingEpuck, seconds: float) -> bool:
        """Wait until one of them was called, at most *seconds* of the robot's time, and return whether one was."""
        # Waiting by the robot's own sleep: simulated time would stand still while this thread slept elsewhere.
        for _ in range(math.ceil(seconds / LOOK)):
            if self._has_come.is_set():
                break
            robot.sleep(LOOK)
        return self._has_come.is_set()

    def _tell(self, outcome: str, command: str, words: str) -> None:
        self.time = self._run.time
        try:
            self._run.say(line(self.time, outcome, command, words))
        finally:
            self._has_come.set()


def ask(robot: BlockingEpuck, run: RunContext, step: Step, patience: float) -> Answer | None:
    """Call a step's command and return at once; its outcome is told when it comes.

    Args:
        robot: The robot.
        run: Where it is told.
        step: What to call.
        patience: s that the answer may take.

    Returns:
        What will have the outcome; None where this firmware has no such command.
    """
    answer = Answer(run)
    style: CallbackEpuck[object] = robot.callback(answer.on_reply, answer.on_error, step.command)
    try:
        step.call(style.within(patience))
    except Unsupported as error:
        run.say(line(run.time, "--", step.command, error.message))
        return None
    return answer


def take(robot: BlockingEpuck, run: RunContext, steps: Iterable[Step], timeout: float) -> None:
    """Call one command after the other, each when the one before has ended, and tell every outcome.

    A lost answer is told and the tour goes on.

    Args:
        robot: The robot.
        run: Where it is told.
        steps: What to call.
        timeout: s that each answer may take; slow commands keep their own time.

    Raises:
        LinkError: The link is gone.
    """
    for step in steps:
        if run.is_over:
            return
        run.state(step.command.replace("_", "-"))
        patience = patience_for(step.command, timeout)
        answer = ask(robot, run, step, patience)
        if answer is None:
            continue
        if not answer.wait(robot, patience + GRACE + LONGEST_SILENCE_WAIT):
            raise forgotten(step.command)
        if isinstance(answer.error, LinkError):
            raise answer.error
        pause(robot, run, step.pause)


def pause(robot: BlockingEpuck, run: RunContext, seconds: float) -> None:
    """Wait *seconds* of the robot's time, or until the performance is over."""
    end = robot.time + seconds
    while (left := end - robot.time) > 0 and not run.is_over:
        robot.sleep(min(left, NAP))


def forgotten(command: str) -> ElibError:
    """Return the error of a call none of whose callbacks was called: one always is, so nobody should ever see it."""
    return ElibError(f"{command} had neither an answer nor an error", hint="this is a defect of elib; please report it")


__all__ = [
    "TIMEOUT",
    "Answer",
    "Patience",
    "Step",
    "ask",
    "forgotten",
    "line",
    "patience_for",
    "pause",
    "shown",
    "take",
]
