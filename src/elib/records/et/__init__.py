"""The Elib Tools, ``et``: filter, count and describe the rows of a log; each action is in ``actions``.

Exit codes: 0 success, 1 the output failed, 2 wrong usage or bad input, 130 Ctrl-C. Results go to stdout or to a file,
which is replaced as a whole or not at all; everything else goes to stderr.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from elib.base.errors import ElibError
from elib.base.exits import discard, exit_code


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``et`` and return its exit code."""
    return exit_code(lambda: execute(sys.argv[1:] if argv is None else argv))


def execute(tokens: Sequence[str], program: str = "et") -> None:
    """Carry out a command line.

    Raises:
        ArgumentError: The command line is wrong, or a row of the log is not what the action needs.
        ElibError: The output cannot be written, or a package that it needs is not installed.
        BrokenPipeError: The reader of the output has closed it.
    """
    try:
        if list(tokens) == ["--version"]:
            from elib import __version__

            print(f"{program} {__version__}")
        else:
            from elib.records.et.commandline import Help, page, parse

            request = parse(tokens)
            if isinstance(request, Help):
                print(page(request.action, program))
            else:
                from elib.records.et.work import perform

                perform(request)
        sys.stdout.flush()
    except OSError as error:
        discard(sys.stdout)
        if isinstance(error, BrokenPipeError):
            raise
        raise ElibError(f"{error.filename or 'the output'}: {error.strerror or error}") from None


__all__ = ["execute", "main"]
