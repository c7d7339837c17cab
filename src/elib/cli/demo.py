"""``elib demo``: let a robot wander, and draw where it went."""

from __future__ import annotations

import asyncio
import shlex
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.rules import DURATION
from elib.behaviours import find, run_behaviour
from elib.cli.arguments import FAST_SIMULATION, RobotUrl
from elib.cli.live import Watcher, beside, period_of
from elib.cli.recordoptions import NOTHING_KEPT, Kept
from elib.cli.report import link_rows
from elib.cli.terminal import BOLD, LiveLine, say, table
from elib.cli.track import Track
from elib.link.transport import parse_url, speed_of
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.robot.watchdog import is_supported
from elib.simulator.drawing import draw_png
from elib.simulator.physics import Pose, Snapshot
from elib.studies.drive import length, simulation_of

PICTURE = Path("elib-demo.png")
BEHAVIOUR = "avoid"
USUAL_TIME = 60.0
"""s of robot time by default."""
FRAMES, PAUSE = 120, 1 / 30
"""Frames of the live line in simulated time, and the s that each is shown: a minute takes about four seconds. The world
waits meanwhile, so that the run is the same whether somebody watches it or not."""

DriveTime = Annotated[float, DURATION, Cli(name="--for", metavar="S", help="Robot time to drive for, seconds.")]
Seed = Annotated[int | None, Cli(name="--seed", metavar="N", help="Seed of the simulation: same seed, same run.")]

WHAT_NEXT = [
    ("send proximity", "ask a robot something; send --help lists the commands"),
    ("simulate", "a virtual robot on a serial port, for any program"),
    ("demo --robot serial:///dev/rfcomm0", "the same with your own robot"),
]


def demo(
    *,
    robot: RobotUrl = FAST_SIMULATION,
    seconds: DriveTime = USUAL_TIME,
    seed: Seed = None,
    records: Kept = NOTHING_KEPT,
) -> None:
    """Let a robot wander for a minute, then draw where it went.

    Without --robot it is a virtual one in the world `arena`; the minute takes a few seconds. The picture is
    elib-demo.png.
    """
    url = with_seed(robot, seed)
    speed = speed_of(url)
    line, watcher = LiveLine(), Watcher()
    is_paced = speed == "max" and line.is_shown

    async def main(epuck: Epuck) -> tuple[str, Track, Snapshot, list[Pose]]:
        track = Track(epuck, *simulation_of(epuck))
        watcher.attach(epuck)
        say(f"{BEHAVIOUR} on {url} ({epuck.firmware}) for {seconds:g} s; Ctrl-C stops it")
        frame = max(track.period, seconds / FRAMES if is_paced else period_of(speed))
        async with beside(_follow(track, watcher, line, frame, is_paced)):
            outcome = await run_behaviour(find(BEHAVIOUR), epuck, seconds=seconds)
            watcher.finish(outcome.duration)
        await track.sample()
        return epuck.firmware, track, *track.floor()

    try:
        firmware, track, floor, trail = run_on(url, main, records=records, watchdog=is_supported())
    finally:
        line.clear()
    caption = f"{floor.name} · {watcher.duration:.0f} s · {length(track.poses):.2f} m driven"
    if not track.is_true:
        caption = f"by the wheel encoders, walls unknown · {watcher.duration:.0f} s · {length(track.poses):.2f} m"
    rows = _rows(track, watcher)
    try:
        draw_png(floor, PICTURE, trails=[trail], caption=caption)
        rows.append(("picture", str(PICTURE)))
    finally:
        where = f"the world {floor.name}" if track.is_true else url
        print(f"{BEHAVIOUR}: {watcher.duration:.0f} s of robot time in {where}, firmware {firmware}\n")
        print(table(rows))
    print("\nWhat next:")
    print(table(what_next()))


def with_seed(url: str, seed: int | None) -> str:
    """Return *url* with the seed in it.

    Raises:
        ArgumentError: The URL is wrong, or there is a seed and the URL is not that of a simulation.
    """
    parsed = parse_url(url)
    if seed is None:
        return str(parsed)
    if parsed.scheme != "sim":
        raise ArgumentError(f"--seed is {seed}, but {url} is not a simulation", hint="leave --seed out")
    keys = {**parsed.keys, "seed": str(seed)}
    return str(parse_url(f"sim://{parsed.target}?" + "&".join(f"{key}={value}" for key, value in keys.items())))


async def _follow(track: Track, watcher: Watcher, line: LiveLine, frame: float, is_paced: bool) -> None:
    """Sample the path, and show the live line every *frame* seconds of robot time."""
    clock = threading.Event()
    due = watcher.duration
    while True:
        await track.sample()
        if watcher.duration >= due:
            due += frame
            line.show([*watcher.time_parts(), (f"{length(track.poses):6.2f} m   ", BOLD), *watcher.robot_parts()])
            if is_paced:
                await asyncio.to_thread(clock.wait, PAUSE)
        await asyncio.sleep(track.period)


def _rows(track: Track, watcher: Watcher) -> list[tuple[str, str]]:
    """Return the summary as label and text."""
    assert watcher.statistics is not None
    driven = length(track.poses)
    source = "the simulated world" if track.is_true else "the wheel encoders"
    return [
        ("drove", f"{driven:.2f} m by {source}, {100 * driven / watcher.duration:.1f} cm/s on average"),
        ("closest", _closest(track, watcher)),
        *link_rows(watcher.statistics),
    ]


def what_next() -> list[tuple[str, str]]:
    """Return what to type next and what it does.

    In a shell that does not find this elib, the first is to activate its environment.
    """
    program = command_name()
    activate = Path(sys.argv[0]).with_name("activate")  # a virtual environment has it beside its programs
    is_unknown = program != "elib" and activate.is_file()
    first = [(f". {_quoted(str(activate))}", "let python and elib be found in this shell")] if is_unknown else []
    return first + [(f"{program} {arguments}", about) for arguments, about in WHAT_NEXT]


def command_name() -> str:
    """Return what to type to call this elib again: its path, if the shell finds another elib or none."""
    typed, known = Path(sys.argv[0]), shutil.which("elib")
    is_known = known is not None and typed.exists() and typed.samefile(known)
    if typed.name == "__main__.py":
        return f"{_quoted(sys.executable)} -m elib"
    return "elib" if is_known or typed.stem != "elib" else _quoted(sys.argv[0])


def _quoted(path: str) -> str:
    """Return a path as a shell reads it."""
    return subprocess.list2cmdline([path]) if sys.platform == "win32" else shlex.quote(path)


def _closest(track: Track, watcher: Watcher) -> str:
    if not track.is_true:
        return f"{watcher.nearest} counts at a front sensor"
    touched = f"it touched something for {track.contact:.1f} s" if track.contact else "it touched nothing"
    return f"{100 * track.closest:.1f} cm from body to obstacle; {touched}"
