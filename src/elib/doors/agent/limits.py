"""What an agent may do with a robot: the fence, the speed limit and the budget, and the guard that enforces them."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

from elib.base.body import FASTEST_2, METRES_PER_STEP, STEPS_PER_REVOLUTION, step_rate
from elib.base.errors import ArgumentError, ElibError, MotionInterrupted
from elib.base.pose import Pose
from elib.base.rules import Number, Whole, check
from elib.link.protocol.commands import SPECS
from elib.link.protocol.table import Request
from elib.link.session import Called, Channel, Ended, ForwardingChannel, Hooks, TraceEvent
from elib.robot.motion import FASTEST

T = TypeVar("T")

REACTION = 0.35
"""s from a reading of the step counters until the robot stands: one period of the watch, and the round trips of the
next reading and of the stop over Bluetooth (wire-protocol.md, 5.13)."""
OVERSHOOT = 0.002
"""m beyond the fence that a measured motion may reach for a moment: some steps, which it drives back."""


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of one agent."""

    # radius of the circle around each robot's start that it may not leave, m
    fence: Annotated[float, Number(0.05, 100, "m")]
    speed: Annotated[float, Number(0.01, FASTEST, "m/s")]  # top speed of each wheel over the floor, m/s
    calls: Annotated[int, Whole(1, 1_000_000)]  # number of calls that may reach a robot
    seconds: Annotated[float, Number(1, 1_000_000, "s")]  # seconds that the robots may drive, all together

    def __post_init__(self) -> None:
        check(self, "the limit ")


@functools.cache
def fastest_within(speed: float) -> int:
    """Return the highest speed of a command, steps/s, with which a wheel of any e-puck is not faster than *speed*, m/s.

    The firmware rounds speeds up to what its motor timer can do: 776 steps/s become 833 on an e-puck1.
    """
    top = speed / METRES_PER_STEP
    return max(steps for steps in range(FASTEST_2 + 1) if step_rate(steps, 1) <= top and step_rate(steps, 2) <= top)


class Budget:
    """What is left of an agent's calls and seconds of driving; all its robots share it."""

    def __init__(self, limits: Limits) -> None:
        self.calls = limits.calls  # calls that are left
        self.seconds = limits.seconds  # seconds of driving that are left

    def spend_call(self) -> bool:
        """Spend one call; return whether one was left."""
        if self.calls <= 0:
            return False
        self.calls -= 1
        return True

    def spend_seconds(self, seconds: float) -> None:
        """Spend seconds of driving."""
        self.seconds = max(0.0, self.seconds - seconds)


class Guard(ForwardingChannel):
    """The channel of one action: it limits wheel speeds, and lets none pass that would leave the fence.

    A faster command is slowed down with the same ratio of the wheels, so the robot drives the same curve.

    Args:
        channel: The panel's own channel.
        limits: The limits of the agent.
        pose: Returns where the robot is, from its start.
        margin: Distance in s of driving that is kept to the fence; 0 for a motion whose goal was checked before.
    """

    def __init__(self, channel: Channel, limits: Limits, pose: Callable[[], Pose], *, margin: float) -> None:
        self.hooks = Hooks()
        self.is_over = False  # whether the fence has ended the action: no wheel may turn any more
        self._session = channel
        self._limits, self._pose, self._margin = limits, pose, margin
        self._speeds = (0.0, 0.0)
        self._asked: dict[int, tuple[Request[Any], Request[Any]]] = {}
        channel.hooks.append(self._see)

    def end(self) -> None:
        """Follow the events of the channel no longer. Safe to repeat."""
        self._session.hooks.remove(self._see)

    @property
    def is_ahead(self) -> bool:
        """Whether both wheels turn forwards."""
        return min(self._speeds) > 0

    def check(self) -> bool:
        """Return whether the robot may go on as its wheels turn now."""
        if not self.is_over and self._leaves(*self._speeds):
            self.is_over = True
        return not self.is_over

    def _leaves(self, left: float, right: float) -> bool:
        """Return whether a robot with these wheel speeds, m/s, leaves the fence."""
        pose, speed = self._pose(), (left + right) / 2
        distance = math.hypot(pose.x, pose.y)
        if distance == 0.0 or speed == 0.0:
            return False
        outward = speed * (pose.x * math.cos(pose.heading) + pose.y * math.sin(pose.heading)) / distance
        if self._margin:
            # A curve may turn outwards while the robot reacts, so all of the speed counts near the fence.
            near = distance + self._margin * abs(speed) > self._limits.fence
            return near and outward > -0.3 * abs(speed)
        return outward > 0 and distance > self._limits.fence + OVERSHOOT

    def _slowed(self, request: Request[Any]) -> Request[Any]:
        left, right = request.numbers
        top = fastest_within(self._limits.speed)
        fastest = max(abs(left), abs(right))
        if fastest <= top:
            return request
        share = top / fastest / STEPS_PER_REVOLUTION
        slower: Request[Any] = SPECS["set_speed"].request(self.context, left * share, right * share)
        return slower

    async def execute(self, request: Request[T], timeout: float) -> T:
        """Send *request* within the limits and return its answer.

        Raises:
            ArgumentError: The request drives the wheels otherwise than by ``set_speed``.
            MotionInterrupted: The robot would leave the fence.
        """
        if request.wheels != "drive" and request.name != "text":
            return await self._session.execute(request, timeout)
        # A text command that sets the speeds has the row's name, but its numbers are not checked.
        if request.name != "set_speed" or request.spec is None:
            raise ArgumentError(
                f"{request.text}: an agent drives by set_speed alone, so that its speed limit and fence hold",
                hint="choose another behaviour",
            )
        sent: Request[Any] = self._slowed(request)
        speeds = sent.numbers[0] * METRES_PER_STEP, sent.numbers[1] * METRES_PER_STEP
        if any(speeds) and (self.is_over or self._leaves(*speeds)):
            self.is_over = True
            raise MotionInterrupted("the robot would leave its fence", hint="drive towards the start")
        self._speeds = speeds
        if sent is request:
            return await self._session.execute(request, timeout)
        self._asked[id(sent)] = sent, request
        try:
            answer: T = await self._session.execute(sent, timeout)
        finally:
            del self._asked[id(sent)]
        return answer

    def _see(self, time: float, event: TraceEvent) -> None:
        """Pass events on, with the request as it was asked for: a slower one is not somebody else's."""
        if isinstance(event, Called | Ended) and (found := self._asked.get(id(event.request))) is not None:
            event = dataclasses.replace(event, request=found[1])
        self.hooks.call(time, event)

    # -- the channel --

    @property
    def error(self) -> ElibError | None:
        """Why the channel ended for good, or None."""
        return self._session.error

    def forget_speed(self) -> None:
        """Do nothing: the panel's own robot restores no speed after the link was lost."""

    async def execute_last(self, request: Request[T], timeout: float) -> T:
        """Send *request* and pass events on no longer; the panel's link stays open."""
        try:
            return await self.execute(request, timeout)
        finally:
            self.end()

    async def close(self) -> None:
        """Pass events on no longer; the panel's link stays open."""
        self.end()

    def send_unqueued(self, data: bytes) -> bool:
        """Send nothing: the panel stops the robot itself."""
        return False
