"""``elib evolve``: let controllers evolve for a task, and keep everything in the folder of a study."""

from __future__ import annotations

import contextlib
import importlib.util
import shutil
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError, Unsupported
from elib.base.extras import check_web, install
from elib.cli.arguments import AsJson, Cluster, View, Workers, option
from elib.cli.terminal import BLOCKS, is_live, print_json, quoted, say, table
from elib.learn.catalogue import all_tasks
from elib.learn.evolution import TEST_EPISODES, Evolution, Result
from elib.learn.executor import open_executor
from elib.learn.networks import KINDS
from elib.learn.optimisers import ALGORITHMS
from elib.learn.progress import Best, Progress
from elib.learn.results import write_results
from elib.learn.study import BEST, SETTINGS, Settings, Study, settings_of

if TYPE_CHECKING:
    from rich.console import Group

    from elib.learn.progress import Spread

LINES = 20
"""Lines about generations, at most, where no terminal shows a plot."""

ROWS, COLUMNS = 8, 60
"""Size of the plot in a terminal, at most."""

DEFAULT = Settings("avoid")


def _setting(shown: str, about: str) -> Cli:
    usual = getattr(DEFAULT, shown.split(" ")[0])
    return option(f"--{shown}", f"{about} (default: {usual}).")


@dataclass(frozen=True)
class Options:
    """The settings of a study, as they were typed."""

    controller: Annotated[str | None, _setting("controller KIND", f"{', '.join(KINDS)}, or FILE.py:LAW")] = None
    hidden: Annotated[int | None, _setting("hidden N", "Hidden neurons")] = None
    algorithm: Annotated[str | None, _setting("algorithm NAME", ", ".join(ALGORITHMS))] = None
    population: Annotated[int | None, _setting("population N", "Individuals of a generation")] = None
    generations: Annotated[int | None, _setting("generations N", "How many; more can be asked for later")] = None
    seconds: Annotated[float | None, option("--seconds S", "Length of an episode (default: the task's).")] = None
    scenarios: Annotated[int | None, _setting("scenarios N", "Episodes of each individual in a generation")] = None
    seed: Annotated[int | None, _setting("seed N", "Seed of all that is drawn: same seed, same result")] = None


def evolve(
    task: Annotated[str | None, Cli(help="A task that comes with elib, such as avoid, or FILE.py:TASK.")] = None,
    /,
    *,
    options: Annotated[Options, Cli(name="*")] = Options(),
    workers: Workers = None,
    cluster: Cluster = None,
    out: Annotated[str | None, option("--out FOLDER", "Folder of the study (default: TASK-study).")] = None,
    view: View = None,
    json: AsJson = False,
) -> None:
    """Let controllers evolve for a task.

    Everything is kept in the folder of a study: its settings, the fitness of every individual, and the best controller,
    best.toml, which `elib run` drives a robot with. Ctrl-C ends it, and the same command goes on where it ended, to the
    same result. `elib evolve --out FOLDER` goes on with what is in the folder.

    For example:
        elib evolve avoid
        elib evolve avoid --algorithm ga --generations 200 --out my-study
        elib evolve --out my-study --view
    """
    import numpy as np

    folder, settings = _chosen(task, out, options)
    for name in ("Numba", "DuckDB", "Matplotlib"):  # the optimisers say themselves what they need
        if importlib.util.find_spec(name.lower()) is None:
            raise Unsupported(f"evolution needs the package {name}, which is not installed", hint=install("learn"))
    if view is not None:
        check_web()
    evaluation = settings.evaluation()
    settings.optimiser(evaluation.controller.size)  # Its package may be missing: say so before a folder is made.
    with contextlib.ExitStack() as stack:
        # What can be refused comes before the folder is made.
        shown = {each.name: getattr(settings, each.name) for each in fields(Settings)}
        shown |= {"seconds": evaluation.task.seconds, "folder": str(folder)}
        controller = evaluation.controller.controller
        progress = Progress(evaluation.task, controller, settings.generations, shown)
        url = ""
        if view is not None:
            from elib.learn.studypage import study_page

            url = stack.enter_context(study_page(progress, view))
        executor = stack.enter_context(open_executor(workers, cluster))
        study = stack.enter_context(Study(folder, settings))
        if url:
            say(f"view {url}")
        say(
            f"{folder}: {'goes on after' if study.generations else 'begins,'} {len(study.generations)} of"
            f" {settings.generations} generations"
        )
        if evaluation.task.observe:
            say("the controllers see the robot's sensors only, not what the task observes beside them")
        display = Display(progress, recorded=len(study.generations))
        evolution = Evolution(study, executor, evaluation=evaluation, told=display.tell)
        try:
            with display.drawing:
                for generation, population in evolution.run():
                    progress.add(np.array(generation.fitness), population)
                    display.show()
                result = evolution.finish()
        except KeyboardInterrupt:
            progress.end("Stopped by Ctrl-C.")
            say(f"stopped after generation {len(study.generations)}; this goes on: elib evolve --out {folder}")
            if study.generations:
                write_results(folder, settings, study.generations, evaluation.controller.size)
            raise
        write_results(folder, settings, study.generations, evaluation.controller.size)
        winner = Best(result.best.generation, result.fitness, result.best.parameters)
        progress.end(f"All {settings.generations} generations are done.", winner)
        _print(result, folder, settings, evaluation.task.solved, json=json)
        if view is not None:
            say("The page stays until Ctrl-C.")
            with contextlib.suppress(KeyboardInterrupt):
                threading.Event().wait()


def _chosen(task: str | None, out: str | None, options: Options) -> tuple[Path, Settings]:
    """Return the folder and the settings; without a task they are those of the study in the folder."""
    given = {each.name: getattr(options, each.name) for each in fields(Options)}
    given = {name: value for name, value in given.items() if value is not None}
    if task is not None:
        given["task"] = task
    if out is None:
        if task is None:
            raise ArgumentError("elib evolve needs a task", hint=f"one of {', '.join(all_tasks())}, or FILE.py:TASK")
        file, _, _ = task.rpartition(":")
        out = f"{Path(file or task).stem}-study"
    folder = Path(out)
    if task is None:
        return folder, replace(settings_of(folder), **given)
    if (folder / SETTINGS).exists():  # More generations may have been asked for since the command was typed first.
        given = {"generations": settings_of(folder).generations, **given}
    return folder, Settings(**given)


def _print(result: Result, folder: Path, settings: Settings, solved: float, *, json: bool) -> None:
    if json:
        print_json(
            {
                "folder": str(folder),
                "task": settings.task,
                "generations": settings.generations,
                "best": {"generation": result.best.generation, "fitness": result.fitness, "solved": result.solved},
            }
        )
        return
    rows = [
        ("best", f"{folder / BEST}, from generation {result.best.generation}"),
        ("fitness", f"{result.fitness:.4g}, the mean of {TEST_EPISODES} episodes that no generation had"),
    ]
    if solved < float("inf"):
        rows.append(("solved", f"{result.solved:.0%} of them (a fitness of {solved:g} or more)"))
    rows.append(("try it", f"elib run {quoted(folder / BEST)}"))
    print(table(rows, indent=0))


class Display:
    """The plot and the bar in the terminal; where there is none, a line for some of the generations that are new."""

    def __init__(self, progress: Progress, recorded: int) -> None:
        from rich.console import Console
        from rich.live import Live
        from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as Bars

        self._progress = progress
        self._recorded = recorded
        console = Console(stderr=True)
        self._bars = Bars(
            TextColumn("generation {task.fields[number]} of " + str(progress.generations)),
            BarColumn(),
            TimeRemainingColumn(),
            console=console,
        )
        self._bar = self._bars.add_task("", total=progress.generations, number=0)
        self._is_live = is_live(sys.stderr)
        live = Live(console=console, get_renderable=self._drawn, refresh_per_second=5)
        self.drawing: contextlib.AbstractContextManager[object] = live if self._is_live else contextlib.nullcontext()

    def tell(self, done: int, jobs: int) -> None:
        """Show that some jobs of a generation are done."""
        count = len(self._progress.done)
        self._bars.update(self._bar, completed=count + done / jobs)

    def show(self) -> None:
        """Show one more generation."""
        done, count = self._progress.done, self._progress.generations
        number = len(done)
        self._bars.update(self._bar, completed=number, number=number)
        if self._is_live or number <= self._recorded:
            return
        if number in (1, count) or number * LINES // count > (number - 1) * LINES // count:
            say(f"generation {number}: best {done[-1].best:.4g}, mean {done[-1].mean:.4g}")

    def _drawn(self) -> Group:
        from rich.console import Group
        from rich.text import Text

        width = min(COLUMNS, shutil.get_terminal_size().columns - 12)
        return Group(Text("\n".join(plotted(list(self._progress.done), self._progress.generations, width))), self._bars)


def plotted(done: Sequence[Spread], count: int, width: int, height: int = ROWS) -> list[str]:
    """Return the lines of a plot with room for *count* generations: the mean fitness filled, the best one as points."""
    if not done:
        return []
    low, high = min(each.mean for each in done), max(each.best for each in done)
    scale = height / (high - low) if high > low else 0.0
    width = max(1, min(width, count))
    rows = [[" "] * width for _ in range(height)]
    for number, each in enumerate(done):
        column = number * width // count  # The last generation of a column is shown.
        filled = (each.mean - low) * scale
        point = min(height - 1, int((each.best - low) * scale))
        for row in range(height):
            part = max(0, min(8, round(8 * (filled - row))))
            rows[row][column] = "•" if row == point else BLOCKS[part - 1] if part else " "
    labels = [f"{high:9.3g} ", *[" " * 10] * (height - 2), f"{low:9.3g} "]
    return [label + "".join(row).rstrip() for label, row in zip(labels, reversed(rows), strict=True)] + [
        f"{'':10}• best {BLOCKS[3]} mean fitness"
    ]
