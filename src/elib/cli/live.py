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

from elib.base.errors import ElibError
from elib.base.tasks import end_tasks
from elib.base.timebase import LoopMaker, LoopSpeed, Paced
from elib.cli.terminal import BLOCKS, BOLD, CYAN, DIM, GREEN, RED, YELLOW, LiveLine, say

if TYPE_CHECKING:
    from elib.behaviours._run.context import RunContext, RunEvent
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
        await end_tasks(task)
    error = None if task.cancelled() else task.exception()
    if error is not None and not isinstance(error, ElibError):
        raise error


def bars(counts: Iterable[float]) -> str:
    """Return one block for each infrared count, higher for a nearer obstacle."""
    top = math.log1p(FULL / KNEE)
    shares = (math.log1p(max(count, 0.0) / KNEE) / top for count in counts)
    return "".join(BLOCKS[min(len(BLOCKS) - 1, round(share * (len(BLOCKS) - 1)))] for share in shares)


def sensor_parts(near: Sequence[float]) -> list[tuple[str, str]]:
    """Return what a robot sees by its infrared counts, as parts of a line; there are none before the first reading."""
    parts: list[tuple[str, str]] = [("left ", DIM)]
    for place, sensor in enumerate(SHOWN):
        if place == len(SHOWN) // 2:
            parts.append(("·", DIM))
        count = near[sensor] if near else 0
        colour = RED if count >= VERY_NEAR else YELLOW if count >= NEAR else GREEN
        parts.append((bars([count]), colour))
    return [*parts, (" right", DIM)]


class RunDisplay:
    """The live line of a run, the lines that its behaviour says, and the Enter key that ends it."""

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

    def _print_said(self, event: RunEvent) -> None:
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
            parts += sensor_parts(near[-1][1] if near else ())
            left, right = robots[0].wheels
            parts.append((f"   wheels {left:+.2f} {right:+.2f} rev/s", CYAN))
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
