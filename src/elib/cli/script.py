"""``elib run``: run a program of yours, a behaviour, or the best controller of a study, on the robot that you name.

It keeps, draws and sums up what the robot did.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import make_dataclass, replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError, ElibError
from elib.base.exits import DONE, FAILED, INTERRUPTED, WRONG_USAGE
from elib.base.extras import check_web
from elib.base.rules import number_from
from elib.behaviours import Behaviour, BehaviourStyle, RunContext, behaviours, play
from elib.behaviours._run.context import DEFAULT_SEED
from elib.behaviours._run.program import TimeLimit, code_of, interruptible, is_own, loops_at, own_traceback, run_file
from elib.cli.arguments import option
from elib.cli.live import RunDisplay
from elib.cli.program import execute_own, is_package
from elib.cli.recordoptions import own_name
from elib.cli.report import ENDINGS, amount, drive_rows, link_rows, state_rows, time_in_states
from elib.cli.terminal import print_json, quoted, say, table, typed
from elib.link.protocol.profiles import rule
from elib.link.session import Disconnected, Reconnected, TraceEvent
from elib.link.session.statistics import merged
from elib.link.transport import speed_of
from elib.records.log import Log
from elib.records.recorder import Recorder
from elib.robot.aio import Epuck, on_open
from elib.robot.link import Record
from elib.robot.runner import NOTHING, Records
from elib.robot.signals import SIGNALS
from elib.robot.substitute import choose_robots, substituted, viewed
from elib.robot.watchdog import watched
from elib.studies.drive import RobotReport, draw_drive
from elib.studies.report import check_report

LINK_FIGURES = ("count", "lost", "refused", "unsent", "median", "p99", "resyncs", "resets")
"""What the summary says of a link: fields of its LinkStats."""

Seed = Annotated[int, option("--seed N", "Seed of the behaviour's random numbers: same seed, same run.")]


def run(
    target: Behaviour | Path,
    *,
    arguments: Sequence[str] = (),
    options: Mapping[str, object] | None = None,
    seed: int = DEFAULT_SEED,
    robots: Sequence[str] = (),
    seconds: float | None = None,
    view: bool = False,
    plot: str | None = None,
    records: Records = NOTHING,
    json: bool = False,
) -> ProgramRun:
    """Run what drives robots, stop them at its end, and print a summary.

    *arguments* are the command line of a program, which are the options of a behaviour if the file only defines one.
    *robots* take the place of its own; each has a recording of its own: FILE, FILE-2 and so on, in the order in which
    they were opened, and those of a swarm behaviour are called by the robots' names. With *json* the summary is on
    stdout, and what the program prints on stderr.
    """
    if isinstance(target, Behaviour):
        robots = robots or [target.url]
    records.check()
    if plot is not None:
        check_report(plot)
    if view:
        check_web()
    it = ProgramRun(target.name if isinstance(target, Behaviour) else str(target), records, seconds)
    with contextlib.ExitStack() as stack:
        if isinstance(target, Path) and target.suffix == ".toml":
            target = stack.enter_context(_champion(target, arguments, is_named=bool(robots)))
        if view:
            stack.enter_context(viewed())
        if robots:
            stack.enter_context(substituted(robots, source="elib run --robot"))
            stack.enter_context(loops_at(speed_of(choose_robots(())[0])))
        stack.enter_context(on_open(it.begin))
        stack.enter_context(watched())
        if json:
            stack.enter_context(contextlib.redirect_stdout(sys.stderr))
        if isinstance(target, Behaviour):
            code = it.end_with(partial(it.play, target, options=options, seed=seed))
        else:
            code = it.end_with(partial(it.execute, target, arguments))
    if isinstance(it.error, ArgumentError) and not it.robots:
        raise it.error
    unwritten = it.finish(plot)
    it.limit.exit_code = code if unwritten is None else FAILED
    if json:
        print_json(it.to_json(code, plot))
    else:
        rows = it.rows()
        if plot is not None:
            rows.append(("plot", plot if it.robots else "none: no robot was opened"))
        say(table(rows, indent=0))
    if it.error is not None:
        raise it.error
    if unwritten is not None:
        raise unwritten
    if code:
        raise SystemExit(code)
    return it


def find_program(name: str) -> Path:
    """Return the path of a program."""
    path = Path(name)
    if path.is_file() or is_package(name):
        return path
    if path.is_dir():
        raise ArgumentError(
            f"{name} is a folder", hint=f"name a program in it: elib run {quoted(path / 'my_robot.py')}"
        )
    folder = path.parent
    if not folder.is_dir():
        raise ArgumentError(f"there is no file {name}: there is no folder {folder}", hint="look for it with: ls")
    kind = ".toml" if path.suffix == ".toml" else ".py"
    there = sorted(each.name for each in folder.iterdir() if each.suffix == kind)
    near = get_close_matches(path.stem, [Path(each).stem for each in there], 1)
    sample = path.stem.lower().replace("_", "-")
    if near:
        hint = f"did you mean {folder / near[0]}{kind}?"
    elif kind == ".toml":
        hint = "elib evolve TASK writes the best controller that it finds into its folder, as best.toml"
    elif sample in behaviours():
        hint = f"elib run {sample} runs the behaviour that comes with elib"
    elif there:
        hint = f"the programs there are: {', '.join(there[:8])}{' ...' if len(there) > 8 else ''}"
    else:
        hint = f"there is no program in that folder; elib new avoid {name} makes one to start from"
    raise ArgumentError(f"there is no file {path.name} in {folder.absolute()}", hint=hint)


def options_of(behaviour: Behaviour) -> type[Any]:
    """Return a class whose fields are the options of a behaviour, and its seed unless it has an option of that name."""
    fields: dict[str, tuple[object, object]] = {"seed": (Seed, DEFAULT_SEED)}
    for each in behaviour.options:
        about = ": ".join(filter(None, (behaviour.meanings.get(each.name), rule(each.quantity))))
        annotation = Annotated[str, Cli(name=f"--{each.name}", metavar=each.name[:1].upper(), help=f"{about}.")]
        fields[each.name] = annotation, typed(each.default)
    made = [(name, annotation, default) for name, (annotation, default) in fields.items()]
    kind = make_dataclass("Options", made, frozen=True)
    kind.__module__ = __name__  # cyclopts does not look into a class of Python's own modules
    return kind


def given_in(options: Any, behaviour: Behaviour) -> dict[str, Any]:
    """Return what :func:`elib.play` takes: the ``options`` of a behaviour and its ``seed``."""
    values = {each.name: number_from(getattr(options, each.name)) for each in behaviour.options}
    return {"options": values} if "seed" in values else {"options": values, "seed": options.seed}


def _champion(path: Path, arguments: Sequence[str], *, is_named: bool) -> AbstractContextManager[Behaviour]:
    """Return a context that yields the controller of a file as a behaviour, by itself in a world of its task."""
    from elib.learn.champion import load_champion  # programs do without it
    from elib.learn.linked import one_episode

    champion = load_champion(path)
    if is_named and arguments:
        raise ArgumentError(
            f"{path.name} takes no arguments on a robot that you name, but there is {arguments[0]!r}",
            hint="leave out --robot: then --scene and --seed choose a world of its task",
        )
    try:
        champion.find_task()
    except ArgumentError:
        if not is_named:
            raise
        return contextlib.nullcontext(champion.behaviour())  # the file of its task is on another computer
    chosen: dict[str, Any] = {}

    def choose(
        *,
        scene: Annotated[int, option("--scene N", "Which world of its task, from 1.")] = 1,
        seed: Annotated[int | None, option("--seed N", "Seed of starts, robots and noise.")] = None,
    ) -> None:
        chosen.update(scene=scene, seed=seed)

    execute_own(f"elib run {quoted(path)} --", choose, arguments, page=f"Drive an episode of the task {champion.task}.")
    if not chosen:  # its page was asked for
        raise SystemExit(DONE)
    return one_episode(champion, **chosen)


class ProgramRun:
    """One run of what drives robots: the robots that it opens, and how it ends."""

    def __init__(self, name: str, records: Records, seconds: float | None) -> None:
        self.name = name
        # what each robot did, in the order of opening; a robot that was opened twice is there twice
        self.robots: list[RobotReport] = []
        self.seconds = seconds
        self.reason = "done"  # why it ended: a key of ENDINGS
        # the error that ended it, if none of the program's own lines is in its traceback; None before
        self.error: BaseException | None = None
        self._records = records
        self._files: list[Log | Recorder] = []
        self._opened: list[float] = []
        self._context: RunContext | None = None
        self._context_began = 0.0
        self._duration: float | None = None
        self._is_swarm = False
        self._say: Callable[[str], object] = say
        self.limit = TimeLimit("elib run --for")  # ends it when its time is over

    @property
    def time(self) -> float:
        """Robot time that the behaviour took, or from the opening of the first robot to the end of the last one, s."""
        if self._duration is not None:
            return self._duration
        return max((robot.time for robot in self.robots), default=0.0)

    @property
    def states(self) -> list[tuple[float, str]]:
        """When each state of a behaviour was entered, s since it began, and its name."""
        return [] if self._context is None else list(self._context.states)

    def begin(self, robot: Epuck) -> list[Record]:
        """Follow a robot that was opened just now; a hook of :func:`on_open`."""
        word = robot.name if self._is_swarm else str(len(self.robots) + 1) if self.robots else ""
        record = self._records.record
        if record is not None and word:
            record = own_name(record, word)
        records = replace(self._records, record=record)
        records.check()
        self._files += records.begin(robot)
        # A robot that is opened after the others were closed goes on at the time at which they ended.
        offset = max((each.time for each in self.robots if not each.is_closed), default=self.time)
        report = RobotReport(robot, robot.time - offset)
        self.robots.append(report)
        robot.trace(partial(self._tell_link, robot.name))
        self._opened.append(offset)
        if self.seconds is not None:
            asyncio.get_running_loop().call_later(max(0.0, self.seconds - offset), self.limit.expire)
        return [report]

    def end_with(self, work: Callable[[], object]) -> int:
        """Do the work of the program and stop its robots; return its exit code. Errors of its own are printed."""
        code = DONE
        with interruptible():
            try:
                try:
                    work()
                finally:
                    SIGNALS.close_all()  # before the summary, as Python does it at its end
                    with contextlib.suppress(OSError, ValueError):  # Python says it at its end
                        sys.stdout.flush()
            except SystemExit as ending:
                code = code_of(ending)
                self.reason = "interrupt" if code > 128 else "error" if code else "done"
            except KeyboardInterrupt:
                code, self.reason = INTERRUPTED, "interrupt"
            except BaseException as error:
                code, self.reason = FAILED, "error"
                if is_own(error):
                    say(own_traceback(error))
                else:
                    self.error = error
                    code = WRONG_USAGE if isinstance(error, ArgumentError) else FAILED
            self.limit.has_ended.set()
        if self.limit.is_over and self.reason == "interrupt":
            code, self.reason = DONE, "time"
        return code

    def execute(self, path: Path, arguments: Sequence[str]) -> None:
        """Run a program, or the behaviour that it only defines, whose options are then its command line."""

        def play_own(behaviour: Behaviour, options: Sequence[str]) -> None:
            kind = options_of(behaviour)

            def command(*, own: Any = kind()) -> None:  # noqa: B008
                self.play(behaviour, **given_in(own, behaviour))

            command.__annotations__["own"] = Annotated[kind, Cli(name="*")]
            execute_own(f"elib run {quoted(path)} --", command, options, page=behaviour.doc)

        run_file(path, arguments, has_driven=lambda: bool(self.robots), play=play_own)

    def play(self, behaviour: Behaviour, **how: Any) -> None:
        """Play a behaviour, show what it does and tells, and keep its states."""
        if behaviour.style is BehaviourStyle.BYTES and (self._records.log or self._records.record):
            raise ArgumentError(
                f"{behaviour.name} writes bytes to the line itself: there are no calls to log or record",
                hint="elib run --list lists the other behaviours",
            )
        self._is_swarm = behaviour.style is BehaviourStyle.SWARM  # its robots are opened in any order
        seconds, self.seconds = self.seconds, None  # a behaviour ends by itself when its time is over
        display = RunDisplay(behaviour.name)
        self._say = display.say

        def begin(context: RunContext, robots: tuple[Epuck, ...]) -> None:
            self._context, self._context_began = context, self.time
            display.begin(context, self.robots)

        try:
            outcome = play(behaviour, seconds=seconds, watch=begin, **how)
            self.reason, self._duration = outcome.reason, outcome.duration
        finally:
            display.end()
            if self._context is not None and self._duration is None:
                self._duration = self._context.time

    def finish(self, plot: str | None) -> ElibError | None:
        """Finish the files and draw the plot; return the error of the first that could not be written."""
        failure: ElibError | None = None
        ends: list[Callable[[], object]] = [each.close for each in (*self._files, *self.robots)]
        if plot is not None and self.robots:
            ends.append(partial(self._draw, plot))
        for end in ends:
            try:
                end()
            except ElibError as error:  # the summary comes first
                failure = failure or error
        return failure

    def _draw(self, plot: str) -> None:
        began = self._context_began
        states = [(began + since, name) for since, name in self.states]
        draw_drive(plot, Path(self.name).name, self.robots, seconds=began + self.time, states=states)

    def rows(self) -> list[tuple[str, str]]:
        """Return the summary as label and text."""
        if not self.robots and self._context is None:
            return [("robots", "none was opened")]
        rows = [("robot time", f"{self.time:.1f} s, {ENDINGS.get(self.reason, self.reason)}")]
        if len(self.robots) > 1:
            rows.append(("robots", f"{len(self.robots)} opened"))
        rows += drive_rows(self.robots)
        rows += state_rows(time_in_states(self.states, self.time))
        if self.robots:
            rows += link_rows(merged([robot.robot.statistics for robot in self.robots]))
        if self._records.log is not None:
            rows.append(("log", self._records.log))
        recorders = [each for each in self._files if isinstance(each, Recorder)]
        state = {True: "", False: "not whole: "}
        return rows + [("recording", f"{state[each.is_whole]}{amount(each)} in {each.path}") for each in recorders]

    def to_json(self, code: int, plot: str | None) -> dict[str, object]:
        """Return the summary for other programs."""
        return {
            "program": self.name,
            "outcome": self.reason,
            "exit_code": code,
            "seconds": self.time,
            "distance": math.fsum(robot.distance for robot in self.robots),
            "states": {
                name: {"seconds": seconds, "entered": count}
                for name, (seconds, count) in time_in_states(self.states, self.time).items()
            },
            "robots": [
                {
                    "name": each.robot.name,
                    "url": each.robot.url,
                    "firmware": each.robot.firmware,
                    "opened": opened,
                    "seconds": each.time - opened,
                    "distance": each.distance,
                    "path": "world" if each.world is not None else "wheels",
                    "contacts": None if each.world is None else each.contacts,
                    "contact_seconds": None if each.world is None else each.contact_time,
                    "link": {name: getattr(each.robot.statistics, name) for name in LINK_FIGURES},
                }
                for each, opened in zip(self.robots, self._opened, strict=True)
            ],
            "log": self._records.log,
            "recordings": [str(each.path) for each in self._files if isinstance(each, Recorder)],
            "plot": plot if self.robots else None,
        }

    def _tell_link(self, name: str, time: float, event: TraceEvent) -> None:
        """Tell a person what to do while a robot that reconnects has no link; a trace hook."""
        match event:
            case Disconnected(error=error):
                self._say(f"the link is lost, and opened again as soon as the robot answers: {error.message}")
                self._say("hint: switch the robot on, charge it, bring it nearer; Ctrl-C ends the run")
            case Reconnected(gap=gap):
                self._say(f"the link of {name} is back after {gap:.1f} s")
