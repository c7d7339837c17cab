"""The robot's end of the serial line: bytes take time on it, and wait in a small buffer until they are read."""

from __future__ import annotations

from collections import deque
from math import inf

from elib.simulator.emulator.timing import BITS_PER_BYTE


class ReceiveRing:
    """The e-puck1's ring, which does not notice an overflow.

    More unread bytes than it has slots overwrite the oldest ones, and yet as many bytes as came are delivered: some are
    lost, others come twice.
    """

    def __init__(self, size: int) -> None:
        self._slots = bytearray(size)
        self._received = 0
        self._read = 0

    def __len__(self) -> int:
        return self._received - self._read

    def put(self, byte: int) -> None:
        """Store a byte from the line."""
        self._slots[self._received % len(self._slots)] = byte
        self._received += 1

    def get(self) -> int:
        """Return the byte in the next slot. Call it only while some are unread."""
        byte = self._slots[self._read % len(self._slots)]
        self._read += 1
        return byte


class ReceiveQueue:
    """A queue of *size* bytes: bytes that do not fit are lost."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._bytes: deque[int] = deque()

    def __len__(self) -> int:
        return len(self._bytes)

    def put(self, byte: int) -> None:
        """Store a byte from the line, if there is room."""
        if len(self._bytes) < self._size:
            self._bytes.append(byte)

    def get(self) -> int:
        """Return the oldest byte. Call it only while there is one."""
        return self._bytes.popleft()


class IncomingLine:
    """Bytes on their way to the robot.

    Args:
        baud: Bits a second; 0 for a line that takes no time.
    """

    def __init__(self, baud: int) -> None:
        self.byte_time = BITS_PER_BYTE / baud if baud else 0.0
        self._pieces: deque[tuple[float, bytes]] = deque()
        self._offset = 0
        self._free_at = -inf
        self.next_arrival = inf
        """When the next byte has arrived, s; infinite while none is on its way."""

    def put(self, data: bytes, time: float) -> None:
        """Start to send *data* at *time*, s, or when the bytes before it have passed."""
        if not data:
            return
        start = max(time, self._free_at)
        self._free_at = start + len(data) * self.byte_time
        self._pieces.append((start, data))
        if len(self._pieces) == 1:
            self._offset = 0
            self.next_arrival = start + self.byte_time

    def get(self) -> int:
        """Return the next byte. Call it only while one is on its way."""
        start, data = self._pieces[0]
        byte = data[self._offset]
        self._offset += 1
        if self._offset == len(data):
            self._pieces.popleft()
            self._offset = 0
            self.next_arrival = self._pieces[0][0] + self.byte_time if self._pieces else inf
        else:
            self.next_arrival = start + (self._offset + 1) * self.byte_time
        return byte

    def clear(self) -> None:
        """Lose everything that is on its way."""
        self._pieces.clear()
        self._offset = 0
        self._free_at = -inf
        self.next_arrival = inf
