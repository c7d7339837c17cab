"""Every field of the packets over Wi-Fi, by hand from docs/reference/wire-protocol.md, 4, in both directions."""

import math
import struct

import pytest

from elib.base.errors import ArgumentError, RemoteProtocolError, Unsupported
from elib.link.protocol import values as v
from elib.link.protocol.commands import SPECS
from elib.link.protocol.connection import Answer, Refusal, ResyncAnswer, State
from elib.link.protocol.context import Context
from elib.link.protocol.profiles import EPUCK2_WIFI, FIRMWARES
from elib.link.protocol.table import Request
from elib.link.protocol.wifi import ALL_SENSORS, SENSORS, memory_of, packet_value, pair, stop_command
from elib.link.protocol.wifi_connection import OutOfStep, Streamed, WifiConnection

STANDING = bytes.fromhex("80 02 00 00000000 00 000000 000000 000000 000000 00")


def sent(name: str, *args: object, after: bytes = STANDING) -> tuple[str, str]:
    """Return both commands of a call as hexadecimal text, on a robot to which *after* was sent last."""
    data = SPECS[name].request(Context(EPUCK2_WIFI, sent=after), *args).data
    assert len(data) == 42
    return data[:21].hex(), data[21:].hex()


# -- commands ----------------------------------------------------------------------------------------------------------

COMMANDS = [
    # name, arguments, the marker and the command behind it
    ("proximity", (), "80 00 00 0000 0000 00 000000 000000 000000 000000 00", None),
    ("set_speed", (0.5, -0.25), "80 00 00 f401 06ff 00 000000 000000 000000 000000 00", None),
    ("set_speed", (1.1, -1.1), "80 00 00 4c04 b4fb 00 000000 000000 000000 000000 00", None),
    ("set_obstacle_avoidance", (1,), "80 00 02 0000 0000 00 000000 000000 000000 000000 00", None),
    (
        "calibrate_proximity",
        (),
        "80 00 01 0000 0000 00 000000 000000 000000 000000 00",
        "80 02 00 0000 0000 00 000000 000000 000000 000000 00",
    ),
    (
        "set_encoders",
        (1000, -2),
        "80 00 04 e803 feff 00 000000 000000 000000 000000 00",
        "80 02 00 0000 0000 00 000000 000000 000000 000000 00",
    ),
    ("set_led", (0, 1), "80 00 00 0000 0000 01 000000 000000 000000 000000 00", None),
    ("set_led", (2, 1), "80 00 00 0000 0000 02 000000 000000 000000 000000 00", None),
    ("set_led", (4, 1), "80 00 00 0000 0000 04 000000 000000 000000 000000 00", None),
    ("set_led", (6, 2), "80 00 00 0000 0000 08 000000 000000 000000 000000 00", None),
    ("set_led", (3, 1), "80 00 00 0000 0000 00 000000 0a0000 000000 000000 00", None),
    ("set_led", (8, 1), "80 00 00 0000 0000 0f 000000 0a0000 0a0000 0a0000 00", None),
    ("set_body_led", (1,), "80 00 00 0000 0000 10 000000 000000 000000 000000 00", None),
    ("set_front_led", (1,), "80 00 00 0000 0000 20 000000 000000 000000 000000 00", None),
    ("set_rgb_led", (3, 1.0, 0.5, 0.02), "80 00 00 0000 0000 00 000000 643202 000000 000000 00", None),
    ("set_rgb_led", (5, 0.01, 0, 1), "80 00 00 0000 0000 00 000000 000000 010064 000000 00", None),
    ("set_rgb_led", (7, 0, 1, 0), "80 00 00 0000 0000 00 000000 000000 000000 006400 00", None),
    *[
        (
            "play_sound",
            (number,),
            f"80 00 00 0000 0000 00 000000 000000 000000 000000 {bit}",
            "80 02 00 0000 0000 00 000000 000000 000000 000000 00",
        )
        for number, bit in ((1, "01"), (2, "02"), (3, "04"), (4, "08"), (5, "10"), (0, "20"), (6, "20"))
    ],
    (
        "image",
        (),
        "80 00 00 0000 0000 00 000000 000000 000000 000000 00",
        "80 03 00 0000 0000 00 000000 000000 000000 000000 00",
    ),
]


@pytest.mark.parametrize(("name", "args", "marker", "rest"), COMMANDS)
def test_a_call_is_these_two_commands(name: str, args: tuple[object, ...], marker: str, rest: str | None) -> None:
    marker = marker.replace(" ", "")
    assert sent(name, *args) == (marker, rest.replace(" ", "") if rest else marker[:2] + "02" + marker[4:])


EVERYTHING = bytes.fromhex("80 02 02 6400 9cff 3f 010203 040506 070809 0a0b0c 00")


def test_what_a_call_does_not_set_stays_as_it_was_sent_last() -> None:
    marker, rest = sent("set_body_led", 0, after=EVERYTHING)
    assert (marker, rest) == tuple(f"80{r}02" + "64009cff2f" + "0102030405060708090a0b0c00" for r in ("00", "02"))
    marker, rest = sent("set_encoders", 5, 6, after=EVERYTHING)
    assert marker[4:14] == "06" + "05000600"
    assert rest == EVERYTHING.hex()
    assert sent("play_sound", 1, after=EVERYTHING)[1] == EVERYTHING.hex()


def test_a_stop_ends_the_avoidance_and_darkens_the_ring_but_not_body_and_front() -> None:
    stopped = "000000000030" + "00" * 12 + "00"
    assert sent("stop", after=EVERYTHING) == (f"8000{stopped}", f"8002{stopped}")
    assert stop_command(EVERYTHING).hex() == f"8002{stopped}"
    streaming = b"\x80\x03" + EVERYTHING[2:]
    assert stop_command(streaming)[1] == 3


def test_the_actuators_of_a_command_are_read_back() -> None:
    memory = memory_of(EVERYTHING)
    assert memory.speed == (100, -100)
    assert memory.avoidance
    assert [memory.lamps[lamp] for lamp in (0, 2, 4, 6, 8, 9)] == [1] * 6
    assert memory.rgb == list(range(1, 13))


def test_the_ring_led_of_the_wifi_cannot_be_set() -> None:
    for name, args in (("set_led", (1, 1)), ("set_rgb_led", (1, 0.1, 0.1, 0.1))):
        with pytest.raises(Unsupported, match="ring LED 1 shows the state of the Wi-Fi"):
            sent(name, *args)
    assert memory_of(bytes.fromhex(sent("set_led", 8, 1)[0])).rgb[:3] == [0, 0, 0]


def test_step_counters_have_sixteen_bits() -> None:
    with pytest.raises(ArgumentError, match="32767"):
        sent("set_encoders", 40000, 0)


def test_every_row_is_either_there_or_absent_with_its_reason() -> None:
    there = {name for name, spec in SPECS.items() if spec.wifi is not None}
    assert there | EPUCK2_WIFI.absent.keys() == {*SPECS, "text"}
    assert not there & EPUCK2_WIFI.absent.keys()
    for name in EPUCK2_WIFI.absent.keys() - {"text"}:
        with pytest.raises(Unsupported, match=f"{name}\\(\\) does not exist on epuck2-wifi: "):
            SPECS[name].request(Context(EPUCK2_WIFI))
    assert list(FIRMWARES)[-1] == "epuck2-wifi"


# -- packets -----------------------------------------------------------------------------------------------------------

FIELDS = [
    # offset, bytes in hexadecimal, name of the reading, what it must be
    (0, "0100 feff 0003", "accelerometer", lambda r: (r.x, r.y, r.z) == (1, -2, 768) and r.g[2] == 1.0),
    (6, "0000803f", "attitude", lambda r: r.magnitude == 1.0),
    (10, "0000b442", "attitude", lambda r: r.orientation == pytest.approx(math.pi / 2)),
    (14, "00003443", "attitude", lambda r: r.inclination == pytest.approx(math.pi)),
    (18, "8300 7dff 0000", "gyroscope", lambda r: (r.x, r.y, r.z) == (131, -131, 0)),
    (24, "00004841 0000c8c1 00000000", "magnetometer", lambda r: (*r,) == pytest.approx((12.5e-6, -25e-6, 0))),
    (36, "fb", "temperature", lambda r: r.celsius == -5),
    *[(37 + 2 * i, "d204", "proximity", lambda r, i=i: r[i] == 1234 and sum(r) == 1234) for i in range(8)],
    *[(53 + 2 * i, "a00f", "ambient_light", lambda r, i=i: r[i] == 4000 and sum(r) == 4000) for i in range(8)],
    (69, "d007", "distance", lambda r: r.metres == 2.0),
    *[(71 + 2 * i, "ff0f", "microphones", lambda r, i=i: r[i] == 4095 and sum(r) == 4095) for i in range(4)],
    (79, "0080", "encoders", lambda r: (*r,) == (-32768, 0)),
    (81, "ff7f", "encoders", lambda r: (*r,) == (0, 32767)),
    (83, "700d", "battery", lambda r: r.raw == 3440 and r.volts == pytest.approx(4.2)),
    (85, "01", "sd_card", lambda r: r.present),
    (86, "01", "ir_receiver", lambda r: (*r,) == (1, 0, 0)),
    (87, "1f", "ir_receiver", lambda r: (*r,) == (0, 31, 0)),
    (88, "7f", "ir_receiver", lambda r: (*r,) == (0, 0, 127)),
    (89, "0f", "selector", lambda r: r.position == 15),
    (90, "0100 0200 0300", "ground", lambda r: tuple(r) == (1, 2, 3)),
    (102, "01", "button", lambda r: r.pressed),
]


@pytest.mark.parametrize(("offset", "data", "name", "holds"), FIELDS)
def test_a_field_of_the_sensor_packet_is_where_the_reference_says(
    offset: int, data: str, name: str, holds: object
) -> None:
    packet = bytearray(104)
    raw = bytes.fromhex(data)
    packet[offset : offset + len(raw)] = raw
    context = Context(EPUCK2_WIFI, time=2.5)
    readings = packet_value(SENSORS, packet, 0, context)
    reading = getattr(readings, name)
    assert callable(holds)
    assert holds(reading)
    assert (reading.time, reading.origin) == (2.5, "robot")
    for other in v.READING_TYPES.keys() - {name, "speed"}:
        assert getattr(readings, other) == getattr(packet_value(SENSORS, bytes(104), 0, context), other)
    # The row of the table gives the same.
    connection = opened()
    connection.send(SPECS[name].request(connection.context))
    connection.receive(b"\x03\x02" + packet, 2.5)
    event = connection.next_event()
    assert isinstance(event, Answer)
    assert event.value == reading


def test_every_reading_of_the_packet_is_tested_by_hand() -> None:
    assert {name for _, _, name, _ in FIELDS} == v.READING_TYPES.keys() - {"speed"}


def test_a_picture_is_160_by_120_in_colour_high_byte_first() -> None:
    connection = opened()
    connection.send(SPECS["image"].request(connection.context))
    pixels = bytearray(38400)
    pixels[0:2] = bytes.fromhex("f800")  # the first pixel of the first row is red
    pixels[2 * 160 : 2 * 160 + 2] = bytes.fromhex("07e0")  # the first one of the second row is green
    pixels[-2:] = bytes.fromhex("001f")  # the last one is blue
    connection.receive(b"\x03\x01" + pixels, 1.0)
    event = connection.next_event()
    assert isinstance(event, Answer)
    shown = event.value.pixels  # type: ignore[attr-defined]
    assert shown.shape == (120, 160, 3)
    assert [shown[at].tolist() for at in ((0, 0), (1, 0), (119, 159))] == [[255, 0, 0], [0, 255, 0], [0, 0, 255]]


# -- the connection ----------------------------------------------------------------------------------------------------

SENSORS_PACKET = b"\x02" + struct.pack("<104x")


def opened() -> WifiConnection:
    connection = WifiConnection(Context(EPUCK2_WIFI))
    connection.send(Request("open", "open", pair(connection.context), ALL_SENSORS))
    connection.receive(b"\x03" + SENSORS_PACKET, 0.0)
    assert isinstance(connection.next_event(), Answer)
    assert connection.state is State.IDLE
    return connection


def numbered(number: int) -> bytes:
    packet = bytearray(SENSORS_PACKET)
    packet[1 + 69 : 1 + 71] = number.to_bytes(2, "little")
    return bytes(packet)


def events(connection: WifiConnection) -> list[object]:
    return list(iter(connection.next_event, None))


def distances(found: list[object]) -> list[float]:
    return [event.value.metres for event in found if isinstance(event, Answer)]  # type: ignore[attr-defined]


def test_a_setter_is_confirmed_by_the_first_empty_packet_and_a_reading_comes_behind_the_run() -> None:
    connection = opened()
    connection.send(SPECS["set_body_led"].request(connection.context, 1))
    connection.receive(numbered(1) + b"\x03", 1.0)
    assert len(events(connection)) == 1
    assert connection.context.last_set.lamps[8] == 1
    # The second half of the pair is late: the run goes on, and does not answer the next marker.
    connection.send(SPECS["distance"].request(connection.context))
    connection.receive(b"\x03\x03\x03" + numbered(2), 1.1)
    assert events(connection) == []
    connection.receive(b"\x03\x03" + numbered(3) + numbered(4), 1.2)
    assert distances(events(connection)) == [0.003]


def test_any_cut_of_the_bytes_gives_the_same_answer() -> None:
    stream = numbered(1) + b"\x03" + numbered(2)
    for cut in range(1, len(stream)):
        connection = opened()
        connection.send(SPECS["distance"].request(connection.context))
        connection.receive(stream[:cut], 1.0)
        connection.receive(stream[cut:], 1.0)
        assert distances(events(connection)) == [0.002], f"cut behind {cut} bytes"


def test_the_marker_of_a_call_given_up_must_return_before_the_next_call() -> None:
    connection = opened()
    connection.send(SPECS["distance"].request(connection.context))
    connection.abandon()
    assert connection.state is State.OUT_OF_SYNC
    connection.receive(numbered(1), 1.0)
    assert connection.state is State.OUT_OF_SYNC
    connection.receive(b"\x03", 1.0)
    assert [type(event) for event in events(connection)] == [ResyncAnswer]
    assert connection.state is State.IDLE


def test_a_call_given_up_behind_its_marker_leaves_nothing_to_wait_for() -> None:
    connection = opened()
    connection.send(SPECS["distance"].request(connection.context))
    connection.receive(b"\x03", 1.0)
    connection.abandon()
    assert connection.state is State.IDLE
    connection.receive(numbered(1), 1.0)
    assert events(connection) == []


def test_a_stop_overtakes_as_one_command_without_a_marker_and_never_more_than_four_wait() -> None:
    connection = opened()
    connection.send(SPECS["set_speed"].request(connection.context, 0.5, 0.5))
    connection.receive(b"\x03", 1.0)
    assert connection.waiting_commands == 1, "the second half of the pair may still wait"
    connection.send(SPECS["distance"].request(connection.context))
    assert connection.waiting_commands == 3
    stop = SPECS["stop"].request(connection.context)
    data = connection.overtaking_bytes(stop)
    assert data == STANDING
    connection.overtake(data)
    assert connection.waiting_commands == 4
    assert connection.overtaking_bytes(stop) == b""
    connection.receive(numbered(6), 1.0)
    assert connection.waiting_commands == 3
    assert connection.overtaking_bytes(stop) == b"", "the next request must find room, too"
    connection.receive(b"\x03" + numbered(7), 1.0)
    assert distances(events(connection)[1:]) == [0.007]
    assert connection.state is State.IDLE
    assert connection.waiting_commands == 1
    assert connection.send(stop)[3:7] == bytes(4)
    assert connection.waiting_commands == 3


def test_a_speed_that_was_not_confirmed_is_not_undone_by_the_next_command() -> None:
    connection = opened()
    connection.send(SPECS["set_speed"].request(connection.context, 0.5, 0.5))
    connection.receive(b"\x03" + SENSORS_PACKET, 1.0)
    connection.send(SPECS["set_speed"].request(connection.context, 0, 0))
    connection.abandon()
    connection.receive(b"\x03" + SENSORS_PACKET, 1.0)
    data = connection.send(SPECS["set_body_led"].request(connection.context, 1))
    assert data[3:7] == data[24:28] == bytes(4), "the robot was told to stop, and the lamp must not drive it on"
    assert connection.context.last_set.speed == (500, 500), "only what is confirmed is known to be set"


def test_pictures_are_streamed_while_they_are_wanted_and_cleared_after_a_single_one() -> None:
    connection = opened()
    assert connection.unasked() == b""
    connection.send(SPECS["image"].request(connection.context))
    connection.receive(b"\x03\x01" + bytes(38400), 1.0)
    assert len(events(connection)) == 1
    data = connection.unasked()
    assert (data[1], data[22]) == (0, 2)
    assert connection.is_tidying
    assert connection.unasked() == b""
    connection.receive(SENSORS_PACKET + b"\x03", 1.0)
    assert connection.state is State.IDLE
    assert not connection.is_tidying
    events(connection)
    connection.context.streams_images = True
    assert connection.unasked()[22] == 3
    connection.receive(SENSORS_PACKET + b"\x03\x01" + bytes(38400) + SENSORS_PACKET, 1.0)
    assert [type(event) for event in events(connection)] == [ResyncAnswer, Streamed]
    assert connection.send(SPECS["proximity"].request(connection.context))[22] == 3


def test_readings_are_events_only_while_they_are_watched() -> None:
    connection = opened()
    connection.receive(SENSORS_PACKET, 1.0)
    assert events(connection) == []
    connection.wants_sensors = lambda time: True
    connection.receive(numbered(5) + numbered(6), 1.0)
    assert [event.value.distance.metres for event in events(connection)] == [0.005, 0.006]  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"\x00", "unknown kind 0x00"),
        (b"\x80", "unknown kind 0x80"),
        (b"v,Version", "unknown kind 0x76"),
        (b"\x03", "nothing asked for"),
        (b"\x02" + bytes(37) + b"\x00\x10" + bytes(65), "infrared sensor at 4096 counts"),
        (b"\x02" + bytes(89) + b"\x10" + bytes(14), "selector 16"),
        (b"\x02" + bytes(102) + b"\x02\x00", "button 2"),
        (b"\x02" + bytes(103) + b"\x02", "spare byte 2"),
    ],
)
def test_bytes_that_are_not_packets_end_the_connection(data: bytes, reason: str) -> None:
    connection = opened()
    connection.receive(data, 1.0)
    (event,) = events(connection)
    assert isinstance(event, OutOfStep)
    assert reason in event.reason
    assert connection.state is State.CLOSED
    connection.receive(SENSORS_PACKET, 1.0)
    assert events(connection) == []


def test_a_lost_byte_of_a_sensor_packet_is_never_a_reading() -> None:
    packet = numbered(0x0101)
    for at in range(1, len(packet)):
        connection = opened()
        connection.send(SPECS["distance"].request(connection.context))
        connection.receive(b"\x03" + packet[:at] + packet[at + 1 :] + packet, 1.0)
        assert [type(event) for event in events(connection)] == [OutOfStep], f"byte {at} is lost"


def test_a_number_that_is_not_finite_refuses_the_call_and_not_the_link() -> None:
    connection = opened()
    connection.wants_sensors = lambda time: True
    connection.send(SPECS["attitude"].request(connection.context))
    packet = bytearray(SENSORS_PACKET)
    struct.pack_into("<f", packet, 1 + 6, math.nan)
    connection.receive(b"\x03" + packet, 1.0)
    (event,) = events(connection)
    assert isinstance(event, Refusal)
    assert isinstance(event.error, RemoteProtocolError)
    assert connection.state is State.IDLE
