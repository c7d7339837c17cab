"""The path of a robot: from the world if it is simulated here, else from its wheel encoders."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Protocol

from elib.body import wrapped
from elib.emulator.sim_transport import SimTransport
from elib.emulator.simulation import Simulation
from elib.errors import ReplyTimeout
from elib.physics import Pose, RobotView, Snapshot
from elib.physics.body import RADIUS
from elib.physics.geometry import Solid
from elib.pose import advanced
from elib.protocol.values import Steps
from elib.robot.aio import Epuck

MARGIN = 0.10
"""m of free floor around a path whose surroundings are unknown."""
SMALLEST_FLOOR = 0.5
"""m, so that a robot that hardly moved is not drawn as large as the picture."""


class Track(Protocol):
    """A path that grows.

    Attributes:
        poses: The poses of the robot, oldest first.
        period: Robot time between two samples, s.
        source: Where the path comes from, in a few words.
    """

    poses: list[Pose]
    period: float
    source: str

    async def sample(self) -> None:
        """Add the pose of the robot now."""
        ...

    def floor(self) -> tuple[Snapshot, list[Pose]]:
        """Return the surroundings with the robot as it stands, and the path in their coordinates."""
        ...


def simulation_of(robot: Epuck) -> tuple[Simulation | None, int]:
    """Return the simulation in this process that an open robot is in, and its index there; None without a world."""
    transport = robot.session.transport
    if isinstance(transport, SimTransport) and transport.simulation.world is not None:
        return transport.simulation, transport.robot.index
    return None, 0


def track_of(robot: Epuck) -> Track:
    """Return the track of an open robot, still empty."""
    simulation, index = simulation_of(robot)
    return OdometryTrack(robot) if simulation is None else TrueTrack(simulation, index)


def length(poses: Sequence[Pose]) -> float:
    """Return the length of a path, m."""
    return math.fsum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in pairwise(poses))


class TrueTrack:
    """The true path of a robot of a simulation in this process.

    Attributes:
        closest: The smallest distance of its body from anything so far, m.
        contact: Time in which it touched something, s, to one sample.
    """

    period = 0.1
    source = "the simulated world"

    def __init__(self, simulation: Simulation, robot: int = 0) -> None:
        self.poses: list[Pose] = []
        self.closest = math.inf
        self.contact = 0.0
        self._simulation = simulation
        self._robot = robot

    async def sample(self) -> None:
        """Add the pose of the robot now."""
        snapshot, _ = self.floor()
        self.poses.append(snapshot.robots[self._robot].pose)
        self.closest = min(self.closest, clearance(snapshot, self._robot))
        if snapshot.robots[self._robot].touching:
            self.contact += self.period

    def floor(self) -> tuple[Snapshot, list[Pose]]:
        """Return the world as it is now, and the path."""
        self._simulation.catch_up()
        assert self._simulation.world is not None
        return self._simulation.world.snapshot(), self.poses


class OdometryTrack:
    """The path by a robot's wheel encoders, from the place where it stood first, looking along x.

    The encoders count issued steps: they see neither slip nor that the robot was blocked (e-puck.md, 1).
    """

    period = 0.2
    source = "the wheel encoders"

    def __init__(self, robot: Epuck) -> None:
        self.poses: list[Pose] = []
        self._robot = robot
        self._before: Steps | None = None

    async def sample(self) -> None:
        """Ask for the encoders and add the pose by them; a lost answer adds nothing, and no distance is lost."""
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

    def floor(self) -> tuple[Snapshot, list[Pose]]:
        """Return a free floor around the path with the robot at its end, and the path on it."""
        snapshot, [trail] = floor_around([self.poses], "odometry")
        return snapshot, trail


def floor_around(paths: Sequence[Sequence[Pose]], name: str) -> tuple[Snapshot, list[list[Pose]]]:
    """Return a free floor around paths in unknown surroundings, with the robots at their ends, and the paths on it.

    Args:
        paths: The paths.
        name: Name of the floor.
    """
    poses = [pose for path in paths for pose in path] or [Pose(0.0, 0.0)]
    left, below = MARGIN - min(pose.x for pose in poses), MARGIN - min(pose.y for pose in poses)
    moved = [[dataclasses.replace(pose, x=pose.x + left, y=pose.y + below) for pose in path] for path in paths]
    width = max(left + MARGIN + max(pose.x for pose in poses), SMALLEST_FLOOR)
    depth = max(below + MARGIN + max(pose.y for pose in poses), SMALLEST_FLOOR)
    robots = tuple(RobotView(path[-1]) for path in moved if path)
    return Snapshot(name, 0, 0.0, width, depth, robots=robots), moved


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
