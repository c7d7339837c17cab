"""Who drives, and that nobody driving means standing still: the dead man's switch.

A page that drives says so at least every tenth of a second, also while the hand is still. When it falls silent, for
whatever reason (closed, hidden, its network gone, its browser busy), the robot is told to stop.

Who presses stop means it: a stick that is still held moves nothing until it was let go once.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from elib.errors import ArgumentError, ElibError

DEAD_MAN = 0.3
"""s of silence of the page that drives after which the stop is sent: with a round trip it stands within 0.5 s."""
AGAIN = 0.2
"""s until a stop that was not confirmed is sent again."""
NEAR_STOP = 0.005
"""rev/s. Less is meant as nothing: the slowest wheel makes a step a second."""

Speeds = tuple[float, float]
STANDING: Speeds = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Answer:
    """What a page that wants to drive is told.

    Attributes:
        drives: It does.
        driver: Who drives, or an empty string.
    """

    drives: bool
    driver: str


class DriveLock:
    """Steers one robot for one page at a time, on the running event loop.

    Args:
        drive: Sets the wheels, rev/s.
        stop: Stops the robot, past all that waits.

    Attributes:
        driver: The page that drives; empty while nobody does.
        limit: Fastest wheel, as a share of what the robot can do, 0..1.
        fastest: What a wheel of this robot can do, rev/s.
        may_move: The robot was last told to move, or did not confirm that it stands.
        trouble: Why the last command was not confirmed; empty if it was.
        is_latched: Stop was pressed; the stick must be let go before it moves anything again.
        on_change: Called when any of this has changed.
        on_hand: Called with ``steer`` when a hand turns the stick, and with ``stop`` when somebody stops the robot: a
            program that drives it has to give way, or to end.
    """

    def __init__(
        self, drive: Callable[[float, float], Awaitable[object]], stop: Callable[[], Awaitable[object]]
    ) -> None:
        self.driver = ""
        self.limit = 0.5
        self.fastest = 1.0
        self.may_move = False
        self.trouble = ""
        self.is_latched = False
        self.on_change: Callable[[], object] = lambda: None
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
        """What the wheels are to do, rev/s."""
        return self._target

    @property
    def has_hand(self) -> bool:
        """Whether a person drives right now; a page that let go is the driver for some seconds more."""
        return bool(self.driver) and (self._target != STANDING or self.may_move)

    def take(self, page: str, *, by_force: bool = False) -> Answer:
        """Let *page* drive, if nobody else does, or in any case: whoever drove until now is stopped.

        From now on it has to steer, or to :meth:`beat`, every tenth of a second.

        Args:
            page: Its name.
            by_force: The person there was asked and wants it.
        """
        if self.driver and self.driver != page:
            if not by_force:
                return Answer(drives=False, driver=self.driver)
            self.still()
        if self.driver != page:
            self.driver, self.is_latched = page, False
            self.on_change()
        self._rearm()
        return Answer(drives=True, driver=page)

    def steer(self, page: str, left: float, right: float) -> bool:
        """Turn the wheels, as shares of the fastest that is allowed; also to say that nothing has changed.

        Args:
            page: Who wants it; it drives from now on if nobody else does.
            left: -1..1.
            right: -1..1.

        Returns:
            Whether it drives.

        Raises:
            ArgumentError: A number is not finite, or none.
        """
        speeds = (self._wheel("left", left), self._wheel("right", right))
        if self._is_closed or self._is_unreachable or not self.take(page).drives:
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
        """Note that *page* sends something that moves the robot, past the stick: it drives now, and has to beat.

        Args:
            page: Its name; empty for one that will not beat, so that the robot stops soon.

        Returns:
            Whether it may: nobody else drives.
        """
        if self._is_closed or self._is_unreachable or self.driver not in ("", page):
            return False
        self.on_hand("steer")
        if page:
            self.take(page)
        self._target, self._told = STANDING, None
        self.may_move = True
        self._rearm()
        self.on_change()
        return True

    def limit_to(self, share: float) -> None:
        """Set the fastest wheel, as a share of what the robot can do.

        Raises:
            ArgumentError: It is no number from 0 to 1.
        """
        if not _is_number(share) or not 0 <= share <= 1:
            raise ArgumentError(f"the speed limit is {share!r}; it must be a number from 0 to 1")
        self.limit = float(share)
        self.on_change()

    def beat(self, page: str) -> bool:
        """Note that *page* is there; return whether it drives."""
        if page != self.driver or self._is_closed:
            return False
        self._rearm()
        return True

    def leave(self, page: str) -> None:
        """Note that *page* is gone, hidden or drives no more: if it drove, the robot stops now."""
        if page == self.driver:
            self.driver, self.is_latched = "", False
            self.still()
            self.on_change()

    def relieve(self) -> None:
        """Let nobody be the driver any more: whoever was has let go, and a program drives now."""
        self._disarm()
        if self.driver:
            self.driver, self.is_latched = "", False
            self.on_change()

    def stop(self) -> None:
        """Stop the robot, and whatever program drives it. Anybody may. A stick that is held has to be let go first."""
        self.is_latched = bool(self.driver)
        self.on_hand("stop")
        self.still()

    def still(self) -> None:
        """Let the wheels stand, past all that waits; it is repeated until it is confirmed."""
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
        """Note that the robot restarted, or was told something by others: what its wheels do is not known."""
        self._told = None

    def driven(self, *, is_moving: bool) -> None:
        """Note that a program has told the wheels something."""
        self._told = None
        if self.may_move != is_moving:
            self.may_move = is_moving
            self.on_change()

    def attach(self, fastest: float) -> None:
        """Note that there is a robot, and that it stands.

        Args:
            fastest: What a wheel of it can do, rev/s.
        """
        self.fastest = fastest
        self._is_unreachable, self._must_stop = False, False
        self._target = self._told = STANDING
        self.may_move, self.trouble = False, ""

    def detach(self) -> None:
        """Note that the robot is out of reach: nobody drives, nothing is sent; what it does nobody knows."""
        self._is_unreachable, self._must_stop = True, False
        self._disarm()
        self.driver, self.is_latched = "", False
        self._target = self._told = STANDING
        self._stops += 1

    async def settle(self) -> None:
        """Wait until no stop is on its way any more."""
        while self._stopping is not None:
            await asyncio.wait([self._stopping])

    async def close(self) -> None:
        """Drive no more."""
        self._is_closed = True
        self._disarm()
        tasks = [task for task in (self._sending, self._stopping) if task is not None]
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks)

    # -- how --

    def _wheel(self, name: str, value: float) -> float:
        if not _is_number(value):
            raise ArgumentError(f"{name} is {value!r}; it must be a number from -1 to 1")
        share = max(-1.0, min(1.0, value)) * max(0.0, min(1.0, self.limit))
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
        self.on_change()

    def _begin(self) -> None:
        if self._is_closed or self._is_unreachable:
            return
        # A stop waits for nothing, not even for the drive that is under way: the session sends it next.
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
                    # Between a stop and the next somebody else may have driven: each is sent.
                    if stops == self._stops:
                        self._must_stop = False
                        self._confirm(STANDING)
        finally:
            self._stopping = None
        if self._target != self._told:
            self._begin()

    async def _send(self) -> None:
        """Tell the robot what it is to do until it has confirmed the newest."""
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
                    # A stop takes the place of a drive that was not sent yet, and the drive ends as if it were done.
                    if stops == self._stops:
                        self._confirm(target)
        finally:
            self._sending = None

    def _confirm(self, target: Speeds) -> None:
        self._told = target
        self.may_move = target != STANDING
        self.trouble = ""
        self.on_change()

    def _fail(self, error: ElibError) -> None:
        if self._is_unreachable:
            return
        self._told = None
        self.trouble = error.message
        if self._target == STANDING and not self._must_stop:
            self._must_stop = True
            self._begin()
        self.on_change()


def _is_number(value: object) -> bool:
    """Return whether *value* is a finite number; a page may send anything."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < math.inf


__all__ = ["DEAD_MAN", "Answer", "DriveLock", "Speeds"]
