"""Run a state machine: each state is a function of the robot that returns the name of the next state."""

from __future__ import annotations

import ast
import inspect
import logging
import textwrap
from collections.abc import Callable, Collection, Coroutine, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any, Final, overload

from elib.base.errors import ArgumentError
from elib.base.rules import Number
from elib.behaviours._run.behaviour import Behaviour, BehaviourStyle
from elib.behaviours._run.context import RunContext
from elib.behaviours._run.loop import PERIOD, react, react_blocking
from elib.robot.aio import Epuck
from elib.robot.blocking import BlockingEpuck

State = Callable[..., object]
"""A function of the robot, or of the robot and the :class:`RunContext`; a coroutine function for an async robot."""

END: Final = "end"
"""What a state returns to end the machine."""

log = logging.getLogger("elib")


@dataclass(frozen=True, slots=True, eq=False)
class StateMachine(Behaviour):
    """A behaviour of several states; :func:`states` makes it."""

    # the states by name. One that is a machine itself is left when it returns a name of this one.
    members: Mapping[str, State] = field(default_factory=dict)
    start: str = ""  # name of the state that it begins in
    exits: Mapping[str, State] = field(default_factory=dict)  # what is done when a state is left, by its name
    period: float = PERIOD  # time from one step to the next, s, if the link is quick enough

    __hash__, __eq__ = object.__hash__, object.__eq__  # a machine is a key of ``exits``

    @overload
    def __call__(self, robot: Epuck, run: RunContext | None = None) -> Coroutine[Any, Any, None]: ...
    @overload
    def __call__(self, robot: BlockingEpuck, run: RunContext | None = None) -> None: ...  # by BlockingStateMachine
    async def __call__(self, robot: Any, run: RunContext | None = None) -> None:  # type: ignore[misc]
        """Drive a robot until a state returns ``end``, and stop it, or until the run is over."""
        walk = self._walk(robot, run)

        async def step(view: Epuck) -> bool:
            walk.begin()
            answer: Any = await walk.call(view)  # type: ignore[misc]  # a state of this class is a coroutine function
            for leave in walk.exits(answer):
                await leave(view)  # type: ignore[misc]
            return walk.take(answer)

        await react(robot, step, period=self.period)
        await robot.stop()

    def _walk(self, robot: Epuck | BlockingEpuck, run: RunContext | None) -> Walk:
        if run is None:
            run = RunContext(lambda: robot.time)
            run.listeners.append(robot.events.add)
        self.check({})
        for name in self.lonely():
            log.warning("state %s is never reached: no state returns %r", name, name)
        if program := self.program():
            run.begin_machine(program)
        return Walk(self, run)

    def check(self, options: Mapping[str, object]) -> dict[str, object]:
        """Return the values of *options*, of which a machine has none.

        Raises:
            ArgumentError: There are options, or a state returns a name that no state has.
        """
        self.check_targets(())
        return Behaviour.check(self, options)  # a class with slots that a decorator makes has no super()

    def check_targets(self, outer: Iterable[str]) -> None:
        """Raise an ArgumentError if a state returns a name that no state of this machine or of *outer* has."""
        known = (*self.members, *outer)
        for name, state in self.members.items():
            if isinstance(state, StateMachine):
                state.check_targets(known)
                continue
            for line, target in targets_of(state):
                if target not in (*known, END):
                    raise unknown(name, target, known, line)

    def lonely(self) -> list[str]:
        """Return the states that no other state names, as far as that can be told."""
        ways = [(name, target) for name, state in self.members.items() for _, target in _all_targets(state)]
        return unreached(self.start, self.members, ways)

    def program(self) -> str:
        """Return the text of the file that holds the first state; empty where it is not to be had."""
        first = next(iter(self.members.values()))
        if isinstance(first, StateMachine):
            return first.program()
        try:
            return "".join(inspect.findsource(first)[0])
        except (OSError, TypeError):
            return ""


@dataclass(frozen=True, slots=True, eq=False)
class BlockingStateMachine(StateMachine):
    """A behaviour of several states in the blocking style."""

    def __call__(self, robot: BlockingEpuck, run: RunContext | None = None) -> None:  # type: ignore[override]
        """Drive a robot until a state returns ``end``, and stop it, or until the run is over."""
        walk = self._walk(robot, run)

        def step(view: BlockingEpuck) -> bool:
            walk.begin()
            answer = walk.call(view)
            if answer != END and walk.run.is_over:
                return False  # no step would be done in the state that it names
            for leave in walk.exits(answer):
                leave(view)
            return walk.take(answer)

        react_blocking(robot, walk.run, step, period=self.period)
        if not walk.run.is_over:  # else the caller that gave the run stops the robot
            robot.stop()


class Walk:
    """Where a run is in a machine.

    Args:
        machine: The machine.
        run: The run.
        within: Name of the state that this machine is, with a dot; empty for the outermost.

    Attributes:
        machine: The machine.
    """

    def __init__(self, machine: StateMachine, run: RunContext, within: str = "") -> None:
        self.run = run
        self.machine, self._within = machine, within
        self._is_done = True
        self._enter(machine.start)

    def _enter(self, name: str) -> None:
        self._name = name
        state = self.machine.members[name]
        self._takes_run = _takes_run(state)
        self._inner: Walk | None = None
        if isinstance(state, StateMachine):
            self._inner = Walk(state, self.run, f"{self._within}{name}.")
        else:
            self.run.enter(self._within + name)

    def begin(self) -> None:
        """Begin a step; as the first of its state again if a lost answer cut the last one, because the robot stands."""
        self.run.entered |= not self._is_done
        self._is_done = False

    def call(self, robot: object) -> object:
        """Do a step of the state; return what it returns, a coroutine in the async style."""
        if self._inner is not None:
            return self._inner.call(robot)
        state = self.machine.members[self._name]
        return state(robot, self.run) if self._takes_run else state(robot)

    def exits(self, answer: object) -> Iterator[State]:
        """Yield what is to be done before the states are left that *answer* leaves, the innermost first."""
        if answer is None:
            return
        if self._inner is not None:
            yield from self._inner.exits(answer)
            if self._inner.knows(answer):
                return
        if self._name in self.machine.exits:
            yield self.machine.exits[self._name]

    def knows(self, answer: object) -> bool:
        """Return whether it is the name of a state of this machine, or of the one that is its state now."""
        return answer in self.machine.members or (self._inner is not None and self._inner.knows(answer))

    def take(self, answer: object) -> bool:
        """Take what the step returned; return whether the machine has ended.

        Raises:
            ArgumentError: It is not the name of a state.
        """
        self._is_done, self.run.entered = True, False
        if answer is None or self.goes(answer):
            return False
        if answer == END:
            return True
        raise unknown(self._name, answer, self.machine.members)

    def goes(self, answer: object) -> bool:
        """Enter the state of that name; return False if there is none."""
        if self._inner is not None and self._inner.goes(answer):
            return True
        if answer not in self.machine.members:
            return False
        assert isinstance(answer, str)
        self._enter(answer)
        return True


def states(
    *functions: State,
    start: State | None = None,
    exits: Mapping[State, State] | None = None,
    name: str = "states",
    world: str = "",
    reconnects: bool = False,
    period: float = PERIOD,
) -> StateMachine:
    """Make a behaviour of states: ``elib.play`` and ``elib.run`` run it, others await ``machine(robot, run)``.

    A state is a function of the robot, or of the robot and the run. It does one step and returns the name of the next
    state, or None to stay; ``"end"`` ends the machine. It is called 20 times a second. ``run.entered`` is true in the
    first step of a state, and ``run.time_in_state`` tells how long it lasts. All are coroutine functions that take an
    :class:`~elib.Epuck`, or all are plain functions that take a :class:`BlockingEpuck`. After a lost answer the robot
    stands, and the step is done again as the first of its state, because the wheels are to be set again.

    Args:
        functions: The states. One may be a machine: it is left by a name that it does not have itself.
        start: The state that it begins in; the first unless given.
        exits: What is done when a state is left, by the state: a function of the robot.
        name: Name of the machine, as a state of another one and for people.
        world: The world that is opened by default: ``light``, or ``crowd?robots=10``.
        reconnects: Give the states a robot that reopens a link that is lost.
        period: Time from one step to the next, s, if the link is quick enough.

    Raises:
        ArgumentError: There is no state, two have one name, *start* or one of *exits* is no state, or plain and
            coroutine functions are mixed.

    Example:
        >>> async def drive(robot):
        ...     await robot.set_speed(0.4, 0.4)
        ...     return "turn" if (await robot.distances()).ahead < 0.04 else None
        >>> async def turn(robot):
        ...     await robot.turn(1.6)
        ...     return "drive"
        >>> elib.play(elib.states(drive, turn), "sim://square?speed=max", seconds=20).states[1][1]
        'turn'
    """
    if not functions:
        raise ArgumentError("elib.states() takes at least one state", hint="elib.states(drive, turn)")
    members: dict[str, State] = {}
    for each in functions:
        called = _name(each)
        if called in (*members, END):
            why = "is what a state returns to end the machine" if called == END else "is the name of two states"
            raise ArgumentError(f"{called!r} {why}", hint="rename the function")
        if not (_takes(each, 1) or _takes(each, 2)):
            raise ArgumentError(f"{called} does not take a robot", hint=f"def {called}(robot), or {called}(robot, run)")
        members[called] = each
    given = {_name(each): do for each, do in (exits or {}).items()}
    first = next(iter(members)) if start is None else _name(start)
    for called in (first, *given):
        if called not in members:
            raise ArgumentError(f"{called!r} is no state of this machine", hint=f"it has: {', '.join(members)}")
    everything = (*members.values(), *given.values())
    kinds = {_is_async(each) for each in everything}
    if len(kinds) > 1:
        plain = next(_name(each) for each in everything if not _is_async(each))
        raise ArgumentError(f"{plain} is a plain function, and others are not", hint=f"write: async def {plain}(robot)")
    style = BehaviourStyle.ASYNC if kinds.pop() else BehaviourStyle.BLOCKING

    async def function(robot: Epuck, run: RunContext) -> None:
        await machine(robot, run)

    def blocking(robot: BlockingEpuck, run: RunContext) -> None:
        machine(robot, run)

    drive = function if style is BehaviourStyle.ASYNC else blocking
    drive.__module__ = getattr(functions[0], "__module__", __name__)  # where elib run looks for what a file defines
    make = StateMachine if style is BehaviourStyle.ASYNC else BlockingStateMachine
    machine: Any = make(
        name,
        f"States: {', '.join(members)}.",
        drive,
        style=style,
        world=world,
        reconnects=reconnects,
        takes_run=True,
        members=members,
        start=first,
        exits=given,
        period=Number(0.001, 60, "s").require(period, "the period"),
    )
    return machine  # type: ignore[no-any-return]


def unknown(name: str, target: object, known: Iterable[str], line: int | None = None) -> ArgumentError:
    """Return the error about a state that returns what is no state's name."""
    there = tuple(known)
    near = get_close_matches(target, there, 1) if isinstance(target, str) else []
    if callable(target):
        near = [_name(target)]
    place = "" if line is None else f"line {line}: "
    hint = f'did you mean "{near[0]}"?' if near else f"the states are: {', '.join(there)}"
    return ArgumentError(f"{place}state {name} returns {target!r}, but no state has this name", hint=hint)


def targets(nodes: Iterable[ast.AST]) -> Iterator[tuple[ast.Return, ast.Constant | None]]:
    """Yield each return that leaves a state, with the string that names its target; None where only the run tells it.

    Functions within do not count: they return to the state.
    """
    for node in nodes:
        if isinstance(node, ast.Return):
            yield from ((node, name) for name in _names(node.value))
        elif not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.expr):
            yield from targets(ast.iter_child_nodes(node))


def _names(value: ast.expr | None) -> Iterator[ast.Constant | None]:
    match value:
        case None | ast.Constant(value=None):
            pass
        case ast.Constant(value=str()):
            yield value
        case ast.IfExp(body=one, orelse=other):
            yield from (*_names(one), *_names(other))
        case _:
            yield None


def unreached(start: str, names: Iterable[str], ways: Collection[tuple[str, str | None]]) -> list[str]:
    """Return the states that no other one leads to; none of them if another one leads where only the run tells.

    Args:
        start: The state that the machine begins in.
        names: All states.
        ways: Source and target of each arrow; a target that only the run tells is None.
    """
    reached = {start, *(target for source, target in ways if target != source)}
    open_ones = {source for source, target in ways if target is None}
    return [name for name in names if name not in reached and not open_ones - {name}]


def targets_of(state: State) -> Iterator[tuple[int, str]]:
    """Yield line and name of each state that a function names in a return; nothing where its text is not to be had."""
    return ((line, name) for line, name in _all_targets(state) if name is not None)


def _all_targets(state: State) -> Iterator[tuple[int, str | None]]:
    if isinstance(state, StateMachine):
        for member in state.members.values():
            yield from _all_targets(member)
        return
    try:
        lines, first = inspect.getsourcelines(state)
        tree = ast.parse(textwrap.dedent("".join(lines)))
    except (OSError, TypeError, SyntaxError):
        tree, first = ast.Module([], []), 0
    match tree.body:
        case [ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) as node] if name == _name(state):
            for each, target in targets(node.body):
                yield first + each.lineno - 1, None if target is None else str(target.value)
        case _:  # its text is not there, or has changed since it was read
            yield 0, None


def _name(state: object) -> str:
    found = state.name if isinstance(state, StateMachine) else getattr(state, "__name__", "")
    if not (callable(state) and isinstance(found, str) and found.isidentifier()):
        raise ArgumentError(f"{state!r} is no state", hint="a state is a function: async def drive(robot): ...")
    return found


def _is_async(state: State) -> bool:
    return inspect.iscoroutinefunction(state) or (
        isinstance(state, StateMachine) and not isinstance(state, BlockingStateMachine)
    )


def _takes_run(state: State) -> bool:
    return len(inspect.signature(state).parameters) > 1


def _takes(state: State, count: int) -> bool:
    """Return whether a function can be called with so many arguments."""
    try:
        inspect.signature(state).bind(*range(count))
    except TypeError:
        return False
    return True
