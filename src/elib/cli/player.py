"""The player of ``elib replay``: its position in a recording, and the keys that move it."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

from elib.base.pose import Pose
from elib.records.timeline import Moment

SLOWEST, FASTEST = 1 / 64, 64.0
"""Slowest and fastest speed, as factors on real time."""
JUMP = 10.0
"""s by which [ and ] jump."""


@dataclass(slots=True)
class PlayedRobot:
    """The robot at the position of the player.

    Attributes:
        state: State of the behaviour; empty without one.
        speed: Wheel speeds that the robot was told, rev/s.
        near: The last infrared reading; empty before the first one.
        pose: Pose of the robot, or None.
    """

    state: str = ""
    speed: tuple[float, float] = (0.0, 0.0)
    near: tuple[float, ...] = ()
    pose: Pose | None = None

    def take(self, moment: Moment) -> None:
        """Take the next moment into account."""
        if moment.kind == "state":
            self.state = moment.text
        if moment.speed is not None:
            self.speed = moment.speed
        self.near = moment.readings.get("proximity", self.near)
        self.pose = moment.pose or self.pose


@dataclass(slots=True)
class Player:
    """A position in a recording that moves with time and keys.

    Attributes:
        moments: The moments of the recording, in order of time.
        length: Duration of the recording, s.
        time: The position, s.
        speed: Speed as a factor on real time.
        is_playing: Whether the position moves with time.
        is_over: Whether the person has ended the player.
    """

    moments: Sequence[Moment]
    length: float
    time: float = 0.0
    speed: float = 1.0
    is_playing: bool = True
    is_over: bool = False
    _next: int = 0
    _is_shown: bool = False
    _robot: tuple[int, PlayedRobot] | None = None
    _typed: str | None = None

    def __post_init__(self) -> None:
        self.jump(self.time)

    @property
    def prompt(self) -> str | None:
        """The text typed after ``g``; None if there is no prompt."""
        return self._typed

    @property
    def robot(self) -> PlayedRobot:
        """The robot at this position."""
        # This is called in every frame, so it continues from the last result.
        place, found = self._robot if self._robot is not None and self._robot[0] <= self._next else (0, PlayedRobot())
        for moment in self.moments[place : self._next]:
            found.take(moment)
        self._robot = self._next, found
        return found

    def advance(self, seconds: float) -> Sequence[Moment]:
        """Let *seconds* of real time pass; return the moments in that time."""
        if not self.is_playing:
            return ()
        self.time = min(self.length, self.time + seconds * self.speed)
        first = self._next
        while self._next < len(self.moments) and self.moments[self._next].time <= self.time:
            self._next += 1
        if self._next == len(self.moments) and self.time >= self.length:
            self.is_playing = False
        self._is_shown |= self._next > first
        return self.moments[first : self._next]

    def step(self, count: int = 1) -> Sequence[Moment]:
        """Go to the next moment, or to the previous one (-1), and return it."""
        self.is_playing = False
        # After a jump, the previous moment was not shown yet, so one step back leads to it.
        place = self._next - 1 + (count if self._is_shown or count > 0 else count + 1)
        if not 0 <= place < len(self.moments):
            return ()
        self._next, self._is_shown = place + 1, True
        self.time = self.moments[place].time
        return self.moments[place : place + 1]

    def jump(self, time: float) -> None:
        """Go to a time, s, inside the recording."""
        self.time = min(max(time, 0.0), self.length)
        self._next = bisect_left(self.moments, self.time, key=lambda moment: moment.time)
        self._is_shown = False

    def press(self, key: str) -> Sequence[Moment]:
        """Handle a key; return the moments to show.

        Args:
            key: A character, or ``left`` ``right`` ``up`` ``down`` ``home`` ``end``.
        """
        if self._typed is not None:
            self._type(key)
            return ()
        match key:
            case " ":
                if not self.is_playing and self.time >= self.length:
                    self.jump(0.0)
                self.is_playing = not self.is_playing
            case "right" | "n" | ".":
                return self.step(1)
            case "left" | "p" | ",":
                return self.step(-1)
            case "]" | "down":
                self.jump(self.time + JUMP)
            case "[" | "up":
                self.jump(self.time - JUMP)
            case "home":
                self.jump(0.0)
            case "end":
                self.jump(self.length)
            case "+" | "=":
                self.speed = min(FASTEST, 2 * self.speed)
            case "-":
                self.speed = max(SLOWEST, self.speed / 2)
            case "g":
                self._typed = ""
            case "q" | "\x03" | "\x04":
                self.is_over = True
        return ()

    def _type(self, key: str) -> None:
        typed = self._typed or ""
        if key in ("\r", "\n"):
            self._typed = None
            try:
                self.jump(float(typed))
            except ValueError:
                return
        elif key in ("\x7f", "\b"):
            self._typed = typed[:-1]
        elif key in ("\x1b", "\x03"):
            self._typed = None
        elif key in "0123456789.":
            self._typed = typed + key


ESCAPES = {
    "\x1b[D": "left",
    "\x1b[C": "right",
    "\x1b[A": "up",
    "\x1b[B": "down",
    "\x1b[H": "home",
    "\x1b[F": "end",
    "\x1b[1~": "home",
    "\x1b[4~": "end",
    "\x1bOD": "left",
    "\x1bOC": "right",
    "\x1b[5~": "[",
    "\x1b[6~": "]",
}
"""Control sequences that terminals send for keys without a character (as xterm does)."""


_KEY = re.compile(r"\x1b[\[O][^A-Za-z~]*[A-Za-z~]?|.", re.DOTALL)


def keys_of(typed: str) -> list[str]:
    """Return the keys in the characters that a terminal sent; unknown sequences are dropped."""
    found: list[str] = _KEY.findall(typed)
    return [ESCAPES.get(key, key) for key in found if key in ESCAPES or len(key) == 1]
