"""The resync: how a line that is out of sync is brought into sync again.

Ask a question whose answer cannot be mistaken, and drop everything before that answer. What may be asked when is the
business of :class:`~elib.protocol.connection.HostConnection`; here is the waiting.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from elib.errors import LinkLost
from elib.protocol.connection import HostConnection, OutOfQuestions, State

PICTURE_SILENCE = 0.1
"""s without a byte that end a picture which is late; the rule of the 2011 library (elib-2011.md, 1.8)."""
LONGEST_SILENCE_WAIT = 2.0
"""s that the line may stay noisy before a resync asks all the same."""
PROBE_TIMES = (0.49, 0.49, 0.49, 0.49, 0.99, 0.99)
"""s that each probe waits at least: the first ones are short, so that a lost answer costs little. No round numbers: a
probe would often end at the very moment at which a call does, and a replay could take them in the other order."""
PROBE_TRIPS = 3
"""Round trips that each probe waits at least, on a slow line."""
LONGEST_TRIP = 1.0
"""s that count as a round trip at most: an answer that took longer was held up, by the link or by a program that was
suspended meanwhile, and says little about the next one."""
RESYNC_ROUNDS = 8
"""Resyncs in a row that are answered and yet leave the line dirty before the link counts as lost."""
QUICK_ROUNDS = 6
"""Of these, those that ask at once; a fast link takes milliseconds for them, so the others wait for quiet."""


class Resync:
    """Resyncs of one session.

    Args:
        connection: Knows what to ask.
        url: Names the link in errors.
        put: Writes a probe.

    Attributes:
        last_byte: When a byte last came, s on the loop's clock; the session keeps it up.
        trip: How long the newest answer took on the line, s, at most LONGEST_TRIP.
    """

    def __init__(self, connection: HostConnection, url: str, put: Callable[[bytes], Awaitable[None]]) -> None:
        self._connection = connection
        self._url = url
        self._put = put
        self._loop = asyncio.get_running_loop()
        self._answer: asyncio.Future[None] | None = None
        self.last_byte = self._loop.time()
        self.trip = 0.0

    def record_trip(self, seconds: float) -> None:
        """Take note how long an answer took."""
        self.trip = min(seconds, LONGEST_TRIP)

    def answered(self) -> None:
        """Take note that the probe's answer came."""
        if self._answer is not None and not self._answer.done():
            self._answer.set_result(None)

    async def run(self, following: Callable[[], str]) -> None:
        """Ask until an answer shows where the line stands.

        Args:
            following: Names the row that is sent next; its question is asked last.

        Raises:
            LinkLost: Nothing answered, or the line never became quiet.
        """
        done = 0
        while done < RESYNC_ROUNDS:
            if self._connection.needs_silence or done >= QUICK_ROUNDS:
                await self._silence()
            await self._probe(following)
            if self._connection.state is not State.OUT_OF_SYNC:
                return
            # A round that a stop has overtaken does not count: a person may press STOP many times on a slow line.
            done += not self._connection.is_overtaken
        raise LinkLost(
            f"{self._url} never becomes quiet: bytes keep coming that nobody asked for",
            hint="does another program use the same port, or is the speed wrong?",
        )

    async def _silence(self) -> None:
        end = self._loop.time() + LONGEST_SILENCE_WAIT
        while (until := min(self.last_byte + PICTURE_SILENCE, end)) > self._loop.time():
            quiet = self._loop.create_future()
            self._loop.call_at(until, quiet.cancel)
            await asyncio.wait([quiet])

    async def _probe(self, following: Callable[[], str]) -> None:
        while True:
            tried = min(self._connection.probes_asked, len(PROBE_TIMES) - 1)
            patience = max(PROBE_TIMES[tried], PROBE_TRIPS * self.trip, self._connection.patience)
            answer = self._answer = self._loop.create_future()
            try:
                data = self._connection.resync(avoid=(following(),))
            except OutOfQuestions:
                raise LinkLost(
                    f"the robot at {self._url} no longer answers",
                    hint="is it switched on, charged and in range? open a new connection when it is",
                ) from None
            await self._put(data)
            try:
                async with asyncio.timeout(patience):
                    await answer
            except TimeoutError:
                # The answer may have come on the very turn of the loop on which the time ran out.
                if self._connection.state is State.RESYNCING:
                    continue
            finally:
                self._answer = None
            return
