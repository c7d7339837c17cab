"""How bytes travel: transports, and opening one by its URL."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TypeVar, cast

from elib.errors import Unsupported
from elib.transport.base import Transport
from elib.transport.url import Url, parse_url, registered, speed_of

__all__ = ["Transport", "Url", "open_transport", "parse_url", "robots_of", "several", "speed_of"]

OpenerT = TypeVar("OpenerT", bound="Callable[[Url], Awaitable[Transport]]")

_NOT_YET = {
    "wifi": "connect over Bluetooth (rfcomm://) or a serial port, or start a serial bridge and use tcp://",
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


def several(expand: Callable[[Url], list[Url]]) -> Callable[[OpenerT], OpenerT]:
    """Mark the opener of a scheme whose URLs may name several robots.

    Args:
        expand: Returns what opens each of them; a URL that names one robot is its own expansion.
    """

    def mark(opener: OpenerT) -> OpenerT:
        vars(opener)["expand"] = expand
        return opener

    return mark


def robots_of(url: Url | str) -> list[Url]:
    """Return what opens each robot that *url* names, in order: the URL itself, unless its scheme knows of several.

    Raises:
        ArgumentError: The URL cannot be.
        LinkNotFound: There is no such world.
        SimulationError: The world's file breaks a rule, or it has no robot.
    """
    url = url if isinstance(url, Url) else parse_url(url)
    entry = registered(url.scheme)
    expand = None if entry is None else getattr(entry.load(), "expand", None)
    return [url] if expand is None else cast("list[Url]", expand(url))
