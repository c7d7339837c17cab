"""What every TCP port of a virtual robot does for its clients: it refuses web pages, and notices who is gone."""

from __future__ import annotations

import re
import socket

MAX_METHOD = 256
"""Bytes without a comma, a blank or the end of a line that a connection may begin with."""
SILENCE, PROBE_EVERY, PROBES = 10, 5, 3
"""s of silence after which a client's computer is asked whether it is there, s between two questions, and how many
questions may stay unanswered."""
_METHOD = rb"[!#$%&'*+.^_`|~0-9A-Za-z-]"
_REQUEST = re.compile(_METHOD + rb"+ [/*A-Za-z]|CONNECT |\x16\x03")  # the last is how https:// begins
_UNDECIDED = re.compile(_METHOD + rb"* ?|\x16")


def is_request(beginning: bytes) -> bool | None:
    """Return whether a connection with this beginning brings a web page's request; None if the next bytes decide.

    A robot's client does not begin like a request: a command is a letter and a comma, or the end of the line. A page of
    any site can make its reader's browser send requests to this computer, with commands in their body.
    """
    if _REQUEST.match(beginning):
        return True
    if not _UNDECIDED.fullmatch(beginning):
        return False
    return True if len(beginning) > MAX_METHOD else None


def notice_absence(connection: socket.socket) -> None:
    """Let the system find out that the other computer is gone, even if it closed no connection."""
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in (
        ("TCP_KEEPIDLE", SILENCE),
        ("TCP_KEEPINTVL", PROBE_EVERY),
        ("TCP_KEEPCNT", PROBES),
        ("TCP_USER_TIMEOUT", 1000 * (SILENCE + PROBES * PROBE_EVERY)),  # ms; while bytes to it wait
    ):
        option = getattr(socket, name, None)  # each system has its own
        if option is not None:
            connection.setsockopt(socket.IPPROTO_TCP, option, value)
