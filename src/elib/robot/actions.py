"""Methods that need more than one row of the command table: motions, and what reads or says more; and all there is."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import inspect
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Protocol, runtime_checkable

from elib.base.body import AXLE, METRES_PER_STEP, SENSOR_DIRECTIONS
from elib.base.errors import ArgumentError, LinkLost, RemoteProtocolError, ReplyTimeout, Unsupported, about
from elib.base.pose import Pose
from elib.base.rules import Number, Several
from elib.link.protocol.commands import SPECS, Commands
from elib.link.protocol.context import Context
from elib.link.protocol.profiles import FIRMWARES
from elib.link.protocol.quantities import Quantity, Seconds, TagSize
from elib.link.protocol.raw import text_request
from elib.link.protocol.styles import action
from elib.link.protocol.table import WheelEffect, without_example
from elib.link.protocol.values import Neighbour, Sensors
from elib.link.session import Robot
from elib.robot.motion import FASTEST, Mover
from elib.robot.polling import polls, sensor_polls

if TYPE_CHECKING:
    from elib.link.protocol.distances import Distances, Scan
    from elib.link.protocol.tags import Tag
    from elib.maps.grid import Grid
else:
    Grid = Any  # annotations of arguments are read at run time, and maps need NumPy

CRUISE = 0.064
"""m/s, the default of motions: half the fastest."""
TURN_RATE = 1.5
"""rad/s, the default of turns."""

USUAL_WAY = 5.0
"""m: beyond the tables of these robots, and a drive of 78 s. A larger number is likely to be in centimetres."""
USUAL_ANGLE = 6 * math.pi
"""rad, three turns: a larger number is likely to be in degrees."""

Distance = Annotated[float, Quantity("distance", "m", -100, 100, scale=1e6, usual=USUAL_WAY)]
COORDINATE = Quantity("coordinate", "m", -1000, 1000, scale=1e6, usual=USUAL_WAY)
Coordinate = Annotated[float, COORDINATE]
ANGLE = Quantity("angle", "rad", -1000, 1000, scale=1e6, usual=USUAL_ANGLE)
Angle = Annotated[float, ANGLE]
Speed = Annotated[float, Quantity("speed", "m/s", 0.001, FASTEST, scale=1e6)]
TurnRate = Annotated[float, Quantity("turn_rate", "rad/s", 0.05, 2 * FASTEST / AXLE, scale=1e6)]
SignedSpeed = Annotated[float, Quantity("speed", "m/s", -FASTEST, FASTEST, scale=1e6)]
SignedTurnRate = Annotated[float, Quantity("turn_rate", "rad/s", -2 * FASTEST / AXLE, 2 * FASTEST / AXLE, scale=1e6)]

ASKING_TIME = 0.002
"""s that a question about neighbours takes, like a short command on the line. Without it, simulated time would stand
still for a program that asks nothing else."""

SCAN_RATE = 1.0
"""rad/s: a link that takes 0.08 s for a look then lets each sensor look twice in each direction of a scan."""

GAINS = Several(Number(0.01, 100), len(SENSOR_DIRECTIONS))
"""The rule of the factors of the infrared sensors. A gain of 0 would make a wall of nothing."""
Reflectance = Annotated[float, Quantity("reflectance", "", 0.05, 1, scale=100)]


@runtime_checkable
class Messenger(Protocol):
    """A transport that leads to a robot which hears others by range and bearing: a simulated one."""

    def send_message(self, message: bytes) -> None:
        """Let the robot say *message* from now on."""
        ...

    def neighbours(self) -> tuple[Neighbour, ...]:
        """Return the robots that it hears."""
        ...


async def _look(robot: Robot, reflectance: float, gains: Any) -> Distances:
    """Read the sensors that measure distances."""
    from elib.link.protocol.distances import OpenAir, distances  # here: most programs read counts

    if gains is not None:
        gains = GAINS.require(tuple(gains) if isinstance(gains, Iterable) else gains, "gains")
    context, found = robot.context, dict[str, Any]()
    names = [name for name in ("proximity", "distance") if name not in context.profile.absent]
    for poll in polls(names, context, "distances()"):
        answer = await robot.execute(poll.request, poll.request.timeout)
        found |= poll.readings(answer)
    context.open_air = context.open_air or OpenAir()
    near = context.open_air(found["proximity"])
    return distances(near, gains=gains, reflectance=reflectance, flight=found.get("distance"))


def _messenger(robot: Robot) -> Messenger:
    ended = robot.session.error
    if ended is not None:
        raise about("neighbours and messages", ended)
    transport = robot.session.transport
    if isinstance(transport, Messenger):
        return transport
    raise Unsupported(
        f"{robot.url} cannot hear other robots: no firmware's protocol carries range and bearing",
        hint="open a robot of the simulator in this program, such as sim://crowd",
    )


class Motions(Commands):
    """Motions in metres and radians, closed by the step counters.

    One motion at a time has the wheels. A motion that is cancelled, or ended by an error, stops the robot.
    ``set_speed()`` and ``stop()`` are carried out, and the motion ends in a MotionInterrupted. Lost answers delay it; a
    wheel that went too far meanwhile is driven back. Places are those of odometry. It begins at (0, 0), looking along
    x, when the robot is opened, and it notices neither slip nor a wall that stops the robot.
    """

    @action
    async def drive(self: Mover, distance: Distance, *, speed: Speed = CRUISE) -> Pose:
        """Drive straight on, m, backwards if negative, and return the pose at the end.

        The step counters end at the goal to one step, 0.13 mm, however slow the link is.

        Args:
            distance: The way, -5 to 5 m; with :func:`elib.really` up to 100 m.
            speed: The fastest speed, m/s, up to 0.1288.

        Example:
            >>> pose = robot.drive(0.10)
            >>> round(pose.x, 3)
            0.1
        """
        async with self.motion.under_way(self, f"drive({distance:g})"):
            await self.motion.roll(self, distance, distance, speed)
        return self.motion.odometry.pose

    @action
    async def turn(self: Mover, angle: Angle, *, turn_rate: TurnRate = TURN_RATE) -> Pose:
        """Turn on the spot, rad, to the left if positive, and return the pose at the end.

        One step of both wheels is 0.28 degrees; the next turn makes up for the rounding of this one.

        Args:
            angle: -18.8 to 18.8 rad, three turns; with :func:`elib.really` up to 1000 rad.
            turn_rate: The fastest turn rate, rad/s, up to 4.86.

        Example:
            >>> pose = robot.turn(math.pi / 2)
            >>> round(math.degrees(pose.heading))
            90
        """
        async with self.motion.under_way(self, f"turn({angle:g})"):
            await self.motion.turn(self, angle, turn_rate)
        return self.motion.odometry.pose

    @action
    async def go_to(
        self: Mover,
        x: Coordinate | Pose,
        y: Coordinate | None = None,
        heading: Angle | None = None,
        *,
        speed: Speed = CRUISE,
        turn_rate: TurnRate = TURN_RATE,
        map: Grid | None = None,  # noqa: A002
    ) -> Pose:
        """Turn towards a place, drive there in a straight line, turn to *heading*, and return the pose at the end.

        Without a map the robot does not drive round obstacles: they stop it, and odometry does not notice. With one it
        drives round what is on it, looks for what is not, and odometry is set right by what it sees on the way.

        Args:
            x: Place in the coordinates of odometry, -5 to 5 m, with :func:`elib.really` up to 1000 m; or a pose, which
                has y and heading too: ``robot.go_to(pose)``.
            y: The other coordinate, m.
            heading: Direction to look in at the end, rad; None for the direction of the drive.
            speed: The fastest speed of the drive, m/s, up to 0.1288.
            turn_rate: The fastest turn rate, rad/s, up to 4.86.
            map: What stands where, an ``elib.Grid`` in the coordinates of odometry: ``robot.set_pose()`` first says
                where on it the robot is. The first time, it turns round once, to learn what its sensors read in the
                open.

        Raises:
            NoWay: There is none on the map, or the robot lost it.

        Example:
            >>> pose = robot.go_to(0.1, 0.1, heading=0)
            >>> round(pose.x, 2), round(pose.y, 2)
            (0.1, 0.1)
        """
        if isinstance(x, Pose):
            if y is not None or heading is not None:
                raise ArgumentError("go_to() takes either a pose, or x, y and heading", hint="robot.go_to(pose)")
            goal = x
            x, y = COORDINATE.check("x", goal.x), COORDINATE.check("y", goal.y)
            heading = ANGLE.check("heading", goal.heading)
        elif y is None:
            raise ArgumentError("go_to() needs y as well", hint="robot.go_to(0.3, 0.2), m, or robot.go_to(pose)")
        async with self.motion.under_way(self, f"go_to({x:g}, {y:g})"):
            if map is None:
                await self.motion.go(self, x, y, speed, turn_rate)
            else:
                from elib.maps.grid import check_grid  # here: they need NumPy, which most programs never load
                from elib.robot.ways import go

                check_grid(map)
                await go(self, map, (x, y), speed, turn_rate)
            if heading is not None:
                rotation = math.remainder(heading - self.motion.odometry.pose.heading, math.tau)
                await self.motion.turn(self, rotation, turn_rate)
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

        Example:
            >>> robot.set_velocity(0.05, 0.5)
            >>> robot.speed()
            Wheels(left=0.285, right=0.491)
        """
        left, right = ((speed + side * turn_rate * AXLE / 2) / FASTEST for side in (-1, 1))
        fastest = max(abs(left), abs(right))
        if fastest > 1:
            raise ArgumentError(
                f"speed {speed:g} m/s with turn_rate {turn_rate:g} rad/s asks a wheel for {fastest:.2f} rev/s; it "
                "makes 1 rev/s at most",
                hint="drive or turn more slowly",
            )
        self.motion.check_free(f"set_velocity({speed:g}, {turn_rate:g})")
        request = SPECS["set_speed"].request(self.session.context, left, right)
        await self.execute(request, request.timeout)

    @action
    async def pose(self: Mover) -> Pose:
        """Read the step counters and return the pose that they give, with the time of the reading.

        Odometry begins at (0, 0), looking along x, when the robot is opened. It follows every speed that is set, so
        nothing has to be read on the way. ``uncertainty`` and ``heading_uncertainty`` of the pose say how sure it is.

        Example:
            >>> robot.set_speed(0.5, 0.5)
            >>> robot.sleep(1)
            >>> round(robot.pose().x, 3)
            0.064
        """
        await self.motion.read_counters_for(self, "pose()")
        return self.motion.odometry.pose

    @action
    async def set_pose(self: Mover, x: Coordinate, y: Coordinate, heading: Angle = 0.0) -> None:
        """Set the pose of odometry to a known place; nothing moves.

        Args:
            x: The first coordinate, -5 to 5 m, with :func:`elib.really` up to 1000 m.
            y: The second coordinate, m.
            heading: The direction in which the robot looks, rad.

        Example:
            >>> robot.set_pose(0.5, 0.3, heading=math.pi / 2)
            >>> round(robot.drive(0.1).y, 3)
            0.4
        """
        await self.motion.read_counters_for(self, f"set_pose({x:g}, {y:g}, {heading:g})")
        self.motion.odometry.pose = Pose(x, y, math.remainder(heading, math.tau), time=self.motion.odometry.pose.time)


class Actions(Motions):
    """Every command, every motion, and what needs several commands."""

    @action
    async def sensors(self: Robot) -> Sensors:
        """Read all sensors of the robot, in one request if the firmware can take it.

        Example:
            >>> everything = robot.sensors()
            >>> everything.selector, everything.distance
            (Selector(position=3), None)
        """
        context = self.context
        found: dict[str, Any] = {}
        for poll in sensor_polls(context):
            answer = await self.execute(poll.request, poll.request.timeout)
            found |= poll.readings(answer)
        return Sensors(**found, **context.stamp)

    @action
    async def distances(
        self: Robot, *, reflectance: Reflectance = 1.0, gains: Sequence[float] | None = None
    ) -> Distances:
        """Return how far away things are by the infrared sensors, m; infinite where nothing is near.

        What a sensor read at least since the link was opened counts as nothing near. So a robot that begins beside a
        wall sees it only after it has been away from it, or after :meth:`calibrate_proximity` in an open place. No two
        sensors see a wall alike; ``errors`` says how sure each distance is. An e-puck2 reads its time-of-flight sensor
        too.

        Args:
            reflectance: What the things around send back, 0.05 to 1: 1 is a white wall. As in the files of worlds.
            gains: Factor of each sensor on the usual light, which makes the distances surer: what ``elib fit`` found,
                ``elib.load_profile("robot.toml").infrared_gains``.

        Example:
            >>> robot.distances().nearest
            inf
        """
        return await _look(self, reflectance, gains)

    @action
    async def scan(
        self: Mover,
        *,
        turn_rate: TurnRate = SCAN_RATE,
        reflectance: Reflectance = 1.0,
        gains: Sequence[float] | None = None,
    ) -> Scan:
        """Turn once round on the spot, look around meanwhile, and return a ring of ranges.

        All infrared sensors look in all directions, so the ranges are surer than one of :meth:`distances`, and the
        glitches of a moving e-puck2 do not count. What its infrared sensors do not see, its time-of-flight sensor does.
        It takes 7 s on a quick link.

        Args:
            turn_rate: The fastest turn rate, rad/s, up to 4.86. A slower turn looks more often.
            reflectance: As for :meth:`distances`.
            gains: As for :meth:`distances`.

        Example:
            >>> scan = robot.scan()
            >>> len(scan.ranges), scan.points
            (36, [])
        """
        from elib.link.protocol.distances import scan

        odometry, looks, headings = self.motion.odometry, [], []
        start = odometry.pose.heading - (odometry.right - odometry.left) * METRES_PER_STEP / AXLE

        def note() -> None:
            turned = (odometry.right - odometry.left) * METRES_PER_STEP / AXLE
            headings.append((odometry.pose.time, start + turned))

        async def look() -> None:
            note()
            with contextlib.suppress(ReplyTimeout, RemoteProtocolError, LinkLost):  # the motion knows when to give up
                looks.append(await _look(self, reflectance, gains))

        note()
        looks.append(await _look(self, reflectance, gains))  # standing: nothing turns if an argument is wrong
        async with self.motion.under_way(self, "scan()"):
            await self.motion.turn(self, math.tau, turn_rate, look)
        note()
        return scan(odometry.pose, headings, looks)

    @action
    async def tags(self: Robot, size: TagSize, *, family: str = "16h5") -> list[Tag]:
        """Take a picture and return the AprilTags in it, the nearest first. Needs the extra ``vision``.

        Each has its number, its distance from the camera, m, its bearing, rad, and how sure both are. ``elib tags``
        prints them. A narrower view shows them from farther away: ``robot.set_camera(56, 56, 4, "grey")``.

        Args:
            size: Side of the black square, m, 0.005 to 1.
            family: ``16h5`` or ``36h11``.

        Raises:
            ArgumentError: There is no such family.
            Unsupported: The extra ``vision`` is not installed.

        Example:
            >>> robot.tags(0.06)
            []
        """
        request = Actions.image.spec.request(self.context)
        picture = await self.execute(request, request.timeout)
        return picture.tags(size, family=family)

    @action
    async def neighbours(self: Robot) -> tuple[Neighbour, ...]:
        """Return the robots that this one hears by range and bearing, the nearest first. Only in the simulator.

        It hears up to 0.8 m where nothing is in the way; a lost message leaves its sender out for a tenth of a second.

        Raises:
            Unsupported: The robot is not simulated in this process.

        Example:
            >>> robot = elib.connect("sim://crowd?robots=3&speed=max")
            >>> for other in robot.neighbours():
            ...     print(f"{other.distance:.2f} m, bearing {other.bearing:.1f}")
            0.13 m, bearing 0.2
            0.16 m, bearing -2.2
        """
        await asyncio.sleep(ASKING_TIME)
        return _messenger(self).neighbours()

    @action
    async def send_message(self: Robot, message: bytes) -> None:
        """Say *message*, at most 4 bytes, to all robots around, ten times a second from now on. Only in the simulator.

        Raises:
            ArgumentError: The message is too long.
            Unsupported: The robot is not simulated in this process.

        Example:
            >>> robot.send_message(b"hi")
        """
        await asyncio.sleep(ASKING_TIME)
        _messenger(self).send_message(message)

    @action
    async def text(self: Robot, command: str) -> str:
        """Send any text command and return the lines of its answer, as they came.

        A command without an answer ends in a ReplyTimeout.

        Example:
            >>> robot.text("C")
            'c,3'
        """
        request = text_request(self.context, command)
        return await self.execute(request, request.timeout)

    @action
    async def sleep(self: Robot, seconds: Seconds) -> None:
        """Wait in the robot's time, simulated or real.

        Raises:
            ArgumentError: *seconds* is not a number from 0 to 3600, or up to 1e9 with :func:`elib.really`.

        Example:
            >>> began = robot.time
            >>> robot.sleep(2)
            >>> round(robot.time - began, 3)
            2.0
        """
        await asyncio.sleep(seconds)


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
    """Something that a person can send to a robot: a command of the table, or an action of several."""

    name: str
    doc: str  # its docstring, without the example
    signature: inspect.Signature  # its signature, without `self`
    # name, rule and default of each argument; the rule is None if any text is allowed
    parameters: tuple[tuple[str, Quantity | None, object], ...] = ()
    wheels: WheelEffect = ""  # what it does to the wheels; see Spec

    @property
    def usage(self) -> str:
        """How it is called: ``set_speed(left, right)``, with optional arguments in brackets."""
        names = [name if default is inspect.Parameter.empty else f"[{name}]" for name, _, default in self.parameters]
        return f"{self.name}({', '.join(names)})"

    @property
    def absent(self) -> dict[str, str]:
        """The firmwares that do not have it, with the reason."""
        return {each.name: each.absent[self.name] for each in FIRMWARES.values() if self.name in each.absent}

    def check(self, context: Context, *arguments: object) -> None:
        """Check a call before anything is sent.

        Raises:
            ArgumentError: An argument is wrong on this firmware, or the number of arguments.
            Unsupported: This firmware does not have the command.
        """
        if self.name in SPECS:
            SPECS[self.name].request(context, *arguments)
            return
        getattr(Actions, self.name).check(arguments, {})
        if self.name == Actions.text.name:
            text_request(context, *arguments)  # type: ignore[arg-type]  # it checks the type itself


@functools.cache
def catalogue() -> Mapping[str, CatalogueEntry]:
    """Return what a person can send on its own, by name: the rows of the table in their order, then the actions."""
    found = {
        spec.name: CatalogueEntry(
            spec.name,
            spec.doc,
            spec.signature,
            tuple((each.name, each.quantity, each.default) for each in spec.parameters),
            spec.wheels,
        )
        for spec in SPECS.values()
    }
    for action_ in (Actions.sensors, Actions.text):
        signature = action_.__signature__
        parameters = tuple((each.name, None, each.default) for each in signature.parameters.values())
        found[action_.name] = CatalogueEntry(
            action_.name, without_example(action_.__doc__ or ""), signature, parameters
        )
    return found
