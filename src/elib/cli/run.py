"""``elib run``: run one of the behaviours that come with elib, or a program of yours, on any robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App
from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.rules import DURATION
from elib.behaviours import Behaviour, behaviours, find
from elib.cli.arguments import RobotUrl, Seconds, option
from elib.cli.program import is_program
from elib.cli.recordoptions import NOTHING_KEPT, Kept
from elib.cli.script import find_program, given_in, options_of, run
from elib.cli.terminal import quoted, say, table

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
    float, DURATION, option("--for S", "Robot time for each sample that does not end by itself, seconds.")
]

Program = Annotated[str | None, Cli(help="The file of your program, a best.toml, or the name of a behaviour.")]
View = Annotated[bool, option("--view", "Show the program's virtual world live in the browser, in real time.")]


@dataclass(frozen=True)
class RunOptions:
    """The options of every run, as :func:`run` takes them."""

    seconds: Seconds = None
    view: View = False
    plot: Annotated[
        str | None, option("--plot FILE", "Draw path, speeds and readings into this file: .png, .svg or .pdf.")
    ] = None
    records: Kept = NOTHING_KEPT
    json: Annotated[
        bool, option("--json", "Print the summary as one line of JSON; what the program prints goes to stderr.")
    ] = False


How = Annotated[RunOptions, Cli(name="*")]
USUAL = RunOptions()

app = App(name="run", group_commands="Behaviours")


@app.default
def choose(
    program: Program = None,
    /,
    *arguments: Annotated[str, Cli(help="What follows -- : the command line of your program.")],
    robot: Annotated[
        list[str] | None, option("--robot URL", "The robot to use, whatever the program names; once for each robot.")
    ] = None,
    how: How = USUAL,
    listed: Annotated[bool, option("--list", "List the behaviours.")] = False,
) -> None:
    """Run a behaviour, or a program of yours, until it ends, its time is over, or Ctrl-C; then stop the robot.

    `elib run avoid` runs a behaviour that comes with elib; `elib run --list` lists them. `elib run avoid --help` shows
    what one of them can be told.

    `elib run my_robot.py` runs any program that uses elib, as `python my_robot.py` does, and a behaviour that a file
    only defines. What follows `--` belongs to the program, or is the options of that behaviour. A summary is printed at
    the end.

    `elib run best.toml` lets the best controller that `elib evolve` found drive: without --robot an episode in the
    first world of its task, whose fitness is printed, with --robot URL your robot. Name several robots to let it drive
    each of them. Behind `--`, `--scene N` and `--seed N` choose another world of the task, and other starts and robots.

    For example:
        elib run avoid
        elib run my_robot.py --robot serial:///dev/rfcomm0 --for 60
        elib run best.toml --view -- --scene 3 --seed 7
    """
    if program is not None and is_program(program):
        run(find_program(program), arguments=arguments, robots=robot or (), **vars(how))
        return
    if program is not None:
        for stem in (program, program.replace("-", "_")):  # dashes are what the parser makes of underscores
            if Path(f"{stem}.py").is_file():
                raise ArgumentError(
                    f"there is no behaviour {stem!r}", hint=f"to run the file: elib run {quoted(f'{stem}.py')}"
                )
            if Path(stem).is_dir():
                raise ArgumentError(
                    f"{stem} is a folder", hint=f"name a program in it: elib run {quoted(f'{stem}/my_robot.py')}"
                )
            if Path(stem).is_file():
                raise ArgumentError(f"{stem} is not a program: its name does not end in .py")
        name = find(program).name  # raises, with a suggestion; a behaviour that exists has a command of its own
        raise ArgumentError(f"options follow the name of {name}", hint=f"elib run {name} --robot URL")
    if not listed:
        raise ArgumentError("elib run needs the name of a behaviour, or a program", hint="elib run --list lists them")
    print(table([(each.name, each.summary) for each in behaviours().values()], indent=0))


@app.command(name="all")
def run_all(*, robot: RobotUrl | None = None, seconds: EachTime = EACH) -> None:
    """Run the samples of 2011 one after another, as their Main did; Enter goes on to the next.

    Without --robot, or with sim:// alone, each sample has a virtual robot in its own world.

    For example:
        elib run all
        elib run all --robot serial:///dev/rfcomm0
    """
    for name in SAMPLES:
        say(f"\n== {name}: {find(name).summary}")
        run(find(name), robots=[robot] if robot else (), seconds=seconds)


def command_of(behaviour: Behaviour) -> Callable[..., None]:
    """Return the command that runs a behaviour, whose options are among its own."""
    kind = options_of(behaviour)

    def command(*, robot: RobotUrl = behaviour.url, how: How = USUAL, own: Any = kind()) -> None:  # noqa: B008
        run(behaviour, robots=[robot], **given_in(own, behaviour), **vars(how))

    command.__annotations__["own"] = Annotated[kind, Cli(name="*")]
    return command


for each in behaviours().values():
    app.command(command_of(each), name=each.name, help=each.doc)
