"""``elib.wait()`` waits for one, or for all, of several calls that were begun."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
from collections.abc import Iterable, Sequence
from typing import Any, TypeVar, cast

from elib.base.errors import ArgumentError, LinkClosed
from elib.link.protocol.styles import Pending
from elib.link.session import check_timeout
from elib.robot.portal import CLOSING_TIME, HOLDING_TIME, Portal

P = TypeVar("P", bound=Pending[Any])


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
    begun = [_checked(call) for call in every]
    left = {call._future for call in begun if not call.done()}
    if left and not (first and len(left) < len({call._future for call in begun})):
        portals = dict.fromkeys(call._portal for call in begun if not call.done())
        _wait(left, cast("list[Portal]", list(portals)), first, timeout)
    return [call for call in every if call.done()], [call for call in every if not call.done()]


def _checked(call: object) -> Pending[Any]:
    if not isinstance(call, Pending):
        raise ArgumentError(f"elib.wait() takes calls that were begun, not {call!r}", hint="robot.begin.proximity()")
    return call


def _wait(
    left: set[concurrent.futures.Future[Any]], portals: Sequence[Portal], first: bool, timeout: float | None
) -> None:
    over: concurrent.futures.Future[None] = concurrent.futures.Future()
    expiries: set[concurrent.futures.Future[None]] = set()

    def end(future: concurrent.futures.Future[Any], those: set[concurrent.futures.Future[Any]]) -> None:
        those.discard(future)
        if (first and those is left) or not those:
            with contextlib.suppress(concurrent.futures.InvalidStateError):  # it ended before
                over.set_result(None)

    for future in tuple(left):
        future.add_done_callback(lambda future: end(future, left))
    if len(portals) == 1:
        try:
            portals[0].wait(over, timeout)
        except TimeoutError:
            pass
        except LinkClosed:
            concurrent.futures.wait([over], CLOSING_TIME)  # the robot is being closed, which ends all its calls
        return
    if timeout is not None:
        for portal in portals:
            with contextlib.suppress(LinkClosed):  # it is being closed, which ends all its calls
                expiries.add(portal.begin(asyncio.sleep(timeout)))
        for expiry in tuple(expiries):
            expiry.add_done_callback(lambda expiry: end(expiry, expiries))
    with contextlib.ExitStack() as stay:
        for portal in portals:
            stay.enter_context(portal.lent())
        for expiry in tuple(expiries):
            stay.callback(expiry.cancel)
        while not over.done():
            concurrent.futures.wait([over], HOLDING_TIME)
            for portal in portals:
                portal.check()
