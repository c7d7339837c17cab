"""The host's decoders against bytes recorded from the real firmware, and every row against the emulated one."""

import gzip
import json
import math
import re
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from elib.base.errors import Unsupported
from elib.link.protocol import values as v
from elib.link.protocol.commands import SPECS
from elib.link.protocol.connection import Answer, HostConnection, State
from elib.link.protocol.context import Context
from elib.link.protocol.forms import prepare
from elib.link.protocol.image import Image, Mounting
from elib.link.protocol.profiles import PROFILES
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.replies import GUARD, Guarded, LinesReply
from elib.link.protocol.table import Spec
from elib.testing import EmulatedRobot

GOLDEN = Path(__file__).parents[1] / "golden"
TEXT = re.compile(r"([A-Za-z])((?:,-?\d+)*)\r")


def exchanges(firmware: str) -> Iterator[dict[str, object]]:
    with gzip.open(GOLDEN / f"{firmware}.jsonl.gz", "rt") as lines:
        for line in lines:
            yield json.loads(line)


def text_row(letter: str, numbers: int, context: Context) -> Spec[object] | None:
    """Return the row of a recorded line, if the host would send it in just this form."""
    for spec in SPECS.values():
        if spec.letter == letter and spec.text is not None and len(spec.parameters) == numbers:
            return None if spec.name in context.profile.absent else spec
    return None


@pytest.mark.parametrize("firmware", sorted(PROFILES))
def test_every_recorded_text_answer_decodes_to_the_numbers_it_shows(firmware: str) -> None:
    context = Context(PROFILES[firmware])
    decoded: dict[str, int] = {}
    for record in exchanges(firmware):
        sent, received = bytes.fromhex(str(record["send_hex"])), bytes.fromhex(str(record["recv_hex"]))
        match = TEXT.fullmatch(sent.decode("latin-1"))
        if match is None or not received or "undefined_on_robot" in record or record.get("hang") or record.get("crash"):
            continue
        spec = text_row(match[1], match[2].count(","), context)
        if spec is None or spec.text is None or spec.name == "reset":
            continue
        if isinstance(spec.text.reply, LinesReply) and spec.text.reply.is_guarded:
            received += b"c,3\r\n"  # it was recorded without the guard behind the command
        taken = spec.text.reply.parse(received, 0, context)
        assert taken is not None, f"{firmware} {record['n']}: {received!r} is not complete"
        end, value = taken
        assert end == len(received), f"{firmware} {record['n']}: bytes are left of {received!r}"
        shown = [int(text) for text in re.findall(r"(?<![\w.])-?\d+", received.decode("latin-1").partition("\r")[0])]
        match value:
            case None:
                assert received[:1].decode().upper() == spec.letter.upper()
            case v.Wheels():
                wrapped = [struct.unpack("<h", struct.pack("<H", number % 65536))[0] for number in shown]
                assert [round(wheel * 1000) for wheel in value] == wrapped
            case v.CameraSettings():
                mode, columns, rows, zoom, size = shown
                swapped = PROFILES[firmware].mounting.swaps
                assert value == (mode, rows, columns, zoom, size) if swapped else (mode, columns, rows, zoom, size)
            case v.Battery():
                assert value.raw == shown[0]
            case v.IrCode():
                assert list(value) == [int(text, 16) for text in re.findall(rb"0x([0-9a-f]+)", received)]
            case v.Selector():
                assert [value.position] == shown
            case v.Numbers():
                assert list(value) == shown
            case v.Version():
                assert value.text in received.decode()
            case str():
                assert value.split() == received.decode().split()[:-1]
            case list():
                found = re.findall(r"(\d+): (-?\d+)", received.decode())
                assert value == [int(each) for each, number in found if firmware != "epuck2" or number != "0"]
            case int():
                assert 0 <= value <= 255
            case _:
                pytest.fail(f"{spec.name} gave {value!r}")
        decoded[spec.name] = decoded.get(spec.name, 0) + 1
    assert len(decoded) >= 18, decoded
    assert sum(decoded.values()) > 300, decoded


@pytest.mark.parametrize("firmware", sorted(PROFILES))
def test_every_recorded_picture_decodes_to_the_pattern_the_chip_showed(firmware: str) -> None:
    seen = 0
    for record in exchanges(firmware):
        if record["send_hex"] != "b700" or "undefined_on_robot" in record or not record["recv_hex"]:
            continue
        received = bytes.fromhex(str(record["recv_hex"]))
        mode, width, height = received[:3]
        if mode > 2 or len(received) != 3 + width * height * (1 if mode == 0 else 2) or width * height == 0:
            continue  # wider than a byte can say, or a size that no host asks for
        context = Context(PROFILES[firmware])
        taken = SPECS["image"].form(context).reply.parse(received, 0, context)
        assert taken is not None
        image = taken[1]
        assert isinstance(image, Image)
        assert taken[0] == len(received)
        assert {image.width, image.height} == {width, height}
        if mode < 2:
            assert image.pixels.shape[:2] == (image.height, image.width)
        seen += 1
    assert seen > 50


# -- every row on every firmware, against the emulated robot -----------------------------------------------------------

ARGUMENTS: dict[str, tuple[object, ...]] = {
    "set_speed": (0.25, -0.5),
    "set_encoders": (300, -400),
    "set_proximity_rate": ("slow",),
    "set_distance_sensor": (False,),
    "set_led": (3, "on"),
    "set_body_led": (1,),
    "set_front_led": (True,),
    "set_rgb_led": (3, 0.1, 0.2, 1.0),
    "play_sound": (2,),
    "set_camera": (30, 20, 4, "grey"),
    "i2c_read": (192, 0),
    "i2c_write": (192, 0, 7),
    "set_obstacle_avoidance": (True,),
}


@pytest.mark.parametrize("firmware", sorted(PROFILES))
def test_the_robot_answers_every_row_in_the_shape_the_host_expects(firmware: str) -> None:
    for name in SPECS:
        try:
            check_row(firmware, name)
        except Exception as error:
            error.add_note(f"This was {name}().")
            raise


def check_row(firmware: str, name: str) -> None:
    context = Context(PROFILES[firmware], time=1.5)
    try:
        request = SPECS[name].request(context, *ARGUMENTS.get(name, ()))
    except Unsupported:
        assert name in PROFILES[firmware].absent
        return
    bench = EmulatedRobot(firmware)
    connection = HostConnection(context)
    connection.receive(bench.send(connection.send(request)), 1.5)
    event = connection.next_event()
    assert isinstance(event, Answer), f"{request} sent {request.data!r}"
    assert connection.state is State.IDLE, "bytes are left over"
    check_value(name, event.value, bench.hardware, firmware)


def check_value(name: str, value: object, hardware: dict[str, object], firmware: str) -> None:
    """Compare a value with the state of the golden files' robot (prox 100, 90, ..; light 3501, 3502, ..)."""
    match name:
        case "set_speed":
            assert hardware["speed"] == [250, -500]
        case "set_encoders":
            assert hardware["steps"] == [300, -400]
        case "set_body_led":
            assert hardware["body"] == 1
        case "set_front_led":
            assert hardware["front"] == 1
        case "set_rgb_led":
            assert hardware["rgb"] == [0, 0, 0, 10, 20, 100, 0, 0, 0, 0, 0, 0]
        case "set_led":
            lit = hardware["rgb"] if firmware == "epuck2" else hardware["led"]
            assert lit == ([0, 0, 0, 10] + [0] * 8 if firmware == "epuck2" else [0, 0, 0, 1, 0, 0, 0, 0])
        case "ambient_light" | "proximity":
            assert isinstance(value, v.InfraredRing)
            assert value.time == 1.5
        case "attitude":
            assert isinstance(value, v.Attitude)
            assert all(math.isfinite(number) for number in value)
        case "microphone_samples":
            assert isinstance(value, np.ndarray)
            assert value.shape == (3, 100)
        case "i2c_scan":
            assert value == [192, 220]
        case "image":
            assert isinstance(value, Image)
            assert (value.width, value.height) == (40, 40)
        case "version":
            assert isinstance(value, v.Version)
            assert value.firmware == firmware
        case "help_text":
            assert str(value).count("\n") >= 20
        case _:
            assert (value is None) == (SPECS[name].signature.return_annotation == "None")


def test_the_robots_readings_arrive_as_the_hardware_has_them() -> None:
    state = {
        "light": [3501, 3502, 3503, 3504, 3505, 3506, 3507, 3508, 3509, 3510],
        "prox": [0] * 10,
        "floor": [1001, 1002, 1003, 1004, 1005],
        "floor_present": 1,
        "tof": 123,
        "selector": 11,
        "battery_raw": 3112,
    }
    bench = EmulatedRobot("epuck2", state)
    bench.set(prox=[100, 90, 80, 70, 60, 50, 40, 30, 20, 10])
    context = Context(PROFILES["epuck2"])

    def ask(name: str) -> object:
        connection = HostConnection(context)
        connection.receive(bench.send(connection.send(SPECS[name].request(context))), 0.0)
        event = connection.next_event()
        assert isinstance(event, Answer)
        return event.value

    assert ask("ambient_light") == tuple(state["light"][:8])  # type: ignore[index]
    assert ask("proximity") == (100, 90, 80, 70, 60, 50, 40, 30)
    assert ask("ground") == (1001, 1002, 1003, 1004, 1005)
    assert ask("distance") == v.Distance(0.123)
    bench.set(tof=8190)  # It sees nothing.
    assert ask("distance") == v.Distance(math.inf)
    assert ask("selector") == v.Selector(11)
    battery = ask("battery")
    assert isinstance(battery, v.Battery)
    assert battery.volts == pytest.approx(3112 / 819.2, abs=0.002)


# -- pictures, by hand -------------------------------------------------------------------------------------------------

GREY_3x2 = bytes((0, 3, 2, 1, 2, 3, 4, 5, 6))
"""What a chip sends: the rows 1 2 3 and 4 5 6."""


@pytest.mark.parametrize(
    ("mounting", "upright"),
    [
        (Mounting.UPRIGHT, [[1, 2, 3], [4, 5, 6]]),
        (Mounting.QUARTER_LEFT, [[3, 6], [2, 5], [1, 4]]),
        (Mounting.HALF, [[6, 5, 4], [3, 2, 1]]),
        (Mounting.QUARTER_RIGHT, [[4, 1], [5, 2], [6, 3]]),
    ],
)
def test_a_picture_is_turned_upright_as_the_chip_is_mounted(mounting: Mounting, upright: list[list[int]]) -> None:
    image = Image(CameraMode.GREY, len(upright[0]), len(upright), GREY_3x2[3:], mounting)
    assert image.pixels.tolist() == upright


@pytest.mark.parametrize(
    ("firmware", "upright"),
    [
        ("btcom-1.1.3", [[3, 6], [2, 5], [1, 4]]),
        ("btcom-2.0", [[3, 6], [2, 5], [1, 4]]),
        ("asercom-1.2.2", [[6, 5, 4], [3, 2, 1]]),
        ("epuck2", [[1, 2, 3], [4, 5, 6]]),
    ],
)
def test_one_picture_of_3_by_2_pixels_proves_the_orientation_of_each_profile(
    firmware: str, upright: list[list[int]]
) -> None:
    context = Context(PROFILES[firmware])
    taken = SPECS["image"].form(context).reply.parse(GREY_3x2, 0, context)
    assert taken is not None
    image = taken[1]
    assert isinstance(image, Image)
    assert image.pixels.tolist() == upright
    assert (image.height, image.width) == image.pixels.shape
    # Colour sits as grey does: the same pattern in the red channel.
    colour = bytes((1, 3, 2)) + b"".join(bytes((level << 3, 0)) for level in GREY_3x2[3:])
    taken = SPECS["image"].form(context).reply.parse(colour, 0, context)
    assert taken is not None
    assert isinstance(taken[1], Image)
    assert (taken[1].pixels[:, :, 0] // 8).tolist() == upright


def test_colour_channels_are_stretched_to_the_whole_range() -> None:
    words = [0xF800, 0x07E0, 0x001F, 0xFFFF, 0x0000, 0x8410]
    image = Image(CameraMode.COLOUR, 6, 1, b"".join(word.to_bytes(2, "big") for word in words))
    assert image.pixels.tolist() == [
        [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255], [0, 0, 0], [132, 130, 132]]
    ]


def test_a_picture_wider_than_its_header_can_say_is_known_by_the_settings() -> None:
    context = Context(PROFILES["epuck2"])
    context.last_set.camera = v.CameraSettings(0, 300, 2, 1, 600)
    data = bytes((0, 300 % 256, 2)) + bytes(600)
    taken = SPECS["image"].form(context).reply.parse(data, 0, context)
    assert taken is not None
    assert (taken[0], taken[1].width) == (603, 300)  # type: ignore[attr-defined]


# -- what leaves the host ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("firmware", "name", "args", "data"),
    [
        ("btcom-1.1.3", "set_speed", (0.5, -0.25), b"D,500,-250\r"),
        ("btcom-1.1.3", "set_camera", (30, 20, 4, "grey"), b"J,0,20,30,4\r"),
        ("epuck2", "set_camera", (30, 20, 4, "grey"), b"J,0,30,20,4\r"),
        ("btcom-1.1.3", "set_led", (8, 1), b"L,8,1\r"),
        ("btcom-1.1.3", "set_led", (8, 2), b"".join(bytes((0xB4, n, 2)) for n in range(8)) + b"\0" + GUARD),
        ("epuck2", "set_led", (8, 2), b"L,8,2\r"),
        ("btcom-1.1.3", "set_body_led", (1,), b"B,1\r"),
        ("btcom-1.1.3", "set_front_led", (False,), b"F,0\r"),
        ("btcom-1.1.3", "play_sound", (3,), b"T,3\r"),
        ("btcom-1.1.3", "image", (), b"\xb7\x00"),
        ("btcom-2.0", "attitude", (), b"\xbf\x00" + GUARD),
        ("asercom-1.2.2", "gyroscope", (), b"\x99\x00" + GUARD),
        ("epuck2", "set_speed", (1.1, -1.1), b"D,1100,-1100\r"),
        ("epuck2", "set_proximity_rate", ("SLOW",), b"\xf0\x02\x00" + GUARD),
        ("asercom-1.2.2", "i2c_write", (192, 0, 7), b"W,192,0,7\r"),
    ],
)
def test_a_call_becomes_just_these_bytes(firmware: str, name: str, args: tuple[object, ...], data: bytes) -> None:
    assert SPECS[name].request(Context(PROFILES[firmware]), *args).data == data


@pytest.mark.parametrize("firmware", ["btcom-1.1.3", "btcom-2.0", "asercom-1.2.2"])
def test_toggling_all_leds_of_an_epuck1_toggles_each(firmware: str) -> None:
    bench = EmulatedRobot(firmware)
    context = Context(PROFILES[firmware])
    for args in ((2, 1), (8, 2)):
        connection = HostConnection(context)
        connection.receive(bench.send(connection.send(SPECS["set_led"].request(context, *args))), 0.0)
        assert isinstance(connection.next_event(), Answer)
    assert bench.hardware["led"] == [1, 1, 0, 1, 1, 1, 1, 1]
    assert context.last_set.lamps[:8] == [1, 1, 0, 1, 1, 1, 1, 1]


def test_every_binary_answer_but_the_pictures_is_guarded() -> None:
    for profile in PROFILES.values():
        for spec in SPECS.values():
            if spec.name in profile.absent or spec.name == "image":
                continue
            form = spec.form(Context(profile))
            assert (form.code is not None) == form.is_guarded, spec.name
            if form.is_guarded:
                data, reply = prepare(form, [0] * len(spec.parameters), Context(profile))
                assert data.endswith(GUARD), spec.name
                assert isinstance(reply, Guarded), spec.name
