"""Where a robot was: from the world if it is simulated here, else from its wheel encoders."""

from __future__ import annotations

import dataclasses
import math
from itertools import pairwise
from typing import Protocol

from elib.body import wrapped
from elib.emulator.sim import SimTransport
from elib.emulator.simulation import Simulation
from elib.errors import ReplyTimeout
from elib.physics import Pose, RobotView, Snapshot, World
from elib.physics.body import RADIUS
from elib.physics.geometry import Solid
from elib.pose import advanced
from elib.protocol.values import Steps
from elib.robot.aio import Epuck

MARGIN = 0.10
"""m of free floor around a path whose surroundings nobody knows."""
SMALLEST_FLOOR = 0.5
"""m, so that a robot that hardly moved is not drawn as large as the picture."""


class Track(Protocol):
    """A path that grows.

    Attributes:
        poses: Where the robot was, oldest first.
        period: s of robot time between two samples.
        source: In a few words, where the path comes from.
    """

    poses: list[Pose]
    period: float
    source: str

    async def sample(self) -> None:
        """Add where the robot is now."""
        ...

    def snapshot(self) -> Snapshot:
        """Return the surroundings and the robot as it stands."""
        ...

    def trail(self) -> list[Pose]:
        """Return the path in the snapshot's coordinates."""
        ...


def track_of(robot: Epuck) -> Track:
    """Return the track of an open robot, still empty."""
    transport = robot.session.transport
    if isinstance(transport, SimTransport) and transport.simulation.world is not None:
        return TrueTrack(transport.simulation, transport.simulation.world, transport.robot.index)
    return OdometryTrack(robot)


def length(poses: list[Pose]) -> float:
    """Return the length of a path, m."""
    return math.fsum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in pairwise(poses))


class TrueTrack:
    """The true path of a robot of a simulation in this process.

    Attributes:
        closest: The smallest distance of its body from anything so far, m.
        contact: s in which it touched something, to one sample.
    """

    period = 0.1
    source = "the simulated world"

    def __init__(self, simulation: Simulation, world: World, robot: int = 0) -> None:
        self.poses: list[Pose] = []
        self.closest = math.inf
        self.contact = 0.0
        self._simulation = simulation
        self._world = world
        self._robot = robot

    async def sample(self) -> None:
        """Add where the robot is now."""
        snapshot = self.snapshot()
        self.poses.append(snapshot.robots[self._robot].pose)
        self.closest = min(self.closest, clearance(snapshot, self._robot))
        if snapshot.robots[self._robot].touching:
            self.contact += self.period

    def snapshot(self) -> Snapshot:
        """Return the world as it is now."""
        self._simulation.catch_up()
        return self._world.snapshot()

    def trail(self) -> list[Pose]:
        """Return the path."""
        return self.poses


class OdometryTrack:
    """The path that a robot's wheel encoders tell, from the place where it stood first, looking along x.

    The encoders count issued steps: they see neither slip nor that the robot was blocked (robot-model, 2.1).
    """

    period = 0.2
    source = "the wheel encoders"

    def __init__(self, robot: Epuck) -> None:
        self.poses: list[Pose] = []
        self._robot = robot
        self._before: Steps | None = None

    async def sample(self) -> None:
        """Ask for the encoders and add where the robot is by them; a lost answer adds nothing and loses no way."""
        try:
            steps = await self._robot.encoders()
        except ReplyTimeout:
            return
        before, self._before = self._before, steps
        if before is None:
            self.poses.append(Pose(0.0, 0.0, 0.0))
            return
        self.poses.append(
            advanced(self.poses[-1], wrapped(steps.left - before.left), wrapped(steps.right - before.right))
        )

    def snapshot(self) -> Snapshot:
        """Return a free floor around the path, and the robot at its end."""
        trail = self.trail()
        width = max((pose.x for pose in trail), default=0.0) + MARGIN
        depth = max((pose.y for pose in trail), default=0.0) + MARGIN
        robots = (RobotView(trail[-1]),) if trail else ()
        return Snapshot("odometry", 0, 0.0, max(width, SMALLEST_FLOOR), max(depth, SMALLEST_FLOOR), robots=robots)

    def trail(self) -> list[Pose]:
        """Return the path, moved to where the snapshot's floor begins."""
        left = MARGIN - min((pose.x for pose in self.poses), default=0.0)
        below = MARGIN - min((pose.y for pose in self.poses), default=0.0)
        return [dataclasses.replace(pose, x=pose.x + left, y=pose.y + below) for pose in self.poses]


def clearance(snapshot: Snapshot, robot: int = 0) -> float:
    """Return the distance of a robot's body from the nearest thing, m; 0 where it touches."""
    pose = snapshot.robots[robot].pose
    others = [other for index, other in enumerate(snapshot.robots) if index != robot]
    x, y = pose.x, pose.y
    distances = [x, snapshot.width - x, y, snapshot.depth - y]
    solids: list[Solid] = [*snapshot.walls, *snapshot.boxes, *snapshot.cylinders]
    distances += [solid.distance(x, y) for solid in solids]
    distances += [math.hypot(x - other.pose.x, y - other.pose.y) - other.radius for other in others]
    return max(0.0, min(distances) - RADIUS)
