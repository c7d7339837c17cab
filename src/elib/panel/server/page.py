"""One open page: what it asks for is carried out, and it is told ten times a second what has changed."""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import msgspec
from aiohttp import WSCloseCode, web
from msgspec import UNSET, Struct, UnsetType

from elib.base.body import SENSOR_DIRECTIONS
from elib.base.errors import ArgumentError
from elib.panel.behaviours import BehaviourAbout, Play, catalogue, runner_state
from elib.panel.events import KINDS
from elib.panel.panel import Generation, Listed, Panel, Study, StudyAbout, StudyState
from elib.panel.server.conversation import Caller, Decoded, Message, Told
from elib.panel.server.instruments import Cursor, Scheme, Summary, Tick, scheme, summary, tick
from elib.panel.server.pictures import WorldInfo, world_list
from elib.panel.server.world import WorldUpdates
from elib.simulator.drawing.robot import LED_ANGLES
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.control_server import time_factor

if TYPE_CHECKING:
    from elib.panel.slot import Slot

PERIOD = 0.1
"""s of the wall clock between two updates."""
OVERVIEW_EVERY = 2
"""Updates for one of the overview, whose robots are many."""
AHEAD = 3
"""Updates on their way to a page that has not drawn them yet, at most: a slow page gets fewer."""
OVERVIEW, START = "overview", "start"

log = logging.getLogger("elib.panel")


class Ring(Struct):
    """Where on the robot the infrared sensors look and the LEDs sit, rad from straight ahead, positive to the left."""

    sensors: Sequence[float]
    leds: Sequence[float]


class Hello(Told, tag="hello"):
    """What a page is told once: its name at the drive locks, and the folder of files, empty if it may not know it."""

    page: str
    place: str
    folder: str
    worlds: list[WorldInfo]
    behaviours: list[BehaviourAbout]
    kinds: dict[str, str]
    ring: Ring
    simulation: bool
    study: StudyAbout | None


class RobotNews(Struct):
    """What is new of the robot that the page shows."""

    tick: Tick
    behaviour: Play
    scheme: Scheme | UnsetType = UNSET


class StudyNews(StudyState):
    """How far the study is, with the generations from the first on that the page does not know yet."""

    first: int
    generations: Sequence[Generation]


class Update(Told, tag="update"):
    """What has changed since the last update; a page says ``drawn`` with its number.

    Attributes:
        worlds: A robot of each world, by its key, and the name of the world.
    """

    number: int
    place: str
    robots: list[Listed] | UnsetType = UNSET
    robot: RobotNews | UnsetType = UNSET
    overview: dict[str, Summary] | UnsetType = UNSET
    worlds: list[tuple[str, str]] | UnsetType = UNSET
    study: StudyNews | UnsetType = UNSET


class Page(Caller):
    """One browser page, from the opening of its WebSocket to its end.

    Args:
        panel: The robots.
        request: The request that opened the WebSocket.
        ws: The page's WebSocket.
        decode: Gives number and message of a text, or what is wrong with it.
        is_ending: Whether the server ends.

    Attributes:
        panel: As given.
        place: The key of the robot that it shows, or ``overview``, or ``start``.
        world_of: The key of the robot whose world it shows where it shows all robots; empty for the first world.
        wants_rays: Whether it shows the rays of the infrared sensors.
        world_updates: Sends it the world.
        watched: The robot of the world whose readings it shows, by its index; None for none.
    """

    kind = "page"
    served_by = "the program"
    closing_reason = "not a message of the page"
    logger = log

    def __init__(
        self,
        panel: Panel,
        request: web.BaseRequest,
        ws: web.WebSocketResponse,
        decode: Callable[[str], Decoded],
        is_ending: Callable[[], bool],
    ) -> None:
        super().__init__(request, ws, decode, is_ending)
        self.panel = panel
        self.place = START
        self.wants_rays = False
        self.world_of = ""
        self.watched: int | None = None
        self._joined: set[Slot] = set()
        self._cursor = Cursor()
        self._scheme: tuple[str, int] = ("", -1)
        self._listed: object = None
        self._behaviour_lines = 0
        self._generations = 0
        self._study: StudyState | None = None
        self._number = self._drawn = 0
        self.world_updates = WorldUpdates(self)
        slots = list(panel.slots)
        self.show(OVERVIEW if len(slots) != 1 and (slots or panel.is_of_world) else slots[0] if slots else START)
        self._telling: list[asyncio.Future[Any]] = [
            asyncio.ensure_future(work) for work in (self._send_updates(), self.world_updates.send())
        ]
        for task in self._telling:
            task.add_done_callback(self._broke)

    # -- what the page says --

    def admit(self, message: Message) -> None:
        """Check that the page may say this: one of a closed panel may change its world alone.

        Raises:
            ArgumentError: It may not.
        """
        if self.panel.is_closed and not message.is_of_world:
            raise ArgumentError("this page shows a world, and nothing else of the computer that simulates it")

    def show(self, place: str) -> None:
        """Show a robot by its key, or ``overview``, or ``start``; what it drove stops."""
        for slot in self._joined:
            slot.drive.leave(self.key)
            slot.look_away(self.key)
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
        if self.world_of in self.panel.slots and (chosen := self.panel.slots[self.world_of].control) is not None:
            return chosen
        return self.panel.control or next((s.control for s in self.panel.slots.values() if s.control is not None), None)

    @property
    def own(self) -> int | None:
        """The index of the robot that the page shows in that world; None where it shows all."""
        return self.panel.slots[self.place].index if self.place in self.panel.slots else None

    # -- what the page is told --

    async def _send_updates(self) -> None:
        await self._send(self._hello())
        due, period = self._loop.time(), PERIOD * time_factor()
        while True:
            if self._number - self._drawn < AHEAD:
                await self._send(self._update())
            due = max(due + period, self._loop.time())
            await asyncio.sleep(due - self._loop.time())

    def _hello(self) -> Hello:
        panel = self.panel
        return Hello(
            page=self.key,
            place=self.place,
            folder="" if panel.is_shared else str(panel.folder.path),
            worlds=world_list(),
            behaviours=catalogue(),
            kinds=KINDS,
            ring=Ring(SENSOR_DIRECTIONS, [math.radians(angle) for angle in LED_ANGLES]),
            simulation=panel.is_of_world,
            study=None if panel.study is None else panel.study.about(),
        )

    def _update(self) -> Update:
        """Return what has changed since the last update."""
        self._join()
        if self.place not in (OVERVIEW, START, *self.panel.slots):
            self.show(OVERVIEW if self.panel.slots else START)
        self._number += 1
        update = Update(self._number, self.place)
        listed = self.panel.labels()
        if listed != self._listed:
            self._listed = listed
            update.robots = listed
        if self.place in self.panel.slots:
            update.robot = self._robot(self.panel.slots[self.place])
        elif self.place == OVERVIEW and self._number % OVERVIEW_EVERY == 1:
            update.overview = {key: summary(slot) for key, slot in self.panel.slots.items()}
            update.worlds = self._worlds()
        if self.panel.study is not None:
            self._tell_study(self.panel.study, update)
        return update

    def _tell_study(self, study: Study, update: Update) -> None:
        first, state = self._generations, study.state()
        if (generations := study.generations(first)) or state != self._study:
            update.study = StudyNews(**msgspec.structs.asdict(state), first=first, generations=generations)
            self._generations, self._study = first + len(generations), state

    def _worlds(self) -> list[tuple[str, str]]:
        """Return the worlds of the robots: the key of a robot in it, and its name."""
        found: dict[int, tuple[str, str]] = {}
        for key, slot in self.panel.slots.items():
            if (control := slot.control) is not None:
                found.setdefault(id(control.simulation), (key, control.world.scene.name))
        return list(found.values())

    def _robot(self, slot: Slot) -> RobotNews:
        slot.look(self.key)
        told = RobotNews(tick(slot, self._cursor), runner_state(slot.runner, self._behaviour_lines))
        if self._scheme != (self.place, slot.edition):
            self._scheme = self.place, slot.edition
            told.scheme = scheme(slot)
        self._behaviour_lines = slot.runner.line_count
        return told

    def _join(self) -> None:
        """Look at every robot, also those of other tabs: what was started there goes on."""
        there = set(self.panel.slots.values())
        for slot in there - self._joined:
            slot.join(self.key)
        self._joined = there

    async def _send(self, message: Told) -> None:
        await self.send(msgspec.json.encode(message))

    # -- the end --

    def _broke(self, task: asyncio.Future[Any]) -> None:
        """End the page when it is told nothing more, so that the browser opens it again."""
        error = None if task.cancelled() else task.exception()
        if error is not None and not isinstance(error, ConnectionError):
            log.error("a page failed", exc_info=error)
            closing = self._ws.close(code=WSCloseCode.INTERNAL_ERROR, message=b"the program made a mistake")
            self._telling.append(asyncio.ensure_future(closing))

    async def close(self) -> None:
        """Leave all robots: what the page drove stops now."""
        for slot in self._joined:
            slot.leave(self.key)
        self._joined.clear()
        for task in self._telling:
            task.cancel()
        await asyncio.wait(self._telling)
        await super().close()
