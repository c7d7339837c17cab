"""``elib run``: run one of the behaviours that come with elib, or a program of yours, on any robot."""

from __future__ import annotations

import contextlib
import enum
import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated

from cyclopts import App
from cyclopts import Parameter as Cli

from elib.behaviours import Behaviour, BehaviourStyle, RunContext, RunMessage, StateChanged, behaviours, find, play
from elib.behaviours._run.context import DEFAULT_SEED
from elib.cli.arguments import RobotUrl, Seconds, check_duration
from elib.cli.live import RunDisplay
from elib.cli.program import is_program
from elib.cli.recordoptions import NOTHING_KEPT, Kept
from elib.cli.report import RunReport
from elib.cli.script import run_program
from elib.cli.terminal import say, table
from elib.errors import ArgumentError, ElibError
from elib.protocol.profiles import rule
from elib.protocol.quantities import number_from
from elib.protocol.table import Parameter
from elib.recording.log import Log
from elib.recording.recorder import Recorder, check_new
from elib.robot.aio import Epuck
from elib.robot.watchdog import is_supported
from elib.runner import NOTHING, Records, unwritable
from elib.timebase import running_loop
from elib.view.report import check_report

Seed = Annotated[
    int, Cli(name="--seed", metavar="N", help="Seed of the behaviour's random numbers: same seed, same run.")
]
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
"""The samples in the order of the Main of 2011; the two that it left out stand where they belong."""

EACH = 60.0
"""s for each sample that does not end by itself."""
EachTime = Annotated[
    float, Cli(name="--for", metavar="S", help="Robot time for each sample that does not end by itself, seconds.")
]


Program = Annotated[str | None, Cli(help="The file of your program, a best.toml, or the name of a behaviour.")]
Arguments = Annotated[str, Cli(help="What follows -- : the command line of your program.")]
Robots = Annotated[
    list[str] | None,
    Cli(
        name="--robot",
        metavar="URL",
        negative="",
        help="The robot to use, whatever the program names; once for each robot.",
    ),
]
View = Annotated[
    bool,
    Cli(name="--view", help="Show the program's virtual world live in the browser, in real time."),
]
AsJson = Annotated[
    bool, Cli(name="--json", help="Print the summary as one line of JSON; what the program prints goes to stderr.")
]

app = App(name="run")


@app.default
def choose(
    program: Program = None,
    /,
    *arguments: Arguments,
    robot: Robots = None,
    seconds: Seconds = None,
    view: View = False,
    plot: Plot = None,
    records: Kept = NOTHING_KEPT,
    json: AsJson = False,
    listed: Annotated[bool, Cli(name="--list", help="List the behaviours.")] = False,
) -> None:
    """Run a behaviour, or a program of yours, until it ends, its time is over, or Ctrl-C; then stop the robot.

    `elib run avoid` runs a behaviour that comes with elib; `elib run --list` lists them. `elib run avoid --help` shows
    what one of them can be told.

    `elib run my_robot.py` runs any program that uses elib, as `python my_robot.py` does. What follows `--` belongs to
    the program. A summary is printed at the end.

    `elib run best.toml` lets the best controller that `elib evolve` found drive: without --robot in the world of its
    task, with --robot URL your robot. Name several robots to let it drive each of them.
    """
    if program is not None and is_program(program):
        code = run_program(
            program, arguments, robots=robot or (), seconds=seconds, view=view, plot=plot, records=records, json=json
        )
        if code:
            raise SystemExit(code)
        return
    if program is not None:
        for stem in (program, program.replace("-", "_")):  # dashes are what the parser makes of underscores
            if Path(f"{stem}.py").is_file():
                raise ArgumentError(f"there is no behaviour {stem!r}", hint=f"to run the file: elib run {stem}.py")
            if Path(stem).is_dir():
                raise ArgumentError(f"{stem} is a folder", hint=f"name a program in it: elib run {stem}/my_robot.py")
            if Path(stem).is_file():
                raise ArgumentError(f"{stem} is not a program: its name does not end in .py")
        find(program)  # raises, with a suggestion: a behaviour that exists has a command of its own
    if not listed:
        raise ArgumentError("elib run needs the name of a behaviour, or a program", hint="elib run --list lists them")
    print(table([(each.name, each.summary) for each in behaviours().values()], indent=0))


@app.command(name="all")
def run_all(*, robot: RobotUrl | None = None, seconds: EachTime = EACH) -> None:
    """Run the samples of 2011 one after another, as their Main did; Enter goes on to the next.

    Without --robot, or with sim:// alone, each sample has a virtual robot in its own world.
    """
    check_duration(seconds)
    for name in SAMPLES:
        say(f"\n== {name}: {find(name).summary}")
        run(find(name), robot=robot, seconds=seconds)


def run(
    behaviour: Behaviour,
    *,
    robot: str | None = None,
    seconds: float | None = None,
    seed: int = DEFAULT_SEED,
    plot: str | None = None,
    options: Mapping[str, object] | None = None,
    records: Records = NOTHING,
) -> None:
    """Run a behaviour and print a summary.

    Raises:
        ArgumentError: The command line is wrong; nothing was sent.
        ElibError: The robot could not be reached, or was lost; or the plot, log or recording could not be written.
    """
    behaviour.check(options or {})
    check_duration(seconds)
    url = behaviour.resolve_url(robot)
    files = RunFiles(behaviour, records)
    if plot is not None:
        check_report(plot)
    display = RunDisplay(behaviour.name, url)
    report: RunReport | None = None
    outcome = None

    def begin(context: RunContext, robots: tuple[Epuck, ...]) -> None:
        nonlocal report
        files.begin(context, robots)
        report = RunReport(context, robots)
        display.begin(report)

    try:
        outcome = play(
            behaviour, url, seconds=seconds, options=options, seed=seed, watch=begin, watchdog=is_supported()
        )
    finally:
        unwritten = files.end()
        display.end()
        if report is not None:
            say(table([*report.rows(outcome), *files.rows()], indent=0))
            if plot is not None:
                try:
                    report.draw(plot, f"{behaviour.name} on {url}")
                    say(f"plot        {plot}")
                except ElibError as error:
                    if outcome is not None:
                        raise
                    say(f"plot        none: {error}")  # the error that ended the run tells more
    if unwritten is not None:
        raise unwritten


class RunFiles:
    """The log and the recordings of one run. The robots of a swarm share the log; each has a recording of its own.

    Args:
        behaviour: The behaviour that runs.
        records: The files to write.

    Raises:
        ArgumentError: A file cannot be created, or the behaviour has no robot whose calls could be written.
        Unsupported: The package mcap is not installed.
    """

    def __init__(self, behaviour: Behaviour, records: Records) -> None:
        if behaviour.style is BehaviourStyle.BYTES and records != Records():
            raise ArgumentError(
                f"{behaviour.name} writes bytes to the line itself: there are no calls to log or record",
                hint="elib run --list lists the other behaviours",
            )
        self._records = records
        self._is_swarm = behaviour.style is BehaviourStyle.SWARM
        self._logs: list[Log] = []
        self._recorders: list[Recorder] = []
        if not self._is_swarm:  # the names of a swarm's recordings depend on the names of its robots
            records.check()

    def begin(self, context: RunContext, robots: tuple[Epuck, ...]) -> None:
        """Begin to write what happens on open robots.

        Raises:
            ArgumentError: A file cannot be written.
        """
        context.listeners.append(self._note)
        log, record = self._records.log, self._records.record
        try:
            if record is not None:
                paths = [Path(record)]
                if self._is_swarm:
                    paths = [own_name(Path(record), robot.name) for robot in robots]
                for path in paths:
                    check_new(path)
                # The loop of a blocking robot runs in another thread, or does not run now.
                clock = None if running_loop() is not None else lambda: context.began + context.time
                self._recorders = [
                    Recorder(robot, path, clock=clock) for robot, path in zip(robots, paths, strict=True)
                ]
            if log is not None:
                self._logs = [Log(robot, log, names=self._records.log_names) for robot in robots]
        except OSError as error:
            raise unwritable(error) from None

    def end(self) -> ElibError | None:
        """Finish the files, and return the error of the first that could not be written. Safe to repeat."""
        failure: ElibError | None = None
        files: list[Log | Recorder] = [*self._logs, *self._recorders]
        for each in files:
            try:
                each.close()
            except ElibError as error:
                failure = failure or error
        return failure

    def rows(self) -> list[tuple[str, str]]:
        """Return what was written, as label and text."""
        rows = [("log", self._logs[0].target)] if self._logs else []
        if self._recorders:
            more = f" and {len(self._recorders) - 1} more" if len(self._recorders) > 1 else ""
            size = sum(each.size for each in self._recorders)
            messages = sum(each.messages for each in self._recorders)
            state = "" if all(each.is_whole for each in self._recorders) else "not whole: "
            what = f"{messages} messages, {size / 1000:.0f} KB in {self._recorders[0].path}{more}"
            rows.append(("recording", state + what))
        return rows

    def _note(self, event: StateChanged | RunMessage) -> None:
        """Write a state or a line into every recording, in the thread where it happens."""
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


def _command(behaviour: Behaviour) -> Callable[..., None]:
    """Return a function whose signature has the options of a behaviour, as the parser needs it."""

    def command(
        *,
        robot: str | None = None,
        seconds: float | None = None,
        seed: int = DEFAULT_SEED,
        plot: str | None = None,
        records: Records = NOTHING,
        **texts: str,
    ) -> None:
        run(
            behaviour,
            robot=robot,
            seconds=seconds,
            seed=seed,
            plot=plot,
            records=records,
            options={name: number_from(text) for name, text in texts.items()},
        )

    typed = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
        for name, default, annotation in (
            ("robot", behaviour.url, RobotUrl),
            ("seconds", None, Seconds),
            ("seed", DEFAULT_SEED, Seed),
            ("plot", None, Plot),
            ("records", NOTHING_KEPT, Kept),
            *((option.name, _default(option), _option(option)) for option in behaviour.options),
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
