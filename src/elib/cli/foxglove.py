"""``elib foxglove``: robots live in the Foxglove app."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import AsyncIterator, Sequence
from typing import TYPE_CHECKING, Annotated
from urllib.parse import quote

from elib.base.errors import ArgumentError, Unsupported
from elib.base.extras import check_web, install
from elib.base.files import write_file
from elib.base.rules import PORT_NUMBER
from elib.cli.arguments import option
from elib.cli.recordoptions import own_name
from elib.cli.serving import Robots, listening, port_option
from elib.robot.running import run_coroutine
from elib.simulator.emulator import loopback

if TYPE_CHECKING:
    from elib.panel.server.listening import Address

PORT = 8765
"""The port that the Foxglove app proposes; the next ones follow."""
GUESSED = ("ws://127.0.0.1:", "ws://[::1]:")
"""The addresses whose ports a page in a browser tries."""

View = Annotated[bool, option("--view", "Show the same robots in the browser too, to watch and to stop them.")]


def foxglove(
    *urls: Robots,
    port: Annotated[int | None, PORT_NUMBER, port_option(PORT)] = None,
    host: Annotated[
        str | None, option("--host H", "Address of this computer alone (default: one that no page can guess).")
    ] = None,
    view: View = False,
    layout: Annotated[str | None, option("--layout FILE", "Write a layout for the app, to be imported there.")] = None,
    record: Annotated[
        str | None,
        option(
            "--record FILE.mcap", "Record everything that happens on the link; of several robots, each in its own file."
        ),
    ] = None,
) -> None:
    """Show robots live in the Foxglove app, and drive them from there, until Ctrl-C.

    Open the address that is printed in the app: Open connection, Foxglove WebSocket. With --layout and without a robot,
    only the layout is written.

    For example:
        elib foxglove sim://arena
        elib foxglove replay://drive.mcap --layout robot.json
    """
    if layout is not None and not urls:
        _write_layout(layout, [""])
        return
    if not urls:
        raise ArgumentError("elib foxglove needs a robot: its URL", hint="elib foxglove sim://")
    check_web()
    try:
        import foxglove as _sdk  # noqa: F401
    except ImportError:
        raise Unsupported(
            "elib foxglove needs the package foxglove-sdk, which is not installed", hint=install("foxglove")
        ) from None
    from elib.doors.foxglove.door import hidden_host
    from elib.doors.robots import hold_open

    if host is not None:
        host, _ = loopback.address(loopback.joined(host, port or PORT))
    with contextlib.ExitStack() as stack:
        address = stack.enter_context(listening(host or hidden_host(), port, PORT))
        page = stack.enter_context(listening()) if view else None
        run_coroutine(lambda: hold_open(_opened(urls, address, page, layout, record)))


@contextlib.asynccontextmanager
async def _opened(
    urls: Sequence[str], address: Address, page: Address | None, layout: str | None, record: str | None
) -> AsyncIterator[None]:
    """Serve robots until the block is left; then stop and disconnect them."""
    from elib.doors.foxglove.door import opened, prefix_of
    from elib.doors.robots import connected

    async with connected(urls, page=page) as panel:
        count = len(panel.slots)
        if layout is not None:
            _write_layout(layout, [prefix_of(key, count) for key in panel.slots])
        if record is not None:
            for key, slot in panel.slots.items():
                slot.records.recording.start(record if count == 1 else own_name(record, key))
        place = f"ws://{loopback.joined(*address.socket.getsockname()[:2])}/"
        async with opened(panel, address):
            if place.startswith(GUESSED):
                print("Every page in a browser of this computer can open this address, and drive.", file=sys.stderr)
            print(place, flush=True)
            app = f"https://app.foxglove.dev/?ds=foxglove-websocket&ds.url={quote(place, safe='')}"
            print(f"In the browser: {app}", file=sys.stderr)
            if page is not None:
                print(f"The panel: {page.url}", file=sys.stderr)
            yield


def _write_layout(path: str, prefixes: Sequence[str]) -> None:
    from elib.doors.foxglove.layout import layout_of

    write_file(path, layout_of(prefixes).encode())
