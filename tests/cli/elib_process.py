"""The program as a person runs it: a process of its own, whose output is waited for with a bound."""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

PATIENCE = 20.0
"""s that a process may take to say or do what is expected of it, on a busy machine."""

COMMAND = [sys.executable, "-m", "elib"]


def environment(**changes: str) -> dict[str, str]:
    """Return an environment without the terminal of whoever runs the tests."""
    kept = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES", "NO_COLOR")}
    return {**kept, "TERM": "xterm-256color", **changes}


def elib(*arguments: str, cwd: Path | None = None, **changes: str) -> subprocess.CompletedProcess[str]:
    """Run ``elib`` to its end."""
    return subprocess.run(
        [*COMMAND, *arguments],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        cwd=cwd,
        env=environment(**changes),
        check=False,
    )


@dataclass(slots=True)
class Running:
    """A program that goes on."""

    process: subprocess.Popen[str]
    lines: queue.SimpleQueue[str]

    def line(self) -> str:
        """Return the next line of its stdout."""
        return self.lines.get(timeout=PATIENCE).rstrip("\n")

    def end(self, number: signal.Signals = signal.SIGINT) -> int:
        """Send a signal, wait for the end and return the exit code."""
        self.process.send_signal(number)
        return self.process.wait(PATIENCE)

    @property
    def stderr(self) -> str:
        """What an ended program said on stderr."""
        assert self.process.stderr is not None
        return self.process.stderr.read()


@contextmanager
def started(*arguments: str, cwd: Path | None = None) -> Iterator[Running]:
    """Start ``elib``; it is killed at the end of the block if it still runs."""
    process = subprocess.Popen(
        [*COMMAND, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=cwd,
        env=environment(PYTHONUNBUFFERED="1"),
    )
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read(source: Sequence[str] | Iterator[str]) -> None:
        for line in source:
            lines.put(line)

    assert process.stdout is not None
    reader = threading.Thread(target=read, args=(process.stdout,), daemon=True)
    reader.start()
    try:
        yield Running(process, lines)
    finally:
        if process.poll() is None:
            process.kill()
        process.wait(PATIENCE)
        reader.join(PATIENCE)
        process.stdout.close()
        assert process.stderr is not None
        process.stderr.close()
