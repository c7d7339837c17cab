"""The process of a checked program: ``python -m elib.lab.program FD FILE.py`` runs the file on the marker's robots."""

from __future__ import annotations

import logging
import random
import sys
from pathlib import Path

from elib.base.errors import LinkError
from elib.behaviours._run.program import loops_at, own_traceback, run_file
from elib.lab.lockstep import MarkersTime, link_of
from elib.robot.substitute import substituted


def main(number: int, file: str) -> None:
    """Run a file as ``python FILE`` would, on the robots behind a file descriptor."""
    random.seed(0)  # noqa: TID251  # the program's own numbers: it has the same marks on every run
    link = link_of(number)
    # Whether the robot stands when the time is over cannot be known, and need not be told.
    link.on_over = lambda: logging.getLogger("elib").setLevel(logging.CRITICAL)
    count = len(link.codecs)
    urls = [f"lockstep://{number}" + (f"?robot={each}" if count > 1 else "") for each in range(1, count + 1)]
    hint = "open a robot once and use it in the whole program, or close it before you open it again"
    with substituted(urls, source="the lab", hint=hint), loops_at(MarkersTime(number)):
        try:
            run_file(Path(file), has_driven=lambda: link.was_used)
        except Exception as error:
            if link.is_over and isinstance(error, LinkError):
                sys.exit(1)  # the marker says why
            print(own_traceback(error), file=sys.stderr)
            raise SystemExit(1) from error


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2])
