"""Leases on URLs: a simulation outlives its connections as long as its URL is leased, as a real robot does."""

from __future__ import annotations

import asyncio
import contextlib
import weakref
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from elib.link.transport.url import Url, parse_url


@dataclass(slots=True, eq=False)
class UrlLease:
    """A lease on one URL."""

    holders: int = 0  # how many blocks hold the lease
    on_end: list[Callable[[], None]] = field(default_factory=list)  # called when the last holder gives it up


_LEASES: weakref.WeakKeyDictionary[asyncio.AbstractEventLoop, dict[str, UrlLease]] = weakref.WeakKeyDictionary()


@contextlib.contextmanager
def lease(url: Url | str) -> Iterator[None]:
    """Let a simulation outlive its connections while the block lasts; other robots do so anyway.

    A program that opens *url* again on the running event loop finds the robot and the world of the last connection,
    however that connection ended. At the end of the block, a simulation without a connection ends.

    Args:
        url: The URL that is opened again and again. If several robots of one event loop come and go, give each its
            own URL, by its seed or by its number in the world they share. Otherwise the robot whose link was lost
            first is opened first.

    Raises:
        ArgumentError: The URL is wrong.
        RuntimeError: No event loop runs.
    """
    key = _key(url)
    leases = _LEASES.setdefault(asyncio.get_running_loop(), {})
    held = leases.setdefault(key, UrlLease())
    held.holders += 1
    try:
        yield
    finally:
        held.holders -= 1
        if not held.holders:
            del leases[key]
            for end in tuple(held.on_end):  # each removes itself
                end()


def lease_of(url: Url | str, loop: asyncio.AbstractEventLoop) -> UrlLease | None:
    """Return the lease on *url* on *loop*, or None if there is none."""
    return _LEASES.get(loop, {}).get(_key(url))


def _key(url: Url | str) -> str:
    """Return what two ways to write the same URL have in common."""
    return str(parse_url(url) if isinstance(url, str) else url)
