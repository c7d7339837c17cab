"""``robot.watch()``: snapshots of the readings at a steady rate, and the poller that all watchers of a robot share.

The poller begins with the first reader and ends with the last. It asks for what its readers want next in one request
where the firmware supports it, and never has more than one request in the session's queue: a command of the program
waits for one poll at most, however slow the link is. Ticks stand on a fixed grid; those that pass while an answer is
awaited are skipped, so on a slow link the rate falls by itself.

A robot on Wi-Fi is not polled: it streams, and its packets are delivered as they come.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Self

from elib.base.errors import ElibError, LinkClosed, LinkError, ReplyTimeout
from elib.link.protocol.commands import SPECS
from elib.link.protocol.image import Image
from elib.link.protocol.values import Reading, Sensors
from elib.link.session import Ending, Pushed, Robot, TraceEvent
from elib.robot.polling import polls
from elib.robot.portal import KeepAlive, Portal
from elib.robot.snapshot import IMAGE, SENSORS, Snapshot

RATE = 20.0
"""Hz, the default: all sensors of an e-puck1 take 12 ms of line, and Bluetooth adds some 20 ms."""
POLL_TIMEOUT = 1.0
"""s that a poll waits for its answer, as ``sensors()`` does."""
PICTURE_PAUSE = 0.05
"""s between two pictures, for other calls: a robot that sends a picture does nothing else (wire-protocol.md, 3.2)."""
PACKET_PERIOD = 0.02
"""s between two sensor packets over Wi-Fi at least (wire-protocol.md, 4.4): the nearest one is that of a tick."""
FIRST_TIME = 5.0
"""s within which every reading must have come once; longer than the robot is busy when it calibrates (3.7 s)."""


@dataclass(slots=True, eq=False)
class Reader:
    """One subscription, with room for one snapshot, the newest."""

    names: tuple[str, ...]
    period: float
    began: float
    due: float
    sequence: int = 0
    dropped: int = 0
    newest: Snapshot | None = None
    error: BaseException | None = None
    is_over: bool = False
    arrived: asyncio.Event = field(default_factory=asyncio.Event)

    @property
    def sensors(self) -> tuple[str, ...]:
        """The sensors among its readings."""
        return tuple(name for name in self.names if name != IMAGE)

    def put(self, time: float, origin: str, readings: dict[str, Reading | Image], error: ElibError | None) -> None:
        """Put a snapshot in the place of one that was not fetched."""
        self.dropped += self.newest is not None
        self.newest = Snapshot(
            time=time,
            origin=origin,
            sequence=self.sequence,
            dropped=self.dropped,
            period=self.period,
            readings=readings,
            error=error,
        )
        self.sequence += 1
        self.arrived.set()

    def end(self, error: BaseException | None) -> None:
        """End the subscription, with *error* if there is one, after a snapshot that was not fetched yet."""
        if not self.is_over:
            self.is_over = True
            self.error = error
            self.arrived.set()

    def skip_to(self, now: float) -> None:
        """Set the next tick: the first one of its grid after *now*."""
        self.due += self.period * (max(0, math.floor((now - self.due) / self.period)) + 1)


class Telemetry:
    """The readers of one robot and the task that polls for them."""

    def __init__(self) -> None:
        self._readers: list[Reader] = []
        self._task: asyncio.Task[None] | None = None
        self._changed = asyncio.Event()
        self._newcomer = False
        self._anchor = 0.0
        self._latest: dict[str, Reading | Image] = {}
        self._failures: dict[str, ElibError] = {}
        self._came: set[str] = set()
        """What came since the last look, from a robot that streams."""
        self._picture_free = -math.inf

    def join(self, robot: Robot, names: tuple[str, ...], period: float) -> Reader:
        """Begin a subscription."""
        now = asyncio.get_running_loop().time()
        reader = Reader(names, period, now, now)
        self._readers.append(reader)
        self._newcomer = True
        self._changed.set()
        if self._task is None:
            self._task = asyncio.create_task(self._run(robot), name="elib telemetry")
        return reader

    def leave(self, reader: Reader) -> None:
        """End a subscription; with the last one the poller ends, after the answer it may be waiting for."""
        reader.end(None)
        if reader in self._readers:
            self._readers.remove(reader)
            self._changed.set()

    async def close(self) -> None:
        """End every subscription with LinkClosed, and the poller. Call it when the session is closed."""
        self._end(LinkClosed("the robot was closed while it was watched"))
        task = self._task
        if task is not None:
            task.cancel()
            await asyncio.wait([task])

    # -- the poller --

    async def _run(self, robot: Robot) -> None:
        try:
            if robot.context.profile.codec == "wifi":
                await self._follow(robot)
            while await self._tick():
                await self._serve(robot)
        except asyncio.CancelledError:
            self._end(LinkClosed("the robot's event loop ended while it was watched"))
            raise
        except Exception as error:
            self._end(error)
        finally:
            self._task = None
            self._latest.clear()
            self._failures.clear()

    async def _follow(self, robot: Robot) -> None:
        """Deliver what a robot on Wi-Fi streams, until no reader is left."""

        def take(time: float, event: TraceEvent) -> None:
            if isinstance(event, Pushed):
                self._take(event.value, robot.context.origin)
            elif isinstance(event, Ending) and robot.session.error is not None:
                self._end(event.error)

        robot.session.hooks.append(take, Pushed, Ending)
        try:
            while self._readers:
                self._changed.clear()
                self._came.clear()
                images = any(IMAGE in reader.names for reader in self._readers)
                robot.session.stream(sensors=self._want_sensors, images=images)
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(_patience(robot)):
                        await self._changed.wait()
                        continue
                if getattr(robot.session.transport, "is_paused", False):
                    continue  # the world of a virtual robot stands still
                self._report_silence(robot)
                if not self._came:
                    await self._ask(robot)
        finally:
            robot.session.hooks.remove(take)
            robot.session.stream(sensors=None, images=False)

    async def _ask(self, robot: Robot) -> None:
        """Ask a robot that has become silent for something: if it takes no command either, the session gives it up."""
        try:
            await robot.execute(SPECS["selector"].request(robot.context), POLL_TIMEOUT)
        except ElibError as error:
            _raise_if_over(robot, error)

    def _report_silence(self, robot: Robot) -> None:
        """Tell the readers what did not come for a while: with the readings that they had, and the error."""
        missing = {name for reader in self._readers for name in reader.names if name not in self._came}
        for name in missing:
            what = "picture" if name == IMAGE else "sensor packet"
            self._failures[name] = ReplyTimeout(
                f"no {what} came from {robot.url} for {_patience(robot):g} s", request=f"watch({name})"
            )
        self._deliver([reader for reader in self._readers if missing.intersection(reader.names)], robot.context.origin)

    def _due_readers(self, now: float) -> list[Reader]:
        return [r for r in self._readers if r.sensors and r.due <= now + min(r.period, PACKET_PERIOD) / 2]

    def _want_sensors(self, time: float) -> bool:
        """Return whether a reader is due when a sensor packet has come; to decode every one would be a waste."""
        self._came.update(name for reader in self._readers for name in reader.sensors)
        return bool(self._due_readers(time))

    def _take(self, value: Sensors | Image, origin: str) -> None:
        """Take a packet: every picture is delivered, and the sensors as often as each reader asked for them."""
        now = asyncio.get_running_loop().time()
        if isinstance(value, Image):
            due = [reader for reader in self._readers if IMAGE in reader.names]
            self._latest[IMAGE] = value
            came = {IMAGE}
        else:
            due = self._due_readers(now)
            came = {name for reader in self._readers for name in reader.sensors}
            self._latest.update({name: getattr(value, name) for name in came})
        self._came |= came
        for name in came:
            self._failures.pop(name, None)
        self._deliver(due, origin, is_turn=not isinstance(value, Image))

    async def _tick(self) -> bool:
        """Wait for the next tick at which a reader is due; return False when no reader is left."""
        loop = asyncio.get_running_loop()
        served = loop.time()
        while self._readers:
            self._changed.clear()
            if self._newcomer:
                # A new reader should not wait for a tick; the grid moves, so that ticks do not become more frequent.
                self._newcomer = False
                self._anchor = loop.time()
                return True
            step = min(reader.period for reader in self._readers)
            due = min(reader.due for reader in self._readers)
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout_at(self._next(step, due, served)):
                    await self._changed.wait()
                    continue
            return True
        return False

    def _next(self, step: float, due: float, served: float) -> float:
        """Return the tick nearest to *due* that comes after *served*."""
        count = max(
            math.ceil((due - self._anchor) / step - 0.5 - 1e-6), math.floor((served - self._anchor) / step + 1e-6) + 1
        )
        return self._anchor + count * step

    async def _serve(self, robot: Robot) -> None:
        """Poll for the readers that are due, and give each its snapshot."""
        loop = asyncio.get_running_loop()
        now = loop.time()
        half = min(reader.period for reader in self._readers) / 2
        due = [reader for reader in self._readers if reader.due <= now + half]
        # Decided before the sensors are read: the first tick after a picture is left to other calls.
        is_picture_turn = now >= self._picture_free and any(IMAGE in reader.names for reader in due)
        names = {name for reader in due for name in reader.sensors}
        if names:
            await self._read(robot, tuple(name for name in SENSORS if name in names))
            self._deliver([reader for reader in due if reader.sensors], robot.context.origin)
        if is_picture_turn:
            await self._take_picture(robot)
            # Readers of both get a snapshot when the sensors are read; only the first one waits for the picture.
            self._deliver([r for r in due if IMAGE in r.names and not (r.sensors and r.sequence)], robot.context.origin)

    async def _read(self, robot: Robot, names: tuple[str, ...]) -> None:
        for poll in polls(names, robot.context):
            try:
                found = await robot.execute(poll.request, max(POLL_TIMEOUT, robot.session.stopping_time))
            except ElibError as error:
                _raise_if_over(robot, error)
                self._failures.update(dict.fromkeys(poll.names, error))
            else:
                self._latest.update(poll.readings(found))
                for name in poll.names:
                    self._failures.pop(name, None)

    async def _take_picture(self, robot: Robot) -> None:
        request = SPECS[IMAGE].request(robot.context)
        try:
            image = await robot.execute(request, request.timeout)
        except ElibError as error:
            _raise_if_over(robot, error)
            self._failures[IMAGE] = error
            image = error.image if isinstance(error, ReplyTimeout) else None
        else:
            self._failures.pop(IMAGE, None)
        finally:
            self._picture_free = asyncio.get_running_loop().time() + PICTURE_PAUSE
        if isinstance(image, Image):
            self._latest[IMAGE] = image

    def _deliver(self, readers: Collection[Reader], origin: str, *, is_turn: bool = True) -> None:
        """Give readers a snapshot. A picture that comes by itself is not a reader's turn: its sensors stay due."""
        now = asyncio.get_running_loop().time()
        for reader in readers:
            if is_turn:
                reader.skip_to(now)
            error = next((self._failures[name] for name in reader.names if name in self._failures), None)
            readings = {name: self._latest[name] for name in reader.names if name in self._latest}
            if len(readings) == len(reader.names):
                reader.put(now, origin, readings, error)
            elif error is not None and now - reader.began >= FIRST_TIME and reader in self._readers:
                self._readers.remove(reader)
                reader.end(error)

    def _end(self, error: BaseException) -> None:
        readers, self._readers = self._readers, []
        for reader in readers:
            reader.end(error)
        self._changed.set()


class Watch:
    """Snapshots as they come: ``async for snapshot in robot.watch("proximity"): ...``.

    It keeps one snapshot, the newest; ``snapshot.dropped`` counts those that were not fetched in time. The subscription
    begins with the loop and ends with it, also by ``break``, unless something else refers to this object. Use a block
    to end it at once in every Python, or to go on with it later::

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
        """Time between two snapshots on a link that is fast enough, s."""

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

    async def __aexit__(self, *_: object) -> None:
        await self.aclose()

    async def take(self) -> Snapshot | None:
        """Wait for the next snapshot; None after the end.

        Raises:
            LinkError: The link is closed or lost; raised once.
            ReplyTimeout: A reading did not come within 5 s of the beginning.
            ElibError: The robot refuses to give a reading.
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
                # Each reader raises an error of its own: a shared one would collect the tracebacks of all.
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
            with contextlib.suppress(RuntimeError):  # the loop is closed, and with it the poller
                loop.call_soon_threadsafe(self._telemetry.leave, reader)


class BlockingWatch:
    """Snapshots as they come, for blocking code: ``for snapshot in robot.watch("proximity"): ...``.

    The poller goes on while the body of the loop works. It ends when the loop is left, also by ``break``, unless
    something else refers to this object; ``with robot.watch(...) as snapshots:`` always ends it.
    """

    def __init__(self, watch: Watch, portal: Portal, keep_alive: KeepAlive | None) -> None:
        self._keep_alive = keep_alive
        self._watch = watch
        self._portal = portal
        self.names = watch.names
        """The readings, in the order of :class:`~elib.Sensors`, ``image`` last."""
        self.period = watch.period
        """Time between two snapshots on a link that is fast enough, s."""

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

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the subscription. Safe to repeat."""
        if not self._portal.is_closed:
            self._portal.call(self._watch.aclose())


def _patience(robot: Robot) -> float:
    """Return for how long a stream may be silent, s."""
    return max(POLL_TIMEOUT, robot.context.profile.patience)


def _raise_if_over(robot: Robot, error: ElibError) -> None:
    """Raise *error* if the link is lost for good; the link of a reconnecting robot may come back."""
    if isinstance(error, LinkError) and robot.session.error is not None:
        raise error
