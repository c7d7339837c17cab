"""Behaviours: declared by a decorator, and found among the modules of ``elib.behaviours``."""

from __future__ import annotations

import enum
import importlib
import inspect
import pkgutil
import re
import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches

from elib.base.errors import ArgumentError
from elib.behaviours._run.context import RunContext
from elib.link.protocol.quantities import Quantity
from elib.link.protocol.table import Parameter
from elib.link.transport import Transport, Url, parse_url
from elib.robot.aio import Epuck
from elib.robot.blocking import BlockingEpuck
from elib.robot.swarms.swarm import Swarm

Function = Callable[..., object]


class BehaviourStyle(enum.Enum):
    """The kind of object that a behaviour runs on; the type of its first parameter tells it."""

    ASYNC = "Epuck"
    BLOCKING = "BlockingEpuck"
    SWARM = "Swarm"
    BYTES = "Transport"


STYLES: dict[object, BehaviourStyle] = {
    Epuck: BehaviourStyle.ASYNC,
    BlockingEpuck: BehaviourStyle.BLOCKING,
    Swarm: BehaviourStyle.SWARM,
    Transport: BehaviourStyle.BYTES,
}


@dataclass(frozen=True, slots=True)
class Behaviour:
    """A program that drives a robot until it is ended from outside, or by itself.

    Attributes:
        name: Name for ``elib run``: that of its module, with dashes; in a script, that of the function.
        doc: Help text.
        function: The function. It takes the open robot, the RunContext if it wants one, and the options by name. It is
            a coroutine function unless the style is blocking.
        options: The options, with units and ranges.
        meanings: The first sentence of what the docstring says about an option, by its name.
        style: What it runs on.
        world: The world that is opened by default, with keys of its URL: ``light``, or ``crowd?robots=10``.
        reconnects: Whether its robot reopens a link that is lost.
        takes_run: Whether its second parameter is the RunContext.
        group: What it is listed with, like ``samples of 2011``.
    """

    name: str
    doc: str
    function: Function
    options: tuple[Parameter, ...] = ()
    style: BehaviourStyle = BehaviourStyle.ASYNC
    world: str = ""
    reconnects: bool = False
    takes_run: bool = False
    group: str = "your own"
    meanings: Mapping[str, str] = field(default_factory=dict)

    @property
    def summary(self) -> str:
        """The first line of :attr:`doc`."""
        return self.doc.partition("\n")[0]

    @property
    def url(self) -> str:
        """URL of the robot that is opened by default: a virtual one in the behaviour's own world."""
        return f"sim://{self.world}"

    def resolve_url(self, url: str | None) -> str:
        """Return the robot's URL. A ``sim://`` without a world gets the behaviour's own world and its keys.

        Raises:
            ArgumentError: *url* is not a URL.
        """
        if url is None:
            return self.url
        given, own = parse_url(url), parse_url(self.url)
        if given.scheme != "sim" or given.target:
            return str(given)
        return str(Url("sim", own.target, tuple({**own.keys, **given.keys}.items())))

    def check(self, options: Mapping[str, object]) -> dict[str, object]:
        """Return the values of *options* as the behaviour takes them.

        Raises:
            ArgumentError: An option does not exist, or its value is out of range.
        """
        known = {option.name: option.quantity for option in self.options}
        checked: dict[str, object] = {}
        for name, value in options.items():
            if name not in known:
                there = ", ".join(known) or "none"
                raise ArgumentError(f"{self.name} has no option {name!r}", hint=f"there are: {there}")
            checked[name] = known[name].check(name, value)
        return checked


@typing.overload
def behaviour(function: Function, /) -> Behaviour: ...
@typing.overload
def behaviour(
    *, world: str = "", reconnects: bool = False, group: str = "your own"
) -> Callable[[Function], Behaviour]: ...
def behaviour(
    function: Function | None = None, /, *, world: str = "", reconnects: bool = False, group: str = "your own"
) -> Behaviour | Callable[[Function], Behaviour]:
    """Make a function a behaviour: ``@behaviour`` or ``@behaviour(world="light")``.

    The type of the first parameter says what is opened: an :class:`~elib.Epuck` or a :class:`~elib.Swarm` for
    coroutine functions, a ``BlockingEpuck`` for plain functions, or a ``Transport`` for raw bytes. The second parameter
    may be a :class:`RunContext`. The others are options: keyword-only, with a default, and annotated with a
    :class:`Quantity`. The docstring's text before the first section is the help; its section ``Args`` says what the
    options mean.

    Args:
        function: The function.
        world: The world that is opened by default: ``light``, or ``crowd?robots=10``.
        reconnects: Give the function a robot that reopens a link that is lost.
        group: What it is listed with on the page of ``elib joystick``.

    Raises:
        TypeError: A parameter breaks these rules.

    Example:
        >>> @elib.behaviour(world="square")
        ... async def dash(robot: elib.Epuck) -> None:
        ...     await robot.drive(0.1)
        >>> elib.play(dash, "sim://?speed=max").reason
        'done'
    """
    if function is None:
        return lambda function: _made(function, world, reconnects, group)
    return _made(function, world, reconnects, group)


def _made(function: Function, world: str, reconnects: bool, group: str) -> Behaviour:
    hints = typing.get_type_hints(function, include_extras=True)
    parameters = list(inspect.signature(function).parameters.values())
    style = STYLES.get(hints.get(parameters[0].name)) if parameters else None
    if style is None:
        there = ", ".join(style.value for style in BehaviourStyle)
        raise TypeError(f"{function.__qualname__}: the first parameter must be annotated as one of {there}")
    if inspect.iscoroutinefunction(function) != (style is not BehaviourStyle.BLOCKING):
        kind = "a plain function" if style is BehaviourStyle.BLOCKING else "a coroutine function"
        raise TypeError(f"{function.__qualname__}: a behaviour on {style.value} must be {kind}")
    takes_run = len(parameters) > 1 and hints.get(parameters[1].name) is RunContext
    options = []
    for item in parameters[1 + takes_run :]:
        quantity = next((n for n in getattr(hints.get(item.name), "__metadata__", ()) if isinstance(n, Quantity)), None)
        if quantity is None or item.kind is not item.KEYWORD_ONLY or item.default is item.empty:
            raise TypeError(f"{function.__qualname__}: {item.name} must be keyword-only, with a Quantity and a default")
        options.append(Parameter(item.name, quantity, item.default))
    module = function.__module__.rpartition(".")[2]
    name = (function.__name__ if module == "__main__" else module).replace("_", "-")
    doc, _, arguments = (inspect.getdoc(function) or "").partition("\nArgs:\n")
    described = re.findall(r"^    (\w+): (.+(?:\n {8}.+)*)", arguments.partition("\n\n")[0], re.MULTILINE)
    meanings = {key: re.split(r"\.(?:\s|$)", " ".join(text.split()))[0] for key, text in described}
    return Behaviour(name, doc.strip(), function, tuple(options), style, world, reconnects, takes_run, group, meanings)


def behaviours() -> dict[str, Behaviour]:
    """Return the behaviours that come with elib by name, in alphabetical order; its package is scanned for them."""
    package = importlib.import_module("elib.behaviours")
    found = {}
    for module in pkgutil.iter_modules(package.__path__, "elib.behaviours."):
        if module.ispkg:
            continue
        for value in vars(importlib.import_module(module.name)).values():
            if isinstance(value, Behaviour):
                found[value.name] = value
    return dict(sorted(found.items()))


def find(name: str) -> Behaviour:
    """Return the behaviour of that name; dashes and underscores are the same.

    Raises:
        ArgumentError: The behaviour does not exist; the message suggests the nearest name.
    """
    there = behaviours()
    wanted = name.strip().lower().replace("_", "-")
    if wanted in there:
        return there[wanted]
    near = get_close_matches(wanted, there, 1)
    hint = f"did you mean {near[0]}?" if near else f"there are: {', '.join(there)}"
    raise ArgumentError(f"there is no behaviour {name!r}", hint=hint)
