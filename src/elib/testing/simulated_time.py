"""Run a test in simulated time."""

from __future__ import annotations

import asyncio
import functools
from collections.abc import Callable, Coroutine
from typing import ParamSpec, TypeVar

from elib.base.timebase import new_loop

P = ParamSpec("P")
T = TypeVar("T")


def simulated(test: Callable[P, Coroutine[object, object, T]]) -> Callable[P, T]:
    """Turn a coroutine test into one that runs in simulated time: waiting takes no wall time."""

    @functools.wraps(test)
    def run(*args: P.args, **kwargs: P.kwargs) -> T:
        with asyncio.Runner(loop_factory=lambda: new_loop("max")) as runner:
            return runner.run(test(*args, **kwargs))

    return run
