"""Control laws and sample behaviours: one file each, a pure law and a thin loop.

A module of this package that holds one coroutine function decorated with :func:`behaviour` is a behaviour; nothing else is
needed for ``elib run`` to find it.
"""

from elib.behaviours.frame import Behaviour, Outcome, behaviour, behaviours, find, perform

__all__ = ["Behaviour", "Outcome", "behaviour", "behaviours", "find", "perform"]
