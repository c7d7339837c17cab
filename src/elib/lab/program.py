"""The process of a checked program: ``python -m elib.lab.program FD FILE.py`` runs the file on the marker's robots."""

from __future__ import annotations

import asyncio
import inspect
import logging
import os
import runpy
import sys
from collections.abc import Mapping
from traceback import StackSummary, TracebackException

import elib
from elib import runner
from elib.behaviours import Behaviour, play
from elib.emulator.lockstep import MarkersTime, link_of
from elib.errors import LinkError
from elib.robot.substitute import substituted


def main(number: int, file: str) -> None:
    """Run a file as ``python FILE`` would, on the robots behind a file descriptor.

    Args:
        number: The file descriptor of the marker's socket.
        file: Path of the program.
    """
    link = link_of(number)
    # Whether the robot stands when the time is over cannot be known, and need not be told.
    link.on_over = lambda: logging.getLogger("elib").setLevel(logging.CRITICAL)
    count = len(link.codecs)
    urls = [f"lockstep://{number}" + (f"?robot={each}" if count > 1 else "") for each in range(1, count + 1)]
    asyncio.set_event_loop_policy(_Policy(number))
    sys.argv = [file]
    sys.path[0] = os.path.dirname(os.path.abspath(file))
    with substituted(urls, source="the lab"):
        try:
            found = runpy.run_path(file, run_name="__main__")
            if not link.was_used:
                _run_defined(found)
        except Exception as error:
            if link.is_over and isinstance(error, LinkError):
                sys.exit(1)  # the marker says why
            print("".join(_own(TracebackException.from_exception(error)).format()), end="", file=sys.stderr)
            sys.exit(1)


def _run_defined(found: Mapping[str, object]) -> None:
    """Run the behaviour that a file only defines, or else its ``async def main(robot)``, as ``elib run`` does."""
    own = [each for each in found.values() if isinstance(each, Behaviour) and each.function.__module__ == "__main__"]
    main = found.get("main")
    if len(own) == 1:
        play(own[0])
    elif not own and inspect.iscoroutinefunction(main) and len(inspect.signature(main).parameters) == 1:
        runner.run(main, argv=[])


def _own(error: TracebackException) -> TracebackException:
    """Leave out what elib and Python did: the author of a program looks for a line of his own."""
    folders = os.path.dirname(elib.__file__), os.path.dirname(asyncio.__file__), "<frozen"
    kept = [frame for frame in error.stack if not frame.filename.startswith(folders)]
    error.stack = StackSummary.from_list(kept)
    for before in (error.__cause__, error.__context__):
        if before is not None:
            _own(before)
    return error


class _Policy(asyncio.DefaultEventLoopPolicy):
    """Lets ``asyncio.run`` make event loops that keep the marker's time."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self._number = number

    def new_event_loop(self) -> asyncio.AbstractEventLoop:
        return MarkersTime(self._number).make()


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2])
