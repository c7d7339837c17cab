"""``elib transfer``: what a controller that learned in the simulator is worth where more of the robot is real."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.base.extras import install
from elib.cli.arguments import AsJson, Cluster, Workers, option
from elib.cli.terminal import LiveLine, grid, print_json, say
from elib.learn.champion import load_champion
from elib.learn.executor import open_executor
from elib.learn.transfer import TransferPlan, TransferReport
from elib.learn.transfer import transfer as run_transfer
from elib.learn.transferreport import COLUMNS, check_folder, row_of, to_json, write_folder
from elib.link.transport import parse_url

PLAN = TransferPlan()


def transfer(
    file: Annotated[Path, Cli(name="FILE", help="A controller that elib evolve wrote, best.toml.")],
    /,
    *,
    robot: Annotated[str | None, option("--robot URL", "Also run on this robot; best one at a start.")] = None,
    profile: Annotated[
        list[str] | None,
        option(
            "--profile NAME",
            "Another robot: enki, webots, gctronic, or a file that elib fit wrote; once for each (default: all three).",
        ),
    ] = None,
    fault: Annotated[
        list[str] | None, option("--fault NAME", "Also run under this fault script, or .toml file; once for each.")
    ] = None,
    runs: Annotated[int, option("--runs N", "Runs of each stage.")] = PLAN.runs,
    robot_runs: Annotated[int, option("--robot-runs N", "Runs on the robot.")] = PLAN.robot_runs,
    latency: Annotated[str, option("--latency S", "Delay each way of the poor link: 0.05 s, or 50ms.")] = "50ms",
    jitter: Annotated[str, option("--jitter S", "Standard deviation of that delay: 0.01 s, or 10ms.")] = "10ms",
    loss: Annotated[float, option("--loss P", "Probability that the poor link loses an answer.")] = PLAN.loss,
    seed: Annotated[int, option("--seed N", "Seed of all runs: same seed, same report.")] = PLAN.seed,
    out: Annotated[Path | None, option("--out FOLDER", "Write report.md, transfer.svg and all runs there.")] = None,
    breaks: Annotated[bool, option("--breaks", "Look for what breaks it first.", negative="--no-breaks")] = True,
    workers: Workers = None,
    cluster: Cluster = None,
    yes: Annotated[bool, option("--yes", "Do not ask before each run on the robot.")] = False,
    json: AsJson = False,
) -> None:
    """Run a learned controller again in stages, from physics alone to a robot, and look for what breaks it.

    The stages: physics alone; physics in which each run draws how its robots differ; the whole chain with each firmware
    and a link; a poor link; robots with other sensors or wheels; and your robot. All virtual stages play the same
    episodes. The table says how much of the fitness is left.

    Your robot runs for the time of an episode, each time after you have put it at a start. It is stopped whatever
    happens.

    For example:
        elib transfer avoid-study/best.toml
        elib transfer avoid-study/best.toml --robot serial:///dev/rfcomm0 --out report
    """
    champion = load_champion(file)
    plan = TransferPlan(
        runs=runs,
        seed=seed,
        latency=seconds_of(latency, "--latency"),
        jitter=seconds_of(jitter, "--jitter"),
        loss=loss,
        profiles=profile,
        faults=fault or (),
        sensitivity=breaks,
        robot=robot,
        robot_runs=robot_runs,
    )
    if robot is not None:
        parse_url(robot)
    if out is not None:
        check_folder(out)
    if importlib.util.find_spec("numba") is None:
        say(f"Numba is not installed: the physics runs interpreted, far slower, to the same report; {install('learn')}")
    with LiveLine() as line, open_executor(workers, cluster) as executor:
        report = run_transfer(
            champion,
            plan,
            executor=executor,
            progress=line.tell,
            ask=None if yes or not sys.stdin.isatty() else lambda text: ask(line, text),
        )
    title = f"{file} ({report.task})"
    if json:
        print_json(to_json(report))
    else:
        show(report)
    if out is not None:
        for path in write_folder(report, out, title):
            say(f"wrote {path}")


def ask(line: LiveLine, text: str) -> None:
    """Ask the person beside the robot for something, and wait for Enter."""
    line.clear()
    say(f"{text} Then press Enter.")
    sys.stdin.readline()


def seconds_of(text: str, option: str) -> float:
    """Return a time that is given in seconds, or in milliseconds with ``ms`` behind the number."""
    number, scale = (text[:-2], 0.001) if text.endswith("ms") else (text.removesuffix("s"), 1.0)
    try:
        return float(number) * scale
    except ValueError:
        raise ArgumentError(f"{option} is {text!r}; it must be a number of seconds, such as 0.05 or 50ms") from None


def show(report: TransferReport) -> None:
    """Print the table of the stages, and what breaks the controller first."""
    print(grid(COLUMNS, map(row_of, report.stages)))
    for reason in report.left_out:
        say(f"left out: {reason}")
    if report.sensitivities:
        print("\nwhat breaks it first")
        for number, each in enumerate(report.sensitivities, 1):
            print(f"{number}  {each.text}")
