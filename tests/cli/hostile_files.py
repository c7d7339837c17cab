"""A process with little memory that runs command lines, each in a copy of itself, and prints those that end badly.

Usage: ``python hostile_files.py FILE``, where FILE has a JSON list of command lines, each a list of words.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import json
import os
import resource
import signal
import sys
import traceback
from pathlib import Path

LIMIT = 300_000_000
"""Bytes of memory that a command may have for its data, that of its packages included."""
PATIENCE = 60
"""s that a command may take: it is hundreds of times what they take."""
IMPORTED = (
    "mcap.stream_reader",
    "zstandard",
    "PIL.Image",
    "elib.studies.fork",
    *(f"elib.cli.{name}" for name in ("compare", "decode", "fit", "program", "record", "replay", "send", "world")),
)
"""What most command lines need: it is imported once."""


class Sink(io.TextIOBase):
    """A stream of whose text the end is kept."""

    def __init__(self) -> None:
        self.kept = ""

    def write(self, text: str) -> int:
        self.kept = (self.kept + text)[-100_000:]
        return len(text)


def complaint(words: list[str]) -> str:
    """Run a command line; return what is wrong with how it ended, or an empty string."""
    from elib.cli import main

    out, err = Sink(), Sink()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main(words)
        except SystemExit as error:
            code = error.code if isinstance(error.code, int) else 1
        except BaseException:
            return traceback.format_exc(limit=-6)
    if "Traceback" in err.kept:
        return err.kept
    if code not in (0, 1, 2) or (code and "error: " not in err.kept):
        return f"exit code {code}: {err.kept}"
    return "a control character was shown" if "\x1b" in out.kept + err.kept else ""


def apart(words: list[str]) -> None:
    """Run a command line in a copy of this process; print what is wrong with how it ended."""
    sys.stdout.flush()
    child = os.fork()
    if not child:
        signal.alarm(PATIENCE)
        if found := complaint(words):
            print(json.dumps({"words": words, "found": found}), flush=True)
        os._exit(0)
    _, status = os.waitpid(child, 0)
    if status:
        found = "it hung" if os.WTERMSIG(status) == signal.SIGALRM else f"it died with status {status}"
        print(json.dumps({"words": words, "found": found}), flush=True)


def serve(path: Path) -> None:
    resource.setrlimit(resource.RLIMIT_DATA, (LIMIT, LIMIT))
    for name in IMPORTED:
        importlib.import_module(name)
    lines = json.loads(path.read_text())
    for words in lines:
        apart(words)
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    print(json.dumps({"count": len(lines), "peak": peak}), flush=True)


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
