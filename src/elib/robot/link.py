"""The link of one robot: its settings, how it is opened, and what all views of the robot share."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import weakref
from dataclasses import dataclass
from typing import Protocol, Self

from elib.base.errors import ElibError, LinkClosed
from elib.base.rules import Lines
from elib.link.protocol.context import Context
from elib.link.protocol.image import Mounting, check_mounting
from elib.link.protocol.profiles import profile_named
from elib.link.protocol.values import Ground
from elib.link.protocol.wifi import stop_command
from elib.link.session import Channel, Ended, LinkCounter, LinkStats, Session, TraceEvent, TraceHook
from elib.link.transport import open_transport, parse_url
from elib.link.transport.lease import lease
from elib.robot.actions import Actions
from elib.robot.events import Events
from elib.robot.motion import Motion
from elib.robot.reconnect import Policy, Reconnector
from elib.robot.signals import TerminationHandler
from elib.robot.sleeping import Standstill
from elib.robot.telemetry import Telemetry
from elib.robot.watchdog import check_supported, is_usual

log = logging.getLogger("elib")

_WITHOUT_MODULE = ({0}, {-1})
"""What ground() reads without the module (wire-protocol.md, 5.12); over a hole, the module still reads some light."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkSettings:
    """How a robot's link is opened, and what happens at its end.

    Raises:
        ArgumentError: There is no such firmware or mounting.
        Unsupported: This system does not support the watchdog.
    """

    keep_moving: bool = False  # do not stop the wheels when the robot is closed
    firmware: str | None = None  # name of the firmware profile to use, whatever the robot answers; None asks the robot
    mounting: Mounting | None = None  # how the robot's camera is mounted; None is the usual way of its firmware
    policy: Policy | None = None  # how a lost link is reopened; None does not reopen it
    # let a small process stop the robot when this program dies or freezes; None: under `elib run` only
    watchdog: bool | None = None

    def __post_init__(self) -> None:
        if self.watchdog:
            check_supported()
        if self.firmware is not None:
            profile_named(self.firmware)
        check_mounting(self.mounting)

    @property
    def is_watched(self) -> bool:
        """Whether the watchdog stops the robot."""
        return is_usual() if self.watchdog is None else self.watchdog


class Record(Protocol):
    """What is kept of a robot's run, until the robot is closed: a log, a recording, what a plot shows."""

    @property
    def is_closed(self) -> bool:
        """Whether it has ended."""

    def close(self) -> None:
        """End it. Safe to repeat."""


class Plot(Record, Protocol):
    """A plot of what a robot does, drawn when the robot is closed, or when this is."""

    path: str  # the file that is written

    @property
    def report(self) -> Record:
        """What is drawn; it ends with the robot."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...


class Link:
    """The link that all views of one robot share: how it is opened, and its session while it is open.

    Raises:
        ArgumentError: *url* is not a URL, or *name* no text.
    """

    def __init__(self, url: str, name: str | None = None, settings: LinkSettings | None = None) -> None:
        parse_url(url)
        self.url = url
        self.name = Lines().require(name, "name") if name else url
        self.settings = settings or LinkSettings()
        self.keep_moving = self.settings.keep_moving
        self.session: Channel | None = None
        self.loop: asyncio.AbstractEventLoop | None = None
        self.counter = LinkCounter()
        self.telemetry = Telemetry()
        self.events = Events()
        self.motion = Motion()
        self.standstill = Standstill()
        self.termination: TerminationHandler | None = None
        self.is_stopped = False
        self.has_reported = False
        """Whether the program knows by an error that its last stop was not confirmed."""
        self.is_over = False
        """Whether it was closed, or could not be opened."""
        self.stay = contextlib.ExitStack()
        self.records: list[Record] = []
        self.plots: list[Plot] = []
        _LINKS.add(self)

    @property
    def channel(self) -> Channel:
        """The open :attr:`session`.

        Raises:
            LinkClosed: The robot is not open yet.
        """
        if self.session is None:
            raise LinkClosed(f"{self.url} is not open", hint="async with elib.open(...) as robot: ...")
        return self.session

    def draw_plots(self) -> None:
        """Draw what the program asked for by :meth:`elib.Epuck.plot`; this takes a second, or several."""
        plots, self.plots = self.plots, []
        for plot in plots:
            try:
                plot.close()
            except ElibError as error:  # the program's own error says more
                log.error("%s", error)

    def judge_ground(self, time: float, event: TraceEvent) -> None:
        """Warn if the first answer to ``ground()`` is that of a robot without the module: the counts do not say so."""
        if isinstance(event, Ended) and isinstance(event.value, Ground):
            self.channel.hooks.remove(self.judge_ground)
            if set(event.value.counts) in _WITHOUT_MODULE:
                log.warning(
                    "%s: every count of ground() is %d: the robot has no ground module, or its firmware does not read "
                    "it (no published BTcom does); a virtual robot has the module if its world's file says "
                    "ground_module = true under [epuck]",
                    self.name,
                    event.value.counts[0],
                )

    async def open(self) -> Channel:
        """Open the link; with a policy, as one that is reopened when it is lost."""
        policy = self.settings.policy
        if policy is None:
            return await self.start()
        with contextlib.ExitStack() as stay:
            stay.enter_context(lease(self.url))  # a simulation must outlive its connections, as a robot does
            channel = await Reconnector(self.url, self.start, policy).open()
            self.stay = stay.pop_all()
        return channel

    async def start(self) -> Session:
        """Open one session."""
        transport = await open_transport(self.url)
        settings = self.settings
        profile = None if settings.firmware is None else profile_named(settings.firmware)
        session = await Session.open(transport, profile=profile, mounting=settings.mounting)
        session.counter = self.counter
        may_move = self.keep_moving or (settings.policy is not None and settings.policy.keep_speed)
        session.final_command = b"" if may_move else stop_bytes(session)
        return session


_LINKS: weakref.WeakSet[Link] = weakref.WeakSet()


def open_urls() -> list[str]:
    """Return the URL of each robot that this program has open, or has made and not yet opened."""
    return [link.url for link in _LINKS.copy() if not link.is_over]


class Linked:
    """What a robot tells about itself and its link, in the async and in the blocking style."""

    _link: Link

    @property
    def url(self) -> str:
        """The URL that was opened."""
        return self._link.url

    @property
    def name(self) -> str:
        """A name for logs, the URL unless given."""
        return self._link.name

    @property
    def firmware(self) -> str:
        """The name of the firmware, such as ``btcom-2.0``, as the robot answered."""
        return self._link.channel.context.profile.name

    @property
    def statistics(self) -> LinkStats:
        """How the link has been so far.

        Example:
            >>> robot.selector().position
            3
            >>> robot.statistics.lost, robot.statistics.resyncs
            (0, 0)
        """
        loop, session = self._link.loop, self._link.session
        if loop is None or session is None:
            return self._link.counter.read(math.nan)
        return self._link.counter.read(loop.time(), session.waiting, session.unanswered)

    def trace(self, hook: TraceHook) -> None:
        """Call ``hook(time, event)`` in the event loop for everything that happens on the link.

        Example:
            >>> robot.trace(lambda time, event: print(type(event).__name__))
            >>> robot.selector().position
            Called
            Wrote
            Received
            Ended
            3
        """
        self._link.channel.hooks.append(hook)


def stop_bytes(session: Channel) -> bytes:
    """Return the bytes that stop this robot whatever it is doing, for when its answer cannot be awaited."""
    profile = session.context.profile
    if profile.codec == "wifi":
        return stop_command(session.context.sent)
    context = Context(profile)
    context.last_set.avoidance = "set_obstacle_avoidance" not in profile.absent
    if context.last_set.avoidance:
        context.last_set.lamps[:] = session.context.last_set.lamps
        context.last_set.rgb[:] = session.context.last_set.rgb
    return Actions.stop.spec.request(context).data
