"""The summary of ``elib run``: what the robots of a run did, as rows of text."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from elib.link.session.statistics import LinkStats
from elib.records.recorder import Recorder
from elib.studies.drive import RobotReport

ENDINGS = {
    "done": "ended by itself",
    "time": "its time was over",
    "enter": "ended by Enter",
    "error": "ended by an error",
    "interrupt": "ended by Ctrl-C or a signal",
}


def time_in_states(states: Sequence[tuple[float, str]], end: float) -> dict[str, tuple[float, int]]:
    """Return each state's time, s, and how often it was entered, by its name, in the order of first entry."""
    spans: dict[str, tuple[float, int]] = {}
    for (since, name), (until, _) in zip(states, [*states, (end, "")][1:], strict=True):
        seconds, count = spans.get(name, (0.0, 0))
        spans[name] = seconds + until - since, count + 1
    return spans


def state_rows(spans: Mapping[str, tuple[float, int]]) -> list[tuple[str, str]]:
    """Return the times in states as label and text; nothing without a state."""
    told = [
        f"{name} {seconds:.1f} s" + (f" in {count} times" if count > 1 else "")
        for name, (seconds, count) in spans.items()
    ]
    return [("states", ", ".join(told))] if told else []


def drive_rows(robots: Sequence[RobotReport]) -> list[tuple[str, str]]:
    """Return how far robots went and what they touched, as label and text; nothing without a robot."""
    if not robots:
        return []
    is_true = all(robot.world is not None for robot in robots)
    source = "by the simulated world" if is_true else "as the wheels were told"
    rows = [("distance", f"{math.fsum(robot.distance for robot in robots):.2f} m, {source}")]
    contacts = sum(robot.contacts for robot in robots)
    if contacts:
        seconds = math.fsum(robot.contact_time for robot in robots)
        rows.append(("contacts", f"{contacts}, for {seconds:.1f} s together"))
    return rows


def link_rows(statistics: LinkStats) -> list[tuple[str, str]]:
    """Return how the link was, as label and text."""
    failed = statistics.refused + statistics.unsent
    share = "99 % below" if statistics.count >= 100 else "at most"  # of fewer, the greatest is the 99th percentile
    answered = f"{statistics.count} answered, {statistics.lost} answers lost"
    return [
        ("commands", answered + (f", {failed} failed otherwise" if failed else "")),
        ("round trip", f"median {_milliseconds(statistics.median)}, {share} {_milliseconds(statistics.p99)}"),
    ]


def amount(recorder: Recorder) -> str:
    """Return the amount that was recorded, in words."""
    return f"{recorder.messages} messages, {recorder.size / 1000:.0f} KB"


def _milliseconds(seconds: float) -> str:
    return "unknown" if math.isnan(seconds) else f"{seconds * 1000:.1f} ms"
