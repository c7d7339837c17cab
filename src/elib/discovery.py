"""``elib.find()``: which robots this computer can reach; no robot is disturbed.

Only links that may lead to a robot are tried: bound Bluetooth ports, USB serial ports, COM ports, robots with which the
system is paired, and running simulations. A port that another program has open is left alone.
"""

from __future__ import annotations

import asyncio
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

import serialx

from elib.emulator.registry import Registered, running
from elib.errors import ArgumentError, ElibError
from elib.session import Session, check_timeout
from elib.timebase import require_real_time
from elib.transport import open_transport, parse_url
from elib.transport.ports import holders, list_ports
from elib.transport.rfcomm import EPUCK2_CHANNEL

Kind = Literal["serial", "bluetooth", "simulation"]

TIMEOUT = 5.0
"""s for each link; all are tried at the same time. A radio looks for a robot that is switched off for up to 5.12 s."""

BLUETOOTHCTL_TIMEOUT = 2.0
"""s for the system's list of paired devices; ``bluetoothctl`` waits for ever if its service does not run."""

_LIKELY = re.compile(
    r"rfcomm\d+|ttyACM\d+|ttyUSB\d+|COM\d+|cu\..*e-?puck.*|cu\.(usbmodem|usbserial|SLAB_USBtoUART|wchusbserial).*",
    re.IGNORECASE,
)
_UNLIKELY = re.compile(r"modem|gdb|communications port|printer", re.IGNORECASE)
"""Words in the descriptions of ports that do not lead to a robot, such as the debugger's port of an e-puck2."""

_BLUETOOTH_NAME = re.compile(r"rfcomm\d+|cu\..*e-?puck.*", re.IGNORECASE)
_DEVICE = re.compile(r"Device ((?:[0-9A-F]{2}:){5}[0-9A-F]{2}) ([^\r\n]+)", re.IGNORECASE)
_ROBOT_NAME = re.compile(r"e-?puck", re.IGNORECASE)
_ROBOT_ADDRESS = "10:00:E8"
"""Beginning of the Bluetooth addresses of first-generation robots."""


@dataclass(frozen=True, slots=True)
class Found:
    """A link that may lead to a robot.

    Attributes:
        url: What opens it.
        kind: ``serial``, ``bluetooth`` (a port bound to a robot, or its address) or ``simulation``.
        description: What the system knows about it.
        firmware: Name of the firmware that answered, such as ``epuck2``; None if nothing answered.
        answer: The version that the robot answered; empty if nothing answered.
        reason: Why nothing answered; empty if a robot did.
    """

    url: str
    kind: Kind
    description: str
    firmware: str | None = None
    answer: str = ""
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Survey:
    """The result of a search.

    Attributes:
        found: The links that may lead to a robot; after :func:`survey` each has an answer or a reason.
        not_tried: Serial ports that were left alone because robots do not have such ports.
        notes: Where the search could not look, one sentence each.
    """

    found: tuple[Found, ...]
    not_tried: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


async def find(*, timeout: float = TIMEOUT, all_ports: bool = False) -> list[Found]:
    """Look for robots, and ask each for its version.

    A robot is asked for nothing else, and goes on with what it does.

    Args:
        timeout: Seconds for each link; all are tried at the same time.
        all_ports: Try every serial port. Other devices may react to the question in unexpected ways.

    Returns:
        Robots that answer (``firmware`` is set), then links on which no robot answers (``reason`` says why).

    Raises:
        ArgumentError: *timeout* is out of its range.
        SimulationError: The event loop simulates time.
    """
    return list((await survey(timeout=timeout, all_ports=all_ports)).found)


async def survey(*, timeout: float = TIMEOUT, all_ports: bool = False) -> Survey:
    """Look for robots as :func:`find` does, and say where the search could not look.

    Raises:
        ArgumentError: *timeout* is out of its range.
        SimulationError: The event loop simulates time.
    """
    timeout = check_timeout(timeout)
    listed = await candidates(all_ports=all_ports)
    async with asyncio.TaskGroup() as group:
        tries = [group.create_task(_ask(each, timeout), name=f"find {each.url}") for each in listed.found]
    found = sorted((task.result() for task in tries), key=lambda each: each.firmware is None)
    return replace(listed, found=tuple(found))


async def candidates(*, all_ports: bool = False) -> Survey:
    """List the links that may lead to a robot, and open none.

    Raises:
        SimulationError: The event loop simulates time.
    """
    require_real_time("looking for robots")
    return await asyncio.to_thread(_candidates, all_ports)


def _candidates(all_ports: bool) -> Survey:
    found = [_simulated(robot) for robot in running()]
    taken = {os.path.realpath(each.url.removeprefix("serial://")) for each in found}
    paired, notes = _paired()
    about = _descriptions()
    not_tried: list[str] = []
    bound: set[str] = set()
    for port in list_ports():
        if os.path.realpath(port) in taken:
            continue
        description = about.get(port, "")
        if not all_ports and not is_likely(port, description):
            not_tried.append(port)
            continue
        address = bound_address(port)
        bound.add(address)
        if address:
            description = f"{paired.get(address, 'a robot')}, bound to {address}"
        is_bluetooth = bool(_BLUETOOTH_NAME.fullmatch(_name(port))) or "bluetooth" in description.lower()
        kind: Kind = "bluetooth" if is_bluetooth else "serial"
        found.append(Found(f"serial://{port}", kind, description or f"{kind} port"))
    for address, name in paired.items():
        if address not in bound:
            channel = f"?channel={EPUCK2_CHANNEL}" if name.lower().startswith("e-puck2") else ""
            found.append(Found(f"rfcomm://{address}{channel}", "bluetooth", f"{name}, known to this computer"))
    return Survey(tuple(found), tuple(not_tried), tuple(notes))


def is_likely(port: str, description: str = "") -> bool:
    """Return whether the serial port *port* may lead to an e-puck.

    Bound Bluetooth ports, USB serial ports and COM ports may; the ports of the mainboard (``ttyS0``), modems and
    debuggers do not.
    """
    return bool(_LIKELY.fullmatch(_name(port))) and not _UNLIKELY.search(description)


def bound_address(port: str) -> str:
    """Return the Bluetooth address that ``/dev/rfcommN`` is bound to, or an empty string."""
    try:
        with open(f"/sys/class/tty/{_name(port)}/address", encoding="ascii") as file:
            return file.read().strip().upper()
    except (OSError, UnicodeError):
        return ""


def _name(port: str) -> str:
    return re.split(r"[/\\]", port)[-1]


def _simulated(robot: Registered) -> Found:
    # The other URLs lead to the same robot, and a question over one would disturb the program that uses another.
    others = f"; also {', '.join(robot.urls[1:])}" if len(robot.urls) > 1 else ""
    return Found(
        robot.urls[0], "simulation", f"{robot.name} of elib simulate {robot.world} (process {robot.process}){others}"
    )


def _descriptions() -> dict[str, str]:
    try:
        ports = serialx.list_serial_ports()
    except (OSError, serialx.SerialException):
        return {}
    return {
        str(port.device): ", ".join(_words((port.product, port.interface_description, port.manufacturer)))
        for port in ports
    }


def _words(parts: Iterable[str | None]) -> list[str]:
    return list(dict.fromkeys(part for part in parts if part))


def _paired() -> tuple[dict[str, str], list[str]]:
    """Return the names of the robots that this computer is paired with, by address, and where it could not look.

    On other systems than Linux a paired robot has a serial port.
    """
    if sys.platform != "linux":
        return {}, []
    program = shutil.which("bluetoothctl")
    if program is None:
        return {}, ["there is no bluetoothctl here, so robots that are paired but not bound to a port are not listed"]
    try:
        done = subprocess.run(
            [program, "devices"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=BLUETOOTHCTL_TIMEOUT,
            text=True,
            errors="replace",
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return {}, ["bluetoothctl does not answer (is the Bluetooth service running?), so paired robots are not listed"]
    devices = {address.upper(): name.strip() for address, name in _DEVICE.findall(done.stdout)}
    return {
        address: name
        for address, name in devices.items()
        if _ROBOT_NAME.search(name) or address.startswith(_ROBOT_ADDRESS)
    }, []


async def _ask(candidate: Found, timeout: float) -> Found:
    """Open the link, ask the robot for its version, and close it; within *timeout*."""
    try:
        url = parse_url(candidate.url)
    except ArgumentError as error:
        return replace(candidate, reason=error.message)
    if url.scheme == "serial":
        names = await asyncio.to_thread(holders, url.target)
        if names:
            return replace(candidate, reason=f"{', '.join(names)} holds it, so it was left alone")
    has_opened = False
    try:
        async with asyncio.timeout(timeout):
            transport = await open_transport(url)
            has_opened = True
            session = await Session.open(transport)
    except ElibError as error:
        return replace(candidate, reason=error.message.removeprefix(f"{url}: ").removeprefix(f"{url} "))
    except TimeoutError:
        happened = "opened, but nothing answered" if has_opened else "did not open"
        return replace(candidate, reason=f"{happened} within {timeout:g} s")
    await session.close()
    return replace(candidate, firmware=session.profile.name, answer=session.version.text)
