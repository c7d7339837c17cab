"""Runs an agent's server with its robots, from the first connection to the last stop."""

from __future__ import annotations

import contextlib
import socket
import sys
import threading
import webbrowser
from collections.abc import Sequence
from typing import TextIO

from elib.doors.agent.limits import Limits
from elib.doors.agent.pipes import Complaints
from elib.doors.agent.server import AgentDoor, Journal, quiet, serve_pipes
from elib.doors.agent.tools import Tools
from elib.doors.robots import connected
from elib.panel.server.listening import listen


async def run(
    urls: Sequence[str],
    limits: Limits,
    *,
    file: TextIO | None = None,
    view: bool = False,
    pipes: tuple[int, int] | None = None,
    http: socket.socket | None = None,
) -> None:
    """Serve an agent until its client closes its end, or until a signal comes over HTTP.

    Args:
        urls: URLs of the robots.
        limits: What the agent may do.
        file: Takes a line of JSON for each call.
        view: Whether a person watches the robots in the browser.
        pipes: Descriptors of input and output of the protocol; None to serve HTTP.
        http: A bound socket for HTTP.

    Raises:
        ElibError: A robot could not be connected, or did not confirm at the end that it stands.
    """
    quiet()
    complaints = Complaints()
    with contextlib.ExitStack() as stack:
        page = listen() if view else None
        if page is not None:
            stack.enter_context(contextlib.closing(page.socket))
        async with connected(urls, page=page) as panel:
            if page is not None:
                print(f"watch and stop the robots: {page.url}", file=sys.stderr, flush=True)
                threading.Thread(target=webbrowser.open, args=(page.url,), daemon=True).start()
            tools = Tools(panel, limits)
            door = AgentDoor(tools, Journal(tools, complaints, file))
            if pipes is not None:
                await serve_pipes(door, *pipes)
            elif http is not None:
                from elib.doors.agent.http import serve_http

                await serve_http(door, http)
