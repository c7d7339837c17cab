"""Who looks at a simulation beside the programs that drive its robots: the live view and the control door."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator

from elib.emulator.control import Control


class Servers:
    """The doors that ``elib simulate`` opens beside the robots' ports.

    Args:
        view: ``HOST:PORT`` of the live view, "" for the usual one, None for none.
        control: ``HOST:PORT`` of the control door, likewise.
    """

    def __init__(self, view: str | None, control: str | None) -> None:
        self._view = view
        self._control = control
        self._met: Control | None = None

    def __bool__(self) -> bool:
        return self._view is not None or self._control is not None

    def meet(self, control: Control) -> None:
        """Take the simulation's control door."""
        self._met = control

    @contextlib.asynccontextmanager
    async def served(self) -> AsyncIterator[list[tuple[str, str]]]:
        """Open what was asked for until the block is left.

        Yields:
            ``view`` and ``control`` with their URLs.

        Raises:
            ArgumentError: A place cannot be.
            LinkError: A port cannot be had.
            SimulationError: There is no world to be seen.
            Unsupported: The extra ``web`` is not installed.
        """
        opened: list[tuple[str, str]] = []
        async with contextlib.AsyncExitStack() as stack:
            if self._met is not None and self._view is not None:
                from elib.view.live import watchable  # A simulation nobody looks at starts faster without.

                opened.append(("view", await stack.enter_async_context(watchable(self._met, self._view))))
            if self._met is not None and self._control is not None:
                from elib.emulator.control_server import serve_control

                opened.append(("control", await stack.enter_async_context(serve_control(self._met, self._control))))
            yield opened
