"""Intel HEX files, taken apart into rows: what is sent, what is not, and what is refused."""

from __future__ import annotations

import os
import random
import sys
from pathlib import Path

import pytest
from hexfiles import Program, expected, hex_file, jump, random_program, record, small, upper

from elib.base.errors import ArgumentError, Unsupported
from elib.tools.flash import Image, read_image
from elib.tools.flash.image import BOOTLOADER_ROWS, image_of

END = record(0, 1, b"")


def instruction(rows: dict[int, bytes], address: int) -> int:
    """Return what the upload writes at *address*."""
    place = address % 64 // 2 * 3
    return int.from_bytes(rows[address - address % 64][place : place + 3], "little")


def sent(image: Image, number: int = 1234) -> dict[int, bytes]:
    rows = image.rows_in_order(number)
    assert len(dict(rows)) == len(rows), "each row is sent once"
    return dict(rows)


def image(program: Program, **options: object) -> Image:
    return image_of(hex_file(program, **options), "test.hex")  # type: ignore[arg-type]


def test_the_reset_vector_leads_to_the_bootloader_and_from_there_to_the_program() -> None:
    rows = sent(image(small()))
    assert rows[0] == bytes.fromhex("407F04 010000") + b"\xff" * 90
    assert rows[0x17F00] == b"\xff" * 81 + bytes.fromhex("D20400 000104 000000") + b"\xff" * 6


def test_what_the_file_does_not_say_is_ff_and_rows_that_it_does_not_touch_are_not_sent() -> None:
    rows = sent(image({**jump(0x100), 0x100: 0x123456, 0x102: 0xABCDEF}))
    assert rows[0x100] == bytes.fromhex("563412 EFCDAB") + b"\xff" * 90
    assert set(rows) == {0, 0x100, 0x17F00}


@pytest.mark.parametrize("length", [4, 16, 64, 252])
def test_every_instruction_of_a_random_program_is_sent(length: int) -> None:
    for seed in range(10):
        program = random_program(random.Random(f"{length} {seed}"), most_rows=200)
        rows = sent(image(program, length=length))
        for address, value in expected(program, 1234).items():
            assert instruction(rows, address) == value, f"at {address:#x} of program {seed}"


@pytest.mark.parametrize("limit", [0x10000, 0x20000])
@pytest.mark.parametrize("before", [4, 8, 12])
def test_records_may_cross_a_limit_of_64_kib(limit: int, before: int) -> None:
    data = bytes.fromhex("112233004455660077889900AABBCC00")
    text = hex_file(small(), more=[upper(limit - before), record(limit - before & 0xFFFF, 0, data), END])
    rows = sent(image_of(text.removesuffix(END + "\n"), "test.hex"))
    for number, value in enumerate((0x332211, 0x665544, 0x998877, 0xCCBBAA)):
        assert instruction(rows, (limit - before) // 2 + 2 * number) == value


def test_blocks_may_come_in_any_order_and_several_times() -> None:
    lines = [
        upper(0x20000),
        record(0x0000, 0, bytes.fromhex("11111100")),
        upper(0),
        record(0x0200, 0, bytes.fromhex("22222200")),
        upper(0x20000),
        record(0x0004, 0, bytes.fromhex("33333300")),
        upper(0),
        record(0, 0, bytes.fromhex("0001040000000000")),
        END,
    ]
    rows = sent(image_of("\r\n".join(lines).lower(), "test.hex"))
    assert [instruction(rows, address) for address in (0x10000, 0x100, 0x10002)] == [0x111111, 0x222222, 0x333333]


def test_other_memories_are_left_out_and_named() -> None:
    more = [
        upper(0x00FFE000),
        record(0xE000, 0, b"\x01\x02\x00\x00"),
        upper(0x01000B80),
        record(0x0B80, 0, b"\x01\x02\x00\x00"),
        upper(0x01F00000),
        record(0x0000, 0, b"\x01\x02\x00\x00" * 4),
    ]
    found = image_of(hex_file(small(), more=more), "test.hex")
    assert found.skipped == {"data EEPROM": 4, "unit number": 4, "configuration words": 16}
    assert sent(found) == sent(image(small()))


@pytest.mark.parametrize("patched", [True, False])
def test_the_rows_of_the_bootloader_are_never_sent_whatever_the_file_holds(patched: bool) -> None:
    program = small()
    if patched:
        program |= {0: 0x047F40, 2: 0x000001, 0x17F36: 4321, 0x17F38: 0x040100, 0x17F3A: 0}
    program |= dict.fromkeys(range(0x17F40, 0x18000, 2), 0xABCDEF)
    found = image(program)
    assert found.protected == (0x17F40, 0x17F80, 0x17FC0)
    assert found.is_patched is patched
    assert not set(sent(found)) & set(BOOTLOADER_ROWS)
    assert sent(found) == sent(image(small()))


def test_a_file_with_bootloader_says_at_17f38_where_its_program_starts() -> None:
    program = {**small(0x12340), 0: 0x047F40, 2: 0x000001, 0x17F38: 0x042340, 0x17F3A: 0x000001}
    found = image(program)
    assert found.start == 0x12340
    assert instruction(sent(found), 0x17F38) == 0x042340
    assert instruction(sent(found), 0x17F3A) == 1


def test_row_0_is_sent_first_and_the_jump_to_the_program_last() -> None:
    order = [address for address, _ in image({**small(), 0x17E00: 5}).rows_in_order(1)]
    assert order == [0, 0x100, 0x140, 0x180, 0x17E00, 0x17F00]


def test_what_a_program_has_in_front_of_the_jump_stays() -> None:
    rows = sent(image({**small(), 0x17F34: 0x55AA55, 0x17F3C: 0x77BB77}))
    assert instruction(rows, 0x17F34) == 0x55AA55
    assert instruction(rows, 0x17F3C) == 0x77BB77


@pytest.mark.parametrize("number", [-1, 65536])
def test_a_number_out_of_range_is_refused(number: int) -> None:
    with pytest.raises(ArgumentError, match="0 to 65535"):
        image(small()).rows_in_order(number)


GOTO = bytes.fromhex("0001040000000000")


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([upper(0x30000), record(0, 0, bytes(4))], "0x018000"),
        ([upper(0x08000000), record(0, 0, bytes(4))], "for the e-puck2: it has bytes for 0x08000000"),
        ([upper(0x01F00000), record(0x000C, 0, bytes(12))], "configuration words from 0xF80006 on alone"),
        ([upper(0x00FFDFFC), record(0xDFFC, 0, bytes(4))], "0x7FEFFE"),
        ([upper(0x01F00020), record(0x0020, 0, bytes(4))], "0xF80010"),
        ([upper(0x2FFFC), record(0xFFFC, 0, bytes(8))], "0x018000"),
        ([record(0x0400, 0, b"\x00\x00\x00\x0c")], "0x000200 is 0C"),
        ([record(0, 2, b"\x10\x00")], "line 4"),
        ([record(0x0200, 0, bytes(4))], "line 4"),
        ([":0102030405"], "line 4"),
        ([":04040000112233FF"], "line 4"),
        (["hello"], "line 4"),
        ([":"], "line 4"),
        ([record(0x17F38 * 2 & 0xFFFF, 9, bytes(4))], "line 4"),
        ([END, record(0x0500, 0, bytes(4))], "behind its end record in line 4"),
    ],
)
def test_a_file_that_is_damaged_or_for_another_chip_is_refused(lines: list[str], message: str) -> None:
    text = "\n".join([upper(0), record(0, 0, GOTO), record(0x0200, 0, bytes(4)), *lines, END])
    with pytest.raises(ArgumentError, match=message):
        image_of(text, "test.hex")


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ({}, "no program"),
        ({0x100: 1}, "does not begin with a jump"),
        ({0: 0x000100, 2: 0, 0x100: 1}, "does not begin with a jump"),
        ({**jump(0x200), 0x100: 1}, "starts at 0x000200, where it holds no program"),
        ({**jump(0x101), 0x100: 1}, "starts at 0x000101"),
        ({**jump(0x80), 0x80: 1}, "starts at 0x000080"),
        ({**jump(0x17F00), 0x17F00: 1}, "starts at 0x017F00"),
        ({0: 0x047F40, 2: 1, 0x100: 1}, "no jump from there"),
        ({0: 0x047F40, 2: 1, 0x100: 1, 0x17F38: 0x047F40, 0x17F3A: 1}, "starts at 0x017F40"),
        ({**small(), 0x17F38: 0x123456}, "0x017F36, where the bootloader's jump"),
    ],
)
def test_a_file_without_a_program_for_this_bootloader_is_refused(program: Program, message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        image(program)


def test_a_file_whose_end_is_missing_is_refused() -> None:
    with pytest.raises(ArgumentError, match="ends without an end record"):
        image_of(hex_file(small()).replace(END, ""), "test.hex")


@pytest.mark.parametrize("name", ["test.hex", "test.elf"])
@pytest.mark.parametrize("content", ["", " \n\n"])
def test_an_empty_file_is_called_empty(name: str, content: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(ArgumentError, match=f"{name} is empty"):
        read_image(tmp_path / name)


def test_a_wrong_check_sum_is_refused_with_its_line() -> None:
    lines = hex_file(small()).splitlines()
    lines[6] = lines[6][:-1] + ("0" if lines[6][-1] != "0" else "1")
    with pytest.raises(ArgumentError, match="line 7 has invalid checksum"):
        image_of("\n".join(lines), "test.hex")


@pytest.mark.parametrize("content", [b"\xff\xfe\x00", b"", b"\n\n", b"MZ\x90" * 100, b":" + b"00" * 3000])
def test_what_is_not_intel_hex_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "test.hex"
    path.write_bytes(content)
    with pytest.raises(ArgumentError, match=r"test\.hex"):
        read_image(path)


@pytest.mark.parametrize(
    ("machine", "beside", "hint"),
    [
        (118, True, "take robot.hex beside it"),
        (118, False, "make one: xc16-bin2hex robot.elf"),
        (40, True, "An e-puck2 is programmed over its USB cable"),
    ],
)
def test_the_other_file_of_a_linker_is_refused_with_the_one_to_take(
    machine: int, beside: bool, hint: str, tmp_path: Path
) -> None:
    path = tmp_path / "robot.elf"
    path.write_bytes(b"\x7fELF\x01\x01\x01" + bytes(11) + bytes((machine, 0)) + bytes(100))
    if beside:
        path.with_suffix(".hex").write_text(hex_file(small()))
    with pytest.raises(ArgumentError, match=r"robot\.elf is an ELF file") as caught:
        read_image(path)
    assert hint in caught.value.hint


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="cannot be read: No such file"):
        read_image(tmp_path / "none.hex")


def test_a_huge_file_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "huge.hex"
    with path.open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(ArgumentError, match="larger than"):
        read_image(path)


def test_a_device_is_refused_unread() -> None:
    with pytest.raises(ArgumentError, match=r"/dev/zero cannot be read: it is not a regular file"):
        read_image("/dev/zero")


def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.hex")
    with pytest.raises(ArgumentError, match=r"pipe\.hex cannot be read: it is not a regular file"):
        read_image(tmp_path / "pipe.hex")


def test_without_intelhex_the_install_line_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "intelhex", None)
    with pytest.raises(Unsupported, match=r'pip install .*\[flash\]"'):
        image(small())
