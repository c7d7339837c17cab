"""Serial ports of this computer: which there are, and who holds one."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Sequence
from pathlib import Path

from elib.base.errors import LinkBusy
from elib.link.transport.url import Url

BAUD = 115200
"""Bits per second, 8N1: what every firmware speaks (wire-protocol.md, 1.1)."""

BRLTTY = "brltty takes some USB serial adapters for Braille displays: sudo apt remove brltty, and plug it in again"
"""It was seen with CH340, CP2102 and FTDI adapters on Ubuntu 22.04: the port appears and vanishes at once."""


def list_ports() -> dict[str, str]:
    """Return the serial ports of this computer, sorted, and how the system describes each; bound Bluetooth ports too.

    Reads the system's lists and opens nothing.
    """
    import serialx  # a page in a browser has neither ports nor this package

    try:
        ports = serialx.list_serial_ports()
    except (OSError, serialx.SerialException):
        ports = []
    found: dict[str, tuple[str | None, ...]] = {str(port): () for port in Path("/dev").glob("rfcomm[0-9]*")}
    found |= {str(port.device): (port.product, port.interface_description, port.manufacturer) for port in ports}
    return {device: ", ".join(dict.fromkeys(filter(None, parts))) for device, parts in sorted(found.items())}


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


def busy(url: Url, names: Sequence[str]) -> LinkBusy:
    """Return the error for a port that others hold.

    Args:
        url: The port.
        names: The programs that hold it, as :func:`~elib.link.transport.ports.holders` returns them; may be empty.
    """
    who = f"{', '.join(names)} {'holds' if len(names) == 1 else 'hold'} it" if names else "another program holds it"
    hint = "close that program"
    if any(name.startswith("this program ") for name in names):
        hint = "close the robot object that this program made before: robot.close(), or use `with elib.connect(...)`"
    if any(name.startswith("ModemManager") for name in names) or not names:
        hint += "; ModemManager probes new ports: sudo systemctl stop ModemManager"
    if any(name.startswith("brltty") for name in names):
        hint += f"; {BRLTTY}"
    return LinkBusy(f"{url}: the port is busy: {who}", hint=hint)
