"""Notice a program for which simulated time stands still: it waits by ``time.sleep()``, or only reads the clock."""

from __future__ import annotations

import asyncio
import dis
import logging
import sys
import time
from types import CodeType, FrameType

from elib.base.timebase import PacedLoop, SimulatedLoop

MIN_PAUSE = 0.04
"""s without a turn of the loop from which on the program is looked at: its shortest sleeps are of 0.05 s."""
MANY_READS = 100_000
"""Reads of a clock that stands still, after which the program is warned. They take some 0.1 s."""

log = logging.getLogger("elib")


class Standstill:
    """Warns once. It looks only into code that calls the robot after a pause."""

    def __init__(self) -> None:
        self._is_given = False
        self._seen: set[CodeType] = set()
        self._read = -1.0
        self._reads = 0
        """How often the clock gave the same time."""

    def look(self, loop: asyncio.AbstractEventLoop | None) -> None:
        """Look at the program that calls now, and warn if it was at rest by ``time.sleep()``."""
        if self._is_given or not isinstance(loop, SimulatedLoop) or isinstance(loop, PacedLoop):
            return
        pause = time.monotonic() - loop.turned
        if pause < MIN_PAUSE:
            return
        frame: FrameType | None = sys._getframe(1)  # noqa: SLF001  # the only way to the caller
        while frame is not None:
            if frame.f_code not in self._seen and _sleeps(frame):
                self._warn(
                    f"{loop.time():.6g} s while the program waited {pause:.2g} s in time.sleep()",
                    "robot.sleep() instead",
                )
                return
            self._seen.add(frame.f_code)
            # Above the program stands what runs it: a notebook's kernel has a time.sleep of its own.
            is_program = frame.f_globals.get("__name__") == "__main__" and frame.f_locals is frame.f_globals
            frame = None if is_program else frame.f_back

    def read(self, now: float) -> float:
        """Return *now*, the time that a blocking program reads, and warn if it reads the same one all the time."""
        self._reads = self._reads + 1 if now == self._read else 0
        self._read = now
        if self._reads == MANY_READS and not self._is_given:
            self._warn(f"{now:.6g} s while robot.time was read {MANY_READS} times", "robot.sleep(0.01) into the loop")
        return now

    def _warn(self, what: str, cure: str) -> None:
        self._is_given = True
        log.warning(
            "simulated time stood still at %s: it moves only while the program waits in a call; write %s", what, cure
        )


def _sleeps(frame: FrameType) -> bool:
    """Return whether the code of *frame* has a call of ``time.sleep``, by whatever name."""
    known = {**frame.f_globals, **frame.f_locals}
    before = None
    for step in dis.get_instructions(frame.f_code):
        value = known.get(step.argval) if isinstance(step.argval, str) else None
        if value is time.sleep or (before is time and step.argval == "sleep"):
            return True
        before = value
    return False
