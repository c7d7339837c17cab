"""Labs: tasks with goals, which a program is checked against in worlds that it cannot reach.

A lab is a folder with a file ``lab.toml`` (:mod:`elib.lab.labfile`). :func:`run_variant` runs a program over a
lock-step link (:mod:`elib.lab.marker`), and the goals (:mod:`elib.lab.goals`) judge what the robots did. The judging
needs no process: :mod:`elib.lab.goal` says how it is called with a trace.
"""

from __future__ import annotations

from elib.base.lazy import names_of

# The process of the program that is judged imports this package as well, and must start fast.
__getattr__, _homes = names_of(__spec__, __file__)
__all__ = list(_homes)
