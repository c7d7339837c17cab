"""Motion as users call it, on every style: ``robot.drive(0.10)``, ``robot.turn(pi / 2)``, ``robot.go_to(0.3, 0.2)``."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Coroutine
from typing import Any, Concatenate, ParamSpec, SupportsFloat, TypeVar, get_args

from elib.body import AXLE
from elib.errors import ArgumentError
from elib.pose import Pose
from elib.protocol.commands import SPECS, Commands
from elib.protocol.styles import action
from elib.robot.motion import (
    CRUISE,
    FASTEST,
    TURN_RATE,
    Angle,
    Coordinate,
    Distance,
    Mover,
    Reservation,
    SignedSpeed,
    SignedTurnRate,
    Speed,
    TurnRate,
)

P = ParamSpec("P")
T = TypeVar("T")


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
