"""Intel HEX files for tests, written here record by record, not by the code that reads them."""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping

Program = dict[int, int]
"""Instructions, 24 bits each, by their address in the chip."""

JUMP_TO_BOOTLOADER = {0x000000: 0x047F40, 0x000002: 0x000001}
JUMP_AT_EXIT = {0x017F38: 0x040100, 0x017F3A: 0x000000}


def record(place: int, kind: int, data: bytes) -> str:
    body = bytes((len(data), place >> 8 & 0xFF, place & 0xFF, kind)) + data
    return ":" + (body + bytes((-sum(body) & 0xFF,))).hex().upper()


def upper(address: int) -> str:
    """Return the record that gives the upper 16 bits of the addresses that follow."""
    return record(0, 4, (address >> 16).to_bytes(2, "big"))


def hex_file(program: Mapping[int, int], *, length: int = 16, more: Iterable[str] = ()) -> str:
    """Return the file of a program, in records of at most *length* bytes that may cross a 64 KiB limit."""
    lines: list[str] = []
    places = sorted(program)
    block = None
    while places:
        first = places[0]
        count = 1
        while count < length // 4 and count < len(places) and places[count] == first + 2 * count:
            count += 1
        data = b"".join(program[address].to_bytes(4, "little") for address in places[:count])
        if block != (2 * first) >> 16:
            block = (2 * first) >> 16
            lines.append(upper(2 * first))
        lines.append(record(2 * first & 0xFFFF, 0, data))
        places = places[count:]
    return "\n".join([*lines, *more, record(0, 1, b""), ""])


def jump(start: int) -> Program:
    return {0: 0x040000 | (start & 0xFFFF), 2: start >> 16}


def small(start: int = 0x100, *, rows: int = 3) -> Program:
    """Return a program of some rows behind its vectors."""
    body = {start + 2 * number: number * 0x10203 & 0xFFFFFF for number in range(32 * rows)}
    return {**jump(start), **body}


def random_program(rng: random.Random, *, most_rows: int = 1536) -> Program:
    """Return a program of random instructions, in up to eight pieces with gaps between them."""
    start = 2 * rng.randrange(0x80, 0x17F00 // 2)
    if start // 0x40 >= 0x17F00 // 0x40:
        start = 0x100
    program = {**jump(start), start: rng.randrange(0xFFFFFF)}
    for address in range(4, 0x100, 2):
        if rng.random() < 0.5:
            program[address] = rng.randrange(0x1000000)
    for _ in range(rng.randrange(1, 9)):
        first = 2 * rng.randrange(0x80, 0x17F36 // 2)
        count = min(rng.randrange(1, 32 * most_rows // 8), (0x17F36 - first) // 2)
        for number in range(count):
            program[first + 2 * number] = rng.randrange(0x1000000)
    program[start] = rng.randrange(0xFFFFFF)
    return program


def expected(program: Mapping[int, int], number: int) -> Program:
    """Return what the memory must hold where the file, or the upload itself, puts something."""
    low = program[0] & 0xFFFF
    return {
        **program,
        **JUMP_TO_BOOTLOADER,
        0x017F36: number,
        0x017F38: 0x040000 | low,
        0x017F3A: program[2] & 0x7F,
    }
