"""Exact motion: to a place and not for a time, closed by the step counters over whatever link there is.

A wheel is asked for what the way that is left allows: fast while it is long, slower towards the end, and at last so
slowly that it takes no second step while an answer is on its way. Where the wheel will be when a command takes effect
is foreseen from the link's own round trips. A wheel that went too far, because the link was gone meanwhile, is driven
back.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import inspect
import math
import threading
import weakref
from collections.abc import AsyncIterator, Callable, Coroutine
from typing import Annotated, Any, Concatenate, ParamSpec, Protocol, SupportsFloat, TypeVar, get_args

from elib.body import AXLE, METRES_PER_STEP, STEPS_PER_REVOLUTION
from elib.errors import (
    ArgumentError,
    CommandRejected,
    ElibError,
    LinkLost,
    MotionBusy,
    MotionInterrupted,
    RemoteProtocolError,
    ReplyTimeout,
)
from elib.pose import Pose
from elib.protocol.commands import SPECS, Commands
from elib.protocol.quantities import Quantity
from elib.protocol.styles import action
from elib.protocol.table import Request
from elib.robot.odometry import Odometry
from elib.session import Called, Channel, Ended, Greeted, Reconnected, ResetNoticed, Robot, TraceEvent

P = ParamSpec("P")
T = TypeVar("T")

FASTEST = STEPS_PER_REVOLUTION * METRES_PER_STEP
"""m/s: one turn of a wheel a second, the firmware's limit."""
CRUISE = 0.064
"""m/s, unless a motion is given its own speed: half the fastest."""
TURN_RATE = 1.5
"""rad/s, unless a turn is given its own speed."""

Distance = Annotated[float, Quantity("distance", "m", -100, 100, scale=1e6)]
Coordinate = Annotated[float, Quantity("coordinate", "m", -1000, 1000, scale=1e6)]
Angle = Annotated[float, Quantity("angle", "rad", -6 * math.pi, 6 * math.pi, scale=1e6)]
"""At most three turns: more is an angle in degrees."""
Speed = Annotated[float, Quantity("speed", "m/s", 0.001, FASTEST, scale=1e6)]
TurnRate = Annotated[float, Quantity("turn_rate", "rad/s", 0.05, 2 * FASTEST / AXLE, scale=1e6)]
SignedSpeed = Annotated[float, Quantity("speed", "m/s", -FASTEST, FASTEST, scale=1e6)]
SignedTurnRate = Annotated[float, Quantity("turn_rate", "rad/s", -2 * FASTEST / AXLE, 2 * FASTEST / AXLE, scale=1e6)]

FIRST_TRIP = 0.1
"""s that a round trip is taken for before one was measured: two commands over Bluetooth (robot-model, 2.12)."""
BRAKING = 3.0
"""Round trips in which the way that is left shrinks to a third: fewer, and the answer comes too late to slow down."""
SHORTEST_BRAKING = 0.15
"""s, on links so quick that the step motor's own times matter."""
CREEPING = 0.4
"""Steps in one round trip at the slowest: the wheel is seen at its goal, and told to stop, before it steps again."""
SLOWEST_CREEP, FASTEST_CREEP = 1.0, 40.0
"""steps/s."""
PERIOD = 0.02
"""s from one look at the counters to the next, on links quicker than that: a link has other things to carry."""
SMOOTHING = 0.3
"""Share of a new round trip in their running mean."""
PATIENCE, TRIPS, LONGEST_PATIENCE = 0.15, 4, 5.0
"""s that a call may take on a quick link, round trips on a slow one, and twice as long after each that was lost: the
wheels turn meanwhile."""
STANDING_TIME = 1.0
"""s that the robot has to confirm that it stands when a motion is given up."""
SILENCE = 10.0
"""s without any answer after which a motion is given up, on a link that does not come back by itself."""
STUCK = 1.0
"""s without a step, beyond what two take at the slowest, after which the wheels are told their speeds again: the robot
may have restarted without a word."""
GAP = 0.05
"""s between two looks whether a link that is being opened again is there."""
STILL = 3
"""Times that the robot is told to stand still when a motion is given up."""
WORTH_SAYING = 0.0005, 0.005
"""m driven and rad turned below which a motion that was given up has not moved the robot."""
NEAR = 0.001
"""m. A robot that is so near to where it was sent has arrived."""
APPROACHES = 3
"""Times that :func:`go_to` sets out: the later ones mend what the first heading was wrong by."""


def pace(way: int, speed: float, cruise: float, trip: float) -> int:
    """Return the speed at which a wheel comes to its goal, and stands there, over a link that takes its time.

    Args:
        way: Steps that it had to go when its counter was read, negative if the goal lies behind.
        speed: At which it turns, steps/s.
        cruise: The fastest it may, steps/s.
        trip: s from the moment at which the counter was read to the one at which the new speed takes effect, about
            one round trip.

    Returns:
        steps/s
    """
    if way == 0:
        return 0
    creep = min(max(CREEPING / trip, SLOWEST_CREEP), FASTEST_CREEP)
    foreseen = way - speed * trip
    if speed * way > 0 and foreseen * way <= 0.0 and abs(speed) > creep:
        return 0  # it will be there when the command is: stand, and look again
    braking = max(BRAKING * trip, SHORTEST_BRAKING)
    return round(math.copysign(max(min(max(abs(foreseen) / braking, creep), cruise), 1.0), way))


class Mover(Robot, Protocol):
    """A robot that moves."""

    @property
    def motion(self) -> Motion:
        """What its wheels are doing, and where it is by them."""
        ...


class Reservation:
    """A motion's reservation of the wheels, from its call on.

    Args:
        name: Of the motion, as it was called.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self._coroutine: Callable[[], Coroutine[Any, Any, Any] | None] = lambda: None

    def hold_for(self, coroutine: Coroutine[Any, Any, Any]) -> None:
        """Last as long as *coroutine*: until that has ended, or nobody can run it any more."""
        self._coroutine = weakref.ref(coroutine)

    @property
    def is_over(self) -> bool:
        """Whether the motion has ended, or will never run."""
        coroutine = self._coroutine()
        return coroutine is None or inspect.getcoroutinestate(coroutine) == inspect.CORO_CLOSED


class Motion:
    """What one robot's wheels are about, and where it is by them; shared by all views of the robot.

    Attributes:
        odometry: Where it is.
    """

    def __init__(self) -> None:
        self.odometry = Odometry()
        self._reservations: tuple[Reservation, ...] = ()
        self._reserving = threading.Lock()
        self._under_way = ""
        self._own: Request[Any] | None = None
        self._interrupted_by = ""
        self._is_driven = False
        self._other: Request[Any] | None = None
        self._was_reset = False
        self._channel: Channel | None = None
        self._trip = FIRST_TRIP
        self._patience = PATIENCE
        self._answered = 0.0
        self._remainder = (0.0, 0.0)

    def follow(self, channel: Channel) -> None:
        """Follow what passes by in *channel* from now on; once is enough."""
        if self._channel is not channel:
            self._channel = channel
            channel.hooks.append(self._observe)

    def _observe(self, time: float, event: TraceEvent) -> None:
        self.odometry.observe(time, event)
        if isinstance(event, Greeted | ResetNoticed | Reconnected):
            self._was_reset = True
        if isinstance(event, Called) and event.request.name in ("set_speed", "stop"):
            is_restoring = self._channel is not None and self._channel.is_restoring
            if self._under_way and event.request is not self._own and not is_restoring:
                self._other = event.request
        if isinstance(event, Ended) and event.request is self._other:
            self._other = None
            if event.error is None or not math.isnan(event.round_trip):  # else it was never sent
                self._interrupted_by, self._is_driven = event.request.name, event.error is None

    def reserve(self, reservation: Reservation) -> None:
        """Add a reservation of the wheels, behind those that were made before. Any thread may call."""
        with self._reserving:
            self._reservations = (*(each for each in self._reservations if not each.is_over), reservation)

    @property
    def _first(self) -> Reservation | None:
        return next((each for each in self._reservations if not each.is_over), None)

    def check_free(self, name: str, reservation: Reservation | None = None) -> None:
        """Raise MotionBusy if a motion has the wheels: it is under way, or was called before *reservation* was made."""
        first = self._first
        if first is not None and first is not reservation:
            other = first.name
            raise MotionBusy(
                f"{name}: {other} is still under way",
                hint="wait for it, or cancel it first; stop() ends it too",
            )

    @contextlib.asynccontextmanager
    async def under_way(self, mover: Mover) -> AsyncIterator[None]:
        """Move, for the first who claimed the wheels; whatever ends the motion early stops them.

        Raises:
            ReplyTimeout: The view's time was over, or nothing was heard of the robot for long.
        """
        self.follow(mover.session)
        first = self._first
        self._under_way = "" if first is None else first.name
        self._interrupted_by, self._is_driven, self._other = "", False, None
        self._answered = asyncio.get_running_loop().time()
        before = self.odometry.left, self.odometry.right
        try:
            yield
        except BaseException as error:
            is_still = not self._is_driven and await self._stop(mover)
            if isinstance(error, ReplyTimeout):
                with contextlib.suppress(ElibError):  # how far it came until it stood
                    await mover.session.execute(SPECS["encoders"].request(mover.session.context), STANDING_TIME)
                raise self._given_up(mover, before, is_still=is_still) from error
            raise
        finally:
            self._under_way = ""

    def _given_up(self, mover: Mover, before: tuple[int, int], *, is_still: bool) -> ReplyTimeout:
        """Return the error of a motion that took too long, or whose robot fell silent."""
        name = self._under_way
        if mover.time_left <= 0:
            ended = f"{name} did not end within {mover.time_given:g} s"
        else:
            ended = f"{name} was given up after {SILENCE:g} s without an answer"
        left, right = self.odometry.left - before[0], self.odometry.right - before[1]
        driven, turned = METRES_PER_STEP * (left + right) / 2, METRES_PER_STEP * (right - left) / AXLE
        parts = [
            f"{way:.2f} {unit}"
            for way, unit, least in zip((driven, turned), ("m driven", "rad turned"), WORTH_SAYING, strict=True)
            if abs(way) >= least
        ]
        stands = "the robot stands" if is_still else "the robot did not confirm that it stands"
        done = " and ".join(parts) or "nothing driven"
        return ReplyTimeout(f"{ended}: {done}; {stands}", request=name)

    async def turn(self, mover: Mover, angle: float, turn_rate: float) -> None:
        """Turn on the spot by *angle*, rad, to the left if positive, at *turn_rate* rad/s at most."""
        way = angle * AXLE / 2
        await self.roll(mover, -way, way, turn_rate * AXLE / 2)

    async def go(self, mover: Mover, x: float, y: float, speed: float, turn_rate: float) -> None:
        """Turn towards a place, m, and drive there in a straight line; again, if the first heading missed it."""
        for _ in range(APPROACHES):
            await self.read_counters(mover)
            self._check_not_interrupted()
            pose = self.odometry.pose
            if math.hypot(x - pose.x, y - pose.y) < NEAR:
                return
            angle = math.remainder(math.atan2(y - pose.y, x - pose.x) - pose.heading, math.tau)
            await self.turn(mover, angle, turn_rate)
            pose = self.odometry.pose
            way = math.hypot(x - pose.x, y - pose.y)
            await self.roll(mover, way, way, speed)

    async def roll(self, mover: Mover, left: float, right: float, speed: float) -> None:
        """Roll both wheels by these many metres of their rims, each as fast as *speed*, m/s, at most.

        Raises:
            MotionInterrupted: Another call drove or stopped the wheels.
            LinkLost: The link is gone for good.
            ReplyTimeout: The robot answered nothing for :data:`SILENCE` seconds, or the view's time was over.
        """
        await self.read_counters(mover)
        goals = []
        for travelled, way, rest in zip(
            (self.odometry.left, self.odometry.right), (left, right), self._remainder, strict=True
        ):
            goals.append(travelled + way / METRES_PER_STEP + rest)
        # Half steps there are none; what is cut off here is made good by the next motion.
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
            if self._was_reset or self.odometry.restarts != restarts:  # it stands, whatever it was told before
                wheels, self._was_reset, restarts = None, False, self.odometry.restarts
            before = wheels or (0, 0)
            wanted = (pace(ways[0], before[0], cruise, self._trip), pace(ways[1], before[1], cruise, self._trip))
            if self._other is not None:
                wheels = None  # another call for the wheels is on its way: it goes first
            elif wanted != wheels:
                wheels = wanted if await self._set(mover, wanted) else None
                self._check_not_interrupted()
                is_checked = False
            elif ways == (0, 0) and wanted == (0, 0) and is_checked:
                return
            began = asyncio.get_running_loop().time()
            is_checked = await self.try_counters(mover) and wheels == (0, 0)
            self._check_not_interrupted()
            await asyncio.sleep(max(0.0, began + PERIOD - asyncio.get_running_loop().time()))

    async def read_counters(self, mover: Mover) -> None:
        """Read the step counters until an answer comes.

        Raises:
            LinkLost: The link is gone for good.
            ReplyTimeout: There was no answer for long, or the view's time is over.
        """
        if not self._under_way:
            self._answered = asyncio.get_running_loop().time()
        while not await self.try_counters(mover):
            pass

    async def read_counters_for(self, mover: Mover, name: str) -> None:
        """Read the step counters for a call that does not drive, and name that in errors; errors as of :meth:`see`."""
        try:
            await self.read_counters(mover)
        except ReplyTimeout as error:
            seconds = min(mover.time_given, SILENCE)
            raise ReplyTimeout(
                f"{name} did not end within {seconds:g} s: the step counters could not be read", request=name
            ) from error

    async def try_counters(self, mover: Mover) -> bool:
        """Read the step counters; return False if no answer came this time; errors as of :meth:`see`."""
        began = asyncio.get_running_loop().time()
        found = await self._ask(mover, SPECS["encoders"].request(mover.session.context))
        if found:
            trip = max(asyncio.get_running_loop().time() - began, PERIOD)
            self._trip += SMOOTHING * (trip - self._trip)
        return found

    async def _set(self, mover: Mover, steps: tuple[int, int]) -> bool:
        """Set both wheels, steps/s; return False if it is not known whether that was done."""
        return await self._ask(mover, _speeds(mover, *steps))

    async def _ask(self, mover: Mover, request: Request[Any]) -> bool:
        self.follow(mover.session)
        loop = asyncio.get_running_loop()
        patience = max(self._patience, TRIPS * self._trip)
        self._own = request
        try:
            await mover.session.execute(request, min(patience, mover.time_left))
        except CommandRejected:
            raise
        except (ReplyTimeout, RemoteProtocolError):  # lost, or garbled
            if mover.time_left <= 0 or (not mover.is_reconnecting and loop.time() - self._answered > SILENCE):
                raise
            self._patience = min(2 * self._patience, LONGEST_PATIENCE)
            is_done = False
        except LinkLost:
            if not mover.is_reconnecting or mover.session.error is not None:
                raise
            await asyncio.sleep(GAP)
            is_done = False
        else:
            self._answered, self._patience = loop.time(), PATIENCE
            is_done = True
        return is_done

    def _check_not_interrupted(self) -> None:
        if self._interrupted_by:
            raise MotionInterrupted(
                f"{self._under_way} was ended by {self._interrupted_by}(), which has the wheels now",
                hint="one at a time drives: await the motion, or cancel it first",
            )

    async def _stop(self, mover: Mover) -> bool:
        """Tell the robot to stand, and return whether it confirmed that.

        What ended the motion says more than a robot that does not answer to this.
        """
        self._own = request = _speeds(mover, 0, 0)
        for _ in range(STILL):
            with contextlib.suppress(ElibError):
                await mover.session.execute(request, STANDING_TIME)
                return True
        mover.session.forget_speed()  # the link is gone; when it comes back the robot must not drive on
        return False


def _speeds(mover: Mover, left: int, right: int) -> Request[Any]:
    left_speed, right_speed = left / STEPS_PER_REVOLUTION, right / STEPS_PER_REVOLUTION
    return SPECS["set_speed"].request(mover.session.context, left_speed, right_speed)


def motion(
    function: Callable[Concatenate[Any, P], Coroutine[Any, Any, T]],
) -> Callable[Concatenate[Any, P], Coroutine[Any, Any, T]]:
    """Make a coroutine method a motion: it claims the wheels when it is called, whenever its coroutine begins to run.

    Of two motions the one that was called first drives.
    """

    async def run(reservation: Reservation, mover: Mover, args: Any, kwargs: Any) -> T:
        mover.motion.check_free(reservation.name, reservation)
        return await function(mover, *args, **kwargs)

    @functools.wraps(function)
    def called(mover: Mover, /, *args: Any, **kwargs: Any) -> Coroutine[Any, Any, T]:
        shown = [*map(str, args), *(f"{name}={value}" for name, value in kwargs.items())]
        reservation = Reservation(f"{function.__name__}({', '.join(shown)})")
        coroutine = run(reservation, mover, args, kwargs)
        reservation.hold_for(coroutine)
        mover.motion.reserve(reservation)
        return coroutine

    return called


class Motions(Commands):
    """Motions in metres and radians, closed by the step counters.

    One motion at a time has the wheels. Cancelled, or ended by an error, it stops the robot; ``set_speed()`` and
    ``stop()`` end it in a MotionInterrupted and are obeyed. Lost answers delay it; a wheel that went too far meanwhile
    is driven back. Places are those of odometry: it begins at (0, 0), looking along x, with the first reading of the
    counters, and sees neither slip nor a wall that holds the robot up.
    """

    @action
    @motion
    async def drive(self: Mover, distance: Distance, *, speed: Speed = CRUISE) -> Pose:
        """Drive straight on, m, backwards if negative, and return where it stands then.

        The step counters end at the goal to one step, 0.13 mm, however slow the link is.

        Args:
            distance: -100 to 100 m.
            speed: At most, m/s, up to 0.1288.
        """
        way = _checked(Distance, "distance", distance)
        fastest = _checked(Speed, "speed", speed)
        async with self.motion.under_way(self):
            await self.motion.roll(self, way, way, fastest)
        return self.motion.odometry.pose

    @action
    @motion
    async def turn(self: Mover, angle: Angle, *, turn_rate: TurnRate = TURN_RATE) -> Pose:
        """Turn on the spot, rad, to the left if positive, and return where it stands then.

        One step of both wheels is 0.28 degrees; what one turn rounds off the next makes good.

        Args:
            angle: -18.8 to 18.8 rad, three turns.
            turn_rate: At most, rad/s, up to 4.86.
        """
        rotation = _checked_angle("angle", angle)
        fastest = _checked(TurnRate, "turn_rate", turn_rate)
        async with self.motion.under_way(self):
            await self.motion.turn(self, rotation, fastest)
        return self.motion.odometry.pose

    @action
    @motion
    async def go_to(
        self: Mover,
        x: Coordinate | Pose,
        y: Coordinate | None = None,
        heading: Angle | None = None,
        *,
        speed: Speed = CRUISE,
        turn_rate: TurnRate = TURN_RATE,
    ) -> Pose:
        """Turn towards a place, drive there in a straight line, turn to *heading*, and return where it stands then.

        Nothing is driven round: what stands in the way holds the robot up, and odometry does not notice.

        Args:
            x: Place in odometry's coordinates, m; or a pose, which has y and heading, too: ``robot.go_to(pose)``.
            y: The same.
            heading: Direction to look in at the end, rad; None for that in which it came.
            speed: Of the drive at most, m/s, up to 0.1288.
            turn_rate: Of the turns at most, rad/s, up to 4.86.
        """
        if isinstance(x, Pose):
            if y is not None or heading is not None:
                raise ArgumentError("go_to() takes a pose alone, or x, y and heading", hint="robot.go_to(pose)")
            goal = x
            x, y, heading = goal.x, goal.y, goal.heading
        elif y is None:
            raise ArgumentError("go_to() needs y as well", hint="robot.go_to(0.3, 0.2), m, or robot.go_to(pose)")
        place = _checked(Coordinate, "x", x), _checked(Coordinate, "y", y)
        end = None if heading is None else _checked_angle("heading", heading)
        fastest, turn_rate_limit = _checked(Speed, "speed", speed), _checked(TurnRate, "turn_rate", turn_rate)
        async with self.motion.under_way(self):
            await self.motion.go(self, *place, fastest, turn_rate_limit)
            if end is not None:
                rotation = math.remainder(end - self.motion.odometry.pose.heading, math.tau)
                await self.motion.turn(self, rotation, turn_rate_limit)
        return self.motion.odometry.pose

    @action
    async def set_velocity(self: Mover, speed: SignedSpeed, turn_rate: SignedTurnRate = 0.0) -> None:
        """Drive on with this speed and turn rate until told otherwise.

        Args:
            speed: m/s, forwards if positive, -0.1288 to 0.1288.
            turn_rate: rad/s, to the left if positive, -4.86 to 4.86. No wheel may have to roll faster than 0.1288 m/s.

        Raises:
            ArgumentError: A wheel would have to turn faster than it can.
            MotionBusy: A motion has the wheels.
        """
        ahead, turning = _checked(SignedSpeed, "speed", speed), _checked(SignedTurnRate, "turn_rate", turn_rate)
        left, right = ((ahead + side * turning * AXLE / 2) / FASTEST for side in (-1, 1))
        if max(abs(left), abs(right)) > 1:
            raise ArgumentError(
                f"speed {speed} m/s with turn_rate {turn_rate} rad/s asks a wheel for {max(abs(left), abs(right)):.2f} "
                "rev/s; it makes 1 rev/s at most",
                hint="drive or turn more slowly",
            )
        self.motion.check_free(f"set_velocity({speed}, {turn_rate})")
        spec = SPECS["set_speed"]
        await self.execute(spec.request(self.session.context, left, right), spec.timeout)

    @action
    async def pose(self: Mover) -> Pose:
        """Read the step counters and return where the robot is by them, with the time of the reading.

        Odometry begins at (0, 0), looking along x, with the first reading of the counters.
        """
        await self.motion.read_counters_for(self, "pose()")
        return self.motion.odometry.pose

    @action
    async def set_pose(self: Mover, x: Coordinate, y: Coordinate, heading: Angle = 0.0) -> None:
        """Let odometry stand at a known place from now on; nothing moves.

        Args:
            x: m
            y: m
            heading: rad
        """
        place = _checked(Coordinate, "x", x), _checked(Coordinate, "y", y)
        direction = _checked_angle("heading", heading)
        await self.motion.read_counters_for(self, f"set_pose({x}, {y}, {heading})")
        self.motion.odometry.pose = Pose(
            *place, math.remainder(direction, math.tau), time=self.motion.odometry.pose.time
        )


def _checked(kind: Any, name: str, value: object) -> float:
    """Return *value* if it is one of this kind; ArgumentError says what would be."""
    quantity = get_args(kind)[1]
    return float(quantity.check(name, value, quantity.low, quantity.high))


def _checked_angle(name: str, value: object) -> float:
    """Return *value* if it is an angle, rad; one of more than three turns was meant in degrees."""
    largest = get_args(Angle)[1].high
    try:
        return _checked(Angle, name, value)
    except ArgumentError as error:
        if isinstance(value, SupportsFloat) and largest < abs(float(value)) < math.inf:
            raise ArgumentError(error.message, hint=f"did you mean math.radians({float(value):g})?") from None
        raise
