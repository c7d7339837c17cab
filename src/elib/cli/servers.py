"""The servers of ``elib simulate`` beside the robots' ports: the live view and the control server."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator

from elib.emulator.control import Control


class Servers:
    """The live view and the control server of a simulation.

    Args:
        view: ``HOST:PORT`` of the live view, "" for the usual port, None for no view.
        control: ``HOST:PORT`` of the control server, "" for the usual port, None for no control server.
    """

    def __init__(self, view: str | None, control: str | None) -> None:
        self._view = view
        self._control = control
        self._control_of: Control | None = None

    def __bool__(self) -> bool:
        return self._view is not None or self._control is not None

    def attach(self, control: Control) -> None:
        """Take the control of the simulation."""
        self._control_of = control

    @contextlib.asynccontextmanager
    async def served(self) -> AsyncIterator[list[tuple[str, str]]]:
        """Serve until the block is left.

        Yields:
            ``view`` and ``control`` with their URLs.

        Raises:
            ArgumentError: A ``HOST:PORT`` is wrong.
            LinkError: A port cannot be opened.
            SimulationError: The simulation has no world to show.
            Unsupported: The extra ``web`` is not installed.
        """
        opened: list[tuple[str, str]] = []
        control = self._control_of
        async with contextlib.AsyncExitStack() as stack:
            if control is not None and self._view is not None:
                from elib.web import check_web

                check_web()
                from elib.web.server import view_of  # without a view a simulation starts faster

                opened.append(("view", await stack.enter_async_context(view_of(control, self._view))))
            if control is not None and self._control is not None:
                from elib.emulator.control_server import serve_control

                opened.append(("control", await stack.enter_async_context(serve_control(control, self._control))))
            yield opened
