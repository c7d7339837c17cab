"""Whatever ends, suspends or freezes a program that drives: its robot stands."""

from __future__ import annotations

import os
import random
import resource
import signal
import subprocess
import sys
import textwrap
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import pytest

from lanes import short

if sys.platform != "linux":
    pytest.skip("signals and ptys as Linux has them", allow_module_level=True)

from served import is_suspended, served_from_a_thread

from elib.link.protocol.profiles import PROFILES
from shared import PATIENCE, wait_until

KILLS = int(os.environ.get("ELIB_KILLS", "18"))
"""How many killings the long form draws; set ELIB_KILLS for more of them."""

PROGRAMS = {
    "elib run": ["-m", "elib", "run", "avoid", "--robot", "URL"],
    "elib demo": ["-m", "elib", "demo", "--robot", "URL"],
    "elib.run": """
        import elib
        async def main(robot):
            while True:
                await robot.set_speed(0.3, 0.4)
                await robot.proximity()
        elib.run(main, robot=URL, watchdog=True)
        """,
    "blocking": """
        import elib
        with elib.connect(URL, watchdog=True) as robot:
            while True:
                robot.set_speed(0.3, 0.4)
                robot.proximity()
        """,
    "async": """
        import asyncio, elib
        async def main():
            async with elib.open(URL, watchdog=True) as robot:
                while True:
                    await robot.set_speed(0.3, 0.4)
                    await robot.proximity()
        asyncio.run(main())
        """,
    "async, awaited": """
        import asyncio, elib
        async def main():
            robot = await elib.open(URL, watchdog=True)
            while True:
                await robot.set_speed(0.3, 0.4)
                await robot.proximity()
        asyncio.run(main())
        """,
    "in a thread": """
        import elib, threading
        def drive():
            robot = elib.connect(URL)
            while True:
                robot.set_speed(0.3, 0.4)
                robot.proximity()
        threading.Thread(target=drive, daemon=True).start()
        threading.Event().wait()
        """,
    "busy": """
        import asyncio, elib
        async def main():
            async with elib.open(URL) as robot:
                await robot.set_speed(0.3, 0.4)
                while True:
                    pass
        asyncio.run(main())
        """,
    "joystick": [
        str(Path(__file__).parents[1] / "panel" / "driving_panel.py"),
        *("joystick", "--no-browser", "--port", "0", "URL"),
    ],
}
ENDS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGKILL", "SIGSTOP")
SUSPENDING = ("SIGTSTP", "SIGSTOP")
UNWATCHED = {"in a thread": ("SIGSTOP", "SIGTSTP"), "busy": ("SIGSTOP", "SIGKILL")}
"""What a program without a watchdog cannot handle: a freeze, and in a thread Ctrl-Z too, as Python does not see it."""
REPRESENTATIVES = [("elib.run", "SIGTSTP"), ("blocking", "SIGKILL"), ("blocking", "SIGQUIT"), ("async", "SIGSTOP")]
"""The quick form: each way to end that no test of a style has."""


@dataclass(frozen=True, slots=True)
class Killing:
    """One killing.

    Attributes:
        program: Which of :data:`PROGRAMS`.
        numbers: Names of the signals, in order.
        way: How far the robot drives before them, m.
        more_way: How far it may drive between them, m.
        latency: Delay of the link, each way, s.
        firmware: Of the robot.
        line: ``pty`` or ``tcp``.
    """

    program: str
    numbers: tuple[str, ...]
    way: float
    more_way: float
    latency: float
    firmware: str
    line: str


def draw(chance: random.Random, program: str, number: str) -> Killing:
    """Return one killing of *program* by *number*, half of them by two signals."""
    numbers: tuple[str, ...] = (number,)
    if number in ENDS[:4] and chance.random() < 0.5:
        numbers = (number, chance.choice((number, *ENDS[:3])))
    return Killing(
        program,
        numbers,
        chance.uniform(0.0001, 0.02),
        chance.choice((0.0, 0.0001, 0.001, 0.005)),
        chance.choice((0.0, 0.02, 0.1)),
        chance.choice(tuple(PROFILES)),
        "pty" if chance.random() < 0.3 else "tcp",
    )


def drawn() -> list[object]:
    """Return the killings of the quick form, and those of the long one: all programs, by all that may end them."""
    chance = random.Random(KILLS)
    quick = [draw(chance, program, end) for program, end in REPRESENTATIVES]
    pairs = [pair for pair in product(PROGRAMS, ENDS) if pair[1] not in UNWATCHED.get(pair[0], ())]
    chance.shuffle(pairs)
    # Each program comes first as often as any other, and so does each end.
    turns = [(list(PROGRAMS)[index % len(PROGRAMS)], ENDS[index % len(ENDS)]) for index in range(KILLS)]
    long = [draw(chance, *(turn if turn in pairs else pairs[index])) for index, turn in enumerate(turns)]
    return short([*quick, *long], *quick)


@pytest.mark.parametrize("each", drawn(), ids=lambda each: f"{each.program} {' '.join(each.numbers)}")
def test_whatever_ends_a_program_its_robot_stands(each: Killing, tmp_path: Path) -> None:
    keys = {"latency": str(each.latency), "firmware": each.firmware}
    with served_from_a_thread(each.line, **keys) as robot, (tmp_path / "stderr").open("w+") as errors:
        process = start(each.program, robot.url, tmp_path, errors.fileno())

        def way() -> float:
            assert process.poll() is None, (each, (tmp_path / "stderr").read_text())
            return robot.way

        try:
            wait_until(lambda: way() >= each.way)
            for index, number in enumerate(each.numbers):
                if index:
                    begin = robot.way
                    wait_until(lambda begin=begin: robot.way >= begin + each.more_way or not robot.is_turning)
                process.send_signal(getattr(signal, number))
            if each.numbers[-1] not in SUSPENDING:
                process.wait(PATIENCE)
                wait_until(lambda: robot.stands)
                return
            wait_until(lambda: is_suspended(process.pid))
            wait_until(lambda: robot.stands)
            process.send_signal(signal.SIGCONT)
            # A program that was frozen in the middle of a call may end in its error: the watchdog's stop was answered
            # meanwhile. A panel need not drive on: it takes the stick away from a page that was silent.
            if each.program not in ("busy", "joystick"):
                may_end = each.numbers[-1] == "SIGSTOP"
                wait_until(lambda: robot.is_turning or (may_end and process.poll() is not None))
        finally:
            process.kill()
            process.wait()


def start(program: str, url: str, folder: Path, errors: int) -> subprocess.Popen[bytes]:
    """Start one of the programs; it finds no settings, and leaves no core."""
    what = PROGRAMS[program]
    if isinstance(what, str):
        arguments = ["-c", f"URL = {url!r}\n" + textwrap.dedent(what)]
    else:
        arguments = [url if part == "URL" else part for part in what]
    homes = dict.fromkeys(("XDG_STATE_HOME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME"), str(folder))
    process = subprocess.Popen(
        [sys.executable, *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=errors,
        cwd=folder,
        env={**os.environ, **homes},
        process_group=0,
    )
    resource.prlimit(process.pid, resource.RLIMIT_CORE, (0, 0))
    return process
