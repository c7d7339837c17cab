"""The path of a robot: from the world if it is simulated here, else from its step counters."""

from __future__ import annotations

import contextlib
import math

from elib.base.errors import ReplyTimeout
from elib.robot.aio import Epuck
from elib.simulator.emulator.simulation import Simulation
from elib.simulator.physics import Pose, Snapshot
from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.geometry import Solid
from elib.studies.drive import floor_around


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
