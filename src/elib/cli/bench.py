"""``elib bench``: measure how long each command takes, and compare it with the thesis of 2011."""

from __future__ import annotations

import math
import statistics
import textwrap
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from operator import methodcaller
from typing import Annotated, TypeVar

from cyclopts import Parameter as Cli

from elib.base.errors import ElibError, LinkError, ReplyTimeout
from elib.base.quantiles import quantile
from elib.base.rules import Whole
from elib.cli.arguments import FAST_SIMULATION, AsJson, RobotUrl
from elib.cli.readings import Json, print_json
from elib.cli.recordoptions import NOTHING_KEPT, Kept
from elib.cli.terminal import LiveLine, columns
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.values import Steps
from elib.robot.aio import Epuck
from elib.robot.runner import run_on

COUNT = 20
"""Calls of each command by default: about 20 s over Bluetooth."""
MAX_CALLS = 10_000
FEW = 3
"""Largest number of calls of a command that takes seconds."""
RECOVERY_TIME = 10.0
"""s in which a line must be in sync again after a lost answer; a robot that calibrates is busy for 3.7 s."""

Count = Annotated[
    int, Whole(1, MAX_CALLS), Cli(name="--count", metavar="N", help=f"Calls of each command, 1 to {MAX_CALLS}.")
]
All = Annotated[bool, Cli(name="--all", help=f"Also sound, calibration and reset ({FEW} calls each).")]

T = TypeVar("T")
Call = Callable[[Epuck], Awaitable[object]]

USUAL_CAMERA = (40, 40, 8, CameraMode.COLOUR)
"""Width, height, zoom and mode that ``set_camera()`` sets without arguments: the picture that the thesis measured."""


@dataclass(frozen=True, slots=True)
class Published:
    """One line of Table 5.1: mean and standard deviation, ms; None where the table has no number.

    Attributes:
        name: Name of the command in the library of 2011.
        weak: Figures with a weak battery, from 6 runs.
        charged: Figures with a charged battery, from 4 runs.
    """

    name: str
    weak: tuple[float, float | None]
    charged: tuple[float, float | None]


SOURCE = "Table 5.1 of the thesis on the C# library Elib (2011): an e-puck1 over Bluetooth, weak and charged battery"

THESIS: Mapping[str, Published] = {
    "set_speed": Published("Motors", (34, 17), (25, 12)),
    "stop": Published("Stop", (24, 6), (27, 13)),
    "speed": Published("GetSpeed", (13, 26), (2, 3)),
    "set_encoders": Published("SetEncoders", (40, 23), (32, 14)),
    "encoders": Published("GetEncoders", (48, 11), (40, 16)),
    "proximity": Published("GetIR", (65, 10), (60, 9)),
    "ambient_light": Published("GetLight", (83, 29), (92, 33)),
    "accelerometer": Published("GetAccelerometer", (70, 9), (64, 9)),
    "microphones": Published("GetMikes", (32, 21), (19, 0)),
    "selector": Published("GetSelector", (75, 54), (50, 0)),
    "ir_receiver": Published("GetIRInfo", (60, 23), (51, 30)),
    "set_led": Published("LightX", (25, 12), (23, 11)),
    "set_body_led": Published("BodyLight", (33, 9), (31, 6)),
    "set_front_led": Published("FrontLight", (31, 4), (30, 6)),
    "set_camera": Published("SetCam", (170, 17), (167, 16)),
    "camera": Published("GetCamParams", (49, 3), (51, 0)),
    "image": Published("GetImage", (307, 34), (312, 84)),
    "version": Published("GetVersion", (42, 17), (57, 23)),
    "help_text": Published("GetHelpInfo", (139, 19), (122, 8)),
    "play_sound": Published("PlaySound", (44, 13), (35, 18)),
    "calibrate_proximity": Published("CalibrateIR", (3696, None), (3692, None)),
    "reset": Published("Reset", (1394, None), (1390, None)),
}
"""Table 5.1, ms; its picture is 40 x 40 in colour, like the one that :func:`bench` takes."""

DISTURBING = {
    "play_sound": "it makes noise",
    "calibrate_proximity": "it calibrates the sensors",
    "reset": "it restarts the robot",
}
SLOW = ("calibrate_proximity", "reset")
EXTRA = ("sensors",)
"""The commands that the thesis did not measure: all sensors at once."""


@dataclass(frozen=True, slots=True)
class Result:
    """The measurements of one command.

    Attributes:
        command: Name of the command.
        times: Time from each call to its value, s.
        lost: Number of calls that had no answer in time.
        refused: Number of calls that failed in another way.
        skipped: Why the command was not measured; empty if it was.
    """

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
    everything: All = False,
    json: AsJson = False,
    records: Kept = NOTHING_KEPT,
) -> None:
    """Measure how long each command takes, beside Table 5.1 of the thesis of 2011.

    The wheels are only told to stand still and the lamps to be off; the camera's settings and the step counters are put
    back. What makes noise, calibrates or restarts the robot is left out unless --all is given. What was measured before
    a failure or Ctrl-C is printed too.
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
            if json:
                print_json(to_json(report))
            else:
                print(to_text(report, min(columns(), 80)))


async def run(robot: Epuck, report: Report, line: LiveLine, *, everything: bool = False) -> None:
    """Measure every command into *report*.

    Raises:
        LinkError: The robot was lost.
    """
    absent = robot.context.profile.absent
    steps = await _unless_lost(robot.encoders) or Steps(0, 0)
    settings = await _unless_lost(robot.camera)
    for name, call in calls(steps).items():
        if name in absent:
            report.results.append(Result(name, skipped=f"{robot.firmware} does not have it: {absent[name]}"))
        elif name in DISTURBING and not everything:
            report.results.append(Result(name, skipped=f"{DISTURBING[name]}; --all measures it"))
        else:
            count = min(report.count, FEW) if name in SLOW else report.count
            report.results.append(await measure(robot, name, call, count, line))
    if settings is not None:
        before = (settings.width, settings.height, settings.zoom, CameraMode(settings.mode))
        if before != USUAL_CAMERA:
            await robot.set_camera(*before)


def calls(steps: Steps) -> dict[str, Call]:
    """Return the calls by the names of their commands, in the order of the table; *steps* are the step counters."""
    arguments = {
        "set_speed": (0, 0),
        "set_encoders": tuple(steps),
        "set_led": (0, 0),
        "set_body_led": (0,),
        "set_front_led": (0,),
        "play_sound": (1,),
    }
    return {name: methodcaller(name, *arguments.get(name, ())) for name in (*THESIS, *EXTRA)}


async def measure(robot: Epuck, name: str, call: Call, count: int, line: LiveLine) -> Result:
    """Make *count* calls, one after the other, and time each.

    Raises:
        LinkError: The robot was lost.
    """
    times: list[float] = []
    lost = refused = 0
    for number in range(count):
        line.show([(f"{name} {number + 1} of {count}", "2")])
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
    """Return the value of a call; None where the answer is lost or refused.

    Raises:
        LinkError: The robot was lost.
    """
    try:
        return await call()
    except LinkError:
        raise
    except ElibError:
        return None


def to_text(report: Report, width: int) -> str:
    """Return the report as a table of 79 columns."""
    rows = [
        f"{report.url} ({report.firmware}, {report.origin})",
        "",
        f"{f'ms, {report.count} calls of each':<57}{'thesis, 2011':>21}",
        f"{'':<19}{'mean':>8}{'sd':>8}{'p50':>8}{'p99':>8}{'lost':>6}{'weak':>11}{'charged':>11}",
    ]
    for result in report.results:
        if result.skipped:
            rows += textwrap.wrap(
                f"{result.command:<19} - {result.skipped}", width, subsequent_indent=" " * 22, break_on_hyphens=False
            )
            continue
        row = f"{result.command:<19}" + "".join(f"{_ms(number):>8}" for number in result.figures.values())
        row += f"{result.lost + result.refused:>6}"
        published = THESIS.get(result.command)
        if published is not None:
            row += "".join(f"{_published(figures):>11}" for figures in (published.weak, published.charged))
        rows.append(row.rstrip())
    notes = [f"weak, charged: {SOURCE}; mean ± standard deviation."]
    if report.count < 100:
        notes.append("p99 of fewer than 100 calls is the slowest.")
    if report.origin == "simulator":
        notes.append("These are figures of a simulation.")
    return "\n".join([*rows, "", textwrap.fill(" ".join(notes), width)])


def _ms(seconds: float) -> str:
    return "-" if math.isnan(seconds) else f"{seconds * 1000:.1f}"


def _published(figures: tuple[float, float | None]) -> str:
    mean, deviation = figures
    return f"{mean:.0f}" if deviation is None else f"{mean:.0f} ±{deviation:<3.0f}"


def to_json(report: Report) -> Json:
    """Return the report for JSON, with times in ms."""
    return {
        "robot": report.url,
        "firmware": report.firmware,
        "origin": report.origin,
        "unit": "ms",
        "count": report.count,
        "source": SOURCE,
        "commands": [_entry(result) for result in report.results],
    }


def _entry(result: Result) -> Json:
    published = THESIS.get(result.command)
    return {
        "command": result.command,
        "calls": len(result.times) + result.lost + result.refused,
        "lost": result.lost,
        "refused": result.refused,
        **{name: round(number * 1000, 4) for name, number in result.figures.items()},
        "skipped": result.skipped or None,
        "thesis": None
        if published is None
        else {
            "name": published.name,
            "weak": {"mean": published.weak[0], "sd": published.weak[1]},
            "charged": {"mean": published.charged[0], "sd": published.charged[1]},
        },
    }
