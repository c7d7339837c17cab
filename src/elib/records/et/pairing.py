"""Join each call with its outcome."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Container, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from elib.records.et.rows import Block, text_of

EVENT, COMMAND = -4, -3
"""Columns, counted from the end: in 2011 a space in the robot's name made one column more."""
BACKWARDS = 0.1
"""Times may go backwards by this much, s, within one run: in 2011 several threads wrote the lines."""
MAX_OPEN = 100_000
"""Calls without an outcome at any time; a robot has a handful."""
MAX_ROBOTS = 100_000
"""Robots in one log: a column that does not hold names must not fill the memory."""


class Pair(NamedTuple):
    """A call and its outcome."""

    time: float
    robot: bytes  # the robot's name, with `%20` for each space
    event: bytes  # `ok` or `ko`
    command: bytes  # the command, by the name it has in the log
    latency: float  # time from the call to its outcome, s
    call: int  # which call of the log it is, from 0


@dataclass(slots=True)
class Pairing:
    """Joins calls with their outcomes. An outcome belongs to the oldest call of that robot and command without one."""

    orphans: int = 0  # how many outcomes have no call: the log began, or was begun again, between the two
    _calls: int = 0
    _given_up: Counter[tuple[bytes, bytes]] = field(default_factory=Counter)
    _open: dict[tuple[bytes, bytes], deque[tuple[float, int]]] = field(default_factory=dict)
    _count: int = 0
    _last: dict[bytes, float] = field(default_factory=dict)

    def pairs(self, block: Block) -> Iterator[Pair]:
        """Yield the pairs whose outcome is in *block*."""
        times = block.numbers(0).tolist()
        last, unended = self._last, self._open
        for place, (row, now) in enumerate(zip(block.rows, times, strict=True)):
            if place in block.begins:
                self._give_up(last)
            words = row.split(b" ")
            if len(words) == 6:
                _, robot, event, command, _, _ = words
            elif len(words) > 6:
                robot, event, command = b"%20".join(words[1:EVENT]), words[EVENT], words[COMMAND]
            else:
                raise block.error(place, f"a row of a log has 6 columns; this one has {len(words)}")
            if now < last.get(robot, now) - BACKWARDS:
                self._give_up({robot})
            last[robot] = now
            key = robot, command
            waiting = unended.get(key)
            if event == b"call":
                if waiting is None:
                    waiting = unended[key] = deque()
                waiting.append((now, self._calls))
                self._calls += 1
                self._count += 1
                if self._count > MAX_OPEN:
                    raise block.error(place, f"more than {MAX_OPEN} calls have no ok or ko; this is not a log")
            elif event not in (b"ok", b"ko"):
                raise block.error(place, f"the third column is {text_of(event)!r}; it must be call, ok or ko")
            elif waiting is None:
                self.orphans += 1
            else:
                begun, number = waiting.popleft()
                if not waiting:
                    del unended[key]
                self._count -= 1
                yield Pair(begun, robot, event, command, now - begun if now > begun else 0.0, number)
        if len(block.rows) in block.begins:
            self._give_up(last)
        if len(self._last) > MAX_ROBOTS:
            raise block.error(0, f"up to here there are more than {MAX_ROBOTS} robots; this is not a log")

    @property
    def unanswered(self) -> Counter[tuple[bytes, bytes]]:
        """How many calls have no outcome, by robot and command."""
        return self._given_up + Counter({key: len(waiting) for key, waiting in self._open.items()})

    @property
    def notes(self) -> list[str]:
        """Notes for the user about rows that are not in any pair."""
        unanswered = self.unanswered.total()
        found = []
        if unanswered:
            found.append(f"calls without ok or ko: {unanswered}; the log ended, or was begun again, before they did")
        if self.orphans:
            found.append(f"ok or ko without a call: {self.orphans}; the log began between the two")
        return found

    def _give_up(self, robots: Container[bytes]) -> None:
        """Give up the open calls of robots: a new run was appended to the log, so they will never have an outcome."""
        for key in [key for key in self._open if key[0] in robots]:
            # Only their number is kept, so they do not fill the memory however often the log was begun again.
            count = len(self._open.pop(key))
            self._given_up[key] += count
            self._count -= count
