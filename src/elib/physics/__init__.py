"""A two-dimensional world in SI units: no protocol, no asyncio, no clock."""

from elib.physics.body import EpuckModel
from elib.physics.geometry import Box, Colour, Cylinder, Pose, Wall
from elib.physics.scene import Scene
from elib.physics.snapshot import Beam, Lamps, RobotView, Snapshot
from elib.physics.world import World

__all__ = [
    "Beam",
    "Box",
    "Colour",
    "Cylinder",
    "EpuckModel",
    "Lamps",
    "Pose",
    "RobotView",
    "Scene",
    "Snapshot",
    "Wall",
    "World",
]
