"""A two-dimensional world in SI units: no protocol, no asyncio, no clock."""

from elib.base.pose import Pose
from elib.simulator.physics.batch import Batch
from elib.simulator.physics.body import EpuckModel
from elib.simulator.physics.controller import Controller
from elib.simulator.physics.defects import Defect
from elib.simulator.physics.episodes import Episodes, Scores
from elib.simulator.physics.fittings import Checkers, Energy, Light, Patch, Print, Sound, Stripe, Zone
from elib.simulator.physics.geometry import Box, Colour, Cylinder, Polygon, Wall
from elib.simulator.physics.records import Records, SensorView
from elib.simulator.physics.scene import Scene
from elib.simulator.physics.snapshot import Beam, Event, Lamps, RobotView, Snapshot
from elib.simulator.physics.task import Randomisation, Task
from elib.simulator.physics.world import World

__all__ = [
    "Batch",
    "Beam",
    "Box",
    "Checkers",
    "Colour",
    "Controller",
    "Cylinder",
    "Defect",
    "Energy",
    "Episodes",
    "EpuckModel",
    "Event",
    "Lamps",
    "Light",
    "Patch",
    "Polygon",
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
    "Zone",
]
