"""``replay://FILE``, and ``replay://FILE?fork=SECONDS``: a virtual robot that goes on where a recorded one was."""

from __future__ import annotations

import asyncio
import dataclasses
import math
import tempfile
from pathlib import Path

from elib.emulator.sim import SimTransport, open_sim
from elib.errors import ArgumentError, LinkNotFound
from elib.physics import Pose, World
from elib.physics.worldfile import source_of
from elib.protocol.commands import SPECS
from elib.protocol.context import Context
from elib.protocol.profiles import profile_named
from elib.protocol.restoring import restoring_calls
from elib.recording.reading import Recording
from elib.recording.replay import open_recording
from elib.recording.state import RobotState, state_at
from elib.timebase import require_speed
from elib.transport.base import Transport
from elib.transport.url import Url, speed_of

DEFAULT_WORLD = "arena"
"""Where a real robot's recording goes on, unless a world is named."""
SILENCE = 0.1
"""s without an answer after which the robot has set everything."""
NUDGE, ROOM, PARTS = 0.0005, 40, 8
"""m, and how many of them, by which a robot may be put beside its place, in so many directions."""
LONGEST_SETTING = 5.0
"""s that setting lamps and camera may take."""


async def open_replay(url: Url) -> Transport:
    """Open a recording as a robot: replayed, or with ``fork=SECONDS`` gone on with in the simulator.

    Raises:
        ArgumentError: There is no such file, it is no recording, or the moment is outside it.
        Unsupported: The package mcap is not installed.
        LinkBusy: It is being replayed on this event loop.
        LinkNotFound: The link was down at this time of the recording, or there is no such world.
        SimulationError: The running event loop cannot run at the speed asked for.
    """
    require_speed(speed_of(url))
    if "fork" not in url.keys:
        return open_recording(url)
    try:
        seconds = float(url.keys["fork"])
    except ValueError:
        seconds = math.nan
    if not math.isfinite(seconds):
        raise ArgumentError(f"fork is {url.keys['fork']!r}; it must be a number of seconds")
    recording = Recording(Path(url.target))
    return await fork(recording, state_at(recording, seconds), world=url.keys.get("world"))


async def fork(recording: Recording, state: RobotState, *, world: str | None = None) -> SimTransport:
    """Return the link to a virtual robot that is what the recorded one was at a moment.

    It stands where that stood and drives on as that did, with its step counters, lamps and camera; things that can be
    moved lie where they lay, and other robots stand where they were. Noise, charge, and what nobody measured, begin
    anew.

    Args:
        recording: Of the robot.
        state: At the moment.
        world: Where it goes on; the recorded world unless given, or the arena for a robot without one. A pose that
            was not measured counts from where the world's first robot begins.

    Raises:
        LinkNotFound: There is no such world.
        SimulationError: The world's file breaks a rule.
    """
    about = recording.about
    index = int(about.get("robot_index", "0")) if world is None else 0
    keys = [("firmware", about["firmware"])]
    keys += [(key, about[key]) for key in ("seed", "robots") if world is None and key in about]
    if index:
        keys.append(("robot", str(index + 1)))
    with tempfile.TemporaryDirectory(prefix="elib-") as folder:
        name = world or recorded_world(recording, Path(folder))
        transport = await open_sim(Url("sim", name, tuple(keys)))
    try:
        await _set(transport, state, about["firmware"])
        place(transport, state, is_same_world=world is None)
    except BaseException:
        transport.abort()
        raise
    return transport


def recorded_world(recording: Recording, folder: Path) -> str:
    """Return the recorded world: by its name, if that still means the same, else as a file."""
    name = recording.about.get("world", DEFAULT_WORLD)
    if not recording.scene:
        return name
    try:
        if source_of(name)[0] == recording.scene.encode():
            return name
    except LinkNotFound:
        pass
    path = folder / f"{recording.paths[0].stem}.toml"
    path.write_text(recording.scene, encoding="utf-8")
    return str(path)


async def _set(transport: SimTransport, state: RobotState, firmware: str) -> None:
    """Let the robot set its lamps and camera, over its own line; the answers are dropped."""
    context = Context(profile_named(firmware))
    for name, arguments in restoring_calls(state.memory):
        await transport.write(SPECS[name].request(context, *arguments).data)
        end = asyncio.get_running_loop().time() + LONGEST_SETTING
        while asyncio.get_running_loop().time() < end:
            try:
                async with asyncio.timeout(SILENCE):
                    await transport.read()
            except TimeoutError:
                break


def place(transport: SimTransport, state: RobotState, *, is_same_world: bool) -> None:
    """Put everything where it was, and let the wheels go on as they went."""
    simulation, robot = transport.simulation, transport.robot
    world = simulation.world
    assert world is not None  # the settings named no file of constant readings
    simulation.catch_up()
    robot.emulator.let_pass(robot.link.now)
    seen = state.world
    if is_same_world and seen is not None:
        for number, (x, y, angle) in enumerate(seen["boxes"]):
            world.move_box(number, Pose(x, y, angle))
        for number, (x, y) in enumerate(seen["cylinders"]):
            world.move_cylinder(number, x, y)
        for number, (x, y, heading) in enumerate(seen["robots"]):
            if number != robot.index:
                _put(world, number, Pose(x, y, heading))
    _put(world, robot.index, _pose_in(world, robot.index, state))
    firmware = robot.emulator.firmware
    firmware.variables["speed_left"], firmware.variables["speed_right"] = state.speed
    firmware.ask_speed(*state.speed)
    for motor, steps in zip(firmware.motors, state.steps, strict=True):
        motor.steps = steps


def _put(world: World, robot: int, pose: Pose) -> None:
    """Put a robot at a pose, or as near as there is room: what touches it was seen a moment before it.

    Raises:
        ArgumentError: There is no room within 2 cm.
    """
    for ring in range(ROOM + 1):
        for part in range(PARTS if ring else 1):
            angle = pose.heading + math.pi + math.tau * part / PARTS  # back first: most things are met ahead
            x, y = pose.x + ring * NUDGE * math.cos(angle), pose.y + ring * NUDGE * math.sin(angle)
            try:
                world.move_robot(robot, dataclasses.replace(pose, x=x, y=y))
            except ArgumentError:
                if ring == ROOM and part == PARTS - 1:
                    raise
            else:
                return


def _pose_in(world: World, robot: int, state: RobotState) -> Pose:
    """Return where the robot is in the world: measured, or as far from its start as its step counters say."""
    pose = state.pose
    if state.is_measured:
        return pose
    start = world.pose(robot)
    ahead = complex(math.cos(start.heading), math.sin(start.heading)) * complex(pose.x, pose.y)
    heading = math.remainder(start.heading + pose.heading, math.tau)
    return dataclasses.replace(start, x=start.x + ahead.real, y=start.y + ahead.imag, heading=heading)


__all__ = ["fork", "open_replay", "place", "recorded_world"]
