"""Methods that need more than one row of the command table, and the catalogue of everything that can be sent."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import inspect
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Protocol, runtime_checkable

from elib.base.body import AXLE, METRES_PER_STEP, SENSOR_DIRECTIONS
from elib.base.errors import ArgumentError, LinkLost, RemoteProtocolError, ReplyTimeout, Unsupported, about
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context
from elib.link.protocol.profiles import FIRMWARES
from elib.link.protocol.quantities import Quantity, Seconds, TagSize
from elib.link.protocol.raw import text_request
from elib.link.protocol.styles import action
from elib.link.protocol.table import WheelEffect, without_example
from elib.link.protocol.values import Neighbour, Sensors
from elib.link.session import Robot, check_timeout
from elib.robot.motion import Mover
from elib.robot.motions import Motions, TurnRate, checked
from elib.robot.polling import polls, sensor_polls

if TYPE_CHECKING:
    from elib.link.protocol.distances import Distances, Scan
    from elib.link.protocol.tags import Tag

ASKING_TIME = 0.002
"""s that a question about neighbours takes, like a short command on the line. Without it, simulated time would stand
still for a program that asks nothing else."""

SCAN_RATE = 1.0
"""rad/s: a link that takes 0.08 s for a look then lets each sensor look twice in each direction of a scan."""

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


async def _look(robot: Robot, reflectance: float, gains: Sequence[float] | None) -> Distances:
    """Read the sensors that measure distances."""
    from elib.link.protocol.distances import OpenAir, distances  # here: most programs read counts

    reflects = checked(Reflectance, "reflectance", reflectance)
    if gains is not None and len(gains) != len(SENSOR_DIRECTIONS):
        raise ArgumentError(f"gains has {len(gains)} numbers; it must have 8, one for each infrared sensor")
    context, found = robot.context, dict[str, Any]()
    names = [name for name in ("proximity", "distance") if name not in context.profile.absent]
    for poll in polls(names, context, "distances()"):
        answer = await robot.execute(poll.request, poll.request.timeout)
        found |= poll.readings(answer)
    context.open_air = context.open_air or OpenAir()
    near = context.open_air(found["proximity"])
    return distances(near, gains=gains, reflectance=reflects, flight=found.get("distance"))


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

        fastest = checked(TurnRate, "turn_rate", turn_rate)
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
            await self.motion.turn(self, math.tau, fastest, look)
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
        side = checked(TagSize, "size", size)
        request = Actions.image.spec.request(self.context)
        picture = await self.execute(request, request.timeout)
        return picture.tags(side, family=family)

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
        await asyncio.sleep(check_timeout(seconds, "the time to sleep"))


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
    """Something that a person can send to a robot: a command of the table, or an action of several.

    Attributes:
        name: The name of the method.
        doc: Its docstring, without the example.
        signature: Its signature, without ``self``.
        parameters: Name, rule and default of each argument; the rule is None if any text is allowed.
        wheels: What it does to the wheels; see :class:`~elib.link.protocol.table.Spec`.
    """

    name: str
    doc: str
    signature: inspect.Signature
    parameters: tuple[tuple[str, Quantity | None, object], ...] = ()
    wheels: WheelEffect = ""

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
