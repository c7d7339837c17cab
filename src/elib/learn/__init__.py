"""Experiments: tasks to learn, controllers that are evolved or trained, and what of it holds on a robot.

The tasks and their episodes come from :mod:`elib.physics`, and run compiled with the extra ``learn``.
"""

from elib.learn.catalogue import all_tasks, find_task
from elib.physics.episodes import Episodes, Scores
from elib.physics.task import Randomisation, Task

__all__ = ["Episodes", "Randomisation", "Scores", "Task", "all_tasks", "find_task"]
