"""Time: when bytes arrive, when they are read, when answers leave."""

from itertools import pairwise

import pytest

from elib.link.protocol.profiles import PROFILES
from elib.simulator.emulator.emulator import Chunk, Emulator
from elib.simulator.emulator.firmware import FIRMWARES
from elib.simulator.emulator.fixed_hardware import FixedHardware
from elib.simulator.emulator.timing import ASERCOM_1_2_2, BTCOM_1_1_3, EPUCK2, LINE_ONLY

BYTE = 10 / 115_200
E_PUCK1 = ("btcom-1.1.3", "btcom-2.0", "asercom-1.2.2")


def robot(firmware: str = "btcom-1.1.3", *, baud: int = 115_200) -> Emulator:
    return Emulator(firmware, FixedHardware(firmware=firmware), baud=baud, booted=True)


def run(emulator: Emulator, until: float) -> list[Chunk]:
    """Advance only when something is due, as a host does."""
    chunks = []
    while (due := emulator.due) is not None and due <= until:
        chunks += emulator.advance(due)
    return chunks + emulator.advance(until)


def text(chunks: list[Chunk]) -> bytes:
    return b"".join(chunk.data for chunk in chunks)


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_a_booted_robot_says_nothing_and_has_nothing_to_do(firmware: str) -> None:
    emulator = robot(firmware)
    assert emulator.is_idle
    assert emulator.due is None
    assert emulator.advance(1000.0) == []


def test_an_answer_leaves_after_request_and_answer_have_been_on_the_line() -> None:
    emulator = robot()
    emulator.receive(b"N\r", 5.0)
    (chunk,) = run(emulator, 6.0)
    assert chunk.data == b"n,100,90,80,70,60,50,40,30\r\n"
    assert chunk.time == pytest.approx(5.0 + (2 + 28) * BYTE)
    assert emulator.is_idle


def test_nothing_is_handed_out_before_its_time() -> None:
    emulator = robot()
    emulator.receive(b"C\r", 0.0)
    assert emulator.advance(6 * BYTE) == []
    assert not emulator.is_idle
    assert text(emulator.advance(7.01 * BYTE)) == b"c,3\r\n"


def test_advancing_often_or_once_gives_the_same_chunks() -> None:
    once, often = robot("asercom-1.2.2"), robot("asercom-1.2.2")
    stream = b"C\rH\rD,1,2\r\xb2\xb7\0Q\r"
    once.receive(stream, 0.0)
    often.receive(stream, 0.0)
    chunks = once.advance(1.0)
    pieces = [chunk for step in range(1, 10_001) for chunk in often.advance(step * 1e-4)]
    assert pieces == chunks


def test_an_unpaced_line_takes_no_time() -> None:
    emulator = robot(baud=0)
    emulator.receive(b"C\rV\r", 2.0)
    assert [chunk.time for chunk in emulator.advance(2.0)] == [2.0, 2.0]


def test_a_second_write_waits_for_the_first_to_pass() -> None:
    emulator = robot()
    emulator.receive(b"D,1", 0.0)
    emulator.receive(b",2\r", 0.0)
    (chunk,) = run(emulator, 1.0)
    assert chunk.time == pytest.approx((6 + 3) * BYTE)


def test_long_answers_come_in_paced_pieces() -> None:
    emulator = robot()
    emulator.receive(b"\xb7\0", 0.0)
    chunks = run(emulator, 1.0)
    assert len(text(chunks)) == 3203
    assert [len(chunk.data) for chunk in chunks] == [64] * 50 + [3]
    assert chunks[-1].time == pytest.approx(2 * BYTE + BTCOM_1_1_3.picture + 3203 * BYTE)
    gaps = [after.time - before.time for before, after in pairwise(chunks)]
    assert gaps[:-1] == pytest.approx([64 * BYTE] * 49)


def test_answers_carry_the_number_of_their_command_or_frame() -> None:
    emulator = robot("asercom-1.2.2")
    emulator.receive(b"C\r\0\xb2\xaf\0D,1,2\r\xbc\0\0\0\0\0K\r", 0.0)
    chunks = run(emulator, 10.0)
    assert [(chunk.answer, chunk.data[:2]) for chunk in chunks] == [
        (1, b"c,"),
        (2, b"d\0"),
        (3, b"d\r"),
        (5, b"k,"),
        (5, b"k,"),
    ]


def test_a_banner_answers_nothing() -> None:
    emulator = Emulator("asercom-1.2.2", FixedHardware(), timing=LINE_ONLY)
    assert {chunk.answer for chunk in run(emulator, 1.0)} == {0}
    emulator.receive(b"R\r", 1.0)
    assert [(chunk.answer, chunk.data[:8]) for chunk in run(emulator, 2.0)][:2] == [(1, b"r\r"), (0, b"Selector")]


def test_calibration_answers_twice_seconds_apart() -> None:
    emulator = robot()
    emulator.receive(b"K\r", 0.0)
    first, second = run(emulator, 10.0)
    assert (len(first.data), len(second.data)) == (62, 25)
    assert second.time - first.time == pytest.approx(BTCOM_1_1_3.calibration + 25 * BYTE)


def test_the_ring_is_lit_for_as_long_as_the_calibration_lasts() -> None:
    hardware = FixedHardware()
    emulator = Emulator("btcom-1.1.3", hardware, booted=True)
    emulator.receive(b"K\r", 0.0)
    run(emulator, 1.0)
    assert hardware.lights.ring == [1] * 8
    run(emulator, 10.0)
    assert hardware.lights.ring == [0] * 8


def test_commands_wait_while_the_robot_calibrates() -> None:
    emulator = robot()
    emulator.receive(b"K\r", 0.0)
    run(emulator, 1.0)
    emulator.receive(b"C\rV\r", 1.0)
    assert text(run(emulator, 3.0)) == b""
    assert text(run(emulator, 10.0)).endswith(b"finished\r\nc,3\r\nv,Version 1.1.3 September 2006\r\n")


@pytest.mark.parametrize("firmware", ["btcom-2.0", "asercom-1.2.2"])
def test_more_than_64_waiting_bytes_overwrite_each_other_but_as_many_are_delivered(firmware: str) -> None:
    emulator = robot(firmware)
    emulator.receive(b"K\r", 0.0)
    run(emulator, 0.5)
    # 66 bytes: the last two lie in the slots of the first two.
    emulator.receive(b"D,111" + b"," * 58 + b"\rV\r", 0.5)
    answers = text(run(emulator, 10.0))
    assert answers.count(b"v,Version") == 2
    assert answers.split(b"finished\r\n")[1].startswith(b"v,Version")
    assert answers.count(b"z,Command not found") == 1


def test_btcom_1_1_3_keeps_four_waiting_bytes_and_loses_the_others() -> None:
    emulator = robot("btcom-1.1.3")
    emulator.receive(b"K\r", 0.0)
    run(emulator, 0.5)
    emulator.receive(b"C\rV\rN\rQ\r", 0.5)
    answers = text(run(emulator, 10.0))
    assert answers.endswith(b"finished\r\nc,3\r\nv,Version 1.1.3 September 2006\r\n")
    emulator.receive(b"Q\r", 10.0)
    assert text(run(emulator, 11.0)) == b"q,0,0\r\n"


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_a_robot_keeps_as_many_waiting_bytes_as_the_clients_profile_says(firmware: str) -> None:
    ring = PROFILES[firmware].receive_ring
    for count in (ring // 2, ring // 2 + 1):
        emulator = robot(firmware)
        emulator.receive(b"K\r", 0.0)
        run(emulator, 0.5)
        emulator.receive(b"C\r" * count, 0.5)
        answers = text(run(emulator, 20.0)).split(b"finished\r\n")[1]
        # The ring of the e-puck1 delivers as many bytes as came, only not the same ones; all of these are alike.
        assert answers == b"c,3\r\n" * (ring // 2 if firmware in ("btcom-1.1.3", "epuck2") else count)


def test_a_line_longer_than_the_ring_is_read_as_it_comes() -> None:
    emulator = robot()
    emulator.receive(b"D," + b"0" * 3000 + b"7,8\rE\r", 0.0)
    assert text(run(emulator, 1.0)) == b"d\r\ne,7,8\r\n"


def test_the_sample_dump_does_not_hold_up_the_program() -> None:
    emulator = robot()
    emulator.receive(b"\xab", 0.0)
    emulator.advance(2 * BYTE)
    emulator.receive(b"\xbc\x0a\0\x14\0\0", 2 * BYTE)
    emulator.advance(10 * BYTE)
    assert emulator.firmware.motors[0].speed == 10
    chunks = run(emulator, 1.0)
    assert len(text(chunks)) == 601
    assert chunks[-1].time == pytest.approx(602 * BYTE)


# Reset and power.


@pytest.mark.parametrize("firmware", E_PUCK1)
def test_a_reset_takes_as_long_as_measured(firmware: str) -> None:
    emulator = robot(firmware)
    emulator.receive(b"R\r", 0.0)
    chunks = run(emulator, 10.0)
    assert chunks[0].data == b"r\r"
    end = 4 * BYTE + FIRMWARES[firmware].TIMING.reset + 88 * BYTE
    # Asercom's selector line goes out while it waits for the ADC's first samples.
    assert chunks[-1].time == pytest.approx(end, abs=20 * BYTE)
    assert text(chunks[-2:])[-88:].startswith(b"\x0c\x07WELCOME")


def test_the_bootloader_loses_bytes_and_the_first_one_ends_its_wait() -> None:
    emulator = robot()
    emulator.receive(b"R\r", 0.0)
    run(emulator, 0.5)
    emulator.receive(b"V\r", 0.5)
    chunks = run(emulator, 10.0)
    assert text(chunks).count(b"Version") == 0
    assert chunks[0].time == pytest.approx(0.5 + BYTE + BTCOM_1_1_3.bootloader_exit + BTCOM_1_1_3.startup, abs=0.01)


def test_bytes_that_come_after_the_bootloader_wait_for_the_program() -> None:
    emulator = robot()
    emulator.receive(b"R\r", 0.0)
    run(emulator, 1.2)
    emulator.receive(b"C\r", 1.2)
    assert text(run(emulator, 10.0)).endswith(b"help\r\nc,3\r\n")


def test_after_the_start_of_an_upload_the_robot_takes_bytes_while_they_keep_coming() -> None:
    emulator = robot()
    emulator.receive(b"R\r", 0.0)
    run(emulator, 0.5)
    for time, answer in ((0.5, b"qK"), (1.5, b""), (2.5, b"")):
        emulator.receive(b"\xc1", time)
        assert text(run(emulator, time + 0.5)) == answer
    assert text(run(emulator, 5.0)).startswith(b"\x0c\x07")


def test_bytes_behind_a_reset_are_lost_with_the_line() -> None:
    emulator = Emulator("btcom-1.1.3", FixedHardware(), timing=LINE_ONLY)
    run(emulator, 1.0)
    emulator.receive(b"R\rV\rV\rV\rV\r", 1.0)
    assert b"Version" not in text(run(emulator, 2.0))


def test_a_robot_that_is_switched_on_goes_through_the_bootloader_twice() -> None:
    emulator = Emulator("asercom-1.2.2", FixedHardware())
    chunks = run(emulator, 10.0)
    assert text(chunks).startswith(b"Selector pos 3\r\n\x0c\x07")
    assert chunks[0].time == pytest.approx(2 * ASERCOM_1_2_2.bootloader + ASERCOM_1_2_2.startup, abs=0.01)
    assert emulator.firmware.resets == 1


def test_a_power_cycle_forgets_everything_at_once() -> None:
    hardware = FixedHardware()
    emulator = Emulator("btcom-2.0", hardware, booted=True)
    emulator.receive(b"D,500,500\rL,8,1\r\xb7\0", 0.0)
    run(emulator, 0.1)
    assert hardware.rates != (0.0, 0.0)
    emulator.power_cycle(0.1)
    assert (hardware.rates, hardware.lights.ring) == ((0.0, 0.0), [0] * 8)
    assert text(run(emulator, 10.0)).startswith(b"\x0c\x07WELCOME")
    emulator.receive(b"E\r", 10.0)
    assert text(run(emulator, 11.0)) == b"e,0,0\r\n"


def test_a_hung_program_answers_nothing_until_its_power_is_cut() -> None:
    emulator = Emulator("btcom-2.0", FixedHardware({"camera": 0}), booted=True)
    emulator.receive(b"\xb7\0C\r", 0.0)
    assert run(emulator, 100.0) == []
    emulator.receive(b"C\r", 100.0)
    assert (run(emulator, 200.0), emulator.is_idle, emulator.due) == ([], True, None)
    emulator.power_cycle(200.0)
    assert text(run(emulator, 300.0)).startswith(b"\x0c\x07")


# The world around it.


class ClockedHardware(FixedHardware):
    """Records the time of the world at every reading."""

    def __init__(self) -> None:
        super().__init__()
        self.time = 0.0
        self.readings: list[float] = []

    def advance(self, time: float) -> None:
        assert time >= self.time, "time went back"
        self.time = time

    def ambient_light(self) -> list[int]:
        self.readings.append(self.time)
        return [0] * 8


def test_the_world_is_up_to_date_when_it_is_read() -> None:
    hardware = ClockedHardware()
    emulator = Emulator("btcom-1.1.3", hardware, booted=True)
    emulator.receive(b"O\r", 3.0)
    emulator.receive(b"\xb1", 4.0)
    run(emulator, 10.0)
    assert hardware.readings == pytest.approx([3.0 + 2 * BYTE, 4.0 + BYTE])


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_steps_are_counted_in_real_time(firmware: str) -> None:
    emulator = robot(firmware)
    emulator.receive(b"D,1000,-500\r", 0.0)
    run(emulator, 10.0)
    emulator.receive(b"Q\r", 10.0)
    left, right = (int(number) for number in text(run(emulator, 11.0))[2:].split(b","))
    assert left == pytest.approx(10_000, rel=2e-3)
    assert right == pytest.approx(-5_000, rel=2e-3)


def test_the_hardware_is_driven_at_the_true_rate() -> None:
    hardware = FixedHardware()
    emulator = Emulator("btcom-1.1.3", hardware, booted=True)
    emulator.receive(b"D,900,-150\r", 0.0)
    run(emulator, 1.0)
    assert hardware.rates == pytest.approx((908.8, -151.5), abs=0.1)


def test_a_remote_key_is_obeyed_without_any_byte() -> None:
    hardware = FixedHardware()
    emulator = Emulator("asercom-1.2.2", hardware, booted=True)
    hardware.set(ir_data=6)
    emulator.advance(1.0)
    assert [motor.speed for motor in emulator.firmware.motors] == [600, -600]


def test_the_e_puck2_obeys_new_codes_from_any_address_and_keeps_its_variables() -> None:
    hardware = FixedHardware(firmware="epuck2")
    emulator = Emulator("epuck2", hardware, booted=True)
    emulator.advance(0.0)
    hardware.set(ir_data=2, ir_address=17)
    emulator.advance(1.0)
    assert [motor.speed for motor in emulator.firmware.motors] == [600, 600]
    emulator.receive(b"S\rE\r", 1.0)
    assert text(run(emulator, 2.0)) == b"s\r\ne,0,0\r\n"
    hardware.set(ir_check=1)  # the same key pressed again
    emulator.advance(3.0)
    assert [motor.speed for motor in emulator.firmware.motors] == [600, 600]


def test_the_e_puck2_turns_away_from_obstacles_fifty_times_a_second() -> None:
    hardware = FixedHardware({"prox": [0] * 10}, firmware="epuck2")
    emulator = Emulator("epuck2", hardware, booted=True)
    emulator.receive(b"\xf7\x02" + b"\x2c\x01" * 2 + bytes(14) + b"\0", 0.0)
    run(emulator, 0.1)
    speeds = [motor.speed for motor in emulator.firmware.motors]
    assert speeds == [300, 300]
    assert emulator.due == pytest.approx(0.1, abs=0.02)
    hardware.set(prox=[200, 100, 0, 0, 0, 0, 0, 0, 0, 0])
    run(emulator, 0.2)
    left, right = (motor.speed for motor in emulator.firmware.motors)
    assert left < 0 < right
    emulator.receive(b"\xf7" + bytes(19) + b"\0", 0.2)
    run(emulator, 0.3)
    assert emulator.due is None


@pytest.mark.parametrize("request_", [b"A\r", b"\x9f\0"], ids=["text A", "binary a"])
def test_the_e_puck2_averages_its_accelerometer_where_it_is_read_alone(request_: bytes) -> None:
    emulator = robot("epuck2")
    emulator.receive(request_, 0.0)
    (chunk,) = run(emulator, 1.0)
    assert chunk.time == pytest.approx(EPUCK2.acceleration + (2 + len(chunk.data)) * BYTE, abs=BYTE)


@pytest.mark.parametrize(
    "opcodes",
    [b"\xf8", b"\xbf", b"\x99\x9e\xf1\x01", b"\xf8\xbb\xf5"],
    ids=["packet", "attitude", "others", "sensors()"],
)
def test_everything_else_that_the_e_puck2_reads_in_binary_takes_no_longer_than_the_line(opcodes: bytes) -> None:
    emulator = robot("epuck2")
    emulator.receive(opcodes + b"\0", 0.0)
    chunks = run(emulator, 1.0)
    assert chunks[-1].time == pytest.approx((len(opcodes) + 1 + len(text(chunks))) * BYTE)


def test_the_e_puck2_calibrates_half_a_second_quicker_by_packet_than_by_text() -> None:
    by_text, by_packet = robot("epuck2"), robot("epuck2")
    by_text.receive(b"K\r", 0.0)
    by_packet.receive(b"\xf7\x01" + bytes(18) + b"\0C\r", 0.0)
    assert run(by_text, 10.0)[-1].time == pytest.approx(EPUCK2.calibration + (2 + 62 + 25) * BYTE)
    (selector,) = run(by_packet, 10.0)
    assert selector.time == pytest.approx(EPUCK2.calibration - 0.5 + (20 + 5) * BYTE)


def test_a_half_open_command_waits_without_being_due() -> None:
    for piece in (b"D,1", b"\xbc\x01", b"\xb2", b"\r"):
        emulator = robot()
        emulator.receive(piece, 0.0)
        run(emulator, 1.0)
        assert (emulator.is_idle, emulator.due) == (True, None)
