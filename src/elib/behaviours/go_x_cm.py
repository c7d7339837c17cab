"""Drive some centimetres, whatever happens to the link, in the callback style.

Each call has two callbacks, one for its answer and one for its failure, and exactly one of them is called, once. Each
callback makes the next call: it reads the step counters, sets the wheels, reads the counters again, until the robot
stands where it should. If the link was lost meanwhile, the robot has driven too far, and is driven back.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Any

from elib.base.body import METRES_PER_STEP, STEPS_PER_REVOLUTION
from elib.base.errors import ElibError
from elib.behaviours import Quantity, RunContext, behaviour
from elib.link.protocol.values import Steps
from elib.robot.blocking import BlockingEpuck
from elib.robot.motion import FIRST_TRIP, PERIOD, pace

Centimetres = Annotated[float, Quantity("cm", "cm", -500, 500, scale=100)]
WheelSpeed = Annotated[float, Quantity("speed", "rev/s", 0.05, 1.0, scale=1000)]

POLL_INTERVAL = 0.05
"""s between two checks of the main program whether the drive is over."""
TIMEOUT = 1.0
"""s that each call may take: ten times what it takes over Bluetooth."""
STUCK = 3.0
"""s without a step after which the speeds are sent again."""
SMOOTHING = 0.3
"""Weight of a new round trip in the running mean."""


@dataclass(slots=True)
class Drive:
    """The state that all callbacks share.

    Attributes:
        robot: The robot.
        run: The run.
        goals: Where each wheel is to stop, in steps of the robot's odometry, which survives gaps and resets.
        cruise: Largest speed, steps/s.
        direction: 1 for forwards, -1 for backwards.
        wheels: The last speeds that the robot confirmed, steps/s; None while they are unknown.
        trip: Time of a round trip, s.
        left_to_go: Steps that were left when the counters were last read.
        moved: When the counters last changed, s.
        failures: Calls that failed.
        is_over: Set when the robot stands at its goal, or cannot drive on.
        error: Why the robot cannot drive on.
        lock: Held by the callback that is running.
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
        """Make all later callbacks do nothing."""
        with self.lock:
            self.is_over.set()

    def then(self, step: Callable[[Any, Any], None]) -> Callable[[Any, Any], None]:
        """Return *step* as a callback: it does nothing after the end, and an error in it ends the drive."""

        def callback(value: Any, state: Any) -> None:
            with self.lock:
                if self.is_over.is_set() or self.run.is_over:
                    self.is_over.set()
                    return
                try:
                    step(value, state)
                except Exception as error:  # the main program raises it
                    self.error = error
                    self.is_over.set()

        return callback

    def read_counters(self) -> None:
        """Read the step counters after a pause, which leaves a quick link free for other requests."""
        self.robot.callback(on_reply=self.then(self.ask), on_error=self.then(self.fail)).sleep(PERIOD)

    def ask(self, _: None, __: None) -> None:
        """Ask for the step counters. The callback of the pause."""
        asking = self.robot.callback(self.then(self.steer), self.then(self.fail), state=self.robot.time)
        asking.within(TIMEOUT).encoders()

    def steer(self, _: Steps, asked: float) -> None:
        """Set the wheels by the steps that are left. The callback of :meth:`ask`."""
        self.trip += SMOOTHING * (self.robot.time - asked - self.trip)
        made = self.robot.robot.motion.odometry  # it includes this reading already
        ways = self.goals[0] - made.left, self.goals[1] - made.right
        if ways != self.left_to_go:
            self.left_to_go, self.moved = ways, self.robot.time
        elif self.robot.time - self.moved > STUCK:  # the robot may have restarted unnoticed
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
            self.read_counters()
        else:
            self.wheels = None
            left, right = (speed / STEPS_PER_REVOLUTION for speed in wanted)
            setting = self.robot.callback(self.then(self.steered), self.then(self.fail), state=wanted)
            setting.within(TIMEOUT).set_speed(left, right)

    def steered(self, _: None, wheels: tuple[int, int]) -> None:
        """Read the counters again. The callback of a speed that was set."""
        self.wheels = wheels
        self.read_counters()

    def fail(self, error: ElibError, _: object) -> None:
        """Read the counters again: whether the robot did the command is unknown. The callback of every failure."""
        self.failures += 1
        self.wheels = None
        if self.robot.robot.session.error is not None:  # closed, or lost for good
            raise error
        self.run.state("lost")
        self.read_counters()


@behaviour(world="arena", reconnects=True, group="samples of 2011")
def go_x_cm(robot: BlockingEpuck, run: RunContext, *, cm: Centimetres = 20, speed: WheelSpeed = 0.2) -> None:
    """Drive some centimetres straight on, over a link that may break at any moment.

    Args:
        robot: The robot to drive.
        run: The run.
        cm: Distance; negative is backwards.
        speed: Largest speed.
    """
    robot.pose()
    odometry = robot.robot.motion.odometry
    before, way = odometry.left, round(cm / 100 / METRES_PER_STEP)
    goals = before + way, odometry.right + way
    drive = Drive(robot, run, goals, speed * STEPS_PER_REVOLUTION, 1 if way >= 0 else -1)
    drive.read_counters()
    while not drive.is_over.is_set() and not run.is_over:
        robot.sleep(POLL_INTERVAL)
    drive.end()
    if drive.error is not None:
        raise drive.error
    made = 100 * (odometry.left - before) * METRES_PER_STEP
    run.say(f"{made:.2f} cm driven, {drive.failures} calls failed on the way")
