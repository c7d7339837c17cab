"""How the emulated ESP32 streams: which packets, in which order and when, and which commands it adopts."""

from __future__ import annotations

from itertools import pairwise

import pytest
from wifi_rig import Rig, command, packets

from elib.simulator.emulator.fixed_hardware import FixedHardware
from elib.simulator.emulator.wifi import STEP, WifiEmulator


def wheels(rig: Rig) -> object:
    """Return the speeds that the main processor was given last."""
    return rig.robot.firmware.report()["speed"]


# -- what is sent --


def test_the_robot_is_silent_until_a_valid_command() -> None:
    rig = Rig()
    assert rig.ids(5.0) == []
    rig.send(command(2))
    assert set(rig.ids(1.0)) == {2}


def test_it_streams_on_with_the_last_command() -> None:
    rig = Rig()
    rig.send(command(0))
    assert set(rig.ids(3.0)) == {3}
    rig.send(command(2))
    rig.ids(0.05)
    assert set(rig.ids(3.0)) == {2}


def test_a_picture_comes_before_the_sensors() -> None:
    rig = Rig()
    rig.send(command(3))
    ids = rig.ids(2.0)
    assert ids[:6] == [1, 2] * 3
    rig.send(command(1))
    rig.ids(0.2)
    assert set(rig.ids(1.0)) == {1}


def test_other_request_bits_alone_send_nothing_and_move_nothing() -> None:
    rig = Rig()
    rig.send(command(4, left=300, right=300))
    assert rig.ids(2.0) == []
    assert wheels(rig) == [0, 0]
    rig.send(command(6, left=300, right=300))
    assert set(rig.ids(0.5)) == {2}
    assert wheels(rig) == [300, 300]


def test_a_marker_and_a_request_give_one_empty_packet_and_then_readings_of_afterwards() -> None:
    rig = Rig()
    rig.send(command(2))
    rig.ids(1.0)
    rig.hardware.set(tof=777)
    rig.send(command(0) + command(2))
    found = rig.packets(0.2)
    first = next(index for index, packet in enumerate(found) if packet == b"\x03")
    assert found.count(b"\x03") == 1
    assert found[first + 1][70:72] == (777).to_bytes(2, "little")


# -- which commands are adopted --


def test_one_command_is_adopted_in_each_cycle() -> None:
    rig = Rig()
    for request in (0, 2, 0, 2):
        rig.send(command(request))
    assert rig.ids(0.2)[:6] == [3, 2, 3, 2, 2, 2]


def test_of_five_waiting_commands_only_the_newest_is_adopted() -> None:
    rig = Rig()
    rig.send(command(0) * 4 + command(2))
    assert set(rig.ids(0.2)) == {2}


def test_of_four_waiting_commands_none_is_thrown_away() -> None:
    rig = Rig()
    rig.send(command(0) * 3 + command(2))
    assert rig.ids(0.2)[:4] == [3, 3, 3, 2]


@pytest.mark.parametrize("part", [1, 10, 20])
def test_behind_five_whole_commands_the_one_that_has_begun_is_waited_for(part: int) -> None:
    rig = Rig()
    rig.send(command(0))
    rig.ids(0.1)
    rig.send(command(0) * 5 + command(2, left=100)[:part])
    assert len(rig.ids(1.0)) <= 1  # it blocks in its read, and streams nothing meanwhile
    rig.send(command(2, left=100)[part:])
    assert set(rig.ids(0.2)) == {2}
    assert wheels(rig) == [100, 0]


@pytest.mark.parametrize("part", [1, 2, 3, 7, 19, 20])
def test_a_torn_command_stops_the_stream_until_its_rest_comes(part: int) -> None:
    rig = Rig()
    rig.send(command(2))
    rig.ids(1.0)
    rig.send(command(2, left=200, right=-200)[:part])
    assert len(rig.ids(2.0)) <= 1
    assert wheels(rig) == [0, 0]
    rig.send(command(2, left=200, right=-200)[part:])
    assert len(rig.ids(1.0)) >= 45
    assert wheels(rig) == [200, -200]


def test_a_torn_first_command_does_not_begin_the_stream() -> None:
    # The rest is taken without a look at its beginning, so nothing valid has come yet (wire-protocol.md, 4.2).
    rig = Rig()
    rig.send(command(2)[:10])
    rig.run(0.1)
    rig.send(command(2)[10:])
    assert rig.ids(1.0) == []
    rig.send(command(2))
    assert len(rig.ids(1.0)) >= 45


def test_a_block_with_a_wrong_first_byte_is_adopted_when_something_else_comes() -> None:
    rig = Rig()
    wrong = b"\x7f" + command(0, left=250, right=250)[1:]
    rig.send(wrong)
    assert rig.ids(0.5) == []
    assert wheels(rig) == [0, 0]
    rig.send(command(2))
    assert set(rig.ids(0.2)) == {2}
    rig.send(wrong)
    assert len(rig.ids(1.0)) <= 1  # it blocks in its read
    assert wheels(rig) == [0, 0]
    rig.send(command(2, left=250, right=250))
    assert rig.ids(0.2)[:3] == [3, 2, 2]
    assert wheels(rig) == [250, 250]


def test_a_lost_byte_shifts_all_that_follows() -> None:
    rig = Rig()
    rig.send(command(2))
    rig.ids(0.2)
    rig.send(command(2, left=100)[1:] + command(2, left=100))
    rig.ids(0.2)
    # 21 bytes from the second one on: the request byte is the flags' 00, the speeds begin one byte late.
    assert wheels(rig) != [100, 0]


# -- what repeats --


def test_set_steps_acts_again_in_every_cycle_until_its_bit_is_cleared() -> None:
    rig = Rig()
    rig.send(command(2, left=1000, right=1000))
    rig.run(0.1)
    rig.send(command(2, flags=4, left=7, right=-7))
    rig.run(0.2)
    counts = {packet[80:84] for packet in rig.packets(2.0)}
    assert len(counts) <= 30  # the wheels turn, but the counters begin anew 50 times a second
    assert max(int.from_bytes(count[:2], "little", signed=True) for count in counts) < 7 + 50
    rig.send(command(2, left=1000, right=1000))
    last = rig.packets(2.0)[-1]
    assert int.from_bytes(last[80:82], "little", signed=True) > 1500


def test_a_sound_begins_again_in_every_cycle_until_its_bit_is_cleared(monkeypatch: pytest.MonkeyPatch) -> None:
    rig, played = Rig(), []
    monkeypatch.setattr(rig.hardware, "play_sound", played.append)
    rig.send(command(2, sound=1) + command(2))
    rig.run(1.0)
    assert played == [1]
    rig.send(command(2, sound=2))
    rig.run(1.0)
    assert played.count(2) >= 45


def test_a_calibration_stops_the_stream_and_one_left_on_never_ends() -> None:
    rig = Rig()
    rig.send(command(2))
    rig.run(1.0)
    rig.send(command(2, flags=1) + command(2))
    times = [time for time, _ in rig.run(6.0)]
    (gap,) = (later - earlier for earlier, later in pairwise(times) if later - earlier > 0.5)
    assert 2.0 < gap < 2.3  # the answer comes too late, twice, and a second of pause follows each time
    rig.send(command(2, flags=1))
    rig.run(5.0)
    assert len(rig.ids(10.0)) < 20


def test_the_wheels_keep_turning_when_the_client_leaves() -> None:
    rig = Rig()
    rig.send(command(2, left=400, right=400))
    rig.run(0.2)
    rig.robot.disconnect(rig.now)
    rig.run(5.0)
    assert wheels(rig) == [400, 400]


# -- when --


def test_sensors_come_fifty_times_a_second() -> None:
    rig = Rig()
    rig.send(command(2))
    times = [time for time, _ in rig.run(10.0)]
    assert 45 * 10 <= len(times) <= 50 * 10
    assert min(later - earlier for earlier, later in pairwise(times)) >= 2 * STEP - 1e-9


def test_an_exchange_with_the_main_processor_takes_its_bytes_and_a_silence() -> None:
    rig = Rig()
    rig.send(command(2))
    rig.run(1.0)
    # The exchange begins when a packet is sent, and the readings of now are in its answer.
    sent = rig.run(2 * STEP + 0.001)[-1][0]
    rig.run(sent + 22 * 10 / 115_200 + 0.0001 - rig.now)
    rig.hardware.set(tof=1)  # too late: the main processor has read its sensors
    first, second = rig.packets(4 * STEP)[:2]
    assert (first[70], second[70]) == (123, 1)


def test_pictures_and_sensors_come_within_the_time_of_capture_and_transfer() -> None:
    rig = Rig()
    rig.send(command(3))
    ids = rig.ids(10.0)
    assert ids.count(1) / 10 == pytest.approx(1 / 0.137, rel=0.03)  # measured-robots: latency.wifi_picture
    assert abs(ids.count(1) - ids.count(2)) <= 1


def test_pictures_do_not_take_the_line_of_the_readings() -> None:
    rig = Rig()
    rig.send(command(1))
    pictures = rig.ids(5.0).count(1)
    assert pictures * 38_400 > 5.0 * 11_520  # more than the serial line carries


def test_the_first_packet_is_older_than_the_client() -> None:
    rig = Rig()
    rig.hardware.set(tof=500)
    rig.send(command(2))
    first, second = rig.packets(0.2)[:2]
    assert first[70:72] == (123).to_bytes(2, "little")  # fetched when the robot was switched on
    assert second[70:72] == (500).to_bytes(2, "little")


def test_the_first_picture_may_be_older_than_the_command_that_asks_for_it_but_not_the_second() -> None:
    rig, old = Rig(), 0
    for moment in range(20):
        rig.hardware.set(shift=0)
        rig.send(command(3))
        rig.run(0.3)
        rig.send(command(2))
        rig.run(0.3 + 0.0072 * moment)  # over a whole period of the camera
        rig.hardware.set(shift=9)
        rig.send(command(0) + command(3))
        found = rig.packets(0.5)
        marker = found.index(b"\x03")
        first, second = [packet for packet in found[marker:] if packet[0] == 1][:2]
        old += first[1:3] == b"\x00\x00"
        assert second[1:3] == b"\x01\x29"  # row 9 of the pattern: green 9, blue 9
    assert 1 <= old < 10


# -- a client that reads slowly --


def test_a_client_that_does_not_read_stops_the_robot_when_its_send_buffer_is_full() -> None:
    rig = Rig(reads=False)
    rig.send(command(2))
    sent = sum(len(data) for _, data in rig.run(20.0))
    assert sent == 5744
    rig.robot.acknowledge(1000, rig.now)
    assert sum(len(data) for _, data in rig.run(5.0)) == 1000
    rig.reads = True
    rig.robot.acknowledge(5744, rig.now)
    assert sum(len(data) for _, data in rig.run(1.0)) >= 45 * 105


def test_commands_of_a_client_that_does_not_read_wait() -> None:
    rig = Rig(reads=False)
    rig.send(command(2))
    rig.run(20.0)
    rig.send(command(2, left=100, right=100))
    rig.run(5.0)
    assert wheels(rig) == [0, 0]  # the task that reads them waits for room


def test_a_picture_passes_in_pieces_of_the_send_buffer() -> None:
    rig = Rig(reads=False)
    rig.send(command(1))
    found = bytearray()
    while len(found) < 38_401:
        piece = b"".join(data for _, data in rig.run(0.3))
        assert 0 < len(piece) <= 5744
        found += piece
        rig.robot.acknowledge(len(piece), rig.now)
    assert packets(bytes(found[:38_401]))[0][0] == 1


# -- clients come and go --


def test_the_next_client_is_served_when_the_first_has_left() -> None:
    rig = Rig()
    rig.send(command(2))
    rig.run(0.5)
    rig.robot.disconnect(rig.now)
    rig.robot.connect(rig.now)
    assert rig.ids(1.0) == []
    rig.send(command(0))
    assert set(rig.ids(0.5)) == {3}


def test_after_a_client_that_never_sent_a_command_no_other_is_served() -> None:
    rig = Rig()
    rig.run(1.0)
    rig.robot.disconnect(rig.now)
    rig.run(0.1)
    assert rig.robot.is_stuck
    rig.robot.connect(rig.now)
    rig.send(command(2))
    assert rig.ids(5.0) == []
    rig.robot.power_cycle(rig.now)
    rig.run(10.0)
    rig.robot.connect(rig.now)
    rig.send(command(2))
    assert set(rig.ids(0.5)) == {2}
    assert not rig.robot.is_stuck


def test_a_connection_that_breaks_before_a_command_does_not_make_the_robot_stuck() -> None:
    rig = Rig()
    rig.run(1.0)
    rig.robot.disconnect(rig.now, reset=True)
    rig.robot.connect(rig.now)
    rig.send(command(2))
    assert set(rig.ids(0.5)) == {2}


def test_a_client_that_only_stops_sending_is_served_on() -> None:
    rig = Rig()
    rig.send(command(2, left=50))
    rig.run(0.5)
    rig.robot.end_of_input(rig.now)
    assert len(rig.ids(2.0)) >= 90
    assert wheels(rig) == [50, 0]


# -- its state --


def test_led2_is_green_while_it_waits_and_flashes_blue_while_it_sends() -> None:
    rig = Rig()
    assert rig.hardware.lights.rgb[:3] == [0, 100, 0]
    rig.send(command(2))
    seen = set()
    for _ in range(100):
        rig.run(0.003)
        seen.add(tuple(rig.hardware.lights.rgb[:3]))
    assert seen == {(0, 100, 0), (0, 0, 100), (0, 0, 0)}
    rig.robot.disconnect(rig.now)
    rig.run(0.2)
    assert rig.hardware.lights.rgb[:3] == [0, 100, 0]


@pytest.mark.parametrize(
    ("selector", "sensors", "pictures"), [(15, True, True), (3, True, False), (8, False, False), (0, False, False)]
)
def test_at_another_selector_position_the_main_processor_does_not_answer(
    selector: int, *, sensors: bool, pictures: bool
) -> None:
    rig = Rig({"selector": selector})
    rig.send(command(2))
    assert (2 in rig.ids(3.0)) == sensors
    other = Rig({"selector": selector})
    other.send(command(3))
    assert (1 in other.ids(3.0)) == pictures


def test_a_robot_that_was_switched_on_listens_after_some_seconds() -> None:
    robot = WifiEmulator("epuck2-wifi", FixedHardware(firmware="epuck2-wifi"))
    robot.connect(0.0)
    robot.receive(command(2), 0.0)
    assert robot.advance(2.0) == []
    sent = b""
    while len(sent) < 105:
        due = robot.due
        assert due is not None
        assert due < 15
        sent += b"".join(chunk.data for chunk in robot.advance(due))
    assert sent[0] == 2


def test_a_robot_that_is_switched_off_says_nothing() -> None:
    rig = Rig()
    rig.send(command(2, left=100))
    rig.run(0.5)
    rig.robot.switch_off(rig.now)
    assert rig.ids(5.0) == []
    assert rig.hardware.rates == (0, 0)


def test_the_camera_is_set_for_wifi_and_the_magnetometer_is_on() -> None:
    rig = Rig()
    window = rig.robot.firmware.window
    assert (window.mode, window.width, window.height, window.zoom, window.x, window.y) == (1, 160, 120, 4, 0, 0)
    assert rig.robot.firmware.report()["mag_on"] == 1
