"""What stands between the network and the panel: every request and every message of every page passes here first.

A browser runs the pages of strangers beside ours, and these can make it call any port of this computer. So the panel
answers to its own names alone (against DNS rebinding), opens a WebSocket only for a page of its own (against hijacking
from another site), takes nothing but what its own page sends, and tells the browser to let that page run no other
script and to talk to nobody else.
"""

from __future__ import annotations

import asyncio
import json
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from elib.errors import ArgumentError
from elib.joystick.access import (
    LOGIN,
    Access,
    Application,
    Bucket,
    Message,
    Receive,
    Scope,
    Send,
    header_of,
    headers_of,
    login_page,
)
from elib.joystick.packets import Conversation, IsKnown, client_of

RATE, BURST = 100.0, 200.0
"""Messages of one page: a second for long, and at once. Sixty come from a hand that drags, ten from one that drives."""
OPENINGS, OPENINGS_AT_ONCE = 5.0, 30.0
"""Pages that are built: a second for long, and at once."""
MOST_PAGES = 64
"""Pages and their WebSockets at a time."""
LONGEST_PATH = 1000
SOCKET = "/_nicegui_ws/"
PLAIN, HTML = "text/plain; charset=utf-8", "text/html; charset=utf-8"
POLICY_VIOLATION = 1008
"""Close code of a WebSocket whose other end does what it must not (RFC 6455, 7.4.1)."""

HEADERS: Mapping[str, str] = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",  # with no-referrer the login form would come without its origin
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=(), payment=(), usb=()",
}
POLICY = (
    "default-src 'self'; script-src 'self' 'nonce-{nonce}' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' ws://{host}; object-src 'none'; "
    "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
"""Scripts come from here or bear the page's own number. NiceGUI needs ``eval`` for what the server has the page do."""
UNTRUSTED = (b"x-forwarded-", b"forwarded", b"x-real-ip")
"""Headers by which a proxy tells where it stands: there is none, so they are somebody's invention."""


@dataclass
class Surroundings:
    """What the guard asks of what it guards.

    Attributes:
        is_route: Whether something answers to a request.
        is_known: Whether a page, an element and a listener are there.
        pages: How many pages there are.
        loads: Reads JSON as it will be read later.
    """

    is_route: Callable[[Scope], bool] = lambda scope: True
    is_known: IsKnown = lambda client, element, listener: True
    pages: Callable[[], int] = lambda: 0
    loads: Callable[[str], object] = field(default=json.loads)


class Guard:
    """Lets through what a page of the panel may do.

    Args:
        application: What is guarded.
        access: Who may come in.
        surroundings: What is asked of the application.
    """

    def __init__(self, application: Application, access: Access, surroundings: Surroundings | None = None) -> None:
        self._application = application
        self._access = access
        self._around = surroundings or Surroundings()
        self._openings: Bucket | None = None
        self._sockets = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request, or serve one WebSocket."""
        match scope["type"]:
            case "http":
                await self._request(scope, receive, send)
            case "websocket":
                await self._socket(scope, receive, send)
            case _:
                await self._application(scope, receive, send)

    # -- requests --

    async def _request(self, scope: Scope, receive: Receive, send: Send) -> None:
        host = self._access.host_of(scope)
        if host is None:
            await _say(send, 403, "This panel answers to its own address alone.")
            return
        send = _Armoured(send, host)
        refusal = self._refusal(scope)
        if refusal is not None:
            await _say(send, *refusal)
        elif scope["path"] == LOGIN and self._access.token is not None:
            await self._login(scope, receive, send)
        elif not self._access.is_let_in(scope):
            await _say(send, 401, login_page(), HTML)
        elif scope["method"] == "POST":
            await _say(send, 405, "Nothing is to be sent here.")
        elif scope["path"].startswith(SOCKET) or not self._around.is_route(scope):
            await _say(send, 404, "There is no such page.")
        elif not scope["path"].startswith("/_nicegui/") and not self._may_open():
            await _say(send, 503, "Too many pages are open or being opened. Close some, and try again.")
        else:
            await self._application(_cleaned(scope), receive, send)

    def _refusal(self, scope: Scope) -> tuple[int, str] | None:
        """Return why a request is refused whoever makes it, or None."""
        if _is_odd(scope):
            return 400, "That is no address of a page."
        if scope["method"] not in ("GET", "HEAD", "POST"):
            return 405, "Pages are only to be looked at."
        if not self._is_own(scope):
            return 403, "Another site may not use this panel."
        if scope["method"] != "POST" and _has_body(scope):
            return 400, "Nothing is to be sent here."
        return None

    def _is_own(self, scope: Scope) -> bool:
        """Return whether a request may come from a page of the panel, or from a person who goes to it."""
        if headers_of(scope, b"origin") or scope["method"] == "POST":
            return self._access.is_own_origin(scope)
        if headers_of(scope, b"sec-fetch-site") in ([], ["same-origin"], ["none"]):
            return True
        is_visit = header_of(scope, b"sec-fetch-mode") == "navigate"
        return is_visit and header_of(scope, b"sec-fetch-dest") == "document"

    def _may_open(self) -> bool:
        if self._openings is None:
            self._openings = Bucket(OPENINGS, OPENINGS_AT_ONCE, asyncio.get_running_loop().time)
        return self._around.pages() < MOST_PAGES and self._openings.take()

    async def _login(self, scope: Scope, receive: Receive, send: Send) -> None:
        address = str((scope.get("client") or ("",))[0])
        if scope["method"] != "POST":
            await _say(send, 200, login_page(), HTML)
        elif not self._access.may_try(address):
            await _say(send, 429, login_page("Too many tries; wait ten seconds."), HTML)
        elif (cookie := await self._access.log_in(receive)) is None:
            await _say(send, 403, login_page("That is not the token."), HTML)
        else:
            await _say(send, 303, "", more=[(b"location", b"/"), (b"set-cookie", cookie.encode())])

    # -- WebSockets --

    async def _socket(self, scope: Scope, receive: Receive, send: Send) -> None:
        await receive()  # the opening
        client = self._who_opens(scope)
        if client is None:
            await send({"type": "websocket.close", "code": POLICY_VIOLATION})
            return
        line = _Line(receive, send, Conversation(client, self._around.is_known, self._around.loads))
        self._sockets += 1
        try:
            await self._application(_cleaned(scope), line.receive, line.send)
        finally:
            self._sockets -= 1

    def _who_opens(self, scope: Scope) -> str | None:
        """Return the page that may open a WebSocket, or None."""
        is_own = self._access.is_own_origin(scope) and self._access.is_let_in(scope)
        if not is_own or _is_odd(scope) or scope["path"] != f"{SOCKET}socket.io/" or self._sockets >= MOST_PAGES:
            return None
        try:
            return client_of(scope["query_string"])
        except ArgumentError:
            return None


class _Line:
    """One page's WebSocket as the application sees it."""

    def __init__(self, receive: Receive, send: Send, conversation: Conversation) -> None:
        self._receive, self._send, self._conversation = receive, send, conversation
        self._rate = Bucket(RATE, BURST, asyncio.get_running_loop().time)
        self._has_begun = self._is_closed = False

    async def receive(self) -> Message:
        """Return the next message that may pass; one that may not ends the connection."""
        if not self._has_begun:
            self._has_begun = True
            return {"type": "websocket.connect"}
        while not self._is_closed:
            message = await self._receive()
            if message["type"] != "websocket.receive":
                return message
            text = message.get("text")
            try:
                if text is None:
                    raise ArgumentError("a message is no text")
                if not self._rate.take():
                    raise ArgumentError("too many messages")
                if self._conversation.receives(text):
                    return message
            except ArgumentError as error:
                await self._end(error.message)
        return {"type": "websocket.disconnect", "code": POLICY_VIOLATION}

    async def send(self, message: Message) -> None:
        """Send what the application says, until the end."""
        if self._is_closed:
            raise OSError("the page did what it must not, and is disconnected")
        if message["type"] == "websocket.send" and message.get("text") is not None:
            self._conversation.sends(message["text"])
        self._is_closed = message["type"] == "websocket.close"
        await self._send(message)

    async def _end(self, reason: str) -> None:
        self._is_closed = True
        await self._send({"type": "websocket.close", "code": POLICY_VIOLATION, "reason": reason})


class _Armoured:
    """Sends an answer with the headers that keep a browser from harm, and marks the page's own scripts."""

    def __init__(self, send: Send, host: str) -> None:
        self._send = send
        self._nonce = secrets.token_urlsafe(16)
        self._policy = POLICY.format(nonce=self._nonce, host=host)
        self._start: Message | None = None
        self._page: bytearray | None = None

    async def __call__(self, message: Message) -> None:
        """Send a part of the answer; a page is held back until it is whole."""
        if message["type"] == "http.response.start":
            own = {name.lower().encode() for name in (*HEADERS, "Content-Security-Policy")}
            headers = [(name, value) for name, value in message["headers"] if name.lower() not in own]
            headers += [(name.lower().encode(), value.encode()) for name, value in HEADERS.items()]
            headers.append((b"content-security-policy", self._policy.encode()))
            self._start = {**message, "headers": headers}
            if any(name == b"content-type" and value.startswith(b"text/html") for name, value in headers):
                self._page = bytearray()
                return
            await self._send(self._start)
        elif self._page is not None and self._start is not None:
            self._page += message.get("body", b"")
            if not message.get("more_body", False):
                # NiceGUI writes every "<" of a text as "&lt;": what begins so is a script of the page itself.
                body = bytes(self._page).replace(b"<script", f'<script nonce="{self._nonce}"'.encode())
                headers = [(name, value) for name, value in self._start["headers"] if name != b"content-length"]
                headers.append((b"content-length", str(len(body)).encode()))
                await self._send({**self._start, "headers": headers})
                await self._send({"type": "http.response.body", "body": body})
        else:
            await self._send(message)


async def _say(
    send: Send, status: int, text: str | bytes, kind: str = PLAIN, more: Sequence[tuple[bytes, bytes]] = ()
) -> None:
    """Send a short answer of our own."""
    body = text.encode() if isinstance(text, str) else text
    headers = [(b"content-type", kind.encode()), (b"content-length", str(len(body)).encode())]
    headers += [(b"cache-control", b"no-store"), (b"connection", b"close"), *more]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


def _cleaned(scope: Scope) -> Scope:
    return {**scope, "headers": [pair for pair in scope["headers"] if not pair[0].startswith(UNTRUSTED)]}


def _has_body(scope: Scope) -> bool:
    lengths = headers_of(scope, b"content-length")
    return bool(headers_of(scope, b"transfer-encoding")) or any(length != "0" for length in lengths)


def _is_odd(scope: Scope) -> bool:
    """Return whether a path is written as no page of ours is: out of its folder, or with what cannot be shown."""
    raw, path = scope.get("raw_path") or b"", scope["path"]
    is_long = len(raw) > LONGEST_PATH or len(scope["query_string"]) > LONGEST_PATH
    parts = path.split("/")
    return (
        is_long or not path.startswith("/") or "\\" in path or not path.isprintable() or ".." in parts or "." in parts
    )
