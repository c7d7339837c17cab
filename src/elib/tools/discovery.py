"""``elib.find()``: which robots this computer can reach; no robot is disturbed.

Only links that may lead to a robot are tried: bound Bluetooth ports, USB serial ports, COM ports, robots with which the
system is paired, and running simulations. A port that another program has open is left alone. The network is asked
only if the caller says so.
"""

from __future__ import annotations

import asyncio
import ipaddress
import os
import re
import shutil
import socket
import subprocess
import sys
from dataclasses import dataclass, replace
from typing import Literal

from elib.base.errors import ArgumentError, ElibError
from elib.base.timebase import require_real_time
from elib.link.session import Session, check_timeout
from elib.link.transport import Transport, open_transport, parse_url
from elib.link.transport.ports import holders, list_ports
from elib.simulator.emulator.registry import Registered, running

Kind = Literal["serial", "bluetooth", "wifi", "simulation"]

TIMEOUT = 5.0
"""s for each link; all are tried at the same time. A radio looks for a robot that is switched off for up to 5.12 s."""

BLUETOOTHCTL_TIMEOUT = 2.0
"""s for the system's list of paired devices; ``bluetoothctl`` waits for ever if its service does not run."""

LOCAL = "local"
"""The network of this computer's own address, as far as an address block of 256 goes."""
MAX_ADDRESSES = 1024
"""The largest network that is asked."""
AT_ONCE = 64
"""Addresses that are asked at the same time: a home router loses packets if there are many more."""
CONNECTING = 1.0
"""s for an address of the network. Most belong to no device, and a robot in the same network answers in 0.1 s."""
_FAR_AWAY = "192.0.2.1"
"""An address that no computer has (RFC 5737); the system says which of its own it would use to get there."""

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
        kind: ``serial``, ``bluetooth`` (a port bound to a robot, or its address), ``wifi`` or ``simulation``.
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
    """The result of a search."""

    found: tuple[Found, ...]  # the links that may lead to a robot; after survey each has an answer or a reason
    not_tried: tuple[str, ...] = ()  # serial ports that were left alone because robots do not have such ports
    notes: tuple[str, ...] = ()  # where the search could not look, one sentence each


async def find(*, timeout: float = TIMEOUT, all_ports: bool = False, network: str | None = None) -> list[Found]:
    """Look for robots, and ask each for its version.

    A robot is asked for nothing else, and goes on with what it does. Only an e-puck2 on Wi-Fi is stopped, for its
    protocol has no question without a command; one that another program drives is not disturbed.

    Args:
        timeout: Seconds for each link; all are tried at the same time.
        all_ports: Try every serial port. Other devices may react to the question in unexpected ways.
        network: A network of this computer, such as ``"192.168.1.0/24"``, in which every address is asked for an
            e-puck2; ``"local"`` is the one of the computer's own address, None is none.

    Returns:
        Robots that answer (``firmware`` is set), then links on which no robot answers (``reason`` says why).

    Raises:
        ArgumentError: *timeout* is out of its range, or *network* is not a network of this computer.
        SimulationError: The event loop simulates time.
    """
    return list((await survey(timeout=timeout, all_ports=all_ports, network=network)).found)


async def survey(*, timeout: float = TIMEOUT, all_ports: bool = False, network: str | None = None) -> Survey:
    """Look for robots as :func:`find` does, and say where the search could not look."""
    timeout = check_timeout(timeout)
    addresses = [] if network is None else addresses_of(network)
    listed = await candidates(all_ports=all_ports)
    places = asyncio.Semaphore(AT_ONCE)
    async with asyncio.TaskGroup() as group:
        tries = [group.create_task(_ask(each, timeout), name=f"find {each.url}") for each in listed.found]
        asked = [group.create_task(_ask_address(each, timeout, places), name=f"find {each}") for each in addresses]
    heard = [each for each in (task.result() for task in asked) if each is not None]
    found = sorted([*(task.result() for task in tries), *heard], key=lambda each: each.firmware is None)
    return replace(listed, found=tuple(found))


def addresses_of(network: str) -> list[str]:
    """Return the addresses of a network of this computer that others may have."""
    if network == LOCAL:
        own = _own_address(_FAR_AWAY)
        if own is None:
            raise ArgumentError("this computer is in no network", hint="connect it to the network of the robots")
        block = ipaddress.IPv4Network(f"{own}/24", strict=False)
    else:
        try:
            block = ipaddress.IPv4Network(network, strict=False)
        except ValueError as error:
            raise ArgumentError(f"{network!r} is not a network: {error}", hint="write 192.168.1.0/24") from None
        own = _own_address(str(block[-1] if block.num_addresses == 1 else block[1]))
    if block.num_addresses > MAX_ADDRESSES:
        raise ArgumentError(
            f"{network} has {block.num_addresses} addresses; {MAX_ADDRESSES} are the most that are asked",
            hint="name a part of it, such as the /24 of the robots",
        )
    if own is None or own not in block:
        raise ArgumentError(
            f"this computer has no address in {network}",
            hint="only robots in a network of its own are looked for; connect to one robot with wifi://HOST",
        )
    return [str(address) for address in block.hosts() if own.is_loopback or address != own]


def _own_address(target: str) -> ipaddress.IPv4Address | None:
    """Return the address from which this computer would speak to *target*; None without a way there."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asker:
        try:
            asker.connect((target, 1))  # of a datagram socket: nothing is sent
        except OSError:
            return None
        return ipaddress.IPv4Address(asker.getsockname()[0])


async def _ask_address(address: str, timeout: float, places: asyncio.Semaphore) -> Found | None:
    """Ask the robot at an address; return None where nothing listens."""
    url = f"wifi://{address}"
    async with places:
        try:
            async with asyncio.timeout(CONNECTING):
                transport = await open_transport(url)
        except (ElibError, TimeoutError):
            return None
        return await _ask(Found(url, "wifi", "a robot in the network"), timeout, transport)


async def candidates(*, all_ports: bool = False) -> Survey:
    """List the links that may lead to a robot, and open none."""
    require_real_time("looking for robots")
    return await asyncio.to_thread(_candidates, all_ports)


def _candidates(all_ports: bool) -> Survey:
    found = [_simulated(robot) for robot in running()]
    taken = {os.path.realpath(each.url.removeprefix("serial://")) for each in found}
    paired, notes = _paired()
    not_tried: list[str] = []
    bound: set[str] = set()
    for port, description in list_ports().items():
        if os.path.realpath(port) in taken:
            continue
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
            found.append(Found(f"rfcomm://{address}", "bluetooth", f"{name}, known to this computer"))
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


async def _ask(candidate: Found, timeout: float, transport: Transport | None = None) -> Found:
    """Open the link unless it is open, ask the robot for its version, and close it; within *timeout*."""
    try:
        url = parse_url(candidate.url)
    except ArgumentError as error:
        return replace(candidate, reason=error.message)
    if url.scheme == "serial":
        names = await asyncio.to_thread(holders, url.target)
        if names:
            return replace(candidate, reason=f"{', '.join(names)} holds it, so it was left alone")
    try:
        async with asyncio.timeout(timeout):
            transport = transport or await open_transport(url)
            session = await Session.open(transport)
    except ElibError as error:
        return replace(candidate, reason=error.message.removeprefix(f"{url}: ").removeprefix(f"{url} "))
    except TimeoutError:
        happened = "did not open" if transport is None else "opened, but nothing answered"
        return replace(candidate, reason=f"{happened} within {timeout:g} s")
    await session.close()
    return replace(candidate, firmware=session.profile.name, answer=session.version.text)
