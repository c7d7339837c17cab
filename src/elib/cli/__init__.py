"""The command line: ``elib demo``, ``elib run``, ``elib send``, ``elib simulate``.

Exit codes: 0 done, 1 the robot or its link failed, 2 wrong usage; 130 after Ctrl-C, 143 after SIGTERM. What a command
found out goes to stdout, everything else to stderr.
"""

from __future__ import annotations

import errno
import io
import os
import signal
import sys
from collections.abc import Sequence
from typing import TextIO

from elib.errors import ArgumentError, ElibError

DONE, ROBOT_FAILED, WRONG_USAGE = 0, 1, 2
INTERRUPTED = 128 + signal.SIGINT


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``elib`` and return its exit code.

    Args:
        argv: The command line without the program's name; the process's own unless given.
    """
    tokens = list(sys.argv[1:] if argv is None else argv)
    sys.stdout, sys.stderr = _usable(sys.stdout), _usable(sys.stderr)
    try:
        if tokens == ["--version"]:
            # Before the parser is imported: it takes longer than the answer.
            from elib import __version__

            print(f"elib {__version__}")
        else:
            from elib.cli.program import execute

            execute(tokens)
        sys.stdout.flush()
    except ArgumentError as error:
        return _complain(str(error), WRONG_USAGE)
    except ElibError as error:
        return _complain(str(error), ROBOT_FAILED)
    except BrokenPipeError:
        # Whoever read our output has enough of it. Python would complain once more when it flushes at the end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ROBOT_FAILED
    except OSError as error:
        if error.filename is None and error.errno != errno.ENOSPC:
            raise
        if error.filename is None:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _complain(f"{error.filename or 'the output'}: {error.strerror}", ROBOT_FAILED)
    except KeyboardInterrupt:
        return INTERRUPTED
    return DONE


def _usable(stream: TextIO | None) -> TextIO:
    """Return a stream that can be written to, whatever the terminal shows and whoever closed it."""
    if stream is None:  # closed by whoever started us
        return open(os.devnull, "w", encoding="utf-8")  # as long as the program
    if isinstance(stream, io.TextIOWrapper):
        stream.reconfigure(errors="replace")  # a terminal that cannot show a bar shows a question mark
    return stream


def _complain(text: str, code: int) -> int:
    from elib.cli.terminal import say

    sys.stdout.flush()
    say(f"error: {text}")
    return code
