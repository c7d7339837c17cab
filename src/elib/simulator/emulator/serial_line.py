"""The robot's end of the serial line: bytes take time on it, and wait in a small buffer until they are read."""

from __future__ import annotations

import re
from collections import deque
from math import inf

from elib.simulator.emulator.timing import BITS_PER_BYTE

_ENDS = re.compile(rb"[^ -~]")
"""Bytes that may complete a text command, or begin a binary one."""


class ReceiveRing:
    """The e-puck1's ring, which does not notice an overflow.

    More unread bytes than it has slots overwrite the oldest ones, and yet as many bytes as came are delivered: some are
    lost, others come twice.
    """

    def __init__(self, size: int) -> None:
        self.unread = 0  # bytes that came and were not read yet
        self._slots = bytearray(size)
        self._received = 0
        self._read = 0

    def put(self, byte: int) -> None:
        """Store a byte from the line."""
        self._slots[self._received % len(self._slots)] = byte
        self._received += 1
        self.unread += 1

    def get(self) -> int:
        """Return the byte in the next slot. Call it only while some are unread."""
        byte = self._slots[self._read % len(self._slots)]
        self._read += 1
        self.unread -= 1
        return byte


class ReceiveQueue:
    """A queue of *size* bytes: bytes that do not fit are lost."""

    def __init__(self, size: int) -> None:
        self.unread = 0  # bytes that came and were not read yet
        self._size = size
        self._bytes: deque[int] = deque()

    def put(self, byte: int) -> None:
        """Store a byte from the line, if there is room."""
        if self.unread < self._size:
            self._bytes.append(byte)
            self.unread += 1

    def get(self) -> int:
        """Return the oldest byte. Call it only while there is one."""
        self.unread -= 1
        return self._bytes.popleft()


class IncomingLine:
    """Bytes on their way to the robot.

    Args:
        baud: Bits a second; 0 for a line that takes no time.
    """

    next_arrival: float  # when the next byte has arrived, s; infinite while none is on its way
    next_end: float  # when the next byte that may complete a text command has arrived, or the last one of its piece, s
    _free_at: float

    def __init__(self, baud: int) -> None:
        self.byte_time = BITS_PER_BYTE / baud if baud else 0.0
        self._pieces: deque[tuple[float, bytes]] = deque()
        self.clear()

    def put(self, data: bytes, time: float) -> None:
        """Start to send *data* at *time*, s, or when the bytes before it have passed."""
        if not data:
            return
        start = max(time, self._free_at)
        self._free_at = start + len(data) * self.byte_time
        self._pieces.append((start, data))
        if len(self._pieces) == 1:
            self._begin()

    def get(self) -> int:
        """Return the next byte. Call it only while one is on its way."""
        start, data = self._pieces[0]
        byte = data[self._offset]
        self._offset += 1
        if self._offset == len(data):
            self._pieces.popleft()
            self._begin()
        else:
            self.next_arrival = start + (self._offset + 1) * self.byte_time
            if self._offset > self._end:
                self._look_for_end()
        return byte

    def clear(self) -> None:
        """Lose everything that is on its way."""
        self._pieces.clear()
        self._free_at = -inf
        self._begin()

    def _begin(self) -> None:
        """Begin with the first piece."""
        self._offset = 0
        if self._pieces:
            self.next_arrival = self._pieces[0][0] + self.byte_time
            self._look_for_end()
        else:
            self.next_arrival = self.next_end = inf

    def _look_for_end(self) -> None:
        start, data = self._pieces[0]
        found = _ENDS.search(data, self._offset)
        self._end = len(data) - 1 if found is None else found.start()
        self.next_end = start + (self._end + 1) * self.byte_time
