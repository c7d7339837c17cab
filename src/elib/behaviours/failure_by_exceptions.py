"""Two states that tell success from failure by exceptions: the begin style."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from elib.behaviours import RunContext, behaviour
from elib.errors import RemoteProtocolError, ReplyTimeout
from elib.robot.blocking import BlockingEpuck, PendingCall

HOPELESS, SHORT = 0.001, 0.01
"""s in which no picture comes, so that there is a failure to show (elib-2011, 6.9)."""
ENOUGH = 1.5
"""s in which one does, 0.3 s over a good link: the state after a repair meets a success for once."""
STOPPING = 1.5
"""s for a stop: after a failure the line is brought into sync first, so it takes two round trips, and links with 0.2 s
of latency each way and more are about."""
FAILURES = (ReplyTimeout, RemoteProtocolError)
"""What is repaired: an answer that did not come, or that made no sense, as when the robot restarted meanwhile."""
WORK = 0.02
"""s of pretended work while the answer is on its way."""

Next: TypeAlias = "tuple[State, PendingCall[object]]"
State: TypeAlias = "Callable[[BlockingEpuck, RunContext, PendingCall[object]], Next]"
"""Takes the call that was begun for it; returns the state that follows, and the call begun for that."""


def okf(robot: BlockingEpuck, run: RunContext, picture: PendingCall[object]) -> Next:
    """Go on after *picture*, if it came: turn on the spot, and ask for the next one, with too little time."""
    run.state("okf")
    try:
        picture.end()
        wheels = robot.begin.set_speed(-1.0, 1.0)
        robot.sleep(WORK)  # the answer comes meanwhile
        wheels.end()
    except FAILURES as error:
        run.say(error.message)
        return kof, robot.begin.within(STOPPING).stop()
    return okf, robot.begin.within(SHORT).image()


def kof(robot: BlockingEpuck, run: RunContext, stop: PendingCall[object]) -> Next:
    """Repair: wait for the *stop* that the failure began, stop once more, and ask for a picture with enough time.

    A stop that is not confirmed is a failure like any other and leads here again: nothing ends in silence.
    """
    run.state("kof")
    try:
        stop.end()
        if run.is_over:
            return kof, stop
        robot.begin.within(STOPPING).stop().end()
    except FAILURES as error:
        run.say(error.message)
        return kof, robot.begin.within(STOPPING).stop()
    run.say("repaired")
    return okf, robot.begin.within(ENOUGH).image()


@behaviour
def alternate(robot: BlockingEpuck, run: RunContext) -> None:
    """Fail on purpose and repair it, again and again: callbacks for failure, written as exceptions.

    Two states follow each other: okf when a call ended well, kof when it did not. Each gets a call that was begun by
    the one before, and learns how it ended by waiting for it: a value or an exception.
    """
    state: State = okf
    call: PendingCall[object] = robot.begin.within(HOPELESS).image()
    while not run.is_over:
        state, call = state(robot, run, call)
