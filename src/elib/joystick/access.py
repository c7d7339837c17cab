"""Who may come in: by which name the panel is called, from which page, and with which token."""

from __future__ import annotations

import asyncio
import ipaddress
import re
import secrets
import socket
from collections import OrderedDict
from collections.abc import Awaitable, Callable, MutableMapping
from hmac import compare_digest
from typing import Any
from urllib.parse import parse_qs

from elib.joystick.listening import EVERYWHERE

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

LOGIN = "/login"
LONGEST_FORM = 512
"""Bytes of a login form."""
FORM_TIME = 5.0
"""s that a login form may take to come."""
TRIES, AGAIN = 5.0, 0.1
"""Wrong tokens of one address in a row, and then a second."""
MOST_ADDRESSES = 1000
HOST = re.compile(r"(\[[0-9a-f:.]{2,39}\]|[a-z0-9._-]{1,253})(:[0-9]{1,5})?", re.IGNORECASE)
LOCAL = frozenset({"localhost", "127.0.0.1", "::1"})


class Bucket:
    """Lets so many things through a second, and some more at once.

    Args:
        rate: For long, per second.
        burst: At once.
        clock: s.
    """

    def __init__(self, rate: float, burst: float, clock: Callable[[], float]) -> None:
        self._rate, self._burst, self._clock = rate, burst, clock
        self._left, self._seen = burst, clock()

    def take(self, amount: float = 1.0) -> bool:
        """Return whether *amount* may pass now."""
        now = self._clock()
        self._left = min(self._burst, self._left + (now - self._seen) * self._rate)
        self._seen = now
        if self._left < amount:
            return False
        self._left -= amount
        return True


def headers_of(scope: Scope, name: bytes) -> list[str]:
    """Return every value of a header."""
    return [value.decode("latin-1") for key, value in scope["headers"] if key == name]


def header_of(scope: Scope, name: bytes) -> str | None:
    """Return a header's value; None if there is none or more than one."""
    found = headers_of(scope, name)
    return found[0] if len(found) == 1 else None


class Access:
    """The rules of one panel.

    Args:
        host: What it is bound to, as asked for.
        port: Its port.
        token: What a browser must show once; None where only this computer reaches the panel.
    """

    def __init__(self, host: str, port: int, token: str | None = None) -> None:
        self.token = token
        self._cookie = f"elib-{port}"  # browsers share cookies between the ports of a host
        self._session = secrets.token_urlsafe(32)
        own = socket.gethostname().lower()
        named = {host.lower()} - set(EVERYWHERE)
        self._names = LOCAL | named | ({own, f"{own}.local"} if token is not None else set())
        self._tries: OrderedDict[str, Bucket] = OrderedDict()

    def host_of(self, scope: Scope) -> str | None:
        """Return by what host and port the panel was called; None if it is not called so.

        A name that leads here all the same is that of somebody's page that had it changed (DNS rebinding).
        """
        text = header_of(scope, b"host")
        match = HOST.fullmatch(text or "")
        if match is None:
            return None
        name = match[1].strip("[]").lower()
        if name not in self._names and not (self.token is not None and _is_reached_at(scope, name)):
            return None
        return match[0]

    def is_own_origin(self, scope: Scope) -> bool:
        """Return whether a request comes from a page of the panel."""
        host, origin = self.host_of(scope), header_of(scope, b"origin")
        return host is not None and origin is not None and origin.lower() == f"http://{host.lower()}"

    def is_let_in(self, scope: Scope) -> bool:
        """Return whether a browser has shown the token."""
        if self.token is None:
            return True
        pairs = [pair.strip().partition("=") for text in headers_of(scope, b"cookie") for pair in text.split(";")]
        shown = [value for name, _, value in pairs if name == self._cookie]
        return len(shown) == 1 and _is_same(shown[0], self._session)

    def may_try(self, address: str) -> bool:
        """Return whether an address may try another token now."""
        bucket = self._tries.pop(address, None) or Bucket(AGAIN, TRIES, asyncio.get_running_loop().time)
        self._tries[address] = bucket
        while len(self._tries) > MOST_ADDRESSES:
            self._tries.popitem(last=False)
        return bucket.take()

    async def log_in(self, receive: Receive) -> str | None:
        """Read a login form; return the cookie that it earns, or None if the token is wrong."""
        form = await _body(receive)
        if form is None or self.token is None:
            return None
        try:
            shown = parse_qs(form.decode("ascii"), max_num_fields=4).get("token", [""])
        except ValueError:
            return None
        if len(shown) != 1 or not _is_same(shown[0].strip(), self.token):
            return None
        return f"{self._cookie}={self._session}; Path=/; HttpOnly; SameSite=Strict"


def _is_same(shown: str, secret: str) -> bool:
    """Compare in a time that does not tell how much of it is right."""
    return compare_digest(shown.encode("utf-8", "replace"), secret.encode())


def _is_reached_at(scope: Scope, name: str) -> bool:
    """Return whether a name is the very address at which this connection arrived."""
    try:
        return bool(scope.get("server")) and ipaddress.ip_address(name) == ipaddress.ip_address(scope["server"][0])
    except ValueError:
        return False


async def _body(receive: Receive) -> bytes | None:
    """Return a short body, or None if it is longer, does not end, or ends with the connection."""
    body = b""
    try:
        async with asyncio.timeout(FORM_TIME):
            while True:
                message = await receive()
                if message["type"] != "http.request":
                    return None
                body += bytes(message.get("body", b""))
                if len(body) > LONGEST_FORM:
                    return None
                if not message.get("more_body", False):
                    return body
    except TimeoutError:
        return None


def login_page(trouble: str = "") -> bytes:
    """Return the page that asks for the token.

    Args:
        trouble: Why the last one did not do, as plain words of ours.
    """
    note = f'<p role="alert">{trouble}</p>' if trouble else ""
    return _LOGIN_PAGE.replace("NOTE", note).encode()


_LOGIN_PAGE = f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>elib joystick</title>
<style>
:root {{ color-scheme: light dark; }}
body {{ font: 1.1rem/1.5 system-ui, sans-serif; max-width: 26rem; margin: 15vh auto; padding: 0 1rem; }}
input, button {{ font: inherit; padding: .5rem .8rem; }}
input {{ width: 100%; box-sizing: border-box; margin: .3rem 0 1rem; }}
[role=alert] {{ font-weight: bold; }}
</style>
</head>
<body>
<main>
<h1>elib joystick</h1>
NOTE
<form method="post" action="{LOGIN}">
<label for="token">Token, as printed where the panel was started</label>
<input id="token" name="token" type="password" autocomplete="off" required autofocus>
<button type="submit">Open the panel</button>
</form>
</main>
</body>
</html>
"""
