"""The live line, which shows on a terminal what a robot does, and the Enter key that ends a run."""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import select
import sys
import threading
from collections.abc import AsyncIterator, Callable, Coroutine, Iterable, Sequence
from functools import partial
from typing import TYPE_CHECKING

from elib.base.body import STEPS_PER_REVOLUTION
from elib.base.errors import ElibError
from elib.base.timebase import LoopMaker, LoopSpeed, Paced
from elib.cli.terminal import BLOCKS, BOLD, CYAN, DIM, GREEN, RED, YELLOW, LiveLine, say
from elib.link.protocol.values import Proximity
from elib.link.session import Ended, TraceEvent
from elib.link.session.statistics import LinkStats
from elib.robot.aio import Epuck

if TYPE_CHECKING:
    from elib.behaviours._run.context import RunContext, RunMessage, StateChanged
    from elib.studies.drive import RobotReport

FRAME = 0.1
"""s of real time between two frames of the live line."""
SIMULATED_FRAME = 1.0
"""s of simulated time between two frames, where it runs as fast as the processor allows."""
FULL, KNEE = 4000.0, 60.0
"""Counts of a full bar, and from which its scale is logarithmic, since counts rise twentyfold within 5 cm; the knee is
above the noise of a free sensor."""
NEAR, VERY_NEAR = 160, 450
"""Counts from which a bar is shown as a warning: about 4 cm and 2.5 cm (e-puck.md, 3)."""
SHOWN = (5, 6, 7, 0, 1, 2)
"""The sensors of the front half, from left to right."""
BACKGROUND = 0.3
"""Time between two looks at whether the terminal is ours, s."""


def period_of(speed: LoopSpeed) -> float:
    """Return the loop's seconds between two frames."""
    match speed:
        case "real":
            return FRAME
        case "max":
            return SIMULATED_FRAME
        case Paced(factor):
            return FRAME * factor
        case LoopMaker():
            return SIMULATED_FRAME
    return FRAME * speed


@contextlib.asynccontextmanager
async def beside(work: Coroutine[object, object, None]) -> AsyncIterator[None]:
    """Let *work* go on beside a block, and end it with the block.

    An ElibError of *work* is ignored, since the block gets the same error; any other error is raised.
    """
    task = asyncio.create_task(work, name="elib live view")
    try:
        yield
    finally:
        task.cancel()
        await asyncio.wait([task])
    error = None if task.cancelled() else task.exception()
    if error is not None and not isinstance(error, ElibError):
        raise error


class Watcher:
    """The state of one robot, read off its link's own trace: to watch costs the robot nothing.

    Attributes:
        near: The newest proximity reading; None before the first.
        wheels: The speeds last asked for and confirmed, rev/s.
        duration: Robot time between :meth:`attach` and now or :meth:`finish`, s.
        statistics: The link's health at the end; None before :meth:`finish`.
        nearest: The highest count that any front sensor has seen.
    """

    def __init__(self) -> None:
        self.near: Proximity | None = None
        self.wheels = (0.0, 0.0)
        self.statistics: LinkStats | None = None
        self.nearest = 0
        self._robot: Epuck | None = None
        self._began = self._end = 0.0

    def attach(self, robot: Epuck) -> None:
        """Follow an open robot from now on."""
        self._robot = robot
        self._began = robot.time
        robot.trace(self._note)

    def finish(self, duration: float | None = None) -> None:
        """Take the numbers for the summary while the robot is still open; a second call changes nothing.

        Args:
            duration: Robot time that the run took, s; until now if None.
        """
        if self._robot is not None:
            self._end = self._robot.time if duration is None else self._began + duration
            self.statistics = self._robot.statistics
            self._robot = None

    @property
    def duration(self) -> float:
        """Robot time since :meth:`attach`, s."""
        return (self._end if self._robot is None else self._robot.time) - self._began

    def time_parts(self) -> Sequence[tuple[str, str]]:
        """Return the time so far, as parts of a line."""
        return [(f"{self.duration:6.1f} s  ", BOLD)]

    def robot_parts(self) -> Sequence[tuple[str, str]]:
        """Return what the robot sees and does, as parts of a line."""
        return sensor_parts(self.near or (), self.wheels)

    def _note(self, time: float, event: TraceEvent) -> None:
        if not isinstance(event, Ended) or event.error is not None:
            return
        if isinstance(event.value, Proximity):
            self.near = event.value
            self.nearest = max(self.nearest, *(event.value[i] for i in SHOWN))
        elif event.request.name == "set_speed" and len(event.request.numbers) == 2:
            left, right = event.request.numbers
            self.wheels = (left / STEPS_PER_REVOLUTION, right / STEPS_PER_REVOLUTION)
        elif event.request.name == "stop":
            self.wheels = (0.0, 0.0)


def bars(counts: Iterable[float]) -> str:
    """Return one block for each infrared count, higher for a nearer obstacle."""
    top = math.log1p(FULL / KNEE)
    shares = (math.log1p(max(count, 0.0) / KNEE) / top for count in counts)
    return "".join(BLOCKS[min(len(BLOCKS) - 1, round(share * (len(BLOCKS) - 1)))] for share in shares)


def sensor_parts(near: Sequence[float], wheels: tuple[float, float]) -> list[tuple[str, str]]:
    """Return what a robot sees and does, as parts of a line.

    Args:
        near: The counts of its infrared sensors; empty before the first reading.
        wheels: The speeds that its wheels were told, rev/s.
    """
    parts: list[tuple[str, str]] = [("left ", DIM)]
    for place, sensor in enumerate(SHOWN):
        if place == len(SHOWN) // 2:
            parts.append(("·", DIM))
        count = near[sensor] if near else 0
        colour = RED if count >= VERY_NEAR else YELLOW if count >= NEAR else GREEN
        parts.append((bars([count]), colour))
    return [*parts, (" right", DIM), (f"   wheels {wheels[0]:+.2f} {wheels[1]:+.2f} rev/s", CYAN)]


class RunDisplay:
    """The live line of a run, the lines that its behaviour says, and the Enter key that ends it.

    Args:
        name: Name of the behaviour.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._line = LiveLine()
        self._is_over = threading.Event()
        self._drawing = threading.Lock()

    def begin(self, context: RunContext, robots: Sequence[RobotReport]) -> None:
        """Show from now on the run and what its robots do."""
        context.listeners.append(self._print_said)
        if self._line.is_shown:
            whom = f"{len(robots)} robots"
            if len(robots) == 1:
                whom = f"{robots[0].robot.name} ({robots[0].robot.firmware})"
            say(f"{self._name}{f' on {whom}' if robots else ''}; Enter or Ctrl-C ends it")
            drawing = partial(self._draw, context, robots)
            threading.Thread(target=drawing, name="elib live line", daemon=True).start()
        ENTER.calls(lambda: context.finish("enter"))

    def end(self) -> None:
        """Remove the live line."""
        self._is_over.set()
        with self._drawing:
            self._line.clear()

    def _print_said(self, event: StateChanged | RunMessage) -> None:
        from elib.behaviours._run.context import RunMessage  # elib watch starts without the behaviours

        if isinstance(event, RunMessage):
            self.say(event.text)

    def say(self, text: str) -> None:
        """Print a line above the live line."""
        with self._drawing:
            self._line.clear()
            say(text)

    def _draw(self, context: RunContext, robots: Sequence[RobotReport]) -> None:
        while not self._is_over.wait(FRAME):
            with self._drawing:
                if not self._is_over.is_set():
                    self._line.show(self._parts(context, robots))

    def _parts(self, context: RunContext, robots: Sequence[RobotReport]) -> list[tuple[str, str]]:
        parts = [(f"{context.time:6.1f} s  ", BOLD)]
        if context.current_state:
            parts.append((f"{context.current_state:<12} ", YELLOW))
        if robots:
            parts.append((f"{math.fsum(each.distance for each in robots):6.2f} m   ", BOLD))
        if len(robots) == 1:
            near = robots[0].readings.get("proximity")
            parts += sensor_parts(near[-1][1] if near else (), robots[0].wheels)
        elif robots:
            parts.append((f"{len(robots)} robots", DIM))
        return parts


class EnterKey:
    """The Enter key, which ends the current run. One thread reads it, however many runs follow each other."""

    def __init__(self) -> None:
        self._pressed: Callable[[], object] | None = None
        self._reader: threading.Thread | None = None
        self._pause = threading.Event()

    def calls(self, function: Callable[[], object]) -> None:
        """Call *function* from now on for every Enter, in the thread that reads the key."""
        self._pressed = function
        if self._reader is None or not self._reader.is_alive():
            self._reader = threading.Thread(target=self._read, name="elib waits for Enter", daemon=True)
            self._reader.start()

    def _read(self) -> None:
        # The end of the input is not an Enter. The input may be closed meanwhile, or be that of a test.
        with contextlib.suppress(OSError, ValueError):
            while sys.stdin is not None and self._is_ours() and sys.stdin.readline():
                if self._pressed is not None:
                    self._pressed()

    def _is_ours(self) -> bool:
        """Wait until a key is for this program: one that reads a terminal in the background is suspended."""
        if not sys.stdin.isatty() or sys.platform == "win32":
            return True
        number = sys.stdin.fileno()
        while True:
            if os.tcgetpgrp(number) != os.getpgrp():
                self._pause.wait(BACKGROUND)
            elif select.select([number], [], [], BACKGROUND)[0] and os.tcgetpgrp(number) == os.getpgrp():
                return True


ENTER = EnterKey()
