"""``replay://FILE``: a transport that gives a program the answers of a recording.

The program that was recorded, or one that does the same, gets the recorded answers at the recorded times. Each byte
that it sends is compared with the recording; at the first difference the link ends, and the error says what differs.
When the link was lost in the recording, it is lost in the replay, and it comes back at the recorded time.
"""

from __future__ import annotations

import asyncio
import functools
import itertools
from bisect import bisect_left
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path

from elib.base.errors import LinkBusy, LinkNotFound, ReplayDiffers
from elib.link.protocol.profiles import FIRMWARES
from elib.link.protocol.wifi import COMMAND
from elib.link.transport.base import BufferedTransport
from elib.link.transport.lease import lease_of
from elib.link.transport.url import Url
from elib.records.reader import Recording, Transfer
from elib.records.topics import BYTES, CALLS, NOTES, OUTCOMES

SHOWN = 40
"""Number of bytes of a request that an error message shows."""

ROUNDING = 1e-9
"""s. Sums of times that differ by less are equal."""
SENDING = 1e-4
"""Longest time between the notes of the sending of a call and of its bytes, s."""
EARLY = 0.02
"""s by which a request may be sent before its recorded time and still be answered at the recorded time. In simulated
time a program is not slowed down by its own computing or by the clock of the system. It must not run ahead of the
recording, and it must not wait for answers until its timeouts end."""


@dataclass(slots=True)
class Stretch:
    """The bytes of one session, from the opening of the link to its end."""

    items: list[Transfer] = field(default_factory=list)  # the bytes, in order
    lost: float | None = None  # when the link was lost, s on the recorded clock; None if it was not lost
    reason: str = ""  # why the link was lost


@dataclass(slots=True)
class Script:
    """The parts of a recording that a replay needs."""

    name: str
    stretches: list[Stretch]  # the bytes of each session
    calls: list[tuple[float, str]]  # when the bytes of each call were sent, and the text of the call, in order of time
    codec: str  # what the link carried
    began: float  # when the recording began, s
    missing: str  # a hint on what happened before the recording began; empty if the recording is complete

    @classmethod
    def of(cls, recording: Recording) -> Script:
        """Read a recording."""
        stretches, calls = [Stretch()], []
        texts: dict[int, str] = {}
        for entry in recording.entries(BYTES.name, CALLS.name, OUTCOMES.name, NOTES.name):
            stretch = stretches[-1]
            if entry.topic == CALLS.name:
                texts[entry.data["call"]] = str(entry.data["text"])
            elif entry.topic == OUTCOMES.name:
                text, trip = texts.pop(entry.data["call"], ""), entry.data["round_trip"]
                if text and trip is not None:
                    calls.append((entry.time - trip, text))
            elif entry.topic == BYTES.name:
                if stretch.lost is not None:
                    stretch = Stretch()
                    stretches.append(stretch)
                stretch.items.append(entry.transfer)
            elif entry.data.get("event") in ("down", "lost") and stretch.lost is None:
                stretch.lost, stretch.reason = entry.time, str(entry.data["message"])
        firmware = FIRMWARES.get(recording.about.get("firmware", ""))
        codec = "serial" if firmware is None else firmware.codec
        return cls(recording.name, stretches, sorted(calls), codec, recording.began, _missing(recording))

    def call_at(self, time: float) -> str:
        """Return the text of the call whose bytes were sent at a time; empty if no call was sent then."""
        place = bisect_left(self.calls, (time - SENDING, ""))
        return self.calls[place][1] if place < len(self.calls) and self.calls[place][0] <= time + SENDING else ""


class Replay:
    """One replay of a recording on an event loop, over all its sessions."""

    def __init__(self, script: Script, url: str) -> None:
        self.script = script
        self.url = url
        self.loop = asyncio.get_running_loop()
        self.transport: ReplayTransport | None = None
        self.failure: tuple[str, str] | None = None
        self._number = -1
        items = script.stretches[0].items
        self.shift = self.loop.time() - items[0].time if items else 0.0

    def open(self) -> ReplayTransport:
        """Begin the next session.

        Raises:
            ReplayDiffers: The program did something else than in the recording.
            LinkNotFound: The link was down at this time of the recording, or the recording is over.
        """
        if self.failure is not None:
            message, hint = self.failure
            raise ReplayDiffers(message, hint=hint)
        if self._number + 1 >= len(self.script.stretches):
            raise LinkNotFound(f"{self.script.name}: the link did not come back in this recording")
        stretch = self.script.stretches[self._number + 1]
        now = self.loop.time()
        # Half a millisecond of tolerance: programs in real time are never on time to the last digit.
        if self._number >= 0 and stretch.items and stretch.items[0].time + self.shift > now + 5e-4:
            raise LinkNotFound(f"{self.script.name}: the link was down at this time of the recording")
        self._number += 1
        self.transport = ReplayTransport(self, stretch)
        return self.transport


class ReplayTransport(BufferedTransport):
    """The program's end of a link whose other end is a recording."""

    def __init__(self, replay: Replay, stretch: Stretch) -> None:
        super().__init__(replay.url, origin="replay")
        self.codec = replay.script.codec
        self._replay = replay
        self._loop = replay.loop
        self._items = deque(stretch.items)
        self._stretch = stretch
        first = next((item.data for item in stretch.items if item.to_robot), b"")
        # The first pair on Wi-Fi stops the robot, except that of a fork, which can be recorded too.
        self.last_command = first[COMMAND.size :] if len(first) == 2 * COMMAND.size else b""
        opening = itertools.takewhile(lambda each: not replay.script.call_at(each.time), stretch.items)
        self.tells_counters = any(each.data == b"Q\r" for each in opening)  # older versions of elib did not ask
        self._expected = memoryview(b"")
        self._request = Transfer(0.0, True, b"")
        self._late = 0.0
        self._due: deque[tuple[float, bytes]] = deque()
        self._timer: asyncio.TimerHandle | None = None
        self._ending: asyncio.TimerHandle | None = None
        self._go_on()

    def abort(self) -> None:
        """Close the recording."""
        if self._closed:
            return
        self._mark_closed()
        for timer in (self._timer, self._ending):
            if timer is not None:
                timer.cancel()
        # A program that will open the link again after a loss continues there; all others start again.
        if self._loss is None or lease_of(self._url, self._loop) is None:
            _forget(self._replay)

    def _push(self, data: bytes) -> None:
        """Compare *data* with the recording.

        Raises:
            LinkLost: The bytes differ, or the recording is over.
        """
        self._compare(data)
        self._check_open()

    # -- what the program sends --

    def _compare(self, data: bytes) -> None:
        rest = memoryview(data)
        while len(rest) and self._replay.failure is None:
            if not len(self._expected) and not self._next_request():
                if self._stretch.lost is None:  # otherwise these bytes were lost with the link
                    self._end_at(data)
                return
            count = min(len(rest), len(self._expected))
            if rest[:count] != self._expected[:count]:
                self._differ(data)
                return
            self._late = _lateness(self._loop.time() - (self._request.time + self._replay.shift))
            rest, self._expected = rest[count:], self._expected[count:]
            if not len(self._expected):
                self._go_on()

    def _next_request(self) -> bool:
        """Take the next bytes that were sent to the robot; return False if there are none."""
        if not self._items:
            return False
        self._request = self._items.popleft()
        self._expected = memoryview(self._request.data)
        return True

    def _go_on(self) -> None:
        """Schedule everything that the robot sent before the next bytes of the program."""
        while self._items and not self._items[0].to_robot:
            item = self._items.popleft()
            self._due.append((item.time + self._replay.shift + self._late, item.data))
        if not self._items and self._stretch.lost is not None and self._ending is None:
            when = self._stretch.lost + self._replay.shift + self._late
            reason = f"{self._stretch.reason} (as recorded in {self._replay.script.name})"
            self._ending = self._loop.call_at(when, self.lose, reason)
        self._wait()

    def _wait(self) -> None:
        if self._timer is None and self._due:
            self._timer = self._loop.call_at(self._due[0][0], self._deliver)

    def _deliver(self) -> None:
        self._timer = None
        _, data = self._due.popleft()
        self.feed(data)
        if not self._closed:
            self._wait()

    # -- how it ends --

    def _differ(self, data: bytes) -> None:
        script, request = self._replay.script, self._request
        recorded = bytes(request.data)
        call = script.call_at(request.time)
        self._fail(
            f"{script.name}: the program differs from its recording at {self._seconds(request.time):.3f} s: it sent "
            f"{_shown(data)} where {_shown(recorded)} was sent" + (f" for {call}" if call else ""),
            self._hint
            or "the recorded answers hold only for the recorded commands: replay://FILE?fork=SECONDS goes on from any "
            "moment in the simulator",
        )

    @property
    def _hint(self) -> str:
        """A hint for a recording that does not begin with the link."""
        script = self._replay.script
        return script.missing if script.stretches[0] is self._stretch else ""

    def _end_at(self, data: bytes) -> None:
        script = self._replay.script
        hint = self._hint or "the program went on for longer than it was recorded; a recording ends when it is closed"
        end = self._stretch.items[-1].time if self._stretch.items else 0.0
        self._fail(
            f"{script.name}: the recording is over at {self._seconds(end):.3f} s, and the program sent {_shown(data)}",
            hint,
        )

    def _fail(self, message: str, hint: str) -> None:
        self._replay.failure = message, hint
        # Not at once: the link must not close while the program is sending.
        self._loop.call_soon(functools.partial(self.lose, message, hint=hint, kind=ReplayDiffers))

    def _seconds(self, time: float) -> float:
        """Return a recorded time in s since the recording began, as in ``elib replay`` and ``fork=``."""
        return time - self._replay.script.began


_REPLAYS: dict[tuple[asyncio.AbstractEventLoop, str], Replay] = {}
"""The recordings that are played, by the event loop and the URL, until they are forgotten."""


def open_recording(url: Url) -> ReplayTransport:
    """Open a recording as a robot on the running event loop: from the start, or again after a lost link."""
    name = str(url)
    key = asyncio.get_running_loop(), name
    replay = _REPLAYS.get(key)
    if replay is None:
        replay = _REPLAYS[key] = Replay(Script.of(Recording(Path(url.target))), name)
        held = lease_of(name, replay.loop)
        if held is not None:
            held.on_end.append(lambda: _forget(replay))
    elif replay.transport is not None and replay.transport.is_open:
        raise LinkBusy(f"{name} is open already on this event loop", hint="close it first")
    return replay.open()


def _lateness(late: float) -> float:
    """Return the delay of an answer, s, for a request that was sent *late* seconds after its recorded time."""
    if late >= ROUNDING:
        return late
    return late + EARLY if late < -EARLY else 0.0


def _forget(replay: Replay) -> None:
    key = replay.loop, replay.url
    if _REPLAYS.get(key) is replay:
        del _REPLAYS[key]


def _missing(recording: Recording) -> str:
    """Return a hint on what is missing at the beginning of a recording; empty if it has the first byte of the link."""
    before = int(recording.about.get("calls_before", "0"))
    if recording.about.get("part", "1") != "1":
        return "the first parts of this recording are missing, and with them what went before"
    return f"it was begun after {before} calls: begin it before the first one" if before else ""


def _shown(data: bytes) -> str:
    """Return bytes for a person: as text if they are text, otherwise in hexadecimal."""
    cut = data[:SHOWN]
    text = cut.decode("ascii", "replace")
    is_text = all(32 <= byte < 127 for byte in cut.rstrip(b"\r\n")) and bool(cut)
    shown = repr(text.rstrip("\r\n")) if is_text else cut.hex(" ")
    return f"{shown}{'...' if len(data) > SHOWN else ''}"
