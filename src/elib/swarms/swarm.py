"""``elib.swarm(url or urls)``: robots that are opened and closed together."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Awaitable, Callable, Generator, Iterable, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, NoReturn, Self, TypeVar

from elib.errors import ArgumentError, LinkClosed
from elib.protocol.context import Profile
from elib.protocol.image import Mounting, check_mounting
from elib.protocol.profiles import profile_named
from elib.robot.aio import Epuck, Link
from elib.robot.reconnect import Policy
from elib.robot.running import run_coroutine
from elib.robot.signals import Termination
from elib.swarms.fanout import in_parallel, raise_first
from elib.swarms.group import Group
from elib.transport import Url, parse_url, robots_of, speed_of

T = TypeVar("T")

OPENING_AT_ONCE = 7
"""Robots that are opened at the same time: as many links as one Bluetooth radio holds (active slaves of a piconet)."""


@dataclass(frozen=True, slots=True)
class Plan:
    """What a swarm is made from.

    Attributes:
        urls: As given; each may name several robots.
        names: Of all robots, in order; None for those that their URLs suggest.
        keep_moving: Leave the wheels turning when the block ends.
        profile: Of all robots, whatever they answer; None asks each.
        mounting: How their cameras sit, where the profile's guess is wrong.
        policy: How links are reopened; None does not.
        watchdog: Let a small process stop the robots when this program dies or freezes.
    """

    urls: tuple[Url, ...]
    names: tuple[str, ...] | None
    keep_moving: bool
    profile: Profile | None
    mounting: Mounting | None
    policy: Policy | None
    watchdog: bool = False

    def links(self) -> list[Link]:
        """Return what opens each robot.

        Raises:
            ArgumentError: There are not as many names as robots, or a URL is there twice.
            LinkNotFound: There is no such world.
            SimulationError: The world's file breaks a rule, or it has no robot.
        """
        urls = [robot for url in self.urls for robot in robots_of(url)]
        names = default_names(urls) if self.names is None else self.names
        if len(names) != len(urls):
            raise ArgumentError(f"there are {len(names)} names for {len(urls)} robots")
        return [
            Link(str(url), name, self.keep_moving, self.profile, self.mounting, self.policy, watchdog=self.watchdog)
            for url, name in zip(urls, names, strict=True)
        ]


class Swarm(Group):
    """Robots that are opened and closed together; make it with :func:`elib.swarm`, use it as ``async with``.

    Leaving the block stops all robots at the same time, whatever ended it, unless ``keep_moving`` was set. A robot
    that does not answer any more keeps none of the others from being stopped.
    """

    def __init__(self, plan: Plan) -> None:
        super().__init__(())
        self._plan = plan
        self._links: list[Link] = []
        self._termination: Termination | None = None

    # -- opening and closing --

    async def __aenter__(self) -> Self:
        if self._termination is not None:
            raise LinkClosed("this swarm was opened before", hint="a swarm lives once: call elib.swarm() again")
        self._termination = Termination()
        try:
            self._links = self._plan.links()
            self._robots = tuple(Epuck(link) for link in self._links)
            await self._open()
        except BaseException:
            await self.close()
            raise
        return self

    def __await__(self) -> Generator[Any, None, Self]:
        return self.__aenter__().__await__()

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()
        if self._termination is not None and self._termination.came is not None:
            raise SystemExit(128 + self._termination.came)

    async def close(self) -> None:
        """Stop all robots (unless ``keep_moving``) and free their links, all at the same time. Safe to repeat."""
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
            "a swarm lives in an event loop, and a plain 'with' has none",
            hint="write async with elib.swarm(...) as robots: ... in an async function, or elib.swarm(...).run(main)",
        )

    def __exit__(self, *_: object) -> None: ...

    def run(self, main: Callable[[Self], Awaitable[T]]) -> T:
        """Open the robots on an event loop of their own, run ``async def main(robots)`` and stop them.

        The loop runs at the speed of the URLs: with ``speed=max`` in simulated time.

        Raises:
            ArgumentError: The URLs ask for different speeds.
        """
        speeds = {speed_of(url) for url in self._plan.urls}
        if len(speeds) > 1:
            asked = " and ".join(sorted(map(str, speeds)))
            raise ArgumentError(f"the robots ask for different speeds, {asked}", hint="one event loop has one speed")

        async def whole() -> T:
            async with self:
                try:
                    return await main(self)
                except asyncio.CancelledError:
                    for link in self._links:  # Ctrl-C and signals stop them all the same
                        link.keep_moving = False
                    raise

        return run_coroutine(whole, speeds.pop())

    async def _open(self) -> None:
        gate = asyncio.Semaphore(OPENING_AT_ONCE)

        async def open_one(robot: Epuck) -> None:
            async with gate:
                await robot

        found = await in_parallel(self._robots, open_one, together=True)
        errors = {name: outcome for name, outcome in found.items() if outcome is not None}
        if errors:
            raise_first(errors)


def swarm(
    urls: str | Iterable[str],
    *,
    names: Iterable[str] | None = None,
    keep_moving: bool = False,
    firmware: str | None = None,
    mounting: Mounting | None = None,
    reconnecting: bool = False,
    watchdog: bool = False,
) -> Swarm:
    """Return several robots: ``async with elib.swarm("sim://crowd?robots=20") as robots: ...``.

    Each has a link, a session, a name and statistics of its own.

    Args:
        urls: One URL or several. One that names a world of several robots opens them all, in the same world and time.
        names: Of the robots, in order. Unless given, virtual robots are ``epuck-1``, ``epuck-2``, ..., and others are
            called by their port or address.
        keep_moving: Leave the wheels turning when the block ends.
        firmware: Use this firmware's profile whatever the robots answer.
        mounting: How the robots' cameras sit, where the firmware's usual way is wrong.
        watchdog: Let a small process stop the robots when this program dies, or freezes for half a second.
        reconnecting: Reopen links that are lost, as :func:`elib.reconnecting` does by default.

    Raises:
        ArgumentError: A URL or the names cannot be, or there is no such firmware.
    """
    listed = [urls] if isinstance(urls, str) else list(urls)
    if not listed:
        raise ArgumentError("a swarm needs a robot", hint='try elib.swarm("sim://arena?robots=3"), or a list of URLs')
    called = None if names is None else tuple(names)
    if called is not None and len(set(called)) < len(called):
        raise ArgumentError(f"two robots have the same name: {', '.join(called)}")
    return Swarm(
        Plan(
            tuple(map(parse_url, listed)),
            called,
            keep_moving,
            None if firmware is None else profile_named(firmware),
            check_mounting(mounting),
            Policy() if reconnecting else None,
            watchdog,
        )
    )


def default_names(urls: Sequence[Url]) -> tuple[str, ...]:
    """Return a name for each robot: ``epuck-N`` of a simulated one, else the last part of what its URL opens.

    Raises:
        ArgumentError: A URL is there twice.
    """
    numbers = [url.keys.get("robot", "") for url in urls if url.scheme == "sim"]
    if "" in numbers or len(set(numbers)) < len(numbers):  # of several worlds: they count through
        numbers = [str(number) for number, _ in enumerate(numbers, 1)]
    left = iter(numbers)
    short = [
        f"epuck-{next(left)}" if url.scheme == "sim" else url.target.rstrip("/").rpartition("/")[2] for url in urls
    ]
    uses = Counter(short)
    names = tuple(str(url) if uses[name] > 1 else name for url, name in zip(urls, short, strict=True))
    name, count = max(Counter(names).items(), key=lambda item: item[1])
    if count > 1:
        raise ArgumentError(f"{name} is given twice", hint="each robot has one connection")
    return names
