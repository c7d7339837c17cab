"""``elib states``: the state machine of a program, in words and as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.exits import FAILED
from elib.base.files import read_file, write_file
from elib.base.plaintext import plain
from elib.cli.arguments import option
from elib.tools.states.drawing import draw
from elib.tools.states.text import MachineText

MAX_SIZE = 1_000_000
"""Bytes of a program that is read."""


def states(
    file: Annotated[Path, Cli(help="The program.")],
    *,
    picture: Annotated[Path | None, option("--draw FILE", "Draw the picture into this SVG file.")] = None,
) -> None:
    """Show the state machine of a program: its states, what leads from one to another, and what is wrong with it.

    The program is read, and not run. If something is wrong with its states, the exit code is 1.

    For example:
        elib states my_robot.py
        elib states my_robot.py --draw machine.svg
    """
    try:
        program = MachineText(read_file(file, "the program", largest=MAX_SIZE).decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise ArgumentError(f"{file} is not a text in UTF-8", hint="save it as UTF-8") from None
    for name in program.states:
        print(f"{name}{'  (begins here)' * (name == program.start)}")
        for arrow in program.arrows:
            if arrow.source == name:
                print(plain(f"  {arrow.words}: {arrow.target}"))
    for problem in program.problems:
        print(plain(f"wrong: {problem}"))
    if picture is not None:
        write_file(picture, draw(program).encode())
    if program.problems:
        raise SystemExit(FAILED)
