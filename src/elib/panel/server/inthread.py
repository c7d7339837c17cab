"""Serve a page from a thread of its own, while this thread does something else."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import AbstractAsyncContextManager

CLOSING_TIME = 5.0
"""s that a page may take to close."""


@contextlib.contextmanager
def in_thread(
    context: Callable[[], AbstractAsyncContextManager[str]],
) -> Iterator[tuple[str, asyncio.AbstractEventLoop]]:
    """Keep a page open until the block is left, on an event loop in a thread of its own.

    Args:
        context: Makes what serves the page and gives its URL; it is called in that thread.

    Yields:
        The page's URL, and the event loop, which takes work by ``call_soon_threadsafe``.

    Raises:
        ElibError: The page cannot be opened.
    """
    opened: Future[str] = Future()
    loop, stop = asyncio.new_event_loop(), asyncio.Event()

    async def serve() -> None:
        async with context() as url:
            opened.set_result(url)
            await stop.wait()

    def run() -> None:
        try:
            with asyncio.Runner(loop_factory=lambda: loop) as runner:
                runner.run(serve())
        except BaseException as error:
            if opened.done():
                raise
            opened.set_exception(error)

    thread = threading.Thread(target=run, name="elib page", daemon=True)
    thread.start()
    url = opened.result()
    try:
        yield url, loop
    finally:
        with contextlib.suppress(RuntimeError):  # the page has failed, and its loop is closed
            loop.call_soon_threadsafe(stop.set)
        thread.join(CLOSING_TIME)
