"""``elib run``: one of the behaviours that come with elib, on any robot."""

from __future__ import annotations

import contextlib
import enum
import inspect
import math
import os
import select
import sys
import threading
from collections.abc import Callable, Mapping
from typing import Annotated

from cyclopts import App
from cyclopts import Parameter as Cli

from elib.behaviours import Behaviour, RunContext, RunMessage, RunResult, StateChanged, behaviours, find, play
from elib.behaviours._run.context import DEFAULT_SEED
from elib.cli.arguments import LogFile, LogNames, RecordFile, RobotUrl, Seconds, check_duration, number_from
from elib.cli.keeping import Keeping
from elib.cli.live import FRAME, Watcher
from elib.cli.performance import SENSES, Performance
from elib.cli.terminal import BOLD, DIM, YELLOW, LiveLine, say, table
from elib.errors import ArgumentError, ElibError
from elib.protocol.profiles import rule
from elib.protocol.table import Parameter
from elib.recording.log import Vocabulary
from elib.robot.aio import Epuck
from elib.robot.statistics import Statistics, merged
from elib.robot.watchdog import is_supported
from elib.runner import NOTHING, Records
from elib.view.report import Chart, check_report, draw_report

Seed = Annotated[int, Cli(name="--seed", metavar="N", help="Of the behaviour's chance: same seed, same run.")]
Plot = Annotated[
    str | None, Cli(name="--plot", metavar="FILE", help="Draw path, speeds and readings to a .png, .svg or .pdf.")
]

SAMPLES = (
    "port-turn-around",
    "actuators-tour",
    "sensors-tour",
    "asynchronous-sensors",
    "show-image",
    "bull",
    "billiard",
    "go-and-turn",
    "go-to-light",
    "go-x-cm",
    "failure-by-exceptions",
    "show-processed-image",
    "logging-example",
)
"""In the order of the Main of 2011; two that it had left out stand where they belong."""

EACH = 60.0
"""s for each of them, where it does not end by itself or by Enter."""


app = App(name="run")


@app.default
def choose(
    behaviour: Annotated[str | None, Cli(show=False)] = None,
    /,
    *,
    listed: Annotated[bool, Cli(name="--list", help="List the behaviours.")] = False,
) -> None:
    """Let a robot behave until it is done, the time is over, or you press Enter or Ctrl-C; then it is stopped.

    `elib run --list` says what there is.

    Raises:
        ArgumentError: There is no such behaviour, or none was named.
    """
    if behaviour is not None:
        find(behaviour)  # says what may have been meant: had it been there, its own command would run
    if not listed:
        raise ArgumentError("elib run needs the name of a behaviour", hint="elib run --list says what there is")
    print(table([(each.name, each.summary) for each in behaviours().values()], indent=0))


@app.command(name="all")
def run_all(*, robot: RobotUrl | None = None, seconds: Annotated[float, Cli(name="--for", metavar="S")] = EACH) -> None:
    """Run the samples of 2011 one after another, as their Main did; Enter goes on to the next.

    Args:
        robot: The robot for all; a virtual one in each sample's own world unless given, or named sim:// alone.
        seconds: Robot time for each that has no end of its own, seconds.
    """
    check_duration(seconds)
    for name in SAMPLES:
        say(f"\n== {name}: {find(name).summary}")
        run(find(name), robot=robot, seconds=seconds)


def run(
    what: Behaviour,
    *,
    robot: str | None = None,
    seconds: float | None = None,
    seed: int = DEFAULT_SEED,
    plot: str | None = None,
    options: Mapping[str, object] | None = None,
    records: Records = NOTHING,
) -> None:
    """Perform a behaviour and sum it up.

    Raises:
        ArgumentError: The command line is wrong; nothing was sent.
        ElibError: The robot could not be reached, or was lost; or the plot, log or recording could not be written.
    """
    what.check(options or {})
    check_duration(seconds)
    url = what.resolve_url(robot)
    keeping = Keeping(what, records)
    if plot is not None:
        check_report(plot)
    shown = Display(what, url)
    outcome = None
    try:
        outcome = play(
            what,
            url,
            seconds=seconds,
            options=options,
            seed=seed,
            watch=keeping.before(shown.begin),
            watchdog=is_supported(),
        )
    finally:
        unkept = keeping.end()
        shown.end()
        if shown.performance is not None:
            say(table([*rows_of(shown.performance, shown.statistics(), outcome), *keeping.rows()], indent=0))
            if plot is not None:
                try:
                    _plot(plot, what, url, shown.performance)
                    say(f"plot        {plot}")
                except ElibError as error:
                    if outcome is not None:
                        raise
                    say(f"plot        none: {error}")  # what ended the run says more
    if unkept is not None:
        raise unkept


class Display:
    """The live line of a performance, its words, and the Enter that ends it.

    Args:
        what: The behaviour.
        url: Of its robot.
    """

    def __init__(self, what: Behaviour, url: str) -> None:
        self.performance: Performance | None = None
        self._what = what
        self._url = url
        self._line = LiveLine()
        self._watcher = Watcher()
        self._robots: tuple[Epuck, ...] = ()
        self._is_over = threading.Event()
        self._drawing = threading.Lock()

    def begin(self, context: RunContext, robots: tuple[Epuck, ...]) -> None:
        """Begin to follow."""
        self.performance = Performance(context, robots)
        self._robots = robots
        context.listeners.append(self._tell)
        if len(robots) == 1:
            self._watcher.attach(robots[0], context.began)
        if self._line.is_shown:
            whom = f"{robots[0].name} ({robots[0].firmware})" if len(robots) == 1 else self._url
            say(f"{self._what.name} on {whom}; Enter or Ctrl-C ends it")
            threading.Thread(target=self._draw, name="elib live line", daemon=True).start()
        ENTER.ends(context)

    def end(self) -> None:
        """Take the live line away."""
        self._is_over.set()
        with self._drawing:
            self._line.clear()

    def statistics(self) -> Statistics | None:
        """Return how the links have been; None without a link."""
        return merged([robot.statistics for robot in self._robots]) if self._robots else None

    def _tell(self, event: StateChanged | RunMessage) -> None:
        if isinstance(event, RunMessage):
            with self._drawing:
                self._line.clear()
                say(event.text)

    def _draw(self) -> None:
        while not self._is_over.wait(FRAME):
            with self._drawing:
                if not self._is_over.is_set():
                    self._line.show(self._parts())

    def _parts(self) -> list[tuple[str, str]]:
        assert self.performance is not None
        context = self.performance.context
        parts = [(f"{context.time:6.1f} s  ", BOLD)]
        if context.current_state:
            parts.append((f"{context.current_state:<12} ", YELLOW))
        if self._robots:
            parts.append((f"{self.performance.distance:6.2f} m   ", BOLD))
        if len(self._robots) == 1:
            parts += self._watcher.robot_parts()
        elif self._robots:
            parts.append((f"{len(self._robots)} robots", DIM))
        return parts


class Enter:
    """The Enter key: it ends the performance that is on. One thread reads, however many performances there are."""

    def __init__(self) -> None:
        self._context: RunContext | None = None
        self._reader: threading.Thread | None = None

    def ends(self, context: RunContext) -> None:
        """Let the next Enter end *context*."""
        self._context = context
        if self._reader is None or not self._reader.is_alive():
            self._reader = threading.Thread(target=self._read, name="elib waits for Enter", daemon=True)
            self._reader.start()

    def _read(self) -> None:
        # The end of the input is no Enter. It may be closed meanwhile, or be a test's.
        with contextlib.suppress(OSError, ValueError):
            while sys.stdin is not None and self._is_ours() and sys.stdin.readline():
                if self._context is not None:
                    self._context.finish("enter")

    @staticmethod
    def _is_ours() -> bool:
        """Wait until a key is for us: who reads a terminal in the background is suspended, robot and all."""
        if not sys.stdin.isatty() or sys.platform == "win32":
            return True
        number = sys.stdin.fileno()
        while True:
            if os.tcgetpgrp(number) != os.getpgrp():
                _PAUSE.wait(BACKGROUND)
            elif select.select([number], [], [], BACKGROUND)[0] and os.tcgetpgrp(number) == os.getpgrp():
                return True


BACKGROUND = 0.3
"""s between two looks at whether the terminal is ours."""
_PAUSE = threading.Event()
ENTER = Enter()


def rows_of(
    performance: Performance, statistics: Statistics | None, outcome: RunResult | None
) -> list[tuple[str, str]]:
    """Return what is said at the end of a performance, as label and text."""
    context = performance.context
    ended = {
        "done": "by itself",
        "time": "its time was over",
        "enter": "by Enter",
        "error": "by an error",
        "interrupt": "by Ctrl-C or a signal",
    }
    reason = context.reason if outcome is None else outcome.reason
    rows = [
        ("robot time", f"{context.time if outcome is None else outcome.duration:.1f} s, {ended.get(reason, reason)}")
    ]
    if performance.followers:
        source = "by the simulated world" if performance.is_true else "as the wheels were told"
        rows.append(("distance", f"{performance.distance:.2f} m, {source}"))
    spans = performance.time_in_states()
    if spans:
        shown = (
            f"{name} {seconds:.1f} s" + (f" in {count} times" if count > 1 else "") for name, seconds, count in spans
        )
        rows.append(("states", ", ".join(shown)))
    return rows + ([] if statistics is None else link_rows(statistics))


def _plot(path: str, what: Behaviour, url: str, performance: Performance) -> None:
    floor = performance.floor()
    charts = []
    whose = f"{performance.kept[0].name}: " if len(performance.kept) > 1 else ""
    for kept in performance.kept[:1]:
        if kept.speeds:
            times, left, right = zip(*kept.speeds, strict=True)
            charts.append(Chart(f"{whose}wheels, rev/s", times, (left, right), ("left", "right"), is_stepped=True))
        for kind, readings in kept.readings.items():
            title, names = SENSES[kind]
            lines = list(zip(*(numbers for _, numbers in readings), strict=True))
            charts.append(Chart(whose + title, [time for time, _ in readings], lines, names[: len(lines)]))
    context = performance.context
    draw_report(
        path,
        title=f"{what.name} on {url}, {context.time:.1f} s, {performance.distance:.2f} m",
        floor=None if floor is None else floor[0],
        trails=[] if floor is None else floor[1],
        charts=charts,
        states=context.states,
        seconds=context.time,
    )


def summary_rows(duration: float, statistics: Statistics) -> list[tuple[str, str]]:
    """Return what is said at the end of every performance, as label and text."""
    return [
        ("robot time", f"{duration:.1f} s"),
        *link_rows(statistics),
    ]


def link_rows(statistics: Statistics) -> list[tuple[str, str]]:
    """Return how the link was, as label and text."""
    failed = statistics.refused + statistics.unsent
    return [
        (
            "commands",
            f"{statistics.count} answered, {statistics.lost} answers lost"
            + (f", {failed} failed otherwise" * (failed > 0)),
        ),
        ("round trip", f"median {_milliseconds(statistics.median)}, 99 % below {_milliseconds(statistics.p99)}"),
    ]


def _milliseconds(seconds: float) -> str:
    return "unknown" if math.isnan(seconds) else f"{seconds * 1000:.1f} ms"


def _command(what: Behaviour) -> Callable[..., None]:
    """Return a function whose signature is the behaviour's, as the parser wants it."""

    def command(
        *,
        robot: str | None = None,
        seconds: float | None = None,
        seed: int = DEFAULT_SEED,
        plot: str | None = None,
        log: str | None = None,
        log_names: Vocabulary = "python",
        record: str | None = None,
        **texts: str,
    ) -> None:
        run(
            what,
            robot=robot,
            seconds=seconds,
            seed=seed,
            plot=plot,
            records=Records(log, record, log_names),
            options={name: number_from(text) for name, text in texts.items()},
        )

    typed = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
        for name, default, annotation in (
            ("robot", what.url, RobotUrl),
            ("seconds", None, Seconds),
            ("seed", DEFAULT_SEED, Seed),
            ("plot", None, Plot),
            ("log", None, LogFile),
            ("log_names", "python", LogNames),
            ("record", None, RecordFile),
            *((option.name, _default(option), _option(option)) for option in what.options),
        )
    ]
    command.__annotations__ = {item.name: item.annotation for item in typed}
    setattr(command, "__signature__", inspect.Signature(typed))  # noqa: B010  # functions declare no such attribute
    return command


def _option(option: Parameter) -> object:
    return Annotated[str, Cli(metavar=option.name[:1].upper(), help=rule(option.quantity))]


def _default(option: Parameter) -> str:
    return option.default.name.lower() if isinstance(option.default, enum.Enum) else str(option.default)


for each in behaviours().values():
    app.command(_command(each), name=each.name, help=each.doc)
