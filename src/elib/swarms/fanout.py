"""How several robots are asked: at the same time or one after another, failing together or each for itself."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection, Coroutine, Iterable, Sequence
from typing import Any, NoReturn, Protocol, TypeVar

from elib.errors import ArgumentError, ElibError, SwarmError, Unsupported
from elib.robot.aio import PARTING_TIME, Epuck, stop_words

T = TypeVar("T")

MOST_NAMES = 4
"""Names that a message lists; of more it says how many."""

Part = Callable[[Epuck], Awaitable[T]]
"""What is to be done with each robot."""
Found = dict[str, T | Exception]
"""What came of it for each robot, by name; only of those with which it has ended."""


class Way(Protocol):
    """:func:`in_parallel` or :func:`in_turn`."""

    def __call__(self, robots: Iterable[Epuck], part: Part[T], *, together: bool) -> Coroutine[Any, Any, Found[T]]:
        """Do *part* with all robots; *together*, the first error ends it for all."""
        ...


async def in_parallel(robots: Iterable[Epuck], part: Part[T], *, together: bool) -> Found[T]:
    """Do *part* with all robots at the same time; *together*, the first error gives up those that have not ended."""
    tasks = {robot.name: asyncio.create_task(_do(part, robot), name=f"elib swarm {robot.name}") for robot in robots}
    if not tasks:
        return {}
    ends_with = asyncio.FIRST_EXCEPTION if together else asyncio.ALL_COMPLETED
    try:
        ended, _ = await asyncio.wait(tasks.values(), return_when=ends_with)
    finally:
        await _give_up([task for task in tasks.values() if not task.done()])
    return {name: _outcome(task) for name, task in tasks.items() if task in ended}


async def in_turn(robots: Iterable[Epuck], part: Part[T], *, together: bool) -> Found[T]:
    """Do *part* with one robot after another; *together*, it is not begun any more after the first error."""
    found: Found[T] = {}
    for robot in robots:
        try:
            found[robot.name] = await part(robot)
        except Exception as error:
            found[robot.name] = error
            if together:
                break
    return found


async def stop_all(robots: Iterable[Epuck]) -> None:
    """Stop all robots that can be reached, at the same time, each in about as long as leaving it would wait."""

    async def stop(robot: Epuck) -> None:
        session = robot.session
        try:
            await robot.within(session.stopping_time).stop()
        except ElibError:
            await session.blurt(stop_words(session), PARTING_TIME)  # it may hear, though it does not answer

    await asyncio.gather(*map(stop, robots))


def raise_first(errors: dict[str, Exception]) -> NoReturn:
    """Raise what says which robots failed, the first of them by name."""
    name, first = next(iter(errors.items()))
    if not isinstance(first, ElibError):
        first.add_note(f"in the program of robot {name}")
        raise first
    if isinstance(first, ArgumentError | Unsupported):
        raise of_robot(name, first) from first
    others = [other for other in errors if other != name]
    also = f"; {listed(others)} failed too" if others else ""
    raise SwarmError(f"{name}: {first.message}{also}", errors=errors, hint=first.hint) from first


def of_robot(name: str, error: ElibError) -> ElibError:
    """Return *error* as it concerns one robot."""
    return type(error)(f"{name}: {error.message}", hint=error.hint)


def listed(names: Sequence[str]) -> str:
    """Return the names for a message, not too many of them."""
    if len(names) <= MOST_NAMES:
        return ", ".join(names)
    shown = names[: MOST_NAMES - 1]
    return f"{', '.join(shown)} and {len(names) - len(shown)} more"


async def _do(part: Part[T], robot: Epuck) -> T:
    return await part(robot)


async def _give_up(tasks: Collection[asyncio.Task[Any]]) -> None:
    for task in tasks:
        task.cancel()
    if tasks:
        await asyncio.wait(tasks)
    for task in tasks:
        if not task.cancelled():
            task.exception()  # it came too late to matter


def _outcome(task: asyncio.Task[T]) -> T | Exception:
    error = None if task.cancelled() else task.exception()
    return error if isinstance(error, Exception) else task.result()
