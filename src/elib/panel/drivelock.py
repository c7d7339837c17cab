"""Who drives a robot, and the dead man's switch: a robot that no one drives stands still.

A page that drives says so at least every tenth of a second, also while the hand does not move. When the page falls
silent for any reason (it is closed or hidden, its network is gone, its browser is busy), the robot is told to stop.

A stop is meant: a stick that is held while somebody presses stop moves nothing until it has been released once.

The states and what changes them are data (:data:`LOCK_STATES`, :data:`WHEEL_STATES`); only :meth:`DriveLock._happen`
changes them.
"""

from __future__ import annotations

import asyncio
import enum
from collections.abc import Awaitable, Callable, Mapping

from elib.base.errors import ElibError
from elib.base.rules import Number
from elib.base.tasks import end_tasks

DEAD_MAN = 0.3
"""s of silence of the page that drives after which the stop is sent: with a round trip it stands within 0.5 s."""
AGAIN = 0.2
"""s until a stop that was not confirmed is sent again."""
NEAR_STOP = 0.005
"""rev/s. A lower speed counts as zero: 0.001 rev/s, one step a second, is the slowest speed of a wheel."""

Speeds = tuple[float, float]
STANDING: Speeds = (0.0, 0.0)


class Event(enum.Enum):
    """What happens to a robot and to who drives it."""

    TAKE = "a page begins to drive: it steers, sends a command that moves the robot, or asks to drive"
    TAKE_HELD = "the same, by a page whose stick was held when somebody pressed stop, and not released since"
    STICK_RELEASED = "the stick of the page that drives is back in its middle"
    STOP = "somebody presses stop"
    TAKE_OVER = "another page takes the robot from the one that drives; take follows"
    LEAVE = "the page that drives is closed or hidden, or drives no more"
    SILENCE = "0.3 s without a sign of the page that drives, or after a command that no page watches over"
    HALT = "a program pauses or ends"
    RELEASE = "a program begins or continues; no person moves the robot"
    MOVE = "the robot is sent what makes it move, by a page or a program"
    REST = "the robot confirms speeds of 0 behind which nothing was sent that moves it"
    NO_REST = "the robot does not confirm speeds of 0"
    STOPPED = "the robot confirms the stop"
    OVERTAKEN = "the robot confirms the stop, but was sent something behind it that moves it"
    ATTACH = "the robot is connected, and was stopped"
    DETACH = "the robot cannot be reached"
    CLOSE = "the panel is closed"

    __hash__ = object.__hash__


class LockState(enum.Enum):
    """Who drives."""

    FREE = "no page drives; a program may"
    DRIVEN = "one page drives"
    LATCHED = "one page drives, but its stick moves nothing until it was released"
    DETACHED = "there is no robot to drive"
    CLOSED = "there is nothing to drive any more"

    __hash__ = object.__hash__


class WheelState(enum.Enum):
    """What is known of the wheels, and whether the stop is sent until it is confirmed."""

    STANDING = "the wheels stand"
    MOVING = "the wheels may turn"
    CHECKING = "the wheels stand; all the same the stop is sent until it is confirmed"
    STOPPING = "the wheels may turn; the stop is sent until it is confirmed"

    __hash__ = object.__hash__


STOPS = (Event.STOP, Event.TAKE_OVER, Event.LEAVE, Event.SILENCE, Event.HALT)
"""The events after which the robot is to stand."""
_GONE = {Event.DETACH: LockState.DETACHED, Event.CLOSE: LockState.CLOSED}
_END = dict.fromkeys((Event.TAKE_OVER, Event.LEAVE, Event.SILENCE, Event.RELEASE), LockState.FREE) | _GONE

LOCK_STATES: Mapping[LockState, Mapping[Event, LockState]] = {
    LockState.FREE: {Event.TAKE: LockState.DRIVEN, Event.TAKE_HELD: LockState.LATCHED, **_GONE},
    LockState.DRIVEN: _END | {Event.STOP: LockState.LATCHED},
    LockState.LATCHED: _END | {Event.STICK_RELEASED: LockState.DRIVEN},
    LockState.DETACHED: {Event.ATTACH: LockState.FREE, Event.CLOSE: LockState.CLOSED},
    LockState.CLOSED: {},
}
_STANDS = dict.fromkeys((Event.STOPPED, Event.DETACH, Event.CLOSE), WheelState.STANDING)
_MOVES = dict.fromkeys((Event.OVERTAKEN, Event.DETACH, Event.CLOSE), WheelState.MOVING)
WHEEL_STATES: Mapping[WheelState, Mapping[Event, WheelState]] = {
    WheelState.STANDING: {Event.MOVE: WheelState.MOVING}
    | dict.fromkeys(({*STOPS, Event.NO_REST} - {Event.SILENCE}), WheelState.CHECKING),
    WheelState.MOVING: dict.fromkeys((Event.REST, Event.ATTACH), WheelState.STANDING)
    | dict.fromkeys((*STOPS, Event.NO_REST), WheelState.STOPPING),
    WheelState.CHECKING: _STANDS | {Event.MOVE: WheelState.STOPPING, Event.OVERTAKEN: WheelState.STANDING},
    WheelState.STOPPING: _MOVES | {Event.REST: WheelState.CHECKING, Event.STOPPED: WheelState.STANDING},
}
"""An event that is not listed for a state changes nothing. Without a robot nothing is stopped."""


class DriveLock:
    """Steers one robot for one page at a time, on the running event loop.

    Args:
        drive: Sets the wheels, rev/s.
        stop: Stops the robot, past all that waits.

    Attributes:
        stop_count: How often stop was pressed.
        move_count: How often the robot was sent what makes it move.
    """

    def __init__(
        self, drive: Callable[[float, float], Awaitable[object]], stop: Callable[[], Awaitable[object]]
    ) -> None:
        self.state = LockState.FREE  # who drives
        self.wheels = WheelState.STANDING  # what is known of the wheels
        self.driver = ""  # the page that drives; empty while no page does
        self.limit = 0.5  # highest speed of a wheel, as a share of what the robot can do, 0..1
        self.fastest = 1.0  # highest speed of a wheel of this robot, rev/s
        self.trouble = ""  # why the last command was not confirmed; empty if it was
        self.stop_count = self.move_count = 0
        # called with `steer` when a person moves the stick, and with `stop` when a person stops the robot: a program
        # that drives the robot then has to pause, or to end
        self.on_hand: Callable[[str], object] = lambda _: None
        self._drive, self._stop = drive, stop
        self._loop = asyncio.get_running_loop()
        self._target: Speeds = STANDING
        self._sent: Speeds | None = STANDING  # None: the wheels may have other speeds than those sent last
        self._is_due = False  # whether the target is still to be sent
        self._stops = 0  # how many were asked for: one that was sent before the newest does not confirm it
        self._holding: set[str] = set()  # the pages whose sticks are out of their middle
        self._held: set[str] = set()  # those of them that were so at a stop
        self._silence: asyncio.TimerHandle | None = None
        self._sending: asyncio.Task[None] | None = None
        self._stopping: asyncio.Task[None] | None = None

    @property
    def target(self) -> Speeds:
        """The speeds that the wheels are to have, rev/s."""
        return self._target

    @property
    def may_move(self) -> bool:
        """Whether the robot was last told to move, or did not confirm that it stands."""
        return self.wheels in (WheelState.MOVING, WheelState.STOPPING)

    @property
    def is_latched(self) -> bool:
        """Whether stop was pressed; the stick must be released before it moves the robot again."""
        return self.state is LockState.LATCHED

    @property
    def is_driven_by_hand(self) -> bool:
        """Whether a person drives right now; a page stays the driver for some seconds after its person let go."""
        return bool(self.driver) and (self._target != STANDING or self.may_move)

    def take(self, page: str, *, by_force: bool = False) -> bool:
        """Let *page* drive if no other page does; return whether it drives.

        With *by_force*, which the person at *page* has agreed to, it takes over from another page, whose drive is
        stopped first. From now on *page* has to steer, or to :meth:`beat`, every tenth of a second.
        """
        if self._is_without_robot or (self.driver not in ("", page) and not by_force):
            return False
        if self.driver != page:
            if self.driver:
                self._happen(Event.TAKE_OVER)
            self._happen(Event.TAKE_HELD if page in self._held else Event.TAKE)
            self.driver = page
        self._watch_over()
        return True

    def steer(self, page: str, left: float, right: float) -> bool:
        """Set the wheels, -1..1 of the speed limit; also called to say that nothing has changed.

        *page* drives from now on if no other page does; return whether it drives. An ArgumentError says that a value is
        not a finite number.
        """
        stick = self._wheel("left", left), self._wheel("right", right)
        target = _near_stop(stick[0] * self.limit), _near_stop(stick[1] * self.limit)
        if stick == STANDING:
            self._holding.discard(page)
            self.unlatch(page)
        else:
            self._holding.add(page)
        if not self.take(page):
            return False
        if self.is_latched:
            return True
        if target != STANDING:
            self.on_hand("steer")
        self._target, self._is_due = target, target != self._sent
        self._begin()
        return True

    def unlatch(self, page: str) -> None:
        """Let *page* move the robot again after a stop: its stick was released, or its program asks to drive."""
        self._held.discard(page)
        if page == self.driver:
            self._happen(Event.STICK_RELEASED)

    def note_command(self, page: str) -> bool:
        """Note that *page* moves the robot otherwise than by the stick; return whether it may: no other page drives.

        It drives now, and has to :meth:`beat`. An empty *page* stands for one that will not, so that the robot stops
        soon.
        """
        if self._is_without_robot or self.driver not in ("", page):
            return False
        self.on_hand("steer")
        if page:
            self.take(page)
        self._target, self._is_due = STANDING, False
        self.note_move()
        self._watch_over()
        return True

    def limit_to(self, share: float) -> None:
        """Set the highest speed of a wheel, 0..1 of what the robot can do; an ArgumentError refuses any other."""
        self.limit = Number(0, 1).require(share, "the speed limit")

    def beat(self, page: str) -> bool:
        """Note that *page* is still there; return whether it drives."""
        is_driver = bool(page) and page == self.driver
        if is_driver:
            self._watch_over()
        return is_driver

    def leave(self, page: str) -> None:
        """Note that *page* is gone or hidden, or no longer drives: if it drove, the robot stops now."""
        self._holding.discard(page)
        if page == self.driver:
            self._happen(Event.LEAVE)

    def release(self) -> None:
        """Let no page be the driver any more: its person has let go, and a program drives now."""
        self._is_due = False
        self._happen(Event.RELEASE)

    def stop(self, page: str = "") -> None:
        """Stop the robot and the program that drives it; every page may. A held stick must be released first.

        *page* is a program that stops the robot, and may move it again at once if it drives it; it is empty for a
        person.
        """
        self.stop_count += 1
        self.on_hand("stop")
        if page and page == self.driver:
            self._happen(Event.HALT)
        else:
            self._held |= self._holding
            self._happen(Event.STOP)

    def halt(self) -> None:
        """Stop the wheels, past all commands that wait; the stop is repeated until the robot confirms it."""
        self._happen(Event.HALT)

    def invalidate(self) -> None:
        """Note that the robot restarted or took commands from others: what its wheels do is not known."""
        self._sent = None

    def note_move(self) -> None:
        """Note that a program turns the wheels, before its command is sent."""
        self._sent = None
        self._happen(Event.MOVE)

    def note_rest(self, move_count: int) -> None:
        """Note that the robot has confirmed speeds of 0 to a program.

        They say nothing if it has moved since they were sent, when :attr:`move_count` was *move_count*.
        """
        if move_count == self.move_count:
            self._sent = None
            self._happen(Event.REST)

    def attach(self, fastest: float) -> None:
        """Note that there is a robot, and that it stands; *fastest* is the highest speed of its wheels, rev/s."""
        self.fastest, self.trouble, self._sent = fastest, "", STANDING
        self._happen(Event.ATTACH)

    def detach(self) -> None:
        """Note that the robot cannot be reached: no page drives, nothing is sent, and what it does is not known."""
        self._happen(Event.DETACH)

    async def wait_until_stopped(self) -> None:
        """Wait until every stop has been confirmed."""
        while self._stopping is not None:
            await asyncio.wait([self._stopping])

    async def close(self) -> None:
        """End all driving; nothing more is sent."""
        self._happen(Event.CLOSE)
        await end_tasks(self._sending, self._stopping)

    # -- how --

    @property
    def _is_without_robot(self) -> bool:
        return self.state in (LockState.DETACHED, LockState.CLOSED)

    @property
    def _must_stop(self) -> bool:
        return self.wheels in (WheelState.CHECKING, WheelState.STOPPING)

    def _happen(self, event: Event) -> None:
        """Change the states as the tables say, and do what follows from that."""
        if event in STOPS and self._is_without_robot:
            return
        self.state = LOCK_STATES[self.state].get(event, self.state)
        self.wheels = WHEEL_STATES[self.wheels].get(event, self.wheels)
        self.move_count += event is Event.MOVE
        if self.state not in (LockState.DRIVEN, LockState.LATCHED):
            self.driver = ""
        if event in _END or event in STOPS:
            self._watch_over(is_driven=bool(self.driver))
        if event in STOPS or self._is_without_robot:
            self._target, self._is_due = STANDING, False
            self._stops += 1
            if self._must_stop:
                self._sent = None
        self._begin()

    def _wheel(self, name: str, value: float) -> float:
        """Return the speed that a stick asks for without the speed limit, rev/s."""
        return _near_stop(max(-1.0, min(1.0, Number().require(value, name))) * self.fastest)

    def _watch_over(self, *, is_driven: bool = True) -> None:
        """Wait for the next sign of the page that drives, or for none."""
        if self._silence is not None:
            self._silence.cancel()
        self._silence = self._loop.call_later(DEAD_MAN, self._happen, Event.SILENCE) if is_driven else None

    def _begin(self) -> None:
        """Send what is to be sent."""
        # A stop waits for nothing, not even for the speeds that are under way: the session sends it next.
        if self._must_stop and self._stopping is None:
            self._stopping = self._loop.create_task(self._halt(), name="elib drive stops")
        elif self._is_due and not self._must_stop and self._sending is None:
            self._sending = self._loop.create_task(self._send(), name="elib drive drives")

    async def _halt(self) -> None:
        """Stop the robot until it has confirmed it."""
        try:
            while self._must_stop:
                stops, moves = self._stops, self.move_count
                try:
                    await self._stop()
                except ElibError as error:
                    if self._must_stop:  # otherwise the robot is gone, or is another one
                        self.trouble = error.message
                    await asyncio.sleep(AGAIN)
                else:
                    # Somebody else may have driven between two stops, so each stop is sent.
                    if stops == self._stops:
                        self.trouble = ""
                        if moves == self.move_count:
                            self._sent = STANDING
                            self._is_due = self._target != STANDING
                        self._happen(Event.STOPPED if moves == self.move_count else Event.OVERTAKEN)
        finally:
            self._stopping = None
        self._begin()

    async def _send(self) -> None:
        """Send the newest speeds until the robot has confirmed them."""
        try:
            while self._is_due and not self._must_stop:
                target = self._sent = self._target
                self._is_due = False
                if target != STANDING:
                    self._happen(Event.MOVE)
                orders = self._stops, self.move_count
                try:
                    await self._drive(*target)
                except ElibError as error:
                    if orders == (self._stops, self.move_count):
                        self._sent, self._is_due, self.trouble = None, True, error.message
                        if self._target == STANDING:
                            self._happen(Event.NO_REST)
                    await asyncio.sleep(AGAIN)
                else:
                    # A stop replaces speeds that were not sent yet, and their call ends as if it were done.
                    if orders == (self._stops, self.move_count):
                        self.trouble = ""
                        if target == STANDING:
                            self._happen(Event.REST)
        finally:
            self._sending = None


def _near_stop(speed: float) -> float:
    return 0.0 if abs(speed) < NEAR_STOP else speed
