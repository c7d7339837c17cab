"""The emulated Tiny Bootloader against docs/reference/wire-protocol.md, 6, byte by byte; the bytes are written here."""

from __future__ import annotations

import pytest

from elib.simulator.emulator.emulator import Chunk, Emulator
from elib.simulator.emulator.firmware.bootloader import BOOTLOADER_ROWS
from elib.simulator.emulator.fixed_hardware import FixedHardware

E_PUCK1 = ("btcom-1.1.3", "btcom-2.0", "asercom-1.2.2")
BYTE = 10 / 115_200
WINDOW = 1.09
ROW_0 = bytes.fromhex("00000060 407F04010000") + b"\xff" * 90 + b"\x36"
ROW_17F00 = bytes.fromhex("007F0160") + b"\xff" * 81 + bytes.fromhex("D20400000104000000") + b"\xff" * 6 + b"\x9c"
END = bytes.fromhex("950000FF")


class Robot:
    """An emulated robot, and what it sends."""

    def __init__(self, firmware: str = "btcom-1.1.3") -> None:
        self.hardware = FixedHardware(firmware=firmware)
        self.emulator = Emulator(firmware, self.hardware, booted=True)
        self.chunks: list[Chunk] = []
        self.time = 0.0

    def run(self, seconds: float) -> bytes:
        """Let time pass and return what was sent meanwhile."""
        before = len(self.chunks)
        end = self.time + seconds
        while (due := self.emulator.due) is not None and due <= end:
            self.chunks += self.emulator.advance(due)
        self.chunks += self.emulator.advance(end)
        self.time = end
        return b"".join(chunk.data for chunk in self.chunks[before:])

    def send(self, data: bytes, seconds: float = 0.05) -> bytes:
        self.emulator.receive(data, self.time)
        return self.run(seconds)

    def reset(self, seconds: float = 0.1) -> None:
        assert self.send(b"R\r", seconds) == b"r\r"

    def call(self) -> None:
        self.reset()
        assert self.send(b"\xc1") == b"qK"

    @property
    def rows(self) -> dict[int, bytes]:
        return self.emulator.memory.rows


def packet(address: int, data: bytes) -> bytes:
    body = address.to_bytes(3, "little") + b"\x60" + data
    return body + bytes((-sum(body) & 0xFF,))


@pytest.fixture(params=E_PUCK1)
def robot(request: pytest.FixtureRequest) -> Robot:
    return Robot(request.param)


def test_the_call_is_answered_by_q_and_k_in_one_burst(robot: Robot) -> None:
    robot.call()
    assert [chunk.data for chunk in robot.chunks[-1:]] == [b"qK"]
    assert robot.chunks[-1].time == pytest.approx(0.1 + 3 * BYTE)


@pytest.mark.parametrize("early", [0.0, WINDOW - 0.01 - 4 * BYTE])
def test_the_call_is_heard_during_the_whole_window(robot: Robot, early: float) -> None:
    robot.reset(early + 5 * BYTE)
    assert robot.send(b"\xc1", 0.005) == b"qK"


def test_behind_the_window_the_call_reaches_the_program(robot: Robot) -> None:
    robot.reset(WINDOW + 0.01)
    assert b"qK" not in robot.send(b"\xc1\0", 5.0)


def test_every_other_first_byte_starts_the_program_at_once_and_is_lost() -> None:
    for wrong in {*range(256)} - {0xC1}:
        robot = Robot()
        robot.reset()
        sent = robot.send(bytes((wrong,)) + b"\xc1", 0.29 + 89 * BYTE + 0.005)
        assert sent.startswith(b"\x0c\x07WELCOME"), f"after {wrong:#04x}"
        assert robot.send(b"V\r") == b"v,Version 1.1.3 September 2006\r\n", f"after {wrong:#04x}"


def test_silence_starts_the_program_after_the_window(robot: Robot) -> None:
    timing = robot.emulator.firmware.timing
    robot.reset(4 * BYTE)
    sent = robot.run(10.0)
    assert sent.endswith(b"for help\r\n")
    first = robot.chunks[1].time - len(robot.chunks[1].data) * BYTE
    assert first == pytest.approx(4 * BYTE + WINDOW + timing.startup, abs=2 * BYTE)


def test_the_two_packets_of_the_reference_are_taken_and_written(robot: Robot) -> None:
    robot.call()
    assert robot.send(ROW_0) == b"K"
    assert robot.send(ROW_17F00) == b"K"
    assert robot.rows[0] == ROW_0[4:-1]
    assert robot.rows[0x17F00] == ROW_17F00[4:-1]
    assert robot.emulator.memory.instruction(0x17F36) == 1234
    assert robot.emulator.memory.program == 0x100


def test_k_comes_one_byte_behind_the_packet_and_the_time_that_the_memory_takes(robot: Robot) -> None:
    robot.call()
    start = robot.time
    robot.send(ROW_0)
    assert robot.chunks[-1].time == pytest.approx(start + 102 * BYTE + 0.004)


def test_a_wrong_bit_in_any_byte_is_answered_by_n_and_nothing_is_written() -> None:
    good = packet(0x000100, bytes(range(96)))
    for place in range(101):
        robot = Robot()
        wrong = bytearray(good)
        wrong[place] ^= 0x08
        robot.call()
        before = dict(robot.rows)
        assert robot.send(bytes(wrong)) == b"N", f"byte {place}"
        assert robot.rows == before, f"byte {place}"
        assert robot.send(good) == b"K", f"byte {place}: it waits for the packet again, and no K stands between"
        assert robot.rows[0x100] == good[4:-1], f"byte {place}"


def test_the_fourth_byte_means_nothing_unless_it_is_ff(robot: Robot) -> None:
    robot.call()
    body = bytes.fromhex("40010000") + bytes(96)
    assert robot.send(body + bytes((-sum(body) & 0xFF,))) == b"K"
    assert robot.rows[0x140] == bytes(96)


def test_a_gap_inside_a_packet_starts_the_program_and_writes_nothing() -> None:
    for count in range(1, 101):
        robot = Robot()
        robot.call()
        before = dict(robot.rows)
        robot.send(ROW_17F00[:count], count * BYTE + WINDOW - 0.01)
        assert robot.run(0.02 + 0.29 + 89 * BYTE).startswith(b"\x0c\x07WELCOME"), f"behind {count} bytes"
        assert robot.rows == before, f"behind {count} bytes"


def test_gaps_below_the_window_are_allowed_between_all_bytes() -> None:
    robot = Robot()
    robot.call()
    for byte in ROW_0[:-1]:
        assert robot.send(bytes((byte,)), 1.08) == b""
    assert robot.send(ROW_0[-1:]) == b"K"


def test_a_gap_between_two_packets_starts_the_program(robot: Robot) -> None:
    robot.call()
    robot.send(ROW_0)
    assert b"WELCOME" in robot.run(5.0)


@pytest.mark.parametrize("units", [1, 0x95, 0x0195])
def test_the_end_packet_lights_led_6_and_then_starts_the_program(robot: Robot, units: int) -> None:
    robot.call()
    robot.send(ROW_17F00)
    start = robot.time
    robot.emulator.receive(units.to_bytes(2, "little") + b"\x12\xff", start)
    assert robot.run(4 * BYTE + units * 0.01333 - 0.001) == b""
    assert robot.hardware.lights.ring == [0, 0, 0, 0, 0, 0, 1, 0]
    robot.run(0.002)
    assert robot.hardware.lights.ring == [0] * 8
    timing = robot.emulator.firmware.timing
    assert robot.run(5.0).endswith(b"for help\r\n")
    at = robot.chunks[-1].time - timing.startup - timing.camera_start - units * 0.01333
    assert at == pytest.approx(start + 92 * BYTE, abs=25 * BYTE)


def test_the_usual_end_packet_lights_for_two_seconds() -> None:
    robot = Robot()
    robot.call()
    robot.send(END, 1.98)
    assert robot.hardware.lights.ring[6] == 1
    robot.run(0.02)
    assert robot.hardware.lights.ring[6] == 0


def test_an_end_packet_of_0_keeps_the_led_lit_until_the_next_reset() -> None:
    robot = Robot()
    robot.call()
    robot.send(bytes.fromhex("000000FF"), 1000.0)
    assert robot.hardware.lights.ring[6] == 1
    robot.emulator.press_reset(robot.time)
    assert robot.hardware.lights.ring[6] == 0
    assert robot.run(5.0).startswith(b"\x0c\x07WELCOME")


def test_nothing_is_protected_and_a_robot_without_its_bootloader_is_dead() -> None:
    robot = Robot()
    robot.call()
    assert robot.send(packet(0x17F80, bytes(96))) == b"K"
    robot.emulator.press_reset(robot.time)
    assert robot.run(100.0) == b""
    robot.emulator.power_cycle(robot.time)
    assert robot.run(100.0) == b""


def test_row_0_repeated_at_once_behind_a_byte_that_came_twice_takes_the_way_to_the_bootloader_away() -> None:
    robot = Robot()
    robot.call()
    assert robot.send(ROW_0[:50] + ROW_0[49:]) == b"N"
    assert robot.send(ROW_0) == b"K", "the check sum is correct, as that of every packet turned in a circle"
    assert not robot.emulator.memory.starts_bootloader


def test_a_row_0_that_leads_elsewhere_leaves_the_bootloader_out_for_good() -> None:
    robot = Robot()
    robot.call()
    assert robot.send(packet(0, bytes.fromhex("000104000000").ljust(96, b"\xff"))) == b"K"
    robot.emulator.power_cycle(robot.time)
    assert robot.send(b"\xc1" * 10, 5.0).startswith(b"\x0c\x07WELCOME")


@pytest.mark.parametrize("data", [b"\xff" * 96, b"\xff" * 84 + bytes.fromhex("407F04010000") + b"\xff" * 6])
def test_a_bootloader_that_leaves_to_itself_listens_for_ever(data: bytes) -> None:
    robot = Robot()
    robot.call()
    assert robot.send(packet(0x17F00, data)) == b"K"
    assert robot.run(1000.0) == b""
    robot.send(b"V\r", 0.5)  # lost, and the window begins again
    assert robot.send(b"\xc1") == b"qK"
    assert robot.send(ROW_17F00) == b"K"
    assert robot.send(END, 5.0).startswith(b"\x0c\x07WELCOME")


def test_power_that_fails_during_a_write_leaves_the_row_erased() -> None:
    robot = Robot()
    robot.call()
    robot.send(packet(0x100, bytes(96)))
    robot.send(packet(0x100, b"\x01" * 96), 101 * BYTE + 0.001)
    robot.emulator.power_cycle(robot.time)
    assert robot.rows[0x100] == b"\xff" * 96


def test_beyond_the_memory_nothing_is_written(robot: Robot) -> None:
    robot.call()
    before = dict(robot.rows)
    assert robot.send(packet(0x18000, bytes(96))) == b"K"
    assert robot.send(packet(0x7FF000, bytes(96))) == b"K"
    assert robot.rows == before


def test_the_memory_keeps_its_content_over_resets_and_power_cycles(robot: Robot) -> None:
    robot.call()
    robot.send(packet(0x2000, b"\x42" * 96))
    robot.emulator.power_cycle(robot.time)
    robot.run(10.0)
    robot.reset()
    assert robot.rows[0x2000] == b"\x42" * 96
    assert not set(robot.rows) & set(BOOTLOADER_ROWS)


def test_a_robot_that_is_switched_on_listens_in_both_windows(robot: Robot) -> None:
    for wait in (0.5, 1.6):
        robot.emulator.power_cycle(robot.time)
        robot.run(wait)
        assert robot.send(b"\xc1") == b"qK"


def test_the_e_puck2_has_no_such_bootloader() -> None:
    robot = Robot("epuck2")
    robot.emulator.press_reset(0.0)
    assert robot.send(b"\xc1", 3.0) == b""
    robot.emulator.press_reset(robot.time)
    assert robot.run(10.0).startswith(b"\x0c\x07WELCOME")
