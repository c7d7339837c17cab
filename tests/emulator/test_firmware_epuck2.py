"""What is particular to the e-puck2."""

import struct

import pytest

from elib.testing import EmulatedRobot

RGB_OFF = [0] * 12


@pytest.fixture
def bench() -> EmulatedRobot:
    return EmulatedRobot("epuck2")


def actuators(
    flags: int = 0, left: int = 0, right: int = 0, lamps: int = 0, rgb: bytes = bytes(12), sounds: int = 0
) -> bytes:
    return b"\xf7" + struct.pack("<BhhB12sB", flags, left, right, lamps, rgb, sounds)


def test_text_keeps_32_bits_and_the_motors_get_16(bench: EmulatedRobot) -> None:
    assert bench.send(b"D,40000,70000\rE\r") == b"d\r\ne,40000,70000\r\n"
    assert bench.hardware["speed"] == [-1100, 1100]


def test_negative_binary_numbers_look_large_in_text(bench: EmulatedRobot) -> None:
    bench.send(b"\xbc\x9c\xff\x64\x00\xb0\x9c\xff\x01\x00\0")
    assert bench.send(b"E\rQ\r") == b"e,65436,100\r\nq,65436,1\r\n"
    assert bench.hardware["speed"] == [-100, 100]
    assert bench.send(b"\xaf\0") == b"\x9c\xff\x01\x00"


def test_reset_does_nothing_at_all(bench: EmulatedRobot) -> None:
    assert bench.send(b"D,5,6\rR\rE\r") == b"d\r\ne,5,6\r\n"
    assert bench.hardware["resets"] == 0


def test_rgb_leds_toggle_their_red_and_are_reset_by_on_and_off(bench: EmulatedRobot) -> None:
    bench.send(b"\xf6" + bytes([1, 2, 3] + [0] * 9) + b"\0")
    bench.send(b"L,1,2\r")
    assert bench.hardware["rgb"] == [0, 2, 3] + [0] * 9
    bench.send(b"L,1,2\r")
    assert bench.hardware["rgb"] == [10, 2, 3] + [0] * 9
    bench.send(b"L,1,1\r")
    assert bench.hardware["rgb"] == [10, 0, 0] + [0] * 9


def test_a_colour_over_100_percent_is_left_as_it_is(bench: EmulatedRobot) -> None:
    bench.send(b"\xf6" + bytes([50, 100, 0] * 4) + b"\0")
    bench.send(b"\xf6" + bytes([101, 20, 255] * 4) + b"\0")
    assert bench.hardware["rgb"] == [50, 20, 0] * 4


def test_all_leds_toggle_each_by_itself(bench: EmulatedRobot) -> None:
    bench.send(b"L,0,1\rL,3,1\rL,8,2\r")
    assert bench.hardware["led"] == [0, 1, 1, 1]
    assert bench.hardware["rgb"] == [10, 0, 0, 0, 0, 0, 10, 0, 0, 10, 0, 0]


def test_the_actuator_packet_sets_everything(bench: EmulatedRobot) -> None:
    assert bench.send(actuators(0, 100, -200, 0b11_0110, bytes(range(12)), 0x08) + b"\0") == b""
    hardware = bench.hardware
    assert (hardware["speed"], hardware["led"]) == ([100, -200], [0, 1, 1, 0])
    assert (hardware["body"], hardware["front"], hardware["rgb"]) == (1, 1, list(range(12)))
    assert hardware["sound"] == 4
    assert bench.send(b"E\r") == b"e,100,65336\r\n"


def test_the_actuator_packet_sets_steps_instead_of_speeds_but_remembers_them_as_speeds(bench: EmulatedRobot) -> None:
    bench.send(b"D,50,60\r" + actuators(4, 7, -7) + b"\0")
    assert (bench.hardware["speed"], bench.hardware["steps"]) == ([50, 60], [7, 65529])
    assert bench.send(b"E\r") == b"e,7,65529\r\n"


def test_the_actuator_packet_calibrates(bench: EmulatedRobot) -> None:
    bench.send(actuators(1) + b"\0")
    assert bench.send(b"N\r") == b"n,0,0,0,0,0,0,0,0\r\n"


def test_actuators_and_sensors_go_in_one_frame(bench: EmulatedRobot) -> None:
    packet = bench.send(actuators(4, 300, 400) + b"\xf8\0")
    assert len(packet) == 103
    assert struct.unpack_from("<2h", packet, 79) == (300, 400)


def test_the_sensor_packet_is_laid_out_as_on_the_radio(bench: EmulatedRobot) -> None:
    bench.set(sd=1, temp=-4, tof=1500, ir_check=1, ir_address=7, ir_data=9, mag=[10.0, -0.5, 2.25], selector=5)
    bench.set(gyro=[22, -44, 666], prox=[200, 180, 160, 140, 120, 100, 80, 60])  # at the start it read half of it
    packet = bench.send(b"\xf8\0")
    assert struct.unpack_from("<3h", packet, 0) == (0, 0, 768)
    assert struct.unpack_from("<3h", packet, 18) == (22, 11, 333)
    assert struct.unpack_from("<3f", packet, 24) == (10.0, -0.5, 2.25)
    assert struct.unpack_from("<b8H8HH", packet, 36)[0] == -4
    assert struct.unpack_from("<8H", packet, 37) == (100, 90, 80, 70, 60, 50, 40, 30)
    assert struct.unpack_from("<H4H", packet, 69) == (1500, 30, 40, 50, 60)
    assert struct.unpack_from("<H6B", packet, 83) == (2400, 1, 1, 7, 9, 5, 1001 & 0xFF)
    assert struct.unpack_from("<6HB", packet, 90) == (1001, 1002, 1003, 11, 12, 13, 0)


def test_obstacle_avoidance_makes_speeds_a_target(bench: EmulatedRobot) -> None:
    bench.send(actuators(0, 100, 100) + actuators(2, 300, 200) + b"\0")
    assert (bench.hardware["oa"], bench.hardware["oa_target"]) == (1, [300, 200])
    assert bench.hardware["speed"] == [100, 100]
    bench.send(b"D,400,400\rS\r")
    assert bench.hardware["oa_target"] == [0, 0]
    bench.send(actuators(0, 50, 60) + b"\0")
    assert (bench.hardware["oa"], bench.hardware["speed"]) == (0, [50, 60])


@pytest.mark.parametrize(
    ("frame", "key", "value"),
    [
        (b"\xf1\x01\0", "mag_on", 1),
        (b"\xf1\x02\0", "mag_on", 0),
        (b"\xf0\x02\0", "prox_mode", 2),
        (b"\xef\0\0", "tof_on", 0),
    ],
)
def test_switches_answer_one_zero(bench: EmulatedRobot, frame: bytes, key: str, value: int) -> None:
    assert bench.send(frame) == b"\0"
    assert bench.hardware[key] == value


def test_the_small_sensors_answer_alone_or_in_a_chain(bench: EmulatedRobot) -> None:
    bench.set(button=1, sd=1, tof=8190)
    assert bench.send(b"\xf5\xf2\xf3\0") == b"\x01\x01" + struct.pack("<H", 8190)
    assert bench.send(b"\xf4\0") == struct.pack("<4h", 30, 40, 50, 60)


def test_the_ground_module_must_have_been_there_at_the_start() -> None:
    late = EmulatedRobot("epuck2", {"floor_present": 0})
    late.set(floor_present=1)
    assert late.send(b"M\r\xb3\0") == b"m,0,0,0,0,0\r\n" + bytes(8)


def test_ground_values_are_unsigned_in_text_and_the_fifth_is_missing_in_binary(bench: EmulatedRobot) -> None:
    bench.set(floor=[65535, 1, 2, 3, 4])
    assert bench.send(b"M\r") == b"m,65535,1,2,3,4\r\n"
    assert bench.send(b"\xb3\0") == struct.pack("<4H", 65535, 1, 2, 3)


def test_gyroscope_and_accelerometer_are_turned_to_the_e_puck1s_axes(bench: EmulatedRobot) -> None:
    x, y, z = 11, -22, 333  # what it read at the start, and subtracts
    bench.set(gyro=[x + 100, y + 200, z + 300], acc13=[1600, 3200, -8000])
    assert bench.send(b"g\r") == b"g,-200,100,300\r\n"
    assert bench.send(b"A\r") == b"a,1973,2198,2423\r\n"


def test_the_robot_is_blind_to_what_stands_there_when_it_is_switched_on() -> None:
    near = [800, 90, 80, 70, 60, 50, 40, 30, 20, 10]
    bench = EmulatedRobot("epuck2", {"prox": near, "gyro": [11, -22, 333]})
    assert bench.send(b"N\r") == b"n,0,0,0,0,0,0,0,0\r\n"
    assert bench.send(b"\xb2\0") == bytes(16)
    assert bench.send(b"\xf8\0")[37:53] == bytes(16)
    assert bench.send(b"g\r") == b"g,0,0,0\r\n"
    bench.set(prox=[each + 5 for each in near], gyro=[11, -22, 334])
    assert bench.send(b"N\rg\r") == b"n,5,5,5,5,5,5,5,5\r\ng,0,0,1\r\n"


def test_over_wifi_too_the_sensors_are_calibrated_at_the_start() -> None:
    bench = EmulatedRobot("epuck2-wifi", {"prox": [800] * 10})
    bench.send(bytes([0x80, 2, *[0] * 19]))
    packet = bench.run(0.1)
    assert packet[0] == 2
    assert packet[38:54] == bytes(16)


@pytest.mark.parametrize(("raw", "percentage"), [(3440, 100), (3031, 37), (2785, 0), (2400, 0)])
def test_the_batterys_percentage_is_that_of_its_own_volts(bench: EmulatedRobot, raw: int, percentage: int) -> None:
    bench.set(battery_raw=raw)
    assert bench.send(b"b\r") == b"b,%d (%d%%)\r\n" % (raw, percentage)


def test_negative_reflections_do_not_exist_here(bench: EmulatedRobot) -> None:
    bench.set(prox=[-50] * 10)
    bench.send(b"K\r")
    bench.set(prox=[20] * 10)
    assert bench.send(b"N\r") == b"n,20,20,20,20,20,20,20,20\r\n"


def test_an_odd_address_is_the_even_one_below_it(bench: EmulatedRobot) -> None:
    assert bench.send(b"Y,221,0\r") == b"y,221,0\r\ny,128\r\n"
    assert bench.send(b"Y,193,0\r") == b"y,193,0\r\ny,3\r\n"
    assert bench.send(b"\xa7\xc1\x09\0") == b"\x0c"


def test_the_rgb_panel_command_leaves_its_numbers_behind_the_answer(bench: EmulatedRobot) -> None:
    numbers = bytes(range(1, 36))
    before = bench.send(b"\xb2\0")
    assert bench.send(b"\xb2\x89" + numbers + b"\xb7\xb7\0")[:16] == before
    assert bench.send(b"\x89" + numbers + b"\xb7\xb7\0")[3:35] == numbers[3:]


def test_registers_are_unsigned_and_the_scan_shows_every_address(bench: EmulatedRobot) -> None:
    assert bench.send(b"Y,220,0\r") == b"y,220,0\r\ny,128\r\n"
    lines = bench.send(b"Z\r").split(b"\r\n")
    assert (len(lines) - 1, lines[0], lines[95]) == (127, b"2: 0", b"192: 3")


def test_binary_register_reads_share_the_variables_of_the_text_ones(bench: EmulatedRobot) -> None:
    assert bench.send(b"\xa7\xdc\x01\0") == b"\x30"
    assert bench.send(b"Y\r") == b"y,220,1\r\ny,48\r\n"


def test_the_rgb_panel_command_spares_earlier_answers(bench: EmulatedRobot) -> None:
    assert bench.send(b"\xb1\x89" + bytes(35) + b"\0") == bench.send(b"\xb1\0")
