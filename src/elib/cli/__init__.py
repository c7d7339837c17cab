"""The command line ``elib``: the parser in ``program``, and a module for each command, such as ``demo``.

A command, and each function that it calls here, raises ArgumentError if its command line is wrong, and then nothing was
sent to a robot; another ElibError if a robot, a link or a file fails; and SystemExit if what it was asked to check is
not in order.

Exit codes: 0 done, 1 another error or what is not in order, 2 wrong usage; 130 after Ctrl-C, 143 after SIGTERM, and 0
after both if they are the usual end of a command, such as a server. What a command found out goes to stdout, everything
else to stderr.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from elib.base.exits import exit_code


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``elib`` and return its exit code."""
    tokens = list(sys.argv[1:] if argv is None else argv)
    return exit_code(lambda: _run(tokens))


def _run(tokens: Sequence[str]) -> None:
    if tokens == ["--version"]:
        # Before the parser is imported, which takes longer than the answer.
        from elib import __version__

        print(f"elib {__version__}")
        return
    from elib.cli.program import execute

    execute(tokens)
