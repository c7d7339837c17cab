"""Control laws and sample behaviours: one file each, a pure law and a thin loop.

A module of this package with a coroutine function decorated with :func:`behaviour` is a behaviour; ``elib run`` needs
nothing else to find it.
"""

from elib.behaviours._run.behaviour import (
    Behaviour,
    RunResult,
    Style,
    behaviour,
    behaviours,
    check_duration,
    find,
    run_behaviour,
    run_behaviour_blocking,
)

__all__ = [
    "Behaviour",
    "RunResult",
    "Style",
    "behaviour",
    "behaviours",
    "check_duration",
    "find",
    "run_behaviour",
    "run_behaviour_blocking",
]
