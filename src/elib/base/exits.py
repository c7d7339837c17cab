"""How the programs of elib end: the error on stderr, and the exit code."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import signal
import sys
from collections.abc import Callable
from typing import TextIO

from elib.base.errors import ArgumentError, ElibError
from elib.base.plaintext import plain

DONE, FAILED, WRONG_USAGE, INTERRUPTED = 0, 1, 2, 128 + signal.SIGINT


def exit_code(work: Callable[[], object]) -> int:
    """Do the work of a program and return its exit code; an error is printed on stderr."""
    sys.stdout, sys.stderr = _writable(sys.stdout), _writable(sys.stderr)
    try:
        work()
        sys.stdout.flush()
    except ElibError as error:
        return complain(error)
    except BrokenPipeError:  # the program that reads the output has enough of it
        discard(sys.stdout)
        return FAILED
    except OSError as error:
        if error.filename is None and error.errno != errno.ENOSPC:
            raise
        if error.filename is None:
            discard(sys.stdout)
        return complain(ElibError(f"{error.filename or 'the output'}: {error.strerror}"))
    except KeyboardInterrupt:
        return INTERRUPTED
    return DONE


def complain(error: ElibError) -> int:
    """Print an error on stderr and return the exit code for it."""
    try:
        sys.stdout.flush()
        print(f"error: {plain(str(error))}", file=sys.stderr, flush=True)
    except OSError:  # its reader has closed it; the exit code still tells
        discard(sys.stdout)
        discard(sys.stderr)
    return WRONG_USAGE if isinstance(error, ArgumentError) else FAILED


def discard(stream: TextIO) -> None:
    """Write nothing to *stream* any more: Python would complain once more when it flushes at the end."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _writable(stream: TextIO | None) -> TextIO:
    """Return a stream that can be written to, whatever the terminal can show, and even if it was closed before."""
    if stream is None:
        return open(os.devnull, "w", encoding="utf-8")  # open as long as the program runs
    if isinstance(stream, io.TextIOWrapper):
        stream.reconfigure(errors="replace")  # a terminal that cannot show a character shows a question mark
    return stream
