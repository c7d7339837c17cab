"""The panel's web server: NiceGUI behind a guard, on our event loop; a signal ends it with all robots standing."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from elib.errors import LinkLost, Unsupported, install
from elib.joystick.access import Access, Application, Scope
from elib.joystick.guard import Guard, Surroundings
from elib.joystick.listening import Address

if TYPE_CHECKING:
    from elib.joystick.state import Panel
from elib.robot.running import ending

TITLE = "elib joystick"


def check_installed() -> None:
    """Make sure that there is a NiceGUI.

    Raises:
        Unsupported: The extra ``web`` is not installed.
    """
    from importlib.util import find_spec

    if find_spec("nicegui") is None:
        raise Unsupported(
            "the joystick needs the package nicegui, which is not installed",
            hint=install("web"),
        )


async def serve(
    address: Address, urls: Sequence[str], *, token: str | None = None, on_ready: Callable[[str], object] = print
) -> None:
    """Serve the panel until Ctrl-C, SIGTERM or SIGHUP; then stop and disconnect every robot. Once in a process.

    Args:
        address: Where; it is bound already.
        urls: Of the robots that are in the panel from the beginning.
        token: What a browser is asked for before it sees anything; None asks for nothing.
        on_ready: Called with the panel's URL when it can be opened.

    Raises:
        ArgumentError: A robot's URL cannot be.
        LinkLost: At the end, a robot did not confirm that it stands.
        Unsupported: The extra ``web`` is not installed.
    """
    check_installed()
    from elib.joystick.bounded import served
    from elib.joystick.state import Panel

    panel = Panel(is_shared=token is not None)
    keys = [panel.add(url, is_trusted=True) for url in urls]
    stop = asyncio.Event()
    # Until all is over: a second Ctrl-C must not keep the robots from being stopped, which takes some seconds at most.
    with ending(stop):
        async with served(_application(panel, address, token), address.socket):
            try:
                for key in keys:
                    panel.connect(key)
                on_ready(address.url)
                await stop.wait()
            finally:
                moving = await panel.close()
    if moving:
        raise LinkLost(
            f"{', '.join(moving)} did not confirm that it stands: it may still be moving",
            hint="switch it off, or hold it",
        )


def _application(panel: Panel, address: Address, token: str | None) -> Application:
    """Build the pages, and put the guard before them."""
    from fastapi import FastAPI
    from nicegui import Client, core, json, ui

    from elib.joystick import pages

    def is_route(scope: Scope) -> bool:
        return any(route.matches(scope)[0].value for route in core.app.routes)

    def is_known(client: str, element: int, listener: str) -> bool:
        page = Client.instances.get(client)
        found = None if page is None else page.elements.get(element)
        return found is not None and listener in found._event_listeners  # noqa: SLF001  # no other way to ask

    pages.build(panel)
    core.app.config.socket_io_js_transports = ["websocket"]
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    ui.run_with(
        app,
        title=TITLE,
        dark=None,
        language="en-US",
        tailwind=False,  # it would compile styles in the browser all the time
        gzip_middleware_factory=None,  # the guard has to read the pages
        show_welcome_message=False,
    )
    access = Access(address.host, address.port, token)
    guard: Application = Guard(app, access, Surroundings(is_route, is_known, lambda: len(Client.instances), json.loads))
    if token is None:
        return guard
    from fastapi.middleware.gzip import GZipMiddleware

    return GZipMiddleware(guard)  # a telephone at the other end of the air is glad of it
