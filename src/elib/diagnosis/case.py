"""One link under examination: what is open, and what the checks so far have found out."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field

from elib.diagnosis.line import Exchange
from elib.errors import ElibError, LinkError
from elib.session import Session
from elib.transport import Transport, Url
from elib.transport.ports import holders, list_ports
from elib.transport.serial import busy

Opener = Callable[[Url], Awaitable[Transport]]
"""Opens a link: :func:`elib.transport.open_transport`, or what a test puts in its place."""


@dataclass(slots=True)
class Case:
    """What the checks share.

    Attributes:
        url: The link.
        opener: What opens it.
        remark: How the link was chosen; empty where the user named it.
        transport: The open link, or None.
        error: Why it did not open, or None.
        opening_time: How long opening took, s.
        exchange: What was heard before anything relied on the protocol, or None.
        session: The robot's session once it was recognised, or None.
        round_trip: Median of the round trips, s; 0 where not measured.
    """

    url: Url
    opener: Opener
    remark: str = ""
    transport: Transport | None = None
    error: ElibError | None = None
    opening_time: float = 0.0
    exchange: Exchange | None = None
    session: Session | None = None
    round_trip: float = 0.0
    _was_tried: bool = field(default=False, repr=False)

    @property
    def is_port(self) -> bool:
        """Whether the link is a serial port of this computer."""
        return self.url.scheme == "serial"

    @property
    def port_exists(self) -> bool:
        """Whether the system has this serial port."""
        return os.path.exists(self.url.target) or self.url.target in list_ports()

    async def attempt(self) -> None:
        """Open the link, once; what came of it is kept. A port that somebody else has open is not touched."""
        if self._was_tried:
            return
        self._was_tried = True
        if self.is_port:
            names = await asyncio.to_thread(holders, self.url.target)
            if names:
                self.error = busy(self.url, names)
                return
        loop = asyncio.get_running_loop()
        began = loop.time()
        try:
            self.transport = await self.opener(self.url)
        except ElibError as error:
            self.error = error
        except OSError as error:  # an opener of somebody else's
            self.error = LinkError(f"{self.url}: {error.strerror or error}")
        self.opening_time = loop.time() - began

    def plain(self, error: ElibError) -> str:
        """Return an error's message without the link's name, which the page has in its title."""
        return error.message.removeprefix(f"{self.url}: ").removeprefix(f"{self.url} ")

    async def close(self) -> None:
        """Free the link."""
        if self.session is not None:
            await self.session.close()
        elif self.transport is not None:
            await self.transport.close()
