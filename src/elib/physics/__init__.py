"""A two-dimensional world in SI units: no protocol, no asyncio, no clock."""

from elib.physics.batch import Batch
from elib.physics.body import EpuckModel
from elib.physics.controller import Controller
from elib.physics.episodes import Episodes, Scores
from elib.physics.fittings import Checkers, Light, Patch, Print, Sound, Stripe
from elib.physics.geometry import Box, Colour, Cylinder, Wall
from elib.physics.records import Records, SensorView
from elib.physics.scene import Scene
from elib.physics.snapshot import Beam, Lamps, RobotView, Snapshot
from elib.physics.task import Randomisation, Task
from elib.physics.world import World
from elib.pose import Pose

__all__ = [
    "Batch",
    "Beam",
    "Box",
    "Checkers",
    "Colour",
    "Controller",
    "Cylinder",
    "Episodes",
    "EpuckModel",
    "Lamps",
    "Light",
    "Patch",
    "Pose",
    "Print",
    "Randomisation",
    "Records",
    "RobotView",
    "Scene",
    "Scores",
    "SensorView",
    "Snapshot",
    "Sound",
    "Stripe",
    "Task",
    "Wall",
    "World",
]
