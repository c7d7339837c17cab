"""Captures of a Wi-Fi link become lines: a command each, a packet each, and every byte in one of them."""

from pathlib import Path

import pytest

import elib
from elib.cli import main
from elib.link.protocol.values import Sensors
from elib.records.decoding import FAULTS, Kind, Line, WifiDecoder, decoder_of, is_wifi
from wifi_robot import sensor_payload

MARKER = bytes.fromhex("80 00 00 f401 0cfe 11 000000 000000 000000 000000 00")
STREAM = bytes.fromhex("80 02 00 f401 0cfe 11 000000 000000 000000 000000 00")
PACKET = b"\x02" + bytes(sensor_payload(1234))
PICTURE = b"\x01" + bytes(38400)


def decoded(*pieces: tuple[str, bytes]) -> list[Line]:
    decoder = WifiDecoder()
    lines = [line for way, data in pieces for line in decoder.feed(way, 1.0, data)]  # type: ignore[arg-type]
    return lines + decoder.flush()


def test_a_pair_of_commands_names_the_calls_that_it_makes_and_the_packets_what_they_hold() -> None:
    lines = decoded(("to robot", MARKER + STREAM), ("to host", PACKET + b"\x03\x03" + PACKET + PICTURE))
    assert [str(call) for call in lines[0].calls] == [
        "marker()",
        "set_speed(left=0.5 rev/s, right=-0.5 rev/s)",
        "set_led(n=0, action=ON)",
        "set_body_led(action=ON)",
    ]
    assert [str(call) for call in lines[1].calls] == ["stream(sensors=1)"]
    assert [(line.kind, line.name) for line in lines[2:]] == [
        (Kind.ANSWER, "sensors"),
        (Kind.ANSWER, "marker"),
        (Kind.FILLER, "the marker again"),
        (Kind.ANSWER, "sensors"),
        (Kind.ANSWER, "image"),
    ]
    value = lines[2].value
    assert isinstance(value, Sensors)
    assert value.ambient_light is not None
    assert value.ambient_light[0] == 1234


@pytest.mark.parametrize(
    ("command", "calls"),
    [
        ("80 00 01 0000 0000 00 000000 000000 000000 000000 00", ["marker()", "calibrate_proximity()"]),
        (
            "80 00 04 e803 feff 00 000000 000000 000000 000000 00",
            ["marker()", "set_encoders(left=1000 steps, right=-2 steps)"],
        ),
        ("80 03 02 0000 0000 00 000000 000000 000000 000000 00", None),
        ("80 00 00 0000 0000 00 000000 643200 000000 000000 20", None),
    ],
)
def test_what_acts_once_and_what_changes_is_named(command: str, calls: list[str] | None) -> None:
    (line,) = decoded(("to robot", bytes.fromhex(command)))
    said = [str(call) for call in line.calls]
    if calls is not None:
        assert said == calls
    elif "643200" in command:
        assert said[1].startswith("set_rgb_led(n=3, red=1, green=0.5, blue=0")
        assert said[2] == "play_sound(n=6)"
    else:
        assert said == ["stream(images=1, sensors=1)", "set_obstacle_avoidance(on=ON)"]


def test_setting_the_steps_is_not_taken_for_a_speed() -> None:
    steps = bytes.fromhex("80 00 04 e803 feff 00 000000 000000 000000 000000 00")
    after = bytes.fromhex("80 02 00 0000 0000 00 000000 000000 000000 000000 00")
    lines = decoded(("to robot", steps + after))
    assert [len(line.calls) for line in lines] == [2, 1]


def test_any_cut_gives_the_same_lines() -> None:
    def told(lines: list[Line]) -> list[tuple[object, ...]]:
        return [(line.direction, line.data, line.kind, line.name, line.calls) for line in lines]

    stream = b"\x03" + PACKET + b"\x03" + PACKET
    whole = decoded(("to robot", MARKER + STREAM), ("to host", stream))
    for cut in range(1, 150, 7):
        pieces = [("to robot", MARKER + STREAM), ("to host", stream[:cut]), ("to host", stream[cut:])]
        assert told(decoded(*pieces)) == told(whole), cut


def test_every_byte_is_in_one_line_also_where_the_stream_is_out_of_step() -> None:
    lines = decoded(("to host", PACKET + b"garbage" + PACKET[:50] + PACKET + PACKET + b"\x02half"))
    assert b"".join(line.data for line in lines) == PACKET + b"garbage" + PACKET[:50] + PACKET + PACKET + b"\x02half"
    assert lines[-1].kind is Kind.HALF
    assert lines[1].kind is Kind.UNKNOWN
    assert sum(line.kind is Kind.ANSWER for line in lines) >= 2
    (line,) = decoded(("to robot", b"V\r"))
    assert line.kind is Kind.HALF


def test_an_empty_packet_that_nothing_asked_for_is_a_fault() -> None:
    lines = decoded(("to robot", STREAM), ("to host", b"\x03"))
    assert lines[-1].kind is Kind.SURPLUS


def test_a_capture_of_wifi_is_told_from_one_of_a_serial_line() -> None:
    assert is_wifi([(None, "to robot", MARKER + STREAM)])
    assert is_wifi([(None, "to host", PACKET + PACKET)])
    assert not is_wifi([(None, "to robot", b"V\r")])
    assert not is_wifi([(None, "to host", b"v,Version 1.2.2\r\n")])
    assert not is_wifi([(None, "to robot", bytes(36) + b"\rV\r"), (None, "to host", PACKET)])
    assert not is_wifi([])
    assert type(decoder_of("epuck2-wifi")) is type(decoder_of(assumed="epuck2-wifi")) is WifiDecoder


def test_a_recording_of_a_robot_on_wifi_is_decoded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "run.mcap"
    with elib.connect("sim://arena?firmware=epuck2-wifi&speed=max") as robot:
        robot.record(path)
        robot.set_speed(0.5, 0.25)
        robot.image()
    assert main(["decode", str(path)]) == 0
    said = capsys.readouterr()
    assert "marker() + set_speed(left=0.5 rev/s, right=0.25 rev/s)" in said.out
    assert "image: 160x120 colour, 38400 bytes" in said.out
    assert "nothing wrong; epuck2-wifi, by its packets" in said.err
    assert FAULTS
