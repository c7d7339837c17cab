"""``elib.swarm(url or urls)``: several robots that are opened and closed together."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Awaitable, Callable, Generator, Iterable, Sequence
from typing import Any, NoReturn, Self, TypeVar

from elib.base.errors import ArgumentError, LinkClosed
from elib.link.protocol.image import Mounting
from elib.link.transport import Url, parse_url, robots_of, speed_of
from elib.robot.aio import Epuck
from elib.robot.link import Link, LinkSettings
from elib.robot.reconnect import Policy
from elib.robot.running import run_coroutine
from elib.robot.signals import TerminationHandler
from elib.robot.substitute import choose_robots
from elib.robot.swarms.fanout import in_parallel, raise_first
from elib.robot.swarms.group import Group

T = TypeVar("T")

OPENING_AT_ONCE = 7
"""Robots that are opened at the same time: the number of links of one Bluetooth radio (active slaves of a piconet)."""

VIRTUAL = ("sim", "lockstep")
"""The schemes whose robots have a number instead of a port."""


class Swarm(Group):
    """Robots that are opened and closed together. Make a swarm by :func:`elib.swarm` and use it in ``async with``.

    Leaving the block stops all robots at the same time, whatever ended it, unless ``keep_moving`` was set. The others
    are stopped even if one robot does not answer any more.
    """

    def __init__(self, urls: Sequence[Url], names: Sequence[str] | None, settings: LinkSettings) -> None:
        super().__init__(())
        self._urls = urls
        self._given_names = names
        self._settings = settings
        self._links: list[Link] = []
        self._termination: TerminationHandler | None = None

    # -- opening and closing --

    async def __aenter__(self) -> Self:
        if self._termination is not None:
            raise LinkClosed("this swarm was opened before", hint="a swarm can be opened once: call elib.swarm() again")
        self._termination = TerminationHandler()
        try:
            self._links = self._make_links()
            self._robots = tuple(Epuck(link) for link in self._links)
            await self._open()
        except BaseException:
            await self.close()
            raise
        return self

    def __await__(self) -> Generator[Any, None, Self]:
        return self.__aenter__().__await__()

    async def __aexit__(self, *_: object) -> None:
        await self.close()
        if self._termination is not None and self._termination.came is not None:
            raise SystemExit(128 + self._termination.came)

    async def close(self) -> None:
        """Stop all robots (unless ``keep_moving``) and close their links, all at the same time. Safe to repeat."""
        try:
            ends = await asyncio.gather(*(robot.close() for robot in self._robots), return_exceptions=True)
        finally:
            if self._termination is not None:
                await self._termination.leave()
        for end in ends:
            if end is not None:
                raise end

    def __enter__(self) -> NoReturn:
        raise ArgumentError(
            "a swarm needs an event loop, and a plain 'with' does not have one",
            hint="write async with elib.swarm(...) as robots: ... in an async function, or elib.swarm(...).run(main)",
        )

    def __exit__(self, *_: object) -> None: ...

    def run(self, main: Callable[[Self], Awaitable[T]]) -> T:
        """Open the robots on an event loop of their own, run ``async def main(robots)`` and stop them.

        The loop runs at the speed of the URLs: with ``speed=max`` in simulated time.

        Raises:
            ArgumentError: The URLs ask for different speeds.
        """
        speeds = {speed_of(url) for url in self._urls}
        if len(speeds) > 1:
            asked = " and ".join(sorted(map(str, speeds)))
            raise ArgumentError(f"the robots ask for different speeds, {asked}", hint="one event loop has one speed")

        async def open_and_run() -> T:
            async with self:
                try:
                    return await main(self)
                except asyncio.CancelledError:
                    for link in self._links:  # Ctrl-C and signals stop them even with keep_moving
                        link.keep_moving = False
                    raise

        return run_coroutine(open_and_run, speeds.pop())

    def _make_links(self) -> list[Link]:
        urls = [robot for url in self._urls for robot in robots_of(url)]
        names = default_names(urls) if self._given_names is None else self._given_names
        if len(names) != len(urls):
            raise ArgumentError(f"there are {len(names)} names for {len(urls)} robots")
        return [Link(str(url), name, self._settings) for url, name in zip(urls, names, strict=True)]

    async def _open(self) -> None:
        limit = asyncio.Semaphore(OPENING_AT_ONCE)

        async def open_one(robot: Epuck) -> None:
            async with limit:
                await robot

        results = await in_parallel(self._robots, open_one, fail_fast=True)
        errors = {name: error for name, error in results.items() if error is not None}
        if errors:
            raise_first(errors)


def swarm(
    urls: str | Iterable[str] | None = None,
    *,
    names: Iterable[str] | None = None,
    keep_moving: bool = False,
    firmware: str | None = None,
    mounting: Mounting | None = None,
    reconnecting: bool = False,
    watchdog: bool | None = None,
) -> Swarm:
    """Return several robots: ``async with elib.swarm("sim://crowd?robots=20") as robots: ...``.

    Each robot has a link, a session, a name and statistics of its own.

    Args:
        urls: One URL or several. The URL of a world with several robots opens all of them, in the same world and time.
            Without a URL, the environment variable ``ELIB_ROBOT`` names the robots.
        names: Names of the robots, in order. By default virtual robots are ``epuck-1``, ``epuck-2``, ..., and others
            are named by their port or address.
        keep_moving: Leave the wheels turning when the block ends.
        firmware: Use this firmware's profile whatever the robots answer.
        mounting: How the robots' cameras are mounted, if they differ from the firmware's usual way.
        watchdog: Let a small process stop the robots when this program dies, or freezes for half a second;
            unless given, only ``elib run`` does.
        reconnecting: Reopen links that are lost, as :func:`elib.reconnecting` does by default.

    Raises:
        ArgumentError: A URL or the names are wrong, or the firmware does not exist.
        Unsupported: This system does not support the watchdog.

    Example:
        >>> async def main(robots):
        ...     return await robots.all.selector()
        >>> elib.swarm("sim://crowd?robots=2&speed=max").run(main)
        {'epuck-1': Selector(position=3), 'epuck-2': Selector(position=3)}
    """
    given = [urls] if isinstance(urls, str) else None if urls is None else list(urls)
    if given == []:
        raise ArgumentError("a swarm needs a robot", hint='try elib.swarm("sim://arena?robots=3"), or a list of URLs')
    chosen = None if names is None else tuple(names)
    if chosen is not None and len(set(chosen)) < len(chosen):
        raise ArgumentError(f"two robots have the same name: {', '.join(chosen)}")
    settings = LinkSettings(
        keep_moving=keep_moving,
        firmware=firmware,
        mounting=mounting,
        policy=Policy() if reconnecting else None,
        watchdog=watchdog,
    )
    return Swarm(tuple(map(parse_url, choose_robots(given or ()))), chosen, settings)


def default_names(urls: Sequence[Url]) -> tuple[str, ...]:
    """Return a name for each robot: ``epuck-N`` for a simulated robot, otherwise the last part of its URL's target.

    Raises:
        ArgumentError: A URL is given twice.
    """
    numbers = [url.keys.get("robot", "") for url in urls if url.scheme in VIRTUAL]
    if "" in numbers or len(set(numbers)) < len(numbers):  # several worlds: number all robots
        numbers = [str(number) for number, _ in enumerate(numbers, 1)]
    left = iter(numbers)
    short = [
        f"epuck-{next(left)}" if url.scheme in VIRTUAL else url.target.rstrip("/").rpartition("/")[2] for url in urls
    ]
    uses = Counter(short)
    names = tuple(str(url) if uses[name] > 1 else name for url, name in zip(urls, short, strict=True))
    name, count = max(Counter(names).items(), key=lambda item: item[1])
    if count > 1:
        raise ArgumentError(f"{name} is given twice", hint="each robot has one connection")
    return names
