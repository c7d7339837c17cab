"""Run one program on several robots: in parallel or in sequence, failing together or each for itself."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection, Coroutine, Iterable, Sequence
from typing import Any, NoReturn, Protocol, TypeVar

from elib.base.errors import ArgumentError, ElibError, SwarmError, Unsupported, about
from elib.base.tasks import end_tasks
from elib.robot.aio import Epuck
from elib.robot.link import stop_bytes

T = TypeVar("T")

MAX_NAMES = 4
"""Robots that a message names; of the others it gives the number."""

Program = Callable[[Epuck], Awaitable[T]]
"""A coroutine function that takes one robot."""
Results = dict[str, T | Exception]
"""The result or error of each robot whose program has ended, by name."""


class Fanout(Protocol):
    """:func:`in_parallel` or :func:`in_turn`."""

    def __call__(
        self, robots: Iterable[Epuck], program: Program[T], *, fail_fast: bool
    ) -> Coroutine[Any, Any, Results[T]]:
        """Run *program* for each robot; with *fail_fast*, the first error ends it for all."""


async def in_parallel(robots: Iterable[Epuck], program: Program[T], *, fail_fast: bool) -> Results[T]:
    """Run *program* for all robots at the same time; with *fail_fast*, the first error cancels the others."""
    tasks = {robot.name: asyncio.create_task(_run(program, robot), name=f"elib swarm {robot.name}") for robot in robots}
    if not tasks:
        return {}
    ends_with = asyncio.FIRST_EXCEPTION if fail_fast else asyncio.ALL_COMPLETED
    try:
        ended, _ = await asyncio.wait(tasks.values(), return_when=ends_with)
    finally:
        await _cancel([task for task in tasks.values() if not task.done()])
    return {name: _result(task) for name, task in tasks.items() if task in ended}


async def in_turn(robots: Iterable[Epuck], program: Program[T], *, fail_fast: bool) -> Results[T]:
    """Run *program* for one robot after another; with *fail_fast*, stop at the first error."""
    results: Results[T] = {}
    for robot in robots:
        try:
            results[robot.name] = await _run(program, robot)
        except Exception as error:
            results[robot.name] = error
            if fail_fast:
                break
    return results


async def stop_all(robots: Iterable[Epuck]) -> None:
    """Stop all robots at the same time; a robot that cannot be reached is waited for as long as when it is closed."""

    async def stop(robot: Epuck) -> None:
        session = robot.session
        try:
            await robot.within(session.stopping_time).stop()
        except ElibError:
            session.send_unqueued(stop_bytes(session))  # it may receive the stop although its answers are lost

    await asyncio.gather(*map(stop, robots))


def raise_first(errors: dict[str, Exception]) -> NoReturn:
    """Raise the first error, and say which robots failed."""
    name, first = next(iter(errors.items()))
    if not isinstance(first, ElibError):
        first.add_note(f"in the program of robot {name}")
        raise first
    if isinstance(first, ArgumentError | Unsupported):
        raise about(name, first) from first
    others = [other for other in errors if other != name]
    also = f"; {joined(others)} failed too" if others else ""
    raise SwarmError(f"{name}: {first.message}{also}", errors=errors, hint=first.hint) from first


def joined(names: Sequence[str]) -> str:
    """Return the names for a message, which lists only the first of many."""
    if len(names) <= MAX_NAMES:
        return ", ".join(names)
    shown = names[: MAX_NAMES - 1]
    return f"{', '.join(shown)} and {len(names) - len(shown)} more"


async def _run(program: Program[T], robot: Epuck) -> T:
    """Run *program* for one robot. Only the caller of the swarm cancels it: a cancellation of its own is an error."""
    try:
        return await program(robot)
    except asyncio.CancelledError as error:
        task = asyncio.current_task()
        if task is None or task.cancelling():
            raise
        raise ElibError("its program awaited what was cancelled", hint="catch asyncio.CancelledError there") from error


async def _cancel(tasks: Collection[asyncio.Task[Any]]) -> None:
    await end_tasks(*tasks)
    for task in tasks:
        if not task.cancelled():
            task.exception()  # retrieved, so that asyncio does not report it


def _result(task: asyncio.Task[T]) -> T | Exception:
    error = None if task.cancelled() else task.exception()
    return error if isinstance(error, Exception) else task.result()
