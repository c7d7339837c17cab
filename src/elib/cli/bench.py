"""``elib bench``: measure how long each command takes."""

from __future__ import annotations

import math
import statistics
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from operator import methodcaller
from typing import Annotated, TypeVar

from elib.base.errors import ElibError, LinkError, ReplyTimeout
from elib.base.quantiles import quantile
from elib.base.rules import Whole
from elib.cli.arguments import FAST_SIMULATION, AsJson, RobotUrl, option
from elib.cli.recordoptions import NOTHING_KEPT, Kept
from elib.cli.terminal import LiveLine, grid, json_line, table
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.values import Steps
from elib.link.protocol.words import Json
from elib.robot.aio import Epuck
from elib.robot.runner import run_on

COUNT = 20
"""Calls of each command by default: about 20 s over Bluetooth."""
MAX_CALLS = 10_000
FEW = 3
"""Largest number of calls of a command that takes seconds."""
RECOVERY_TIME = 10.0
"""s in which a line must be in sync again after a lost answer; a robot that calibrates is busy for 3.7 s."""

Count = Annotated[int, Whole(1, MAX_CALLS), option("--count N", f"Calls of each command, 1 to {MAX_CALLS}.")]

T = TypeVar("T")
Call = Callable[[Epuck], Awaitable[object]]

USUAL_CAMERA = (40, 40, 8, CameraMode.COLOUR)
"""Width, height, zoom and mode that ``set_camera()`` sets without arguments: the picture that is measured."""


MEASURED: dict[str, tuple[object, ...]] = {
    "set_speed": (0, 0),
    "stop": (),
    "speed": (),
    "set_encoders": (0, 0),
    "encoders": (),
    "proximity": (),
    "ambient_light": (),
    "accelerometer": (),
    "microphones": (),
    "selector": (),
    "ir_receiver": (),
    "set_led": (0, 0),
    "set_body_led": (0,),
    "set_front_led": (0,),
    "set_camera": (),
    "camera": (),
    "image": (),
    "version": (),
    "help_text": (),
    "play_sound": (1,),
    "calibrate_proximity": (),
    "reset": (),
    "sensors": (),
}
"""The commands that are measured, in this order, and their arguments; the step counters are set to what they are."""

DISTURBING = {
    "play_sound": "it makes noise",
    "calibrate_proximity": "it calibrates the sensors",
    "reset": "it restarts the robot",
}
SLOW = ("calibrate_proximity", "reset")


@dataclass(frozen=True, slots=True)
class Result:
    """One command: s from each call to its value, how many had no answer or failed, or why it was not measured."""

    command: str
    times: tuple[float, ...] = field(default=(), repr=False)
    lost: int = 0
    refused: int = 0
    skipped: str = ""

    @property
    def figures(self) -> dict[str, float]:
        """Mean, standard deviation of the sample, and quantiles by the nearest rank, s; nan for too few times."""
        return {
            "mean": statistics.fmean(self.times) if self.times else math.nan,
            "sd": statistics.stdev(self.times) if len(self.times) > 1 else math.nan,
            "p50": quantile(self.times, 0.5),
            "p99": quantile(self.times, 0.99),
        }


@dataclass(slots=True)
class Report:
    """A benchmark as it grows."""

    url: str
    count: int
    firmware: str = ""
    origin: str = ""
    results: list[Result] = field(default_factory=list)


def bench(
    *,
    robot: RobotUrl = FAST_SIMULATION,
    count: Count = COUNT,
    everything: Annotated[bool, option("--all", f"Also sound, calibration and reset ({FEW} calls each).")] = False,
    json: AsJson = False,
    records: Kept = NOTHING_KEPT,
) -> None:
    """Measure how long each command takes.

    The wheels are only told to stand still and the lamps to be off; the camera's settings and the step counters are put
    back. What makes noise, calibrates or restarts the robot is left out unless --all is given. What was measured before
    a failure or Ctrl-C is printed too.

    For example:
        elib bench
        elib bench --robot serial:///dev/rfcomm0 --count 100
    """
    report = Report(robot, count)
    line = LiveLine()

    async def main(epuck: Epuck) -> None:
        report.firmware, report.origin = epuck.firmware, epuck.context.origin
        await run(epuck, report, line, everything=everything)

    try:
        run_on(robot, main, records=records)
    finally:
        line.clear()
        if report.results:
            print(json_line(to_json(report)) if json else to_text(report), flush=True)


async def run(robot: Epuck, report: Report, line: LiveLine, *, everything: bool) -> None:
    """Measure every command into *report*."""
    absent = robot.context.profile.absent
    steps = await _unless_lost(robot.encoders) or Steps(0, 0)
    settings = await _unless_lost(robot.camera)
    for name, arguments in {**MEASURED, "set_encoders": tuple(steps)}.items():
        if name in absent:
            report.results.append(Result(name, skipped=f"{robot.firmware} does not have it: {absent[name]}"))
        elif name in DISTURBING and not everything:
            report.results.append(Result(name, skipped=f"{DISTURBING[name]}; --all measures it"))
        else:
            count = min(report.count, FEW) if name in SLOW else report.count
            report.results.append(await measure(robot, name, methodcaller(name, *arguments), count, line))
    if settings is not None:
        before = (settings.width, settings.height, settings.zoom, CameraMode(settings.mode))
        if before != USUAL_CAMERA:
            await robot.set_camera(*before)


async def measure(robot: Epuck, name: str, call: Call, count: int, line: LiveLine) -> Result:
    """Make *count* calls, one after the other, and time each."""
    times: list[float] = []
    lost = refused = 0
    for number in range(count):
        line.tell(f"{name} {number + 1} of {count}")
        began = robot.time
        try:
            await call(robot)
        except LinkError:
            raise
        except ElibError as error:
            lost += isinstance(error, ReplyTimeout)
            refused += not isinstance(error, ReplyTimeout)
            # Resynchronise the line now, for the next call would take longer.
            await _unless_lost(robot.within(RECOVERY_TIME).selector)
        else:
            times.append(robot.time - began)
    return Result(name, tuple(times), lost, refused)


async def _unless_lost(call: Callable[[], Awaitable[T]]) -> T | None:
    """Return the value of a call; None where the answer is lost or refused."""
    try:
        return await call()
    except LinkError:
        raise
    except ElibError:
        return None


def to_text(report: Report) -> str:
    """Return the report as a table, and what was not measured."""
    heading = ["command", "mean", "sd", "p50", "p99", "lost"]
    measured = [
        [each.command, *(f"{seconds * 1000:.1f}" for seconds in each.figures.values()), str(each.lost + each.refused)]
        for each in report.results
        if not each.skipped
    ]
    parts = [f"{report.url} ({report.firmware}, {report.origin})", ""]
    parts.append(grid(heading, [[cell.replace("nan", "-") for cell in row] for row in measured]))
    if skipped := [(each.command, each.skipped) for each in report.results if each.skipped]:
        parts += ["", "not measured", table(skipped)]
    notes = [f"Times are in ms, of {report.count} calls each."]
    notes += ["p99 of fewer than 100 calls is the slowest."] * (report.count < 100)
    notes += ["These are figures of a simulation."] * (report.origin == "simulator")
    return "\n".join([*parts, "", *notes]).rstrip()


def to_json(report: Report) -> Json:
    """Return the report for JSON, with times in ms."""
    return {
        "robot": report.url,
        "firmware": report.firmware,
        "origin": report.origin,
        "unit": "ms",
        "count": report.count,
        "commands": [
            {
                "command": each.command,
                "calls": len(each.times) + each.lost + each.refused,
                "lost": each.lost,
                "refused": each.refused,
                **{name: round(number * 1000, 4) for name, number in each.figures.items()},
                "skipped": each.skipped or None,
            }
            for each in report.results
        ],
    }
