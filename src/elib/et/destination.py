"""Files that are replaced whole or not at all, and standard output."""

from __future__ import annotations

import contextlib
import io
import os
import stat
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Protocol

from elib.errors import ArgumentError


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
        if isinstance(sys.stdout, io.TextIOWrapper):
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
def replacing(target: str) -> Iterator[Path]:
    """Give the path of an empty file beside *target*, which becomes it if the block ends well.

    A device or pipe is given as it is. A link stays a link; a file keeps its rights.

    Raises:
        ArgumentError: There can be no such file.
    """
    try:
        path = Path(os.path.realpath(target))
        mode = path.stat().st_mode if path.exists() else stat.S_IFREG | 0o666 & ~_umask()
        if stat.S_ISDIR(mode):
            raise ArgumentError(f"{target!r} is a directory; the output needs a file")
        if path.exists() and not os.access(path, os.W_OK):
            raise ArgumentError(f"{target!r} cannot be written: it is write-protected")
        temporary = _beside(path) if stat.S_ISREG(mode) else path
    except OSError as error:
        raise ArgumentError(f"{target!r} cannot be written: {error.strerror or error}") from None
    try:
        with named(target):
            if temporary != path:
                temporary.chmod(stat.S_IMODE(mode))
            yield temporary
            if temporary != path:
                temporary.replace(path)
    finally:
        if temporary != path:
            temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def named(target: str) -> Iterator[None]:
    """Let an error of writing say what could not be written."""
    try:
        yield
    except OSError as error:
        if error.errno is None or error.filename is not None:
            raise
        raise OSError(error.errno, error.strerror, target) from None


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


def _beside(path: Path) -> Path:
    handle, name = tempfile.mkstemp(prefix=f".{path.name[:100]}.", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    return Path(name)


def _umask() -> int:
    """Return the mask of this process; there is no way to read it but to set it."""
    mask = os.umask(0o077)
    os.umask(mask)
    return mask
