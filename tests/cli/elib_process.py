"""The program as a person runs it: a process of its own, whose output is waited for with a bound."""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from shared import PATIENCE, run

COMMAND = [sys.executable, "-m", "elib"]
Told = Callable[..., str]
"""Takes the words of a command and returns what was said: the fixtures ``printed`` and ``refused``."""
Ran = Callable[..., tuple[int, str, str]]
"""Takes the words of a command and returns exit code, stdout and stderr: the fixture ``ran``."""


def environment(**changes: str) -> dict[str, str]:
    """Return an environment without the terminal settings of the person who runs the tests."""
    kept = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES", "NO_COLOR")}
    return {**kept, "TERM": "xterm-256color", **changes}


def elib(*arguments: str, cwd: Path | None = None, **changes: str) -> subprocess.CompletedProcess[str]:
    """Run ``elib`` to its end."""
    return run([*COMMAND, *arguments], cwd=cwd, env=environment(**changes))


class Output:
    """The lines of one stream, read as they come."""

    def __init__(self, stream: IO[str]) -> None:
        self.seen: list[str] = []
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, args=(stream,), daemon=True)
        self._reader.start()

    def line(self) -> str:
        """Return the next line, without its end; fail when none comes in time or the stream has ended."""
        line = self._lines.get(timeout=PATIENCE)
        assert line is not None, f"the output ended after {self.seen}"
        self.seen.append(line)
        return line

    def until(self, text: str) -> str:
        """Return the next line that contains *text*."""
        while text not in (line := self.line()):
            pass
        return line

    def rest(self) -> str:
        """Return everything that came, at the end of the program."""
        self._reader.join(PATIENCE)
        while (line := self._lines.get(timeout=PATIENCE)) is not None:
            self.seen.append(line)
        self._lines.put(None)
        return "\n".join(self.seen)

    def _read(self, stream: IO[str]) -> None:
        with stream:
            for line in stream:
                self._lines.put(line.rstrip("\n"))
        self._lines.put(None)


@dataclass(slots=True)
class Running:
    """A program that goes on."""

    process: subprocess.Popen[str]
    out: Output
    err: Output

    def press_enter(self) -> None:
        """Press Enter."""
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def end(self, number: signal.Signals = signal.SIGINT) -> int:
        """Send a signal, wait for the end and return the exit code."""
        self.process.send_signal(number)
        return self.process.wait(PATIENCE)


@contextmanager
def started(*arguments: str, cwd: Path | None = None, command: Sequence[str] = tuple(COMMAND)) -> Iterator[Running]:
    """Start ``elib``, or another *command*; it is killed at the end of the block if it still runs."""
    process = subprocess.Popen(
        [*command, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=cwd,
        env=environment(),
    )
    assert process.stdout is not None
    assert process.stderr is not None
    running = Running(process, Output(process.stdout), Output(process.stderr))
    try:
        yield running
    finally:
        if process.poll() is None:
            process.kill()
        process.wait(PATIENCE)
        assert process.stdin is not None
        with suppress(BrokenPipeError):
            process.stdin.close()
        running.out.rest()
        running.err.rest()
