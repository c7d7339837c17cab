"""``elib demo``: let a robot wander, and draw where it went."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Annotated

from elib.base.errors import ArgumentError
from elib.base.rules import DURATION
from elib.behaviours import find
from elib.cli.arguments import FAST_SIMULATION, RobotUrl, option
from elib.cli.recordoptions import NOTHING_KEPT, Kept
from elib.cli.script import run
from elib.cli.terminal import quoted, say, table
from elib.link.transport import parse_url
from elib.simulator.drawing import draw
from elib.studies.drive import floor_of

PICTURE = Path("elib-demo.png")
USUAL_TIME = 60.0
"""s of robot time by default."""


WHAT_NEXT = [
    ("send proximity", "ask a robot something; send --help lists the commands"),
    ("simulate", "a virtual robot on a serial port, for any program"),
    ("demo --robot serial:///dev/rfcomm0", "the same with your own robot"),
]


def demo(
    *,
    robot: RobotUrl = FAST_SIMULATION,
    seconds: Annotated[float, DURATION, option("--for S", "Robot time to run for, seconds.")] = USUAL_TIME,
    seed: Annotated[int | None, option("--seed N", "Seed of the simulation: same seed, same run.")] = None,
    records: Kept = NOTHING_KEPT,
) -> None:
    """Let a robot wander for a minute, then draw where it went.

    Without --robot it is a virtual one in the world `arena`; the minute takes a few seconds. The picture is
    elib-demo.png. What drives is the behaviour `avoid`.

    For example:
        elib demo
        elib demo --robot serial:///dev/rfcomm0
    """
    url = with_seed(robot, seed)
    say(f"avoid on {url} for {seconds:g} s; Ctrl-C stops it\n")
    done = run(find("avoid"), robots=[url], seconds=seconds, records=records)
    floor, trails = floor_of(done.robots)
    assert floor is not None  # a robot was opened
    distance = sum(each.distance for each in done.robots)
    draw(floor, PICTURE, trails=trails, caption=f"{floor.name} · {done.time:.0f} s · {distance:.2f} m driven")
    print(f"\nThe path is drawn in {PICTURE}. What next:")
    print(table(what_next()))


def with_seed(url: str, seed: int | None) -> str:
    """Return *url* with the seed in it."""
    parsed = parse_url(url)
    if seed is None:
        return str(parsed)
    if parsed.scheme != "sim":
        raise ArgumentError(f"--seed is {seed}, but {url} is not a simulation", hint="leave --seed out")
    keys = {**parsed.keys, "seed": str(seed)}
    return str(parse_url(f"sim://{parsed.target}?" + "&".join(f"{key}={value}" for key, value in keys.items())))


def what_next() -> list[tuple[str, str]]:
    """Return what to type next and what it does.

    In a shell that does not find this elib, the first is to activate its environment.
    """
    program = command_name()
    activate = Path(sys.argv[0]).with_name("activate")  # a virtual environment has it beside its programs
    is_unknown = program != "elib" and activate.is_file()
    first = [(f". {quoted(str(activate))}", "let python and elib be found in this shell")] if is_unknown else []
    return first + [(f"{program} {arguments}", about) for arguments, about in WHAT_NEXT]


def command_name() -> str:
    """Return what to type to call this elib again: its path, if the shell finds another elib or none."""
    typed, known = Path(sys.argv[0]), shutil.which("elib")
    is_known = known is not None and typed.exists() and typed.samefile(known)
    if typed.name == "__main__.py":
        return f"{quoted(sys.executable)} -m elib"
    return "elib" if is_known or typed.stem != "elib" else quoted(sys.argv[0])
