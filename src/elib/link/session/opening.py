"""Recognise the robot at the other end of a link that was just opened (wire-protocol.md, 8)."""

from __future__ import annotations

import asyncio
import re
from dataclasses import replace

from elib.base.errors import ArgumentError, LinkBusy, LinkLost, NotAnEpuck, RobotSilent
from elib.link.protocol.commands import SPECS
from elib.link.protocol.connection import Answer, HostConnection, State
from elib.link.protocol.context import Context, Profile
from elib.link.protocol.profiles import (
    BTCOM_1_1_3,
    EPUCK2_WIFI,
    FIRMWARES,
    MAX_PARAMETERS,
    TURN_THE_SELECTOR,
    recognise,
)
from elib.link.protocol.shapes import GREETING
from elib.link.protocol.table import Request
from elib.link.protocol.values import Sensors, Steps, Version
from elib.link.protocol.wifi import ALL_SENSORS, pair
from elib.link.protocol.wifi_connection import OutOfStep, WifiConnection
from elib.link.session.trace import Received, Transcript, Wrote
from elib.link.transport.base import Transport, codec_of
from elib.link.transport.url import parse_url

DRAIN_TIME = 0.2
"""s that the line is listened to before the robot is asked who it is (wire-protocol.md, 8)."""
OPENING_TIMEOUTS = (1.0, 1.0, 2.0)
"""s that each attempt waits: a robot that calibrates or starts is busy for some seconds."""
LINE_END_TIME = 0.05
"""s to wait for the answer to a half-typed line that was ended."""
ANSWERED = re.compile(rb"[\r\n](v,[^\r\n]+)", re.IGNORECASE)
"""The answer to the question for the version, among whatever else came."""
READY = re.compile(rb"k, Calibration finished|" + re.escape(GREETING))
"""What a robot sends by itself when it is no longer busy: it is then asked once more."""
SETTLING_TIME = 0.1
"""s to wait for bytes behind the first answer; the silence that ends a picture."""
COUNTERS_TIME = 1.0
"""s to wait for the step counters; without them odometry begins with the first reading."""
STREAM_TIME = 4.0
"""s that a robot on Wi-Fi has to take its first command. It may calibrate, for 1.7 s, or pause for 1 s after a broken
exchange between its processors (wire-protocol.md, 4.4)."""
MAX_OPENING = 1 << 16
"""Bytes of the opening that are kept for recordings, at most."""


class RecordingTransport:
    """A transport that keeps what is written and received while a robot is being recognised.

    Args:
        inner: The transport that carries the bytes.
    """

    def __init__(self, inner: Transport) -> None:
        self.url = inner.url
        self.codec = codec_of(inner)
        self.origin = inner.origin
        # over Wi-Fi, the command from which the first one is made; without one, the first one stops the robot
        self.last_command: bytes = getattr(inner, "last_command", b"")
        # whether the step counters may be read now: in the replay of a recording without them, they may not
        self.tells_counters: bool = getattr(inner, "tells_counters", True)
        self._inner = inner
        self._clock = asyncio.get_running_loop().time
        self._events: list[tuple[float, Wrote | Received]] = []
        self._left = MAX_OPENING

    @property
    def opening(self) -> Transcript:
        """The bytes that were written and received so far, at most the first 64 KiB."""
        return tuple(self._events)

    @property
    def received(self) -> bytes:
        """The bytes among them that were received."""
        return b"".join(event.data for _, event in self._events if isinstance(event, Received))

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


Opened = tuple[HostConnection | WifiConnection, Version, Steps | None]
"""The connection to a robot, its answer to the question for its version, and its step counters if it gave them."""


async def recognise_robot(transport: RecordingTransport, profile: Profile | None) -> Opened:
    """Find out which robot is at the other end, whatever an earlier program left on the line.

    Args:
        transport: An open transport that nothing was read from.
        profile: Use this firmware's profile whatever the robot answers.

    Raises:
        RobotSilent: Nothing was received.
        NotAnEpuck: What was received is not an e-puck's answer.
        LinkBusy: The other side closed a TCP connection before it sent anything.
        LinkLost: The link broke meanwhile.
        ArgumentError: *profile* is that of another kind of link.
    """
    if profile is not None and profile.codec != transport.codec:
        raise ArgumentError(
            f"{profile.name} does not talk through {transport.url}",
            hint=f"leave firmware= out, or choose one of {', '.join(_firmwares_of(transport.codec))}",
        )
    if transport.codec == "wifi":
        return await begin_stream(transport, profile or EPUCK2_WIFI)
    try:
        return await _ask(transport, profile)
    except LinkLost as lost:
        if transport.received or isinstance(lost, RobotSilent) or parse_url(transport.url).scheme != "tcp":
            raise
        from elib.link.transport.tcp import ONE_AT_A_TIME  # loaded by now, and only for this kind of link

        # A TCP server that is busy can refuse a connection only by accepting and closing it.
        raise LinkBusy(
            f"{transport.url}: the other side accepted the connection and closed it before it sent anything",
            hint=f"{ONE_AT_A_TIME}; {lost.hint}",
        ) from lost


def _firmwares_of(codec: str) -> list[str]:
    return [name for name, each in FIRMWARES.items() if each.codec == codec]


async def begin_stream(transport: RecordingTransport, profile: Profile) -> Opened:
    """Send a robot on Wi-Fi its first command at once, which stops it, and wait until it has taken that.

    If the transport goes on with a recorded program, the command has the actuators which that one set last.

    Raises:
        RobotSilent: Nothing was received.
        NotAnEpuck: What was received are not the packets of an e-puck2.
        LinkLost: The link broke meanwhile.
    """
    context = Context(profile, transport.origin)
    context.sent = transport.last_command or context.sent
    connection = WifiConnection(context)
    request: Request[object] = Request("open", "open", pair(context), ALL_SENSORS)
    await _exchange(transport, connection, request, STREAM_TIME)
    while (event := connection.next_event()) is not None:
        if isinstance(event, Answer):
            counters = event.value.encoders if isinstance(event.value, Sensors) else None
            return connection, Version(profile.version, profile.name, "", **context.stamp), counters
        if isinstance(event, OutOfStep):
            raise NotAnEpuck(
                f"something answers on {transport.url}, but not as an e-puck2 on Wi-Fi does: {event.reason}",
                hint="is it the right host and port, and is the ESP32's Wi-Fi firmware not older than February 2019?",
            )
    if transport.received:
        raise NotAnEpuck(
            f"the robot at {transport.url} sends packets, but did not take a command within {STREAM_TIME:g} s",
            hint="turn its selector to 15, where its main processor works with the Wi-Fi firmware, and press reset",
        )
    raise RobotSilent(
        f"{transport.url} opened, but no packet came within {STREAM_TIME:g} s",
        hint="turn the robot's selector to 15 and press reset; close other programs that are connected to it: "
        "it serves one at a time",
    )


async def _ask(transport: RecordingTransport, profile: Profile | None) -> Opened:
    loop = asyncio.get_running_loop()
    # Zeros fill the parameters of a binary session and end it; the CR ends a half-typed line.
    await transport.write(bytes(MAX_PARAMETERS + 1) + b"\r")
    await _listen(transport, DRAIN_TIME)
    for attempt, limit in enumerate((*OPENING_TIMEOUTS, OPENING_TIMEOUTS[0])):
        if attempt == len(OPENING_TIMEOUTS) and not READY.search(transport.received):
            break
        context = Context(profile or BTCOM_1_1_3, transport.origin)
        connection = HostConnection(context)
        await _exchange(transport, connection, SPECS["version"].request(context), limit)
        while (event := connection.next_event()) is not None:
            if isinstance(event, Answer) and isinstance(event.value, Version):
                if connection.state is State.OUT_OF_SYNC:
                    await _listen(transport, SETTLING_TIME)
                found = profile or recognise(event.value.text)
                context = Context(found, transport.origin, loop.time())
                version = replace(event.value, firmware=found.name, time=loop.time(), origin=transport.origin)
                recognised = HostConnection(context, version.text)
                if attempt > 0:
                    recognised.lose_sync(b"V\r")  # the same answer may come again: it was asked for more than once
                    return recognised, version, None
                return recognised, version, await _read_counters(transport, recognised)
        await transport.write(b"\r")
        await _listen(transport, LINE_END_TIME)
    if not transport.received:
        silent = RobotSilent(
            f"{transport.url} opened, but no robot answered",
            hint=f"switch the robot on, charge it; {TURN_THE_SELECTOR}; check that no other robot has this address",
        )
        if transport.url.startswith("rfcomm:"):
            from elib.link.transport.rfcomm import EPUCK2_CHANNEL, bluetooth_address

            address, channel = bluetooth_address(parse_url(transport.url))
            if channel not in (None, EPUCK2_CHANNEL):
                other = f"rfcomm://{address}?channel={EPUCK2_CHANNEL}"
                silent.hint = f"an e-puck2 talks on another channel: {other}; {silent.hint}"
        raise silent
    if late := ANSWERED.search(b"\n" + transport.received):
        raise RobotSilent(
            f"the robot at {transport.url} answered too late, after more than {sum(OPENING_TIMEOUTS):g} s: "
            f"{late[1].decode('latin-1')}",
            hint="wait until it has started and calibrated, bring it nearer, and try again",
        )
    raise NotAnEpuck(
        f"something answers on {transport.url}, but not as an e-puck does: {transport.received[:60]!r}",
        hint="is it the right port, at 115200 baud, with the standard firmware (BTcom, asercom) on the robot?",
    )


async def _read_counters(transport: RecordingTransport, connection: HostConnection) -> Steps | None:
    """Read the step counters, with which odometry begins; None without an answer."""
    if not transport.tells_counters:
        return None
    await _exchange(transport, connection, SPECS["encoders"].request(connection.context), COUNTERS_TIME)
    if connection.state is State.BUSY:
        connection.abandon()
    found = None
    while (event := connection.next_event()) is not None:
        if isinstance(event, Answer) and isinstance(event.value, Steps):
            found = event.value
    return found


async def _exchange(
    transport: Transport, connection: HostConnection | WifiConnection, request: Request[object], seconds: float
) -> None:
    """Send *request*, and let the connection take what comes until it has the answer or the time is over."""
    loop = asyncio.get_running_loop()
    await transport.write(connection.send(request))
    end = loop.time() + seconds
    while connection.state is State.BUSY and loop.time() < end:
        connection.receive(await _listen_once(transport, end), loop.time())


async def _listen(transport: Transport, seconds: float) -> None:
    loop = asyncio.get_running_loop()
    end = loop.time() + seconds
    while loop.time() < end:
        await _listen_once(transport, end)


async def _listen_once(transport: Transport, end: float) -> bytes:
    try:
        async with asyncio.timeout_at(end):
            return await transport.read()
    except TimeoutError:
        return b""
