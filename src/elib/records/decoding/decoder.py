"""The decoder: bytes between a program and a robot in, lines with their meaning out. No I/O, no clock.

Requests are cut out by the robot's own state machine; answers are matched with them by the shapes of the command table.
In a capture of the robot's half alone nothing tells what its bytes answer; they are cut into lines without a meaning.
"""

from __future__ import annotations

from elib.link.protocol.context import Context
from elib.link.protocol.profiles import ASERCOM_1_2_2, PROFILES, profile_named, recognise
from elib.records.decoding.answers import AnswerReader
from elib.records.decoding.lines import Direction, Line
from elib.records.decoding.requests import RequestReader

ASSUMED = ASERCOM_1_2_2.name
"""The firmware if neither the caller nor the capture names one: the one that ``sim://`` runs by default."""


class Decoder:
    """Turns bytes into lines. Every byte comes out in one line, in order within its direction.

    The lines are the same however the bytes are cut into pieces, if :meth:`flush` is called at their end alone.

    Args:
        firmware: The name of the robot's firmware; None to find it in what the robot says.
        assumed: The firmware to assume until the robot says it; None for :data:`ASSUMED`.
    """

    def __init__(self, firmware: str | None = None, *, assumed: str | None = None) -> None:
        self._context = Context(profile_named(firmware or assumed or ASSUMED), origin="replay")
        self._answers = AnswerReader(self._context, lambda: self._requests.restarted(), self._learned)
        self._requests = RequestReader(self._context, self._answers.expect)
        # how the firmware is known: `as told`, `assumed`, `by its version` or `by its greeting`
        self.source = "as told" if firmware is not None else "assumed" if assumed is None else "by its version"

    @property
    def firmware(self) -> str:
        """The firmware by whose rules bytes are decoded now."""
        return self._context.profile.name

    @property
    def lacks_requests(self) -> bool:
        """Whether only the robot's bytes have come: nothing tells what they answer."""
        return self._answers.hears_robot and not self._answers.hears_host

    @property
    def unanswered(self) -> list[str]:
        """The requests that still wait for an answer; none without the robot's half."""
        return [each.request for each in self._answers.expected if self._answers.hears_robot and not each.may_lack]

    def feed(self, direction: Direction, time: float | None, data: bytes) -> list[Line]:
        """Take bytes, and return the lines they complete.

        Args:
            direction: The direction of the bytes.
            time: When they came, s on any clock; None if that is not known.
            data: The bytes, in the order they had on the wire among those of both directions.
        """
        if not data:
            return []
        if direction == "to robot":
            lines = self._answers.close()
            self._answers.hears_host = True
            return lines + self._requests.feed(data, time)
        return self._requests.close() + self._answers.feed(data, time)

    def flush(self) -> list[Line]:
        """Return lines for what is not complete: the capture ends, or the line pauses."""
        return self._requests.flush() + self._answers.flush()

    def _learned(self, version: str) -> str:
        """Note the firmware that the robot names; return what is wrong with that."""
        says_selector = (profile for profile in PROFILES.values() if profile.says_selector)
        found = recognise(version) if version else next(says_selector)
        if self.source == "as told":
            is_other = found is not self._context.profile
            return f"a robot with {found.name} says so; it is decoded as {self.firmware}" if is_other else ""
        if version or self.source == "assumed":
            self.source = "by its version" if version else "by its greeting"
            if found is not self._context.profile:
                self._context.profile = found
                self._context.requests.clear()
                self._requests.restarted(found)
        return ""
