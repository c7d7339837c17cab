"""Log the calls of a program and their outcomes."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from pathlib import Path

from elib.base.errors import ArgumentError
from elib.behaviours import RunContext, behaviour
from elib.behaviours._run.tours import run_steps
from elib.behaviours.sensors_tour import STEPS
from elib.robot.blocking import BlockingEpuck

FILE = "elib.log"
TIMEOUTS = (1.0, 0.5)
"""s for each answer, in the first and in the second tour (as in Elib of 2011)."""


def candidates(name: str) -> Iterator[str]:
    """Yield ``run.log``, ``run1.log``, ``run2.log`` and so on, with the number before the ending."""
    path = Path(name)
    yield name
    for number in count(1):
        yield str(path.with_name(f"{path.stem}{number}{path.suffix}"))


def make_free(name: str) -> Path:
    """Make a new, empty file with the first candidate name that is free, and return its path.

    Raises:
        ArgumentError: A file cannot be made in this folder.
    """
    for candidate in candidates(name):
        try:
            # Checked and made in one step: otherwise two programs could take the same name.
            with open(candidate, "x", encoding="utf-8"):
                return Path(candidate)
        except FileExistsError:
            continue
        except OSError as error:
            raise ArgumentError(
                f"{candidate} cannot be written: {error.strerror}", hint="change to a folder that you may write in"
            ) from error
    raise AssertionError("unreachable")


@behaviour(group="samples of 2011")
def log_tours(robot: BlockingEpuck, run: RunContext) -> None:
    """Run the tour of the sensors twice, and log every call to a new file.

    The log is elib.log in the current folder, or elib1.log and so on if that exists. Each line has the time, the robot,
    call, ok or ko, the command, and how many calls had not been sent and not been answered.
    """
    path = make_free(FILE)
    with robot.log(path) as log:
        for timeout in TIMEOUTS:
            log.comment(f"every answer may take {timeout:g} s")
            run_steps(robot, run, STEPS, timeout)
        log.stop()
    run.say(f"the log is in {path.absolute()}")
