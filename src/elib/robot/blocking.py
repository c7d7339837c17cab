"""The robot for ordinary programs: blocking calls, begin/end pairs and callbacks over one event loop."""

from __future__ import annotations

import concurrent.futures
import contextlib
import copy
import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Self

from elib.base.errors import ElibError, LinkClosed
from elib.link.protocol.image import Mounting
from elib.link.protocol.styles import Action, BeginStyle, BlockingStyle, CallbackStyle, Pending, V_contra
from elib.link.protocol.table import Command
from elib.link.transport import speed_of
from elib.robot.actions import Actions
from elib.robot.aio import Epuck
from elib.robot.aio import open as open_async
from elib.robot.events import BlockingEvents
from elib.robot.link import Linked, Plot
from elib.robot.portal import KeepAlive, Portal
from elib.robot.telemetry import RATE, BlockingWatch

if TYPE_CHECKING:  # loaded when a log or a recording begins: most programs have none
    from elib.records.log import Log, Vocabulary
    from elib.records.recorder import Recorder
    from elib.records.writer import Target

AnyOperation = Command[Any, Any] | Action[Any, Any]


class _OverPortal(Actions):
    """A robot in a style for threads: its calls go through the portal into the robot's event loop."""

    def __init__(self, robot: Epuck, portal: Portal, keep_alive: KeepAlive | None) -> None:
        self._robot = robot
        self._portal = portal
        self._keep_alive = keep_alive

    def within(self, seconds: float, *, tries: int = 1, quick_only: bool = False) -> Self:
        """Return a view of the robot whose calls wait this long: see :meth:`elib.Epuck.within`.

        Example:
            >>> robot.within(0.5, tries=3).selector()
            Selector(position=3)
        """
        view = copy.copy(self)
        view._robot = self._robot.within(seconds, tries=tries, quick_only=quick_only)
        return view


class BlockingEpuck(Linked, _OverPortal, BlockingStyle):
    """One e-puck for ordinary code: calls wait and return values. Make it with :func:`elib.connect`.

    Leaving the ``with`` block, or :meth:`close`, stops the robot whatever ended the block, Ctrl-C and SIGTERM too,
    unless ``keep_moving`` was set. A robot that the program no longer refers to is closed as well. Any thread may call.
    """

    def __init__(self, robot: Epuck, portal: Portal, keep_alive: KeepAlive | None = None) -> None:
        super().__init__(robot, portal, keep_alive)
        self._link = robot._link

    def _call(self, operation: AnyOperation, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
        return self._portal.call(self._robot._call(operation, args, kwargs))

    @property
    def begin(self) -> BeginEpuck:
        """The begin style: ``pending = robot.begin.proximity()``, later ``pending.end()``.

        Example:
            >>> pending = robot.begin.selector()
            >>> pending.end().position
            3
        """
        return BeginEpuck(self._robot, self._portal, self._keep_alive)

    def callback(
        self,
        on_reply: Callable[[V_contra, Any], object] | None = None,
        on_error: Callable[[ElibError, Any], object] | None = None,
        state: Any = None,
    ) -> CallbackEpuck[V_contra]:
        """Return the callback style: exactly one of the two is called, once, off the event loop.

        Args:
            on_reply: Called as ``on_reply(value, state)``. A type checker compares the annotations of a function with
                what the command returns.
            on_error: Called as ``on_error(error, state)``.
            state: Passed to the callback unchanged.

        Example:
            >>> robot.callback(lambda value, state: print(state, value.position), print, "selector:").selector()
            >>> robot.sleep(0.5)
            selector: 3
        """
        return CallbackEpuck(self._robot, self._portal, on_reply, on_error, state, self._keep_alive)

    def watch(self, *names: str, rate: float = RATE) -> BlockingWatch:
        """Return snapshots of the readings, as they come: ``for snapshot in robot.watch("proximity"): ...``.

        Args:
            names: Readings of ``sensors()``, and ``image``; see :meth:`elib.Epuck.watch`.
            rate: Snapshots a second, 0.001 to 1000 Hz.

        Example:
            >>> for snapshot in robot.watch("encoders", rate=10):
            ...     if snapshot.sequence == 2:
            ...         break
            >>> snapshot.encoders
            Steps(left=0, right=0)
        """
        return BlockingWatch(self._robot.watch(*names, rate=rate), self._portal, self._keep_alive)

    # -- closing --

    def __enter__(self) -> Self:
        if self._portal.is_closed:
            raise LinkClosed(f"{self.url} was closed", hint="a robot object opens once: call elib.connect() again")
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop the robot (unless ``keep_moving``), end the session and free the port. Safe to repeat.

        Example:
            >>> robot.close()
            >>> robot
            <BlockingEpuck sim://?speed=max closed>
        """
        self._portal.leave()

    def stop_and_close(self) -> ElibError | None:
        """Close the robot like :meth:`close`, and return why it did not confirm its stop, instead of logging that.

        Returns:
            What :meth:`elib.Epuck.stop_and_close` returns.

        Example:
            >>> robot.stop_and_close()
        """
        if self._portal.is_closed:
            return None
        try:
            return self._portal.call(self._robot.stop_and_close())
        finally:
            self._portal.leave()

    # -- about the robot --

    @property
    def robot(self) -> Epuck:
        """The async robot behind this one; its calls must run in its event loop."""
        return self._robot

    @property
    def events(self) -> BlockingEvents:
        """Events of the link: resets, late answers, the link down and back. They are kept from the first use on.

        Example:
            >>> events = robot.events
            >>> list(events.within(1))
            []
        """
        return BlockingEvents(self._robot.events, self._portal, self._keep_alive)

    @property
    def time(self) -> float:
        """The robot's time: the clock of its event loop, s since the robot was opened."""
        return self._link.standstill.read(self._robot.time)

    def log(self, target: Target, *, names: Vocabulary = "python") -> Log:
        """Write a line for each call and each outcome: see :meth:`elib.Epuck.log`.

        Example:
            >>> with robot.log("run.log") as log:
            ...     log.comment("first round")
            ...     robot.drive(0.05).x > 0
            True
        """
        return self._robot.log(target, names=names)

    def record(
        self,
        path: str | os.PathLike[str],
        *,
        part_bytes: int | None = None,
        part_seconds: float | None = None,
        keep: int | None = None,
    ) -> Recorder:
        """Record everything that happens on the link: see :meth:`elib.Epuck.record`.

        Example:
            >>> with robot.record("run.mcap") as recorder:
            ...     recorder.note("first round")
            ...     robot.drive(0.05).x > 0
            True
        """

        async def record() -> Recorder:
            return self._robot.record(path, part_bytes=part_bytes, part_seconds=part_seconds, keep=keep)

        return self._portal.call(record())

    def plot(self, path: str | os.PathLike[str]) -> Plot:
        """Draw what the robot does from now on, when it is closed: see :meth:`elib.Epuck.plot`.

        Example:
            >>> with robot.plot("run.png"):
            ...     robot.drive(0.05).x > 0
            True
        """

        async def plot() -> Plot:
            return self._robot.plot(path)

        return self._portal.call(plot())

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} {'closed' if self._portal.is_closed else 'open'}>"


class BeginEpuck(_OverPortal, BeginStyle):
    """The begin style: calls return a :class:`Pending` at once."""

    def __init__(self, robot: Epuck, portal: Portal, keep_alive: KeepAlive | None) -> None:
        super().__init__(robot, portal, keep_alive)
        self._callback: Callable[[Pending[Any]], object] | None = None
        self._state: Any = None

    def __call__(self, callback: Callable[[Pending[Any]], object] | None = None, state: Any = None) -> BeginEpuck:
        """Return a begin style whose calls run ``callback(pending)`` at their end and carry ``pending.state``."""
        view = copy.copy(self)
        view._callback, view._state = callback, state
        return view

    def _call(self, operation: AnyOperation, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
        future = self._portal.begin(self._robot._call(operation, args, kwargs))
        pending = Pending(future, self._portal, f"begin.{operation.name}", self._state, self._keep_alive)
        if self._callback is not None:
            pending.add_done_callback(self._callback)
        return pending


class CallbackEpuck(_OverPortal, CallbackStyle[V_contra]):
    """The callback style: calls return at once, and one of two callbacks gets the outcome."""

    def __init__(
        self,
        robot: Epuck,
        portal: Portal,
        on_reply: Callable[[V_contra, Any], object] | None,
        on_error: Callable[[ElibError, Any], object] | None,
        state: Any,
        keep_alive: KeepAlive | None,
    ) -> None:
        super().__init__(robot, portal, keep_alive)
        self._on_reply = on_reply
        self._on_error = on_error
        self._state = state

    def _call(self, operation: AnyOperation, args: tuple[Any, ...], kwargs: dict[str, Any]) -> None:
        future = self._portal.begin(self._robot._call(operation, args, kwargs))
        name = f"the callback of {operation.name}()"

        def report(_: object) -> None:
            self._portal.later(lambda: self._report(future), name)

        future.add_done_callback(report)

    def _report(self, future: concurrent.futures.Future[Any]) -> None:
        try:
            value = future.result()
        except concurrent.futures.CancelledError:
            error: ElibError = LinkClosed("the robot was closed before the answer came")
        except ElibError as failure:
            error = failure
        except Exception as failure:
            error = ElibError(f"{type(failure).__name__}: {failure}")
            error.__cause__ = failure
        else:
            if self._on_reply is not None:
                self._on_reply(value, self._state)
            return
        if self._on_error is not None:
            self._on_error(error, self._state)


def connect(
    url: str | None = None,
    *,
    name: str | None = None,
    keep_moving: bool = False,
    firmware: str | None = None,
    mounting: Mounting | None = None,
    watchdog: bool | None = None,
) -> BlockingEpuck:
    """Open a robot for ordinary, blocking code: ``with elib.connect(url) as robot: ...``.

    Args:
        url: For example ``sim://``, ``serial:///dev/rfcomm0`` or ``tcp://host:port``. With ``sim://?speed=max`` time
            runs as fast as this computer can. Without a URL, the environment variable ``ELIB_ROBOT`` names the robot;
            without that it is ``sim://``.
        name: A name for logs; the URL unless given.
        keep_moving: Do not stop the wheels at the end.
        firmware: Name of the firmware profile to use, whatever the robot answers.
        mounting: How this robot's camera is mounted, if it is not as usual for its firmware.
        watchdog: Let a small process stop the robot when this program dies, or freezes for half a second; unless
            given, only ``elib run`` does.

    Raises:
        ArgumentError: The URL or an argument is wrong.
        LinkError: The robot cannot be opened; the subclass says why.

    Example:
        >>> with elib.connect("sim://square?speed=max") as robot:
        ...     round(robot.drive(0.1).x, 2)
        0.1
    """
    return connect_robot(
        open_async(url, name=name, keep_moving=keep_moving, firmware=firmware, mounting=mounting, watchdog=watchdog)
    )


def connect_robot(robot: Epuck) -> BlockingEpuck:
    """Open *robot* on an event loop of its own and return its blocking style."""
    portal = Portal(speed_of(robot.url))
    try:
        portal.call(robot.__aenter__())
    except BaseException:
        with contextlib.suppress(ElibError):
            portal.close()
        raise
    portal.before_close, portal.after_close = robot._close, robot._link.draw_plots
    return BlockingEpuck(robot, portal, KeepAlive(portal))
