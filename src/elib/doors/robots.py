"""The robots behind a door: connected when it opens, stopped and disconnected when it closes."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Sequence

from elib.base.errors import LinkClosed
from elib.panel.panel import Panel, check_standing
from elib.panel.server.http import Door, served
from elib.panel.server.listening import Address
from elib.robot.running import ending


@contextlib.asynccontextmanager
async def connected(
    urls: Sequence[str], *, page: Address | None = None, token: str | None = None, door: Door | None = None
) -> AsyncIterator[Panel]:
    """Connect robots; stop and disconnect them when the block is left, whatever ends it.

    Args:
        urls: URLs of the robots; a URL of a world may have several of them.
        page: A bound port on which the panel shows the same robots, so that a person can watch and stop them; None
            for no page.
        token: What a browser is asked for before it sees the page; None asks for nothing.
        door: One more address of the page's server, for programs.

    Yields:
        A panel with these robots. Its keys, "1", "2" and so on, are the names of the robots for clients.

    Raises:
        ArgumentError: A URL is wrong.
        ElibError: A robot could not be connected; this is the error of the first such robot.
        LinkLost: At the end, a robot did not confirm that it stands.
    """
    panel = Panel(is_shared=token is not None)
    try:
        for url in urls:
            panel.add_all(url, is_trusted=True)
        if not await asyncio.gather(*(slot.connect() for slot in panel.slots.values())):
            raise LinkClosed("there is no robot", hint="name its URL")
        for slot in panel.slots.values():
            if slot.error is not None and not slot.is_connected:
                raise slot.error
        if page is None:
            yield panel
        else:
            async with served(panel, page, token, door):
                yield panel
    finally:
        moving = await panel.close()
    check_standing(moving)


async def hold_open(door: contextlib.AbstractAsyncContextManager[object]) -> None:
    """Hold a door open until Ctrl-C, SIGTERM or SIGHUP comes; if it is still being opened then, give that up.

    Args:
        door: Connects robots and serves them; its end stops and disconnects them, which no second signal cuts short.
    """
    stop, is_open = asyncio.Event(), False

    async def hold() -> None:
        nonlocal is_open
        async with door:
            is_open = True
            await stop.wait()

    with ending(stop):
        holding, asked = asyncio.ensure_future(hold()), asyncio.ensure_future(stop.wait())
        try:
            await asyncio.wait((holding, asked), return_when=asyncio.FIRST_COMPLETED)
            if not is_open:
                holding.cancel()
            await holding
        finally:
            asked.cancel()
            if not holding.done():
                holding.cancel()
                await asyncio.wait([holding])
