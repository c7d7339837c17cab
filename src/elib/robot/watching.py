"""``robot.watch()``: snapshots as they come, for ``async for`` and for plain ``for``."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Collection
from types import TracebackType
from typing import Self

from elib.errors import LinkError
from elib.robot.portal import KeepAlive, Portal
from elib.robot.snapshot import Snapshot, period_of, watched_names
from elib.robot.telemetry import Reader, Telemetry
from elib.session import Robot

RATE = 20.0
"""Hz, unless told otherwise: all sensors of an e-puck1 take 12 ms of line, and Bluetooth adds some 20 ms."""


class Watch:
    """Snapshots as they come: ``async for snapshot in robot.watch("proximity"): ...``.

    It keeps one snapshot, the newest; those that were not fetched in time are counted in ``snapshot.dropped``. The
    subscription begins with the loop and ends with it, by ``break`` too, when nothing else refers to this object. To be
    sure in every Python, or to go on later, hold it in a block::

        async with robot.watch("proximity", "image", rate=10) as snapshots:
            async for snapshot in snapshots:
                ...
    """

    def __init__(self, telemetry: Telemetry, robot: Robot, names: tuple[str, ...], period: float) -> None:
        self._reader: Reader | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._telemetry = telemetry
        self._robot = robot
        self._is_closed = False
        self.names = names
        """The readings, in the order of :class:`~elib.Sensors`, ``image`` last."""
        self.period = period
        """s between two snapshots, where the link is fast enough."""

    def __aiter__(self) -> Self:
        self._begin()
        return self

    async def __anext__(self) -> Snapshot:
        snapshot = await self.take()
        if snapshot is None:
            raise StopAsyncIteration
        return snapshot

    async def __aenter__(self) -> Self:
        self._begin()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.aclose()

    async def take(self) -> Snapshot | None:
        """Wait for the next snapshot; None after the end.

        Raises:
            LinkError: The link is closed or lost; raised once.
            ReplyTimeout: Some reading did not come within 5 s of the beginning.
            ElibError: The robot refuses to give one.
        """
        self._begin()
        reader = self._reader
        if reader is None:
            return None
        while reader.newest is None and not reader.is_over:
            reader.arrived.clear()
            await reader.arrived.wait()
        snapshot, reader.newest = reader.newest, None
        if snapshot is None and reader.error is not None:
            error, reader.error = reader.error, None
            if isinstance(error, LinkError):
                # Each reader raises one of its own: a shared one would collect everybody's tracebacks.
                raise type(error)(error.message, hint=error.hint) from error
            raise error
        return snapshot

    async def aclose(self) -> None:
        """End the subscription. Safe to repeat."""
        self._is_closed = True
        reader, self._reader = self._reader, None
        if reader is not None:
            self._telemetry.leave(reader)

    def _begin(self) -> None:
        if self._reader is None and not self._is_closed:
            self._loop = asyncio.get_running_loop()
            self._reader = self._telemetry.join(self._robot, self.names, self.period)

    def __del__(self) -> None:
        reader, loop = self._reader, self._loop
        if reader is not None and loop is not None:
            with contextlib.suppress(RuntimeError):  # a closed loop polls no more
                loop.call_soon_threadsafe(self._telemetry.leave, reader)


class BlockingWatch:
    """Snapshots as they come, for ordinary code: ``for snapshot in robot.watch("proximity"): ...``.

    The poller goes on while the loop's body works, and ends when the loop is left, by ``break`` too, unless something
    else refers to this object; ``with robot.watch(...) as snapshots:`` ends it for sure.
    """

    def __init__(self, watch: Watch, portal: Portal, keep_alive: KeepAlive | None) -> None:
        self._keep_alive = keep_alive
        self._watch = watch
        self._portal = portal
        self.names = watch.names
        """The readings, in the order of :class:`~elib.Sensors`, ``image`` last."""
        self.period = watch.period
        """s between two snapshots, where the link is fast enough."""

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> Snapshot:
        snapshot = self._portal.call(self._watch.take())
        if snapshot is None:
            raise StopIteration
        return snapshot

    def __enter__(self) -> Self:
        self._portal.call(self._watch.__aenter__())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the subscription. Safe to repeat."""
        if not self._portal.is_closed:
            self._portal.call(self._watch.aclose())


def watch(telemetry: Telemetry, robot: Robot, names: Collection[str], rate: float) -> Watch:
    """Return a watch that has not begun yet.

    Raises:
        ArgumentError: There is no such reading, or the rate cannot be.
        Unsupported: The firmware has not got a reading.
    """
    return Watch(telemetry, robot, watched_names(names, robot.context.profile), period_of(rate))
