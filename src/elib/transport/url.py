"""The URLs that name a robot: ``sim://``, ``serial:///dev/rfcomm0``, ``tcp://host:port``, ``rfcomm://10:00:E8:..``."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from importlib.resources import files
from types import MappingProxyType
from typing import TYPE_CHECKING
from urllib.parse import quote, unquote

from elib.errors import ArgumentError
from elib.timebase import LoopSpeed, Paced
from elib.transport.simulation import KEYS as SIMULATION_KEYS
from elib.transport.simulation import SimulationSettings, parse_speed

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

KEYS: Mapping[str, Iterable[str]] = {
    "serial": (),
    "rfcomm": ("channel",),
    "tcp": (),
    "sim": SIMULATION_KEYS,
    "replay": ("speed", "fork", "world"),
    "wifi": (),
}
"""The schemes elib knows and the keys each one takes after ``?``."""

EXAMPLES = "sim://, serial:///dev/rfcomm0, rfcomm://10:00:E8:AA:BB:CC, tcp://127.0.0.1:4000"

EPUCK2_CHANNEL = 2
"""RFCOMM channel of the e-puck2's line, the second of its services GDB, UART and SPI (protocol.md, 1.1)."""

_PORT_NAME = re.compile(r"(COM\d+|(?:tty|rfcomm|cu\.|pts/).+)", re.IGNORECASE)
_WORLD_NAME = re.compile(r"[a-z-]+")
_HOST_PORT = re.compile(r"(\[[0-9a-fA-F:.]+\]|[\w.-]+):(\d{1,5})")
_BLUETOOTH = re.compile(r"[0-9A-Fa-f]{2}(:[0-9A-Fa-f]{2}){5}")


@dataclass(frozen=True, slots=True)
class Url:
    """A checked URL.

    Attributes:
        scheme: What kind of link: a key of :data:`KEYS` or a registered entry point.
        target: What the scheme opens: a port, ``host:port``, a Bluetooth address, a world; decoded.
        query: The keys with their values as text, in the order given.
    """

    scheme: str
    target: str
    query: tuple[tuple[str, str], ...] = ()

    @property
    def keys(self) -> Mapping[str, str]:
        """The keys after ``?``; read only."""
        return MappingProxyType(dict(self.query))

    def __str__(self) -> str:
        text = f"{self.scheme}://{quote(self.target, safe='/:[].@~')}"
        pairs = "&".join(f"{key}={quote(value, safe='/:')}" for key, value in self.query)
        return f"{text}?{pairs}" if pairs else text


def parse_url(text: object) -> Url:
    """Take a URL or the bare name of a serial port apart, and check every part.

    Raises:
        ArgumentError: A scheme, key, value or target that cannot be; the message says which and why.
    """
    if not isinstance(text, str):
        raise ArgumentError(f"a robot's URL is a str, not {text!r}", hint=f"URLs look like {EXAMPLES}")
    text = text.strip()
    scheme, separator, rest = text.partition("://")
    if not separator:
        return Url("serial", _bare_port(text))
    scheme = scheme.lower()
    if scheme not in KEYS and registered(scheme) is None:
        near = get_close_matches(scheme, KEYS, 1)
        meant = f"did you mean {near[0]}://?" if near else f"URLs look like {EXAMPLES}"
        raise ArgumentError(f"{text!r}: there is no scheme {scheme}://", hint=meant)
    target, _, query = rest.partition("?")
    url = Url(scheme, unquote(target), _pairs(text, scheme, query))
    return _check(text, url)


def speed_of(url: Url | str) -> LoopSpeed:
    """Return how fast time runs for *url*: the caller makes its event loop by it.

    Returns:
        ``"real"`` for everything but a simulation with the key ``speed``, and a replay: that is paced, so that
        decisions which hang on times are those of the recording.

    Raises:
        ArgumentError: The URL or its speed cannot be.
    """
    url = url if isinstance(url, Url) else parse_url(url)
    speed = parse_speed(url.keys.get("speed", "real"))
    if url.scheme != "replay" or "fork" in url.keys or speed == "max":
        return speed
    return Paced(1.0 if speed == "real" else speed)


def simulation_of(url: Url) -> SimulationSettings:
    """Return the settings of a ``sim://`` URL.

    Raises:
        ArgumentError: A value is out of its range.
    """
    return SimulationSettings.from_text(url.target or "arena", url.keys)


def registered(scheme: str) -> EntryPoint | None:
    """Return the entry point in the group ``elib.transports`` that opens *scheme*, if there is one."""
    from importlib.metadata import entry_points  # it takes longer to import than all of ours

    return next(iter(entry_points(group="elib.transports", name=scheme)), None)


def bluetooth_address(url: Url) -> tuple[str, int]:
    """Return address and RFCOMM channel of an ``rfcomm://`` URL.

    Raises:
        ArgumentError: No address of six hexadecimal pairs, or a channel that is not 1 to 30.
    """
    if not _BLUETOOTH.fullmatch(url.target):
        raise ArgumentError(
            f"{url.target!r} is no Bluetooth address", hint="it has six pairs: rfcomm://10:00:E8:AA:BB:CC"
        )
    channel = url.keys.get("channel", "1")  # where the e-puck1 listens (protocol.md, 1.1)
    if not channel.isascii() or not channel.isdigit() or not 1 <= int(channel) <= 30:
        raise ArgumentError(
            f"channel is {channel!r}; it must be from 1 to 30",
            hint=f"an e-puck1 listens on channel 1, an e-puck2 on channel {EPUCK2_CHANNEL}",
        )
    return url.target.upper(), int(channel)


def host_and_port(url: Url) -> tuple[str, int]:
    """Return host and port of a ``tcp://`` URL.

    Raises:
        ArgumentError: A part is missing, or the port is not 1 to 65535.
    """
    match = _HOST_PORT.fullmatch(url.target.rstrip("/"))
    if match is None:
        raise ArgumentError(
            f"{url.target!r} is not HOST:PORT", hint="a URL of this kind looks like tcp://192.168.1.5:4000"
        )
    port = int(match[2])
    if not 1 <= port <= 65535:
        raise ArgumentError(f"port is {port}; it must be from 1 to 65535")
    return match[1].strip("[]"), port


def _check(text: str, url: Url) -> Url:
    match url.scheme:
        case "sim":
            simulation_of(url)
        case "replay":
            parse_speed(url.keys.get("speed", "real"))
        case "rfcomm":
            bluetooth_address(url)
        case "tcp":
            host_and_port(url)
        case "serial":
            return Url("serial", _serial_port(text, url.target))
    if url.scheme in ("replay", "wifi") and not url.target:
        raise ArgumentError(f"{text!r} names no {'file' if url.scheme == 'replay' else 'host'}")
    return url


def _pairs(text: str, scheme: str, query: str) -> tuple[tuple[str, str], ...]:
    pairs: dict[str, str] = {}
    for part in filter(None, query.split("&")):
        key, separator, value = part.partition("=")
        key, value = unquote(key), unquote(value)
        allowed = list(KEYS.get(scheme, (key,)))
        if key not in allowed:
            near = get_close_matches(key, allowed, 1)
            meant = f"did you mean {near[0]}?" if near else f"there are {', '.join(allowed) or 'none'}"
            raise ArgumentError(f"{text!r}: {scheme}:// has no key {key!r}", hint=meant)
        if not separator or not value:
            raise ArgumentError(f"{text!r}: {key} has no value", hint=f"write {key}=VALUE")
        if key in pairs:
            raise ArgumentError(f"{text!r}: {key} is given twice")
        pairs[key] = value
    return tuple(pairs.items())


def _serial_port(text: str, target: str) -> str:
    if not target:
        raise ArgumentError(f"{text!r} names no port", hint="write serial:///dev/rfcomm0 or serial://COM3")
    if target.startswith("dev/"):
        raise ArgumentError(f"{text!r} has two slashes where three belong", hint=f"write serial:///{target}")
    is_bare = "/" not in target and _PORT_NAME.fullmatch(target)
    return _bare_port(target) if is_bare else os.path.expanduser(target)


def _bare_port(name: str) -> str:
    """Complete the bare name of a serial port; refuse what looks like something else."""
    if name.startswith(("/", "./", "../", "~", "\\\\")):
        return os.path.expanduser(name)
    if _PORT_NAME.fullmatch(name):
        return name.upper() if name[:3].upper() == "COM" else f"/dev/{name}"
    hint = f"URLs look like {EXAMPLES}"
    if _BLUETOOTH.fullmatch(name):
        hint = f"write rfcomm://{name}"
    elif name.partition(":")[0] in KEYS:
        scheme, _, rest = name.partition(":")
        hint = f"write {scheme}://{rest.lstrip('/') if scheme != 'serial' else rest}"
    elif _HOST_PORT.fullmatch(name):
        hint = f"write tcp://{name}"
    elif _WORLD_NAME.fullmatch(name) and files("elib").joinpath("worlds", f"{name}.toml").is_file():
        hint = f"write sim://{name}"
    raise ArgumentError(f"{name!r} is neither a URL nor the name of a serial port", hint=hint)
