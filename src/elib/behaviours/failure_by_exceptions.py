"""Two states, for success and for failure, told apart by exceptions, in the begin style."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from elib.base.errors import RemoteProtocolError, ReplyTimeout
from elib.behaviours import RunContext, behaviour
from elib.link.protocol.styles import Pending
from elib.robot.blocking import BlockingEpuck

HOPELESS, SHORT = 0.001, 0.01
"""s within which no picture comes, to cause a failure (as in Elib of 2011)."""
ENOUGH = 1.5
"""s within which a picture comes, 0.3 s over a good link: after a repair there is a success."""
STOPPING = 1.5
"""s for a stop. After a failure there is a resync first, so it takes two round trips, and some links have a latency of
0.2 s each way or more."""
FAILURES = (ReplyTimeout, RemoteProtocolError)
"""Failures that are repaired: a missing answer, or one that could not be understood, as after a restart of the
robot."""
WORK = 0.02
"""s of pretended work while the answer is on its way."""

Next: TypeAlias = "tuple[State, Pending[object]]"
State: TypeAlias = "Callable[[BlockingEpuck, RunContext, Pending[object]], Next]"
"""A state takes the call that was begun for it, and returns the next state and the call begun for that."""


def okf(robot: BlockingEpuck, run: RunContext, picture: Pending[object]) -> Next:
    """If *picture* came, turn on the spot, and ask for the next one with too little time."""
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


def kof(robot: BlockingEpuck, run: RunContext, stop: Pending[object]) -> Next:
    """Repair: wait for the *stop* that the failure began, stop again, and ask for a picture with enough time.

    A stop that is not confirmed is a failure too, and leads to this state again.
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


@behaviour(group="samples of 2011")
def alternate(robot: BlockingEpuck, run: RunContext) -> None:
    """Fail on purpose and repair it, again and again: exceptions instead of callbacks for failures.

    There are two states: okf after a call that succeeded, kof after one that failed. Each gets a call that the state
    before has begun, and waits for it, which returns a value or raises an exception.
    """
    state: State = okf
    call: Pending[object] = robot.begin.within(HOPELESS).image()
    while not run.is_over:
        state, call = state(robot, run, call)
