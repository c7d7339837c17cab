"""A recorded drive played to a virtual robot: the same calls at the same times, from the same place."""

from __future__ import annotations

import ast
import asyncio
import contextlib
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from elib.emulator.fork import place, recorded_world
from elib.emulator.robotprofile import RobotProfile, write
from elib.emulator.sim import SimTransport
from elib.errors import ArgumentError, ElibError
from elib.protocol.commands import SPECS
from elib.protocol.context import Context
from elib.protocol.raw import text_request
from elib.protocol.table import Request
from elib.recording.reading import Recording
from elib.recording.state import request_again, state_at
from elib.recording.topics import CALLS, OUTCOMES
from elib.robot.aio import Epuck
from elib.robot.polling import polls, sensor_polls
from elib.runner import run_on
from elib.transport import parse_url
from elib.transport.url import Url

WORLDLESS = "there is no world in it: it is of a real robot, or of one with constant readings"
PATIENCE = 5.0
"""s that a call may take; the recorded program's patience is not known."""
SEEDS = 2**64


@dataclass(frozen=True, slots=True)
class Made:
    """A call of the recorded program.

    Attributes:
        time: When it was made, s since the recording began.
        sent: When its bytes were sent, or else when it was made; s since the recording began.
        number: Of the call in the recording.
        command: Its name.
        text: As a person wrote it.
        arguments: Whole numbers of the wire.
    """

    time: float
    sent: float
    number: int
    command: str
    text: str
    arguments: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Played:
    """What came of it.

    Attributes:
        recording: Of the virtual robot.
        numbers: For each call of this recording, in order, its number in the one that was played.
        left_out: Texts of calls that cannot be made again.
        skipped: Readings that were not asked for, for the line was busy until the next call was due.
    """

    recording: Recording
    numbers: tuple[int, ...]
    left_out: tuple[str, ...]
    skipped: int


@contextlib.contextmanager
def played(
    recording: Recording, *, profile: RobotProfile | None = None, world: str | None = None, seed: int | None = None
) -> Iterator[Played]:
    """Play a recorded drive to a virtual robot and record that; the new recording goes when the block ends.

    It begins at the first recorded pose, with boxes, cylinders and other robots where they lay and stood; the others
    stay there. What the program asked is asked at the recorded times, whatever is answered; a reading is skipped where
    the line is busy until the next call is due. Wheels that turned when the recording began are not known to: begin it
    before driving.

    Args:
        recording: Of the drive.
        profile: What the virtual robot is like; a nominal one unless given.
        world: Where it drives; the recorded world unless given.
        seed: Of all noise; another one than was recorded unless given.

    Raises:
        ArgumentError: There is no world, or the robot cannot stand where it was recorded.
        LinkNotFound: There is no such world.
        SimulationError: The world's file breaks a rule.
    """
    with tempfile.TemporaryDirectory(prefix="elib-") as folder:
        url = _url(recording, Path(folder), profile or RobotProfile(), world, seed)
        sent = {
            entry.data["call"]: entry.time - entry.data["round_trip"]
            for entry in recording.entries(OUTCOMES.name)
            if entry.data["round_trip"] is not None
        }
        calls = [
            Made(
                entry.time - recording.began,
                sent.get(entry.data["call"], entry.time) - recording.began,
                entry.data["call"],
                entry.data["command"],
                entry.data["text"],
                tuple(entry.data["arguments"]),
            )
            for entry in recording.entries(CALLS.name)
        ]
        path = Path(folder) / "played.mcap"
        numbers: list[int] = []
        left_out: list[str] = []
        skipped = 0

        async def main(robot: Epuck) -> None:
            transport = robot.session.transport
            assert isinstance(transport, SimTransport)
            try:
                place(transport, state_at(recording, 0.0), is_same_world=world is None, is_exact=True)
            except ArgumentError as error:
                raise ArgumentError(
                    f"the drive of {recording.name} cannot begin there in the simulator: {error.message}",
                    hint="name the world in which it was recorded with --world",
                ) from error
            nonlocal skipped
            with robot.record(path):
                skipped = await _make(robot, calls, numbers, left_out)

        run_on(str(url), main)
        yield Played(Recording(path), tuple(numbers), tuple(left_out), skipped)


def _url(recording: Recording, folder: Path, profile: RobotProfile, world: str | None, seed: int | None) -> Url:
    about = recording.about
    if world is None and not recording.scene:
        raise ArgumentError(
            f"{recording.name} cannot be played in the simulator: {WORLDLESS}",
            hint="name a world like the one it drove in: --world NAME or --world FILE.toml",
        )
    write(profile, folder / "profile.toml")
    name = world or recorded_world(recording, folder)
    if seed is None:
        seed = (int(about.get("seed", "0")) + 1) % SEEDS
    keys = [("speed", "max"), ("firmware", about["firmware"]), ("seed", str(seed))]
    keys.append(("profile", str(folder / "profile.toml")))
    if about.get("url", "").startswith("sim://"):  # a line of another speed is none of the robot's own doing
        keys += [(key, value) for key, value in parse_url(about["url"]).query if key == "baud"]
    if world is None:
        keys += [("robots", about["robots"])] if "robots" in about else []
        index = int(about.get("robot_index", "0"))
        keys += [("robot", str(index + 1))] if index else []
    return Url("sim", name, tuple(keys))


async def _make(robot: Epuck, calls: list[Made], numbers: list[int], left_out: list[str]) -> int:
    """Make the calls at their times, and wait for the last ones; return how many readings were skipped.

    A program asks as fast as its line answers. Where an answer comes later than it did, what is asked next waits, and
    all that follows would be later and later. So a reading that has to wait until the next call was sent is not made:
    wheels are told at the recorded times.
    """
    loop = asyncio.get_running_loop()
    skipped = 0
    began = loop.time()
    under_way: set[asyncio.Task[None]] = set()
    for count, call in enumerate(calls, 1):
        request = request_of(call, robot.context)
        if request is None:
            left_out.append(call.text)
            continue
        await asyncio.sleep(max(0.0, began + call.time - loop.time()))
        if under_way and count < len(calls) and request.only_reads:
            await asyncio.wait(under_way, timeout=max(0.0, began + calls[count].sent - loop.time()))
            if under_way:
                skipped += 1
                continue
        numbers.append(call.number)
        task = loop.create_task(_execute(robot, request))
        under_way.add(task)
        task.add_done_callback(under_way.discard)
        await asyncio.sleep(0)  # so that calls enter the queue in their order
    if under_way:
        await asyncio.wait(under_way)
    return skipped


async def _execute(robot: Epuck, request: Request[Any]) -> None:
    # A refusal or a late answer is in the recording, as anything else is.
    with contextlib.suppress(ElibError):
        await robot.execute(request, max(PATIENCE, 0.0 if request.spec is None else request.spec.timeout))


def _text_in(text: str) -> str:
    """Return the line of ``text('...')``.

    Raises:
        ValueError: There is none.
    """
    try:
        line = ast.literal_eval(text[len("text(") : -1])
    except (RecursionError, MemoryError):  # what the parser says of brackets within brackets within brackets
        raise ValueError("it is nested too deeply") from None
    if not isinstance(line, str):
        raise ValueError(f"{line!r} is no text")
    return line


def request_of(call: Made, context: Context) -> Request[Any] | None:
    """Return the request that a recorded call was; None if that cannot be told."""
    spec = SPECS.get(call.command)
    try:
        if call.text.startswith("text("):
            return text_request(context, _text_in(call.text))
        if call.text == "sensors()":
            requests = (poll.request for poll in sensor_polls(context))
            return next((each for each in requests if each.name == call.command), None)
        if call.text.startswith("watch(") and " more)" not in call.text:
            return polls(call.text[len("watch(") : -1].split(", "), context)[0].request
        return None if spec is None else replace(request_again(spec, call.arguments, context), text=call.text)
    except (ElibError, LookupError, ValueError, SyntaxError):
        return None
