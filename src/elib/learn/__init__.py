"""Experiments: tasks to learn, controllers that are evolved or trained, and what of it holds on a robot.

The tasks and their episodes come from :mod:`elib.simulator.physics`, and run compiled with the extra ``learn``.
"""

import importlib.util

from elib.learn.catalogue import all_tasks, find_task, register
from elib.learn.champion import Champion, load_champion
from elib.learn.networks import Law, Network, find_controller
from elib.learn.study import read_study
from elib.simulator.physics.defects import Defect
from elib.simulator.physics.episodes import Episodes, Scores
from elib.simulator.physics.observing import Observation, camera_row, encoders, goal, ground_colours, neighbours
from elib.simulator.physics.task import Randomisation, Task

__all__ = [
    "Champion",
    "Defect",
    "Episodes",
    "Law",
    "Network",
    "Observation",
    "Randomisation",
    "Scores",
    "Task",
    "all_tasks",
    "camera_row",
    "encoders",
    "find_controller",
    "find_task",
    "goal",
    "ground_colours",
    "load_champion",
    "neighbours",
    "read_study",
]

# So that gymnasium.make("elib.learn:elib/Avoid-v0") finds it, whichever of the two packages was imported first.
if importlib.util.find_spec("gymnasium") is not None:
    register()
