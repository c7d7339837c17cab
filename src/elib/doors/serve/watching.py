"""Readings for watchers: read once and encoded once for all who watch the same, and only the newest for each."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import msgspec

from elib.base.errors import ElibError, LinkClosed
from elib.doors.serve.answers import Readings
from elib.doors.serve.values import all_plain
from elib.link.protocol.image import Image
from elib.link.protocol.values import Reading
from elib.panel.panel import Panel
from elib.panel.slot import Phase, Slot
from elib.robot.snapshot import WATCHABLE
from elib.simulator.emulator.control_server import time_factor

AGAIN = 0.2
"""s until a robot is asked again whose link was down, or whose answers did not come."""

What = tuple[str, tuple[str, ...], float]
"""Key of the robot, names of the readings, and messages a second."""


class Watcher(Protocol):
    """One who watches."""

    @property
    def is_behind(self) -> bool:
        """Whether it has not taken yet what it was sent before."""
        ...

    async def send(self, data: bytes) -> None:
        """Send it a message; it does not wait for anything."""
        ...

    async def end_watch(self, what: What, error: ElibError) -> None:
        """End its watch, because there is nothing more to be read."""
        ...


class Broadcast:
    """The readings of one robot at one rate, for all who watch them.

    Args:
        panel: The robots.
        what: What is watched.

    Attributes:
        missed: How many messages each watcher has missed so far, because it did not take the one before.
    """

    def __init__(self, panel: Panel, what: What) -> None:
        self.missed: dict[Watcher, int] = {}
        self._panel, self._what = panel, what
        self._task = asyncio.get_running_loop().create_task(self._run(), name="elib serve watches")

    def end(self) -> None:
        """Watch no more."""
        self._task.cancel()

    async def _run(self) -> None:
        key, names, rate = self._what
        while (slot := self._panel.slots.get(key)) is not None and slot.phase not in (Phase.DISCONNECTED, Phase.FAILED):
            try:
                if slot.is_playing:
                    await self._sample(slot, names, rate)
                elif slot.is_connected:
                    async with slot.robot.watch(*names, rate=rate) as snapshots:
                        async for snapshot in snapshots:
                            await self._tell(snapshot.time, snapshot.readings)
            except ElibError:
                pass  # the event log says what happened; the watch goes on when the link is back
            await asyncio.sleep(AGAIN * time_factor())
        error = None if slot is None else slot.error
        over = LinkClosed(f"robot {key} is not connected any more, and nothing can be read")
        for watcher in tuple(self.missed):
            await watcher.end_watch(self._what, error or over)

    async def _sample(self, slot: Slot, names: Sequence[str], rate: float) -> None:
        """Tell what a recording shows while it is played."""
        while slot.is_playing:
            readings = {name: slot.readings[name] for name in names or WATCHABLE if name in slot.readings}
            if readings:
                await self._tell(slot.now, readings)
            await asyncio.sleep(time_factor() / rate)

    async def _tell(self, time: float, readings: Mapping[str, Reading | Image]) -> None:
        told = Readings(robot=self._what[0], time=round(time, 6), readings=all_plain(readings), missed=0)
        # The count differs between watchers, so it comes last; the rest is encoded once.
        beginning = msgspec.json.encode(told).removesuffix(b"0}")
        for watcher, missed in tuple(self.missed.items()):
            if watcher.is_behind:
                self.missed[watcher] = missed + 1
            else:
                await watcher.send(b"%b%d}" % (beginning, missed))


class Broadcasts:
    """All broadcasts of a door; each lasts as long as somebody watches it.

    Args:
        panel: The robots.
    """

    def __init__(self, panel: Panel) -> None:
        self._panel = panel
        self._running: dict[What, Broadcast] = {}

    def join(self, watcher: Watcher, what: What) -> Callable[[], None]:
        """Let *watcher* watch; the returned function ends that."""
        broadcast = self._running.get(what)
        if broadcast is None:
            broadcast = self._running[what] = Broadcast(self._panel, what)
        broadcast.missed[watcher] = 0

        def leave() -> None:
            broadcast.missed.pop(watcher, None)
            if not broadcast.missed and self._running.get(what) is broadcast:
                del self._running[what]
                broadcast.end()

        return leave
