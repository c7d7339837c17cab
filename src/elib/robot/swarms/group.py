"""A group of robots, and the views that send a command to all of them: at the same time, or one after another."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine, Iterable, Iterator, Sequence
from typing import Any, Self, TypeVar, overload

from elib.base.errors import ArgumentError, ElibError, about
from elib.link.protocol.styles import Action, CollectingStyle, Outcomes, SwarmStyle
from elib.link.protocol.table import Command
from elib.robot.actions import Actions
from elib.robot.aio import Epuck
from elib.robot.swarms.fanout import Fanout, Program, in_parallel, in_turn, joined, raise_first, stop_all

T = TypeVar("T")


class Group(Sequence[Epuck]):
    """Robots in their order, by place or by name: ``robots[0]``, ``robots["epuck-3"]``, ``robots[:10]``.

    ::

        await robots.all.set_speed(0.2, 0.2)  # at the same time
        near = await robots.all.proximity()  # near["epuck-3"].front_right
        await robots.in_turn.set_body_led(1)  # one after another
        await robots.only("epuck-1", "epuck-4").all.stop()
        outcomes = await robots.all.collect.battery()  # outcomes.answers, outcomes.errors
        await robots.all.run(wander)  # async def wander(robot)
    """

    def __init__(self, robots: Iterable[Epuck]) -> None:
        self._robots = tuple(robots)

    @property
    def names(self) -> tuple[str, ...]:
        """The robots' names, in order."""
        return tuple(robot.name for robot in self._robots)

    @property
    def all(self) -> AllRobots:
        """Commands to all of them, at the same time."""
        return AllRobots(self._robots, in_parallel)

    @property
    def in_turn(self) -> AllRobots:
        """Commands to one robot after another: each is asked when the one before it has answered."""
        return AllRobots(self._robots, in_turn)

    def only(self, *which: str | int) -> Group:
        """Return some of the robots, by their names or places.

        Raises:
            ArgumentError: A robot does not exist, or is named twice.
        """
        chosen = [self[each] for each in which]
        if len(set(chosen)) < len(chosen):
            raise ArgumentError(f"only{which!r} names a robot twice")
        return Group(chosen)

    @overload
    def __getitem__(self, which: int | str) -> Epuck: ...
    @overload
    def __getitem__(self, which: slice) -> Group: ...
    def __getitem__(self, which: int | str | slice) -> Epuck | Group:
        if isinstance(which, slice):
            return Group(self._robots[which])
        if isinstance(which, str):
            for robot in self._robots:
                if robot.name == which:
                    return robot
            raise NoSuchRobot(f"there is no robot {which!r}", hint=f"there are {joined(self.names) or 'none'}")
        try:
            return self._robots[which]
        except IndexError:
            raise NoSuchRobot(f"there is no robot {which}: there are {len(self)}, counted from 0") from None

    def __len__(self) -> int:
        return len(self._robots)

    def __iter__(self) -> Iterator[Epuck]:
        return iter(self._robots)

    def __contains__(self, which: object) -> bool:
        return which in self._robots or which in self.names

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {joined(self.names) or 'no robots'}>"


class NoSuchRobot(ArgumentError, IndexError):
    """The group does not have this robot."""


class _View(Actions):
    """Commands to several robots."""

    def __init__(self, robots: tuple[Epuck, ...], fanout: Fanout) -> None:
        self._robots = robots
        self._fanout = fanout

    def within(self, seconds: float) -> Self:
        """Return a view whose calls wait this long for each robot, s, instead of the command's own time.

        Raises:
            ArgumentError: *seconds* is not a finite number from 0 on.
        """
        return type(self)(tuple(robot.within(seconds) for robot in self._robots), self._fanout)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {joined([robot.name for robot in self._robots]) or 'no robots'}>"


class AllRobots(_View, SwarmStyle):
    """Every command, to several robots: a call gives their answers by name, in order, as a dict.

    The calls succeed or fail together. At the first error the calls of the other robots are cancelled, all robots are
    stopped, and a :class:`~elib.SwarmError` names the robot. A mistake in the command itself, an ArgumentError
    or Unsupported, is raised before anything is sent to any robot.
    """

    @property
    def collect(self) -> Collecting:
        """The same commands for each robot by itself: calls return Outcomes, with answers and errors."""
        return Collecting(self._robots, self._fanout)

    async def run(self, program: Callable[[Epuck], Awaitable[T]]) -> dict[str, T]:
        """Run ``async def program(robot)`` for each robot and return their results by name.

        Raises:
            SwarmError: A program ended in an error of elib. Any other error is raised unchanged, with the robot's name
                in a note.
        """
        results = await self._fanout(self._robots, program, fail_fast=True)
        errors = {name: result for name, result in results.items() if isinstance(result, Exception)}
        if errors:
            await stop_all(self._robots)
            raise_first(errors)
        return {name: result for name, result in results.items() if not isinstance(result, Exception)}

    def _call(
        self, operation: Command[Any, Any] | Action[Any, Any], args: tuple[Any, ...], kwargs: dict[str, Any]
    ) -> Coroutine[Any, Any, dict[str, Any]]:
        if isinstance(operation, Action):
            operation.check(args, kwargs)
        else:
            for robot in self._robots:
                try:
                    operation.spec.request(robot.context, *args, **kwargs)
                except ElibError as error:
                    raise about(robot.name, error) from error
        return self.run(_program(operation, args, kwargs))


class Collecting(_View, CollectingStyle):
    """Every command, to several robots, each for itself: a call returns the answer or the error of every robot."""

    async def run(self, program: Callable[[Epuck], Awaitable[T]]) -> Outcomes[T]:
        """Run ``async def program(robot)`` for each robot and return all results and errors."""
        outcomes: Outcomes[T] = Outcomes({}, {})
        for name, result in (await self._fanout(self._robots, program, fail_fast=False)).items():
            if isinstance(result, Exception):
                outcomes.errors[name] = result
            else:
                outcomes.answers[name] = result
        return outcomes

    def _call(
        self, operation: Command[Any, Any] | Action[Any, Any], args: tuple[Any, ...], kwargs: dict[str, Any]
    ) -> Coroutine[Any, Any, Outcomes[Any]]:
        return self.run(_program(operation, args, kwargs))


def _program(
    operation: Command[Any, Any] | Action[Any, Any], args: tuple[Any, ...], kwargs: dict[str, Any]
) -> Program[Any]:
    async def ask(robot: Epuck) -> Any:
        return await operation(robot, *args, **kwargs)

    return ask
