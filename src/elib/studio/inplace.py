"""A lab's marker in the process of the program that it marks, where there are no others: calls carry the frames."""

from __future__ import annotations

import asyncio
import logging
import math
import signal
import time
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

from elib.base.timebase import Host, HostedLoop, outside
from elib.behaviours._run.program import code_of
from elib.lab import Lab, Variant, VariantResult
from elib.lab.labfile import settings_of
from elib.lab.lockstep import linked
from elib.lab.marker import GRACE, WALL, Marker, RunOver, WallOver
from elib.lab.program import main
from elib.lab.tracer import AFTERWARDS, End, Tracer, end_by
from elib.robot.signals import SIGNALS
from elib.simulator.emulator.simulation import Simulation

Run = Callable[[str, Callable[[Path], object], Callable[[], bool]], str]
"""Writes a program into a file, calls the function with it where programs run, and returns what was printed meanwhile.

While the other function returns True it ends what runs, as Ctrl-C does.
"""


class _Nowhere(Host):
    """Where a marker runs: nobody waits for its world but the program."""

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
        assert variant.time is not None
        self._simulation = Simulation(settings_of(variant))
        self._tracer = Tracer(lab, variant, self._simulation)
        self._marker = Marker(self._simulation, variant.time, self._send, self._tracer.counts_requests)

    def result(self, text: str, run: Run) -> VariantResult:
        """Run a program to its end, and return what became of it."""
        log, codes = logging.getLogger("elib"), [0]
        level = log.level

        def work(file: Path) -> None:
            with linked(self) as number:
                codes[0] = _exit_code(number, file)

        try:
            output = run(text, work, self._is_late)
            ended, self._end = self._simulation.time, self._end or end_by(codes[0])
            if self._end[2] is not None:
                self._do(asyncio.sleep(AFTERWARDS))
            digest = self._marker.transcript.hexdigest()
            return self._tracer.judged(self._end, ended, self._marker.requests, output, digest)
        finally:
            log.setLevel(level)  # a program whose time is over changes it
            with outside(self._loop):
                self._simulation.close()
            self._loop.close()

    # -- the channel --

    def sendall(self, data: bytes) -> None:
        """Let the marker take a frame, while the program stands still."""
        if self._end is not None:
            return
        try:
            if self._is_late():
                raise WallOver(self._wall)
            self._do(self._marker.take(data))
        except RunOver as over:
            self._end = over.ending, str(over), None
            self._until = min(self._until, time.perf_counter() + GRACE)

    def recv(self, size: int) -> bytes:
        """Return the answer."""
        answer, self._answer = self._answer, b""
        return answer

    def close(self) -> None:
        """Do nothing: there is nothing to close."""

    def _send(self, frame: bytes) -> None:
        self._answer += frame

    def _is_late(self) -> bool:
        return time.perf_counter() > self._until

    def _do(self, work: Coroutine[Any, Any, None]) -> None:
        with outside():
            self._loop.run_until_complete(work)


def _exit_code(number: int, file: Path) -> int:
    """Run a program on the robots of a link, and return the exit code that its process would have."""
    try:
        main(number, str(file))
    except SystemExit as ending:
        return code_of(ending)
    except KeyboardInterrupt:
        return -signal.SIGINT
    finally:
        SIGNALS.close_all()
    return 0
