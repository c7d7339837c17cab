"""Recognise the robot at the other end of a link that was just opened (wire-protocol.md, 8)."""

from __future__ import annotations

import asyncio
import re

from elib.errors import LinkBusy, LinkLost, NotAnEpuck, RobotSilent
from elib.protocol.commands import SPECS
from elib.protocol.connection import Answer, HostConnection, State
from elib.protocol.context import Context, Profile
from elib.protocol.profiles import BTCOM_1_1_3, LONGEST_PARAMETERS, recognise
from elib.protocol.shapes import GREETING
from elib.protocol.values import Version
from elib.session.trace import Received, Transcript, Wrote
from elib.transport.base import Transport
from elib.transport.rfcomm import EPUCK2_CHANNEL, bluetooth_address
from elib.transport.tcp import ONE_AT_A_TIME
from elib.transport.url import parse_url

DRAIN_TIME = 0.2
"""s that the line is listened to before the robot is asked who it is (wire-protocol.md, 8)."""
OPENING_TIMEOUTS = (1.0, 1.0, 2.0)
"""s that each attempt waits: a robot that calibrates or starts is busy for some seconds."""
LINE_END_TIME = 0.05
"""s to wait for the answer to a half-typed line that was ended."""
READY = re.compile(rb"k, Calibration finished|" + re.escape(GREETING))
"""What a robot sends by itself when it is no longer busy: it is then asked once more."""
SETTLING_TIME = 0.1
"""s to wait for bytes behind the first answer; the silence that ends a picture."""
LARGEST_OPENING = 1 << 16
"""Bytes of the opening that are kept for recordings, at most."""
HEARD_LIMIT = 4096
"""Bytes that are kept of what was received, for the error message."""


class RecordingTransport:
    """A transport that keeps what is written and received while a robot is being recognised.

    Args:
        inner: The transport that carries the bytes.
    """

    def __init__(self, inner: Transport) -> None:
        self.url = inner.url
        self.origin = inner.origin
        self._inner = inner
        self._clock = asyncio.get_running_loop().time
        self._events: list[tuple[float, Wrote | Received]] = []
        self._left = LARGEST_OPENING

    @property
    def opening(self) -> Transcript:
        """The bytes that were written and received so far, at most the first 64 KiB."""
        return tuple(self._events)

    async def read(self) -> bytes:
        """Return the bytes that arrived."""
        data = await self._inner.read()
        self._note(Received(data))
        return data

    async def write(self, data: bytes) -> None:
        """Hand *data* over."""
        self._note(Wrote(data))
        await self._inner.write(data)

    async def close(self) -> None:
        """Free the port."""
        await self._inner.close()

    def _note(self, event: Wrote | Received) -> None:
        if self._left > 0:
            self._left -= len(event.data)
            self._events.append((self._clock(), event))


async def recognise_robot(transport: Transport, profile: Profile | None = None) -> tuple[Context, Version, bool]:
    """Ask the robot for its version, whatever an earlier program left on the line.

    Args:
        transport: An open transport.
        profile: Use this firmware's profile whatever the robot answers.

    Returns:
        The context of the connection, the robot's answer, and whether the same answer may come again because
        the question was asked more than once.

    Raises:
        RobotSilent: Nothing was received.
        NotAnEpuck: What was received is not an e-puck's answer.
        LinkBusy: The other side closed a TCP connection before it sent anything.
        LinkLost: The link broke meanwhile.
    """
    heard = bytearray()
    try:
        return await _ask(transport, profile, heard)
    except LinkLost as lost:
        if heard or isinstance(lost, RobotSilent) or parse_url(transport.url).scheme != "tcp":
            raise
        # A TCP server that is busy can refuse a connection only by accepting and closing it.
        raise LinkBusy(
            f"{transport.url}: the other side accepted the connection and closed it before it sent anything",
            hint=f"{ONE_AT_A_TIME}; {lost.hint}",
        ) from lost


async def _ask(transport: Transport, profile: Profile | None, heard: bytearray) -> tuple[Context, Version, bool]:
    """Recognise the robot; every byte that is received meanwhile is kept in *heard*."""
    loop = asyncio.get_running_loop()
    # Zeros fill the parameters of a binary session and end it; the CR ends a half-typed line.
    await transport.write(bytes(LONGEST_PARAMETERS + 1) + b"\r")
    await _listen(transport, DRAIN_TIME, heard)
    for attempt, limit in enumerate((*OPENING_TIMEOUTS, OPENING_TIMEOUTS[0])):
        if attempt == len(OPENING_TIMEOUTS) and not READY.search(heard):
            break
        context = Context(profile or BTCOM_1_1_3, transport.origin)
        connection = HostConnection(context)
        await transport.write(connection.send(SPECS["version"].request(context)))
        end = loop.time() + limit
        while connection.state is State.BUSY and loop.time() < end:
            data = await _listen_once(transport, end)
            _keep(heard, data)
            connection.receive(data, loop.time())
        while (event := connection.next_event()) is not None:
            if isinstance(event, Answer) and isinstance(event.value, Version):
                if connection.state is State.OUT_OF_SYNC:
                    await _listen(transport, SETTLING_TIME, bytearray())
                context, version = _known(event.value, profile, transport, loop.time())
                return context, version, attempt > 0
        await transport.write(b"\r")
        await _listen(transport, LINE_END_TIME, heard)
    if not heard:
        silent = RobotSilent(
            f"{transport.url} opened, but no robot answered",
            hint="switch the robot on, charge it, turn its selector (position 3, or 8 on the USB cable of an e-puck2) "
            "and press reset; check that no other robot has this address",
        )
        if transport.url.startswith("rfcomm:"):
            address, channel = bluetooth_address(parse_url(transport.url))
            if channel != EPUCK2_CHANNEL:
                other = f"rfcomm://{address}?channel={EPUCK2_CHANNEL}"
                silent.hint = f"an e-puck2 talks on another channel: {other}; {silent.hint}"
        raise silent
    raise NotAnEpuck(
        f"something answers on {transport.url}, but not as an e-puck does: {bytes(heard[:60])!r}",
        hint="is it the right port, at 115200 baud, with the standard firmware (BTcom, asercom) on the robot?",
    )


def _known(answer: Version, profile: Profile | None, transport: Transport, now: float) -> tuple[Context, Version]:
    found = profile or recognise(answer.text)
    version = Version(answer.text, found.name, answer.hardware, time=now, origin=transport.origin)
    return Context(found, transport.origin, now), version


async def _listen(transport: Transport, seconds: float, heard: bytearray) -> None:
    """Drop what is received for *seconds*, but keep its beginning for an error message."""
    loop = asyncio.get_running_loop()
    end = loop.time() + seconds
    while loop.time() < end:
        _keep(heard, await _listen_once(transport, end))


async def _listen_once(transport: Transport, end: float) -> bytes:
    try:
        async with asyncio.timeout_at(end):
            return await transport.read()
    except TimeoutError:
        return b""


def _keep(heard: bytearray, data: bytes) -> None:
    heard += data[: HEARD_LIMIT - len(heard)]
