"""What is happening, for a line on the terminal: read off the link's own trace, so watching costs the robot nothing."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Coroutine, Sequence

from elib.body import STEPS_PER_REVOLUTION
from elib.cli.terminal import BOLD, CYAN, DIM, GREEN, RED, YELLOW, bars
from elib.errors import ElibError
from elib.protocol.values import Proximity
from elib.robot.aio import Epuck
from elib.session import Ended, TraceEvent
from elib.session.statistics import LinkStats
from elib.timebase import LoopSpeed, Paced

FRAME = 0.1
"""s of a person's time between two frames of the live line."""
SIMULATED_FRAME = 1.0
"""s of simulated time between two frames, where it runs as fast as the processor allows."""
FULL, KNEE = 4000.0, 60.0
"""Counts of a full bar, and where its scale turns logarithmic: above the noise of a free sensor."""
NEAR, VERY_NEAR = 160, 450
"""Counts from which a bar is shown as a warning: about 4 cm and 2.5 cm (robot-model, 2.3)."""
SHOWN = (5, 6, 7, 0, 1, 2)
"""The sensors of the front half, from left to right."""


def period_of(speed: LoopSpeed) -> float:
    """Return the loop's seconds between two frames."""
    match speed:
        case "real":
            return FRAME
        case "max":
            return SIMULATED_FRAME
        case Paced(factor):
            return FRAME * factor
    return FRAME * speed


@contextlib.asynccontextmanager
async def beside(work: Coroutine[object, object, None]) -> AsyncIterator[None]:
    """Let *work* go on beside a block, and end it with the block.

    What the robot does to it (an ElibError) is left to the block, which meets the same; any other error is raised.
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
    """Follows one robot.

    Attributes:
        near: The newest proximity reading, or None before the first.
        wheels: The speeds last asked for and confirmed, rev/s.
        duration: Robot time between :meth:`attach` and now or :meth:`finish`, s.
        statistics: The link's health at the end; None before :meth:`finish`.
        nearest: The highest count any front sensor has seen.
    """

    def __init__(self) -> None:
        self.near: Proximity | None = None
        self.wheels = (0.0, 0.0)
        self.statistics: LinkStats | None = None
        self.nearest = 0
        self._robot: Epuck | None = None
        self._began = self._end = 0.0

    def attach(self, robot: Epuck, began: float | None = None) -> None:
        """Follow *robot* from now on.

        Args:
            robot: It is open.
            began: s on the robot's clock, where its loop is not the one that runs here; now if None.
        """
        self._robot = robot
        self._began = robot.time if began is None else began
        robot.trace(self._note)

    def finish(self, duration: float | None = None) -> None:
        """Keep what there is to sum up, while the robot is still open; repeating it changes nothing.

        Args:
            duration: How long it took, s; until now if None.
        """
        if self._robot is not None:
            self._end = self._robot.time if duration is None else self._began + duration
            self.statistics = self._robot.statistics
            self._robot = None

    @property
    def duration(self) -> float:
        """Robot time since :meth:`attach`, s."""
        return (self._end if self._robot is None else self._robot.time) - self._began

    def parts(self) -> Sequence[tuple[str, str]]:
        """Return the line: texts, each with its SGR colour code."""
        return [*self.time_parts(), *self.robot_parts()]

    def time_parts(self) -> Sequence[tuple[str, str]]:
        """Return how long it takes by now, as parts of a line."""
        return [(f"{self.duration:6.1f} s  ", BOLD)]

    def robot_parts(self) -> Sequence[tuple[str, str]]:
        """Return what the robot sees and does, as parts of a line."""
        counts = [self.near[i] if self.near is not None else 0 for i in SHOWN]
        shown: list[tuple[str, str]] = [("left ", DIM)]
        for place, count in enumerate(counts):
            if place == len(counts) // 2:
                shown.append(("·", DIM))
            colour = RED if count >= VERY_NEAR else YELLOW if count >= NEAR else GREEN
            shown.append((bars([count], FULL, KNEE), colour))
        left, right = self.wheels
        shown += [(" right", DIM), (f"   wheels {left:+.2f} {right:+.2f} rev/s", CYAN)]
        return shown

    def _note(self, time: float, event: TraceEvent) -> None:
        if not isinstance(event, Ended) or event.error is not None:
            return
        if isinstance(event.value, Proximity):
            self.near = event.value
            self.nearest = max(self.nearest, *(event.value[i] for i in SHOWN))
        elif event.request.name == "set_speed":
            left, right = event.request.numbers
            self.wheels = (left / STEPS_PER_REVOLUTION, right / STEPS_PER_REVOLUTION)
        elif event.request.name == "stop":
            self.wheels = (0.0, 0.0)
