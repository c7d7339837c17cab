"""The page of the command line, from its own help."""

from __future__ import annotations

import contextlib
import io
import os
from unittest import mock

from elib.cli import main
from elib.cli.program import APPS, COMMANDS, build

INTRODUCTION = """# Command line

What a command finds out goes to stdout, everything else to stderr. Exit codes: 0 done, 1 the robot or its link failed,
2 wrong usage, 130 after Ctrl-C, 143 after SIGTERM; `elib simulate` ends with 0 on either, its usual end.
`--robot URL` takes any of the [URLs](urls.md).

Every command of the robot is a sub-command of `elib send`: [Commands](commands.md) describes them, and
`elib send COMMAND --help` does too.
"""


def page() -> str:
    """Return the page."""
    pages: list[list[str]] = [[]]
    for name in COMMANDS:
        pages.append([name])
        if name in APPS and name != "send":  # whose sub-commands have a page of their own
            pages += [[name, part] for part in build([name])[name] if not part.startswith("-")]
    parts = [INTRODUCTION]
    for words in pages:
        called = " ".join(["elib", *words])
        parts.append(f"## {called}\n\n```text\n{help_of(words)}\n```")
    return "\n\n".join(part.strip() for part in parts)


def help_of(words: list[str]) -> str:
    """Return what ``--help`` prints, 80 columns wide and without colour.

    Raises:
        RuntimeError: It failed.
    """
    stream = io.StringIO()
    plain = {"COLUMNS": "80", "NO_COLOR": "1", "TERM": "dumb", "FORCE_COLOR": ""}
    with mock.patch.dict(os.environ, plain), contextlib.redirect_stdout(stream):
        if main([*words, "--help"]) != 0:
            raise RuntimeError(f"elib {' '.join(words)} --help failed")
    return "\n".join(line.rstrip() for line in stream.getvalue().strip().splitlines())
