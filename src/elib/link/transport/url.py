"""URLs that name a robot, such as ``serial:///dev/rfcomm0``, and the schemes that they begin with."""

from __future__ import annotations

import os
import re
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib import import_module
from types import MappingProxyType
from urllib import parse

from elib.base.errors import ArgumentError, Unsupported
from elib.base.rules import nearest
from elib.base.timebase import LoopSpeed
from elib.link.transport.base import Transport

OWN = {
    "serial": "elib.link.transport.serial",
    "rfcomm": "elib.link.transport.rfcomm",
    "tcp": "elib.link.transport.tcp",
    "wifi": "elib.link.transport.wifi",
    "sim": "elib.simulator.emulator.sim_transport",
    "lockstep": "elib.lab.lockstep",
    "replay": "elib.studies.fork",
    "webserial": "elib.studio.webserial",
}
"""The modules of elib's own schemes, each with its ``SCHEME``. They go by name, so that a link imports no simulator."""
GROUP = "elib.transports"
"""The group of entry points by which other packages add schemes, a :class:`Scheme` each."""

EXAMPLES = "sim://, serial:///dev/rfcomm0, rfcomm://10:00:E8:AA:BB:CC, tcp://127.0.0.1:4000, wifi://192.168.1.5"

HOST_PORT = re.compile(r"(\[[0-9a-fA-F:.]+\]|[\w.-]+):(\d{1,5})")
BLUETOOTH_ADDRESS = re.compile(r"[0-9A-Fa-f]{2}(:[0-9A-Fa-f]{2}){5}")
_PORT_NAME = re.compile(r"(COM\d+|(?:tty|rfcomm|cu\.|pts/).+)", re.IGNORECASE)

# The names of files need not be UTF-8.
_quote, _unquote = partial(parse.quote, errors="surrogateescape"), partial(parse.unquote, errors="surrogateescape")


@dataclass(frozen=True, slots=True)
class Url:
    """A URL, taken apart."""

    scheme: str  # what kind of link
    target: str  # what the scheme opens: a port, `host:port`, a Bluetooth address, a world; decoded
    query: tuple[tuple[str, str], ...] = ()  # the keys with their values as text, in the order given

    @property
    def keys(self) -> Mapping[str, str]:
        """The keys after ``?``; read only."""
        return MappingProxyType(dict(self.query))

    def __str__(self) -> str:
        text = f"{self.scheme}://{_quote(self.target, safe='/:[].@~')}"
        pairs = "&".join(f"{key}={_quote(value, safe='/:')}" if value else key for key, value in self.query)
        return f"{text}?{pairs}" if pairs else text


@dataclass(frozen=True, slots=True)
class Scheme:
    """A kind of link, named as its URLs begin."""

    open: Callable[[Url], Awaitable[Transport]]  # opens the link that a URL names
    keys: tuple[str, ...] = ()  # names of the keys that a URL may have after `?`
    # checks the target and the values of the keys, and returns the URL in its usual form. It raises ArgumentError where
    # one of them is wrong.
    check: Callable[[Url], Url] = lambda url: url
    speed: Callable[[Url], LoopSpeed] = lambda url: "real"  # returns how fast the event loop must run that opens a URL
    # returns what opens each robot of a URL that may name several
    robots: Callable[[Url], list[Url]] = lambda url: [url]
    flags: tuple[str, ...] = ()  # those of the keys that may stand without a value


def scheme_names() -> list[str]:
    """Return the names of all schemes."""
    from importlib.metadata import entry_points

    return sorted({*OWN, *(entry.name for entry in entry_points(group=GROUP))})


@lru_cache
def scheme_named(name: str) -> Scheme | None:
    """Return a scheme, or None if there is none of this name. Only the module of this scheme is imported.

    Raises:
        Unsupported: The entry point of another package cannot be loaded, or is not a :class:`Scheme`.
    """
    if name in OWN:
        own: Scheme = import_module(OWN[name]).SCHEME
        return own
    from importlib.metadata import entry_points  # importing it takes a sixth of the time of `elib.connect`

    entry = next(iter(entry_points(group=GROUP, name=name)), None)
    if entry is None:
        return None
    try:
        scheme = entry.load()
    except Exception as error:  # it is another package's code
        owner = "the package that brings it" if entry.dist is None else entry.dist.name
        raise Unsupported(
            f"the entry point {entry.value} of {name}:// cannot be loaded: {type(error).__name__}: {error}",
            hint=f"update or uninstall {owner}",
        ) from error
    if not isinstance(scheme, Scheme):
        raise Unsupported(
            f"the entry point {entry.value} of {name}:// is not an elib.link.transport.Scheme",
            hint="the package that brings it must name a Scheme there",
        )
    return scheme


def scheme_of(url: Url) -> Scheme:
    """Return the scheme of *url*.

    Raises:
        ArgumentError: There is no such scheme.
    """
    scheme = scheme_named(url.scheme)
    if scheme is None:
        names = scheme_names()
        hint = nearest(url.scheme, names)
        hint = f"{hint.removesuffix('?')}://?" if hint.startswith("did") else f"URLs look like {EXAMPLES}"
        raise ArgumentError(f"{str(url)!r}: there is no scheme {url.scheme}://", hint=hint)
    return scheme


def parse_url(text: object) -> Url:
    """Take a URL or the bare name of a serial port apart, and check every part.

    Raises:
        ArgumentError: A scheme, key, value or target is wrong; the message says which and why.
    """
    if not isinstance(text, str):
        raise ArgumentError(f"a robot's URL is a str, not {text!r}", hint=f"URLs look like {EXAMPLES}")
    text = text.strip()
    name, separator, rest = text.partition("://")
    if not separator:
        return Url("serial", port_path(text))
    target, _, query = rest.partition("?")
    if not query and "&" in target and "=" in target:
        hint = f"did you mean {name}://{target.replace('&', '?', 1)}?"
        raise ArgumentError(f"{text!r}: keys stand behind a ?, and there is none", hint=hint)
    url = Url(name.lower(), _unquote(target))
    scheme = scheme_of(url)
    return scheme.check(Url(url.scheme, url.target, _pairs(text, url.scheme, scheme, query)))


def speed_of(url: Url | str) -> LoopSpeed:
    """Return how fast time runs for *url*: the caller makes its event loop by it.

    Returns:
        ``"real"`` for everything but a simulation with the key ``speed``, and a replay: that is paced, so that
        decisions which depend on times are those of the recording.

    Raises:
        ArgumentError: The URL or its speed is wrong.
    """
    url = url if isinstance(url, Url) else parse_url(url)
    return scheme_of(url).speed(url)


def port_path(name: str) -> str:
    """Return the path of a serial port, which may be given by its bare name, such as ``rfcomm0``.

    Raises:
        ArgumentError: The name looks like something else; the hint says which URL is probably meant.
    """
    if name.startswith(("/", "./", "../", "~", "\\\\")):
        return os.path.expanduser(name)
    if _PORT_NAME.fullmatch(name):
        return name.upper() if name[:3].upper() == "COM" else f"/dev/{name}"
    from elib.base.files import WORLDS
    from elib.base.tables import shipped  # here: only a mistyped URL needs it

    hint = f"URLs look like {EXAMPLES}"
    scheme, _, rest = name.replace("//", ":", 1).partition(":")
    if BLUETOOTH_ADDRESS.fullmatch(name):
        hint = f"write rfcomm://{name}"
    elif scheme in scheme_names():
        hint = f"write {scheme}://{rest.lstrip('/') if scheme != 'serial' else rest}"
    elif HOST_PORT.fullmatch(name):
        hint = f"write tcp://{name}"
    elif name in shipped(WORLDS):
        hint = f"write sim://{name}"
    raise ArgumentError(f"{name!r} is neither a URL nor the name of a serial port", hint=hint)


def _pairs(text: str, name: str, scheme: Scheme, query: str) -> tuple[tuple[str, str], ...]:
    pairs: dict[str, str] = {}
    for part in filter(None, query.split("&")):
        key, separator, value = part.partition("=")
        key, value = _unquote(key), _unquote(value)
        if key not in scheme.keys:
            raise ArgumentError(f"{text!r}: {name}:// has no key {key!r}", hint=nearest(key, scheme.keys))
        if not value and (separator or key not in scheme.flags):
            raise ArgumentError(f"{text!r}: {key} has no value", hint=f"write {key}=VALUE")
        if key in pairs:
            raise ArgumentError(f"{text!r}: {key} is given twice")
        pairs[key] = value
    return tuple(pairs.items())
