"""``--log`` and ``--record`` of ``elib run``: what is kept of a performance, its states and words among it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path

from elib.behaviours import Behaviour, RunContext, RunMessage, StateChanged, Style
from elib.errors import ArgumentError, ElibError
from elib.recording.log import Log, log_robot
from elib.recording.recorder import Recorder, check_new
from elib.robot.aio import Epuck
from elib.runner import Records, unwritable
from elib.timebase import running_loop

Watch = Callable[[RunContext, tuple[Epuck, ...]], object]


class Keeping:
    """Keeps what happens on the robots of one performance. A swarm's robots share a log; each has its own recording.

    Args:
        what: The behaviour.
        records: What is kept.

    Raises:
        ArgumentError: A file cannot be, or the behaviour has no robot whose calls could be kept.
        Unsupported: The package mcap is not installed.
    """

    def __init__(self, what: Behaviour, records: Records) -> None:
        if what.style is Style.BYTES and records != Records():
            raise ArgumentError(
                f"{what.name} writes bytes to the line itself: there are no calls to log or record",
                hint="elib run --list says what else there is",
            )
        self._records = records
        self._is_swarm = what.style is Style.SWARM
        self._logs: list[Log] = []
        self._recorders: list[Recorder] = []
        if not self._is_swarm:  # the names of a swarm's recordings are known when its robots are
            records.check()

    def before(self, watch: Watch) -> Watch:
        """Return *watch* so that everything is kept when it is called."""

        def begin(context: RunContext, robots: tuple[Epuck, ...]) -> None:
            self._begin(context, robots)
            watch(context, robots)

        return begin

    def end(self) -> ElibError | None:
        """Finish the files, and return what went wrong with the first that could not be written. Safe to repeat."""
        kept: list[Log | Recorder] = [*self._logs, *self._recorders]
        failure: ElibError | None = None
        for each in kept:
            try:
                each.close()
            except ElibError as error:
                failure = failure or error
        return failure

    def rows(self) -> list[tuple[str, str]]:
        """Return what is said at the end, as label and text."""
        rows = [("log", self._logs[0].target)] if self._logs else []
        if self._recorders:
            more = f" and {len(self._recorders) - 1} more" if len(self._recorders) > 1 else ""
            size = sum(each.size for each in self._recorders)
            messages = sum(each.messages for each in self._recorders)
            state = "" if all(each.is_whole for each in self._recorders) else "not whole: "
            what = f"{messages} messages, {size / 1000:.0f} KB in {self._recorders[0].path}{more}"
            rows.append(("recording", state + what))
        return rows

    def _begin(self, context: RunContext, robots: tuple[Epuck, ...]) -> None:
        context.listeners.append(self._tell)
        log, record = self._records.log, self._records.record
        try:
            if record is not None:
                paths = [Path(record)]
                if self._is_swarm:
                    paths = [own_name(Path(record), robot.name) for robot in robots]
                for path in paths:
                    check_new(path)
                # The loop of a blocking robot runs elsewhere, or not just now.
                clock = None if running_loop() is not None else lambda: context.began + context.time
                self._recorders = [
                    Recorder(robot, path, clock=clock) for robot, path in zip(robots, paths, strict=True)
                ]
            if log is not None:
                self._logs = [log_robot(robot, log, names=self._records.log_names) for robot in robots]
        except OSError as error:
            raise unwritable(error) from None

    def _tell(self, event: StateChanged | RunMessage) -> None:
        """Write a state or word into every recording, in the thread where it happens."""
        with contextlib.suppress(ElibError):  # closed, or its disk is full: the behaviour goes on
            for recorder in self._recorders:
                if isinstance(event, StateChanged):
                    recorder.note(event.state, kind="state")
                else:
                    recorder.note(event.text)


def own_name(path: Path, robot: str) -> Path:
    """Return the file of one robot of a swarm: ``run-NAME.mcap``."""
    word = "".join(letter if letter.isalnum() or letter in "-_." else "-" for letter in robot)
    return path.with_name(f"{path.stem}-{word}{path.suffix}")


__all__ = ["Keeping", "own_name"]
