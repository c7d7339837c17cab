"""Rerun of a recorded drive on a virtual robot: the same calls at the same times, from the same place."""

from __future__ import annotations

import ast
import asyncio
import contextlib
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from elib.base.errors import ArgumentError, ElibError
from elib.base.tasks import Tasks
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context
from elib.link.protocol.raw import text_request
from elib.link.protocol.table import Request
from elib.link.transport import parse_url
from elib.link.transport.url import Url
from elib.records.reader import Recording
from elib.records.state import request_again, state_at
from elib.records.topics import CALLS, OUTCOMES
from elib.robot.aio import Epuck
from elib.robot.polling import polls, sensor_polls
from elib.robot.runner import run_on
from elib.simulator.emulator.robotprofile import RobotProfile, write
from elib.simulator.emulator.sim_transport import SimTransport
from elib.studies.fork import place, recorded_world

WORLDLESS = "it has no world: it is of a real robot, or of a virtual one with constant readings"
TIMEOUT = 5.0
"""s that a call may take; the timeouts of the recorded program are not known."""
SEEDS = 2**64
"""Number of seeds of a simulation."""


@dataclass(frozen=True, slots=True)
class RecordedCall:
    """A call of the recorded program."""

    time: float  # when the call was made, s since the recording began
    sent: float  # when its bytes were sent, s since the recording began; *time* if they were not
    number: int
    command: str  # name of the command
    text: str  # the call as it is written in a program
    arguments: tuple[int, ...]  # arguments, as whole numbers of the wire


@dataclass(frozen=True, slots=True)
class Rerun:
    """Result of a rerun."""

    recording: Recording
    numbers: tuple[int, ...]  # for each call of this recording, in order, its number in the original recording
    left_out: tuple[str, ...]  # texts of the calls that cannot be made again
    skipped: int  # number of readings that were not asked for because the line was busy until the next call


@contextlib.contextmanager
def rerun(
    recording: Recording, *, profile: RobotProfile | None = None, world: str | None = None, seed: int | None = None
) -> Iterator[Rerun]:
    """Make the calls of a recorded drive again on a virtual robot, and record it.

    The new recording is deleted when the block ends. The drive begins at the first recorded pose, with boxes, cylinders
    and other robots at their recorded places; the other robots do not move. Each call is made at its recorded time,
    whatever the answers are; a reading is skipped if the line is busy until the next call. If wheels turned already
    when the recording began, that is not known: recordings should begin before driving.

    Args:
        recording: Recording of the drive.
        profile: Profile of the virtual robot; a nominal robot unless given.
        world: World in which it drives; the recorded world unless given.
        seed: Seed of all noise; another seed than the recorded one unless given.
    """
    with tempfile.TemporaryDirectory(prefix="elib-") as folder:
        url = _url(recording, Path(folder), profile or RobotProfile(), world, seed)
        sent = {
            entry.data["call"]: entry.time - entry.data["round_trip"]
            for entry in recording.entries(OUTCOMES.name)
            if entry.data["round_trip"] is not None
        }
        calls = [
            RecordedCall(
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
                    f"the drive of {recording.name} cannot begin at its place in the simulator: {error.message}",
                    hint="name the world in which it was recorded: --world NAME",
                ) from error
            nonlocal skipped
            with robot.record(path):
                skipped = await _make(robot, calls, numbers, left_out)

        run_on(str(url), main)
        yield Rerun(Recording(path), tuple(numbers), tuple(left_out), skipped)


def _url(recording: Recording, folder: Path, profile: RobotProfile, world: str | None, seed: int | None) -> Url:
    about = recording.about
    if world is None and not recording.scene:
        raise ArgumentError(
            f"{recording.name} cannot be run again in the simulator: {WORLDLESS}",
            hint="name a world like the one it drove in: --world NAME or --world FILE.toml",
        )
    write(profile, folder / "profile.toml")
    name = world or recorded_world(recording, folder)
    if seed is None:
        seed = (int(about.get("seed", "0")) + 1) % SEEDS
    keys = [("speed", "max"), ("firmware", about["firmware"]), ("seed", str(seed))]
    keys.append(("profile", str(folder / "profile.toml")))
    if about.get("url", "").startswith("sim://"):  # the speed of the line is not a property of the robot
        keys += [(key, value) for key, value in parse_url(about["url"]).query if key == "baud"]
    if world is None:
        keys += [("robots", about["robots"])] if "robots" in about else []
        index = int(about.get("robot_index", "0"))
        keys += [("robot", str(index + 1))] if index else []
    return Url("sim", name, tuple(keys))


async def _make(robot: Epuck, calls: list[RecordedCall], numbers: list[int], left_out: list[str]) -> int:
    """Make the calls at their times and wait for the last ones; return the number of skipped readings.

    Many programs ask as fast as the line answers. If an answer is later than in the recording, the next call waits, and
    all later calls would be later and later. So a reading that would have to wait until the next call was sent is
    skipped, and wheel commands are sent at their recorded times.
    """
    loop = asyncio.get_running_loop()
    skipped = 0
    began = loop.time()
    under_way = Tasks()
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
        under_way.begin(_execute(robot, request), "elib calls again")
        await asyncio.sleep(0)  # calls must enter the queue in their order
    if under_way:
        await asyncio.wait(under_way)
    return skipped


async def _execute(robot: Epuck, request: Request[Any]) -> None:
    # Errors and late answers are in the recording.
    with contextlib.suppress(ElibError):
        await robot.execute(request, max(TIMEOUT, 0.0 if request.spec is None else request.spec.timeout))


def _text_in(text: str) -> str:
    """Return the line of ``text('...')``.

    Raises:
        ValueError: The text is not such a call.
    """
    try:
        line = ast.literal_eval(text[len("text(") : -1])
    except (RecursionError, MemoryError):  # the parser raises these for deeply nested brackets
        raise ValueError("it is nested too deeply") from None
    if not isinstance(line, str):
        raise ValueError(f"{line!r} is not a text")
    return line


def request_of(call: RecordedCall, context: Context) -> Request[Any] | None:
    """Return the request of a recorded call; None if the call cannot be made again."""
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
