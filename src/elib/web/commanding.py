"""One command for one robot, as a page asks for it: checked before anything is sent."""

from __future__ import annotations

from elib.errors import ArgumentError
from elib.protocol.commands import SPECS
from elib.robot.actions import catalogue
from elib.robot.aio import Epuck

LONGEST_TEXT = 200
"""Characters of a raw command: the robots' own line buffers are shorter."""
PATIENCE = 1.0
"""s that a command from the page may take, or its own time where that is longer."""


def check(robot: Epuck, name: object, arguments: tuple[object, ...]) -> None:
    """Check a command before anything is sent.

    Raises:
        ArgumentError: There is no such command, or an argument is wrong.
        Unsupported: This firmware has no such command.
    """
    if not isinstance(name, str) or name not in catalogue():
        raise ArgumentError(f"there is no command {name!r}")
    catalogue()[name].check(robot.context, *arguments)
    if name == "text" and len(str(arguments[0])) > LONGEST_TEXT:
        raise ArgumentError(f"a raw command is one line of 1 to {LONGEST_TEXT} characters")


def may_drive(name: str, arguments: tuple[object, ...]) -> bool:
    """Return whether the robot may drive on by itself after a command."""
    if name == "text":  # the e-puck2 reads small letters as capitals
        return str(arguments[0]).lstrip().upper().startswith("D")
    return catalogue()[name].wheels == "drive"


def patience(name: str) -> float:
    """Return how long the answer to a command may take, s."""
    return max(PATIENCE, SPECS[name].timeout) if name in SPECS else PATIENCE


__all__ = ["check", "may_drive", "patience"]
