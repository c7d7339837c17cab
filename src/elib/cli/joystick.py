"""``elib joystick``: a panel in the browser, to drive and to watch robots."""

from __future__ import annotations

from typing import Annotated

from elib.base.browser import show_page
from elib.base.extras import check_web
from elib.cli.arguments import option
from elib.cli.serving import Host, Port, Robots, listening, token_for
from elib.robot.running import run_coroutine
from elib.simulator.emulator.loopback import LOOPBACK

CLOSE_AFTER = 120.0
"""s that --close-with-page waits for another page: one that is loaded again is closed for a moment."""

NoBrowser = Annotated[bool, option("--no-browser", "Do not open a browser; the address is printed.")]
CloseWithPage = Annotated[bool, option("--close-with-page", "End two minutes after the last page was closed.")]


def joystick(
    *urls: Robots,
    port: Port = None,
    host: Host = LOOPBACK,
    no_browser: NoBrowser = False,
    close_with_page: CloseWithPage = False,
) -> None:
    """Drive and watch robots in the browser, until Ctrl-C.

    Without a URL the page offers the robots that it finds, those that it was used with before, and virtual ones. Only
    this computer can open the page, unless --host names another address.

    For example:
        elib joystick
        elib joystick serial:///dev/rfcomm0 sim://maze
    """
    check_web()
    from elib.panel.server.http import serve

    def announce(url: str) -> None:
        print(url, flush=True)
        if not no_browser:
            show_page(url)

    close_after = CLOSE_AFTER if close_with_page else None
    with listening(host, port) as address:
        token = token_for(address)
        run_coroutine(lambda: serve(address, urls, token=token, close_after=close_after, on_ready=announce))
