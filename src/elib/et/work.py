"""What a command line asks for, done: source, action, output, progress."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO

from elib.errors import ArgumentError
from elib.et.commandline import Request
from elib.et.destination import source
from elib.et.formats import format_of, writing
from elib.et.plot import check_plot, draw_plot
from elib.et.rows import Block, blocks_of

LARGE = 50_000_000
"""Bytes of a file whose progress is shown."""


def perform(request: Request) -> None:
    """Do it. What is wrong with the command line is found before anything is read.

    Raises:
        ArgumentError: It cannot be done, or a row of the log is not what the action needs.
        Unsupported: Something is not installed.
        OSError: The output cannot be written.
    """
    form = format_of(request.format, request.destination)
    if request.plot is not None:
        check_plot(request.action, request.plot)
        if request.destination and os.path.realpath(request.plot) == os.path.realpath(request.destination):
            raise ArgumentError(f"-d and --plot are both {request.plot!r}; each needs a file of its own")
    name = request.source or "stdin"
    with source(request.source) as file, ExitStack() as stack:
        writer = stack.enter_context(writing(form, request.destination))
        if file.isatty() and sys.stderr.isatty():
            print("reading what you type until Ctrl-D; -s FILE reads a file", file=sys.stderr, flush=True)
        blocks: Iterator[Block] = _blocks(file, name)
        if not (request.action.is_streaming and request.destination is None and sys.stdout.isatty()):
            blocks = stack.enter_context(_shown(blocks, file, name))  # a bar among the rows would spoil both
        request.action.run(blocks, writer)
        if request.plot is not None:
            draw_plot(request.action, request.plot, f"{type(request.action).__name__} of {Path(name).name}")
    for note in request.action.notes:
        print(note, file=sys.stderr)


def _blocks(file: IO[bytes], name: str) -> Iterator[Block]:
    """Yield what a file holds."""
    # A pipe is taken as it comes: read() would wait for a whole block.
    read = getattr(file, "read1", file.read)
    try:
        yield from blocks_of(read, name)
    except OSError as error:
        raise ArgumentError(f"{name} cannot be read: {error.strerror or error}") from None


@contextmanager
def _shown(blocks: Iterator[Block], file: IO[bytes], name: str) -> Iterator[Iterator[Block]]:
    """Show on a terminal how far a large file is read."""
    size = _size(file)
    if size < LARGE or not sys.stderr.isatty():
        yield blocks
        return
    from rich.console import Console
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), DownloadColumn(), TimeRemainingColumn()
    # Rich would take standard output too, and show the results among the messages.
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, redirect_stdout=False, redirect_stderr=False) as progress:
        task = progress.add_task(Path(name).name, total=size)

        def counted() -> Iterator[Block]:
            for block in blocks:
                yield block
                progress.advance(task, block.size)
            progress.stop()  # before the results come

        yield counted()


def _size(file: IO[bytes]) -> int:
    try:
        status = os.fstat(file.fileno())
    except OSError:
        return 0
    return status.st_size if stat.S_ISREG(status.st_mode) else 0
