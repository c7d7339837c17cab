"""Who may use the page: by which name it is called, from which site, and with which token.

A browser runs the pages of strangers beside ours, and these can make it call any port of this computer. So the server
answers only to its own names (against DNS rebinding) and takes requests and WebSockets only from its own page (against
hijacking from another site). Other computers must show a token once.
"""

from __future__ import annotations

import ipaddress
import re
import secrets
import socket
from collections import OrderedDict
from hmac import compare_digest

from aiohttp import web

from elib.simulator.emulator.control_server import Bucket
from elib.simulator.emulator.loopback import EVERYWHERE

TRIES, AGAIN = 5.0, 0.1
"""Wrong tokens that one address may show at once, and after that per second."""
MAX_ADDRESSES = 1000
HOST = re.compile(r"(\[[0-9a-f:.]{2,39}\]|[a-z0-9._-]{1,253})(:[0-9]{1,5})?", re.IGNORECASE)
LOCAL = frozenset({"localhost", "127.0.0.1", "::1"})


class Access:
    """The rules of one server.

    Args:
        host: The address that it is bound to, as asked for.
        port: Its port.
        token: What a browser must show once; None where only this computer reaches the server.
    """

    def __init__(self, host: str, port: int, token: str | None = None) -> None:
        self.token = token
        self.cookie = f"elib-{port}"  # browsers share cookies between the ports of a host
        self.session = secrets.token_urlsafe(32)
        own = socket.gethostname().lower()
        named = {host.lower()} - set(EVERYWHERE)
        self._names = LOCAL | named | ({own, f"{own}.local"} if token is not None else set())
        self._tries: OrderedDict[str, Bucket] = OrderedDict()

    def host_of(self, request: web.BaseRequest) -> str | None:
        """Return the host and port by which the server was called; None if that is not one of its names.

        Another name that leads here belongs to a stranger's page (DNS rebinding).
        """
        match = HOST.fullmatch(_only(request, "Host") or "")
        if match is None:
            return None
        name = match[1].strip("[]").lower()
        if name not in self._names and not (self.token is not None and _is_reached_at(request, name)):
            return None
        return match[0]

    def is_own(self, request: web.BaseRequest) -> bool:
        """Return whether a request comes from the server's own page, or from a person who goes to it."""
        host = self.host_of(request)
        if "Origin" in request.headers or request.method == "POST":
            origin = _only(request, "Origin")
            return host is not None and origin is not None and origin.lower() == f"http://{host.lower()}"
        if request.headers.getall("Sec-Fetch-Site", []) in ([], ["same-origin"], ["none"]):
            return True
        is_visit = _only(request, "Sec-Fetch-Mode") == "navigate"
        return is_visit and _only(request, "Sec-Fetch-Dest") == "document"

    def is_let_in(self, request: web.BaseRequest) -> bool:
        """Return whether the browser has shown the token."""
        if self.token is None:
            return True
        pairs = [
            pair.strip().partition("=") for text in request.headers.getall("Cookie", []) for pair in text.split(";")
        ]
        shown = [value for name, _, value in pairs if name == self.cookie]
        return len(shown) == 1 and is_same(shown[0], self.session)

    def may_try(self, address: str) -> bool:
        """Return whether an address may try another token now."""
        bucket = self._tries.pop(address, None) or Bucket(AGAIN, TRIES)
        self._tries[address] = bucket
        while len(self._tries) > MAX_ADDRESSES:
            self._tries.popitem(last=False)
        return bucket.take()


def is_same(shown: str, secret: str) -> bool:
    """Compare two texts in a time that does not tell how much of them is equal."""
    return compare_digest(shown.encode("utf-8", "replace"), secret.encode())


def _only(request: web.BaseRequest, name: str) -> str | None:
    """Return a header's value; None if there is none or more than one."""
    found = request.headers.getall(name, [])
    return found[0] if len(found) == 1 else None


def _is_reached_at(request: web.BaseRequest, name: str) -> bool:
    """Return whether a name is the address at which this connection arrived."""
    own = ("",) if request.transport is None else request.transport.get_extra_info("sockname") or ("",)
    try:
        return ipaddress.ip_address(name) == ipaddress.ip_address(own[0])
    except ValueError:
        return False
