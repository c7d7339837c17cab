"""The path of a robot: from the world if it is simulated here, else from its step counters."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Sequence
from itertools import pairwise

from elib.emulator.sim_transport import SimTransport
from elib.emulator.simulation import Simulation
from elib.errors import ReplyTimeout
from elib.physics import Pose, RobotView, Snapshot
from elib.physics.body import RADIUS
from elib.physics.geometry import Solid
from elib.robot.aio import Epuck

MARGIN = 0.10
"""m of free floor around a path whose surroundings are unknown."""
SMALLEST_FLOOR = 0.5
"""m, so that a robot that hardly moved is not drawn as large as the picture."""


def simulation_of(robot: Epuck) -> tuple[Simulation | None, int]:
    """Return the simulation in this process that an open robot is in, and its index there; None without a world."""
    transport = robot.session.transport
    if isinstance(transport, SimTransport) and transport.simulation.world is not None:
        return transport.simulation, transport.robot.index
    return None, 0


def length(poses: Sequence[Pose]) -> float:
    """Return the length of a path, m."""
    return math.fsum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in pairwise(poses))


class Track:
    """The path of a robot: its true one in a simulation of this process, else the one by its step counters.

    The counters count issued steps: they see neither slip nor that the robot was blocked (e-puck.md, 1).

    Args:
        robot: An open robot.
        simulation: The simulation that it is in, or None.
        index: Its index in the simulation.

    Attributes:
        poses: The poses of the robot, oldest first.
        is_true: Whether the poses are those of the simulation.
        period: Robot time between two samples, s.
        closest: The smallest distance of its body from anything so far, m; infinite if that is unknown.
        contact: Time in which it touched something, s, to one sample.
    """

    def __init__(self, robot: Epuck, simulation: Simulation | None = None, index: int = 0) -> None:
        self.poses: list[Pose] = []
        self.is_true = simulation is not None
        self.period = 0.1 if self.is_true else 0.2
        self.closest = math.inf
        self.contact = 0.0
        self._robot = robot
        self._simulation = simulation
        self._index = index

    async def sample(self) -> None:
        """Add the pose of the robot now; if no answer comes it adds nothing, and no distance is lost."""
        if self._simulation is None:
            with contextlib.suppress(ReplyTimeout):
                self.poses.append(await self._robot.pose())
            return
        snapshot, _ = self.floor()
        self.poses.append(snapshot.robots[self._index].pose)
        self.closest = min(self.closest, clearance(snapshot, self._index))
        if snapshot.robots[self._index].touching:
            self.contact += self.period

    def floor(self) -> tuple[Snapshot, list[Pose]]:
        """Return the surroundings with the robot as it stands now, and the path in their coordinates."""
        if self._simulation is None:
            snapshot, [trail] = floor_around([self.poses], "odometry")
            return snapshot, trail
        self._simulation.catch_up()
        assert self._simulation.world is not None
        return self._simulation.world.snapshot(), self.poses


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
