"""Rules all firmwares follow, beyond the exchanges that were recorded."""

import struct

import pytest

from elib.base.errors import ArgumentError
from elib.link.protocol import profiles
from elib.link.protocol.profiles import profile_named
from elib.link.protocol.robot_connection import RobotConnection
from elib.simulator.emulator.firmware import FIRMWARES, WIFI_FIRMWARES
from elib.simulator.emulator.firmware.bootloader import ProgramMemory
from elib.simulator.emulator.fixed_hardware import FixedHardware
from elib.simulator.emulator.timing import LINE_ONLY
from elib.testing import EmulatedRobot

ALL = tuple(FIRMWARES)
IMAGE = 0xB7
E_PUCK1 = ("btcom-1.1.3", "btcom-2.0", "asercom-1.2.2")


def numbers(reply: bytes) -> list[int]:
    return [int(number) for number in reply[2:].split(b",")]


def words(reply: bytes) -> list[int]:
    return list(struct.unpack(f"<{len(reply) // 2}h", reply))


@pytest.mark.parametrize("firmware", ALL)
def test_every_letter_and_opcode_has_a_handler_and_a_parameter_count(firmware: str) -> None:
    program = FIRMWARES[firmware](FixedHardware(firmware=firmware), LINE_ONLY)
    assert set(program.LENGTHS) == set(program.BINARY)
    assert set(map(chr, program.TEXT)) >= set("ABCDEFGHIJKLMNOPQRSTUV")
    assert program.TIMING.reset > 0
    assert program.BUILD.camera_chip


def test_an_unknown_firmware_names_the_nearest() -> None:
    with pytest.raises(ArgumentError, match="there is no firmware 5"):
        profile_named(5)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match=r"there is no firmware 'btcom-2'(.|\n)*did you mean btcom-2\.0\?"):
        EmulatedRobot("btcom-2")


@pytest.mark.parametrize("firmware", ALL)
def test_an_action_left_out_is_the_last_one_of_any_lamp(bench: EmulatedRobot) -> None:
    assert bench.send(b"L,2,1\rB\rF\r") == b"l\r\nb\r\nf\r\n"
    assert (bench.hardware["body"], bench.hardware["front"]) == (1, 1)
    bench.send(b"F,0\rB\r")
    assert (bench.hardware["body"], bench.hardware["front"]) == (0, 0)


@pytest.mark.parametrize("firmware", ALL)
def test_text_and_binary_speeds_share_their_variables(bench: EmulatedRobot) -> None:
    bench.send(b"\xbc\x0a\x00\x14\x00\x00")
    assert bench.send(b"D,77\rE\r") == b"d\r\ne,77,20\r\n"


@pytest.mark.parametrize("firmware", ALL)
def test_stop_changes_the_motors_but_not_what_was_asked(bench: EmulatedRobot) -> None:
    assert bench.send(b"D,300,-400\rS\rE\r") == b"d\r\ns\r\ne,300,-400\r\n"
    assert bench.hardware["speed"] == [0, 0]


@pytest.mark.parametrize("firmware", ALL)
def test_the_text_and_the_binary_answer_agree(bench: EmulatedRobot) -> None:
    bench.send(b"P,-300,1234\r")
    assert words(bench.send(b"\xaf\x00")) == numbers(bench.send(b"Q\r")) == [-300, 1234]
    assert words(bench.send(b"\xb1\x00")) == numbers(bench.send(b"O\r"))


@pytest.mark.parametrize("firmware", ALL)
def test_a_chain_answers_in_order_and_only_at_its_zero(bench: EmulatedRobot) -> None:
    light, steps = bench.send(b"\xb1\x00"), bench.send(b"\xaf\x00")
    assert bench.send(b"\xb1\xaf") == b""
    assert bench.send(b"\xb1\x00") == light + steps + light


@pytest.mark.parametrize("firmware", ALL)
def test_a_reading_is_taken_when_its_opcode_comes_not_when_it_is_sent(bench: EmulatedRobot) -> None:
    before = bench.send(b"\xb1\x00")
    bench.send(b"\xb1")
    bench.set(light=[1] * 10)
    assert bench.send(b"\xb1\x00") == before + struct.pack("<8h", *[1] * 8)


@pytest.mark.parametrize("firmware", ALL)
def test_what_follows_a_zero_is_a_new_frame_or_a_line(bench: EmulatedRobot) -> None:
    steps = bench.send(b"\xaf\x00")
    assert bench.send(b"\xaf\x00\xaf\x00C\r\xaf\x00") == steps + steps + b"c,3\r\n" + steps


@pytest.mark.parametrize("firmware", ALL)
def test_proximity_offsets_are_the_mean_of_the_calibration(firmware: str) -> None:
    bench = EmulatedRobot(firmware, {"prox": [50] * 10})
    bench.send(b"K\r")
    bench.set(prox=[80] * 10)
    assert numbers(bench.send(b"N\r")) == [30] * 8


@pytest.mark.parametrize("firmware", ["btcom-1.1.3", "asercom-1.2.2", "epuck2"])
def test_calibration_leaves_the_ring_dark(bench: EmulatedRobot) -> None:
    bench.send(b"L,8,1\rB,1\rK\r")
    assert set(bench.hardware["led"]) == {0}
    assert bench.hardware["body"] == 1


def test_btcom_2_leaves_the_ring_alone_while_it_calibrates() -> None:
    bench = EmulatedRobot("btcom-2.0")
    bench.send(b"L,8,1\rK\r")
    assert bench.hardware["led"] == [1] * 8


@pytest.mark.parametrize("firmware", ALL)
def test_the_remote_controls_last_code_is_reported_in_hexadecimal(bench: EmulatedRobot) -> None:
    bench.set(ir_check=1, ir_address=31, ir_data=63)
    assert bench.send(b"G\r") == b"g IR check : 0x1, address : 0x1f, data : 0x3f\r\n"


@pytest.mark.parametrize("firmware", E_PUCK1)
def test_a_key_acts_only_between_commands_and_only_once(bench: EmulatedRobot) -> None:
    bench.send(b"\xaf")
    bench.set(ir_data=2)
    assert bench.hardware["speed"] == [0, 0]
    bench.send(b"\x00")
    assert bench.hardware["speed"] == [600, 600]
    bench.send(b"S\r")
    bench.set(ir_data=2)
    assert bench.hardware["speed"] == [0, 0]


@pytest.mark.parametrize("firmware", E_PUCK1)
def test_key_0_plays_a_sound_and_sets_the_asked_speeds_again(bench: EmulatedRobot) -> None:
    bench.set(ir_data=4)
    bench.send(b"S\r")
    bench.set(ir_data=0)
    assert bench.hardware["speed"] == [-600, 600]
    assert bench.hardware["sound"] == 5


@pytest.mark.parametrize("firmware", E_PUCK1)
def test_a_reset_forgets_everything_but_the_number_of_resets(bench: EmulatedRobot) -> None:
    bench.send(b"D,100,100\rP,5,5\rL,8,1\rT,1\rJ,0,20,20,8\r")
    assert bench.send(b"R\r").startswith(b"r\r")
    assert bench.send(b"E\rQ\rI\r") == b"e,0,0\r\nq,0,0\r\ni,1,40,40,8,3200\r\n"
    assert (bench.hardware["resets"], bench.hardware["led"], bench.hardware["speed"]) == (2, [0] * 8, [0, 0])


@pytest.mark.parametrize("firmware", E_PUCK1)
def test_integers_of_the_e_puck1_have_16_bits(bench: EmulatedRobot) -> None:
    assert bench.send(b"D,65535,-32769\rE\r") == b"d\r\ne,-1,32767\r\n"
    assert bench.send(b"B,65537\r") == b"b\r\n"
    assert bench.hardware["body"] == 1


@pytest.mark.parametrize("firmware", E_PUCK1)
def test_a_sound_after_a_camera_set_up_is_silent_until_the_amplifier_starts_again(firmware: str) -> None:
    hardware = FixedHardware()
    program = FIRMWARES[firmware](hardware, LINE_ONLY)
    list(program.boot(ProgramMemory(), cold=True))
    heard = []
    for line in (b"T,2\r", b"J\r", b"T,2\r", b"T,0\r", b"T,2\r"):
        reply = program.line(line)
        list(reply)
        heard.append(hardware.sound)
    assert heard == [2, 0, 0, 0, 2]


@pytest.mark.parametrize("firmware", E_PUCK1)
def test_the_sample_dump_leaves_before_the_frame_ends(bench: EmulatedRobot) -> None:
    dump = bench.send(b"\xb1\xab")
    assert len(dump) == 600
    rings = [words(dump)[first : first + 100] for first in (0, 100, 200)]
    assert [max(ring) - min(ring) for ring in rings] == numbers(bench.send(b"\0U\r")[17:])
    assert bench.send(b"\xab\0")[600:] == bytes([42])


@pytest.mark.parametrize("firmware", ALL)
def test_every_robot_survives_odd_arguments_to_every_command(firmware: str) -> None:
    bench = EmulatedRobot(firmware, {"motor_time": "frozen"})
    program = FIRMWARES[firmware]
    for code, length in program.LENGTHS.items():
        if code != IMAGE:
            bench.send(bytes((code,)) + bytes(range(200, 200 + length)) + b"\0")
    for letter in program.TEXT:
        bench.send(bytes((letter,)) + b",-1,99999,x\r")
    assert bench.send(b"C\r") == b"c,3\r\n"


def test_a_connection_is_told_every_length() -> None:
    lengths = FIRMWARES["epuck2"](FixedHardware(firmware="epuck2"), LINE_ONLY).LENGTHS
    assert (lengths[0xF7], lengths[0xF6], lengths[0xA7], lengths[0x89], lengths[0xB2]) == (19, 12, 2, 35, 0)
    assert RobotConnection(lengths).is_between_commands


def test_every_firmware_that_the_host_knows_is_emulated() -> None:
    assert {*FIRMWARES, *WIFI_FIRMWARES} == set(profiles.FIRMWARES)
