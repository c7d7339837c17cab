"""The Elib Tools, ``et``: filter, count and describe the rows of a log; each action is in :mod:`elib.et.actions`.

Exit codes: 0 success, 1 the output failed, 2 wrong usage or bad input, 130 Ctrl-C. Results go to stdout or to a file,
which is replaced as a whole or not at all; everything else goes to stderr.
"""

from __future__ import annotations

import io
import os
import signal
import sys
from collections.abc import Sequence
from typing import TextIO

from elib.errors import ArgumentError, ElibError
from elib.plaintext import plain

DONE, FAILED, WRONG_USAGE = 0, 1, 2
INTERRUPTED = 128 + signal.SIGINT


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``et`` and return its exit code.

    Args:
        argv: The command line without the program's name; the process's own unless given.
    """
    sys.stdout, sys.stderr = _usable(sys.stdout), _usable(sys.stderr)
    try:
        execute(sys.argv[1:] if argv is None else argv)
    except ArgumentError as error:
        return _complain(str(error), WRONG_USAGE)
    except ElibError as error:
        return _complain(str(error), FAILED)
    except BrokenPipeError:
        return FAILED  # whoever read it has enough
    except KeyboardInterrupt:
        return INTERRUPTED
    return DONE


def execute(tokens: Sequence[str], program: str = "et") -> None:
    """Carry out a command line.

    Args:
        tokens: The words of the command line, without the program's name.
        program: The program's name, for the help.

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
            _execute(tokens, program)
        sys.stdout.flush()
    except OSError as error:
        _forget_output()
        if isinstance(error, BrokenPipeError):
            raise
        raise ElibError(f"{error.filename or 'the output'}: {error.strerror or error}") from None


def _execute(tokens: Sequence[str], program: str) -> None:
    from elib.et.commandline import Help, page, parse

    request = parse(tokens)
    if isinstance(request, Help):
        print(page(request.action, program))
        return
    from elib.et.work import perform

    perform(request)


def _usable(stream: TextIO | None) -> TextIO:
    """Return a stream that can be written to, whatever the terminal shows and whoever closed it."""
    if stream is None:
        return open(os.devnull, "w", encoding="utf-8")  # as long as the program
    if isinstance(stream, io.TextIOWrapper):
        stream.reconfigure(errors="replace")
    return stream


def _forget_output(stream: TextIO | None = None) -> None:
    """Let nothing be written any more: Python would complain once more when it flushes at the end."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), (stream or sys.stdout).fileno())
    except (OSError, ValueError):
        return


def _complain(text: str, code: int) -> int:
    try:
        print(f"error: {plain(text)}", file=sys.stderr, flush=True)
    except OSError:  # nobody listens any more; the code says it
        _forget_output(sys.stderr)
    return code


__all__ = ["execute", "main"]
