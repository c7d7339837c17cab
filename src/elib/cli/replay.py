"""``elib replay``: show a recording in the browser, print or draw it, or continue it in the simulator."""

from __future__ import annotations

import asyncio
import math
import sys
from collections.abc import Sequence
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.plaintext import plain
from elib.behaviours import find
from elib.cli.arguments import Seconds, option
from elib.cli.terminal import is_live, json_line, say
from elib.link.protocol.words import Json
from elib.link.transport import Url
from elib.records.mcapreader import Health
from elib.records.reader import Recording
from elib.records.timeline import KINDS, Moment, timeline
from elib.robot.aio import Epuck
from elib.robot.runner import run_on
from elib.studies.drive import draw_recording, simulation_of
from elib.studies.report import check_report

GO_ON = 10.0
"""s for which a fork continues unless --for says otherwise."""


def replay(
    file: Annotated[str, Cli(metavar="FILE", help="The recording.")],
    /,
    *,
    begin: Annotated[float | None, option("--from S", "Print from this time on, s since the beginning.")] = None,
    end: Annotated[float | None, option("--to S", "Print until this time.")] = None,
    only: Annotated[str, option("--only KIND,KIND", f"Print only these kinds: {', '.join(KINDS)}.")] = "",
    json: Annotated[bool, option("--json", "Print a line of JSON for each call and note.")] = False,
    plot: Annotated[
        str | None, option("--plot FILE", "Draw path, speeds and readings into this file instead: .png, .svg or .pdf.")
    ] = None,
    fork_at: Annotated[float | None, option("--fork-at S", "Continue from this time in the simulator.")] = None,
    behaviour: Annotated[str | None, option("--behaviour NAME", "With --fork-at: run this behaviour.")] = None,
    world: Annotated[str | None, option("--world NAME", "With --fork-at: use another world.")] = None,
    seconds: Seconds = None,
) -> None:
    """Show a recording in the browser, with a time line to go to any moment, until Ctrl-C.

    With --from, --to, --only or --json it is printed instead, a line for each call and note, and also where there is no
    terminal. To replay a program, start it with --robot replay://FILE.

    For example:
        elib replay drive.mcap
        elib replay drive.mcap --from 10 --to 12 --only call
        elib replay drive.mcap --fork-at 10 --behaviour avoid
    """
    printing = {"--from": begin is not None, "--to": end is not None, "--only": bool(only), "--json": json}
    for name, is_given in printing.items():
        if is_given and (fork_at is not None or plot is not None):
            with_what = "--fork-at" if fork_at is not None else "--plot"
            raise ArgumentError(f"{name} chooses lines, but {with_what} prints none")
    if fork_at is not None:
        fork(file, fork_at, behaviour, world, seconds, plot)
        return
    for name, value in (("--behaviour", behaviour), ("--world", world), ("--for", seconds)):
        if value is not None:
            raise ArgumentError(f"{name} needs --fork-at", hint="elib replay FILE --fork-at 10")
    kinds = _kinds(only)
    first, last = begin or 0.0, math.inf if end is None else end
    if not (math.isfinite(first) and 0 <= first < last):
        raise ArgumentError(f"there is nothing from {first:g} s to {'the end' if end is None else f'{end:g} s'}")
    if plot is not None:
        check_report(plot)
    recording = Recording(file)
    say(title(recording))
    if plot is not None:
        draw_recording(recording, plot)
        say(f"plot        {plot}")
    elif any(printing.values()) or not (is_live(sys.stdout) and is_live(sys.stderr)):
        for moment in timeline(recording, kinds):
            if first <= moment.time <= last:
                print(json_line(to_json(moment)) if json else to_line(moment))
    else:
        from elib.cli.joystick import joystick  # printing needs no server

        joystick(str(Url("replay", file)))


def fork(
    file: str, at: float, behaviour: str | None, world: str | None, seconds: float | None, plot: str | None
) -> None:
    """Continue a recording from the moment *at*, s, in the simulator: with a behaviour, or as the robot drove then."""
    keys = ("fork", repr(at)), ("speed", "max"), *([("world", world)] if world else [])
    url = str(Url("replay", file, keys))
    if behaviour is not None:
        from elib.cli.script import run  # printing a recording needs none

        run(find(behaviour), robots=[url], seconds=GO_ON if seconds is None else seconds, plot=plot)
        return
    if plot is not None:
        raise ArgumentError("--plot with --fork-at needs --behaviour", hint="elib replay FILE --plot PICTURE")

    async def drive_on(robot: Epuck) -> None:
        simulation, index = simulation_of(robot)
        assert simulation is not None  # a fork is in a world
        began = robot.session.opening[0][0]
        end = robot.time + (GO_ON if seconds is None else seconds)
        while True:
            simulation.catch_up()
            assert simulation.world is not None
            pose = simulation.world.pose(index)
            print(
                f"{at + robot.time - began:9.3f} s  x {pose.x:.3f} m, y {pose.y:.3f} m, "
                f"heading {math.degrees(pose.heading):.1f}°"
            )
            if robot.time >= end:
                return
            await asyncio.sleep(min(1.0, end - robot.time))

    run_on(url, drive_on)


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


def title(recording: Recording) -> str:
    """Return the line about a recording that is printed first."""
    about, health = recording.about, Health()
    times = (entry.time for entry in recording.entries(health=health))
    length = max(0.0, max(times, default=recording.began) - recording.began)
    where = f" in {about['world']}" if "world" in about else ""
    state = "" if health.is_complete else "; it was cut off: elib record repair repairs it"
    return f"{recording.name}: {about['robot']} ({about['firmware']}){where}, {length:.1f} s{state}"


def _kinds(only: str) -> Sequence[str]:
    kinds = [kind.strip() for kind in only.split(",") if kind.strip()]
    for kind in kinds:
        if kind not in KINDS:
            raise ArgumentError(f"--only has {kind!r}; the kinds are {', '.join(KINDS)}")
    return kinds or KINDS
