"""The folder of a long piece of work that can go on later: its settings, and a journal, a line for each part done."""

from __future__ import annotations

import contextlib
import json
import os
import platform
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from elib import __version__
from elib.base.errors import ArgumentError, ElibError
from elib.base.files import parse_json, reason_of
from elib.learn.executor import versions_of


class Journal(contextlib.AbstractContextManager["Journal"]):
    """A file of lines, open for this program alone; each line is on the disk before :meth:`append` returns.

    The program may be killed at any moment. A last line that was not written to its end is dropped.

    Args:
        path: The file; it is made if it does not exist.

    Attributes:
        lines: What the file holds: the value of each line.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file = path.open("a+b")
        except OSError as error:
            raise ElibError(f"{path} cannot be opened: {reason_of(error)}", hint="is the folder yours?") from None
        try:
            _lock(self._file.fileno(), path)
            self.lines, intact = read_lines(path)
            self._file.truncate(intact)
        except BaseException:
            self._file.close()
            raise

    def append(self, line: dict[str, Any]) -> None:
        """Write one line."""
        content = json.dumps(line, allow_nan=False).encode() + b"\n"
        try:
            self._file.write(content)
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise ElibError(
                f"{self.path} cannot be written: {reason_of(error)}", hint="is there room on the disk?"
            ) from None
        self.lines.append(line)

    def close(self) -> None:
        """Let other programs open the file."""
        with contextlib.suppress(OSError):  # a full disk was reported by append
            self._file.close()

    def __exit__(self, *_: object) -> None:
        self.close()


def open_folder(folder: Path, what: str, settings: str, journal: str) -> Journal:
    """Open the folder of *what*, such as ``a study``, with the names of its settings and journal, or make it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        there = {each.name for each in folder.iterdir() if not each.name.startswith(".")}
    except OSError as error:
        hint = "choose another with --out"
        raise ArgumentError(f"{folder} cannot be a folder for {what}: {error.strerror}", hint=hint) from None
    if settings not in there and there - {journal}:
        hint = "choose a new folder with --out, or an empty one"
        raise ArgumentError(f"{folder} holds other files and no {what.removeprefix('a ')}", hint=hint)
    found = Journal(folder / journal)
    if found.lines and settings not in there:
        found.close()
        raise ArgumentError(f"{folder} has {journal} but no {settings}", hint="choose another with --out")
    return found


def differences_of(began: Mapping[str, Any], now: Mapping[str, Any], *, elib: object) -> list[str]:
    """Return in words how settings, and the version *elib*, differ from those with which a piece of work began."""
    names = [name for name in {**began, **now} if began.get(name) != now.get(name)]
    found = [f"{name} is {began.get(name)!r} there, and {now.get(name)!r} now" for name in names]
    return found + [f"elib was {elib} there, and is {__version__} now"] * (elib != __version__)


def versions(*packages: str) -> dict[str, str]:
    """Return the versions on which a result may depend: of elib, Python, and what is installed of these packages."""
    return {"elib": __version__, "python": platform.python_version(), **versions_of(*packages)}


def read_lines(path: Path) -> tuple[list[dict[str, Any]], int]:
    """Return the values of the lines of a journal, and how many bytes of it are intact."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ElibError(f"{path} cannot be read: {reason_of(error)}", hint="check its path") from None
    found: list[dict[str, Any]] = []
    intact = 0
    rows = content.splitlines(keepends=True)
    for number, row in enumerate(rows, start=1):
        try:
            line = parse_json(row)
            if not row.endswith(b"\n") or not isinstance(line, dict):
                raise ValueError
        except ValueError:
            if number == len(rows):  # the program was killed, or the power failed, while it was written
                break
            raise ElibError(
                f"{path}:{number}: this line is damaged",
                hint="put back a copy of the file, or delete this line and all below it: they will be done again",
            ) from None
        found.append(line)
        intact += len(row)
    return found, intact


def _lock(descriptor: int, path: Path) -> None:
    """Lock a file for this process; the system unlocks it when the process ends, however that happens."""
    try:
        if sys.platform == "win32":
            import msvcrt

            # Windows locks bytes, and refuses to read them: so one that is never written.
            os.lseek(descriptor, 1 << 30, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        raise ElibError(
            f"another program writes into {path.parent}", hint="wait until it has ended, or choose another folder"
        ) from None
    except OSError:
        pass  # The file system knows no locks; most of those that are shared in a network do.
