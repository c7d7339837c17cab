"""The frame of every behaviour: how it is declared, found and performed."""

from __future__ import annotations

import asyncio
import contextlib
import enum
import importlib
import inspect
import math
import pkgutil
import typing
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass
from difflib import get_close_matches

from elib.behaviours._run.context import RunContext
from elib.errors import ArgumentError, ElibError, LinkError, LinkLost, ReplyTimeout
from elib.protocol.quantities import Quantity
from elib.protocol.table import Parameter
from elib.robot.aio import Epuck
from elib.robot.blocking import BlockingEpuck
from elib.robot.statistics import Statistics, merged
from elib.swarms.swarm import Swarm
from elib.transport import Transport, Url, parse_url

STOPPING_TIMES = (1.5, 2.0, 4.0)
"""s that the robot has to confirm, at a behaviour's end, that it stands; after each it is told again, for an answer may
be lost. The last is time for a resync of three probes before."""
STOP_WORDS = b"D,0,0\r"
"""What a raw line is told at the end; every firmware understands it."""

Loop = Callable[..., object]


class Style(enum.Enum):
    """On what a behaviour runs; the type of its first parameter says which."""

    ASYNC = "Epuck"
    BLOCKING = "BlockingEpuck"
    SWARM = "Swarm"
    BYTES = "Transport"


STYLES: dict[object, Style] = {
    Epuck: Style.ASYNC,
    BlockingEpuck: Style.BLOCKING,
    Swarm: Style.SWARM,
    Transport: Style.BYTES,
}


@dataclass(frozen=True, slots=True)
class Behaviour:
    """Something a robot can do until told otherwise.

    Attributes:
        name: What ``elib run`` calls it: its module's name, with dashes; in a program of its own the function's.
        doc: What a person reads.
        loop: The function; it takes the open robot, the run if it wants it, and the options by name. A coroutine
            function unless it is blocking.
        options: What can be set, with units and ranges.
        style: On what it runs.
        world: The gallery's world it is at home in, with the keys of its URL if it needs some.
        reconnects: Its robot reopens a link that is lost.
        takes_run: Its second parameter is the run.
    """

    name: str
    doc: str
    loop: Loop
    options: tuple[Parameter, ...] = ()
    style: Style = Style.ASYNC
    world: str = ""
    reconnects: bool = False
    takes_run: bool = False

    @property
    def summary(self) -> str:
        """The first line of :attr:`doc`."""
        return self.doc.partition("\n")[0]

    @property
    def url(self) -> str:
        """What is opened where no robot is named: a virtual one in its world."""
        return f"sim://{self.world}"

    def at_home(self, url: str | None) -> str:
        """Return the robot's URL: a ``sim://`` that names no world is in the behaviour's own, with that one's keys.

        Raises:
            ArgumentError: It is none.
        """
        if url is None:
            return self.url
        given, own = parse_url(url), parse_url(self.url)
        if given.scheme != "sim" or given.target:
            return str(given)
        return str(Url("sim", own.target, tuple({**own.keys, **given.keys}.items())))

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
class RunResult:
    """How a performance went.

    Attributes:
        duration: Robot time it took, s.
        was_limited: The time given to it was over, or the person ended it; otherwise it came to its own end.
        statistics: The link's health since the robot was opened, of all robots together; None where there was only a
            raw line.
        reason: ``done`` at its own end, ``time``, ``enter``, or the word that the run was finished with.
        states: When each state was entered, s since it began, and its name.
        lines: What it said.
    """

    duration: float
    was_limited: bool
    statistics: Statistics | None
    reason: str = "done"
    states: tuple[tuple[float, str], ...] = ()
    lines: tuple[str, ...] = ()


@typing.overload
def behaviour(loop: Loop, /) -> Behaviour: ...
@typing.overload
def behaviour(*, world: str = "", reconnects: bool = False) -> Callable[[Loop], Behaviour]: ...
def behaviour(
    loop: Loop | None = None, /, *, world: str = "", reconnects: bool = False
) -> Behaviour | Callable[[Loop], Behaviour]:
    """Make a function a behaviour, named after its module: ``@behaviour`` or ``@behaviour(world="light")``.

    Its first parameter is the robot, and its type says what is opened: an :class:`~elib.Epuck` or a
    :class:`~elib.Swarm` for coroutine functions, a :class:`~elib.BlockingEpuck` for plain ones, a
    :class:`~elib.transport.Transport` for raw bytes. The second may be ``run``, the
    :class:`~elib.behaviours._run.context.RunContext`. The others are keyword-only with a default, each annotated with
    its :class:`~elib.protocol.quantities.Quantity`. Its docstring's text before the first section is the help.

    Args:
        loop: The function.
        world: The gallery's world it is at home in, where no robot is named: ``light``, or ``crowd?robots=10``.
        reconnects: Give it a robot that reopens a link that is lost.

    Raises:
        TypeError: A parameter breaks these rules.
    """
    if loop is None:
        return lambda function: _made(function, world, reconnects)
    return _made(loop, world, reconnects)


def _made(loop: Loop, world: str, reconnects: bool) -> Behaviour:
    hints = typing.get_type_hints(loop, include_extras=True)
    parameters = list(inspect.signature(loop).parameters.values())
    style = STYLES.get(hints.get(parameters[0].name)) if parameters else None
    if style is None:
        there = ", ".join(style.value for style in Style)
        raise TypeError(f"{loop.__qualname__}: the first parameter must be annotated as one of {there}")
    if inspect.iscoroutinefunction(loop) != (style is not Style.BLOCKING):
        kind = "a plain function" if style is Style.BLOCKING else "a coroutine function"
        raise TypeError(f"{loop.__qualname__}: a behaviour on {style.value} must be {kind}")
    takes_run = len(parameters) > 1 and parameters[1].name == "run"
    options = []
    for item in parameters[1 + takes_run :]:
        quantity = next((n for n in getattr(hints.get(item.name), "__metadata__", ()) if isinstance(n, Quantity)), None)
        if quantity is None or item.kind is not item.KEYWORD_ONLY or item.default is item.empty:
            raise TypeError(f"{loop.__qualname__}: {item.name} must be keyword-only, with a Quantity and a default")
        options.append(Parameter(item.name, quantity, item.default))
    module = loop.__module__.rpartition(".")[2]
    name = (loop.__name__ if module == "__main__" else module).replace("_", "-")
    doc = (inspect.getdoc(loop) or "").partition("\nArgs:")[0].strip()
    return Behaviour(name, doc, loop, tuple(options), style, world, reconnects, takes_run)


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
    near = get_close_matches(wanted, there, 1)
    hint = f"did you mean {near[0]}?" if near else f"there are: {', '.join(there)}"
    raise ArgumentError(f"there is no behaviour {name!r}", hint=hint)


def check_duration(seconds: float | None) -> None:
    """Check the time that a behaviour is given.

    Raises:
        ArgumentError: It is not positive and finite.
    """
    if seconds is not None and not (math.isfinite(seconds) and seconds > 0):
        raise ArgumentError(f"the time to run for is {seconds} s; it must be a finite number above 0")


async def run_behaviour(
    what: Behaviour,
    robot: Epuck | Swarm | Transport,
    *,
    seconds: float | None = None,
    options: typing.Mapping[str, object] | None = None,
    run: RunContext | None = None,
) -> RunResult:
    """Let *robot* behave until the time is over, it comes to its own end, or the caller is cancelled; then stop it.

    Args:
        what: The behaviour, none in the blocking style.
        robot: An open robot, or what the behaviour runs on.
        seconds: Robot time after which it ends; None for as long as it likes.
        options: Values for the behaviour's options.
        run: Where it performs; it has a time of its own. A new one unless given.

    Returns:
        How it went.

    Raises:
        ArgumentError: *seconds* is not positive and finite, or an option is wrong; nothing was sent.
        ElibError: What the behaviour could not cope with, or the robot did not confirm that it stopped.
    """
    check_duration(seconds)
    chosen = what.check(options or {})
    loop = asyncio.get_running_loop()
    run = RunContext(loop.time, seconds=seconds) if run is None else run
    run.listeners += [each.events.add for each in _robots(robot)]
    limit = asyncio.timeout(None if run.left is None else run.left)

    def end_it() -> None:
        # A run may be finished from any thread, and after the loop.
        with contextlib.suppress(RuntimeError):
            loop.call_soon_threadsafe(_expire, limit)

    try:
        async with limit:
            run.on_finish(end_it)
            await typing.cast("Awaitable[object]", what.loop(robot, *([run] if what.takes_run else []), **chosen))
    except BaseException as error:
        # A TimeoutError may be the robot's own, which the behaviour let through.
        if not (isinstance(error, TimeoutError) and limit.expired()):
            run.finish("error" if isinstance(error, Exception) else "interrupt")
            # The error that ended it says more than a stop that could not be confirmed.
            try:
                await _stop(robot)
            except ElibError:
                raise _still_moving(what, error) from error
            raise
        run.finish("time")
    outcome = _outcome(run, [each.statistics for each in _robots(robot)])
    try:
        await _stop(robot)
    except ElibError as error:
        raise _still_moving(what, error) from error
    return outcome


def run_behaviour_blocking(
    what: Behaviour,
    robot: BlockingEpuck,
    *,
    seconds: float | None = None,
    options: typing.Mapping[str, object] | None = None,
    run: RunContext | None = None,
) -> RunResult:
    """Do the same as :func:`run_behaviour` for a behaviour in the blocking style, in this thread."""
    check_duration(seconds)
    chosen = what.check(options or {})
    run = RunContext(lambda: robot.time, seconds=seconds) if run is None else run
    run.listeners.append(robot.events.add)
    try:
        what.loop(robot, *([run] if what.takes_run else []), **chosen)
        run.finish("time" if run.is_over else "done")
    except BaseException as error:
        run.finish("error" if isinstance(error, Exception) else "interrupt")  # so that no callback drives on
        try:
            _stop_blocking(robot)
        except ElibError:
            raise _still_moving(what, error) from error
        raise
    outcome = _outcome(run, [robot.statistics])
    try:
        _stop_blocking(robot)
    except ElibError as error:
        raise _still_moving(what, error) from error
    return outcome


def _stop_blocking(robot: BlockingEpuck) -> None:
    with _without_wheels(robot.robot):
        _confirmed_blocking(robot)


def _confirmed_blocking(robot: BlockingEpuck) -> None:
    for seconds in STOPPING_TIMES[:-1]:
        with contextlib.suppress(ReplyTimeout):
            return robot.within(seconds).stop()
    return robot.within(STOPPING_TIMES[-1]).stop()


def _expire(limit: asyncio.Timeout) -> None:
    # Too late where the block has ended meanwhile.
    with contextlib.suppress(RuntimeError):
        limit.reschedule(asyncio.get_running_loop().time())


def _robots(robot: Epuck | Swarm | Transport) -> tuple[Epuck, ...]:
    if isinstance(robot, Swarm):
        return tuple(robot)
    return (robot,) if isinstance(robot, Epuck) else ()


async def _stop(robot: Epuck | Swarm | Transport) -> None:
    if isinstance(robot, Swarm):
        await asyncio.gather(*map(_stop, robot))
        return
    with _without_wheels(robot):
        if isinstance(robot, Epuck):
            await _confirmed(lambda seconds: robot.within(seconds).stop())
        else:
            await robot.write(STOP_WORDS)


@contextlib.contextmanager
def _without_wheels(robot: Epuck | Transport) -> Iterator[None]:
    """Let a stop fail that only a recording hears: it has no wheels, and was perhaps stopped at another moment."""
    try:
        yield
    except ElibError:
        origin = robot.context.origin if isinstance(robot, Epuck) else robot.origin
        if origin != "replay":
            raise


async def _confirmed(stop: Callable[[float], Awaitable[None]]) -> None:
    for seconds in STOPPING_TIMES[:-1]:
        with contextlib.suppress(ReplyTimeout):
            return await stop(seconds)
    return await stop(STOPPING_TIMES[-1])


def _outcome(run: RunContext, statistics: list[Statistics]) -> RunResult:
    reason = run.reason or "done"
    return RunResult(
        run.time, reason != "done", merged(statistics) if statistics else None, reason, run.states, run.lines
    )


def _still_moving(what: Behaviour, error: BaseException) -> ElibError | BaseException:
    """Return *error* with the warning that nobody knows whether the robot stands."""
    warning = f"{what.name} ended, but the robot did not confirm that it stands: it may still be moving"
    if isinstance(error, LinkError):
        return type(error)(f"{error.message}; {warning}", hint=error.hint or "switch it off, or catch it")
    if isinstance(error, ElibError):
        return LinkLost(f"{warning} ({error.message})", hint="switch it off, or catch it")
    error.add_note(warning)
    return error


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
