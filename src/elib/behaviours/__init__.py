"""Programs: the sample behaviours that come with elib, one file each, and what runs them and yours.

It stands on ``robot``. Begin with ``avoid.py``, then ``_run/behaviour.py``. A module of this package with a function
decorated with :func:`behaviour` is a sample; ``elib run`` finds it by itself. ``samples`` are programs to start from.
"""

from elib.behaviours._run.behaviour import Behaviour, BehaviourStyle, behaviour, behaviours, find
from elib.behaviours._run.context import MachineStarted, RunContext, RunEvent, RunMessage, StateChanged
from elib.behaviours._run.loop import react, react_blocking
from elib.behaviours._run.play import RunResult, play, run_behaviour, run_behaviour_blocking
from elib.behaviours._run.states import states
from elib.link.protocol.distances import OpenAir
from elib.link.protocol.quantities import Quantity

__all__ = [
    "Behaviour",
    "BehaviourStyle",
    "MachineStarted",
    "OpenAir",
    "Quantity",
    "RunContext",
    "RunEvent",
    "RunMessage",
    "RunResult",
    "StateChanged",
    "behaviour",
    "behaviours",
    "find",
    "play",
    "react",
    "react_blocking",
    "run_behaviour",
    "run_behaviour_blocking",
    "states",
]
