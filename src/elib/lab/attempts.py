"""What a submission tries that has nothing to do with its robot, named: other files, programs, the network, memory.

This is for the teacher's eyes and for honest students, who get an error that says what the rule is. It is not what
holds a program back: that are the walls around it (elib.lab.sandbox). So it may pass over what a library does.
"""

from __future__ import annotations

import contextlib
import inspect
import json
import os
import sys
from collections.abc import Sequence
from typing import Any

PATHS = {
    "open": (0,),
    "os.chmod": (0,),
    "os.chown": (0,),
    "os.link": (0, 1),
    "os.listdir": (0,),
    "os.mkdir": (0,),
    "os.remove": (0,),
    "os.rename": (0, 1),
    "os.rmdir": (0,),
    "os.scandir": (0,),
    "os.symlink": (0, 1),
    "os.truncate": (0,),
    "os.utime": (0,),
    "sqlite3.connect": (0,),
}
"""Events with paths, and which of their arguments these are."""

DEEDS = {
    "ctypes.call_function": "to call C functions with ctypes",
    "ctypes.dlopen": "to load a C library with ctypes",
    "ctypes.dlsym": "to call C functions with ctypes",
    "ctypes.dlsym/handle": "to call C functions with ctypes",
    "ctypes.string_at": "to read memory with ctypes",
    "gc.get_objects": "to search the memory with gc",
    "gc.get_referents": "to search the memory with gc",
    "gc.get_referrers": "to search the memory with gc",
    "os.exec": "to start another program",
    "os.fork": "to start another process",
    "os.forkpty": "to start another process",
    "os.kill": "to send a signal to process {0}",
    "os.killpg": "to send a signal to the processes {0}",
    "os.posix_spawn": "to start another program",
    "os.system": "to start another program",
    "pty.spawn": "to start another program",
    "socket.bind": "to open a port",
    "socket.connect": "to connect to {1}",
    "socket.getaddrinfo": "to reach {0} on the network",
    "socket.gethostbyname": "to reach {0} on the network",
    "socket.sendmsg": "to send to {1}",
    "socket.sendto": "to send to {1}",
    "subprocess.Popen": "to start another program",
    "sys._current_frames": "to look into other threads",
}
"""Events that no program for a robot needs, and what they try."""

SYSTEM = ("/bin", "/dev", "/etc", "/lib", "/lib64", "/proc", "/sbin", "/sys", "/usr", "/var")
"""Where libraries may look: for fonts, the time zone, the number of processors."""
DEVICES = ("/dev/full", "/dev/null", "/dev/random", "/dev/urandom", "/dev/zero")
LIBRARIES_OF_PYTHON = ("ctypes/util.py", "locale.py", "mimetypes.py", "platform.py", "uuid.py")
"""Modules of Python that look around on their own account, when a program asks for something harmless."""
MAX_TOLD = 20
"""Attempts that are reported at most; one is enough."""


class Forbidden(PermissionError):
    """A submission tried what a program for a robot does not need."""


def watch(home: str, path: Sequence[str], secret: Sequence[str], reports: int, link: int) -> None:
    """Report and refuse attempts from now on, for as long as the process lives.

    Args:
        home: The submission's folder.
        path: Where modules of Python and its packages are.
        secret: Folders of the teacher; they need not exist here.
        reports: Where attempts are written to, a JSON string a line.
        link: The link to the marker; opening it by its number is an attempt.
    """
    judge = _Judge(home, path, secret, link)
    is_judging = False  # what judging itself does is not judged
    told = 0

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal is_judging, told
        if is_judging or (event not in PATHS and event not in DEEDS):
            return
        is_judging = True
        try:
            what = judge.verdict(event, arguments)
            if what is not None and told < MAX_TOLD:
                told += 1
                with contextlib.suppress(OSError):
                    os.write(reports, b"\n" + json.dumps(what[:200]).encode() + b"\n")
        finally:
            is_judging = False
        if what is not None:
            raise Forbidden(f"a submission must not try {what}")

    sys.addaudithook(hook)


class _Judge:
    def __init__(self, home: str, path: Sequence[str], secret: Sequence[str], link: int) -> None:
        self._home = os.path.realpath(home)
        self._own = (self._home, os.path.realpath(os.environ["TMPDIR"]), *DEVICES)
        self._python = tuple(map(os.path.realpath, (*path, sys.base_prefix)))  # in /tmp too, it may only be read
        self._readable = (*self._own, *self._python)
        self._secret = secret
        self._link = link
        self._standard = os.path.dirname(os.__file__)

    def verdict(self, event: str, arguments: tuple[Any, ...]) -> str | None:
        """Return what an event tries that is forbidden, or None."""
        by = self._who()
        if by is None:
            return None
        if event in PATHS:
            places = (*self._readable, *SYSTEM) if by == "library" else self._readable
            closed = self._secret
            if by == "submission" and _writes(event, arguments):
                places, closed = self._own, (*self._secret, *self._python)
            return next(filter(None, (self._about(arguments[index], places, closed) for index in PATHS[event])), None)
        if by == "library" or (event == "os.kill" and arguments[0] == os.getpid()):
            return None
        return DEEDS[event].format(*arguments)

    def _who(self) -> str | None:
        """Return who does it: the submission, a library for it, or None for an import or elib on its own."""
        by = "submission"
        frame = inspect.currentframe()
        while frame is not None:
            name = frame.f_code.co_filename
            if name.startswith("<frozen importlib"):
                return None
            if name == __file__:
                frame = frame.f_back
                continue
            if name == "<string>" or _is_within(name, self._home):
                return by
            is_standard = name.startswith(("<", self._standard)) and "site-packages" not in name
            if not is_standard or name.endswith(LIBRARIES_OF_PYTHON):
                by = "library"
            frame = frame.f_back
        return None

    def _about(self, path: Any, places: Sequence[str], closed: Sequence[str]) -> str | None:
        """Return what is wrong with a path that must be in one of the places, and in none of the closed ones."""
        if isinstance(path, int):
            return "to use the link to its robot by hand" if path == self._link else None
        try:
            given = os.path.abspath(os.fsdecode("." if path is None else path))
            name = os.path.realpath(given)
        except (TypeError, ValueError):
            return None
        is_closed = any(_is_within(given, place) or _is_within(name, place) for place in closed)
        if is_closed or not any(_is_within(name, place) for place in places):
            return f"to reach {os.fsdecode(path)}, which is outside its folder"
        return None


def _writes(event: str, arguments: tuple[Any, ...]) -> bool:
    """Return whether an event about a path changes something there."""
    if event == "open":
        flags = arguments[2] if isinstance(arguments[2], int) else 0
        return bool(flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT))
    return event not in ("os.listdir", "os.scandir")


def _is_within(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder + "/")
