"""Who drives, and that nobody driving means standing still: the dead man's switch.

A page that drives says so at least every tenth of a second, also while the hand is still. When it falls silent, for
whatever reason (closed, hidden, its network gone, its browser busy), the robot is told to stop.
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
        captain: Who drives, or an empty string.
    """

    drives: bool
    captain: str


class Helm:
    """Steers one robot for one page at a time, on the running event loop.

    Args:
        drive: Sets the wheels, rev/s.
        stop: Stops the robot, past all that waits.

    Attributes:
        captain: The page that drives; empty while nobody does.
        limit: Fastest wheel, as a share of what the robot can do, 0..1.
        fastest: What a wheel of this robot can do, rev/s.
        may_move: The robot was last told to move, or did not confirm that it stands.
        trouble: Why the last command was not confirmed; empty if it was.
        on_change: Called when any of this has changed.
    """

    def __init__(
        self, drive: Callable[[float, float], Awaitable[object]], stop: Callable[[], Awaitable[object]]
    ) -> None:
        self.captain = ""
        self.limit = 0.5
        self.fastest = 1.0
        self.may_move = False
        self.trouble = ""
        self.on_change: Callable[[], object] = lambda: None
        self._drive, self._stop = drive, stop
        self._loop = asyncio.get_running_loop()
        self._target: Speeds = STANDING
        self._told: Speeds | None = STANDING
        self._must_stop = False
        self._silence: asyncio.TimerHandle | None = None
        self._sending: asyncio.Task[None] | None = None
        self._stopping: asyncio.Task[None] | None = None
        self._is_closed = False

    @property
    def target(self) -> Speeds:
        """What the wheels are to do, rev/s."""
        return self._target

    def take(self, page: str, *, by_force: bool = False) -> Answer:
        """Let *page* drive, if nobody else does, or in any case: whoever drove until now is stopped.

        Args:
            page: Its name.
            by_force: The person there was asked and wants it.
        """
        if self.captain and self.captain != page:
            if not by_force:
                return Answer(drives=False, captain=self.captain)
            self.stop()
        if self.captain != page:
            self.captain = page
            self.on_change()
        return Answer(drives=True, captain=page)

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
        speeds = tuple(self._wheel(name, value) for name, value in (("left", left), ("right", right)))
        if self._is_closed or not self.take(page).drives:
            return False
        self._rearm()
        self._aim((speeds[0], speeds[1]))
        return True

    def beat(self, page: str) -> bool:
        """Note that *page* is there; return whether it drives."""
        if page != self.captain or self._is_closed:
            return False
        self._rearm()
        return True

    def leave(self, page: str) -> None:
        """Note that *page* is gone, hidden or drives no more: if it drove, the robot stops now."""
        if page == self.captain:
            self.captain = ""
            self.stop()
            self.on_change()

    def stop(self) -> None:
        """Stop the robot, past all that waits; it is repeated until it is confirmed. Anybody may."""
        self._disarm()
        self._target = STANDING
        self._must_stop = True
        self._told = None
        self._begin()

    def forget(self) -> None:
        """Note that the robot is another, or restarted: what it was told is not known."""
        self._told = None

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

    def _wheel(self, name: str, value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise ArgumentError(f"{name} is {value!r}; it must be a number from -1 to 1")
        share = max(-1.0, min(1.0, float(value))) * max(0.0, min(1.0, self.limit))
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
        self.captain = ""
        if self._target != STANDING or self.may_move:
            self.stop()
        self.on_change()

    def _begin(self) -> None:
        if self._is_closed:
            return
        # A stop waits for nothing, not even for the drive that is under way: the session sends it next.
        if self._must_stop and self._stopping is None:
            self._stopping = self._loop.create_task(self._halt(), name="elib helm stops")
        elif not self._must_stop and self._sending is None:
            self._sending = self._loop.create_task(self._send(), name="elib helm drives")

    async def _halt(self) -> None:
        """Stop the robot until it has confirmed it."""
        try:
            while self._must_stop:
                try:
                    await self._stop()
                except ElibError as error:
                    self._fail(error)
                    await asyncio.sleep(AGAIN)
                else:
                    self._must_stop = False
                    self._confirm(STANDING)
        finally:
            self._stopping = None
        if self._target != self._told:
            self._begin()

    async def _send(self) -> None:
        """Tell the robot what it is to do until it has confirmed the newest."""
        try:
            while not self._must_stop and self._told != self._target:
                target = self._target
                self.may_move |= target != STANDING
                try:
                    await self._drive(*target)
                except ElibError as error:
                    self._fail(error)
                    await asyncio.sleep(AGAIN)
                else:
                    self._confirm(target)
        finally:
            self._sending = None

    def _confirm(self, target: Speeds) -> None:
        self._told = target
        self.may_move = target != STANDING
        self.trouble = ""
        self.on_change()

    def _fail(self, error: ElibError) -> None:
        self._told = None
        self.trouble = error.message
        if self._target == STANDING and not self._must_stop:
            self._must_stop = True
            self._begin()
        self.on_change()


__all__ = ["DEAD_MAN", "Answer", "Helm", "Speeds"]
