"""Transports, which carry bytes between a program and a robot, and how a URL opens one."""

from __future__ import annotations

from elib.link.transport.base import Transport
from elib.link.transport.url import Scheme, Url, parse_url, scheme_of, speed_of

__all__ = ["Scheme", "Transport", "Url", "open_transport", "parse_url", "robots_of", "speed_of"]


async def open_transport(url: Url | str) -> Transport:
    """Open the link that *url* names.

    Only the module of its scheme is imported.

    Args:
        url: A URL, or the bare name of a serial port.

    Raises:
        ArgumentError: The URL is wrong.
        Unsupported: Nothing on this system opens such a link.
        LinkNotFound: There is no such port, host or world.
        LinkBusy: Another program holds it.
        LinkDenied: This user may not open it.
        SimulationError: The event loop does not run at the speed asked for.
    """
    url = url if isinstance(url, Url) else parse_url(url)
    return await scheme_of(url).open(url)


def robots_of(url: Url | str) -> list[Url]:
    """Return what opens each robot that *url* names, in order: the URL itself, unless its scheme knows of several.

    Raises:
        ArgumentError: The URL is wrong.
        LinkNotFound: There is no such world.
        SimulationError: The world's file breaks a rule, or it has no robot.
    """
    url = url if isinstance(url, Url) else parse_url(url)
    return scheme_of(url).robots(url)
