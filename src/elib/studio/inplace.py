"""A lab's marker in the process of the program that it marks, where there are no others: calls carry the frames."""

from __future__ import annotations

import logging
import math
import signal
import time
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any, TypeVar

from elib.base.timebase import Host, HostedLoop, outside
from elib.behaviours._run.program import code_of
from elib.lab import Lab, Variant, VariantResult
from elib.lab.lockstep import link_of, linked
from elib.lab.marker import WALL, Marker, RunOver, wall_over
from elib.lab.program import main
from elib.lab.tracer import End, end_by
from elib.robot.signals import SIGNALS

GRACE = 0.5
"""s of the wall clock in which a program may end after its time was over."""

T = TypeVar("T")
Run = Callable[[str, Callable[[Path], BaseException | None], Callable[[], bool]], str]
"""Writes a program into a file, calls the function with it where programs run, and returns what was printed meanwhile.

The function returns the error that ended the program. While the other one returns True, what runs is ended, as Ctrl-C
ends it.
"""


class _Nowhere(Host):
    """Where a marker runs: only the program waits for its world."""

    def wait(self, seconds: float) -> None:
        """Do not wait."""


class InPlace:
    """A marker that a program in the same process reaches by calls: the channel of a lock-step link.

    Args:
        lab: The lab.
        variant: One of its variants.
        wall: How long the program may take by the wall clock, s.
    """

    def __init__(self, lab: Lab, variant: Variant, wall: float = WALL) -> None:
        self._wall, self._until = wall, time.perf_counter() + wall
        self._answer = b""
        self._end: End | None = None
        self._loop = HostedLoop(_Nowhere(), math.inf)
        self._do(self._begin(lab, variant))

    async def _begin(self, lab: Lab, variant: Variant) -> None:
        self._marker = Marker(lab, variant, self._send)

    def result(self, text: str, run: Run) -> VariantResult:
        """Run a program to its end, and return what became of it."""
        log, codes = logging.getLogger("elib"), [0]
        level = log.level

        def work(file: Path) -> BaseException | None:
            with linked(self) as number:
                link_of(number).on_jump = self._end_late
                codes[0], error = _ended(number, file)
            return error

        try:
            output = run(text, work, self._is_late)
            self._end = self._end or end_by(codes[0])
            return self._do(self._judge(self._end, output))
        finally:
            log.setLevel(level)  # a program whose time is over changes it
            with outside(self._loop):
                self._marker.close()
            self._loop.close()

    async def _judge(self, end: End, output: str) -> VariantResult:
        await self._marker.afterwards(self._marker.note(end))
        return self._marker.result(output)

    # -- the channel --

    def sendall(self, data: bytes) -> None:
        """Let the marker take a frame, while the program stands still."""
        if self._end is None:
            try:
                self._do(self._marker.take(data))
            except RunOver as over:
                self._stop(over)

    def recv(self, size: int) -> bytes:
        """Return the answer."""
        answer, self._answer = self._answer, b""
        return answer

    def close(self) -> None:
        """Do nothing: there is nothing to close."""

    def _send(self, frame: bytes) -> None:
        self._answer += frame

    def _stop(self, over: RunOver) -> None:
        self._end = over.ending, str(over), None
        self._until = min(self._until, time.perf_counter() + GRACE)

    def _end_late(self) -> None:
        """End a program that goes on after its time. One that catches this, too, hears it again."""
        if self._is_late():
            if self._end is None:
                self._stop(wall_over(self._wall))
            self._until = time.perf_counter() + GRACE
            raise KeyboardInterrupt

    def _is_late(self) -> bool:
        return time.perf_counter() > self._until

    def _do(self, work: Coroutine[Any, Any, T]) -> T:
        with outside():
            return self._loop.run_until_complete(work)


def _ended(number: int, file: Path) -> tuple[int, BaseException | None]:
    """Run a program on the robots of a link; return the exit code that its process would have, and its error."""
    try:
        main(number, str(file))
    except SystemExit as ending:
        return code_of(ending), ending.__cause__
    except KeyboardInterrupt:
        return -signal.SIGINT, None
    finally:
        SIGNALS.close_all()
    return 0, None
