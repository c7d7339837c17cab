"""Drive so many centimetres, whatever happens to the link: failures are told by callbacks.

Each call has two functions, one for its answer and one for its failure, and exactly one of them is called, once. They
pass the behaviour on: from looking at the step counters to setting the wheels and back, until the robot stands where it
should. A robot whose link was gone has driven on; it is driven back.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Any

from elib.behaviours import Quantity, RunContext, behaviour
from elib.body import METRES_PER_STEP, STEPS_PER_REVOLUTION
from elib.errors import ElibError
from elib.protocol.values import Steps
from elib.robot.blocking import BlockingEpuck
from elib.robot.motion import FIRST_TRIP, PERIOD, pace

Centimetres = Annotated[float, Quantity("cm", "cm", -500, 500, scale=100)]
WheelSpeed = Annotated[float, Quantity("speed", "rev/s", 0.05, 1.0, scale=1000)]

POLL = 0.05
"""s between two looks of the main program at whether it is over."""
PATIENCE = 1.0
"""s that each call may take: ten times what it takes over Bluetooth."""
STUCK = 3.0
"""s without a step after which the wheels are told their speeds again."""
SMOOTHING = 0.3
"""Share of a new round trip in their running mean."""


@dataclass(slots=True)
class Journey:
    """What all callbacks share.

    Attributes:
        robot: The robot.
        run: Where it performs.
        goals: Where each wheel shall stand, steps by the robot's odometry, which outlives gaps and resets.
        cruise: The fastest, steps/s.
        direction: 1 for forwards, -1 for backwards.
        wheels: What they were last told and have confirmed, steps/s; None while that is unknown.
        trip: What a round trip takes, s.
        left_to_go: Steps that were left when the counters were last read.
        moved: When they last changed, s.
        failures: Calls that failed.
        is_over: Set when the robot stands at its goal, or can go no further.
        error: Why it can go no further.
        lock: Held by the callback that is at work.
    """

    robot: BlockingEpuck
    run: RunContext
    goals: tuple[int, int]
    cruise: float
    direction: int = 1
    wheels: tuple[int, int] | None = None
    trip: float = FIRST_TRIP
    left_to_go: tuple[int, int] = (0, 0)
    moved: float = 0.0
    failures: int = 0
    is_over: threading.Event = field(default_factory=threading.Event)
    error: Exception | None = None
    lock: threading.RLock = field(default_factory=threading.RLock)

    def end(self) -> None:
        """Let no callback go on."""
        with self.lock:
            self.is_over.set()

    def then(self, step: Callable[[Any, Any], None]) -> Callable[[Any, Any], None]:
        """Return *step* as a callback: it does nothing when all is over, and what goes wrong in it ends the journey."""

        def callback(value: Any, state: Any) -> None:
            with self.lock:
                if self.is_over.is_set() or self.run.is_over:
                    self.is_over.set()
                    return
                try:
                    step(value, state)
                except Exception as error:  # raised in the main program, which waits
                    self.error = error
                    self.is_over.set()

        return callback

    def look(self) -> None:
        """Look at the step counters, after a pause in which a quick link may carry something else."""
        self.robot.callback(on_reply=self.then(self.ask), on_error=self.then(self.fail)).sleep(PERIOD)

    def ask(self, _: None, __: None) -> None:
        """Ask for the step counters; the callback of a pause."""
        asking = self.robot.callback(self.then(self.drive), self.then(self.fail), state=self.robot.time)
        asking.within(PATIENCE).encoders()

    def drive(self, _: Steps, asked: float) -> None:
        """Set the wheels by what is left to go; the callback of :meth:`ask`."""
        self.trip += SMOOTHING * (self.robot.time - asked - self.trip)
        made = self.robot.robot.motion.odometry  # it has seen this reading
        ways = self.goals[0] - made.left, self.goals[1] - made.right
        if ways != self.left_to_go:
            self.left_to_go, self.moved = ways, self.robot.time
        elif self.robot.time - self.moved > STUCK:  # it may have restarted without a word
            self.wheels, self.moved = None, self.robot.time
        now = self.wheels or (0, 0)
        wanted = pace(ways[0], now[0], self.cruise, self.trip), pace(ways[1], now[1], self.cruise, self.trip)
        if ways == (0, 0) and self.wheels == (0, 0):
            self.run.state("arrived")
            self.is_over.set()
            return
        ahead = [self.direction * way for way in ways]
        self.run.state("returning" if min(ahead) < 0 else "driving" if max(ahead) > 0 else "braking")
        if wanted == self.wheels:
            self.look()
        else:
            self.wheels = None
            left, right = (speed / STEPS_PER_REVOLUTION for speed in wanted)
            setting = self.robot.callback(self.then(self.driven), self.then(self.fail), state=wanted)
            setting.within(PATIENCE).set_speed(left, right)

    def driven(self, _: None, wheels: tuple[int, int]) -> None:
        """Look again; the callback of a speed that is set."""
        self.wheels = wheels
        self.look()

    def fail(self, error: ElibError, _: object) -> None:
        """Try again from the start: nobody knows what the robot did; the callback of every failure."""
        self.failures += 1
        self.wheels = None
        if self.robot.robot.session.error is not None:  # closed, or given up for good
            raise error
        self.run.state("lost")
        self.look()


@behaviour(world="arena", reconnects=True)
def go_x_cm(robot: BlockingEpuck, run: RunContext, *, cm: Centimetres = 20, speed: WheelSpeed = 0.2) -> None:
    """Drive some centimetres straight on, over a link that may break at any moment.

    Args:
        robot: The robot to drive.
        run: Where it performs.
        cm: How far; negative is backwards.
        speed: The fastest.
    """
    robot.pose()
    odometry = robot.robot.motion.odometry
    before, way = odometry.left, round(cm / 100 / METRES_PER_STEP)
    goals = before + way, odometry.right + way
    journey = Journey(robot, run, goals, speed * STEPS_PER_REVOLUTION, 1 if way >= 0 else -1)
    journey.look()
    while not journey.is_over.is_set() and not run.is_over:
        robot.sleep(POLL)
    journey.end()
    if journey.error is not None:
        raise journey.error
    made = 100 * (odometry.left - before) * METRES_PER_STEP
    run.say(f"{made:.2f} cm driven, {journey.failures} calls failed on the way")
