"""The async robot: every command is a coroutine method."""

from __future__ import annotations

import asyncio
import contextlib
import copy
import logging
import math
import os
from collections.abc import Callable, Coroutine, Generator, Iterable, Iterator
from importlib import import_module
from typing import TYPE_CHECKING, Any, Self, TypeVar

from elib.base.errors import ArgumentError, ElibError, LinkClosed, RemoteProtocolError, ReplyTimeout
from elib.base.pose import Pose
from elib.base.rules import Whole
from elib.link.protocol.context import Context
from elib.link.protocol.image import Mounting
from elib.link.protocol.styles import Action, AsyncStyle
from elib.link.protocol.table import Command, Request
from elib.link.session import Channel, Ended, check_timeout
from elib.robot.actions import Actions
from elib.robot.events import Events
from elib.robot.link import Link, Linked, LinkSettings, Plot, Record, stop_bytes
from elib.robot.motion import Motion
from elib.robot.signals import TerminationHandler
from elib.robot.snapshot import period_of, watched_names
from elib.robot.substitute import link_to
from elib.robot.telemetry import RATE, Watch

if TYPE_CHECKING:  # loaded when a log or a recording begins: most programs have none
    from elib.records.log import Log, Vocabulary
    from elib.records.recorder import Recorder
    from elib.records.writer import Target

T = TypeVar("T")

TRIES = Whole(1, 100)
"""How often a reading is asked for at most."""

log = logging.getLogger("elib")


class Epuck(Linked, Actions, AsyncStyle):
    """One e-puck in an event loop. Make it with :func:`elib.open`; use it as ``async with`` or await it and close it.

    Leaving the block stops the robot, whatever ended it, unless ``keep_moving`` was set.
    """

    def __init__(self, link: Link) -> None:
        if isinstance(link, str):
            hint = f"async with elib.open({link!r}) as robot: ..."
            raise ArgumentError("elib.Epuck is the class of a robot, and opens none", hint=hint)
        self._link = link
        self._timeout: float | None = None
        self._is_for_quick = False
        self._tries = 1
        self._deadline: Deadline | None = None

    # -- opening and closing --

    async def __aenter__(self) -> Self:
        link = self._link
        if link.session is not None:
            raise LinkClosed(f"{link.url} was opened before", hint="a robot object opens once: call elib.open() again")
        link.termination = TerminationHandler()
        try:
            link.session = await link.open()
        except BaseException:
            link.is_over = True
            await link.termination.leave()
            raise
        link.loop = asyncio.get_running_loop()
        session = link.session
        link.motion.follow(session, session.counters)
        session.hooks.append(link.judge_ground, Ended)
        try:
            if not link.keep_moving:
                link.termination.guard(session, lambda: stop_bytes(session), is_watched=link.settings.is_watched)
            for hook in tuple(_hooks):
                for record in hook(self) or ():
                    self._close_at_end(record)
        except BaseException:
            await self.close()
            raise
        return self

    def __await__(self) -> Generator[Any, None, Self]:
        return self._open_without_block().__await__()

    async def _open_without_block(self) -> Self:
        await self.__aenter__()
        assert self._link.termination is not None
        await self._link.termination.close_with_loop(self.close)
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()
        termination = self._link.termination
        if termination is not None and termination.came is not None:
            raise SystemExit(128 + termination.came)

    async def close(self) -> None:
        """Stop the robot (unless ``keep_moving``), end the session and free the port. Safe to repeat.

        A stop that is not confirmed is logged, not raised: that would hide the error that ended the block.
        """
        await self._close()
        if self._link.plots:
            await asyncio.to_thread(self._link.draw_plots)  # other robots of the loop go on meanwhile

    async def _close(self) -> None:
        session = self._link.session
        error = await self.stop_and_close()
        is_elsewhere = isinstance(error, LinkClosed) or (session is not None and session.transport.origin == "replay")
        if not (error is None or is_elsewhere or self._link.has_reported):
            self._warn(error.message)

    async def stop_and_close(self) -> ElibError | None:
        """Close the robot like :meth:`close`, and return why it did not confirm its stop, instead of logging that.

        Returns:
            The error that the last stop ended in; None if the stop was confirmed, or if none was to be sent because the
            robot was closed before, keeps moving, or is a recording.
        """
        link = self._link
        session = link.session
        if session is None:
            return None
        try:
            if link.keep_moving or link.is_stopped:
                return None
            link.is_stopped = True
            return await self._stop_for_good(session)
        finally:
            link.is_over = True
            await session.close()
            link.stay.close()
            await link.telemetry.close()
            link.events.close()
            for record in link.records:
                try:
                    record.close()
                except ElibError as error:  # the block's own error says more
                    log.error("%s", error)
            if link.termination is not None:
                await link.termination.leave()

    async def _stop_for_good(self, session: Channel) -> ElibError | None:
        """Send a stop as the robot's last command, even if other tasks still drive it.

        Returns:
            Why it was not confirmed; None if it was.
        """
        request = Actions.stop.spec.request(session.context)
        try:
            await session.execute_last(request, session.stopping_time)
        except BaseException as error:
            # Not confirmed: answers are lost, or time is short. A stop without an answer may still arrive.
            session.send_unqueued(stop_bytes(session))
            if not isinstance(error, ElibError):
                self._warn(type(error).__name__)
                raise
            return error
        return None

    def _warn(self, reason: str) -> None:
        log.warning("%s did not confirm that it stands: it may still be moving (%s)", self.name, reason)

    # -- calls --

    def within(self, seconds: float, *, tries: int = 1, quick_only: bool = False) -> Self:
        """Return a view of the robot whose calls wait this long, instead of each command's own time.

        Args:
            seconds: From the call to its end at the latest, s.
            tries: How often a call that only reads is asked at most, 1 to 100: again when its share of the time is over
                without an answer. A call that acts on the robot is sent once: whether it was done is unknown. Only
                ``stop()`` is always sent again, until it is confirmed or its time is over.
            quick_only: Whether motions, pictures and other slow commands keep their own time, on every link.

        Raises:
            ArgumentError: *seconds* is not a number from 0 to 3600, or *tries* is out of its range.
        """
        view = copy.copy(self)
        view._timeout, view._tries = check_timeout(seconds), TRIES.require(tries, "tries")
        view._is_for_quick = quick_only
        return view

    def _time_for(self, request: Request[Any], usual: float) -> float:
        if self._timeout is None or (self._is_for_quick and not request.is_quick):
            return usual
        return self._timeout

    def _call(
        self, operation: Command[Any, Any] | Action[Any, Any], args: tuple[Any, ...], kwargs: dict[str, Any]
    ) -> Any:
        self._link.standstill.look(self._link.loop)
        if isinstance(operation, Action):
            actor = self
            if self._timeout is not None and not self._is_for_quick:
                actor = copy.copy(self)
                actor._deadline = Deadline(self._timeout)  # one for all the requests of the action
            checked = operation.check(args, kwargs)
            call: Any = operation.function(actor, *checked.args, **checked.kwargs)
        else:
            spec = operation.spec
            request = spec.request(self._link.channel.context, *args, **kwargs)
            call = self._ask(request, self._time_for(request, request.timeout))
        call.__qualname__ = f"Epuck.{operation.name}"  # Python names it so if the await was forgotten
        return call

    def _ask(self, request: Request[T], timeout: float) -> Coroutine[Any, Any, T]:
        if request.is_urgent:
            return self._insist(request, timeout)
        if self._tries > 1 and request.only_reads:
            return _ask_again(self._link.channel, request, timeout, self._tries)
        return self._link.channel.execute(request, timeout)

    async def _insist(self, request: Request[T], timeout: float) -> T:
        """Send a stop again and again until it is confirmed: it does no harm twice, and it must arrive."""
        session = self.session
        try:
            answer = await _ask_again(session, request, timeout, int(timeout / session.stopping_time))
        except ElibError:
            self._link.has_reported = True
            raise
        self._link.has_reported = False
        return answer

    async def execute(self, request: Request[T], default: float) -> T:
        """Send *request* and return its answer, within *default* seconds unless :meth:`within` said otherwise."""
        if self._deadline is not None:
            return await self._ask(request, self._deadline.left())
        return await self._ask(request, self._time_for(request, default))

    @property
    def time_given(self) -> float:
        """The time that :meth:`within` gave to this action, s; infinite without one."""
        return math.inf if self._deadline is None else self._deadline.seconds

    @property
    def time_left(self) -> float:
        """The part of :attr:`time_given` that is left, s."""
        return math.inf if self._deadline is None else self._deadline.left()

    def watch(self, *names: str, rate: float = RATE) -> Watch:
        """Return snapshots of the readings, as they come: ``async for snapshot in robot.watch("proximity"): ...``.

        All watchers of a robot share one poller, which has one request on the wire at most. A slow watcher misses
        snapshots, and a slow link makes them rarer; neither delays anything else. Over Wi-Fi nothing is asked: the
        robot streams its sensors, and pictures while they are watched.

        Args:
            names: Readings of ``sensors()``, and ``image``; without names, all that the firmware has except ``image``.
            rate: Snapshots a second, 0.001 to 1000 Hz; over Wi-Fi the most of them, and every picture makes one.

        Raises:
            ArgumentError: There is no such reading, or the rate is out of its range.
            Unsupported: The firmware does not have a reading.
            LinkClosed: The robot is not open.
        """
        view = copy.copy(self)
        # All watchers share the poller: it uses its own times, not those of one view.
        view._timeout, view._tries, view._is_for_quick = None, 1, False
        return Watch(self._link.telemetry, view, watched_names(names, self.context.profile), period_of(rate))

    # -- about the robot --

    @property
    def session(self) -> Channel:
        """The session, or what makes sessions for a reconnecting robot.

        Raises:
            LinkClosed: The robot is not open yet.
        """
        return self._link.channel

    @property
    def motion(self) -> Motion:
        """The state of its motions and its odometry."""
        return self._link.motion

    @property
    def context(self) -> Context:
        """Profile, origin and memory of the connection."""
        return self.session.context

    @property
    def events(self) -> Events:
        """Events of the link: resets, late answers, the link down and back. They are kept from the first use on."""
        self._link.events.follow(self.session)
        return self._link.events

    @property
    def is_reconnecting(self) -> bool:
        """Whether it reopens its link when it is lost (:func:`elib.reconnecting`)."""
        return self._link.settings.policy is not None

    @property
    def time(self) -> float:
        """The robot's time: the clock of its event loop, s, which begins at 0 unless ``asyncio.run`` made the loop.

        Any thread may read it.

        Raises:
            RuntimeError: The robot is not open, and no event loop runs.
        """
        loop = self._link.loop
        return (asyncio.get_running_loop() if loop is None else loop).time()

    def log(self, target: Target, *, names: Vocabulary = "python") -> Log:
        """Write a line for each call and each outcome.

        ::

            with robot.log("run.log") as log:
                log.comment("start of the second round")

        Args:
            target: Path of a file, which is created or appended to, or an open text stream, which stays open.
            names: How commands are named: "python" (``proximity``), or "2011" as in that library (``GetIR(..)``).

        Returns:
            The log, running until it is closed or the robot is.

        Raises:
            ArgumentError: The target takes no text, or there are no such names.
            LinkClosed: The robot is not open, or was closed.
            OSError: The file cannot be opened.
        """
        self._check_open()
        from elib.records.log import Log

        log = Log(self, target, names=names)
        self._close_at_end(log)
        return log

    def record(
        self,
        path: str | os.PathLike[str],
        *,
        part_bytes: int | None = None,
        part_seconds: float | None = None,
        keep: int | None = None,
    ) -> Recorder:
        """Record everything that happens on the link, to read, analyse and replay it: the flight recorder.

        ::

            with robot.record("run.mcap") as recorder:
                recorder.note("the second round")

        What is older than a second of real time stays in the file, however the program ends. Begin before the first
        command if the recording is to be replayed from its start.

        Args:
            path: Path of the file, ``.mcap``; it must not exist. Later parts are called ``NAME.part2.mcap`` and so on.
            part_bytes: Size after which the next part begins, bytes, 10 000 at least; None for one file.
            part_seconds: Robot time after which the next part begins, s, 1 at least; None for one file.
            keep: Parts that are kept, the newest ones, 2 at least; None for all.

        Returns:
            The recorder, running until it is closed or the robot is.

        Raises:
            ArgumentError: The file exists, its name ends otherwise, or a number is out of its range.
            Unsupported: The package mcap is not installed (extra ``record``).
            LinkClosed: The robot is not open, or was closed.
            OSError: The file cannot be opened.
        """
        self._check_open()
        from elib.records.recorder import Recorder

        recorder = Recorder(self, path, part_bytes=part_bytes, part_seconds=part_seconds, keep=keep)
        self._close_at_end(recorder)
        return recorder

    def plot(self, path: str | os.PathLike[str]) -> Plot:
        """Draw what the robot does from now on: its path, the speeds of its wheels, and what it read.

        ::

            robot.plot("run.png")
            robot.set_speed(0.3, 0.5)

        The path is the true one in a simulation of this process; else it follows from the speeds told to the wheels.

        Args:
            path: File to write when the robot is closed: ``.png``, ``.svg`` or ``.pdf``. An existing one is replaced.

        Returns:
            The plot. Its ``close()`` draws it earlier, and so does ``with robot.plot(...):``.

        Raises:
            ArgumentError: The name ends otherwise, or there is no such folder.
            Unsupported: Matplotlib is not installed (extra ``plot``).
            LinkClosed: The robot is not open, or was closed.
        """
        self._check_open()
        plot: Plot = import_module("elib.studies.drive").Plot(self, path)  # it is above the robot, and goes by name
        self._close_at_end(plot.report)
        self._link.plots.append(plot)
        return plot

    def _close_at_end(self, record: Record) -> None:
        """Close *record* with the robot, at the latest; forget those that were closed before."""
        self._link.records = [each for each in self._link.records if not each.is_closed] + [record]

    def _check_open(self) -> None:
        ended = self.session.error
        if ended is not None:
            raise LinkClosed(f"{self.url} is not open any more: {ended.message}", hint="open a new connection")

    @property
    def odometry_pose(self) -> Pose:
        """Where the robot is by the step counters that were read last, relative to where it was opened."""
        return self._link.motion.odometry.pose

    @property
    def call_count(self) -> int:
        """Number of calls that have ended, with whatever outcome."""
        return self._link.counter.calls

    def __repr__(self) -> str:
        session = self._link.session
        state = "not open" if session is None else "open" if session.error is None else "closed"
        return f"<{type(self).__name__} {self.name} {state}>"


Hook = Callable[["Epuck"], Iterable[Record] | None]
"""A function that takes a robot that was opened just now; it may return what is to be closed with the robot."""
_hooks: list[Hook] = []


@contextlib.contextmanager
def on_open(hook: Hook) -> Iterator[None]:
    """Call *hook* in its event loop for every robot that this process opens while the block lasts, before its program.

    An error of the hook closes the robot and ends its opening.
    """
    _hooks.append(hook)
    try:
        yield
    finally:
        _hooks.remove(hook)


class Deadline:
    """The time shared by all requests of one action, from the first one on."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self._end: float | None = None

    def left(self) -> float:
        """Return what is left, s."""
        now = asyncio.get_running_loop().time()
        if self._end is None:
            self._end = now + self.seconds
        return max(0.0, self._end - now)


async def _ask_again(session: Channel, request: Request[T], timeout: float, tries: int) -> T:
    """Send *request*, which does no harm twice, up to *tries* times; each try has its share of the time left."""
    # A stop whose bytes were garbled is refused, or its answer makes no sense; the robot may still be moving then.
    again = (ReplyTimeout, RemoteProtocolError) if request.is_urgent else ReplyTimeout
    end = asyncio.get_running_loop().time() + timeout
    for left in range(tries, 1, -1):
        try:
            return await session.execute(request, max(0.0, end - asyncio.get_running_loop().time()) / left)
        except again:
            continue
    try:
        return await session.execute(request, max(0.0, end - asyncio.get_running_loop().time()))
    except ReplyTimeout as error:
        if tries < 2:
            raise
        message = f"{request} did not end within {timeout:g} s, though it was tried {tries} times"
        raise ReplyTimeout(message, request=str(request), image=error.image) from None


def open(  # noqa: A001  # elib.open is the name users read
    url: str | None = None,
    *,
    name: str | None = None,
    keep_moving: bool = False,
    firmware: str | None = None,
    mounting: Mounting | None = None,
    watchdog: bool | None = None,
) -> Epuck:
    """Return an async robot: ``async with elib.open(url) as robot: ...``. ``elib.connect_async`` is the same function.

    Args:
        url: For example ``sim://``, ``serial:///dev/rfcomm0`` or ``tcp://host:port``. Without one, the environment
            variable ``ELIB_ROBOT`` names the robot; without that it is ``sim://``.
        name: A name for logs; the URL unless given.
        keep_moving: Do not stop the wheels when the block ends.
        firmware: Name of the firmware profile to use, whatever the robot answers.
        mounting: How this robot's camera is mounted, if it is not as usual for its firmware.
        watchdog: Let a small process stop the robot when this program dies, or freezes for half a second; unless
            given, only ``elib run`` does.

    Raises:
        ArgumentError: The URL is wrong, or there is no such firmware or mounting.
        Unsupported: This system does not support the watchdog.
    """
    settings = LinkSettings(keep_moving=keep_moving, firmware=firmware, mounting=mounting, watchdog=watchdog)
    return Epuck(link_to(url, name, settings))


connect_async = open
