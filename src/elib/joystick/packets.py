"""What a page's WebSocket may say: exactly what NiceGUI's own page says, and nothing else.

A message is a packet of Engine.IO 4 around one of Socket.IO 5: ``3`` answers a ping, ``1`` ends the connection, ``40``
and ``41`` enter and leave, ``42[NAME, {...}]`` is an event. All of it comes from whoever opened the socket, so names,
types and lengths are checked here, before any library of ours or others takes it apart. What an event's arguments mean
is for its handler to check.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from urllib.parse import parse_qsl

from elib.errors import ArgumentError

LONGEST = 16 * 1024
"""Characters of a message; the longest that means anything, a line for the console, has some hundred."""
MOST_ARGUMENTS = 16
MOST_NUMBER = 2**53
"""Beyond, a page counts no longer one by one."""

UUID = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")
EVENT = re.compile(r"42[0-9]{0,6}(\[.*)", re.DOTALL)
NUMBER = re.compile(r"[0-9]{1,12}")
NAME = re.compile(r"[\w-]{0,64}", re.ASCII)
QUERY: Mapping[str, re.Pattern[str]] = {
    "EIO": re.compile("4"),
    "transport": re.compile("websocket"),
    "client_id": UUID,
    "tab_id": UUID,
    "document_id": UUID,
    "old_tab_id": re.compile(f"{UUID.pattern}|null"),
    "next_message_id": NUMBER,
    "implicit_handshake": re.compile("true|false"),
    "t": NAME,
}
"""What stands in the WebSocket's URL."""
REQUIRED = frozenset({"EIO", "transport", "client_id", "tab_id", "document_id", "next_message_id"})

IsKnown = Callable[[str, int, str], bool]


def client_of(query: bytes) -> str:
    """Return the page that opens a WebSocket, by what stands in its URL.

    Raises:
        ArgumentError: NiceGUI's own page would not say that.
    """
    try:
        pairs = parse_qsl(query.decode("ascii"), keep_blank_values=True, strict_parsing=True, max_num_fields=len(QUERY))
    except ValueError:
        raise ArgumentError("the query cannot be read") from None
    found = dict(pairs)
    if len(found) != len(pairs) or not found.keys() >= REQUIRED or not found.keys() <= QUERY.keys():
        raise ArgumentError("the query is not that of a page")
    for key, value in pairs:
        if not QUERY[key].fullmatch(value):
            raise ArgumentError(f"{key} cannot be what it is")
    return found["client_id"]


class Conversation:
    """One WebSocket: what was said on it decides what may be said next.

    Args:
        client: The page that opened it.
        is_known: Tells of a page, an element and a listener whether they are there.
        loads: Reads JSON as those will to whom it is passed on.
    """

    def __init__(self, client: str, is_known: IsKnown, loads: Callable[[str], object] = json.loads) -> None:
        self.client = client
        self._is_known = is_known
        self._loads = loads
        self._has_entered = False
        self._pings = 0

    def sends(self, text: str) -> None:
        """Note what is sent to the page: a ping may be answered, once."""
        if text == "2":
            self._pings += 1

    def receives(self, text: str) -> bool:
        """Check a message from the page; return whether it is to be passed on.

        Raises:
            ArgumentError: NiceGUI's own page would not say that.
        """
        if len(text) > LONGEST:
            raise ArgumentError(f"a message has {len(text)} characters; it may have {LONGEST}")
        match text:
            case "3" if self._pings:
                self._pings -= 1
                return True
            case "40" if not self._has_entered:
                self._has_entered = True
                return True
            case "1" | "41":
                return True
        match = EVENT.fullmatch(text)
        if match is None or not self._has_entered:
            raise ArgumentError("a message is none that a page sends now")
        return self._event(self._json(match[1]))

    def _event(self, event: object) -> bool:
        match event:
            case [
                "event",
                {"client_id": self.client, "id": int(number), "listener_id": str(listener), "args": list(arguments)},
            ]:
                return self._click(number, listener, arguments)
            case ["ack", {"client_id": self.client, "next_message_id": int(number)}] if _counts(number):
                return True
            case ["javascript_response", {"client_id": self.client, "request_id": str(name)}] if UUID.fullmatch(name):
                return True
            case ["log", {"client_id": self.client}]:
                return False  # the terminal is not for a page to write on
            case ["handshake", {"client_id": self.client, **about}]:
                return self._handshake(about)
        raise ArgumentError("an event is none that a page sends")

    def _click(self, number: int, listener: str, arguments: Sequence[object]) -> bool:
        if not _counts(number) or not UUID.fullmatch(listener) or len(arguments) > MOST_ARGUMENTS:
            raise ArgumentError("an event names no listener")
        for argument in arguments:
            if argument is not None:
                self._json(argument)
        return self._is_known(self.client, number, listener)

    def _handshake(self, about: Mapping[object, object]) -> bool:
        texts = {key: value for key, value in about.items() if value is not None}
        texts["next_message_id"] = str(texts.get("next_message_id", ""))
        texts.pop("implicit_handshake", None)
        names = {"tab_id", "document_id", "next_message_id"}
        if not texts.keys() >= names or not texts.keys() <= names | {"old_tab_id"}:
            raise ArgumentError("a handshake is not that of a page")
        for key, value in texts.items():
            if not isinstance(value, str) or not QUERY[str(key)].fullmatch(value):
                raise ArgumentError(f"{key} cannot be what it is")
        return True

    def _json(self, text: object) -> object:
        try:
            if isinstance(text, str):
                return self._loads(text)
        except (ValueError, RecursionError):
            pass
        raise ArgumentError("a message has what is no JSON")


def _counts(number: int) -> bool:
    return not isinstance(number, bool) and 0 <= number <= MOST_NUMBER


__all__ = ["LONGEST", "Conversation", "IsKnown", "client_of"]
