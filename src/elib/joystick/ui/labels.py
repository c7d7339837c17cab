"""Short names of robots, for tabs and cards: a URL is long, and its end tells more than its beginning."""

from __future__ import annotations

from collections.abc import Iterable

from elib.errors import ElibError
from elib.joystick.pilot import Pilot
from elib.transport import parse_url

LONGEST = 28
"""Characters of a name that fit on a tab."""


def short(url: str) -> str:
    """Return a robot's URL as a few words: ``rfcomm0``, ``crowd 3``, ``192.168.1.20:1000``."""
    try:
        found = parse_url(url)
    except ElibError:
        return url
    place = found.target.rstrip("/").rpartition("/")[2] or ("arena" if found.scheme == "sim" else found.scheme)
    return f"{place} {found.keys.get('robot', '')}".strip()


def labels(pilots: Iterable[Pilot]) -> list[str]:
    """Return a name for each, and no name twice."""
    found: list[str] = []
    for pilot in pilots:
        name = short(pilot.url) if pilot.name == pilot.url else pilot.name
        name = name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…"
        same = sum(each == name or each.startswith(f"{name} (") for each in found)
        found.append(f"{name} ({same + 1})" if same else name)
    return found


__all__ = ["labels", "short"]
