"""Notice a program that waits with ``time.sleep()`` for a robot whose time is simulated, and stands still meanwhile."""

from __future__ import annotations

import asyncio
import dis
import logging
import sys
import time
from types import CodeType, FrameType

from elib.base.timebase import PacedLoop, SimulatedLoop

LEAST_PAUSE = 0.04
"""s without a turn of the loop from which on the program is looked at: its shortest sleeps are of 0.05 s."""

log = logging.getLogger("elib")


class SleepNotice:
    """Warns once. It looks only into code that calls the robot after a pause."""

    def __init__(self) -> None:
        self._is_given = False
        self._seen: set[CodeType] = set()

    def look(self, loop: asyncio.AbstractEventLoop | None) -> None:
        """Look at the program that calls now, and warn if it was at rest by ``time.sleep()``."""
        if self._is_given or not isinstance(loop, SimulatedLoop) or isinstance(loop, PacedLoop):
            return
        pause = time.monotonic() - loop.turned
        if pause < LEAST_PAUSE:
            return
        frame: FrameType | None = sys._getframe(1)  # noqa: SLF001  # the only way to the caller
        while frame is not None:
            if frame.f_code not in self._seen and _sleeps(frame):
                self._is_given = True
                log.warning(
                    "the program waited %.2g s in time.sleep(), and the robot's simulated time stood still at %.6g s "
                    "meanwhile; write robot.sleep() instead",
                    pause,
                    loop.time(),
                )
                return
            self._seen.add(frame.f_code)
            frame = frame.f_back


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
