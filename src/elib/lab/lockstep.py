"""``lockstep://FD``: robots in a world that another process owns, which also keeps the time.

A marker gives the program one end of a socket pair, or of a :class:`Channel` in the same process. This is the program's
side; the frames are described in docs/decisions/0023-the-marker-owns-the-simulator.md.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import socket
import struct
import threading
import weakref
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Protocol

from elib.base.errors import ArgumentError, LinkBusy, LinkLost, LinkNotFound, SimulationError
from elib.base.rules import Whole
from elib.base.timebase import HostedLoop, LoopMaker, SimulatedLoop, host, running_loop
from elib.link.protocol.values import Neighbour
from elib.link.transport.base import BufferedTransport
from elib.link.transport.url import Scheme, Url

VERSION = 1
MAX_MESSAGE = 65536
"""Bytes of a frame, its letter included; the program cuts what it writes."""
LETTER = struct.Struct("<IB")
"""The head of each frame: how many bytes follow, of which the first is the letter."""
HELLO, OPEN, CLOSE, WRITE, GO, SAY, HEAR = b"HOCWGSN"
ROBOT = struct.Struct("<H")
TIME = struct.Struct("<d")
GREETING = struct.Struct("<BdH")
"""The answer to hello: version, time, how many robots; then a letter for each, s for serial or w for Wi-Fi."""
KEPT = struct.Struct("<I")
PASSED = struct.Struct("<d?")
"""The answer to go: the time, and whether the run is over; then what there is of news, and the text why it is over."""
NEWS = struct.Struct("<HI?I")
"""News of one robot: its index, bytes that its link has not taken yet, whether it was lost, length of what follows."""
HEARD = struct.Struct("<dddB")

GONE = "the marker has ended"
ROBOT_NUMBER = Whole(1, 10_000)


class Channel(Protocol):
    """What a link needs of a socket."""

    def sendall(self, data: bytes, /) -> object:
        """Send a frame."""

    def recv(self, size: int, /) -> bytes:
        """Return what has come, or nothing at the end."""

    def close(self) -> object:
        """Carry no more."""


class LockstepLink:
    """The program's end of a channel to the marker, which all its event loops share.

    Args:
        number: The number in its URL.
        channel: What carries the frames; the socket whose file descriptor is *number* if None.

    Attributes:
        is_over: Whether the marker lets no more time pass.
        was_used: Whether the program has opened a robot.
    """

    def __init__(self, number: int, channel: Channel | None = None) -> None:
        self.name = f"lockstep://{number}"
        self.is_over = self.was_used = False
        self.on_over: Callable[[], None] | None = None  # called when the marker lets no more time pass
        # called before a loop jumps, if set; what it raises ends the program
        self.on_jump: Callable[[], None] | None = None
        self.now = 0.0  # the marker's time, s
        self.loops: weakref.WeakSet[LockstepLoop] = weakref.WeakSet()
        self.robots: dict[int, LockstepTransport] = {}
        self._lock = threading.RLock()
        self._received = bytearray()
        try:
            if channel is None:
                channel = found = socket.socket(fileno=number)
                found.set_inheritable(False)
                found.setblocking(True)
            self._channel = channel
            answer = self.ask(HELLO, bytes((VERSION,)))
        except (OSError, LinkLost) as error:
            raise LinkNotFound(
                f"{self.name}: there is no marker behind this file descriptor: {error}",
                hint="only a lab's marker gives such a URL; try sim://",
            ) from None
        _, self.now, count = GREETING.unpack_from(answer)
        # what each robot's link carries
        self.codecs = ["wifi" if each == ord("w") else "serial" for each in answer[GREETING.size :][:count]]

    def tell(self, letter: int, body: bytes) -> None:
        """Send a frame that has no answer."""
        with self._lock:
            if self.is_over:
                return
            try:
                self._channel.sendall(LETTER.pack(1 + len(body), letter) + body)
            except OSError:
                self._end(GONE)

    def ask(self, letter: int, body: bytes) -> bytes:
        """Send a frame and return the answer to it.

        Raises:
            LinkLost: The run is over.
        """
        with self._lock:
            self.tell(letter, body)
            try:
                size, _ = LETTER.unpack(self._take(LETTER.size))
                return self._take(size - 1)
            except OSError:
                self._end(GONE)
                raise LinkLost(f"{self.name}: {GONE}") from None

    def _take(self, count: int) -> bytes:
        while len(self._received) < count:
            piece = b"" if self.is_over else self._channel.recv(MAX_MESSAGE)
            if not piece:
                raise ConnectionError(GONE)
            self._received += piece
        data = bytes(self._received[:count])
        del self._received[:count]
        return data

    def go(self, asking: LockstepLoop, when: float) -> None:
        """Let time pass until *when* on the clock of a loop, or until something comes for the program."""
        with self._lock, contextlib.suppress(LinkLost):
            until = max(asking.began + when, self.now)
            if until - asking.began < when:
                until = math.nextafter(until, math.inf)  # rounded down, the timer would never be due
            answer = self.ask(GO, TIME.pack(until))
            self.now, is_over = PASSED.unpack_from(answer)
            for loop in self.loops:
                loop.set_time(when if loop is asking and self.now == until else self.now - loop.began)
            place = PASSED.size
            if is_over:
                self._end(answer[place:].decode("utf-8", "replace"))
                return
            while place < len(answer):
                index, kept, is_lost, length = NEWS.unpack_from(answer, place)
                place += NEWS.size + length
                robot = self.robots.get(index)
                if robot is not None:
                    robot.hand_over(answer[place - length : place], kept, is_lost=is_lost)

    def _end(self, why: str) -> None:
        """Note that the marker lets no more time pass: all robots are lost."""
        self.is_over = True
        if self.on_over is not None:
            self.on_over()
        with contextlib.suppress(OSError):
            self._channel.close()
        for robot in tuple(self.robots.values()):
            robot.hand_over(why.encode(), 0, is_lost=True)


class LockstepLoop(SimulatedLoop):
    """A :class:`SimulatedLoop` whose time is the marker's, from zero on: it asks before it jumps."""

    def __init__(self, link: LockstepLink, *where: Any) -> None:
        self.link = link  # the link to the marker
        self.began = link.now  # the marker's time when the loop was made, s
        super().__init__(*where)
        link.loops.add(self)

    def set_time(self, now: float) -> None:
        """Set the loop's time, which never goes back."""
        self._set_time(max(self._now, now))

    def _jump(self) -> bool:
        if self.link.on_jump is not None:
            self.link.on_jump()
        waits = any(robot.loop is self for robot in self.link.robots.values())
        if self.link.is_over or not (self._scheduled or waits):
            return super()._jump()
        self.link.go(self, self._scheduled[0].when() if self._scheduled else math.inf)
        return True


class HostedLockstepLoop(LockstepLoop, HostedLoop):
    """The same where there is one thread."""


class LockstepTransport(BufferedTransport):
    """The program's end of the link of one robot."""

    def __init__(self, url: str, link: LockstepLink, index: int) -> None:
        super().__init__(url, origin="simulator")
        self.loop = asyncio.get_running_loop()
        self.codec = link.codecs[index]
        self._link = link
        self._index = index
        self._kept = 0

    def hand_over(self, data: bytes, kept: int, *, is_lost: bool) -> None:
        """Take news of the marker, on this transport's own loop as soon as it runs."""
        if running_loop() is self.loop:
            self.loop.call_soon(self._take_over, data, kept, is_lost)
            return
        with contextlib.suppress(RuntimeError):  # that loop may be closed
            self.loop.call_soon_threadsafe(self._take_over, data, kept, is_lost)

    def _take_over(self, data: bytes, kept: int, is_lost: bool) -> None:
        if is_lost:
            self._forget()
            message, _, hint = data.decode("utf-8", "replace").partition("\n")
            self.lose(f"{self._url}: {message}", hint=hint)
            return
        self.feed(data)
        if kept != self._kept:
            self._kept = kept
            self.wake_writer()

    def abort(self) -> None:
        """Leave the robot. It goes on, and so does its world."""
        if self._closed:
            return
        if self.is_open:
            self._forget()
            self._link.tell(CLOSE, ROBOT.pack(self._index))
        self._mark_closed()

    def _forget(self) -> None:
        if self._link.robots.get(self._index) is self:
            del self._link.robots[self._index]

    def _push(self, data: bytes) -> None:
        room = MAX_MESSAGE - 1 - ROBOT.size
        for start in range(0, len(data), room):
            answer = self._link.ask(WRITE, ROBOT.pack(self._index) + data[start : start + room])
            [self._kept] = KEPT.unpack(answer)

    def _unsent(self) -> int:
        return self._kept

    def _pause(self) -> None:
        """Do nothing: the marker sends no more than a robot's line carries."""

    def _resume(self) -> None:
        """Do nothing."""

    def send_message(self, message: bytes) -> None:
        """Let the robot say *message* to others by range and bearing, from now on.

        Raises:
            ArgumentError: The message is not bytes, or too long.
            LinkLost: The link is down.
        """
        # Here, because few programs need it, and it takes long to import.
        from elib.simulator.physics.rangebearing import check_message

        self._check_open()
        check_message(message)
        self._link.tell(SAY, ROBOT.pack(self._index) + message)

    def neighbours(self) -> tuple[Neighbour, ...]:
        """Return the robots that this one hears by range and bearing, the nearest first.

        Raises:
            LinkLost: The link is down.
        """
        self._check_open()
        answer = self._link.ask(HEAR, ROBOT.pack(self._index))
        found, place = [], 0
        began = self.loop.began if isinstance(self.loop, LockstepLoop) else 0.0
        while place < len(answer):
            distance, bearing, time, length = HEARD.unpack_from(answer, place)
            place += HEARD.size + length
            message = answer[place - length : place]
            found.append(Neighbour(distance, bearing, message, time=time - began, origin=self.origin))
        return tuple(found)


MAX_FILE = 1 << 24
"""No file descriptor is as large."""
_LINKS: dict[int, LockstepLink] = {}
"""Links by their numbers: file descriptors, or larger ones for markers in the same process."""
_LINKS_LOCK = threading.Lock()


def link_of(number: int) -> LockstepLink:
    """Return the link of a number, the same one each time.

    Raises:
        LinkNotFound: There is no marker behind it.
    """
    with _LINKS_LOCK:
        if number not in _LINKS:
            _LINKS[number] = LockstepLink(number)
        return _LINKS[number]


@contextlib.contextmanager
def linked(channel: Channel) -> Iterator[int]:
    """Give a marker in the same process a number for URLs, while the block lasts."""
    with _LINKS_LOCK:
        number = max(MAX_FILE, *_LINKS, 0) + 1
        _LINKS[number] = LockstepLink(number, channel)
    try:
        yield number
    finally:
        del _LINKS[number]


@dataclass(frozen=True, slots=True)
class MarkersTime(LoopMaker):
    """The time of a marker."""

    number: int  # the number of its link

    def make(self) -> LockstepLoop:
        """Return an event loop in this time."""
        link, place = link_of(self.number), host()
        return LockstepLoop(link) if place is None else HostedLockstepLoop(link, place, math.inf)


async def open_lockstep(url: Url) -> LockstepTransport:
    """Open a robot of the marker's world.

    Raises:
        LinkNotFound: There is no marker, or the robot's link is down.
        LinkBusy: The program has this robot open already.
        LinkLost: The run is over.
        ArgumentError: There is no such robot.
        SimulationError: The running event loop does not keep the marker's time.
    """
    link = link_of(int(url.target))
    loop = asyncio.get_running_loop()
    if not isinstance(loop, LockstepLoop) or loop.link is not link:
        raise SimulationError(
            f"{url} needs an event loop that keeps the marker's time",
            hint="let elib.run() or elib.connect() choose the loop, or use asyncio.run()",
        )
    index = int(url.keys.get("robot", "1")) - 1
    if index >= len(link.codecs):
        raise ArgumentError(f"{url}: the world has {len(link.codecs)} robots, counted from 1")
    if index in link.robots:
        raise LinkBusy(f"{url} is open already in this program", hint="close it first")
    answer = link.ask(OPEN, ROBOT.pack(index)).decode("utf-8", "replace")
    if answer:
        message, _, hint = answer.partition("\n")
        raise LinkNotFound(f"{url}: {message}", hint=hint)
    link.was_used = True
    transport = link.robots[index] = LockstepTransport(str(url), link, index)
    return transport


def robots_of(url: Url) -> list[Url]:
    """Return what opens each robot of the marker's world; the URL itself if it names one, or there is one."""
    count = len(link_of(int(url.target)).codecs)
    if "robot" in url.keys or count == 1:
        return [url]
    return [replace(url, query=(("robot", str(number)),)) for number in range(1, count + 1)]


def _check(url: Url) -> Url:
    if not (url.target.isascii() and url.target.isdigit()) or len(url.target) > 9:
        raise ArgumentError(f"{url}: the target is the number of a file descriptor, such as lockstep://3")
    if "robot" in url.keys:
        text = url.keys["robot"]
        ROBOT_NUMBER.require(int(text) if text.isascii() and text.isdigit() and len(text) < 9 else text, "robot")
    return url


SCHEME = Scheme(
    open_lockstep, keys=("robot",), check=_check, speed=lambda url: MarkersTime(int(url.target)), robots=robots_of
)
"""``lockstep://FD``."""
