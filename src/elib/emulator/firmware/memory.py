"""The one buffer of a firmware: for the line it receives, the reply it prints, the answer it packs.

Nothing clears the buffer, so a command that sends more than it wrote also sends what an earlier command left there
(wire-protocol.md, 2.5 and 3.4). The model is the dsPIC's whole data space of 64 KiB with the buffer at its start: a
picture larger than the buffer overwrites what follows it.
"""

from __future__ import annotations

SIZE = 0x10000


class Memory:
    """64 KiB, zero at power-on. Addresses wrap, negative ones included."""

    def __init__(self) -> None:
        self._bytes = bytearray(SIZE)

    def store(self, address: int, data: bytes) -> None:
        """Write *data* at *address*."""
        address %= SIZE
        end = address + len(data)
        if end <= SIZE:
            self._bytes[address:end] = data
        else:
            for offset, byte in enumerate(data):
                self._bytes[(address + offset) % SIZE] = byte

    def load(self, address: int, count: int) -> bytes:
        """Read *count* bytes, 0..65536, from *address*."""
        address %= SIZE
        piece = bytes(self._bytes[address : address + count])
        return piece + bytes(self._bytes[: count - len(piece)])

    def text(self, address: int) -> bytes:
        """Read up to the next zero byte, which is not returned."""
        address %= SIZE
        end = self._bytes.find(0, address)
        return bytes(self._bytes[address : end if end >= 0 else SIZE])
