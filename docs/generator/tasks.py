"""The page of the tasks that come with elib, from the tasks themselves and what their files say."""

from __future__ import annotations

import inspect

from elib.learn import Task, all_tasks
from generator.markdown import docstring, inline, table

INTRODUCTION = """# Tasks

A task says what robots are to learn: in which worlds, what they see, what they earn in each tick, and when an episode
is over. These come with elib. `elib evolve TASK` evolves controllers for one, and each is a Gymnasium or PettingZoo
environment as well.

In each episode, the seed draws a world, where robots start, their noise, and how far they differ from each other: the
ranges are in `src/elib/learn/rooms.py`, with their sources. The robots are calibrated: `proximity` is what a sensor
reads above what it reads in the open. Controllers decide every 0.1 s, and drive at 0.1 m/s at most. Names of readings
are those of [`SensorView`](simulator.md).
"""


def page() -> str:
    """Return the page."""
    tasks = [all_tasks()[name] for name in sorted(all_tasks())]
    rows = ((f"[`{task.name}`](#{task.name})", task.summary, str(task.robots)) for task in tasks)
    return "\n\n".join([INTRODUCTION.strip(), table(("Task", "What to do", "Robots"), rows), *map(described, tasks)])


def described(task: Task) -> str:
    """Return what a task is, in words and in a table."""
    text = inspect.getdoc(inspect.getmodule(task.reward)) or ""
    _, _, about = text.partition("\n\n")
    unit = "the mean of the reward over the episode" if task.fitness == "mean" else "the sum of the reward"
    rows = [
        ("sees", ", ".join(f"`{sensor}`" for sensor in task.sensors)),
        ("earns in each tick", returned(task.reward)),
        ("fitness", unit + (", the mean over the robots" if task.robots > 1 else "")),
        ("solved", f"from a fitness of {task.solved:g} on"),
        ("ends", f"after {task.seconds:g} s" + (f", or earlier: {returned(task.is_over)}" if task.is_over else "")),
        ("on a real robot", f"its sensors are {'enough' if task.on_board else 'not enough'} to measure the reward"),
        ("source", task.source),
    ]
    return f"## {task.name}\n\n{task.summary}\n\n{docstring(about)}\n\n{table(('', ''), rows)}"


def returned(function: object) -> str:
    """Return what a function returns, as its docstring says, on one line."""
    text = inline(" ".join((inspect.getdoc(function) or "").split())).removesuffix(".")
    return text.removeprefix("Return ").removeprefix("whether ")
