"""A log of what a robot was asked and what it answered."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from pathlib import Path

from elib.behaviours import RunContext, behaviour
from elib.behaviours._run.tours import run_steps
from elib.behaviours.sensors_tour import STEPS
from elib.errors import ArgumentError
from elib.robot.blocking import BlockingEpuck

FILE = "elib.log"
TIMEOUTS = (1.0, 0.5)
"""s for each answer, on the first tour and on the second (elib-2011, 6.10)."""


def candidates(name: str) -> Iterator[str]:
    """Yield ``run.log``, ``run1.log``, ``run2.log`` and so on: the number stands before the ending."""
    path = Path(name)
    yield name
    for number in count(1):
        yield str(path.with_name(f"{path.stem}{number}{path.suffix}"))


def make_free(name: str) -> Path:
    """Make a new, empty file, named by the first candidate that no other has, and return its path.

    Raises:
        ArgumentError: There can be none in this folder.
    """
    for candidate in candidates(name):
        try:
            # Made in one step: had it been looked for first, two programs could take the same name.
            with open(candidate, "x", encoding="utf-8"):
                return Path(candidate)
        except FileExistsError:
            continue
        except OSError as error:
            raise ArgumentError(
                f"{candidate} cannot be written: {error.strerror}", hint="change to a folder that you may write in"
            ) from error
    raise AssertionError("numbers never end")


@behaviour
def keep_log(robot: BlockingEpuck, run: RunContext) -> None:
    """Take the sensors' tour twice, and log every call to a file of its own.

    The log is elib.log in the current folder, or elib1.log and so on where that is taken. Each line has the time, the
    robot, call, ok or ko, the command, and how many calls had not been sent and not been answered.
    """
    path = make_free(FILE)
    with robot.log(path) as log:
        for timeout in TIMEOUTS:
            log.comment(f"every answer may take {timeout:g} s")
            run_steps(robot, run, STEPS, timeout)
        log.stop()
    run.say(f"the log is in {path.absolute()}")
