"""``elib.wait()`` waits for one, or for all, of several calls that were begun."""

from __future__ import annotations

import concurrent.futures
import contextlib
from collections.abc import Iterable
from typing import Any, TypeVar, cast

from elib.base.errors import ArgumentError, LinkClosed
from elib.base.timebase import host
from elib.link.protocol.styles import Pending
from elib.link.session import check_timeout
from elib.robot.portal import CLOSING_TIME, HOLDING_TIME, AnyFuture, Portal, ended

P = TypeVar("P", bound=Pending[Any])

TURN = 0.02
"""s of robot time for which one of several robots goes on before the next one, where there is one thread."""


def wait(calls: Iterable[P], *, first: bool = False, timeout: float | None = None) -> tuple[list[P], list[P]]:
    """Wait until all calls that were begun have ended, whatever their outcome; no call's error is raised here.

    ::

        calls = [robot.begin.proximity(), robot.begin.selector()]
        done, pending = elib.wait(calls, first=True)

    The calls may belong to several robots. A robot with a simulated time of its own goes on with its calls while the
    program waits for another one.

    Args:
        calls: What ``robot.begin...`` returned.
        first: Wait only until one of them has ended.
        timeout: Robot time after which to stop waiting, s; the calls go on. With several robots, each of their clocks
            must show that it has passed.

    Returns:
        The calls that have ended, and those that have not, each in the order given.

    Raises:
        ArgumentError: *calls* holds something else than a begun call, or *timeout* is not from 0 to 3600.

    Example:
        >>> calls = [robot.begin.image(), robot.begin.selector()]
        >>> done, pending = elib.wait(calls)
        >>> len(done), len(pending)
        (2, 0)
    """
    every = list(calls)
    if timeout is not None:
        check_timeout(timeout)
    left: dict[Portal, set[AnyFuture]] = {}
    for call in map(_checked, every):
        if not call.done():
            left.setdefault(cast("Portal", call._portal), set()).add(call._future)
    if left and not (first and any(call.done() for call in every)):
        _wait(left, first, timeout)
    return [call for call in every if call.done()], [call for call in every if not call.done()]


def _checked(call: object) -> Pending[Any]:
    if not isinstance(call, Pending):
        raise ArgumentError(f"elib.wait() takes calls that were begun, not {call!r}", hint="robot.begin.proximity()")
    return call


def _wait(left: dict[Portal, set[AnyFuture]], first: bool, timeout: float | None) -> None:
    """Wait for calls, by the portals of their robots."""
    if len(left) == 1:
        ((portal, futures),) = left.items()
        try:
            portal.call(ended(futures, first=first, timeout=timeout))
        except LinkClosed:
            concurrent.futures.wait(futures, CLOSING_TIME)  # the robot is being closed, which ends all its calls
        return
    if host() is not None:
        _take_turns(left, first, timeout)
        return
    over: list[AnyFuture] = []
    with contextlib.ExitStack() as stay:
        for portal, futures in left.items():
            stay.enter_context(portal.lent())
            with contextlib.suppress(LinkClosed):  # it is being closed, which ends all its calls
                over.append(portal.begin(ended(futures, first=first, timeout=timeout)))
                stay.callback(over[-1].cancel)
        pending = set(over)
        while pending := concurrent.futures.wait(pending, HOLDING_TIME, concurrent.futures.FIRST_COMPLETED).not_done:
            if first and any(future.done() for futures in left.values() for future in futures):
                break
            for portal in left:
                portal.check()


def _take_turns(left: dict[Portal, set[AnyFuture]], first: bool, timeout: float | None) -> None:
    """Wait where there is one thread: the clock of each robot goes on by a short while in turn."""
    times = {portal: portal.loop.time() for portal in left}
    while any(futures for futures in left.values()):
        for portal, futures in left.items():
            if futures:
                portal.call(ended(futures, first=first, timeout=TURN))
                is_over = timeout is not None and portal.loop.time() - times[portal] >= timeout
                left[portal] = set() if is_over else {each for each in futures if not each.done()}
                if first and len(left[portal]) < len(futures) and not is_over:
                    return
