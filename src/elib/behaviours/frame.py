"""The frame of every behaviour: how it is declared, found and performed."""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import inspect
import math
import pkgutil
import typing
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from difflib import get_close_matches

from elib.errors import ArgumentError, ElibError
from elib.protocol.quantities import Quantity
from elib.protocol.table import Parameter
from elib.robot.aio import Epuck
from elib.robot.statistics import Statistics

STOPPING_TIME = 4.0
"""s that the robot has to confirm, at a behaviour's end, that it stands: time for a fence of three probes before."""

Loop = Callable[..., Coroutine[object, object, None]]


@dataclass(frozen=True, slots=True)
class Behaviour:
    """Something a robot can do until told otherwise.

    Attributes:
        name: What ``elib run`` calls it: its module's name, with dashes.
        doc: What a person reads.
        loop: The coroutine function; it takes the open robot and the options by name.
        options: What can be set, with units and ranges.
    """

    name: str
    doc: str
    loop: Loop
    options: tuple[Parameter, ...] = ()

    @property
    def summary(self) -> str:
        """The first line of :attr:`doc`."""
        return self.doc.partition("\n")[0]

    def check(self, options: typing.Mapping[str, object]) -> dict[str, object]:
        """Return *options* as the numbers to use.

        Raises:
            ArgumentError: There is no such option, or its value is out of its range.
        """
        known = {option.name: option.quantity for option in self.options}
        checked: dict[str, object] = {}
        for name, value in options.items():
            if name not in known:
                there = ", ".join(known) or "none"
                raise ArgumentError(f"{self.name} has no option {name!r}", hint=f"there are: {there}")
            quantity = known[name]
            checked[name] = quantity.check(name, value, quantity.low, quantity.high)
        return checked


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a performance went.

    Attributes:
        duration: Robot time it took, s.
        was_limited: The time given to it was over; otherwise it came to its own end.
        statistics: The link's health since the robot was opened.
    """

    duration: float
    was_limited: bool
    statistics: Statistics


def behaviour(loop: Loop) -> Behaviour:
    """Make a coroutine function a behaviour, named after its module.

    Its first parameter is the robot; the others are keyword-only with a default, each annotated with its
    :class:`~elib.protocol.quantities.Quantity`. Its docstring's text before the first section is the help.

    Raises:
        TypeError: A parameter breaks these rules.
    """
    hints = typing.get_type_hints(loop, include_extras=True)
    options = []
    for item in list(inspect.signature(loop).parameters.values())[1:]:
        quantity = next((n for n in getattr(hints.get(item.name), "__metadata__", ()) if isinstance(n, Quantity)), None)
        if quantity is None or item.kind is not item.KEYWORD_ONLY or item.default is item.empty:
            raise TypeError(f"{loop.__qualname__}: {item.name} must be keyword-only, with a Quantity and a default")
        options.append(Parameter(item.name, quantity, item.default))
    name = loop.__module__.rpartition(".")[2].replace("_", "-")
    doc = (inspect.getdoc(loop) or "").partition("\nArgs:")[0].strip()
    return Behaviour(name, doc, loop, tuple(options))


def behaviours() -> dict[str, Behaviour]:
    """Return every behaviour of this package by name, in alphabetical order; found by scanning its modules."""
    package = importlib.import_module("elib.behaviours")
    found = {}
    for module in pkgutil.iter_modules(package.__path__, "elib.behaviours."):
        for value in vars(importlib.import_module(module.name)).values():
            if isinstance(value, Behaviour):
                found[value.name] = value
    return dict(sorted(found.items()))


def find(name: str) -> Behaviour:
    """Return the behaviour of that name; dashes and underscores are the same.

    Raises:
        ArgumentError: There is none; the nearest name is suggested.
    """
    there = behaviours()
    wanted = name.strip().lower().replace("_", "-")
    if wanted in there:
        return there[wanted]
    near = get_close_matches(wanted, there, 1, cutoff=0.4)
    hint = f"did you mean {near[0]}?" if near else f"there are: {', '.join(there)}"
    raise ArgumentError(f"there is no behaviour {name!r}", hint=hint)


async def perform(
    what: Behaviour, robot: Epuck, *, seconds: float | None = None, options: typing.Mapping[str, object] | None = None
) -> Outcome:
    """Let *robot* behave until the time is over, it comes to its own end, or the caller is cancelled; then stop it.

    Args:
        what: The behaviour.
        robot: An open robot.
        seconds: Robot time after which it ends; None for as long as it likes.
        options: Values for the behaviour's options.

    Returns:
        How it went.

    Raises:
        ArgumentError: *seconds* is not positive and finite, or an option is wrong; nothing was sent.
        ElibError: What the behaviour could not cope with, or the robot did not confirm that it stopped.
    """
    if seconds is not None and not (math.isfinite(seconds) and seconds > 0):
        raise ArgumentError(f"the time to run for is {seconds} s; it must be a finite number above 0")
    chosen = what.check(options or {})
    began = robot.time
    limit = asyncio.timeout(seconds)
    try:
        async with limit:
            await what.loop(robot, **chosen)
    except TimeoutError:
        if not limit.expired():
            raise  # the robot's own, which the behaviour let through
    except BaseException:
        # The error that ended it says more than a stop that could not be confirmed.
        with contextlib.suppress(ElibError):
            await robot.within(STOPPING_TIME).stop()
        raise
    duration = robot.time - began
    await robot.within(STOPPING_TIME).stop()
    return Outcome(duration, limit.expired(), robot.statistics)


__all__ = ["Behaviour", "Outcome", "behaviour", "behaviours", "find", "perform"]
