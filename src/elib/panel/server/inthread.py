"""Serve a page from a thread of its own, while this thread does something else."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import AbstractAsyncContextManager
from typing import TypeVar

T = TypeVar("T")

CLOSING_TIME = 5.0
"""s that a page may take to close."""


@contextlib.contextmanager
def in_thread(
    context: Callable[[], AbstractAsyncContextManager[T]],
) -> Iterator[tuple[T, asyncio.AbstractEventLoop]]:
    """Keep a page open until the block is left, on an event loop in a thread of its own.

    *context* makes what serves the page, in that thread. What it gives is yielded with the event loop, which takes work
    by ``call_soon_threadsafe``.
    """
    opened: Future[T] = Future()
    loop, stop = asyncio.new_event_loop(), asyncio.Event()

    async def serve() -> None:
        async with context() as given:
            opened.set_result(given)
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
    given = opened.result()
    try:
        yield given, loop
    finally:
        with contextlib.suppress(RuntimeError):  # the page has failed, and its loop is closed
            loop.call_soon_threadsafe(stop.set)
        thread.join(CLOSING_TIME)
