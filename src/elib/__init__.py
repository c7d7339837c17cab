"""Drive an e-puck robot, real or virtual, from Python."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from elib.discovery import Found, find
    from elib.errors import (
        ArgumentError,
        CommandRejected,
        ElibError,
        LinkBusy,
        LinkClosed,
        LinkDenied,
        LinkError,
        LinkLost,
        LinkNotFound,
        LocalProtocolError,
        MotionBusy,
        MotionError,
        MotionInterrupted,
        NotAnEpuck,
        ProtocolError,
        RemoteProtocolError,
        ReplayDiffers,
        ReplyTimeout,
        RobotSilent,
        SimulationError,
        SimulationStalled,
        SwarmError,
        Unsupported,
    )
    from elib.physics.batch import Batch
    from elib.physics.body import EpuckModel
    from elib.physics.controller import Controller
    from elib.physics.scene import Scene
    from elib.physics.world import World
    from elib.pose import Pose
    from elib.protocol.image import Image, Mounting
    from elib.protocol.quantities import CameraMode, LedAction, ProximityRate
    from elib.protocol.styles import Outcomes
    from elib.protocol.values import (
        Acceleration,
        AmbientLight,
        AngularVelocity,
        Attitude,
        Battery,
        Button,
        CameraSettings,
        Distance,
        Ground,
        IrCode,
        MagneticField,
        Microphones,
        Proximity,
        SdCard,
        Selector,
        Sensors,
        Steps,
        Temperature,
        Version,
        Wheels,
    )
    from elib.robot.aio import Epuck, open  # noqa: A004  # elib.open is the name users read
    from elib.robot.blocking import BeginEpuck, BlockingEpuck, CallbackEpuck, Pending, connect
    from elib.robot.events import LateAnswer, LinkBack, LinkDown, RobotEvent, UnexpectedReset
    from elib.robot.reconnecting import Reconnecting, reconnecting
    from elib.robot.snapshot import Snapshot
    from elib.robot.waiting import wait
    from elib.robot.watching import BlockingWatch, Watch
    from elib.runner import robot_url, robot_urls, run
    from elib.session.statistics import LinkStats
    from elib.swarms.swarm import Swarm, swarm

__version__ = "0.1.0"

_NAMES = {
    "elib.discovery": "Found find",
    "elib.errors": (
        "ArgumentError CommandRejected ElibError LinkBusy LinkClosed LinkDenied LinkError LinkLost "
        "LinkNotFound LocalProtocolError NotAnEpuck ProtocolError RemoteProtocolError ReplyTimeout "
        "MotionBusy MotionError MotionInterrupted ReplayDiffers RobotSilent SimulationError SimulationStalled "
        "SwarmError Unsupported"
    ),
    "elib.physics.batch": "Batch",
    "elib.physics.body": "EpuckModel",
    "elib.physics.controller": "Controller",
    "elib.physics.scene": "Scene",
    "elib.physics.world": "World",
    "elib.pose": "Pose",
    "elib.protocol.styles": "Outcomes",
    "elib.protocol.image": "Image Mounting",
    "elib.protocol.quantities": "CameraMode LedAction ProximityRate",
    "elib.protocol.values": (
        "Acceleration AmbientLight AngularVelocity Attitude Battery Button CameraSettings Distance Ground "
        "IrCode MagneticField Microphones Proximity SdCard Selector Sensors Steps Temperature Version Wheels"
    ),
    "elib.robot.aio": "Epuck open",
    "elib.robot.blocking": "BeginEpuck BlockingEpuck CallbackEpuck Pending connect",
    "elib.robot.events": "LateAnswer LinkBack LinkDown RobotEvent UnexpectedReset",
    "elib.robot.snapshot": "Snapshot",
    "elib.robot.waiting": "wait",
    "elib.robot.watching": "BlockingWatch Watch",
    "elib.robot.reconnecting": "Reconnecting reconnecting",
    "elib.session.statistics": "LinkStats",
    "elib.runner": "robot_url robot_urls run",
    "elib.swarms.swarm": "Swarm swarm",
}
"""Where each public name lives. A module is imported when its first name is asked for, so that ``import elib`` and
``elib --version`` cost next to nothing."""
_HOMES = {name: module for module, names in _NAMES.items() for name in names.split()}


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'elib' has no attribute {name!r}")
    import importlib

    value = globals()[name] = getattr(importlib.import_module(_HOMES[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


__all__ = [
    "Acceleration",
    "AmbientLight",
    "AngularVelocity",
    "ArgumentError",
    "Attitude",
    "Batch",
    "Battery",
    "BeginEpuck",
    "BlockingEpuck",
    "BlockingWatch",
    "Button",
    "CallbackEpuck",
    "CameraMode",
    "CameraSettings",
    "CommandRejected",
    "Controller",
    "Distance",
    "ElibError",
    "Epuck",
    "EpuckModel",
    "Found",
    "Ground",
    "Image",
    "IrCode",
    "LateAnswer",
    "LedAction",
    "LinkBack",
    "LinkBusy",
    "LinkClosed",
    "LinkDenied",
    "LinkDown",
    "LinkError",
    "LinkLost",
    "LinkNotFound",
    "LinkStats",
    "LocalProtocolError",
    "MagneticField",
    "Microphones",
    "MotionBusy",
    "MotionError",
    "MotionInterrupted",
    "Mounting",
    "NotAnEpuck",
    "Outcomes",
    "Pending",
    "Pose",
    "ProtocolError",
    "Proximity",
    "ProximityRate",
    "Reconnecting",
    "RemoteProtocolError",
    "ReplayDiffers",
    "ReplyTimeout",
    "RobotEvent",
    "RobotSilent",
    "Scene",
    "SdCard",
    "Selector",
    "Sensors",
    "SimulationError",
    "SimulationStalled",
    "Snapshot",
    "Steps",
    "Swarm",
    "SwarmError",
    "Temperature",
    "UnexpectedReset",
    "Unsupported",
    "Version",
    "Watch",
    "Wheels",
    "World",
    "__version__",
    "connect",
    "find",
    "open",
    "reconnecting",
    "robot_url",
    "robot_urls",
    "run",
    "swarm",
    "wait",
]
