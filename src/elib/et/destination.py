"""Where output goes: a file that is replaced whole or not at all, or standard output."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Iterator
from typing import IO, Protocol

from elib.errors import ArgumentError
from elib.files import replacing
from elib.plaintext import plain


class Sink(Protocol):
    """What takes bytes."""

    def write(self, data: bytes, /) -> object:
        """Write them."""
        ...

    def flush(self) -> object:
        """Send them on."""
        ...


class StandardOutput:
    """Standard output for bytes, also where a program has put a text stream in its place."""

    def write(self, data: bytes, /) -> None:
        """Write them."""
        if sys.stdout.isatty():  # a terminal obeys what it is shown; files and pipes get every byte as it is
            sys.stdout.write(plain(data.decode("utf-8", "replace")))
        elif isinstance(sys.stdout, io.TextIOWrapper):
            sys.stdout.flush()
            sys.stdout.buffer.write(data)
        else:
            sys.stdout.write(data.decode("utf-8", "replace"))

    def flush(self) -> None:
        """Send them on."""
        if isinstance(sys.stdout, io.TextIOWrapper):
            sys.stdout.buffer.flush()
        sys.stdout.flush()


@contextlib.contextmanager
def opened(target: str | None) -> Iterator[Sink]:
    """Open a destination for bytes: a file that is replaced at the end, or standard output."""
    if target is None:
        output = StandardOutput()
        yield output
        output.flush()
    else:
        with replacing(target) as path, path.open("wb") as file:
            yield file


@contextlib.contextmanager
def source(target: str | None) -> Iterator[IO[bytes]]:
    """Open what is read: a file, or standard input.

    Raises:
        ArgumentError: It cannot be opened.
    """
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
