"""What the tests of several packages share: the loop's time, Python programs, ports that are held, a terminal."""

from __future__ import annotations

import asyncio
import io
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager

PATIENCE = 20.0
"""s that a process may take to do what is expected of it, on a busy machine."""
GREETING = b'\x0c\r\nWELCOME to the SerCom protocol on e-Puck\r\nthe EPFL education robot type "H" for help\r\n'
"""What a robot sends when it starts."""


def now() -> float:
    """Return the time of the running event loop, s."""
    return asyncio.get_running_loop().time()


def run_python(program: str, *, seconds: float = PATIENCE, check: bool = False) -> subprocess.CompletedProcess[str]:
    """Run a program in another Python and wait for its end; fail if it fails and *check* is true."""
    return subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True, timeout=seconds, check=check
    )


@contextmanager
def held(path: str, *, locks: bool = False) -> Iterator[int]:
    """Let another process have the port *path* open, and lock it if asked; yield its number."""
    lock = "fcntl.flock(f, 2);" if locks else ""
    code = f"import fcntl, sys; f = open(sys.argv[1], 'r+b', 0); {lock} print(flush=True); sys.stdin.read()"
    process = subprocess.Popen([sys.executable, "-c", code, path], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert process.stdout is not None
    try:
        process.stdout.readline()
        yield process.pid
    finally:
        process.communicate(timeout=PATIENCE)


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True
