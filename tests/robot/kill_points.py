"""Programs that drive a robot, and what ends them at random moments: whether the wheels stand, and after what time.

Run as a script it makes a campaign: ``python kill_points.py DRAWS [SEED]`` prints a table.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from elib.emulator.control import Control
from elib.emulator.server import serve
from elib.emulator.settings import SimulationSettings
from elib.protocol.profiles import PROFILES

WORLD = "arena"
PATIENCE = 30.0
"""s until a program has to drive, on a busy machine."""
LOOK = 0.002
"""s between two looks at the wheels."""
WINDOW = 2.5
"""s after the last signal for which the wheels are watched, at most."""
REST = 0.6
"""s, and two delays of the link, for which they must have stood at the end."""

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
        str(Path(__file__).parents[1] / "web" / "driving_panel.py"),
        *("joystick", "--no-browser", "--port", "0", "URL"),
    ],
}
ENDS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGKILL", "SIGSTOP")
SUSPENDING = ("SIGTSTP", "SIGSTOP")
UNWATCHED = {"in a thread": ("SIGSTOP", "SIGTSTP"), "busy": ("SIGSTOP", "SIGKILL")}
"""What a program without a watchdog cannot handle: a freeze, and in a thread Ctrl-Z too, as Python does not see it."""
LATENCIES = (0.0, 0.02, 0.1)


@dataclass(frozen=True, slots=True)
class Draw:
    """One killing.

    Attributes:
        program: Which of :data:`PROGRAMS`.
        numbers: Names of the signals, in order.
        gap: s between them.
        moment: s after the wheels have begun to turn.
        latency: Delay of the link, each way, s.
        firmware: Of the robot.
        is_pty: By a serial port, not by TCP.
    """

    program: str
    numbers: tuple[str, ...]
    gap: float
    moment: float
    latency: float
    firmware: str
    is_pty: bool


@dataclass(frozen=True, slots=True)
class End:
    """How a killing ended.

    Attributes:
        stands: Whether the wheels stand.
        seconds: Time from the last signal until they stood, s.
        code: Exit code; None for a suspended program.
        goes_on: Whether a suspended program drives on when it is continued.
        said: What it wrote on stderr.
    """

    stands: bool
    seconds: float
    code: int | None
    goes_on: bool
    said: str

    def is_right(self, drawn: Draw) -> bool:
        """Return whether the robot stands, and the program has ended, or goes on where it was suspended.

        One that was frozen in the middle of a call may end in its error: the watchdog's stop was answered meanwhile.
        A panel need not go on: it takes the stick away from a page that was silent.
        """
        if drawn.numbers[-1] in SUSPENDING:
            may_rest = drawn.program in ("busy", "joystick") or drawn.numbers[-1] == "SIGSTOP"
            return self.stands and (self.goes_on or may_rest)
        return self.stands and self.code is not None


def draw(chance: random.Random, program: str, number: str) -> Draw:
    """Return one killing of *program* by *number*, half of them by two signals."""
    numbers: tuple[str, ...] = (number,)
    if number in ENDS[:4] and chance.random() < 0.5:
        numbers = (number, chance.choice((number, *ENDS[:3])))
    return Draw(
        program,
        numbers,
        chance.choice((0.0, 0.003, 0.02, 0.1)) * chance.uniform(0.5, 1.5),
        chance.uniform(0.0, 0.5),
        chance.choice(LATENCIES),
        chance.choice(tuple(PROFILES)),
        chance.random() < 0.3,
    )


def pairs() -> list[tuple[str, str]]:
    """Return every program with everything that may end it."""
    return [(program, end) for program in PROGRAMS for end in ENDS if end not in UNWATCHED.get(program, ())]


@contextlib.contextmanager
def robot(latency: float, firmware: str) -> Iterator[tuple[str, str, list[object]]]:
    """Serve a robot from a thread; yield its TCP URL, its serial URL and its motors."""
    ready = threading.Event()
    found: list[object] = []
    loop = asyncio.new_event_loop()
    stop = asyncio.Event()

    async def main() -> None:
        def meet(control: Control) -> None:
            found.append(control.simulation.robots[0].emulator.firmware.motors)

        settings = SimulationSettings.from_text(WORLD, {"latency": str(latency), "firmware": firmware})
        async with serve(settings, pty=True, tcp="0", control=meet) as served:
            found.extend(each.url for each in served)
            ready.set()
            await stop.wait()

    thread = threading.Thread(target=lambda: loop.run_until_complete(main()))
    thread.start()
    try:
        assert ready.wait(PATIENCE)
        motors, serial, tcp = found
        yield str(tcp), str(serial), motors  # type: ignore[misc]
    finally:
        loop.call_soon_threadsafe(stop.set)
        thread.join()
        loop.close()


def kill(drawn: Draw) -> End:
    """Start a program, let it drive, send the signals, and watch the wheels."""
    with robot(drawn.latency, drawn.firmware) as (tcp, serial, motors), tempfile.TemporaryDirectory() as folder:
        url = serial if drawn.is_pty else tcp
        what = PROGRAMS[drawn.program]
        if isinstance(what, str):
            arguments = ["-c", f"URL = {url!r}\n" + textwrap.dedent(what)]
        else:
            arguments = [url if part == "URL" else part for part in what]
        errors = Path(folder, "stderr")
        environment = {**os.environ, "XDG_STATE_HOME": folder, "XDG_CONFIG_HOME": folder, "XDG_CACHE_HOME": folder}
        with errors.open("wb") as stderr:
            process = subprocess.Popen(
                [sys.executable, *arguments],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=stderr,
                cwd=folder,
                env=environment,
                process_group=0,
            )
        try:
            resource.prlimit(process.pid, resource.RLIMIT_CORE, (0, 0))

            def turn() -> bool:
                return any(motor.speed for motor in motors)  # type: ignore[attr-defined]

            end = time.monotonic() + PATIENCE
            while not turn():
                assert process.poll() is None, errors.read_text()
                assert time.monotonic() < end, f"it never drove: {drawn} {errors.read_text()}"
                time.sleep(LOOK)
            time.sleep(drawn.moment)
            for index, number in enumerate(drawn.numbers):
                if index:
                    time.sleep(drawn.gap)
                with contextlib.suppress(ProcessLookupError):
                    process.send_signal(getattr(signal, number))
            sent = last = now = time.monotonic()
            while now - sent < WINDOW and now - last < REST + 2 * drawn.latency:
                if turn():
                    last = now
                time.sleep(LOOK)
                now = time.monotonic()
            stands = not turn() and now - last >= REST
            goes_on = False
            if drawn.numbers[-1] in SUSPENDING:
                process.send_signal(signal.SIGCONT)
                end = time.monotonic() + PATIENCE / 3
                while not goes_on and time.monotonic() < end and process.poll() is None:
                    goes_on = turn()
                    time.sleep(LOOK)
                code = None
            else:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(PATIENCE / 3)
                code = process.poll()
            return End(stands, last - sent, code, goes_on, errors.read_text())
        finally:
            process.kill()
            process.wait()


def campaign(draws: int, seed: int) -> None:
    """Print a table of program, signal, draws, how many stand, the worst time and the exit codes."""
    chance = random.Random(seed)
    offset = chance.randrange(1000)
    table: dict[tuple[str, str], list[tuple[Draw, End]]] = defaultdict(list)
    todo = pairs()
    for index in range(draws):
        program, number = todo[(index + offset) % len(todo)]
        drawn = draw(chance, program, number)
        ended = kill(drawn)
        table[program, number].append((drawn, ended))
        if not ended.is_right(drawn):
            print(drawn, ended, file=sys.stderr, flush=True)
    for (program, number), kills in sorted(table.items()):
        stand = sum(ended.stands for _, ended in kills)
        worst = max(ended.seconds for _, ended in kills)
        beyond = max(ended.seconds - drawn.latency for drawn, ended in kills)
        codes = sorted({str(ended.code) for _, ended in kills})
        print(f"{program:15} {number:8} {len(kills):4} {stand:4} {worst:6.3f} {beyond:6.3f}  {' '.join(codes)}")


if __name__ == "__main__":
    campaign(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0)
