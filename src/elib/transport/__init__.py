"""How bytes travel: transports, and opening one by its URL."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import cast

from elib.errors import Unsupported
from elib.transport.base import Transport
from elib.transport.url import Url, parse_url, registered, speed_of

__all__ = ["Transport", "Url", "open_transport", "parse_url", "speed_of"]

_NOT_YET = {
    "wifi": "connect over Bluetooth (rfcomm://) or a serial port, or start a serial bridge and use tcp://",
    "replay": "this version of elib cannot replay recordings yet",
}


async def open_transport(url: Url | str) -> Transport:
    """Open the link that *url* names.

    The scheme is looked up among the entry points of the group ``elib.transports``; only its module is imported.

    Args:
        url: A URL, or the bare name of a serial port.

    Raises:
        ArgumentError: The URL cannot be.
        Unsupported: Nothing on this system opens such a link.
        LinkNotFound: There is no such port, host or world.
        LinkBusy: Somebody else holds it.
        LinkDenied: No right to open it.
        SimulationError: The event loop does not run at the speed asked for.
    """
    url = url if isinstance(url, Url) else parse_url(url)
    entry = registered(url.scheme)
    if entry is None:
        hint = _NOT_YET.get(url.scheme, "install elib anew: its entry points are missing")
        raise Unsupported(f"{url}: nothing here opens {url.scheme}://", hint=hint)
    opener = cast("Callable[[Url], Awaitable[Transport]]", entry.load())
    return await opener(url)
