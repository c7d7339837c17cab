"""``elib replay``: play, step through, print or draw a recording, or continue it in the simulator."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import math
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated
from urllib.parse import quote

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.plaintext import plain
from elib.base.pose import Pose
from elib.base.timebase import parse_speed
from elib.behaviours import find
from elib.cli.arguments import Seconds
from elib.cli.live import SHOWN, bars
from elib.cli.player import Player, keys_of
from elib.cli.readings import Json, json_line
from elib.cli.terminal import BOLD, CYAN, DIM, RED, YELLOW, LiveLine, is_live, paint, say
from elib.records.mcapreader import Health
from elib.records.reader import Recording
from elib.records.timeline import KINDS, Moment, timeline
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.robot.running import run_coroutine
from elib.simulator.emulator.sim_transport import SimTransport
from elib.simulator.physics import Snapshot, World
from elib.simulator.worlds.files import parse
from elib.studies.drive import SENSES, charts_of, floor_around
from elib.studies.report import check_report, draw_report

FRAME = 0.05
"""s between two frames of the player."""
GO_ON = 10.0
"""s for which a fork continues unless --for says otherwise."""
COLOURS = {"state": YELLOW, "note": CYAN, "link": RED, "robot": RED, "recorder": RED}
HELP = "space, ← → step, [ ] 10 s, g go to, + - speed, q"

File = Annotated[str, Cli(metavar="FILE", help="The recording.")]
PlaySpeed = Annotated[str, Cli(name="--speed", metavar="K", help="Factor on real time, or max: print all at once.")]
From = Annotated[float, Cli(name="--from", metavar="S", help="Begin at this time, s since the beginning.")]
To = Annotated[float | None, Cli(name="--to", metavar="S", help="End at this time.")]
Only = Annotated[str, Cli(name="--only", metavar="KIND,KIND", help=f"Kinds of lines: {', '.join(KINDS)}.")]
AsJson = Annotated[bool, Cli(name="--json", help="Print a JSON object for each line.")]
Plot = Annotated[str | None, Cli(name="--plot", metavar="FILE", help="Draw path, speeds and readings instead.")]
Fork = Annotated[float | None, Cli(name="--fork-at", metavar="S", help="Continue from this time in the simulator.")]
Behave = Annotated[str | None, Cli(name="--behaviour", metavar="NAME", help="With --fork-at: run this behaviour.")]
WorldName = Annotated[str | None, Cli(name="--world", metavar="NAME", help="With --fork-at: use another world.")]


def replay(
    file: File,
    /,
    *,
    speed: PlaySpeed = "1",
    begin: From = 0.0,
    end: To = None,
    only: Only = "",
    json: AsJson = False,
    plot: Plot = None,
    fork_at: Fork = None,
    behaviour: Behave = None,
    world: WorldName = None,
    seconds: Seconds = None,
) -> None:
    """Play a recording line by line, at its original speed.

    On a terminal, the space bar pauses, the arrows step, [ and ] jump by 10 s, g and a number go to a time, + and -
    change the speed, and q ends. Without a terminal, everything is printed at once. To replay a program, start it with
    --robot replay://FILE.
    """
    printing = {"--from": begin != 0, "--to": end is not None, "--only": bool(only), "--json": json}
    for option, is_given in printing.items():
        if is_given and (fork_at is not None or plot is not None):
            with_what = "--fork-at" if fork_at is not None else "--plot"
            raise ArgumentError(f"{option} chooses lines, but {with_what} prints none")
    if fork_at is not None:
        if speed != "1":
            raise ArgumentError("--speed cannot be used with --fork-at: a fork runs as fast as possible")
        fork(file, fork_at, behaviour=behaviour, world=world, seconds=seconds, plot=plot)
        return
    for option, value in (("--behaviour", behaviour), ("--world", world), ("--for", seconds)):
        if value is not None:
            raise ArgumentError(f"{option} needs --fork-at", hint="elib replay FILE --fork-at 10")
    pace = parse_speed("real" if speed == "1" else speed)
    kinds = _kinds(only)
    if not (math.isfinite(begin) and begin >= 0) or (end is not None and not end > begin):
        raise ArgumentError(f"there is nothing from {begin:g} s to {'the end' if end is None else f'{end:g} s'}")
    if plot is not None:
        check_report(plot)
    recording = Recording(file)
    health = Health()
    length = _length(recording, health)
    say(title(recording, length, health))
    if plot is not None:
        draw(recording, plot)
        say(f"plot        {plot}")
        return
    last = length if end is None else end
    if json or pace == "max" or not (is_live(sys.stdout) and is_live(sys.stderr)):
        for moment in timeline(recording, kinds):
            if begin <= moment.time <= last:
                print(json_line(to_json(moment)) if json else to_line(moment))
        return
    moments = [moment for moment in timeline(recording, kinds) if moment.time <= last]
    moments.sort(key=lambda moment: moment.time)
    player = Player(moments, min(last, length), begin, 1.0 if pace == "real" else pace)
    run_coroutine(lambda: _play(player))


def fork(
    file: str,
    at: float,
    *,
    behaviour: str | None = None,
    world: str | None = None,
    seconds: float | None = None,
    plot: str | None = None,
) -> None:
    """Continue a recording from the moment *at*, s, in the simulator: with a behaviour, or as the robot drove then.

    Raises:
        ArgumentError: The command line is wrong, or the moment is not in the recording.
        ElibError: The simulator cannot continue from this moment.
    """
    url = f"replay://{quote(os.fspath(Path(file)))}?fork={at!r}&speed=max" + (f"&world={quote(world)}" if world else "")
    if behaviour is not None:
        from elib.cli.script import play_behaviour  # playing a recording needs none

        play_behaviour(find(behaviour), robot=url, seconds=GO_ON if seconds is None else seconds, plot=plot)
        return
    if plot is not None:
        raise ArgumentError("--plot with --fork-at needs --behaviour", hint="elib replay FILE --plot PICTURE")

    async def drive_on(robot: Epuck) -> None:
        transport = robot.session.transport
        assert isinstance(transport, SimTransport)  # a fork is one
        simulation = transport.simulation
        began = robot.session.opening[0][0]
        end = robot.time + (GO_ON if seconds is None else seconds)
        while True:
            simulation.catch_up()
            assert simulation.world is not None
            pose = simulation.world.pose(transport.robot.index)
            print(
                f"{at + robot.time - began:9.3f} s  x {pose.x:.3f} m, y {pose.y:.3f} m, "
                f"heading {math.degrees(pose.heading):.1f}°"
            )
            if robot.time >= end:
                return
            await asyncio.sleep(min(1.0, end - robot.time))

    run_on(url, drive_on)


# -- lines --


def to_line(moment: Moment) -> str:
    """Return a moment as a line of text."""
    kind = "" if moment.kind == "call" else f"{moment.kind}: "
    return plain(f"{moment.time:9.3f} s  {kind}{moment.text}")


def to_json(moment: Moment) -> Json:
    """Return a moment for JSON."""
    pose = moment.pose
    return {
        "time": round(moment.time, 9),
        "kind": moment.kind,
        "text": moment.text,
        "ok": not moment.is_bad,
        "readings": {name: list(numbers) for name, numbers in moment.readings.items()},
        "speed": None if moment.speed is None else list(moment.speed),
        "pose": None if pose is None else [pose.x, pose.y, pose.heading],
    }


def title(recording: Recording, length: float, health: Health) -> str:
    """Return the line about a recording that is printed before it is played."""
    about = recording.about
    where = f" in {about['world']}" if "world" in about else ""
    state = "" if health.is_complete else "; it was cut off: elib record repair repairs it"
    return f"{recording.name}: {about['robot']} ({about['firmware']}){where}, {length:.1f} s{state}"


def _kinds(only: str) -> Sequence[str]:
    kinds = [kind.strip() for kind in only.split(",") if kind.strip()]
    for kind in kinds:
        if kind not in KINDS:
            raise ArgumentError(f"--only has {kind!r}; the kinds are {', '.join(KINDS)}")
    return kinds or KINDS


def _length(recording: Recording, health: Health) -> float:
    times = (entry.time for entry in recording.entries(health=health))
    return max(0.0, max(times, default=recording.began) - recording.began)


# -- the player --


async def _play(player: Player) -> None:
    loop = asyncio.get_running_loop()
    line = LiveLine()
    pressed: asyncio.Queue[str] = asyncio.Queue()
    with _raw_keys(loop, pressed):
        before = loop.time()
        while not player.is_over:
            moments: list[Moment] = []
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(FRAME):
                    moments += player.press(await pressed.get())
            now = loop.time()
            moments += player.advance(now - before)
            before = now
            if moments:
                line.clear()
                for moment in moments:
                    print(paint(to_line(moment), RED if moment.is_bad else COLOURS.get(moment.kind, ""), sys.stdout))
                sys.stdout.flush()
            line.show(_status(player))
            if not sys.stdin.isatty() and not player.is_playing:
                break
    line.clear()


def _status(player: Player) -> list[tuple[str, str]]:
    if player.prompt is not None:
        return [(f"go to {player.prompt}_ s (Enter)", BOLD)]
    robot = player.robot
    parts = [(f"{'▶' if player.is_playing else '⏸'} {player.time:6.1f} / {player.length:.1f} s ", BOLD)]
    if player.speed != 1:
        parts.append((f"{player.speed:g}x ", DIM))
    if robot.state:
        parts.append((f"{robot.state} ", YELLOW))
    parts.append((f"{robot.speed[0]:+.2f} {robot.speed[1]:+.2f} rev/s ", ""))
    if len(robot.near) == 8:
        parts.append((bars(robot.near[sensor] for sensor in SHOWN) + " ", ""))
    if robot.pose is not None:
        parts.append((f"x {robot.pose.x:.2f} y {robot.pose.y:.2f} m  ", ""))
    return [*parts, (HELP, DIM)]


@contextlib.contextmanager
def _raw_keys(loop: asyncio.AbstractEventLoop, pressed: asyncio.Queue[str]) -> Iterator[None]:
    """Put each key into *pressed* when it is pressed, if the system supports that."""
    if sys.platform == "win32" or not sys.stdin.isatty():
        yield
        return
    import termios
    import tty

    number = sys.stdin.fileno()
    before = termios.tcgetattr(number)

    def read() -> None:
        for key in keys_of(os.read(number, 1024).decode("utf-8", "replace")):
            pressed.put_nowait(key)

    tty.setcbreak(number)
    loop.add_reader(number, read)
    try:
        yield
    finally:
        loop.remove_reader(number)
        termios.tcsetattr(number, termios.TCSADRAIN, before)


# -- the picture --


def draw(recording: Recording, path: str) -> None:
    """Draw a recording: the path, and speeds, readings and states over time.

    Raises:
        ArgumentError: The name of the picture does not end in .png, .svg or .pdf.
        Unsupported: Matplotlib is not installed.
        ElibError: The disk is full.
    """
    moments = sorted(timeline(recording), key=lambda moment: moment.time)
    length = max((moment.time for moment in moments), default=0.0)
    told = [(moment.time, moment.speed) for moment in moments if moment.speed is not None]
    read = {
        name: [(moment.time, moment.readings[name]) for moment in moments if name in moment.readings] for name in SENSES
    }
    floor = _floor(recording)
    draw_report(
        path,
        title=f"{recording.name}: {recording.about['robot']}, {length:.1f} s",
        floor=None if floor is None else floor[0],
        trails=[] if floor is None else floor[1],
        charts=charts_of(told, read),
        states=[(moment.time, moment.text) for moment in moments if moment.kind == "state"],
        seconds=length,
    )


def _floor(recording: Recording) -> tuple[Snapshot, list[list[Pose]]] | None:
    measured = recording.path(measured=True)
    path = measured or recording.path(measured=False)
    if not path:
        return None
    if not (measured and recording.scene):
        return floor_around([path], "by its step counters")
    about = recording.about
    count = int(about.get("robots", "1"))
    scene = parse(recording.scene.encode(), recording.name, robots=count)
    snapshot = World(scene, robots=count).snapshot()
    index = int(about.get("robot_index", "0"))
    robots = [
        dataclasses.replace(robot, pose=path[-1]) if number == index else robot
        for number, robot in enumerate(snapshot.robots)
    ]
    return dataclasses.replace(snapshot, robots=tuple(robots), time=path[-1].time), [path]
