"""The host's side of Tiny Bootloader's protocol, without input and output: bytes and times in, bytes and times out.

The bootloader counts bytes. After a byte too many or too few it takes the end of one packet for the start of the next,
and a packet that is sent again in this state has a correct check sum and the wrong address. So a session goes on only
while each packet is answered by K at once. After anything else the host keeps quiet until the bootloader has given up,
calls it again, and goes on one row before the one that failed. The first packet of each session is always the same, and
shows that both sides count alike: ``PARKING`` cannot be correct if bytes of the call stand before it.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

from elib.tools.flash.image import BOOTLOADER, EMPTY, START_AT, VECTORS, Row, jump

CALL = b"\xc1"
READY = b"qK"
WRITTEN, REFUSED = b"K", b"N"
DATA = 0x60
"""The fourth byte of a row's packet; the bootloader only tests for FF (wire-protocol.md, 6.2)."""
END = b"\x95\x00\x00\xff"
"""The last packet: LED 6 lights for 2.0 s, then the program starts."""
END_LIGHT = 2.0

CALL_INTERVAL = 0.1
"""s between two calls, of the 50 to 100 ms that the hosts use: a call that comes behind the answer is taken for the
first byte of a packet, so a slow link needs long ones."""
MAX_CALL_INTERVAL = 0.5
"""s. The bootloader listens for 1.09 s."""
CALL_LIMIT = 30.0
ANSWER_LIMIT = 1.0
QUIET = 1.5
"""s of silence after which the bootloader has given up, which takes 1.09 s, with the delay of the link."""
CALLING_TIME = 3.0
"""s of calls between two silences, once rows were written: the robot may still wait for the end of a packet, and then
takes the calls for it."""
SETTLING = 0.1
"""s without a byte behind the last answer."""
MAX_FAILURES, MAX_IN_ALL = 5, 100
"""Failures in a row at the same place, and in a whole upload: more of them are no accident."""


def packet(address: int, row: bytes) -> bytes:
    """Return the packet that writes a row."""
    data = bytes((address & 0xFF, address >> 8 & 0xFF, address >> 16, DATA)) + row
    return data + bytes((-sum(data) & 0xFF,))


PARKING = packet(VECTORS, (EMPTY[: (START_AT - VECTORS) // 2 * 3] + jump(BOOTLOADER)).ljust(len(EMPTY), b"\xff"))
"""The first packet of a session: while the program is not whole, the bootloader leaves to itself, so that the robot
neither starts half a program nor needs its reset button for the next upload."""


class Phase(Enum):
    """The phases of an upload."""

    CALLING = "calling"
    PARKING = "parking"
    WRITING = "writing"
    SETTLING = "settling"
    DONE = "done"
    FAILED = "failed"


class Upload:
    """An upload: call :meth:`send` when :attr:`due` has come, and :meth:`receive` with what arrives.

    Attributes:
        has_begun: Whether a packet was sent, so that the robot may have lost its program.
        is_parked: Whether the robot is sure to wait in its bootloader for the next upload.
    """

    def __init__(self, rows: Sequence[Row], time: float) -> None:
        self.phase = Phase.CALLING  # how far it is
        self.due = time  # when send has something to do next, s
        self.written = 0  # how many rows the robot has written and acknowledged
        self.has_begun = self.is_parked = False
        # what went wrong, in order; five at the same place in a row, or 100 in all, end it
        self.failures: list[str] = []
        self._packets = [packet(*row) for row in rows]
        self._place = 0
        self._failed_at = -1
        self._in_a_row = 0
        self._received = b""
        self._next: bytes | None = None
        self._interval = CALL_INTERVAL
        self._calls_until = self._limit = time + CALL_LIMIT

    def call_again(self, time: float) -> None:
        """Call for another 30 s, after the robot was reset."""
        self.phase = Phase.CALLING
        self.due = time
        self._calls_until = self._limit = time + CALL_LIMIT
        self._received = b""

    def send(self, time: float) -> bytes:
        """Return the bytes to send at *time*, s, often none."""
        if self._next is not None:
            data, self._next = self._next, None
            self.has_begun = self.has_begun or data == PARKING
            if data is self._packets[-1]:  # if its answer is lost, the robot may run the new program
                self.is_parked = False
            self.due = time + ANSWER_LIMIT
            return data
        if time < self.due:
            return b""
        match self.phase:
            case Phase.CALLING if time >= self._limit:
                self.failures.append(f"no bootloader answered for {CALL_LIMIT:g} s")
                self.phase = Phase.FAILED
            case Phase.CALLING if time >= self._calls_until:
                self.due = time + QUIET
                self._calls_until = self.due + CALLING_TIME
            case Phase.CALLING:
                self.due = time + self._interval
                return CALL
            case Phase.PARKING | Phase.WRITING:
                self._fail(f"no answer within {ANSWER_LIMIT:g} s", time)
            case Phase.SETTLING:
                self.phase = Phase.DONE
                return END
            case _:
                pass
        return b""

    def receive(self, data: bytes, time: float) -> None:
        """Take what arrived at *time*, s."""
        match self.phase:
            case Phase.CALLING:
                # Bytes from before may come first, and the pair in two pieces.
                self._received = self._received[-1:] + data
                if READY in self._received:
                    self.phase = Phase.PARKING
                    self._send(PARKING, time)
            case Phase.PARKING if data == WRITTEN:
                self.is_parked = True
                self.phase = Phase.WRITING
                self._send(self._packets[self._place], time)
            case Phase.WRITING if data == WRITTEN:
                self._place += 1
                self.written = max(self.written, self._place)
                if self._place < len(self._packets):
                    self._send(self._packets[self._place], time)
                else:
                    self.phase = Phase.SETTLING
                    self.due = time + SETTLING
            case Phase.PARKING | Phase.WRITING | Phase.SETTLING:
                refused = data == REFUSED
                self.is_parked = self.is_parked or (refused and self.phase is Phase.WRITING)
                self._fail("the check sum was wrong (N)" if refused else f"it answered {data[:20]!r}", time)
            case _:
                pass

    def _send(self, data: bytes, time: float) -> None:
        self._next = data
        self.due = time

    def _fail(self, what: str, time: float) -> None:
        """Keep quiet until the bootloader has given up, and call it again."""
        where = -1 if self.phase is Phase.PARKING else self._place
        at = "the first packet" if where < 0 else f"row {min(where + 1, len(self._packets))}"
        self.failures.append(f"{at}: {what}")
        self._in_a_row = self._in_a_row + 1 if where == self._failed_at else 1
        self._failed_at = where
        if self._in_a_row >= MAX_FAILURES or len(self.failures) >= MAX_IN_ALL:
            self.phase = Phase.FAILED
            return
        if where < 0:
            self._interval = min(2 * self._interval, MAX_CALL_INTERVAL)
        self._place = max(0, self._place - 1)
        self.phase = Phase.CALLING
        self._received = b""
        self._next = None
        self.due = time + QUIET
        self._calls_until = self.due + CALLING_TIME
        self._limit = self.due + CALL_LIMIT
