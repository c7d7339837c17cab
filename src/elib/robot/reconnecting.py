"""``elib.reconnecting(url)``: a robot that reopens its link, for blocking and async programs."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, Literal

from elib.base.errors import ArgumentError, LinkClosed
from elib.base.rules import Choice
from elib.link.protocol.image import Mounting
from elib.link.session import check_timeout
from elib.robot.aio import Epuck
from elib.robot.blocking import BlockingEpuck, connect_robot
from elib.robot.link import LinkSettings
from elib.robot.reconnect import Policy
from elib.robot.substitute import link_to


class Reconnecting:
    """The result of :func:`elib.reconnecting`: ``with`` gives a blocking robot, ``async with`` an async one."""

    def __init__(self, robot: Epuck) -> None:
        self._robot = robot
        self._blocking: BlockingEpuck | None = None

    def __enter__(self) -> BlockingEpuck:
        return self.connect()

    def __exit__(self, *_: object) -> None:
        if self._blocking is not None:
            self._blocking.close()

    async def __aenter__(self) -> Epuck:
        return await self._robot.__aenter__()

    async def __aexit__(self, *_: object) -> None:
        await self._robot.__aexit__()

    def __await__(self) -> Generator[Any, None, Epuck]:
        return self._robot.__await__()

    def connect(self) -> BlockingEpuck:
        """Open the robot for blocking calls; close it yourself.

        Raises:
            LinkError: The robot cannot be opened; the subclass says why.
        """
        if self._blocking is not None:
            raise LinkClosed(f"{self._robot.url} was opened before", hint="call elib.reconnecting() again")
        self._blocking = connect_robot(self._robot)
        return self._blocking


def reconnecting(
    url: str | None = None,
    *,
    during_gap: Literal["wait", "fail"] = "wait",
    keep_speed: bool = False,
    first_delay: float = 0.25,
    longest_delay: float = 4.0,
    give_up_after: float = 60.0,
    name: str | None = None,
    keep_moving: bool = False,
    firmware: str | None = None,
    mounting: Mounting | None = None,
    watchdog: bool | None = None,
) -> Reconnecting:
    """Return a robot that reopens its link when it is lost, and restores what this program had set.

    Camera, lamps and step counters are restored, and the wheels stand still unless *keep_speed* is set. The same is
    done for a robot that restarts unasked, which its greeting shows, or step counters that fell back to about 0.
    ``robot.events`` says what happened.

    A call that was under way when the link broke ends in :class:`~elib.LinkLost`, because whether the robot did
    it is unknown. A call that only reads is sent again, and so is ``stop``. The same holds for a call that was under
    way when the robot restarted; there the error is :class:`~elib.ReplyTimeout`.

    Args:
        url: URL of the robot; without one it is chosen as by :func:`elib.connect`. The first opening is tried only
            once, and its errors are raised.
        during_gap: ``wait``: calls wait for the link within their own deadline. ``fail``: they fail at once.
        keep_speed: Drive on with the last wheel speeds after a gap.
        first_delay: Time before the second attempt to reopen, s; it doubles with each attempt.
        longest_delay: Longest time between two attempts, s.
        give_up_after: Time without a link after which every call ends in LinkLost, s.
        name: A name for logs; the URL unless given.
        keep_moving: Do not stop the wheels when the block ends.
        firmware: Name of the firmware profile to use, whatever the robot answers.
        mounting: How this robot's camera is mounted, if it is not as usual for its firmware.
        watchdog: Let a small process stop the robot when this program dies, or freezes for half a second; unless
            given, only ``elib run`` does.

    Raises:
        ArgumentError: An argument is wrong.

    Example:
        >>> with elib.reconnecting("sim://?speed=max&fault=walks-out-of-range") as robot:
        ...     events = robot.events
        ...     robot.sleep(30)  # the link is gone from 25 to 35 s
        ...     robot.within(20).selector().position
        ...     [type(event).__name__ for event in events.within(0)]
        3
        ['LinkDown', 'LinkBack']
    """
    Choice(("wait", "fail")).require(during_gap, "during_gap")
    for argument, seconds in (("first_delay", first_delay), ("longest_delay", longest_delay)):
        if check_timeout(seconds) == 0:
            raise ArgumentError(f"{argument} is 0 s; it must be longer than that")
    policy = Policy(during_gap, keep_speed, first_delay, longest_delay, check_timeout(give_up_after))
    settings = LinkSettings(
        keep_moving=keep_moving, firmware=firmware, mounting=mounting, policy=policy, watchdog=watchdog
    )
    return Reconnecting(Epuck(link_to(url, name, settings)))
