"""One open page: it carries out what the page asks for, and sends it ten times a second what has changed."""

from __future__ import annotations

import asyncio
import inspect
import logging
import math
import secrets
from collections.abc import Awaitable
from typing import TYPE_CHECKING

import msgspec
from aiohttp import web

from elib.body import SENSOR_DIRECTIONS
from elib.emulator.control import Control
from elib.errors import ArgumentError, ElibError
from elib.view.robot import LED_ANGLES
from elib.web import messages
from elib.web.behaviours import catalogue, runner_state
from elib.web.instruments import Cursor, scheme, summary, tick
from elib.web.world import WorldUpdates

if TYPE_CHECKING:
    from elib.web.panel import Panel
    from elib.web.slot import Slot

PERIOD = 0.1
"""s between two updates."""
OVERVIEW_EVERY = 2
"""Updates for one of the overview, whose robots are many."""
AHEAD = 3
"""Updates on their way to a page that has not drawn them yet, at most: a slow page gets fewer."""
MOST_TASKS = 32
"""Requests of one page that wait for an answer at the same time."""
OVERVIEW, START = "overview", "start"

Json = dict[str, object]
log = logging.getLogger("elib.web")


class Page:
    """One browser page, from the opening of its WebSocket to its end.

    Args:
        panel: The robots.
        ws: The page's WebSocket.

    Attributes:
        panel: As given.
        name: The page's name at the drive locks; no other page can guess it.
        place: The key of the robot that it shows, or ``overview``, or ``start``.
        wants_rays: Whether it shows the rays of the infrared sensors.
        world_updates: Sends it the world.
        watched: The robot of the world whose readings it shows, by its index; None for none.
    """

    def __init__(self, panel: Panel, ws: web.WebSocketResponse) -> None:
        self.panel = panel
        self.name = f"page-{secrets.token_hex(8)}"
        self.place = START
        self.wants_rays = False
        self.watched: int | None = None
        self._ws = ws
        self._loop = asyncio.get_running_loop()
        self._joined: set[Slot] = set()
        self._cursor = Cursor()
        self._scheme: tuple[str, int] = ("", -1)
        self._listed: object = None
        self._behaviour_lines = 0
        self._number = self._drawn = 0
        self._tasks: set[asyncio.Task[None]] = set()
        self.world_updates = WorldUpdates(self)
        slots = list(panel.slots)
        self.show(OVERVIEW if len(slots) != 1 and (slots or panel.control) else slots[0] if slots else START)
        for work in (self._send_updates(), self.world_updates.send()):
            self._begin(work)

    # -- what the page says --

    def hear(self, text: str) -> bool:
        """Carry out one message; return False if it is not a message of the page."""
        try:
            message = messages.decode(text)
        except (msgspec.DecodeError, RecursionError):
            return False
        if len(self._tasks) > MOST_TASKS:
            self._begin(self._answer(message.id, error=ArgumentError("too many requests wait for an answer")))
            return True
        try:
            result = message.carry_out(self)
        except ElibError as error:
            self._begin(self._answer(message.id, error=error))
        else:
            if inspect.isawaitable(result):
                self._begin(self._finish(message.id, result))
            elif message.id:
                self._begin(self._answer(message.id, result))
        return True

    async def _finish(self, number: int, work: Awaitable[object]) -> None:
        try:
            result = await work
        except ElibError as error:
            await self._answer(number, error=error)
        else:
            await self._answer(number, result)

    async def _answer(self, number: int, result: object = None, *, error: ElibError | None = None) -> None:
        if error is not None:
            await self._send({"type": "answer", "id": number, "ok": False, "error": error.message, "hint": error.hint})
        elif number:
            await self._send({"type": "answer", "id": number, "ok": True, "result": result})

    def slot(self, key: str) -> Slot:
        """Return a robot of the panel.

        Raises:
            ArgumentError: There is none with that key.
        """
        return self.panel.slot(key)

    def show(self, place: str) -> None:
        """Show a robot by its key, or ``overview``, or ``start``; what it drove stops."""
        for slot in self._joined:
            slot.drive.leave(self.name)
            slot.look_away(self.name)
        if place not in (OVERVIEW, START):
            self.panel.slot(place)
        self.place = place
        self._cursor, self._scheme, self._behaviour_lines = Cursor(), ("", -1), 0

    def drawn(self, number: int) -> None:
        """Note how far the page has come."""
        self._drawn = min(max(self._drawn, number), self._number)

    @property
    def control(self) -> Control:
        """The control of the world that the page shows.

        Raises:
            ArgumentError: It shows none.
        """
        found = self.world
        if found is None:
            raise ArgumentError("there is no virtual world here", hint="a real robot has its own")
        return found

    @property
    def world(self) -> Control | None:
        """The control of the world that the page shows, or None."""
        if self.place in self.panel.slots:
            return self.panel.slots[self.place].control
        if self.place == START:
            return None
        return self.panel.control or next((s.control for s in self.panel.slots.values() if s.control is not None), None)

    @property
    def own(self) -> int | None:
        """The index of the robot that the page shows in that world; None where it shows all."""
        return self.panel.slots[self.place].index if self.place in self.panel.slots else None

    # -- what the page is told --

    async def _send_updates(self) -> None:
        await self._send(self._hello())
        due = self._loop.time()
        while True:
            if self._number - self._drawn < AHEAD:
                await self._send(self._update())
            due = max(due + PERIOD, self._loop.time())
            await asyncio.sleep(due - self._loop.time())

    def _hello(self) -> Json:
        panel = self.panel
        return {
            "type": "hello",
            "page": self.name,
            "place": self.place,
            "shared": panel.is_shared,
            "folder": "" if panel.is_shared else str(panel.folder.path),
            "worlds": panel.worlds(),
            "recents": panel.recents.urls,
            "behaviours": catalogue(),
            "ring": {"sensors": [round(math.degrees(angle), 2) for angle in SENSOR_DIRECTIONS], "leds": LED_ANGLES},
            "simulation": panel.control is not None,
        }

    def _update(self) -> Json:
        """Return what has changed since the last update."""
        self._join()
        if self.place not in (OVERVIEW, START, *self.panel.slots):
            self.show(OVERVIEW if self.panel.slots else START)
        self._number += 1
        update: Json = {"type": "update", "number": self._number, "place": self.place}
        listed = self.panel.labels()
        if listed != self._listed:
            self._listed = listed
            update["robots"] = listed
        if self.place in self.panel.slots:
            update["robot"] = self._robot(self.panel.slots[self.place])
        elif self.place == OVERVIEW and self._number % OVERVIEW_EVERY == 1:
            update["overview"] = {key: summary(slot) for key, slot in self.panel.slots.items()}
        return update

    def _robot(self, slot: Slot) -> Json:
        slot.look(self.name)
        told: Json = {"tick": tick(slot, self._cursor)}
        if self._scheme != (self.place, slot.edition):
            self._scheme = self.place, slot.edition
            told["scheme"] = scheme(slot)
        told["behaviour"] = runner_state(slot.runner, self._behaviour_lines)
        self._behaviour_lines = slot.runner.line_count
        return told

    def _join(self) -> None:
        """Look at every robot, also those of other tabs: what was started there goes on."""
        there = set(self.panel.slots.values())
        for slot in there - self._joined:
            slot.join(self.name)
        self._joined = there

    async def _send(self, message: Json) -> None:
        await self.send_text(msgspec.json.encode(message).decode())

    async def send_text(self, text: str) -> None:
        """Send a message; a page that is gone gets none."""
        if not self._ws.closed:
            await self._ws.send_str(text)

    async def send_bytes(self, data: bytes) -> None:
        """Send a frame of the world; a page that is gone gets none."""
        if not self._ws.closed:
            await self._ws.send_bytes(data)

    # -- the end --

    def _begin(self, work: object) -> None:
        task: asyncio.Task[None] = self._loop.create_task(work, name="elib page")  # type: ignore[arg-type]
        self._tasks.add(task)
        task.add_done_callback(self._ended)

    def _ended(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        error = None if task.cancelled() else task.exception()
        if error is not None and not isinstance(error, ConnectionError):
            log.error("a page failed", exc_info=error)

    async def close(self) -> None:
        """Leave all robots: what the page drove stops now."""
        for slot in self._joined:
            slot.leave(self.name)
        self._joined.clear()
        tasks = tuple(self._tasks)
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks)


__all__ = ["OVERVIEW", "START", "Page"]
