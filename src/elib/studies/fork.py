"""``replay://FILE``, and ``replay://FILE?fork=SECONDS``: a virtual robot that goes on where a recorded one was."""

from __future__ import annotations

import asyncio
import dataclasses
import logging
import math
import tempfile
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from elib.base.body import STEPS_PER_REVOLUTION
from elib.base.errors import ArgumentError, LinkNotFound
from elib.base.rules import Number
from elib.base.timebase import LoopSpeed, Paced, parse_speed, require_speed
from elib.link.protocol.actuators import restoring_calls
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context
from elib.link.protocol.profiles import profile_named
from elib.link.protocol.wifi import STREAM_SENSORS, command_of
from elib.link.transport.base import Transport
from elib.link.transport.url import Scheme, Url, parse_url
from elib.records.reader import Recording
from elib.records.replay import open_recording
from elib.records.state import RobotState, state_at
from elib.simulator.emulator.sim_transport import SimTransport, open_sim
from elib.simulator.physics import Pose, World
from elib.simulator.physics.body import RADIUS
from elib.simulator.worlds.files import source_of

log = logging.getLogger("elib")

DEFAULT_WORLD = "arena"
"""The world in which a real robot's recording goes on, unless another one is named."""
SILENCE = 0.1
"""s without an answer after which the robot has set everything."""
NEAR_STEP, FAR_STEP, PARTS = 0.0005, 0.02, 12
"""m between the places that are tried for a robot, near its own place and further away; and in how many directions."""
MIN_SHIFT = 0.02
"""m by which a robot may stand beside its recorded place without a warning."""
KEPT_KEYS = ("latency", "jitter", "loss", "baud", "quality")
"""Keys of a recorded ``sim://`` URL that describe its link and its robots."""
MOMENT = Number(unit="s")
"""A time of a recording."""
MAX_SPEED = STEPS_PER_REVOLUTION
"""steps/s that a command may ask of a wheel: one revolution a second."""
MAX_SETTING = 5.0
"""s that setting lamps and camera may take."""


async def open_replay(url: Url) -> Transport:
    """Open a recording as a robot: replayed, or with ``fork=SECONDS`` gone on with in the simulator."""
    require_speed(_speed(url))
    if "fork" not in url.keys:
        if "world" in url.keys:
            raise ArgumentError(f"{url}: world goes with fork", hint="replay://FILE?fork=10&world=square")
        return open_recording(url)
    seconds = MOMENT.require(MOMENT.read(url.keys["fork"]), "fork")
    recording = Recording(Path(url.target))
    return await fork(recording, state_at(recording, seconds), world=url.keys.get("world"))


async def fork(recording: Recording, state: RobotState, *, world: str | None = None) -> SimTransport:
    """Return the link to a virtual robot in the state of a recorded one at a moment.

    It stands where the recorded robot stood, or as near as there is room, and drives on at its speed, with its step
    counters, lamps and camera. Movable things and other robots are where they were. A robot that was simulated keeps
    its profile and quality, and the latency, jitter, loss and baud of its link. Noise, charge, and
    whatever was not measured, begin afresh.

    Args:
        recording: The recording of the robot.
        state: Its state at the moment.
        world: The world in which it goes on; the recorded world unless given, or the arena for a robot without one. A
            pose that was not measured counts from where the world's first robot begins.
    """
    about = recording.about
    index = int(about.get("robot_index", "0")) if world is None else 0
    keys = [("firmware", about["firmware"])]
    keys += [(key, about[key]) for key in ("seed", "robots") if world is None and key in about]
    if index:
        keys.append(("robot", str(index + 1)))
    with tempfile.TemporaryDirectory(prefix="elib-") as folder:
        name = world or recorded_world(recording, Path(folder), state.scene)
        keys += _likeness(recording, Path(folder))
        transport = await open_sim(Url("sim", name, tuple(keys)))
    try:
        if transport.codec == "wifi":
            # Every command has all actuators, so the first one of the new connection sets them.
            left, right = (max(-MAX_SPEED, min(MAX_SPEED, speed)) for speed in state.speed)  # the file may be damaged
            memory = dataclasses.replace(state.memory, speed=(left, right))
            transport.last_command = command_of(memory, STREAM_SENSORS)
        else:
            await _set(transport, state, about["firmware"])
        place(transport, state, is_same_world=world is None)
    except BaseException:
        transport.abort()
        raise
    return transport


def _likeness(recording: Recording, folder: Path) -> list[tuple[str, str]]:
    """Return the keys that give the robot and its link the properties they had in the recorded simulation."""
    about = recording.about
    keys = []
    if about.get("url", "").startswith("sim://"):
        keys += [(key, value) for key, value in parse_url(about["url"]).query if key in KEPT_KEYS]
    if about.get("profile"):
        path = folder / "profile.toml"
        path.write_text(about["profile"], encoding="utf-8")
        keys.append(("profile", str(path)))
    return keys


def recorded_world(recording: Recording, folder: Path, scene: str = "") -> str:
    """Return the recorded world: its name, if that still means the same world, else a file.

    Args:
        recording: The recording.
        folder: Where the file is written.
        scene: The world as TOML, if it was rebuilt since the recording began.
    """
    name = recording.about.get("world", DEFAULT_WORLD)
    scene = scene or recording.scene
    if not scene:
        return name
    try:
        if source_of(name)[0] == scene.encode():
            return name
    except LinkNotFound:
        pass
    path = folder / f"{recording.paths[0].stem}.toml"
    path.write_text(scene, encoding="utf-8")
    return str(path)


async def _set(transport: SimTransport, state: RobotState, firmware: str) -> None:
    """Set the robot's lamps and camera over its own line, and drop the answers."""
    context = Context(profile_named(firmware))
    for name, arguments in restoring_calls(state.memory):
        await transport.write(SPECS[name].request(context, *arguments).data)
        end = asyncio.get_running_loop().time() + MAX_SETTING
        while asyncio.get_running_loop().time() < end:
            try:
                async with asyncio.timeout(SILENCE):
                    await transport.read()
            except TimeoutError:
                break


def place(transport: SimTransport, state: RobotState, *, is_same_world: bool, is_exact: bool = False) -> None:
    """Put everything where it was, and let the wheels turn as they did.

    Args:
        transport: The link to the virtual robot.
        state: Where everything was.
        is_same_world: Whether other robots and movable things are those of the recorded world.
        is_exact: Whether the robot must stand where it stood, to 2 cm; otherwise it is put as near as there is room.
    """
    simulation, robot = transport.simulation, transport.robot
    world = simulation.world
    assert world is not None  # the settings named no file of constant readings
    simulation.catch_up()
    robot.emulator.let_world_run(robot.link.now)
    seen = state.world
    if is_same_world and seen is not None:
        put_things(world, seen, is_exact=is_exact)
        for number, (x, y, heading) in enumerate(seen["robots"]):
            if number != robot.index:
                _put(world, number, Pose(x, y, heading))
    _put(world, robot.index, _pose_in(world, robot.index, state), is_exact=is_exact)
    firmware = robot.emulator.firmware
    firmware.variables["speed_left"], firmware.variables["speed_right"] = state.speed
    firmware.ask_speed(*state.speed)
    for motor, steps in zip(firmware.motors, state.steps, strict=True):
        motor.steps = steps


def put_things(world: World, seen: Mapping[str, Any], *, is_exact: bool) -> None:
    """Put boxes and cylinders where they were.

    Raises:
        ArgumentError: There is no room for one, and it must be exact. Otherwise it stays where it is, with a warning.
            The same holds if the recording does not say which boxes were added or removed.
    """
    here = world.snapshot()
    if (len(here.boxes), len(here.cylinders)) != (len(seen["boxes"]), len(seen["cylinders"])):
        unknown = ArgumentError("boxes were added or removed, and the recording does not say which")
        if is_exact:
            raise unknown
        log.warning("%s; all things stand where they stood when it began", unknown.message)
        return
    moves = [
        partial(world.move_box, number, Pose(*place))
        for number, (box, place) in enumerate(zip(here.boxes, seen["boxes"], strict=True))
        if (box.x, box.y, box.angle) != tuple(place)
    ]
    moves += [
        partial(world.move_cylinder, number, *place)
        for number, (post, place) in enumerate(zip(here.cylinders, seen["cylinders"], strict=True))
        if (post.x, post.y) != tuple(place)
    ]
    for move in moves:
        try:
            move()
        except ArgumentError as error:
            if is_exact:
                raise
            log.warning("%s; it stays where it is", error.message)


def _put(world: World, robot: int, pose: Pose, *, is_exact: bool = False) -> None:
    """Put a robot at a pose, or as near as there is room.

    An exact place may be blocked: things that it touches were seen a moment before it, and step counters do not notice
    walls.
    """
    size = world.scene.width, world.scene.depth
    x, y = (min(max(value, RADIUS), extent - RADIUS) for value, extent in zip((pose.x, pose.y), size, strict=True))
    far = math.ceil(math.hypot(*size) / FAR_STEP)
    distances = [step * NEAR_STEP for step in range(int(FAR_STEP / NEAR_STEP))] + [
        step * FAR_STEP for step in range(1, far)
    ]
    refused: ArgumentError | None = None
    for distance in distances:
        for part in range(PARTS if distance else 1):
            angle = pose.heading + math.pi + math.tau * part / PARTS  # backwards first: most obstacles are ahead
            place = dataclasses.replace(
                pose, x=x + distance * math.cos(angle), y=y + distance * math.sin(angle), time=math.nan
            )
            try:
                world.move_robot(robot, place)
            except ArgumentError as error:
                refused = refused or error
                continue
            moved = math.dist((place.x, place.y), (pose.x, pose.y))
            if moved > MIN_SHIFT and is_exact:
                raise refused or ArgumentError(
                    f"the recorded place ({pose.x:.3f}, {pose.y:.3f}) m is not free in this world"
                )
            if moved > MIN_SHIFT:
                log.warning(
                    "the recorded place (%.3f, %.3f) m is not free in this world; the robot goes on %.0f cm beside it",
                    pose.x,
                    pose.y,
                    100 * moved,
                )
            return
    raise refused or ArgumentError("there is no room for the robot in this world")


def _pose_in(world: World, robot: int, state: RobotState) -> Pose:
    """Return where the robot is in the world: the measured pose, or its start moved by its step counters."""
    pose = state.pose
    if state.is_measured:
        return pose
    start = world.pose(robot)
    ahead = complex(math.cos(start.heading), math.sin(start.heading)) * complex(pose.x, pose.y)
    heading = math.remainder(start.heading + pose.heading, math.tau)
    return dataclasses.replace(start, x=start.x + ahead.real, y=start.y + ahead.imag, heading=heading)


def _check(url: Url) -> Url:
    if not url.target:
        raise ArgumentError(f"{str(url)!r} names no file")
    _speed(url)
    return url


def _speed(url: Url) -> LoopSpeed:
    speed = parse_speed(url.keys.get("speed", "real"))
    return speed if "fork" in url.keys or speed == "max" else Paced(1.0 if speed == "real" else speed)


SCHEME = Scheme(open_replay, keys=("speed", "fork", "world"), check=_check, speed=_speed)
"""``replay://FILE``."""
