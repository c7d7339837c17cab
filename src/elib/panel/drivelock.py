"""Who drives a robot, and the dead man's switch: a robot that no one drives stands still.

A page that drives says so at least every tenth of a second, also while the hand does not move. When the page falls
silent for any reason (it is closed or hidden, its network is gone, its browser is busy), the robot is told to stop.

A stop is meant: a stick that is held while somebody presses stop moves nothing until it has been released once.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from elib.base.errors import ElibError
from elib.base.rules import Number

DEAD_MAN = 0.3
"""s of silence of the page that drives after which the stop is sent: with a round trip it stands within 0.5 s."""
AGAIN = 0.2
"""s until a stop that was not confirmed is sent again."""
NEAR_STOP = 0.005
"""rev/s. A lower speed counts as zero: 0.001 rev/s, one step a second, is the slowest speed of a wheel."""

Speeds = tuple[float, float]
STANDING: Speeds = (0.0, 0.0)


class DriveLock:
    """Steers one robot for one page at a time, on the running event loop.

    Args:
        drive: Sets the wheels, rev/s.
        stop: Stops the robot, past all that waits.

    Attributes:
        driver: The page that drives; empty while no page does.
        limit: Highest speed of a wheel, as a share of what the robot can do, 0..1.
        fastest: Highest speed of a wheel of this robot, rev/s.
        may_move: Whether the robot was last told to move, or did not confirm that it stands.
        trouble: Why the last command was not confirmed; empty if it was.
        halts: How often stop was pressed.
        is_latched: Whether stop was pressed; the stick must be released before it moves the robot again.
        on_hand: Called with ``steer`` when a person moves the stick, and with ``stop`` when a person stops the robot: a
            program that drives the robot then has to pause, or to end.
    """

    def __init__(
        self, drive: Callable[[float, float], Awaitable[object]], stop: Callable[[], Awaitable[object]]
    ) -> None:
        self.driver = ""
        self.limit = 0.5
        self.fastest = 1.0
        self.may_move = False
        self.trouble = ""
        self.halts = 0
        self.is_latched = False
        self.on_hand: Callable[[str], object] = lambda _: None
        self._drive, self._stop = drive, stop
        self._loop = asyncio.get_running_loop()
        self._target: Speeds = STANDING
        self._told: Speeds | None = STANDING
        self._must_stop = False
        self._stops = 0
        self._is_unreachable = False
        self._silence: asyncio.TimerHandle | None = None
        self._sending: asyncio.Task[None] | None = None
        self._stopping: asyncio.Task[None] | None = None
        self._is_closed = False

    @property
    def target(self) -> Speeds:
        """The speeds that the wheels are to have, rev/s."""
        return self._target

    @property
    def has_hand(self) -> bool:
        """Whether a person drives right now; a page stays the driver for some seconds after its person let go."""
        return bool(self.driver) and (self._target != STANDING or self.may_move)

    def take(self, page: str, *, by_force: bool = False) -> bool:
        """Let *page* drive if no other page does, or take over from the other page, whose drive is stopped first.

        From now on *page* has to steer, or to :meth:`beat`, every tenth of a second.

        Args:
            page: Name of the page.
            by_force: Whether to take over; the person at *page* was asked and wants to.

        Returns:
            Whether *page* drives.
        """
        if self.driver and self.driver != page:
            if not by_force:
                return False
            self.still()
        if self.driver != page:
            self.driver, self.is_latched = page, False
        self._rearm()
        return True

    def steer(self, page: str, left: float, right: float) -> bool:
        """Set the wheels, as shares of the speed limit; also called to say that nothing has changed.

        Args:
            page: Name of the page; it drives from now on if no other page does.
            left: -1..1.
            right: -1..1.

        Returns:
            Whether *page* drives.

        Raises:
            ArgumentError: A value is not a finite number.
        """
        speeds = (self._wheel("left", left), self._wheel("right", right))
        if self._is_closed or self._is_unreachable or not self.take(page):
            return False
        if speeds == STANDING:
            self.is_latched = False
        elif self.is_latched:
            return True
        else:
            self.on_hand("steer")
        self._aim(speeds)
        return True

    def watch_over(self, page: str) -> bool:
        """Note that *page* moves the robot otherwise than by the stick: the page drives now, and has to :meth:`beat`.

        Args:
            page: Name of the page; empty for a page that will not beat, so that the robot stops soon.

        Returns:
            Whether the page may do so: no other page drives.
        """
        if self._is_closed or self._is_unreachable or self.driver not in ("", page):
            return False
        self.on_hand("steer")
        if page:
            self.take(page)
        self._target, self._told = STANDING, None
        self.may_move = True
        self._rearm()
        return True

    def limit_to(self, share: float) -> None:
        """Set the highest speed of a wheel, as a share of what the robot can do.

        Raises:
            ArgumentError: The share is not a number from 0 to 1.
        """
        self.limit = Number(0, 1).require(share, "the speed limit")

    def beat(self, page: str) -> bool:
        """Note that *page* is still there; return whether it drives."""
        if page != self.driver or self._is_closed:
            return False
        self._rearm()
        return True

    def leave(self, page: str) -> None:
        """Note that *page* is gone or hidden, or no longer drives: if it drove, the robot stops now."""
        if page == self.driver:
            self.driver, self.is_latched = "", False
            self.still()

    def relieve(self) -> None:
        """Let no page be the driver any more: its person has let go, and a program drives now."""
        self._disarm()
        self.driver, self.is_latched = "", False

    def stop(self) -> None:
        """Stop the robot and the program that drives it; every page may. A held stick must be released first."""
        self.halts += 1
        self.is_latched = bool(self.driver)
        self.on_hand("stop")
        self.still()

    def still(self) -> None:
        """Stop the wheels, past all commands that wait; the stop is repeated until the robot confirms it."""
        if self.driver:
            self._rearm()
        else:
            self._disarm()
        self._target = STANDING
        self._stops += 1
        self._told = None
        if not self._is_unreachable:
            self._must_stop = True
            self._begin()

    def forget(self) -> None:
        """Note that the robot restarted or took commands from others: what its wheels do is not known."""
        self._told = None

    def driven(self, *, is_moving: bool) -> None:
        """Note that a program has set the wheels."""
        self._told = None
        self.may_move = is_moving

    def attach(self, fastest: float) -> None:
        """Note that there is a robot, and that it stands.

        Args:
            fastest: Highest speed of its wheels, rev/s.
        """
        self.fastest = fastest
        self._is_unreachable, self._must_stop = False, False
        self._target = self._told = STANDING
        self.may_move, self.trouble = False, ""

    def detach(self) -> None:
        """Note that the robot cannot be reached: no page drives, nothing is sent, and what it does is not known."""
        self._is_unreachable, self._must_stop = True, False
        self._disarm()
        self.driver, self.is_latched = "", False
        self._target = self._told = STANDING
        self._stops += 1

    async def settle(self) -> None:
        """Wait until every stop has been confirmed."""
        while self._stopping is not None:
            await asyncio.wait([self._stopping])

    async def close(self) -> None:
        """End all driving; nothing more is sent."""
        self._is_closed = True
        self._disarm()
        tasks = [task for task in (self._sending, self._stopping) if task is not None]
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks)

    # -- how --

    def _wheel(self, name: str, value: float) -> float:
        share = max(-1.0, min(1.0, Number().require(value, name))) * max(0.0, min(1.0, self.limit))
        speed = share * self.fastest
        return 0.0 if abs(speed) < NEAR_STOP else speed

    def _aim(self, target: Speeds) -> None:
        self._target = target
        if self._target != self._told:
            self._begin()

    def _rearm(self) -> None:
        self._disarm()
        self._silence = self._loop.call_later(DEAD_MAN, self._on_silence)

    def _disarm(self) -> None:
        if self._silence is not None:
            self._silence.cancel()
            self._silence = None

    def _on_silence(self) -> None:
        self._silence = None
        self.driver, self.is_latched = "", False
        if self._target != STANDING or self.may_move:
            self.still()

    def _begin(self) -> None:
        if self._is_closed or self._is_unreachable:
            return
        # A stop waits for nothing, not even for the speeds that are under way: the session sends it next.
        if self._must_stop and self._stopping is None:
            self._stopping = self._loop.create_task(self._halt(), name="elib drive stops")
        elif not self._must_stop and self._sending is None:
            self._sending = self._loop.create_task(self._send(), name="elib drive drives")

    async def _halt(self) -> None:
        """Stop the robot until it has confirmed it."""
        try:
            while self._must_stop:
                stops = self._stops
                try:
                    await self._stop()
                except ElibError as error:
                    self._fail(error)
                    await asyncio.sleep(AGAIN)
                else:
                    # Somebody else may have driven between two stops, so each stop is sent.
                    if stops == self._stops:
                        self._must_stop = False
                        self._confirm(STANDING)
        finally:
            self._stopping = None
        if self._target != self._told:
            self._begin()

    async def _send(self) -> None:
        """Send the newest speeds until the robot has confirmed them."""
        try:
            while not self._must_stop and not self._is_unreachable and self._told != self._target:
                target, stops = self._target, self._stops
                self.may_move |= target != STANDING
                try:
                    await self._drive(*target)
                except ElibError as error:
                    self._fail(error)
                    await asyncio.sleep(AGAIN)
                else:
                    # A stop replaces speeds that were not sent yet, and their call ends as if it were done.
                    if stops == self._stops:
                        self._confirm(target)
        finally:
            self._sending = None

    def _confirm(self, target: Speeds) -> None:
        self._told = target
        self.may_move = target != STANDING
        self.trouble = ""

    def _fail(self, error: ElibError) -> None:
        if self._is_unreachable:
            return
        self._told = None
        self.trouble = error.message
        if self._target == STANDING and not self._must_stop:
            self._must_stop = True
            self._begin()
