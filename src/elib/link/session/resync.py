"""The resync, which brings a line that is out of sync into sync again.

It asks a question whose answer cannot be mistaken, the probe, and drops everything before that answer. Which questions
may be asked is decided in :class:`~elib.link.protocol.connection.HostConnection`; this module does the waiting.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable

from elib.base.errors import LinkLost
from elib.link.protocol.connection import HostConnection, OutOfQuestions, State
from elib.link.protocol.wifi_connection import WifiConnection

PICTURE_SILENCE = 0.1
"""s without a byte after which a late picture counts as ended; the rule of the 2011 library (wire-protocol.md, 3.2)."""
MAX_SILENCE_WAIT = 2.0
"""s to wait for a quiet line before a resync asks even if bytes keep coming."""
PAUSE = 0.02
"""s without a byte after which a robot with a small receive ring has taken what was sent to it, if it had the time."""
MAX_TEXT = 0.15
"""s that the robot takes to send an answer in text at most; what comes for longer is noise."""
PROBE_TIMES = (0.49, 0.49, 0.49, 0.49, 0.99, 0.99)
"""s that each probe waits at least. The first ones are short, so that a lost answer costs little. The numbers are not
round: a probe would often end at the same moment as a call, and a replay could take them in the other order."""
PROBE_TRIPS = 3
"""Round trips that each probe waits at least, for slow lines."""
MAX_TRIP = 1.0
"""s that count as a round trip at most. An answer that took longer was delayed by the link, or by a program that was
suspended meanwhile, and does not tell how long the next one takes."""
MARKER_TIME = 6.5
"""s that a marker over Wi-Fi may take to return at least. It may wait behind a picture, which takes up to 5.9 s
(measured-robots: latency.wifi_picture); the robot pauses for 1 s after a broken exchange between its processors
(wire-protocol.md, 4.4), and calibrates for 1.7 s."""
PAUSE_POLL = 0.1
"""s between two looks at a paused world."""
RESYNC_ROUNDS = 8
"""Resyncs in a row that are answered but leave the line out of sync, after which the link counts as lost."""
QUICK_ROUNDS = 6
"""Resyncs, of these, that ask at once. A fast link takes milliseconds for them, so the others wait for a quiet line."""


class Settling:
    """What brings the link of one session into sync again, and what it must know about the link.

    Args:
        url: Names the link in errors.
        is_paused: Tells whether the robot is a virtual one whose world stands still, so that no answer can come.
    """

    def __init__(self, url: str, is_paused: Callable[[], bool]) -> None:
        self._url = url
        self._is_paused = is_paused
        self._loop = asyncio.get_running_loop()
        self._answer = asyncio.Event()
        # when the newest byte was received, s on the loop's clock; the session sets it
        self.last_byte = self._loop.time()
        # when the newest bytes were sent, without probes, s on the loop's clock; the session sets it
        self.last_sent = -math.inf
        self.trip = 0.0  # how long the newest answer took, s, at most MAX_TRIP

    def record_trip(self, seconds: float) -> None:
        """Record how long an answer took."""
        self.trip = min(seconds, MAX_TRIP)

    def answered(self) -> None:
        """End the wait: what was waited for was received."""
        self._answer.set()

    async def _wait_out_pause(self) -> bool:
        """Wait until the world goes on; return whether it stood still."""
        was_paused = False
        while self._is_paused():  # no event says when it goes on
            was_paused = True
            await asyncio.sleep(PAUSE_POLL)
        return was_paused


class MarkerWait(Settling):
    """Over Wi-Fi: waits until the robot has taken every command that no caller waits for.

    Args:
        connection: Counts the markers that did not return.
        url: Names the link in errors.
        is_paused: Tells whether the robot is a virtual one whose world stands still.
    """

    def __init__(self, connection: WifiConnection, url: str, is_paused: Callable[[], bool] = lambda: False) -> None:
        super().__init__(url, is_paused)
        self._connection = connection

    async def run(self, following: Callable[[], str]) -> None:
        """Wait until the markers have returned.

        Raises:
            LinkLost: One did not.
        """
        while self._connection.state is State.OUT_OF_SYNC:
            limit = max(MARKER_TIME, self._connection.busy_time + PROBE_TRIPS * self.trip)
            self._answer.clear()
            try:
                async with asyncio.timeout(limit):
                    await self._answer.wait()
            except TimeoutError:
                if await self._wait_out_pause() or self._connection.state is not State.OUT_OF_SYNC:
                    continue
                silent = self._loop.time() - self.last_byte
                raise LinkLost(
                    f"the robot at {self._url} "
                    + (f"sent nothing for {silent:.1f} s" if silent >= limit else "sends packets but takes no command"),
                    hint="is it switched on, charged and in range? open a new connection when it is",
                ) from None


class Resync(Settling):
    """On a serial line: the resyncs of one session.

    Args:
        connection: Decides what to ask.
        url: Names the link in errors.
        put: Writes a probe.
        is_paused: Tells whether the robot is a virtual one whose world stands still, so that no answer can come.
    """

    def __init__(
        self,
        connection: HostConnection,
        url: str,
        put: Callable[[bytes], Awaitable[None]],
        is_paused: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__(url, is_paused)
        self._connection = connection
        self._put = put

    async def run(self, following: Callable[[], str]) -> None:
        """Ask until an answer brings the line into sync.

        Args:
            following: Returns the name of the command that is sent next; its question is asked last.

        Raises:
            LinkLost: Nothing answered, or the line never became quiet.
        """
        done = 0
        while done < RESYNC_ROUNDS:
            if self._connection.needs_pause:
                taken = self.last_sent + min(self.trip, MAX_TEXT) + self._connection.busy_time
                await self._silence(PAUSE, max(taken, self._loop.time()) + MAX_TEXT, taken)
            if self._connection.needs_silence or done >= QUICK_ROUNDS:
                await self._silence(PICTURE_SILENCE, self._loop.time() + MAX_SILENCE_WAIT)
            await self._probe(following)
            if self._connection.state is not State.OUT_OF_SYNC:
                return
            # A round that a stop has overtaken does not count: a user may press STOP many times on a slow line.
            done += not self._connection.is_overtaken
        raise LinkLost(
            f"{self._url} never becomes quiet: bytes keep coming that answer nothing",
            hint="does another program use the same port, or is the speed wrong?",
        )

    async def _silence(self, seconds: float, end: float, since: float = -math.inf) -> None:
        """Wait until no byte has come for *seconds* after *since*, but not beyond *end*."""
        while (until := min(max(self.last_byte, since) + seconds, end)) > self._loop.time():
            quiet = self._loop.create_future()
            self._loop.call_at(until, quiet.cancel)
            await asyncio.wait([quiet])

    async def _probe(self, following: Callable[[], str]) -> None:
        while True:
            tried = min(self._connection.probes_asked, len(PROBE_TIMES) - 1)
            timeout = max(PROBE_TIMES[tried], PROBE_TRIPS * self.trip, self._connection.busy_time)
            self._answer.clear()
            try:
                data = self._connection.resync(avoid=(following(),))
            except OutOfQuestions:
                raise LinkLost(
                    f"the robot at {self._url} no longer answers",
                    hint="is it switched on, charged and in range? open a new connection when it is",
                ) from None
            await self._put(data)
            try:
                async with asyncio.timeout(timeout):
                    await self._answer.wait()
            except TimeoutError:
                # The answer may have been received in the same turn of the loop in which the time ran out.
                await self._wait_out_pause()
                if self._connection.state is State.RESYNCING:
                    continue
            return
