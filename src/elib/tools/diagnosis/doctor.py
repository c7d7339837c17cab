"""The connection doctor: its checks, their order, and which earlier check each of them needs."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from elib.base.errors import ElibError
from elib.link.transport import open_transport, parse_url
from elib.tools.diagnosis import link, robot
from elib.tools.diagnosis.advice import NO_LINK, REPORT, here
from elib.tools.diagnosis.link import Examination, Opener
from elib.tools.diagnosis.report import CheckFailed, CheckResult, Diagnosis, DiagnosisStep
from elib.tools.discovery import candidates, survey


@dataclass(frozen=True, slots=True)
class Check:
    """One check."""

    name: str
    run: Callable[[Examination], Awaitable[CheckResult]]  # makes the check; returns what it found or raises CheckFailed
    needs: str  # name of the step without which this one makes no sense
    limit: float  # time after which the check counts as failed, s; longer than all that it waits for by itself
    codec: str = ""  # the only kind of link that has it, `"serial"` or `"wifi"`; empty for all


CHECKS = (
    Check("link", link.link, "", 11),
    Check("rights", link.rights, "link", 11),
    Check("holder", link.holder, "rights", 11),
    Check("opening", link.opening, "holder", 11),
    Check("line", link.line, "opening", 8),
    Check("binary session", link.binary_session, "line", 1, "serial"),
    Check("answer", robot.answer, "line", 7),
    Check("firmware", robot.firmware, "answer", 1),
    Check("selector", robot.selector, "answer", 2),
    Check("round trip", robot.round_trip, "answer", 8),
    Check("throughput", robot.throughput, "answer", 5, "serial"),
    Check("picture", robot.picture, "answer", 7),
)
"""The checks in their order. The link is opened once, in the first step that needs it."""


async def diagnose(
    url: str | None = None, *, opener: Opener = open_transport, on_step: Callable[[DiagnosisStep], None] | None = None
) -> Diagnosis:
    """Find out why a robot does not connect, or how well it does.

    A link that another program has open is not opened, and no wheel is told to turn. A link on which nothing answers
    takes at most 20 s: 10 to open it, the rest to listen and to ask.

    Args:
        url: The link; None for the one on which a robot answers, or the only one there is.
        opener: Opens the link.
        on_step: Called with each step as soon as it is done.

    Returns:
        All steps; those that make no sense after one that failed are skipped.
    """
    tell = on_step or (lambda step: None)
    if url is None:
        url, remark = await _choose()
        if not url:
            return _nothing(remark, tell)
    else:
        remark = ""
    examination = Examination(parse_url(url), opener, remark)
    steps: dict[str, DiagnosisStep] = {}
    try:
        for check in CHECKS:
            if check.codec not in ("", examination.codec):
                continue
            step = steps[check.name] = await _make(check, examination, steps)
            tell(step)
    finally:
        await examination.close()
    return Diagnosis(str(examination.url), tuple(steps.values()))


async def _make(check: Check, examination: Examination, before: dict[str, DiagnosisStep]) -> DiagnosisStep:
    if check.needs and not before[check.needs].ok:
        return _skipped(check)
    try:
        async with asyncio.timeout(check.limit):
            found = await check.run(examination)
    except CheckFailed as failure:
        return DiagnosisStep(check.name, False, failure.detail, failure.fix)
    except ElibError as error:
        return DiagnosisStep(check.name, False, examination.plain(error), error.hint or REPORT)
    except TimeoutError:
        return DiagnosisStep(
            check.name, False, f"it did not end within {check.limit:g} s", "switch the robot off and on"
        )
    return DiagnosisStep(check.name, True if found.is_sure else None, found.detail, found.fix)


def _skipped(check: Check) -> DiagnosisStep:
    return DiagnosisStep(check.name, None, f"needs {check.needs}")


async def _choose() -> tuple[str, str]:
    """Return the link to examine, and why this one; an empty link where there is none."""
    listed = await candidates()
    if len(listed.found) > 1:
        listed = await survey()
    if not listed.found:
        left = f" (left out, for robots have no such ports: {', '.join(listed.not_tried)})" if listed.not_tried else ""
        return "", f"there is no port, paired robot or running simulation{left}"
    first, others = listed.found[0], len(listed.found) - 1
    if not others:
        return first.url, "the only one there is"
    return first.url, f"one of {others + 1}, see elib find"


def _nothing(why: str, tell: Callable[[DiagnosisStep], None]) -> Diagnosis:
    steps = [DiagnosisStep(CHECKS[0].name, False, why, here(NO_LINK)), *(_skipped(check) for check in CHECKS[1:])]
    for step in steps:
        tell(step)
    return Diagnosis("", tuple(steps))
