"""``webserial://``: a robot on the serial port that the page of the studio holds.

The window of the page owns the port, not the worker: it can still stop the robot when the worker is ended.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from elib.base.errors import LinkBusy, LinkLost, LinkNotFound, SimulationError, Unsupported
from elib.base.timebase import HostedLoop, host
from elib.link.transport.base import BufferedTransport, Transport
from elib.link.transport.url import Scheme, Url

Send = Callable[[bytes], object]


class Port:
    """The page's serial port, as the worker sees it.

    Args:
        send: Gives bytes to the page, which writes them to the port.
        wake: Ends the wait of the program, because something has come.
    """

    def __init__(self, send: Send, guard: Send, wake: Callable[[], object]) -> None:
        self.is_there = False  # whether a person has chosen a port, and it is not unplugged
        # tells the page which bytes stop the robot, should Python be ended; none while no program has it open
        self.guard = guard
        self.transport: WebSerial | None = None  # the link that uses it, or None
        self.send = send
        self._wake = wake

    def opened(self) -> None:
        """Note that a person has chosen a port."""
        self.is_there = True

    def received(self, data: bytes) -> None:
        """Take bytes from the robot."""
        self._tell(lambda link: link.feed(data))

    def lost(self, reason: str) -> None:
        """Note that the port is gone, for a reason in words."""
        self.is_there = False
        self._tell(lambda link: link.lose(f"{link.url}: {reason}", hint="plug it in, and choose it again"))

    def _tell(self, what: Callable[[WebSerial], object]) -> None:
        link = self.transport
        if link is not None:
            link.loop.call_soon(what, link)
            self._wake()


port: Port | None = None
"""The port of the page; None on a computer."""


class WebSerial(BufferedTransport):
    """The link to a robot over the port of the page."""

    def __init__(self, url: str, line: Port) -> None:
        super().__init__(url)
        self.loop = asyncio.get_running_loop()  # the event loop of the program that has opened it
        self._line = line
        line.transport = self

    def abort(self) -> None:
        """Leave the port to the page, which keeps it open."""
        if not self._closed:
            self._mark_closed()
            self._line.transport = None

    def _push(self, data: bytes) -> None:
        if not self._line.is_there:
            raise LinkLost(f"{self._url}: the port is gone", hint="plug it in, and choose it again")
        self._line.send(data)


async def open_port(url: Url) -> Transport:
    """Use the port that a person has chosen in the page.

    Raises:
        Unsupported: Python runs in no page.
        LinkNotFound: No port was chosen, or it is unplugged.
        LinkBusy: The program has it open already.
        SimulationError: The event loop does not keep real time.
    """
    place, loop = host(), asyncio.get_running_loop()
    if port is None or place is None:
        raise Unsupported(f"{url} is a port of the studio's page", hint="serial:// opens a port of this computer")
    if not port.is_there:
        raise LinkNotFound(f"{url}: no port is chosen", hint="click Robot, then Real robot, and choose its port")
    if port.transport is not None:
        raise LinkBusy(f"{url} is open already", hint="close it first, or use the robot that is open")
    if not isinstance(loop, HostedLoop) or loop.factor != 1.0:
        raise SimulationError(f"{url} works in real time, and this event loop does not", hint="leave speed= out")
    place.speed = 1.0
    return WebSerial(str(url), port)


def _check(url: Url) -> Url:
    return Url(url.scheme, "", url.query)


SCHEME = Scheme(open_port, check=_check)
"""``webserial://``."""
