"""The rows of program memory that an Intel HEX file holds, with the jumps that keep the bootloader in reach."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from elib.base.errors import ArgumentError, Unsupported
from elib.base.extras import install
from elib.base.files import guide, read_file
from elib.base.rules import Whole

ROW = 0x40
"""Addresses in a row. The chip counts half instructions, and a row has 32 instructions."""
ROW_BYTES = 96
END = 0x18000
VECTORS, BOOTLOADER = 0x17F00, 0x17F40
BOOTLOADER_ROWS = range(BOOTLOADER, END, ROW)
"""The rows of the bootloader, which are never sent (wire-protocol.md, 6.4)."""
NUMBER_AT, START_AT = 0x17F36, 0x17F38
"""Where the robot's number stands, and the jump by which the bootloader leaves to the program."""
FIRST_START = 0x100
"""The first address behind the reset vector and the interrupt vectors."""
NUMBER = Whole(0, 0xFFFF)
EMPTY = b"\xff" * ROW_BYTES

OTHER_MEMORY = {
    "data EEPROM": range(0x7FF000, 0x800000),
    "unit number": range(0x8005C0, 0x800600),
    "configuration words": range(0xF80000, 0xF80010),
}
"""What a file may hold besides the program, and what the bootloader cannot write (wire-protocol.md, 6.3)."""

OWN_SETTINGS = range(0xF80000, 0xF80006)
"""The configuration words FOSC, FWDT and FBORPOR, which a dsPIC33 does not have there (DS70143, 21)."""
OTHER_CHIP = "is it a program for another chip? The e-puck1 has a dsPIC30F6014A"
EPUCK2_PLACES = range(0x08000000, 0x08200000)
"""The flash memory of the e-puck2's main processor, an STM32F407 (its reference manual, RM0090, 3)."""
EPUCK2_HINT = f"An e-puck2 is programmed over its USB cable: see the guide {guide('flash')}"
ELF, ELF_MACHINE, ARM = b"\x7fELF", 18, 40
"""The first bytes of an ELF file, where it says for which processor it is, and the number of ARM, the e-puck2's."""

MAX_FILE = 4 << 20
"""Bytes. The whole memory, in records of one byte each, takes less."""
LINE_SECONDS = 102 * 10 / 115200
"""s that a row takes on the line: its packet and the answer."""

Row = tuple[int, bytes]
"""Address and 96 bytes: 32 instructions, low byte first."""


@dataclass(frozen=True, slots=True)
class Image:
    """A program for the e-puck1, as it is to be written."""

    # The rows of the program by their address, without those of the bootloader. The reset vector leads to the
    # bootloader, and the row at 0x17F00 has the jump to the program, without the robot's number.
    rows: Mapping[int, bytes]
    start: int  # where the program starts
    is_patched: bool  # whether the file had these jumps already
    protected: tuple[int, ...]  # the rows of the bootloader that the file holds and that are not sent
    skipped: Mapping[str, int]  # how many bytes the file holds for other memories, by their names

    def rows_in_order(self, number: int) -> list[Row]:
        """Return the rows in the order in which they are sent.

        Row 0 is the first one. The row with the jump to the program is the last one, so that the robot cannot start a
        program that is half written.

        Args:
            number: The robot's number, 0..65535.

        Raises:
            ArgumentError: *number* is out of its range.
        """
        NUMBER.require(number, "number", "the robot's ")
        last = _with(self.rows[VECTORS], NUMBER_AT, bytes((number & 0xFF, number >> 8, 0)))
        return [
            *((address, self.rows[address]) for address in sorted(self.rows) if address != VECTORS),
            (VECTORS, last),
        ]

    @property
    def seconds(self) -> float:
        """The time that the upload takes on the line at least, s."""
        return len(self.rows) * LINE_SECONDS


def read_image(path: str | Path) -> Image:
    """Read a program from an Intel HEX file."""
    name = Path(path).name
    content = read_file(path, "the program", largest=MAX_FILE)
    if not content.strip():
        raise ArgumentError(f"{name} is empty", hint="build the program, or copy the file, again")
    if len(content) > MAX_FILE:
        raise ArgumentError(f"{name} is larger than any Intel HEX file of a program for the e-puck1")
    if content.startswith(ELF):
        is_epuck2 = content[ELF_MACHINE : ELF_MACHINE + 1] == bytes((ARM,))
        beside = Path(path).with_suffix(".hex")
        take = f"take {beside.name} beside it" if beside.exists() else f"make one: xc16-bin2hex {name}"
        raise ArgumentError(
            f"{name} is an ELF file{' for the e-puck2' if is_epuck2 else ''}; an e-puck1 takes an Intel HEX file",
            hint=EPUCK2_HINT if is_epuck2 else take,
        )
    try:
        text = content.decode("ascii")
    except UnicodeDecodeError:
        raise ArgumentError(f"{name} is not an Intel HEX file: it holds bytes that are not text") from None
    return image_of(text, name)


def image_of(text: str, name: str) -> Image:
    """Return the program in the text of an Intel HEX file; *name* is for messages. Raises as :func:`read_image`."""
    given = _bytes_of(text, name)
    if any(place in EPUCK2_PLACES for place in given):
        raise ArgumentError(
            f"{name} is a program for the e-puck2: it has bytes for 0x{min(EPUCK2_PLACES):08X}", hint=EPUCK2_HINT
        )
    settings = [place // 4 * 2 for place in given if place // 4 * 2 in OTHER_MEMORY["configuration words"]]
    if settings and not any(place in OWN_SETTINGS for place in settings):
        raise ArgumentError(f"{name} has configuration words from 0x{min(settings):06X} on alone", hint=OTHER_CHIP)
    rows: dict[int, bytearray] = {}
    skipped: Counter[str] = Counter()
    for place, byte in sorted(given.items()):
        address, part = place // 4 * 2, place % 4
        if address >= END:
            skipped[_other_memory(address, name)] += 1
        elif part == 3:
            # Instructions have three bytes. Their fourth is 0 in the file, or FF in a copy of erased memory.
            if byte not in (0, 0xFF):
                raise ArgumentError(
                    f"{name}: the fourth byte of the instruction at 0x{address:06X} is {byte:02X}, not 00",
                    hint=OTHER_CHIP,
                )
        else:
            row = rows.setdefault(address - address % ROW, bytearray(EMPTY))
            row[address % ROW // 2 * 3 + part] = byte
    protected = tuple(address for address in sorted(rows) if address in BOOTLOADER_ROWS)
    return _patched({address: bytes(row) for address, row in rows.items()}, protected, skipped, name)


def jump(address: int) -> bytes:
    """Return the GOTO to *address*, two instructions."""
    return bytes((address & 0xFF, address >> 8 & 0xFF, 0x04, address >> 16, 0, 0))


def _patched(rows: dict[int, bytes], protected: tuple[int, ...], skipped: Counter[str], name: str) -> Image:
    """Return the image whose jumps lead to the bootloader and from there to the program."""
    first = _jump_at(rows, 0)
    if first is None:
        raise ArgumentError(
            f"{name} does not begin with a jump to its program at 0x000000",
            hint="is it a whole program, and for the e-puck1's dsPIC30F6014A?",
        )
    vectors = rows.get(VECTORS, EMPTY)
    is_patched = first == BOOTLOADER
    start = _jump_at(rows, START_AT) if is_patched else first
    if start is None:
        raise ArgumentError(
            f"{name} starts with the bootloader, but holds no jump from there to a program at 0x{START_AT:06X}",
            hint="take the file of the program without bootloader",
        )
    if start % 2 or not FIRST_START <= start < VECTORS or rows.get(start - start % ROW, EMPTY) == EMPTY:
        raise ArgumentError(f"{name} starts at 0x{start:06X}, where it holds no program")
    if not is_patched and _at(vectors, NUMBER_AT, 9) != b"\xff" * 9:
        raise ArgumentError(
            f"{name} holds instructions at 0x{NUMBER_AT:06X}, where the bootloader's jump to the program has its place",
            hint=f"the program must end below 0x{NUMBER_AT:06X}",
        )
    kept = {address: row for address, row in rows.items() if address not in BOOTLOADER_ROWS}
    kept[0] = _with(rows[0], 0, jump(BOOTLOADER))
    kept[VECTORS] = _with(_with(vectors, NUMBER_AT, b"\xff" * 3), START_AT, jump(start))
    return Image(kept, start, is_patched, protected, skipped)


def _bytes_of(text: str, name: str) -> dict[int, int]:
    """Return every byte that the file holds, by its address, which is twice that of the chip."""
    try:
        from intelhex import HexReaderError, IntelHex
    except ImportError as error:
        raise Unsupported(
            "Intel HEX files need the package intelhex, which is not installed", hint=install("flash")
        ) from error
    lines = [line.strip() for line in text.splitlines()]
    ends = [number for number, line in enumerate(lines, 1) if line[7:9] == "01"]
    other = next((number for number, line in enumerate(lines, 1) if line[7:9] in ("02", "03")), None)
    file = IntelHex()
    try:
        file.loadhex(io.StringIO("\n".join(lines)))
    except HexReaderError as error:
        raise ArgumentError(f"{name}: {error}", hint="copy the file again: it is damaged, or not Intel HEX") from None
    if other is not None:
        raise ArgumentError(
            f"{name}: line {other} is a record for another kind of processor", hint="is it a program for the e-puck1?"
        )
    if not ends:
        raise ArgumentError(f"{name} ends without an end record", hint="copy the file again: a part of it is missing")
    if any(lines[ends[0] :]):
        raise ArgumentError(f"{name} goes on behind its end record in line {ends[0]}", hint="take each program alone")
    found: dict[int, int] = file.todict()
    found.pop("start_addr", None)  # type: ignore[call-overload]  # the library adds it to the bytes
    if not found:
        raise ArgumentError(f"{name} holds no program")
    return found


def _other_memory(address: int, name: str) -> str:
    for memory, where in OTHER_MEMORY.items():
        if address in where:
            return memory
    raise ArgumentError(
        f"{name} holds data for 0x{address:06X}; the memory of the e-puck1 ends at 0x{END - 2:06X}",
        hint=OTHER_CHIP,
    )


def _jump_at(rows: Mapping[int, bytes], address: int) -> int | None:
    """Return where the GOTO at *address* leads to; None if none stands there."""
    low, high, code, top, *rest = _at(rows.get(address - address % ROW, EMPTY), address, 6)
    return None if code != 0x04 or top > 0x7F or any(rest) else low | high << 8 | top << 16


def _at(row: bytes, address: int, count: int) -> bytes:
    place = address % ROW // 2 * 3
    return row[place : place + count]


def _with(row: bytes, address: int, data: bytes) -> bytes:
    place = address % ROW // 2 * 3
    return row[:place] + data + row[place + len(data) :]


def spans(addresses: Mapping[int, bytes] | tuple[int, ...]) -> Iterator[tuple[int, int]]:
    """Yield the first and the last row of each run of neighbouring rows."""
    for _, run in groupby(enumerate(sorted(addresses)), lambda place: place[1] - ROW * place[0]):
        rows = [address for _, address in run]
        yield rows[0], rows[-1]
