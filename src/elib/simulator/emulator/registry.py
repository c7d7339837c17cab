"""The running simulations of this user: a small file for each, in a folder that no other user may write.

``elib simulate`` keeps one while it runs, and :func:`elib.find` reads them.
"""

from __future__ import annotations

import contextlib
import getpass
import json
import os
import stat
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated

import msgspec

from elib.simulator.emulator.settings import SimulationSettings

PREFIX, SUFFIX = "simulate-", ".json"
"""How the names of the files begin and end."""


class Registered(msgspec.Struct, frozen=True):
    """One robot of a running simulation."""

    process: int  # number of the process that simulates it
    name: str  # `epuck-1`, `epuck-2`, ..
    # what opens it; all of them lead to the same robot, and one program at a time should use it
    urls: Annotated[tuple[str, ...], msgspec.Meta(min_length=1)]
    firmware: str  # which firmware it runs
    world: str  # name of its world, or path of the world's file


@contextlib.contextmanager
def registered(robots: Iterable[tuple[str, str]], settings: SimulationSettings) -> Iterator[None]:
    """Register the robots that a simulation offers until the block is left.

    A simulation that cannot be registered runs nevertheless; :func:`elib.find` does not list it then.

    Args:
        robots: Name and URL of each robot; a robot may have several URLs.
        settings: What they were built from.
    """
    urls: dict[str, list[str]] = {}
    for name, url in robots:
        urls.setdefault(name, []).append(url)
    entries = [
        Registered(os.getpid(), name, tuple(its), settings.firmware, settings.world) for name, its in urls.items()
    ]
    path = _write(entries) if entries else None
    try:
        yield
    finally:
        if path is not None:
            with contextlib.suppress(OSError):
                path.unlink()


def running() -> list[Registered]:
    """Return the robots of every simulation that runs now, by process and name.

    A file whose process is gone was left by a crash, and is removed. Windows offers no harmless way to ask whether a
    process lives: there a stale file shows by its URL, on which no robot answers.
    """
    place = folder()
    if not is_ours(place):
        return []
    found: list[Registered] = []
    for path in place.glob(f"{PREFIX}*{SUFFIX}"):
        try:
            robots = msgspec.convert(json.loads(path.read_text("utf-8")), list[Registered])
        except (OSError, ValueError):  # gone meanwhile, or written by another version
            continue
        if all(_is_alive(robot.process) for robot in robots):
            found += robots
        else:
            with contextlib.suppress(OSError):
                path.unlink()
    return sorted(found, key=lambda robot: (robot.process, len(robot.name), robot.name))


def folder() -> Path:
    """Return where this user's files lie; it may not exist yet."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    if runtime and os.path.isdir(runtime):
        return Path(runtime, "elib")
    user = getpass.getuser() if sys.platform == "win32" else str(os.getuid())
    return Path(tempfile.gettempdir(), f"elib-{user}")


def is_ours(place: Path) -> bool:
    """Return whether *place* is a folder that only this user can write.

    Everybody can write the folder for temporary files: another user could have made ours first, to lead programs to
    another robot.
    """
    try:
        found = os.lstat(place)
    except OSError:
        return False
    if sys.platform == "win32":
        return stat.S_ISDIR(found.st_mode)
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022


def _write(entries: list[Registered]) -> Path | None:
    place = folder()
    with contextlib.suppress(OSError):
        place.mkdir(mode=0o700, exist_ok=True)
        if not is_ours(place):
            return None
        handle, draft = tempfile.mkstemp(prefix=f"{PREFIX}{os.getpid()}-", suffix=".draft", dir=place)
        with open(handle, "w", encoding="utf-8") as file:
            json.dump(msgspec.to_builtins(entries), file)
        path = Path(draft).with_suffix(SUFFIX)
        Path(draft).replace(path)  # a reader finds all of it or nothing
        return path
    return None


def _is_alive(process: int) -> bool:
    if sys.platform == "win32":
        return True
    try:
        os.kill(process, 0)
    except (OSError, OverflowError):  # it is gone, or the number now belongs to another user's process
        return False
    return process > 0
