"""The page of ``elib.learn``: tasks, controllers, environments, and what a reward can read of the world."""

from __future__ import annotations

import inspect
import re

from elib import learn
from elib.learn.envs import Environment, TaskEnv, TaskVectorEnv
from elib.learn.swarm_envs import SwarmEnv
from elib.simulator.physics.records import Lamp, Robot, Thing, Tone
from generator.markdown import docstring, joined, table
from generator.robot import function
from generator.simulator import own

INTRODUCTION = """# Learning

What `elib.learn` has for programs. [Evolve a controller](../guides/evolve.md) and
[Gymnasium](../guides/gymnasium.md) show how to use it, and [Tasks](tasks.md) lists the tasks that come with elib. To
evolve, you need the extra `learn`.
"""
FIRST = (learn.Task, learn.Randomisation)
PUBLIC = sorted((getattr(learn, name) for name in learn.__all__), key=lambda each: each not in FIRST)
CLASSES = [each for each in PUBLIC if isinstance(each, type)]
FUNCTIONS = [each for each in PUBLIC if not isinstance(each, type)]

REWARDS = """## What a reward sees

A reward is called as `reward(world, i)` after every tick, an end as `is_over(world)`; of a task with a memory as
`reward(world, i, memory)` and `is_over(world, memory)`. They read the fields below and change nothing but the memory.
`world.views[i]` holds what robot *i* senses, the fields of [`SensorView`](simulator.md). A sensor is read in every
tick if `reward_sensors` names it, and only before each decision if only `sensors` names it; a reward that reads
another one is refused. `world.setting[0].tick` counts the ticks of the episode, and `.step` is the length of one, s.
"""
RECORDS = (
    ("world.robots[i]", Robot),
    ("world.things[k]", Thing),
    ("world.lamps[k]", Lamp),
    ("world.tones[k]", Tone),
)


def page() -> str:
    """Return the page."""
    parts = [
        INTRODUCTION,
        *(own(each, "elib.learn") for each in CLASSES),
        own(TaskEnv, "elib.learn.envs"),
        docstring(TaskEnv.__init__.__doc__),
        docstring(Environment.__doc__),
        own(TaskVectorEnv, "elib.learn.envs"),
        docstring(TaskVectorEnv.__init__.__doc__),
        own(SwarmEnv, "elib.learn.swarm_envs"),
        docstring(SwarmEnv.__init__.__doc__),
    ]
    parts += [*(function(each, "elib.learn") for each in FUNCTIONS), REWARDS]
    parts += [*(f"### `{name}`\n\n{record(kind)}" for name, kind in RECORDS)]
    return joined(parts)


def record(kind: type) -> str:
    """Return the fields of a record; those without a comment of their own share that of the one before."""
    rows: list[tuple[list[str], str]] = []
    for name, comment in re.findall(r"^    (\w+): .*?(?:  # (.*))?$", inspect.getsource(kind), re.MULTILINE):
        if comment or not rows:
            rows.append(([name], comment))
        else:
            rows[-1][0].append(name)
    lines = ((", ".join(f"`{name}`" for name in names), comment) for names, comment in rows)
    return f"{docstring(kind.__doc__)}\n\n{table(('Field', 'What it is'), lines)}"
