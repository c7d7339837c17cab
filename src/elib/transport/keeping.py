"""Who means to come back: a simulation that outlives its connections, as a real robot does."""

from __future__ import annotations

import asyncio
import contextlib
import weakref
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from elib.transport.url import Url, parse_url


@dataclass(slots=True, eq=False)
class Stay:
    """A wish that what a URL names stays as it is.

    Attributes:
        holders: How many have it.
        endings: Called when the last one gives it up.
    """

    holders: int = 0
    endings: list[Callable[[], None]] = field(default_factory=list)


_STAYS: weakref.WeakKeyDictionary[asyncio.AbstractEventLoop, dict[str, Stay]] = weakref.WeakKeyDictionary()


@contextlib.contextmanager
def keep(url: Url | str) -> Iterator[None]:
    """Let a simulation outlive its connections while the block lasts; other robots do so anyway.

    Whoever opens *url* anew on the running event loop meets the robot and the world of the last connection, however
    that one ended. At the end of the block a simulation that nobody is connected to ends.

    Args:
        url: What is opened again and again. Where several robots of one event loop come and go, give each a URL of
            its own, by its seed or by its number in a world they share: of several that could be meant, the one lost
            first is met first.

    Raises:
        ArgumentError: The URL cannot be.
        RuntimeError: No event loop runs.
    """
    key = key_of(url)
    stays = _STAYS.setdefault(asyncio.get_running_loop(), {})
    stay = stays.setdefault(key, Stay())
    stay.holders += 1
    try:
        yield
    finally:
        stay.holders -= 1
        if not stay.holders:
            del stays[key]
            for ending in tuple(stay.endings):  # each takes itself off
                ending()


def stay_of(url: Url | str, loop: asyncio.AbstractEventLoop) -> Stay | None:
    """Return the wish that *url* stays, if somebody on *loop* has it."""
    return _STAYS.get(loop, {}).get(key_of(url))


def key_of(url: Url | str) -> str:
    """Return what two ways to write the same URL have in common."""
    return str(parse_url(url) if isinstance(url, str) else url)
