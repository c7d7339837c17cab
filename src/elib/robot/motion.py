"""Motion in metres and radians: ``robot.drive(0.10)``, ``robot.turn(pi / 2)``, ``robot.go_to(0.3, 0.2)``.

The step counters close the loop, so the robot stands at its goal however slow the link is. A wheel turns fast while its
way is long, slower towards the end, and at last so slowly that it does not take a second step while an answer is on its
way. Where a wheel will be when a command takes effect is predicted from the link's round trips. A wheel that went too
far, because the link was down meanwhile, is driven back.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any, Protocol, TypeVar

from elib.base.body import AXLE, METRES_PER_STEP, STEPS_PER_REVOLUTION, WHEEL_CIRCUMFERENCE
from elib.base.errors import (
    CommandRejected,
    ElibError,
    LinkLost,
    MotionBusy,
    MotionInterrupted,
    RemoteProtocolError,
    ReplyTimeout,
)
from elib.base.pose import bearing
from elib.link.protocol.commands import SPECS
from elib.link.protocol.table import Request
from elib.link.protocol.values import Steps
from elib.link.session import Called, Channel, Ended, Greeted, Reconnected, ResetNoticed, Robot, TraceEvent
from elib.robot.odometry import EVENTS, Odometry

T = TypeVar("T")

Look = Callable[[], Awaitable[None]]

FASTEST = WHEEL_CIRCUMFERENCE
"""m/s: one turn of a wheel a second, the firmware's limit."""
FIRST_TRIP = 0.1
"""s assumed for a round trip before one was measured: two commands over Bluetooth (wire-protocol.md, 5.13)."""
BRAKING = 3.0
"""Round trips in which the way that is left shrinks to a third. With fewer, answers come too late to slow down."""
MIN_BRAKING = 0.15
"""s, for links so quick that the times of the step motor matter."""
CREEPING = 0.4
"""Steps in one round trip at the slowest: the robot is told to stop at its goal before the wheel steps again."""
SLOWEST_CREEP, FASTEST_CREEP = 1.0, 40.0
"""steps/s."""
PERIOD = 0.02
"""s from one reading of the counters to the next, on links quicker than that: other calls need the link too."""
SMOOTHING = 0.3
"""Weight of a new round trip in their running mean."""
CALL_TIME, CALL_TRIPS, MAX_CALL_TIME = 0.15, 4, 5.0
"""s that a call may take on a quick link, and round trips on a slow one; it doubles after each lost answer, up to 5 s.
The wheels turn meanwhile."""
STANDING_TIME = 1.0
"""s that the robot has to confirm each stop when a motion is given up."""
SILENCE = 10.0
"""s without an answer after which a motion is given up, on a link that is not reopened."""
STUCK = 1.0
"""s without a step, beyond the time of two at the slowest, after which the wheel speeds are sent again: the robot may
have restarted without a greeting."""
RETRY_PAUSE = 0.05
"""s to wait while a link is being opened again, before the next try."""
MAX_STOPS = 3
"""How often the robot is told to stand still, at most, when a motion is given up."""
MIN_ERRORS = 0.0005, 0.005
"""m driven and rad turned below which the error of a motion does not mention them."""
NEAR = 0.001
"""m from its goal within which a robot has arrived."""
APPROACHES = 3
"""How often :func:`go_to` turns and drives, at most: the later times correct the error of the first heading."""


def pace(way: int, speed: float, cruise: float, trip: float) -> int:
    """Return the speed that brings a wheel to its goal, and to a stand there, over a link with a delay.

    Args:
        way: Steps that the wheel had to go when its counter was read; negative if the goal lies behind.
        speed: Its speed now, steps/s.
        cruise: The fastest speed allowed, steps/s.
        trip: Time from the reading of the counter until the new speed takes effect, about one round trip, s.

    Returns:
        The new speed, steps/s.
    """
    if way == 0:
        return 0
    creep = min(max(CREEPING / trip, SLOWEST_CREEP), FASTEST_CREEP)
    foreseen = way - speed * trip
    if speed * way > 0 and foreseen * way <= 0.0 and abs(speed) > creep:
        return 0  # it reaches the goal before the command reaches it: stand, and read the counters again
    braking = max(BRAKING * trip, MIN_BRAKING)
    return round(math.copysign(max(min(max(abs(foreseen) / braking, creep), cruise), 1.0), way))


class Mover(Robot, Protocol):
    """A robot as its motion needs it: :class:`Robot` and the motion itself."""

    @property
    def motion(self) -> Motion:
        """The state of its motions and its odometry."""


class Motion:
    """The motions of one robot and its odometry. All views of the robot share it."""

    odometry: Odometry  # the pose of the robot by its step counters, from when it was opened

    def __init__(self) -> None:
        self._under_way = ""
        self._own: Request[Any] | None = None
        self._interrupted_by = ""
        self._is_driven = False
        self._other: Request[Any] | None = None
        self._was_reset = False
        self._channel: Channel
        self._trip = FIRST_TRIP
        self._call_time = CALL_TIME
        self._answered = 0.0
        self._remainder = (0.0, 0.0)
        self.wheels: Any = None  # what driving by a map has learned of them

    def follow(self, channel: Channel, counters: Steps | None = None) -> None:
        """Follow the events of *channel* from now on; *counters* were read just now, where odometry begins."""
        self._channel = channel
        self.odometry = Odometry(channel, asyncio.get_running_loop().time(), counters)
        channel.hooks.append(self.odometry.observe, *EVENTS)

    def _observe(self, time: float, event: TraceEvent) -> None:
        """Notice what changes the wheels while a motion is under way: another call, or a restart."""
        if isinstance(event, Called):
            is_own = event.request is self._own or event.request is self._channel.restoring
            if event.request.name in ("set_speed", "stop") and not is_own:
                self._other = event.request
        elif not isinstance(event, Ended):
            self._was_reset = True
        elif event.request is self._other:
            self._other = None
            if event.error is None or not math.isnan(event.round_trip):  # else it was never sent
                self._interrupted_by, self._is_driven = event.request.name, event.error is None

    def check_free(self, name: str) -> None:
        """Raise MotionBusy for the call *name* if a motion is under way."""
        if self._under_way:
            raise MotionBusy(
                f"{name}: {self._under_way} is still under way",
                hint="wait for it, or cancel it first; stop() ends it too",
            )

    @contextlib.asynccontextmanager
    async def under_way(self, mover: Mover, name: str) -> AsyncIterator[None]:
        """Have the wheels while the block lasts, for the call *name*. An error in it stops them.

        Raises:
            MotionBusy: Another motion has them.
            ReplyTimeout: The time given was over, or the robot did not answer for :data:`SILENCE` seconds.
        """
        self.check_free(name)
        self._under_way = name
        self._interrupted_by, self._is_driven, self._other = "", False, None
        self._answered = asyncio.get_running_loop().time()
        self._channel.hooks.append(self._observe, Called, Ended, Greeted, ResetNoticed, Reconnected)
        before = self.odometry.left, self.odometry.right
        try:
            yield
        except BaseException as error:
            is_still = not self._is_driven and await self._stop(mover)
            if isinstance(error, ReplyTimeout):
                with contextlib.suppress(ElibError):  # how far the robot drove before it stood
                    await mover.session.execute(SPECS["encoders"].request(mover.session.context), STANDING_TIME)
                raise self._given_up(mover, before, is_still=is_still) from error
            raise
        finally:
            self._channel.hooks.remove(self._observe)
            self._under_way = ""

    def _given_up(self, mover: Mover, before: tuple[int, int], *, is_still: bool) -> ReplyTimeout:
        """Return the error of a motion that took too long, or whose robot no longer answered."""
        name = self._under_way
        if mover.time_left <= 0:
            ended = f"{name} did not end within {mover.time_given:g} s"
        else:
            ended = f"{name} was given up after {SILENCE:g} s without an answer"
        left, right = self.odometry.left - before[0], self.odometry.right - before[1]
        driven, turned = METRES_PER_STEP * (left + right) / 2, METRES_PER_STEP * (right - left) / AXLE
        parts = [
            f"{way:.2f} {unit}"
            for way, unit, least in zip((driven, turned), ("m driven", "rad turned"), MIN_ERRORS, strict=True)
            if abs(way) >= least
        ]
        stands = "the robot stands" if is_still else "the robot did not confirm that it stands"
        done = " and ".join(parts) or "nothing driven"
        return ReplyTimeout(f"{ended}: {done}; {stands}", request=name)

    async def turn(self, mover: Mover, angle: float, turn_rate: float, look: Look | None = None) -> None:
        """Turn on the spot by *angle*, rad, positive to the left, at *turn_rate* rad/s at most."""
        way = angle * AXLE / 2
        await self.roll(mover, -way, way, turn_rate * AXLE / 2, look)

    async def go(self, mover: Mover, x: float, y: float, speed: float, turn_rate: float) -> None:
        """Turn towards a place, m, and drive there in a straight line; again if the first heading missed it."""
        for _ in range(APPROACHES):
            await self.read_counters(mover)
            self._check_not_interrupted()
            pose = self.odometry.pose
            if math.hypot(x - pose.x, y - pose.y) < NEAR:
                return
            await self.turn(mover, bearing(pose, x, y), turn_rate)
            pose = self.odometry.pose
            way = math.hypot(x - pose.x, y - pose.y)
            await self.roll(mover, way, way, speed)

    async def roll(self, mover: Mover, left: float, right: float, speed: float, look: Look | None = None) -> None:
        """Roll the rims of the wheels by *left* and *right* metres, each at *speed* m/s at most.

        Before each reading of the counters *look* is awaited.

        Raises:
            MotionInterrupted: Another call drove or stopped the wheels.
            LinkLost: The link is lost for good.
            ReplyTimeout: The robot did not answer for :data:`SILENCE` seconds, or the time given was over.
        """
        await self.read_counters(mover)
        goals = []
        for travelled, way, rest in zip(
            (self.odometry.left, self.odometry.right), (left, right), self._remainder, strict=True
        ):
            goals.append(travelled + way / METRES_PER_STEP + rest)
        # Steps are integers; the next motion makes up for the rounding error.
        ends = [round(goal) for goal in goals]
        self._remainder = (goals[0] - ends[0], goals[1] - ends[1])
        cruise = max(speed / METRES_PER_STEP, 1.0)
        wheels: tuple[int, int] | None = None
        is_checked = False
        ways, moved = (0, 0), asyncio.get_running_loop().time()
        self._was_reset, restarts = False, self.odometry.restarts
        while True:
            before_ways, ways = ways, (ends[0] - self.odometry.left, ends[1] - self.odometry.right)
            if ways != before_ways:
                moved = asyncio.get_running_loop().time()
            elif asyncio.get_running_loop().time() - moved > STUCK + 2 / SLOWEST_CREEP:
                wheels, moved = None, asyncio.get_running_loop().time()
            if self._was_reset or self.odometry.restarts != restarts:  # the wheels stand now
                wheels, self._was_reset, restarts = None, False, self.odometry.restarts
            before = wheels or (0, 0)
            wanted = (pace(ways[0], before[0], cruise, self._trip), pace(ways[1], before[1], cruise, self._trip))
            if self._other is not None:
                wheels = None  # another call that drives is on its way: wait for its outcome
            elif wanted != wheels:
                wheels = wanted if await self.set_wheels(mover, wanted) else None
                is_checked = False
            elif ways == (0, 0) and wanted == (0, 0) and is_checked:
                return
            began = asyncio.get_running_loop().time()
            if look is not None:
                await look()
            is_checked = await self.try_counters(mover) and wheels == (0, 0)
            self._check_not_interrupted()
            await asyncio.sleep(max(0.0, began + PERIOD - asyncio.get_running_loop().time()))

    async def read_counters(self, mover: Mover) -> None:
        """Read the step counters, as often as it takes to get an answer.

        Raises:
            LinkLost: The link is lost for good.
            ReplyTimeout: The robot did not answer for :data:`SILENCE` seconds, or the time given was over.
        """
        if not self._under_way:
            self._answered = asyncio.get_running_loop().time()
        while not await self.try_counters(mover):
            pass

    async def read_counters_for(self, mover: Mover, name: str) -> None:
        """Read the step counters for a call that does not drive; *name* names that call in errors."""
        try:
            await self.read_counters(mover)
        except ReplyTimeout as error:
            seconds = min(mover.time_given, SILENCE)
            raise ReplyTimeout(
                f"{name} did not end within {seconds:g} s: the step counters could not be read", request=name
            ) from error

    async def try_counters(self, mover: Mover) -> bool:
        """Read the step counters once; return False without an answer. Raises what :meth:`read_counters` raises."""
        began = asyncio.get_running_loop().time()
        found = bool(await self.ask(mover, SPECS["encoders"].request(mover.session.context)))
        if found:
            trip = max(asyncio.get_running_loop().time() - began, PERIOD)
            self._trip += SMOOTHING * (trip - self._trip)
        return found

    async def set_wheels(self, mover: Mover, steps: tuple[int, int]) -> bool:
        """Set both wheels, steps/s; return False if it is unknown whether that was done.

        Raises:
            MotionInterrupted: Another call drove or stopped the wheels.
        """
        is_done = bool(await self.ask(mover, _speeds(mover, *steps)))
        self._check_not_interrupted()
        return is_done

    async def ask(self, mover: Mover, request: Request[T]) -> tuple[T, ...]:
        """Send a request of the motion under way; return its answer alone, or nothing if that was lost."""
        loop = asyncio.get_running_loop()
        timeout = max(self._call_time, CALL_TRIPS * self._trip)
        self._own = request
        try:
            answer = await mover.session.execute(request, min(timeout, mover.time_left))
        except CommandRejected:
            raise
        except (ReplyTimeout, RemoteProtocolError):  # the answer was lost or garbled
            if mover.time_left <= 0 or (not mover.is_reconnecting and loop.time() - self._answered > SILENCE):
                raise
            self._call_time = min(2 * self._call_time, MAX_CALL_TIME)
        except LinkLost:
            if not mover.is_reconnecting or mover.session.error is not None:
                raise
            await asyncio.sleep(RETRY_PAUSE)
        else:
            self._answered, self._call_time = loop.time(), CALL_TIME
            return (answer,)
        return ()

    def _check_not_interrupted(self) -> None:
        if self._interrupted_by:
            raise MotionInterrupted(
                f"{self._under_way} was ended by {self._interrupted_by}(), which has the wheels now",
                hint="only one call can drive at a time: await the motion, or cancel it first",
            )

    async def _stop(self, mover: Mover) -> bool:
        """Tell the robot to stand, and return whether it confirmed that. Raises nothing."""
        self._own = request = _speeds(mover, 0, 0)
        for _ in range(MAX_STOPS):
            with contextlib.suppress(ElibError):
                await mover.session.execute(request, STANDING_TIME)
                return True
        mover.session.forget_speed()  # the link is gone; when it comes back the robot must not drive on
        return False


def _speeds(mover: Mover, left: int, right: int) -> Request[Any]:
    left_speed, right_speed = left / STEPS_PER_REVOLUTION, right / STEPS_PER_REVOLUTION
    return SPECS["set_speed"].request(mover.session.context, left_speed, right_speed)
