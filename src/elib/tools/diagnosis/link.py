"""The link under examination, and the checks that need no robot: does the link exist, open and fall silent."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from pathlib import Path

from elib.base.errors import (
    ArgumentError,
    ElibError,
    LinkBusy,
    LinkDenied,
    LinkError,
    LinkLost,
    LinkNotFound,
    SimulationError,
    Unsupported,
)
from elib.link.protocol.wifi import EMPTY
from elib.link.session import Session
from elib.link.transport import Transport, Url
from elib.link.transport.base import codec_of
from elib.link.transport.ports import busy, holders, list_ports
from elib.link.transport.tcp import ONE_AT_A_TIME
from elib.tools.diagnosis import advice
from elib.tools.diagnosis.line import Exchange, heard, interrogate
from elib.tools.diagnosis.report import CheckFailed, CheckResult
from elib.tools.discovery import bound_address

ADAPTERS = Path("/sys/class/bluetooth")
"""Where Linux lists its Bluetooth adapters."""
SHOWN = 16
"""Bytes of what was received that are shown."""
SLOW_ANSWER = 0.5
"""s; ten times what the thesis measured for the same question (wire-protocol.md, 5.13)."""

Opener = Callable[[Url], Awaitable[Transport]]
"""Opens a link: :func:`elib.link.transport.open_transport`, or what a test puts in its place."""


@dataclass(slots=True)
class Examination:
    """One link, and what the checks so far have found out about it."""

    url: Url
    opener: Opener  # opens the link
    remark: str = ""  # how the link was chosen; empty where the user named it
    transport: Transport | None = None  # the open link; None where it is not open
    error: ElibError | None = None  # why the link did not open; None where it did
    opening_time: float = 0.0  # time that opening took, s
    exchange: Exchange | None = None  # what was received before anything relied on the protocol; None before the check
    session: Session | None = None  # the robot's session once the robot was recognised; None before
    _was_tried: bool = field(default=False, repr=False)

    @property
    def is_port(self) -> bool:
        """Whether the link is a serial port of this computer."""
        return self.url.scheme == "serial"

    @property
    def port_exists(self) -> bool:
        """Whether the system has this serial port."""
        return os.path.exists(self.url.target) or self.url.target in list_ports()

    @property
    def codec(self) -> str:
        """What the link carries: ``"serial"`` or ``"wifi"``."""
        if self.transport is not None:
            return codec_of(self.transport)
        return "wifi" if self.url.scheme == "wifi" else "serial"

    async def attempt(self) -> ElibError | None:
        """Open the link once, and return why it did not open. A port that another program has open is not opened."""
        if self._was_tried:
            return self.error
        self._was_tried = True
        if self.is_port:
            names = await asyncio.to_thread(holders, self.url.target)
            if names:
                self.error = busy(self.url, names)
                return self.error
        loop = asyncio.get_running_loop()
        began = loop.time()
        try:
            self.transport = await self.opener(self.url)
        except ElibError as error:
            self.error = error
        except OSError as error:  # from an opener that is not elib's own
            self.error = LinkError(f"{self.url}: {error.strerror or error}")
        self.opening_time = loop.time() - began
        return self.error

    def plain(self, error: ElibError) -> str:
        """Return an error's message without the URL of the link, which the title of the page has."""
        return error.message.removeprefix(f"{self.url}: ").removeprefix(f"{self.url} ")

    async def close(self) -> None:
        """Close the link."""
        if self.session is not None:
            await self.session.close()
        elif self.transport is not None:
            await self.transport.close()


async def link(examination: Examination) -> CheckResult:
    """Check that there is such a port, adapter, host or world."""
    url = examination.url
    if examination.is_port and examination.port_exists:
        address = bound_address(url.target)
        what = f"there is a port {url.target}"
        return CheckResult(advice.joined(f"{what}, bound to {address}" if address else what, examination.remark))
    if url.scheme == "rfcomm" and not _has_adapter():
        raise CheckFailed("this computer has no Bluetooth adapter", advice.here(advice.NO_ADAPTER))
    error = await examination.attempt()
    if isinstance(error, (LinkNotFound, Unsupported, ArgumentError, SimulationError)):
        raise CheckFailed(examination.plain(error), error.hint)
    return CheckResult(advice.joined(_found(url), examination.remark))


async def rights(examination: Examination) -> CheckResult:
    """Check that this user may open the link."""
    error = await examination.attempt()
    if isinstance(error, LinkDenied):
        raise CheckFailed(examination.plain(error), error.hint)
    return CheckResult("this user may open it" if examination.is_port else "none are needed")


async def holder(examination: Examination) -> CheckResult:
    """Check that no other program has the link open."""
    error = await examination.attempt()
    if isinstance(error, LinkBusy):
        raise CheckFailed(examination.plain(error), advice.joined(error.hint, advice.here(advice.SHARED_PORT)))
    if not examination.is_port:
        return CheckResult("no other program is seen to have it open")
    return CheckResult("no other program has it open" if sys.platform == "linux" else "no other program has locked it")


async def opening(examination: Examination) -> CheckResult:
    """Check that the link opens."""
    error = await examination.attempt()
    if error is not None:
        raise CheckFailed(
            examination.plain(error),
            advice.joined(error.hint, advice.here(advice.OPENING) if examination.is_port else ""),
        )
    return CheckResult(f"it opens, in {examination.opening_time:.2f} s")


async def line(examination: Examination) -> CheckResult:
    """Check that the line is silent until it is asked, and that the answer is text."""
    assert examination.transport is not None
    if examination.codec == "wifi":
        return await _packets(examination, examination.transport)
    try:
        found = examination.exchange = await interrogate(examination.transport)
    except LinkLost as error:
        served = ONE_AT_A_TIME if examination.url.scheme == "tcp" else ""
        raise CheckFailed(examination.plain(error), advice.joined(served, error.hint)) from error
    if found.is_noise:
        received = _shown(found.first + found.second or found.unasked)
        raise CheckFailed(f"what comes is not text: {received}", advice.WRONG_SPEED)
    if not found.is_quiet:
        raise CheckFailed(f"it never falls silent: {_shown(found.unasked)}", advice.CHATTER)
    if found.unasked:
        return CheckResult(f"{len(found.unasked)} bytes of an earlier program's answer came first; now it is silent")
    return CheckResult("silent until asked")


async def _packets(examination: Examination, transport: Transport) -> CheckResult:
    """Check that the robot sends nothing before it gets a command, as its Wi-Fi firmware does since February 2019."""
    try:
        unasked = await heard(transport)
    except LinkLost as error:
        raise CheckFailed(examination.plain(error), advice.joined(ONE_AT_A_TIME, error.hint)) from error
    if not unasked:
        return CheckResult("silent until it gets a command")
    if not unasked.strip(bytes((EMPTY,))):
        raise CheckFailed("empty packets come before any command, as from builds before February 2019", advice.OLD_WIFI)
    raise CheckFailed(f"what comes is not an e-puck2's Wi-Fi: {_shown(unasked)}", advice.NO_WIFI)


async def binary_session(examination: Examination) -> CheckResult:
    """Check whether an earlier program left the robot in a binary session, or in the middle of a command."""
    found = examination.exchange
    assert found is not None
    if found.was_swallowed and not found.first:
        return CheckResult(
            "one was open and swallowed text; zeros ended it, the wheels were stopped, and the robot answers again",
            "let programs end with close() or a with block; some old monitors leave such sessions open on purpose",
        )
    if found.was_swallowed:
        return CheckResult(
            f"half a command was on the line: {_shown(found.first)} came instead of a version; now it is free",
            "let programs end with close() or a with block",
        )
    if not found.answered:
        return CheckResult("unknown: nothing answers, before zeros or after", is_sure=False)
    if found.waited > SLOW_ANSWER:
        return CheckResult(f"none was open; the first answer took {found.waited:.1f} s")
    return CheckResult("none was open")


def _found(url: Url) -> str:
    """Return what there is, for a link that is not a port of this computer."""
    match url.scheme:
        case "tcp":
            return f"a program listens on {url.target}"
        case "sim":
            return "a virtual robot, made for this examination"
        case "wifi":
            return f"something listens on {url.target}"
        case "rfcomm":
            return "there is a Bluetooth adapter"
    return f"there is something that opens {url.scheme}://"


def _has_adapter() -> bool:
    """Return whether this computer has a Bluetooth adapter, as far as the system tells without opening one."""
    return sys.platform != "linux" or any(ADAPTERS.glob("hci*"))


def _shown(data: bytes) -> str:
    """Return the beginning of *data*: text as text, anything else as hexadecimal numbers, which wrap well."""
    start = data[:SHOWN]
    text = repr(start.decode("ascii")) if start.isascii() else start.hex(" ")
    return f"{len(data)} bytes, {text}{' ...' if len(data) > SHOWN else ''}"
