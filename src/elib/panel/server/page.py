"""One open page: what it asks for is carried out, and it is told what it has subscribed to."""

from __future__ import annotations

import asyncio
import logging
import math
from collections import deque
from collections.abc import Callable, Coroutine, Iterable, Sequence
from typing import Any, ClassVar, NamedTuple

import msgspec
from msgspec import UNSET, Struct, UnsetType

from elib.base.body import AXLE, FOCAL, LENS, SENSOR_DIRECTIONS, SENSOR_RADIUS, WHEEL_DIAMETER
from elib.base.errors import ArgumentError
from elib.base.tasks import Tasks
from elib.panel.behaviours import BehaviourAbout, Play, catalogue, runner_state
from elib.panel.events import KINDS
from elib.panel.panel import REFUSALS, Can, Generation, Listed, Panel, Reachable, Study, StudyAbout, StudyState
from elib.panel.server.conversation import Caller, Connection, Decode, Message, Told
from elib.panel.server.instruments import Cursor, Scheme, Summary, Tick, scheme, summary, tick
from elib.panel.server.pictures import WorldInfo, world_list
from elib.simulator.drawing.robot import LED_ANGLES
from elib.simulator.emulator.control import Control
from elib.simulator.emulator.control_server import time_factor
from elib.simulator.physics.body import HEIGHT
from elib.simulator.physics.optics import ABOVE

MAX_STREAMS = 128
"""Subscriptions of one page: two for each world of a large class, and more."""
AHEAD = 3
"""Messages of one stream on their way to a page that has not drawn them yet, at most."""
SHARE = 0.1
"""How much of the time may go into one stream: of a huge crowd a page is told less often."""
LOOK = 0.1
"""s between two looks for robots that came or went."""
INTERNAL_ERROR = 1011
"""Why a page is left that failed (RFC 6455, 7.4.1)."""
LOOKS = 10
"""Looks for one update that has nothing new: a page that hears nothing for longer knows that something is wrong."""


log = logging.getLogger("elib.panel")


class Ring(Struct):
    """Where on the robot the infrared sensors look and the LEDs sit, rad from straight ahead, positive to the left."""

    sensors: Sequence[float] = SENSOR_DIRECTIONS
    leds: Sequence[float] = tuple(map(math.radians, LED_ANGLES))


class Body(Struct):
    """The robot in m: its body, its wheels, the infrared sensors' distance from the axis, and its camera."""

    height: float = HEIGHT
    axle: float = AXLE
    wheel: float = WHEEL_DIAMETER
    sensor_radius: float = SENSOR_RADIUS
    eye: tuple[float, float] = (LENS, ABOVE)  # how far the lens is ahead of the axle, and above the floor, m
    focal: float = FOCAL  # its distance from the chip, in pixels of the chip: a picture at zoom z has one of z of them


class Hello(Told, tag="hello"):
    """What a page is told once."""

    page: str  # its name at the drive locks
    can: Can  # what it can do
    folder: str  # where files go; empty if the page may not know it
    worlds: list[WorldInfo]
    behaviours: list[BehaviourAbout]
    robots: Sequence[Reachable]  # how the robots of a world are reached that belong to no panel
    study: StudyAbout | None
    kinds: dict[str, str]  # the kinds of event lines, with their titles
    ring: Ring
    body: Body


class RobotNews(Struct):
    """What is new of a robot; its scheme only if that is."""

    tick: Tick
    behaviour: Play
    scheme: Scheme | UnsetType = UNSET


class StudyNews(StudyState):
    """How far the study is, with the generations from the first on that the page does not know yet."""

    first: int
    generations: Sequence[Generation]


class Update(Told, tag="update"):
    """What has changed; a page says ``drawn`` with its number."""

    number: int
    place: str = ""  # the key of the robot that it is about; empty if it is about none or all
    robots: list[Listed] | UnsetType = UNSET  # all robots of the panel
    robot: RobotNews | UnsetType = UNSET
    overview: dict[str, Summary] | UnsetType = UNSET
    worlds: list[tuple[str, str]] | UnsetType = UNSET  # the worlds by their keys, and their names
    study: StudyNews | UnsetType = UNSET


class Wish(NamedTuple):
    """What a page wants to be told: of which robot or world, how many times a second, and under which number."""

    what: str = ""
    of: str = ""
    rate: float = 1 / LOOK
    channel: int = 0
    rays: bool = False


class Stream:
    """Tells one page of one thing, again and again."""

    fastest: ClassVar[float] = 1 / LOOK
    """Hz."""

    def __init__(self, page: Page, wish: Wish) -> None:
        self.wish = wish  # what the page wants
        self._page = page
        self._sent: deque[int] = deque()
        self._task = page.begin(self._run())

    @property
    def control(self) -> Control | None:
        """The control of the world that it tells of, or None."""
        return None

    def drawn(self, number: int) -> None:
        """Note how far the page has come."""
        while self._sent and self._sent[0] <= number:
            self._sent.popleft()

    def end(self) -> None:
        """Tell nothing more."""
        self._task.cancel()

    async def _run(self) -> None:
        loop, factor = asyncio.get_running_loop(), time_factor()
        while True:
            began = loop.time()
            messages = list(self._next()) if len(self._sent) < AHEAD else []
            cost = (loop.time() - began) / SHARE
            for message in messages:
                if isinstance(message, bytes):
                    await self._page.send(message, is_text=False)
                else:
                    await self._page.tell(message)
            due = began + max(cost, factor / min(self.wish.rate, self.fastest))
            await asyncio.sleep(max(0.0, due - loop.time()))

    def _next(self) -> Iterable[Told | bytes]:
        """Return what there is to tell now."""
        raise NotImplementedError

    def _update(self) -> Update:
        """Return an update to be filled."""
        self._page.updates += 1
        self._sent.append(self._page.updates)
        return Update(self._page.updates)


class ListStream(Stream):
    """The robots of the panel, for every page: also those that it does not show go on while it looks."""

    def __init__(self, page: Page) -> None:
        super().__init__(page, Wish())
        self._listed: list[Listed] | None = None
        self._looks = 0

    async def _run(self) -> None:
        await self._page.tell(self._page.hello())
        await super()._run()

    def _next(self) -> Iterable[Update]:
        self._page.meet()
        self._looks += 1
        listed = self._page.panel.labels()
        if listed != self._listed:
            self._listed = listed
            update = self._update()
            update.robots = listed
            yield update
        elif self._looks % LOOKS == 0:
            yield self._update()


class RobotStream(Stream):
    """One robot. When it ends, what the page drove stops."""

    def __init__(self, page: Page, wish: Wish) -> None:
        self._slot = page.panel.slot(wish.of)
        self._cursor, self._edition, self._lines = Cursor(), -1, 0
        super().__init__(page, wish)
        page.meet()
        self._slot.look(page.key)

    def end(self) -> None:
        """Tell nothing more; the page drives no more, unless it has subscribed to the same robot again."""
        super().end()
        if not self._page.shows(self.wish.of):
            self._slot.drive.leave(self._page.key)
            self._slot.look_away(self._page.key)

    def _next(self) -> Iterable[Update]:
        slot = self._slot
        if self._page.panel.slots.get(self.wish.of) is not slot:
            return  # it was taken out of the panel
        update = self._update()
        update.place = self.wish.of
        update.robot = RobotNews(tick(slot, self._cursor), runner_state(slot.runner, self._lines))
        if self._edition != slot.edition:
            self._edition = slot.edition
            update.robot.scheme = scheme(slot)
        self._lines = slot.runner.line_count
        yield update


class OverviewStream(Stream):
    """All robots in short, and their worlds."""

    def _next(self) -> Iterable[Update]:
        panel = self._page.panel
        update = self._update()
        update.worlds = [(key, control.world.scene.name) for key, control in panel.all_worlds().items()]
        update.overview = {key: summary(slot) for key, slot in panel.slots.items()}
        yield update


class StudyStream(Stream):
    """The study to which the page belongs."""

    def __init__(self, page: Page, wish: Wish) -> None:
        self._study, self._first = page.study(), 0
        self._told: StudyState | None = None
        super().__init__(page, wish)

    def _next(self) -> Iterable[Update]:
        first, state = self._first, self._study.state()
        generations = self._study.generations(first)
        if generations or state != self._told:
            update = self._update()
            update.study = StudyNews(**msgspec.structs.asdict(state), first=first, generations=generations)
            self._first, self._told = first + len(generations), state
            yield update


class Page(Caller):
    """One browser page, from the opening of its WebSocket to its end."""

    kind = "page"
    served_by = "the program"
    closing_reason = "not a message of the page"
    logger = log

    def __init__(self, panel: Panel, decode: Decode, connection: Connection) -> None:
        super().__init__(panel, decode, connection)
        self.updates = 0  # how many updates it was sent
        self._telling = Tasks()
        self._streams: dict[tuple[str, int], Stream] = {}
        self._list = ListStream(self)

    # -- what the page says --

    def admit(self, message: Message) -> None:
        """Check that the page may say this; an ArgumentError says what it cannot do."""
        if message.needs and not getattr(self.panel.can, message.needs):
            raise ArgumentError(f"this page cannot {REFUSALS[message.needs]}")

    def subscribe(self, wish: Wish, make: Callable[[Page, Wish], Stream]) -> None:
        """Tell the page of something from now on, in place of what it wanted by the same name and channel.

        A rate of 0 ends that. An ArgumentError says that there is no such robot or study, or that there are too many
        subscriptions. *make* makes the stream.
        """
        key = wish.what, wish.channel
        if key not in self._streams and len(self._streams) >= MAX_STREAMS:
            raise ArgumentError(f"a page has at most {MAX_STREAMS} subscriptions", hint="end one with a rate of 0")
        old = self._streams.get(key)
        if old is not None and wish.rate and old.wish.of == wish.of:
            old.wish = wish  # at another rate, or with rays: what the page knows is not told again
            return
        new = make(self, wish) if wish.rate else None
        self._streams.pop(key, None)
        if new is not None:
            self._streams[key] = new
        if old is not None:
            old.end()

    def drawn(self, number: int, channel: int | None = None) -> None:
        """Note which updates are on the screen, or which frames of the world of a channel."""
        for stream in (self._list, *self._streams.values()):
            if (stream.wish.channel if stream.wish.what == "world" else None) == channel:
                stream.drawn(number)

    def shows(self, robot: str) -> bool:
        """Return whether the page has subscribed to a robot."""
        return any(wish.what == "robot" and wish.of == robot for wish in (each.wish for each in self._streams.values()))

    def world(self, channel: int) -> Control | None:
        """Return the control of the world of a channel, or None if it has none."""
        stream = self._streams.get(("world", channel))
        return None if stream is None else stream.control

    def control(self, channel: int) -> Control:
        """Return the same; an ArgumentError says that there is none."""
        found = self.world(channel)
        if found is None:
            raise ArgumentError("there is no virtual world here", hint="a real robot has its own")
        return found

    def study(self) -> Study:
        """Return the study to which the page belongs; an ArgumentError says that there is none."""
        if self.panel.study is None:
            raise ArgumentError("this page does not belong to a study", hint="elib evolve TASK --view opens one")
        return self.panel.study

    # -- what the page is told --

    def begin(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        """Tell the page something in a task of its own. If that fails, the page ends: the browser opens it again."""
        task = self._telling.begin(work, "elib page")
        task.add_done_callback(self._broke)
        return task

    def hello(self) -> Hello:
        """Return what the page is told first."""
        panel = self.panel
        return Hello(
            page=self.key,
            can=panel.can,
            folder="" if panel.is_shared else str(panel.folder.path),
            worlds=world_list(),
            behaviours=catalogue(),
            robots=panel.reachable,
            study=None if panel.study is None else panel.study.about(),
            kinds=KINDS,
            ring=Ring(),
            body=Body(),
        )

    # -- the end --

    def _broke(self, task: asyncio.Task[Any]) -> None:
        error = None if task.cancelled() else task.exception()
        if error is not None and not isinstance(error, ConnectionError):
            log.error("a page failed", exc_info=error)
            closing = self.connection.close(INTERNAL_ERROR, "the program made a mistake")
            self._telling.begin(closing, "elib page ends")

    async def close(self) -> None:
        """Leave all robots: what the page drove stops now."""
        for task in self._telling:
            task.cancel()
        await super().close()
        await self._telling.end()
