"""The page of the simulator's own face: worlds without robots' programs, for speed and for tests."""

from __future__ import annotations

import elib
from elib import learn
from elib.simulator import physics
from elib.simulator.physics import Event, RobotView, SensorView, Snapshot
from generator.markdown import docstring, joined
from generator.robot import entry

INTRODUCTION = """# The simulator

A program for a robot never needs this page: it opens `sim://`. Here is the world behind it, in SI units, for those who
want to run many worlds, steer thousands of robots in compiled code, or look behind the scenes of a test.
[Worlds](../guides/worlds.md) shows how to describe one in a file, [Fast simulation](../guides/fast-simulation.md) how
to run one fast.
"""
RUNS = (elib.World, elib.Batch, elib.Controller, SensorView)
PUBLIC = (elib.Scene, elib.EpuckModel, elib.Pose)
TOLD = (Snapshot, RobotView, Event)
ELSEWHERE = {*RUNS, *PUBLIC, *TOLD, physics.Records, *(getattr(learn, name) for name in learn.__all__)}
PARTS = [each for each in (getattr(physics, name) for name in physics.__all__) if each not in ELSEWHERE]


def page() -> str:
    """Return the page."""
    parts = [INTRODUCTION, *(own(each) for each in RUNS), "# What a scene is made of"]
    parts += [*(own(each) for each in PUBLIC), "The parts of a scene come from `elib.simulator.physics`."]
    parts += [f"## {each.__name__}\n\n{docstring(each.__doc__)}" for each in PARTS]
    parts += ["# What a world tells", *(f"## {each.__name__}\n\n{docstring(each.__doc__)}" for each in TOLD)]
    return joined(parts)


def own(kind: type, package: str = "elib") -> str:
    """Return the entry of a class, with nothing that it inherits from other packages."""
    own = {name for base in kind.__mro__ if base.__module__.startswith("elib.") for name in vars(base)}
    return entry(kind, lambda name: name not in own, package)
