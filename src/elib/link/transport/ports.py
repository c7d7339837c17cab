"""Serial ports of this computer: which there are, and who holds one."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

import serialx


def list_ports() -> list[str]:
    """Return the serial ports of this computer, sorted; bound Bluetooth ports too.

    Reads the system's lists and opens nothing.
    """
    try:
        found = {str(port.device) for port in serialx.list_serial_ports()}
    except (OSError, serialx.SerialException):
        found = set()
    found.update(str(port) for port in Path("/dev").glob("rfcomm[0-9]*"))
    return sorted(found)


def holders(path: str) -> list[str]:
    """Return the programs that hold *path*, as ``NAME (process PID)``, as far as Linux tells; elsewhere none.

    If a program has locked the port, only that one is named; otherwise all that have it open.
    """
    try:
        device = os.stat(path)
    except OSError:
        return []
    locked = _locked_by(device)
    return [_program(pid) for pid in locked or _opened_by(device) if Path(f"/proc/{pid}").exists()]


def _locked_by(device: os.stat_result) -> list[int]:
    """Read the owners of locks: ``1: FLOCK ADVISORY WRITE PID MAJOR:MINOR:INODE 0 EOF``, the device in hexadecimal."""
    place = f"{os.major(device.st_dev):02x}:{os.minor(device.st_dev):02x}:{device.st_ino}"
    try:
        lines = Path("/proc/locks").read_text().splitlines()
    except OSError:
        return []
    owners = [int(words[4]) for words in map(str.split, lines) if len(words) > 5 and words[5] == place]
    return list(dict.fromkeys(owners))  # the file may change while it is read, and show one twice


def _opened_by(device: os.stat_result) -> list[int]:
    owners = []
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # another user's process, or one that ended meanwhile
            if any(_is_same(opened, device) for opened in (process / "fd").iterdir()):
                owners.append(int(process.name))
    return owners


def _is_same(opened: Path, device: os.stat_result) -> bool:
    try:
        found = opened.stat()
    except OSError:  # closed meanwhile
        return False
    return (found.st_dev, found.st_ino) == (device.st_dev, device.st_ino)


def _program(pid: int) -> str:
    try:
        name = Path(f"/proc/{pid}/comm").read_text().strip()
    except OSError:
        name = "a program"
    return f"this program (process {pid})" if pid == os.getpid() else f"{name} (process {pid})"
