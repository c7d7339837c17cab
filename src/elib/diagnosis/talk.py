"""The checks on the bare line: does it fall silent, is it noise, had somebody left a binary session open."""

from __future__ import annotations

from elib.diagnosis.advice import CHATTER, WRONG_SPEED, joined
from elib.diagnosis.case import Case
from elib.diagnosis.line import interrogate
from elib.diagnosis.report import Finding, Trouble
from elib.errors import LinkLost
from elib.transport.tcp import ONE_AT_A_TIME

SHOWN = 16
"""Bytes of what was heard that are shown."""
SLOW_ANSWER = 0.5
"""s; ten times what the thesis measured for the same question (protocol.md, 5.13)."""


async def line(case: Case) -> Finding:
    """Is the line silent until asked, and is what comes then text?"""
    assert case.transport is not None
    try:
        found = case.exchange = await interrogate(case.transport)
    except LinkLost as error:
        served = ONE_AT_A_TIME if case.url.scheme == "tcp" else ""
        raise Trouble(case.plain(error), joined(served, error.hint)) from error
    if found.is_noise:
        raise Trouble(f"what comes is no text: {_shown(found.first + found.second or found.unasked)}", WRONG_SPEED)
    if not found.is_quiet:
        raise Trouble(f"it never falls silent: {_shown(found.unasked)}", CHATTER)
    if found.unasked:
        return Finding(f"{len(found.unasked)} bytes of an earlier program's answer came first; now it is silent")
    return Finding("silent until asked")


async def binary_session(case: Case) -> Finding:
    """Had an earlier program left the robot in the middle of something?"""
    found = case.exchange
    assert found is not None
    if found.was_swallowed and not found.first:
        return Finding(
            "one was open and swallowed text; zeros ended it, the wheels were stopped, and the robot answers again",
            "let programs end with close() or a with block; some old monitors leave such sessions open on purpose",
        )
    if found.was_swallowed:
        return Finding(
            f"half a command was on the line: {_shown(found.first)} came instead of a version; now it is free",
            "let programs end with close() or a with block",
        )
    if not found.answered:
        return Finding("nobody can tell: nothing answers, before zeros or after", is_sure=False)
    if found.waited > SLOW_ANSWER:
        return Finding(f"none was open; the first answer took {found.waited:.1f} s")
    return Finding("none was open")


def _shown(data: bytes) -> str:
    """Return the beginning of *data*: text as such, anything else as numbers, which wrap well and show a pattern."""
    start = data[:SHOWN]
    text = repr(start.decode("ascii")) if start.isascii() else start.hex(" ")
    return f"{len(data)} bytes, {text}{' ...' if len(data) > SHOWN else ''}"
