"""Carry out a command line: open the source, run the action, write the output, show the progress."""

from __future__ import annotations

import io
import os
import stat
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO

from elib.base.errors import ArgumentError
from elib.records.et.commandline import Request
from elib.records.et.formats import format_of, writing
from elib.records.et.plot import check_plot, draw_plot
from elib.records.et.rows import Block, blocks_of

LARGE_FILE = 50_000_000
"""Bytes; a bar shows how far a larger file is read."""


def perform(request: Request) -> None:
    """Carry out a request. Mistakes in the command line are found before anything is read."""
    format_name = format_of(request.format, request.destination)
    if request.plot is not None:
        check_plot(request.action, request.plot)
        if request.destination and os.path.realpath(request.plot) == os.path.realpath(request.destination):
            raise ArgumentError(f"-d and --plot are both {request.plot!r}; each needs a file of its own")
    name = request.source or "stdin"
    with _source(request.source) as file, ExitStack() as stack:
        writer = stack.enter_context(writing(format_name, request.destination))
        if file.isatty() and sys.stderr.isatty():
            print("reading what you type until Ctrl-D; -s FILE reads a file", file=sys.stderr, flush=True)
        blocks: Iterator[Block] = _blocks(file, name)
        if not (request.action.is_streaming and request.destination is None and sys.stdout.isatty()):
            blocks = stack.enter_context(_with_progress(blocks, file, name))  # a bar among the rows would damage both
        request.action.run(blocks, writer)
        if request.plot is not None:
            draw_plot(request.action, request.plot, f"{type(request.action).__name__} of {Path(name).name}")
    for note in request.action.notes:
        print(note, file=sys.stderr)


@contextmanager
def _source(target: str | None) -> Iterator[IO[bytes]]:
    """Open the source: a file, or standard input."""
    if target is not None:
        try:
            file = open(target, "rb", buffering=0)  # noqa: SIM115 - closed below
        except OSError as error:
            raise ArgumentError(f"{target!r} cannot be read: {error.strerror or error}") from None
        with file:
            yield file
    elif sys.stdin is None:
        raise ArgumentError("standard input is closed", hint="-s FILE reads a file")
    elif isinstance(sys.stdin, io.TextIOWrapper):
        yield sys.stdin.buffer
    else:
        yield io.BytesIO(sys.stdin.read().encode("utf-8", "surrogateescape"))


def _blocks(file: IO[bytes], name: str) -> Iterator[Block]:
    """Yield the blocks of a file."""
    # read1() returns what a pipe has; read() would wait for a whole block.
    read = getattr(file, "read1", file.read)
    try:
        yield from blocks_of(read, name)
    except OSError as error:
        raise ArgumentError(f"{name} cannot be read: {error.strerror or error}") from None


@contextmanager
def _with_progress(blocks: Iterator[Block], file: IO[bytes], name: str) -> Iterator[Iterator[Block]]:
    """Show on a terminal how far a large file is read."""
    size = _size(file)
    if size < LARGE_FILE or not sys.stderr.isatty():
        yield blocks
        return
    from rich.console import Console
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), DownloadColumn(), TimeRemainingColumn()
    # Without these two, Rich would redirect standard output too, and show the results among the messages.
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, redirect_stdout=False, redirect_stderr=False) as progress:
        task = progress.add_task(Path(name).name, total=size)

        def counted() -> Iterator[Block]:
            for block in blocks:
                yield block
                progress.advance(task, block.size)
            progress.stop()  # the results come next

        yield counted()


def _size(file: IO[bytes]) -> int:
    try:
        status = os.fstat(file.fileno())
    except OSError:
        return 0
    return status.st_size if stat.S_ISREG(status.st_mode) else 0
