"""``elib doctor``: find out why a robot does not connect, on a page that can be attached to an issue."""

from __future__ import annotations

import platform
import sys
import textwrap

from elib import __version__
from elib.base.plaintext import plain
from elib.cli.arguments import AsJson, NamedUrl, SameUrl, one_of
from elib.cli.terminal import DIM, GREEN, RED, YELLOW, columns, paint, print_json
from elib.link.transport import parse_url, speed_of
from elib.robot.running import run_coroutine
from elib.tools.diagnosis import CHECKS, OFFER, Diagnosis, DiagnosisStep, diagnose

WIDTH = 80
"""Columns of the page: it is made to be attached to an issue."""

MARKS = {"ok": ("ok", GREEN), "warning": ("warn", YELLOW), "failed": ("FAIL", RED), "skipped": ("-", DIM)}


def doctor(url: NamedUrl = None, /, *, robot: SameUrl = None, json: AsJson = False) -> None:
    """Find out why a robot does not connect, step by step, and say what to do.

    Without URL it looks for a link, as `elib find` does. No wheel is told to turn, and a port that another program has
    open is not opened. The exit code is 1 if a step failed.

    For example:
        elib doctor
        elib doctor serial:///dev/rfcomm0
    """
    url = one_of(url, robot)
    speed = "real" if url is None else speed_of(parse_url(url))
    if not json:
        system = f"elib {__version__}, Python {platform.python_version()}, {platform.platform()}"
        link = f"link: {url or 'none was named, so it is looked for'}"
        print(textwrap.fill(system, _width()), link, sep="\n", end="\n\n", flush=True)

    found = run_coroutine(lambda: diagnose(url, on_step=None if json else _show), speed)
    if json:
        print_json(to_json(found))
    else:
        print(ending(found), flush=True)
    if not found.ok:
        raise SystemExit(1)


def lines(step: DiagnosisStep) -> list[str]:
    """Return one step as the lines of the page, without colour."""
    mark = MARKS[step.state][0]
    longest = max(len(check.name) for check in CHECKS)
    first = f"  {mark:<4}  {step.name:<{longest}}  "
    margin = " " * len(first)
    shown = _wrapped(step.detail, first, margin)
    if step.fix:
        shown += _wrapped(step.fix, f"{margin}> ", f"{margin}  ")
    return shown


def ending(found: Diagnosis) -> str:
    """Return the last lines of the page: the verdict, and what to do without a robot."""
    parts = [plain(found.verdict)]
    if not any(step.name == "answer" and step.ok for step in found.steps):
        parts.append(OFFER)
    return "\n" + "\n".join(textwrap.fill(part, _width()) for part in parts)


def to_json(found: Diagnosis) -> dict[str, object]:
    """Return a diagnosis for JSON; ``ok`` of a step that was skipped is None."""
    return {
        "ok": found.ok,
        "verdict": found.verdict,
        "url": found.url,
        "elib": __version__,
        "python": platform.python_version(),
        "system": platform.platform(),
        "steps": found.steps,
    }


def _show(step: DiagnosisStep) -> None:
    mark, colour = MARKS[step.state]
    print("\n".join(lines(step)).replace(mark, paint(mark, colour, sys.stdout), 1), flush=True)


def _wrapped(text: str, first: str, margin: str) -> list[str]:
    return textwrap.wrap(
        plain(text),
        _width(),
        initial_indent=first,
        subsequent_indent=margin,
        break_on_hyphens=False,
        break_long_words=False,
    )


def _width() -> int:
    return min(columns(), WIDTH)
