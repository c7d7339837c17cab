"""Tiny Bootloader of the e-puck1, and the program memory that it writes (wire-protocol.md, 6)."""

from __future__ import annotations

from collections.abc import Callable, Generator

from elib.simulator.emulator.firmware.steps import Busy, Deaf, FirmwareStep, FirmwareSteps, Hang, Listen, Send
from elib.simulator.emulator.timing import Timing

UPLOAD = 0xC1
"""The byte that starts an upload instead of the program."""
READY = b"qK"
WRITTEN, REFUSED = b"K", b"N"
LAST = 0xFF
"""The fourth byte of the packet that ends an upload."""
HEADER_BYTES, PACKET_BYTES = 4, 101
LIGHT_UNIT = 0.01333
"""s for which the LED is lit, for each unit of the last packet."""

ROW = 0x40
"""Units of half an instruction in a row: 32 instructions."""
END = 0x18000
VECTORS, BOOTLOADER = 0x17F00, 0x17F40
"""The row with the jump to the program, and the first row of the bootloader, which is also its entry."""
BOOTLOADER_ROWS = range(BOOTLOADER, END, ROW)
START = 0x17F38
"""Where the bootloader leaves to."""
ERASED = 0xFFFFFF
PROGRAM = 0x100
"""Start of BTcom's program (wire-protocol.md, 6.4)."""

ERASE_TIME = WRITE_TIME = 0.002
"""s. The dsPIC30F's data sheet gives 2 ms for either; the processor stands still meanwhile."""


class ProgramMemory:
    """The flash of a dsPIC30F6014A, which keeps its content without power.

    A new one holds what leads to the bootloader and to the program. The bootloader's own instructions and those of the
    program that is there at first are not modelled.
    """

    def __init__(self) -> None:
        # the rows that were written, 96 bytes each, by their address; an erased row holds FF
        self.rows: dict[int, bytes] = {}
        self.write(0, _jump(BOOTLOADER).ljust(96, b"\xff"))
        self.write(VECTORS, (b"\xff" * 84 + _jump(PROGRAM)).ljust(96, b"\xff"))

    def erase(self, address: int) -> None:
        """Erase the row with *address*."""
        self.write(address, b"\xff" * 96)

    def write(self, address: int, data: bytes) -> None:
        """Write the row with *address*; there is nothing to write beyond the end of the memory."""
        if address < END:
            self.rows[address - address % ROW] = data

    def instruction(self, address: int) -> int:
        """Return an instruction, 24 bits."""
        row = self.rows.get(address - address % ROW, b"\xff" * 96)
        place = address % ROW // 2 * 3
        return int.from_bytes(row[place : place + 3], "little")

    def jump_at(self, address: int) -> int | None:
        """Return where the GOTO at *address* leads to; None if none stands there."""
        first, second = self.instruction(address), self.instruction(address + 2)
        if first >> 16 != 0x04 or second >> 8:
            return None
        return (first & 0xFFFF) | (second & 0x7F) << 16

    @property
    def starts_bootloader(self) -> bool:
        """Whether the chip begins with the bootloader after a reset."""
        return self.jump_at(0) == BOOTLOADER

    @property
    def has_bootloader(self) -> bool:
        """Whether the bootloader is as it was delivered: no row of it was ever written."""
        return not any(row in self.rows for row in BOOTLOADER_ROWS)

    @property
    def program(self) -> int | None:
        """Where the bootloader leaves to; None if no jump stands there.

        In erased memory the chip does nothing until it comes to the next row, which is the bootloader's.
        """
        if self.instruction(START) == self.instruction(START + 2) == ERASED:
            return BOOTLOADER
        return self.jump_at(START)


def run_bootloader(memory: ProgramMemory, timing: Timing, light: Callable[[int], None]) -> FirmwareSteps:
    """Run from a reset until the program starts.

    Args:
        memory: The program memory.
        timing: How long the bootloader waits; where it does not wait, as for the golden transcripts, it is left out.
        light: Sets LED 6 to 0 or 1.
    """
    if not timing.bootloader or not memory.starts_bootloader:
        return
    while True:
        if not memory.has_bootloader:
            yield Hang()
        units = yield from _upload(memory, timing)
        if units is not None:
            light(1)
            if units == 0:
                yield Hang()
            yield Busy(units * LIGHT_UNIT)
            light(0)
        program = memory.program
        if program is None:
            yield Hang()
        if program != BOOTLOADER:
            return


def _upload(memory: ProgramMemory, timing: Timing) -> Generator[FirmwareStep, int | None, int | None]:
    """Wait for an upload and take its rows; return for how many units the LED is to be lit, if it was ended."""
    byte = yield Listen(timing.bootloader)
    if byte != UPLOAD:
        if byte is not None:
            yield Deaf(timing.bootloader_exit)
        return None
    yield Send(READY)
    while True:
        packet = bytearray()
        while len(packet) < PACKET_BYTES:
            byte = yield Listen(timing.bootloader)
            if byte is None:
                return None
            packet.append(byte)
            if len(packet) == HEADER_BYTES and byte == LAST:
                return packet[0] | packet[1] << 8
        if sum(packet) % 256:
            yield Send(REFUSED)
            continue
        address = int.from_bytes(packet[:3], "little")
        memory.erase(address)
        yield Busy(ERASE_TIME)
        memory.write(address, bytes(packet[HEADER_BYTES:-1]))
        yield Busy(WRITE_TIME)
        yield Send(WRITTEN)


def _jump(address: int) -> bytes:
    """Return a GOTO, two instructions."""
    return bytes((address & 0xFF, address >> 8 & 0xFF, 0x04, address >> 16, 0, 0))
