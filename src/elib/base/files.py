"""Read files that a person named, within bounds, and write files whole or not at all."""

from __future__ import annotations

import contextlib
import json
import os
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO, NoReturn

from elib.base.errors import ArgumentError, ElibError

PACKAGE = Path(__file__).parents[1]
"""The folder of the package elib."""
WORLDS, FAULTS, LABS = "simulator/worlds", "simulator/faults", "lab/labs"
"""Folders in it: the worlds, fault scripts and labs that come with elib."""
PAGE = "panel/page"
"""The folder of the page in the browser."""

MAX_STATE = 1_000_000
"""Bytes of a JSON file at most: the largest that elib reads has some hundred numbers."""


def guide(name: str) -> Path:
    """Return the file of a guide: the wheel has them in the package, a checkout in ``docs/guides``."""
    folders = (PACKAGE / "guides", PACKAGE.parents[1] / "docs/guides")
    return next((folder / f"{name}.md" for folder in folders if folder.is_dir()), folders[0] / f"{name}.md")


def open_file(path: str | os.PathLike[str]) -> BinaryIO:
    """Open a regular file for reading, and never wait: a pipe without a writer would never open.

    Raises:
        OSError: The file cannot be opened, or is not a regular file.
        ValueError: The path has a NUL in it.
    """
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    stream = open(descriptor, "rb")  # noqa: SIM115  # given to the caller
    mode = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(mode):
        stream.close()
        raise OSError(0, "Is a directory" if stat.S_ISDIR(mode) else "it is not a regular file", os.fspath(path))
    return stream


def read_file(
    path: str | os.PathLike[str],
    what: str,
    *,
    largest: int,
    hint: str = "check its path",
    error: Callable[..., ElibError] = ArgumentError,
) -> bytes:
    """Return the content of a file that a person named, at most *largest* bytes and one.

    The extra byte tells the caller that the content is too large.

    Args:
        path: The file.
        what: What it should be, for messages: ``the fault script``.
        largest: Bytes that it may have.
        hint: What to try if it cannot be read.
        error: Class of the error.

    Raises:
        ElibError: The file cannot be read, or is not a regular file; *error* is its class.
    """
    try:
        with open_file(path) as stream:
            return stream.read(largest + 1)
    except (OSError, ValueError) as problem:  # a NUL in a name is a ValueError
        raise error(f"{what} {os.fspath(path)} cannot be read: {reason_of(problem)}", hint=hint) from problem


def reason_of(error: OSError | ValueError) -> str:
    """Return why a file cannot be opened, in words."""
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def parse_json(text: str | bytes) -> object:
    """Return the value of JSON that may come from anywhere.

    Raises:
        ValueError: *text* is not JSON. NaN and Infinity are refused too, and so are text that is nested too deeply and
            numbers with thousands of digits.
    """
    try:
        return _DECODER.decode(text if isinstance(text, str) else text.decode())
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def _refuse(word: str) -> NoReturn:
    raise ValueError(f"{word} is not a number in JSON")


_DECODER = json.JSONDecoder(parse_constant=_refuse)


def write_file(path: str | os.PathLike[str], content: bytes) -> None:
    """Write a file that a person named; an existing one is replaced, as :func:`replacing` does it.

    Raises:
        ArgumentError: The file cannot be created.
        ElibError: The disk is full, or fails; an existing file stays as it was.
    """
    target = os.fspath(path)
    try:
        with replacing(target) as beside:
            beside.write_bytes(content)
    except OSError as error:
        raise ElibError(
            f"{target!r} cannot be written: {reason_of(error)}", hint="is there room on the disk?"
        ) from error


def create_file(path: Path, content: bytes) -> None:
    """Write a file that a person named and that is not there yet.

    Raises:
        ArgumentError: It is there already, or cannot be written.
    """
    try:
        with path.open("xb") as target:
            target.write(content)
    except FileExistsError:
        raise ArgumentError(f"{path} exists already", hint="give another name, or move that file away first") from None
    except OSError as error:
        raise ArgumentError(f"{path} cannot be written: {error.strerror}", hint="does its folder exist?") from None


@contextlib.contextmanager
def replacing(target: str) -> Iterator[Path]:
    """Yield the path of an empty file beside *target*; it replaces *target* if the block ends without an error.

    The path of a device or pipe is yielded as it is. A link stays a link, and a file keeps its rights.

    Raises:
        ArgumentError: The file cannot be created.
    """
    try:
        path = Path(os.path.realpath(target))
        mode = path.stat().st_mode if path.exists() else stat.S_IFREG | 0o666 & ~_umask()
        if stat.S_ISDIR(mode):
            raise ArgumentError(f"{target!r} is a directory; the output needs a file")
        if path.exists() and not os.access(path, os.W_OK):
            raise ArgumentError(f"{target!r} cannot be written: it is write-protected")
        temporary = _beside(path) if stat.S_ISREG(mode) else path
    except ArgumentError:
        raise
    except (OSError, ValueError) as error:  # a NUL in a name is a ValueError
        raise ArgumentError(
            f"{target!r} cannot be written: {reason_of(error)}", hint="does its folder exist, and is it yours?"
        ) from None
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
    """Add the name of the file to an error of writing."""
    try:
        yield
    except OSError as error:
        if error.errno is None or error.filename is not None:
            raise
        raise OSError(error.errno, error.strerror, target) from None


def _beside(path: Path) -> Path:
    import tempfile  # here: it loads seven modules, and most programs write no file

    # A name has 255 bytes at most, and a character up to 4 of them. What writes the file may look at its ending.
    name, suffix = path.name[:40], path.suffix[:10]
    handle, name = tempfile.mkstemp(prefix=f".{name}.", suffix=suffix, dir=path.parent)
    os.close(handle)
    return Path(name)


def _umask() -> int:
    """Return the mask of this process; it can only be read by setting it."""
    mask = os.umask(0o077)
    os.umask(mask)
    return mask
