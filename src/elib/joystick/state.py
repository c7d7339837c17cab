"""What the panel holds: the robots, each in its place, whoever looks at them. It lives on the server's event loop."""

from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import Callable, Mapping
from types import MappingProxyType

from elib.errors import ArgumentError
from elib.joystick.pilot import Pilot
from elib.physics.worldfile import gallery
from elib.transport.url import parse_url

MOST_ROBOTS = 64
"""Places for robots: two classes full."""
LONGEST_URL = 500
LONGEST_NAME = 80
PARTING = 3.0
"""s that a robot may take to confirm its last stop when the panel closes."""


class Panel:
    """The robots of one panel.

    Args:
        is_shared: Other computers reach it: nobody on a page may name files of this one.

    Attributes:
        is_shared: As given.
        changes: Counts up whenever a robot comes or goes, or anything but a reading of one has changed.
        on_change: Called after it did.
    """

    def __init__(self, *, is_shared: bool = False) -> None:
        self.is_shared = is_shared
        self.changes = 0
        self.on_change: Callable[[], object] = lambda: None
        self._pilots: dict[str, Pilot] = {}
        self._number = 0
        self._tasks: set[asyncio.Task[object]] = set()

    @property
    def pilots(self) -> Mapping[str, Pilot]:
        """The robots by key, in the order they came; read only."""
        return MappingProxyType(self._pilots)

    def pilot(self, key: object) -> Pilot:
        """Return the robot with a key.

        Raises:
            ArgumentError: There is none, or no more.
        """
        found = self._pilots.get(key) if isinstance(key, str) else None
        if found is None:
            raise ArgumentError("there is no such robot in the panel", hint="it may have been taken out meanwhile")
        return found

    def add(self, url: object, name: object = "", *, is_trusted: bool = False) -> str:
        """Make a place for a robot, not yet connected, and return its key.

        Args:
            url: What will be opened.
            name: What it is to be called; its URL if empty.
            is_trusted: It comes from the command line, not from a page.

        Raises:
            ArgumentError: The URL or the name cannot be, or the panel is full.
        """
        if len(self._pilots) >= MOST_ROBOTS:
            raise ArgumentError(f"the panel has {MOST_ROBOTS} robots, which is all it holds")
        text = _line("the URL", url, LONGEST_URL)
        if self.is_shared and not is_trusted:
            _refuse_files(text)
        pilot = Pilot(text, name=_line("the name", name, LONGEST_NAME))
        self._number += 1
        key = str(self._number)
        pilot.on_change = self._changed
        self._pilots[key] = pilot
        self._changed()
        return key

    async def remove(self, key: object) -> None:
        """Stop and disconnect a robot, and give up its place.

        Raises:
            ArgumentError: There is none with that key.
        """
        pilot = self.pilot(key)
        assert isinstance(key, str)
        del self._pilots[key]
        self._changed()
        await _part(pilot)

    def connect(self, key: object) -> None:
        """Begin to connect a robot; :attr:`Pilot.phase` says how it goes.

        Raises:
            ArgumentError: There is none with that key.
        """
        self.begin(self.pilot(key).connect())

    def stop_all(self) -> None:
        """Stop every robot, past all that waits."""
        for pilot in self._pilots.values():
            if pilot.is_connected:
                pilot.stop()

    def leave(self, page: str) -> None:
        """Note that a page is gone: what it drove stops now, and the behaviours that nobody watches any more."""
        for pilot in self._pilots.values():
            pilot.leave(page)

    def begin(self, work: object) -> None:
        """Let a coroutine go on for the panel, whatever becomes of the page that asked for it."""
        task: asyncio.Task[object] = asyncio.get_running_loop().create_task(work, name="elib panel")  # type: ignore[arg-type]
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def close(self) -> list[str]:
        """Stop and disconnect every robot at once, within a bound.

        Returns:
            The names of those that did not confirm that they stand.
        """
        pilots = list(self._pilots.values())
        self.stop_all()
        for task in tuple(self._tasks):
            task.cancel()
        if self._tasks:
            await asyncio.wait(self._tasks)
        await asyncio.gather(*map(_part, pilots))
        self._pilots.clear()
        return [pilot.name for pilot in pilots if pilot.helm.may_move]

    def _changed(self) -> None:
        self.changes += 1
        self.on_change()


async def _part(pilot: Pilot) -> None:
    """Stop a robot, disconnect it, and end what drove it."""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(PARTING):
            await pilot.disconnect()
    await pilot.helm.close()


def _line(what: str, text: object, longest: int) -> str:
    """Return a line of text that a page sent.

    Raises:
        ArgumentError: It is none.
    """
    if not isinstance(text, str):
        raise ArgumentError(f"{what} is no text")
    text = text.strip()
    if len(text) > longest:
        raise ArgumentError(f"{what} has {len(text)} characters; it may have {longest}")
    if not text.isprintable():
        raise ArgumentError(f"{what} has characters that cannot be shown")
    return text


def _refuse_files(text: str) -> None:
    """Refuse a URL by which somebody elsewhere would read files of this computer.

    Raises:
        ArgumentError: It names one.
    """
    url = parse_url(text)
    names_file = url.scheme == "replay" or (url.scheme == "sim" and url.target not in ("", *gallery()))
    names_file = names_file or any(url.keys.get(key) for key in ("hardware", "profile"))
    fault = url.keys.get("fault", "")
    if names_file or os.sep in fault or "/" in fault or fault.endswith(".toml"):
        raise ArgumentError(
            "a page of a shared panel may not open files of the computer it runs on",
            hint="name the file on the command line: elib joystick --robot URL",
        )


__all__ = ["LONGEST_NAME", "LONGEST_URL", "MOST_ROBOTS", "Panel"]
