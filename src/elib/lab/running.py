"""One run of a program in one variant of a lab, in a process of its own, which a socket joins to its world."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import subprocess
import sys
import threading
import time
import types
from collections.abc import Callable, Coroutine, Generator, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Protocol

from elib.base.errors import ElibError, Unsupported
from elib.base.extras import install
from elib.base.timebase import SimulatedLoop
from elib.lab.labfile import Lab, Variant
from elib.lab.lockstep import LETTER, MAX_MESSAGE
from elib.lab.marker import GRACE, WALL, BrokenRule, Marker, RunOver, wall_over
from elib.lab.tracer import End, VariantResult, end_by

LOOK = 0.1
"""s of the wall clock between two looks at whether a silent program still runs."""
MAX_OUTPUT = 1_000_000
"""Bytes of a program's output that are kept."""


class Running(Protocol):
    """A program that runs in a process of its own."""

    @property
    def output(self) -> str:
        """What it printed so far."""
        ...

    def poll(self) -> int | None:
        """Return its exit code, -N if signal N ended it, or None while it runs."""
        ...

    def kill(self) -> None:
        """End it at once, with all that it started. Safe to repeat."""
        ...


def program_command(program: str | PathLike[str], number: int) -> list[str]:
    """Return the command line that runs a program on the robots behind the file descriptor *number*."""
    return [sys.executable, "-m", "elib.lab.program", str(number), str(program)]


def run_variant(
    lab: Lab, variant: Variant, start: Callable[[socket.socket], Running], *, wall: float = WALL
) -> VariantResult:
    """Run a program in a variant of a lab, and judge it. In a game the other half of the robots stand.

    Args:
        lab: The lab.
        variant: One of its variants.
        start: Starts the program with its end of the link, whose file descriptor the process must inherit.
        wall: How long it may take by the wall clock, s.

    Raises:
        ElibError: The world or the program could not be started, or the lab needs an extra that is not installed. What
            the program does raises nothing.
    """
    return run_together(lab, variant, [start], wall=wall)[0]


def run_together(
    lab: Lab, variant: Variant, starts: Sequence[Callable[[socket.socket], Running]], *, wall: float = WALL
) -> list[VariantResult]:
    """Run the two programs of a game in one world, or one program; see :func:`run_variant`."""
    if sys.platform == "win32":
        raise Unsupported("a program cannot be checked on Windows", hint="use Linux, macOS, or WSL")
    if lab.lacks:
        what = f"programs for the lab {lab.name} need the extra {lab.lacks}, which is not installed here"
        raise Unsupported(what, hint=install(lab.lacks))
    loop = SimulatedLoop()
    try:
        return loop.run_until_complete(_run(lab, variant, starts, wall))
    finally:
        loop.close()


async def _run(
    lab: Lab, variant: Variant, starts: Sequence[Callable[[socket.socket], Running]], wall: float
) -> list[VariantResult]:
    """Run the programs to their end and judge them."""
    served: list[tuple[Marker, _Link]] = []
    with contextlib.ExitStack() as stack:
        for start in starts:
            ours, theirs = socket.socketpair()
            stack.enter_context(ours)
            with theirs:
                link = _Link(ours, wall)
                marker = Marker(lab, variant, link.send, served[0][0] if served else None)
                stack.callback(marker.close)
                link.running = start(theirs)
                stack.callback(link.running.kill)
            served.append((marker, link))
        links = [link for _, link in served]
        # Each is served until it waits, the first one first: who computes how fast changes nothing.
        ends = await asyncio.gather(
            *(_in_turn(_end(marker, link), [each for each in links if each is not link]) for marker, link in served)
        )
        await served[0][0].afterwards(*ends)
        return [marker.result(link.running.output) for marker, link in served]


@types.coroutine
def _in_turn(work: Coroutine[Any, Any, End], others: Sequence[_Link]) -> Generator[Any, None, End]:
    """Serve one program. Nothing else happens meanwhile, so the clock on the wall stands for the others."""
    while True:
        began = time.monotonic()
        try:
            waited = work.send(None)
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]  # what a coroutine returns has no type here
        finally:
            for other in others:
                other.deadline += time.monotonic() - began
        yield waited


async def _end(marker: Marker, link: _Link) -> End:
    """Serve a program until something ends the run, and return how it ended."""
    try:
        try:
            while True:
                await marker.take(link.frame())
        except ProgramEnded:
            return marker.note(end_by(link.exit_code()))
    except RunOver as over:
        if over.ending == "time":
            link.drain(GRACE)
        link.running.kill()
        return marker.note((over.ending, str(over), None))


class ProgramEnded(Exception):
    """The program closed its end of the socket, or its process has ended."""


class _Link:
    """The marker's end of the socket to a program, whose time by the wall clock is limited."""

    running: Running

    def __init__(self, program: socket.socket, wall: float) -> None:
        self._socket = program
        self._wall = wall
        self.deadline = time.monotonic() + wall
        self._received = bytearray()

    def frame(self) -> bytes:
        """Return the next frame. The world's time stands still meanwhile.

        Raises:
            ProgramEnded: The usual end.
            RunOver: It is not a frame, or it took too long.
        """
        while len(self._received) < LETTER.size:
            self._receive()
        size, _ = LETTER.unpack_from(self._received)
        if not 1 <= size <= MAX_MESSAGE:
            raise BrokenRule(f"a frame of {size} bytes")
        end = LETTER.size - 1 + size
        while len(self._received) < end:
            self._receive()
        frame = bytes(self._received[:end])
        del self._received[:end]
        return frame

    def send(self, frame: bytes) -> None:
        """Send a frame."""
        try:
            self._socket.settimeout(self._left())
            self._socket.sendall(frame)
        except TimeoutError:
            raise wall_over(self._wall) from None
        except OSError:
            raise ProgramEnded from None

    def drain(self, seconds: float) -> None:
        """Give the program a short time, s of the wall clock, to end after its time was over.

        It has closed its end long before it has printed what it has to say.
        """
        self.deadline = min(self.deadline, time.monotonic() + seconds)
        with contextlib.suppress(RunOver):
            with contextlib.suppress(ProgramEnded):
                while True:
                    self._receive()
                    self._received.clear()
            self.exit_code()

    def exit_code(self) -> int:
        """Return the exit code of a program that has closed the link, and may still do something else."""
        while (code := self.running.poll()) is None:
            self._left()
            time.sleep(0.002)
        return code

    def _receive(self) -> None:
        while True:
            try:
                self._socket.settimeout(min(self._left(), LOOK))
                piece = self._socket.recv(MAX_MESSAGE)
            except TimeoutError:
                if self.running.poll() is not None:
                    raise ProgramEnded from None
                continue
            except OSError:
                raise ProgramEnded from None
            if not piece:
                raise ProgramEnded
            self._received += piece
            return

    def _left(self) -> float:
        """Return the time that is left by the wall clock, s."""
        left = self.deadline - time.monotonic()
        if left <= 0:
            raise wall_over(self._wall)
        return left


def plain_opponents(lab: Lab) -> list[Callable[[socket.socket], Running]]:
    """Return what starts the opponent of a game, so that a program can be tried alone; nothing in other labs."""
    opponent = lab.opponent
    return [] if opponent is None else [lambda link: PlainProgram(opponent, link)]


class PlainProgram:
    """A program of one's own in a process of its own, without isolation: what it prints is shown as it comes.

    Attributes:
        output: What it printed so far.
    """

    def __init__(
        self, program: str | PathLike[str], link: socket.socket, shows: Callable[[bytes], object] | None = None
    ) -> None:
        self._shows = shows
        self._output = bytearray()
        try:
            self._process = subprocess.Popen(
                program_command(Path(program).resolve(), link.fileno()),
                pass_fds=(link.fileno(),),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                cwd=Path(program).resolve().parent,
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
            )
        except OSError as error:
            raise ElibError(f"{program} cannot be started: {error}") from error
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def output(self) -> str:
        """What it printed so far."""
        return self._output.decode("utf-8", "replace")

    def poll(self) -> int | None:
        """Return its exit code, or None while it runs."""
        code = self._process.poll()
        if code is not None:
            self._reader.join(GRACE)
        return code

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()
        self._process.wait()
        self._reader.join(GRACE)

    def _read(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as stream:
            while piece := stream.read1(65536):  # type: ignore[attr-defined]  # a pipe is a buffered reader
                self._output += piece[: MAX_OUTPUT - len(self._output)]
                if self._shows is not None:
                    with contextlib.suppress(OSError):  # no one reads any more what is shown; the program goes on
                        self._shows(piece)
