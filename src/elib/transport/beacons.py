"""Simulations of this user that other programs can drive: a small record each, in a folder nobody else may write.

``elib simulate`` leaves one while it runs (:mod:`elib.emulator.beacon`), :func:`elib.find` reads them.
"""

from __future__ import annotations

import contextlib
import getpass
import json
import os
import stat
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Self

PATTERN = "simulate-*.json"
"""Names of the records."""


@dataclass(frozen=True, slots=True)
class Beacon:
    """What a running simulation says about one of its robots.

    Attributes:
        process: Number of the process that simulates it.
        name: ``epuck-1``, ``epuck-2``, ...
        urls: What opens it; all of them lead to the same robot, and one program at a time should use it.
        firmware: Which firmware it runs.
        world: Name of its world, or path of the world's file.
    """

    process: int
    name: str
    urls: tuple[str, ...]
    firmware: str
    world: str

    @classmethod
    def from_json(cls, record: object) -> Self:
        """Read one robot of a record.

        Raises:
            ValueError: It is not what :meth:`to_json` makes.
        """
        match record:
            case {
                "process": int(process),
                "name": str(name),
                "urls": [*urls],
                "firmware": str(firmware),
                "world": str(world),
            } if urls and all(isinstance(url, str) for url in urls):
                return cls(process, name, tuple(map(str, urls)), firmware, world)
        raise ValueError(f"no beacon: {record!r}")

    def to_json(self) -> dict[str, object]:
        """Return what stands in the record."""
        return asdict(self)


def folder() -> Path:
    """Return where this user's records lie; it need not exist."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    if runtime and os.path.isdir(runtime):
        return Path(runtime, "elib")
    user = getpass.getuser() if sys.platform == "win32" else str(os.getuid())
    return Path(tempfile.gettempdir(), f"elib-{user}")


def is_ours(place: Path) -> bool:
    """Return whether *place* is a folder that only this user can have put records in.

    The folder for temporary files is everybody's: another user could have made ours first, to send robots astray.
    """
    try:
        found = os.lstat(place)
    except OSError:
        return False
    if sys.platform == "win32":
        return stat.S_ISDIR(found.st_mode)
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022


def running() -> list[Beacon]:
    """Return the robots of every simulation that runs now, by process and name.

    A record whose process is gone was left by a crash, and is removed. Windows offers no harmless way to ask whether a
    process lives: there a stale record shows by its URL, which nobody answers.
    """
    place = folder()
    if not is_ours(place):
        return []
    found: list[Beacon] = []
    for path in place.glob(PATTERN):
        try:
            robots = [Beacon.from_json(record) for record in json.loads(path.read_text("utf-8"))]
        except (OSError, ValueError, TypeError):  # gone meanwhile, or not ours to understand
            continue
        if all(_is_alive(robot.process) for robot in robots):
            found += robots
        else:
            with contextlib.suppress(OSError):
                path.unlink()
    return sorted(found, key=lambda robot: (robot.process, len(robot.name), robot.name))


def _is_alive(process: int) -> bool:
    if sys.platform == "win32":
        return True
    try:
        os.kill(process, 0)
    except (OSError, OverflowError):  # gone; or another user's, so the number was given anew
        return False
    return process > 0
