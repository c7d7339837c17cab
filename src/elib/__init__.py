"""Drive an e-puck robot, real or virtual, from Python."""

from __future__ import annotations

from typing import TYPE_CHECKING

# For type checkers: every public name and the module that it comes from.
if TYPE_CHECKING:
    from elib.base.errors import ArgumentError as ArgumentError
    from elib.base.errors import CallCancelled as CallCancelled
    from elib.base.errors import CommandRejected as CommandRejected
    from elib.base.errors import ElibError as ElibError
    from elib.base.errors import LinkBusy as LinkBusy
    from elib.base.errors import LinkClosed as LinkClosed
    from elib.base.errors import LinkDenied as LinkDenied
    from elib.base.errors import LinkError as LinkError
    from elib.base.errors import LinkLost as LinkLost
    from elib.base.errors import LinkNotFound as LinkNotFound
    from elib.base.errors import LocalProtocolError as LocalProtocolError
    from elib.base.errors import MotionBusy as MotionBusy
    from elib.base.errors import MotionError as MotionError
    from elib.base.errors import MotionInterrupted as MotionInterrupted
    from elib.base.errors import NotAnEpuck as NotAnEpuck
    from elib.base.errors import ProtocolError as ProtocolError
    from elib.base.errors import RemoteProtocolError as RemoteProtocolError
    from elib.base.errors import ReplayDiffers as ReplayDiffers
    from elib.base.errors import ReplyTimeout as ReplyTimeout
    from elib.base.errors import RobotSilent as RobotSilent
    from elib.base.errors import SimulationError as SimulationError
    from elib.base.errors import SimulationStalled as SimulationStalled
    from elib.base.errors import SwarmError as SwarmError
    from elib.base.errors import Unsupported as Unsupported
    from elib.base.fields import really as really
    from elib.base.pose import Pose as Pose
    from elib.behaviours._run.behaviour import behaviour as behaviour
    from elib.behaviours._run.context import RunContext as RunContext
    from elib.behaviours._run.loop import react as react
    from elib.behaviours._run.play import play as play
    from elib.link.protocol.image import Image as Image
    from elib.link.protocol.image import Mounting as Mounting
    from elib.link.protocol.quantities import CameraMode as CameraMode
    from elib.link.protocol.quantities import LedAction as LedAction
    from elib.link.protocol.quantities import ProximityRate as ProximityRate
    from elib.link.protocol.styles import Outcomes as Outcomes
    from elib.link.protocol.styles import Pending as Pending
    from elib.link.protocol.values import Acceleration as Acceleration
    from elib.link.protocol.values import AmbientLight as AmbientLight
    from elib.link.protocol.values import AngularVelocity as AngularVelocity
    from elib.link.protocol.values import Attitude as Attitude
    from elib.link.protocol.values import Battery as Battery
    from elib.link.protocol.values import Button as Button
    from elib.link.protocol.values import CameraSettings as CameraSettings
    from elib.link.protocol.values import Distance as Distance
    from elib.link.protocol.values import Ground as Ground
    from elib.link.protocol.values import IrCode as IrCode
    from elib.link.protocol.values import MagneticField as MagneticField
    from elib.link.protocol.values import Microphones as Microphones
    from elib.link.protocol.values import Neighbour as Neighbour
    from elib.link.protocol.values import Proximity as Proximity
    from elib.link.protocol.values import SdCard as SdCard
    from elib.link.protocol.values import Selector as Selector
    from elib.link.protocol.values import Sensors as Sensors
    from elib.link.protocol.values import Steps as Steps
    from elib.link.protocol.values import Temperature as Temperature
    from elib.link.protocol.values import Version as Version
    from elib.link.protocol.values import Wheels as Wheels
    from elib.link.session.statistics import LinkStats as LinkStats
    from elib.records.et.logtable import read_log as read_log
    from elib.records.reader import read_recording as read_recording
    from elib.robot.aio import Epuck as Epuck
    from elib.robot.aio import connect_async as connect_async
    from elib.robot.aio import open as open  # noqa: A004  # elib.open is the name users read
    from elib.robot.blocking import BeginEpuck as BeginEpuck
    from elib.robot.blocking import BlockingEpuck as BlockingEpuck
    from elib.robot.blocking import CallbackEpuck as CallbackEpuck
    from elib.robot.blocking import connect as connect
    from elib.robot.events import LateAnswer as LateAnswer
    from elib.robot.events import LinkBack as LinkBack
    from elib.robot.events import LinkDown as LinkDown
    from elib.robot.events import RobotEvent as RobotEvent
    from elib.robot.events import UnexpectedReset as UnexpectedReset
    from elib.robot.reconnecting import Reconnecting as Reconnecting
    from elib.robot.reconnecting import reconnecting as reconnecting
    from elib.robot.runner import robot_url as robot_url
    from elib.robot.runner import robot_urls as robot_urls
    from elib.robot.runner import run as run
    from elib.robot.snapshot import Snapshot as Snapshot
    from elib.robot.swarms.swarm import Swarm as Swarm
    from elib.robot.swarms.swarm import swarm as swarm
    from elib.robot.telemetry import BlockingWatch as BlockingWatch
    from elib.robot.telemetry import Watch as Watch
    from elib.robot.waiting import wait as wait
    from elib.simulator.physics.batch import Batch as Batch
    from elib.simulator.physics.body import EpuckModel as EpuckModel
    from elib.simulator.physics.controller import Controller as Controller
    from elib.simulator.physics.scene import Scene as Scene
    from elib.simulator.physics.world import World as World
    from elib.tools.discovery import Found as Found
    from elib.tools.discovery import find as find

__version__ = "0.1.0"

_HOMES = {
    "elib.base.errors": (
        "ArgumentError CallCancelled CommandRejected ElibError LinkBusy LinkClosed LinkDenied LinkError LinkLost "
        "LinkNotFound LocalProtocolError MotionBusy MotionError MotionInterrupted NotAnEpuck ProtocolError "
        "RemoteProtocolError ReplayDiffers ReplyTimeout RobotSilent SimulationError SimulationStalled SwarmError "
        "Unsupported"
    ),
    "elib.base.fields": "really",
    "elib.base.pose": "Pose",
    "elib.behaviours._run.behaviour": "behaviour",
    "elib.behaviours._run.context": "RunContext",
    "elib.behaviours._run.loop": "react",
    "elib.behaviours._run.play": "play",
    "elib.link.protocol.image": "Image Mounting",
    "elib.link.protocol.quantities": "CameraMode LedAction ProximityRate",
    "elib.link.protocol.styles": "Outcomes Pending",
    "elib.link.protocol.values": (
        "Acceleration AmbientLight AngularVelocity Attitude Battery Button CameraSettings Distance Ground IrCode "
        "MagneticField Microphones Neighbour Proximity SdCard Selector Sensors Steps Temperature Version Wheels"
    ),
    "elib.link.session.statistics": "LinkStats",
    "elib.records.et.logtable": "read_log",
    "elib.records.reader": "read_recording",
    "elib.robot.aio": "Epuck connect_async open",
    "elib.robot.blocking": "BeginEpuck BlockingEpuck CallbackEpuck connect",
    "elib.robot.events": "LateAnswer LinkBack LinkDown RobotEvent UnexpectedReset",
    "elib.robot.reconnecting": "Reconnecting reconnecting",
    "elib.robot.runner": "robot_url robot_urls run",
    "elib.robot.snapshot": "Snapshot",
    "elib.robot.swarms.swarm": "Swarm swarm",
    "elib.robot.telemetry": "BlockingWatch Watch",
    "elib.robot.waiting": "wait",
    "elib.simulator.physics.batch": "Batch",
    "elib.simulator.physics.body": "EpuckModel",
    "elib.simulator.physics.controller": "Controller",
    "elib.simulator.physics.scene": "Scene",
    "elib.simulator.physics.world": "World",
    "elib.tools.discovery": "Found find",
}
"""The public names by the module that they come from, which is imported when one of them is first used: so ``import
elib`` and ``elib --version`` are fast. A test compares them with the imports above, which type checkers read."""
_HOME = {name: module for module, names in _HOMES.items() for name in names.split()}
_HIDDEN = {"open", "run"}
"""Names that ``from elib import *`` leaves out: one would hide a built-in function, the other is too common."""


if not TYPE_CHECKING:  # to a type checker, every name would then be there

    def __getattr__(name: str) -> object:
        if name == "__all__":
            return sorted({"__version__", *_HOME} - _HIDDEN)
        if name not in _HOME:
            raise AttributeError(f"module 'elib' has no attribute {name!r}")
        import importlib

        value = globals()[name] = getattr(importlib.import_module(_HOME[name]), name)
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
