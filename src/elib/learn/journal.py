"""A journal: one line of JSON for each part of a long piece of work that is done, so that the work can go on later."""

from __future__ import annotations

import contextlib
import json
import os
import sys
from pathlib import Path
from typing import Any, Self

from elib.base.errors import ElibError
from elib.base.files import parse_json, reason_of


class Journal:
    """A file of lines, open for this program alone; each line is on the disk before :meth:`append` returns.

    The program may be killed at any moment. A last line that was not written to its end is dropped.

    Args:
        path: The file; it is made if it does not exist.

    Attributes:
        lines: What the file holds: the value of each line.

    Raises:
        ElibError: The file cannot be opened, another program writes it, or a line in its middle is damaged.
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
        """Write one line.

        Raises:
            ElibError: The disk is full, or fails.
        """
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

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def read_lines(path: Path) -> tuple[list[dict[str, Any]], int]:
    """Return the values of the lines of a journal, and how many bytes of it are intact.

    Raises:
        ElibError: The file cannot be read, or a line other than the last one is damaged.
    """
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
    """Lock a file for this process; the system unlocks it when the process ends, however that happens.

    Raises:
        ElibError: Another program has locked it.
    """
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
