"""What the tests of several packages share: how they wait, Python programs, ports that are held, a terminal.

Tests do not race the wall clock; ``tests/check_waiting.py`` refuses what would. What is to come is waited for with
:func:`until` or :func:`wait_until`, or with the bound :data:`PATIENCE`. That something does not come is proven without
waiting: in simulated time, by counting, or by an answer that would have come later.
"""

from __future__ import annotations

import asyncio
import functools
import inspect
import io
import socket
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Awaitable, Callable, Coroutine, Iterator, Sequence
from contextlib import AbstractAsyncContextManager, contextmanager
from pathlib import Path
from typing import Any, TypeVar

import pytest

from elib.base.files import PACKAGE, PAGE
from elib.testing import simulated, with_faults

T = TypeVar("T")

PATIENCE = 180.0
"""s of the bound on everything that a test waits for, also a command that computes for a minute. Only what is broken
reaches it, on a busy machine too."""
LOOK = 0.01
"""s between two looks at what is waited for."""
GREETING = b'\x0c\r\nWELCOME to the SerCom protocol on e-Puck\r\nthe EPFL education robot type "H" for help\r\n'
"""What a robot sends when it starts."""

needs_page = pytest.mark.skipif(
    not (PACKAGE / PAGE / "index.html").exists(),
    reason="the page is not built, for which npm's registry is needed: make page",
)


def now() -> float:
    """Return the time of the running event loop, s."""
    return asyncio.get_running_loop().time()


async def until(is_so: Callable[[], T | Awaitable[T]]) -> T:  # clock: the place for it
    """Wait in the event loop until ``is_so()`` gives something true, and return that; fail after :data:`PATIENCE`.

    ``is_so`` may be a coroutine function. A failure says how often it was answered: never if what it asks stands still.
    """
    end, answers = now() + PATIENCE, 0
    while True:
        value = is_so()
        try:
            async with asyncio.timeout_at(end) as bound:
                if inspect.isawaitable(value):
                    value = await value
                answers += 1
        except TimeoutError:  # a look was on its way: nearly always so when a browser is asked
            if not bound.expired():
                raise
            value = None
        if value:
            return value
        assert now() < end, f"this did not come in {PATIENCE} s; {answers} looks were answered"
        await asyncio.sleep(LOOK)


def wait_until(is_so: Callable[[], T]) -> T:  # clock: the place for it
    """Wait without an event loop until ``is_so()`` gives something true, and return that; see :func:`until`."""
    end = time.monotonic() + PATIENCE
    while not (value := is_so()):
        assert time.monotonic() < end, f"this did not come in {PATIENCE} s"
        threading.Event().wait(LOOK)
    return value


def inside(
    place: Callable[..., AbstractAsyncContextManager[Any]], *arguments: Any, **settings: Any
) -> Callable[[Callable[..., Coroutine[Any, Any, None]]], Callable[..., None]]:
    """Make a test of a coroutine function: in simulated time, inside ``place(*arguments, **settings)``.

    What the place gives, such as an open robot, is the first argument of the function; the others are fixtures.
    """

    def decorate(test: Callable[..., Coroutine[Any, Any, None]]) -> Callable[..., None]:
        others = list(inspect.signature(test).parameters.values())[1:]

        @functools.wraps(test)
        @simulated
        async def run(**given: Any) -> None:
            async with place(*arguments, **settings) as it:
                await test(it, **given)

        run.__signature__ = inspect.Signature(others)  # type: ignore[attr-defined]  # pytest looks for fixtures there
        return run

    return decorate


def run(command: Sequence[str], **options: Any) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, with nothing to read, and return what it wrote and its exit code.

    *options* are those of ``subprocess.run``.
    """
    given = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "check": False}
    return subprocess.run(command, text=True, timeout=PATIENCE, **{**given, **options})


def run_python(program: str, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run a program in another Python to its end; see :func:`run`."""
    return run([sys.executable, "-c", textwrap.dedent(program)], **options)


def with_fault(folder: Path, fault: str, url: str = "sim://square?speed=max") -> str:
    """Return *url* with one fault, written as in a fault script, without its head; more may follow with theirs."""
    script = folder / "fault.toml"
    script.write_text(f'description = "of a test"\n[[fault]]\n{fault}')
    return with_faults(script, url)


@contextmanager
def held_port(host: str = "127.0.0.1") -> Iterator[int]:
    """Hold a port in which nothing listens, so that no other program gets it; yield its number.

    A server that asks for it gets it, as servers set ``SO_REUSEADDR``. A port that is let go may be anybody's.
    """
    with socket.socket() as line:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        line.bind((host, 0))
        yield line.getsockname()[1]


@contextmanager
def held(path: str, *, locks: bool = False) -> Iterator[int]:
    """Let another process have the port *path* open, and lock it if asked; yield its number."""
    lock = "fcntl.flock(f, 2);" if locks else ""
    code = f"import fcntl, sys; f = open(sys.argv[1], 'r+b', 0); {lock} print(flush=True); sys.stdin.read()"
    process = subprocess.Popen([sys.executable, "-c", code, path], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert process.stdout is not None
    try:
        process.stdout.readline()
        yield process.pid
    finally:
        process.communicate(timeout=PATIENCE)


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True
