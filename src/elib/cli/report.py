"""Reports of a run, from the traces of the robots' links: for the summary and the plot of ``elib run``."""

from __future__ import annotations

import math
from collections.abc import Sequence

from elib.behaviours import RunResult
from elib.behaviours._run.context import RunContext
from elib.robot.aio import Epuck
from elib.session.statistics import LinkStats, merged
from elib.view.drive import RobotReport, draw_drive

ENDINGS = {
    "done": "ended by itself",
    "time": "its time was over",
    "enter": "ended by Enter",
    "error": "ended by an error",
    "interrupt": "ended by Ctrl-C or a signal",
}


class RunReport:
    """The report of what all robots of a run did.

    Args:
        context: The run.
        robots: The robots that take part, open.
    """

    def __init__(self, context: RunContext, robots: tuple[Epuck, ...]) -> None:
        self.context = context
        self.robots = [RobotReport(robot, context.began) for robot in robots]

    @property
    def distance(self) -> float:
        """How far the robots went, all together, m; nan without a robot."""
        return math.fsum(robot.distance for robot in self.robots) if self.robots else math.nan

    def time_in_states(self) -> list[tuple[str, float, int]]:
        """Return each state's name, the time in it, s, and how often it was entered, in the order of first entry."""
        states = self.context.states
        if not states:
            return []
        spans: dict[str, tuple[float, int]] = {}
        for (since, name), (until, _) in zip(states, [*states[1:], (self.context.time, "")], strict=True):
            seconds, count = spans.get(name, (0.0, 0))
            spans[name] = seconds + until - since, count + 1
        return [(name, seconds, count) for name, (seconds, count) in spans.items()]

    def rows(self, outcome: RunResult | None) -> list[tuple[str, str]]:
        """Return the summary as label and text; *outcome* is None if an error ended the run."""
        reason = self.context.reason if outcome is None else outcome.reason
        duration = self.context.time if outcome is None else outcome.duration
        rows = [("robot time", f"{duration:.1f} s, {ENDINGS.get(reason, reason)}")]
        rows += drive_rows(self.robots)
        spans = [
            f"{name} {seconds:.1f} s" + (f" in {count} times" if count > 1 else "")
            for name, seconds, count in self.time_in_states()
        ]
        if spans:
            rows.append(("states", ", ".join(spans)))
        if self.robots:
            rows += link_rows(merged([each.robot.statistics for each in self.robots]))
        return rows

    def draw(self, path: str, title: str) -> None:
        """Draw paths, states, and the speeds and readings of the first robot.

        Raises:
            ArgumentError: The file cannot be created.
            ElibError: The file cannot be written.
        """
        draw_drive(path, title, self.robots, seconds=self.context.time, states=self.context.states)


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


def _milliseconds(seconds: float) -> str:
    return "unknown" if math.isnan(seconds) else f"{seconds * 1000:.1f} ms"
