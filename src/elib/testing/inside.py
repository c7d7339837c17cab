"""Access to what is behind a robot that is simulated in this process: its link, its emulator, its world."""

from __future__ import annotations

from elib.base.errors import ArgumentError
from elib.robot.aio import Epuck
from elib.robot.blocking import BlockingEpuck
from elib.simulator.emulator.emulator import Emulator
from elib.simulator.emulator.link import Link
from elib.simulator.emulator.sim_transport import SimTransport
from elib.simulator.emulator.simulated_hardware import SimulatedHardware
from elib.simulator.emulator.simulation import Simulation
from elib.simulator.physics import World

AnyEpuck = Epuck | BlockingEpuck
"""A robot of :func:`elib.open`, :func:`elib.connect`, :func:`elib.reconnecting`, or a member of a swarm."""


def link_of(robot: AnyEpuck) -> Link:
    """Return the link between a simulated robot and the program; it can lose answers, stall, or be cut.

    Args:
        robot: Opened with ``sim://``. Use the link of a blocking one only while no call runs.

    Raises:
        ArgumentError: The robot is not simulated in this process.
        LinkClosed: The robot is not open yet.
    """
    return transport_of(robot).robot.link


def world_of(robot: AnyEpuck) -> World:
    """Return the world that a simulated robot stands in.

    The world advances when a robot in it is talked to; ``simulation_of(robot).catch_up()`` brings it up to now.

    Args:
        robot: Opened with ``sim://``.

    Raises:
        ArgumentError: The robot is not simulated in this process, or has constant readings instead of a world.
        LinkClosed: The robot is not open yet.
    """
    world = simulation_of(robot).world
    if world is None:
        raise _constant(robot)
    return world


def simulation_of(robot: AnyEpuck) -> Simulation:
    """Return the simulation of a robot: its world, all robots in it, and their common time.

    Args:
        robot: Opened with ``sim://``.

    Raises:
        ArgumentError: The robot is not simulated in this process.
        LinkClosed: The robot is not open yet.
    """
    return transport_of(robot).simulation


def hardware_of(robot: AnyEpuck) -> SimulatedHardware:
    """Return the hardware of a simulated robot, to do what a person does to a real one: ``press_button()``.

    Args:
        robot: Opened with ``sim://``.

    Raises:
        ArgumentError: The robot is not simulated in this process, or has constant readings instead of a world.
        LinkClosed: The robot is not open yet.
    """
    hardware = transport_of(robot).robot.hardware
    if not isinstance(hardware, SimulatedHardware):
        raise _constant(robot)
    return hardware


def emulator_of(robot: AnyEpuck) -> Emulator:
    """Return the emulator of a simulated robot: its program, with motors, lamps and memory.

    Args:
        robot: Opened with ``sim://``.

    Raises:
        ArgumentError: The robot is not simulated in this process.
        LinkClosed: The robot is not open yet.
    """
    return transport_of(robot).robot.emulator


def transport_of(robot: AnyEpuck) -> SimTransport:
    """Return the transport of a simulated robot.

    Raises:
        ArgumentError: The robot is not simulated in this process.
        LinkClosed: The robot is not open yet.
    """
    transport = (robot.robot if isinstance(robot, BlockingEpuck) else robot).session.transport
    if not isinstance(transport, SimTransport):
        raise ArgumentError(f"{robot.url} is not simulated in this process", hint='open "sim://?speed=max"')
    return transport


def _constant(robot: AnyEpuck) -> ArgumentError:
    return ArgumentError(f"{robot.url} has constant readings and no world", hint="leave hardware= out of the URL")
