"""Run a list of commands in the callback style, one after another, and tell the outcome of each."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated

from elib.base.errors import ElibError, LinkError, Unsupported
from elib.behaviours._run.context import RunContext
from elib.link.protocol.commands import SPECS
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import Quantity
from elib.link.protocol.values import Numbers, Selector, Version
from elib.link.session import GRACE, MAX_SILENCE_WAIT
from elib.robot.blocking import BlockingEpuck, CallbackEpuck

Timeout = Annotated[float, Quantity("timeout", "s", 0.0, 60.0, scale=1)]

TIMEOUT = 1.0
"""s for each answer, unless the command itself is slower."""
SLOW = 1.0
"""s. A command with a longer timeout of its own keeps it: no robot restarts in a second (wire-protocol.md, 5.13)."""
POLL_INTERVAL = 0.005
"""s between two checks whether the answer has come (as in Elib of 2011)."""
PAUSE_STEP = 0.5
"""s of a pause after which the tour checks whether it is over."""


@dataclass(frozen=True, slots=True)
class TourStep:
    """One step of a tour."""

    command: str  # name of the command's row
    call: Callable[[CallbackEpuck[object]], None]  # function that calls the command on a robot in the callback style
    pause: float = 0.0  # s to wait after it


def timeout_for(command: str, timeout: float) -> float:
    """Return how long the answer to *command* may take, s: *timeout*, or longer if the command is slow."""
    own = SPECS[command].timeout
    return max(timeout, own) if own > SLOW else timeout


def summarize(value: object) -> str:
    """Return an answer as a few words; empty if it says only that the command was done."""
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
    """Return the message about one outcome: its time, OK or KO, the command, and the answer or error."""
    return f"{time:8.3f} s  {outcome}  {command}{': ' if words else ''}{words}"


class StepOutcome:
    """The two callbacks of one call, and its outcome. The callbacks run in other threads than the tour."""

    def __init__(self, run: RunContext) -> None:
        self.time = math.nan
        self.error: ElibError | None = None  # why there is no answer, or None
        self._run = run
        self._has_come = threading.Event()

    def on_reply(self, value: object, command: str) -> None:
        """Tell the answer to *command*; its name is the state that was passed to the call."""
        self._tell("OK", command, summarize(value))

    def on_error(self, error: ElibError, command: str) -> None:
        """Tell why *command* has no answer, and keep the error for the tour: raised here, it would be lost."""
        self.error = error
        self._tell("KO", command, error.message)

    def wait(self, robot: BlockingEpuck, seconds: float) -> bool:
        """Wait until a callback was called, at most *seconds* of the robot's time, and return whether one was."""
        # The robot's own sleep must be used: simulated time would stand still while this thread waits elsewhere.
        for _ in range(math.ceil(seconds / POLL_INTERVAL)):
            if self._has_come.is_set():
                break
            robot.sleep(POLL_INTERVAL)
        return self._has_come.is_set()

    def _tell(self, outcome: str, command: str, words: str) -> None:
        self.time = self._run.time
        try:
            self._run.say(line(self.time, outcome, command, words))
        finally:
            self._has_come.set()


def begin_step(robot: BlockingEpuck, run: RunContext, step: TourStep, timeout: float) -> StepOutcome | None:
    """Call a step's command and return at once; its outcome is told when it comes.

    Args:
        robot: The robot.
        run: The run.
        step: The step.
        timeout: s that the answer may take.

    Returns:
        What will get the outcome; None if this firmware does not have the command.
    """
    outcome = StepOutcome(run)
    callbacks: CallbackEpuck[object] = robot.callback(outcome.on_reply, outcome.on_error, step.command)
    try:
        step.call(callbacks.within(timeout))
    except Unsupported as error:
        run.say(line(run.time, "--", step.command, error.message))
        return None
    return outcome


def run_steps(robot: BlockingEpuck, run: RunContext, steps: Iterable[TourStep], timeout: float) -> None:
    """Call one command after another, each when the one before has ended, and tell every outcome.

    The tour goes on after a lost answer.

    Args:
        robot: The robot.
        run: The run.
        steps: The steps.
        timeout: s that each answer may take; slow commands keep their own timeout.

    Raises:
        LinkError: The link was lost.
    """
    for step in steps:
        if run.is_over:
            return
        run.state(step.command.replace("_", "-"))
        limit = timeout_for(step.command, timeout)
        outcome = begin_step(robot, run, step, limit)
        if outcome is None:
            continue
        if not outcome.wait(robot, limit + GRACE + MAX_SILENCE_WAIT):
            raise no_outcome(step.command)
        if isinstance(outcome.error, LinkError):
            raise outcome.error
        wait(robot, run, step.pause)


def wait(robot: BlockingEpuck, run: RunContext, seconds: float) -> None:
    """Wait *seconds* of the robot's time, or until the run is over."""
    end = robot.time + seconds
    while (left := end - robot.time) > 0 and not run.is_over:
        robot.sleep(min(left, PAUSE_STEP))


def no_outcome(command: str) -> ElibError:
    """Return the error for a call neither of whose callbacks was called. One always is, so this is a defect of elib."""
    return ElibError(f"{command} had neither an answer nor an error", hint="this is a defect of elib; please report it")
