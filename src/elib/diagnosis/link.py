"""The checks that need no robot: is there a link, may this user use it, does somebody else, does it open."""

from __future__ import annotations

import sys
from pathlib import Path

from elib.diagnosis.advice import NO_ADAPTER, OPENING, SHARED_PORT, here, joined
from elib.diagnosis.case import Case
from elib.diagnosis.report import Finding, Trouble
from elib.discovery import bound_address
from elib.errors import ArgumentError, LinkBusy, LinkDenied, LinkNotFound, SimulationError, Unsupported

ADAPTERS = Path("/sys/class/bluetooth")
"""Where Linux lists its Bluetooth adapters."""


async def link(case: Case) -> Finding:
    """Is there such a port, adapter, host or world?"""
    if case.is_port and case.port_exists:
        address = bound_address(case.url.target)
        what = f"there is a port {case.url.target}"
        return Finding(joined(f"{what}, bound to {address}" if address else what, case.remark))
    if case.url.scheme == "rfcomm" and not _has_adapter():
        raise Trouble("this computer has no Bluetooth adapter", here(NO_ADAPTER))
    await case.attempt()
    error = case.error
    if isinstance(error, (LinkNotFound, Unsupported, ArgumentError, SimulationError)):
        raise Trouble(case.plain(error), error.hint)
    return Finding(joined(_met(case), case.remark))


async def rights(case: Case) -> Finding:
    """May this user open it?"""
    await case.attempt()
    error = case.error
    if isinstance(error, LinkDenied):
        raise Trouble(case.plain(error), error.hint)
    return Finding("this user may open it" if case.is_port else "none are needed")


async def holder(case: Case) -> Finding:
    """Does somebody else have it open?"""
    await case.attempt()
    error = case.error
    if isinstance(error, LinkBusy):
        raise Trouble(case.plain(error), joined(error.hint, here(SHARED_PORT)))
    if not case.is_port:
        return Finding("nobody else is seen to have it")
    return Finding("no other program has it open" if sys.platform == "linux" else "no other program has locked it")


async def opening(case: Case) -> Finding:
    """Does it open?"""
    await case.attempt()
    error = case.error
    if error is not None:
        raise Trouble(case.plain(error), joined(error.hint, here(OPENING) if case.is_port else ""))
    return Finding(f"it opens, in {case.opening_time:.2f} s")


def _met(case: Case) -> str:
    match case.url.scheme:
        case "tcp":
            return f"somebody listens on {case.url.target}"
        case "sim":
            return "a virtual robot, made for this examination"
        case "rfcomm":
            return "there is a Bluetooth adapter"
    return f"there is something that opens {case.url.scheme}://"


def _has_adapter() -> bool:
    """Return whether this computer has a Bluetooth adapter, as far as the system tells without being asked to open."""
    return sys.platform != "linux" or any(ADAPTERS.glob("hci*"))
