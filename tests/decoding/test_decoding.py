"""What bytes between a program and a robot mean."""

import gzip
import itertools
import json
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import elib
from elib.base.errors import ArgumentError
from elib.link.protocol import values as v
from elib.link.protocol.image import Image
from elib.link.protocol.profiles import PROFILES
from elib.link.protocol.quantities import CameraMode
from elib.link.session.trace import Received, TraceEvent, Wrote
from elib.records.decoding import ASSUMED, FAULTS, Decoder, Direction, Kind, Line
from elib.records.decoding.opcodes import binary_commands
from elib.robot.runner import run_on
from elib.simulator.emulator.firmware import FIRMWARES
from elib.testing import EmulatedRobot
from lanes import few_and_many

GOLDEN = Path(__file__).parents[1] / "golden"
BANNER = b'\x0c\x07WELCOME to the SerCom protocol on e-Puck\r\nthe EPFL education robot type "H" for help\r\n'
Piece = tuple[Direction, bytes]


def talk(*pieces: bytes | str, firmware: str | None = None) -> list[Line]:
    """Decode pieces that went to the robot (text) and came from it (bytes), and the end of the capture."""
    decoder = Decoder(firmware)
    lines: list[Line] = []
    for piece in pieces:
        direction: Direction = "to robot" if isinstance(piece, str) else "to host"
        lines += decoder.feed(direction, None, piece.encode("latin-1") if isinstance(piece, str) else piece)
    return lines + decoder.flush()


def answers(lines: Iterable[Line]) -> list[Line]:
    return [line for line in lines if line.direction == "to host"]


def calls(lines: Iterable[Line]) -> list[str]:
    return [str(call) for line in lines for call in line.calls]


# -- requests ----------------------------------------------------------------------------------------------------------


def test_a_text_command_is_the_call_that_sends_it() -> None:
    (line,) = talk("D,500,-250\r")
    assert str(line.calls[0]) == "set_speed(left=0.5 rev/s, right=-0.25 rev/s)"
    assert (line.kind, line.offset, line.data) == (Kind.REQUEST, 0, b"D,500,-250\r")


def test_a_line_feed_behind_the_carriage_return_belongs_to_the_line() -> None:
    assert [line.data for line in talk("N\r\nO\r", b"n,1\r\n", "\nS\r")][:2] == [b"N\r\n", b"O\r"]


def test_the_camera_is_told_for_the_upright_picture() -> None:
    quarter = talk("J,0,40,30,8\r", firmware="btcom-2.0")
    upright = talk("J,0,40,30,8\r", firmware="epuck2")
    assert calls(quarter) == ["set_camera(width=30 pixels, height=40 pixels, zoom=8, mode=GREY)"]
    assert calls(upright) == ["set_camera(width=40 pixels, height=30 pixels, zoom=8, mode=GREY)"]


def test_missing_numbers_and_words_are_reported() -> None:
    assert talk("D,100\r")[0].problem == "1 of 2 numbers: what was given before holds"
    assert talk("stop\r")[0].problem == "only the first letter counts"
    assert talk("?\r")[0].problem == "asercom-1.2.2 does not have this command"


def test_a_letter_means_what_the_firmware_means_by_it() -> None:
    assert calls(talk("b\r", firmware="asercom-1.2.2")) == ["battery()"]
    assert calls(talk("b,1\r", firmware="btcom-2.0")) == ["set_body_led(action=ON)"]
    assert talk("R\r", firmware="epuck2")[0].problem == "epuck2 takes it and answers nothing"


def test_a_chain_of_binary_commands_is_one_line() -> None:
    (line,) = talk("\xbc\x64\0\x9c\xff\xb4\x08\x01\xb2\0")
    assert list(map(str, line.calls)) == [
        "set_speed(left=0.1 rev/s, right=-0.1 rev/s)",
        "set_body_led(action=ON)",
        "proximity()",
    ]


def test_lamp_eight_of_the_oldest_firmware_is_the_whole_ring() -> None:
    assert calls(talk("\xb4\x08\x01\0", firmware="btcom-1.1.3")) == ["set_led(n=8, action=ON)"]


def test_the_packet_of_all_actuators_is_taken_apart() -> None:
    packet = "\xf7\x02\x64\0\x64\0\x11" + "\0\0\x0a" * 4 + "\x01\0"
    assert calls(talk(packet, firmware="epuck2")) == [
        "set_actuators(set_obstacle_avoidance=ON, left=0.1 rev/s, right=0.1 rev/s, lamps=010001, "
        "led1=0/0/10 %, led3=0/0/10 %, led5=0/0/10 %, led7=0/0/10 %, sound=1)"
    ]


def test_what_a_binary_session_swallows_is_a_fault_and_is_named() -> None:
    line, *answers = talk("\xb2V\r\xa0\0")
    assert (line.kind in FAULTS, [each.kind for each in answers]) == (True, [])
    assert line.problem == (
        "asercom-1.2.2 swallows 'V'; asercom-1.2.2 swallows '\\r'; asercom-1.2.2 swallows opcode 0xa0"
    )


def test_what_ends_a_half_command_is_a_line_of_its_own() -> None:
    resync, question = talk("\0" * 36 + "\rV\r")
    assert (resync.kind, len(resync.data)) == (Kind.FILLER, 36)
    assert question.data == b"\rV\r"
    assert calls([question]) == ["version()"]


def test_halves_at_the_end_are_called_so() -> None:
    assert [line.problem for line in (*talk("D,1"), *talk("\xb2\xb1"))] == [
        "the CR that ends the command is missing",
        "the zero that ends the binary session is missing",
    ]
    assert talk("\r")[0].kind is Kind.FILLER


def test_a_line_that_never_ends_is_shown_in_pieces() -> None:
    lines = talk("V" * 10_000 + "\r")
    assert [line.kind for line in lines] == [Kind.HALF, Kind.HALF, Kind.REQUEST]
    assert calls(lines) == ["version()"]


@pytest.mark.parametrize("name", PROFILES)
def test_the_opcodes_are_those_the_emulated_robot_knows(name: str) -> None:
    ours = {code: command.length for code, command in binary_commands(PROFILES[name]).items()}
    assert ours == FIRMWARES[name].LENGTHS


# -- answers -----------------------------------------------------------------------------------------------------------


def test_an_answer_is_matched_with_its_request() -> None:
    _, line = talk("N\r", b"n,100,90,80,70,60,50,40,30\r\n")
    assert (line.kind, line.name, line.value) == (Kind.ANSWER, "proximity", (100, 90, 80, 70, 60, 50, 40, 30))


def test_the_letters_that_mean_two_things_are_told_apart_by_who_asked() -> None:
    lines = talk(
        "B,1\r", b"b\r\n", "b\r", b"b,2400 (67%)\r\n", "G\r", b"g IR check : 0x2, address : 0x0, data : 0x5\r\n"
    )
    assert [line.name for line in answers(lines)] == ["set_body_led", "battery", "ir_receiver"]


def test_a_request_that_got_no_answer_is_named_at_the_next_that_did() -> None:
    line = talk("N\r", "O\r", "Q\r", b"q,1,2\r\n")[-1]
    assert line.name == "encoders"
    assert line.unanswered == ("proximity()", "ambient_light()")


def test_a_binary_answer_is_taken_apart() -> None:
    lines = answers(talk("\xb2\xaf\0C\r", bytes(16) + b"\x01\0\xff\xffc,3\r\n"))
    assert [(line.name, line.offset) for line in lines] == [("proximity", 0), ("encoders", 16), ("selector", 20)]
    assert lines[1].value == (1, -1)


@pytest.mark.parametrize("count", [0, 3, 15, 17, 40])
def test_a_binary_answer_of_another_length_is_called_so_and_the_next_is_found(count: int) -> None:
    lines = answers(talk("\xb2\0C\r", b"\x01" * count + b"c,3\r\n", "Q\r", b"q,1,2\r\n"))
    assert [line.name for line in lines[-2:]] == ["selector", "encoders"]
    if count:
        assert lines[0].kind is Kind.MALFORMED
        assert lines[0].problem == f"{count} bytes where 16 belong"
    else:
        assert lines[0].unanswered == ("proximity()",)


def test_a_picture_is_a_picture() -> None:
    _, line = talk("\xb7\0", bytes((0, 40, 30)) + bytes(1200), firmware="epuck2")
    assert isinstance(line.value, Image)
    assert (line.value.mode, line.value.width, line.value.height) == (CameraMode.GREY, 40, 30)


def test_a_wide_picture_is_as_wide_as_was_asked() -> None:
    lines = talk("J,0,320,10,1\r", b"j\r\n", "\xb7\0", bytes((0, 64, 10)) + bytes(3200), "V\r", firmware="epuck2")
    picture = next(line.value for line in lines if isinstance(line.value, Image))
    assert picture.width == 320


def test_a_picture_that_breaks_off_ends_where_the_next_answer_begins() -> None:
    lines = answers(talk("\xb7\0", bytes((1, 40, 40)) + bytes(1000), "V\r", b"v,Version 1.1.3 September 2006\r\n"))
    assert [(line.name, line.kind) for line in lines] == [("image", Kind.MALFORMED), ("version", Kind.ANSWER)]
    assert lines[0].problem == "1003 bytes where 3203 belong"


def test_a_header_that_no_robot_sends_is_malformed() -> None:
    lines = answers(talk("\xb7\0", b"\x01\xff\xff" + bytes(100), "V\r", b"v,Version 1.1.3 September 2006\r\n"))
    assert [line.kind for line in lines] == [Kind.MALFORMED, Kind.UNKNOWN, Kind.ANSWER]
    assert "mode 1, 255 x 255 pixels" in lines[0].problem


def test_the_samples_of_the_microphones_come_before_the_rest_of_their_session() -> None:
    lines = answers(talk("\xb2\xab\0", bytes(600) + bytes(16) + b"\x63"))
    assert [(line.name, len(line.data)) for line in lines] == [
        ("microphone_samples", 600),
        ("proximity", 16),
        ("microphone_samples", 1),
    ]


def test_a_greeting_tells_that_the_robot_has_started() -> None:
    lines = answers(talk("N\r", b"Selector pos 3\r\n" + BANNER, "V\r", b"v,Version 1.1.3 September 2006\r\n"))
    assert [line.kind for line in lines] == [Kind.GREETING, Kind.GREETING, Kind.ANSWER]
    assert lines[-1].unanswered == ("proximity()",)


def test_a_reset_is_answered_by_the_greeting() -> None:
    lines = answers(talk("R\rV\r", b"r\r" + BANNER, "V\r", b"v,Version 1.1.3 September 2006\r\n"))
    assert [line.name for line in lines] == ["reset", "version"]


def test_a_greeting_in_the_middle_of_a_picture_ends_it() -> None:
    lines = answers(talk("\xb7\0", bytes((1, 40, 40)) + bytes(50) + BANNER))
    assert [(line.kind, len(line.data)) for line in lines] == [(Kind.MALFORMED, 53), (Kind.GREETING, 88)]


def test_the_robots_own_answers_tell_the_firmware() -> None:
    decoder = Decoder()
    assert (decoder.firmware, decoder.source) == (ASSUMED, "assumed")
    decoder.feed("to robot", None, b"V\r")
    decoder.feed("to host", None, b"v,Version 2.0 January 2018 GCtronic\r\nHW version: FFF7\r\n")
    assert (decoder.firmware, decoder.source) == ("epuck2", "by its version")


def test_what_the_caller_says_of_the_firmware_holds_and_a_contradiction_is_told() -> None:
    _, line = talk("V\r", b"v,Version 2.0.0 January 2008\r\n", firmware="asercom-1.2.2")
    assert line.problem == "a robot with btcom-2.0 says so; it is decoded as asercom-1.2.2"
    with pytest.raises(ArgumentError, match="no firmware 'c64'"):
        Decoder("c64")


def test_a_refusal_belongs_to_the_request_that_is_refused() -> None:
    lines = answers(talk("g\r", b"z,Command not found\r\n", "?\r", b"z,Command not found\r\n"))
    assert [(line.name, line.problem) for line in lines] == [("gyroscope", "the robot does not know 'g'"), ("?", "")]


def test_a_malformed_answer_and_a_surplus_one_are_named() -> None:
    lines = answers(talk("N\r", b"n,1,2\r\n", b"q,3,4\r\n", b"\xff\r\n", "S\r", b"s\r\n"))
    assert [line.kind for line in lines] == [Kind.MALFORMED, Kind.SURPLUS, Kind.UNKNOWN, Kind.ANSWER]
    assert "expected 'n' and 8 numbers" in lines[0].problem


def test_noise_before_an_answer_does_not_hide_it() -> None:
    lines = answers(talk("Q\r", b"\xfe\xff\x80q,1,2\r\n"))
    assert [(line.kind, len(line.data)) for line in lines] == [(Kind.UNKNOWN, 3), (Kind.ANSWER, 7)]


def test_an_answer_of_several_lines_that_breaks_off_does_not_swallow_the_next() -> None:
    lines = answers(talk("K\r", b"k, Starting calibration - Remove any object\r\n", "Q\r", b"q,1,2\r\n"))
    assert [(line.kind, line.name) for line in lines] == [
        (Kind.HALF, "calibrate_proximity"),
        (Kind.ANSWER, "encoders"),
    ]


def test_a_binary_answer_takes_the_place_of_a_text_answer_that_was_lost() -> None:
    lines = answers(talk("N\r", "\xaf\0", b"\x01\0\x02\0"))
    assert [(line.name, line.value, line.unanswered) for line in lines] == [("encoders", (1, 2), ("proximity()",))]


def test_devices_on_the_bus_are_listed_to_their_end() -> None:
    lines = answers(talk("Z\rC\r", b"192: 3\r\n220: 1\r\nc,3\r\n"))
    assert [(line.name, line.value) for line in lines[:2]] == [("i2c_scan", {"192": 3}), ("i2c_scan", {"220": 1})]
    assert lines[2].name == "selector"
    assert not lines[2].unanswered


@pytest.mark.parametrize("firmware", PROFILES)
@pytest.mark.parametrize("guard", [b"", b"C\r"])
def test_a_help_text_is_one_answer_with_and_without_the_question_behind_it(firmware: str, guard: bytes) -> None:
    answer = EmulatedRobot(firmware).send(b"H\r" + guard)
    decoder = Decoder(firmware)
    lines = decoder.feed("to robot", None, b"H\r" + guard) + decoder.feed("to host", None, answer)
    assert not [line for line in lines if line.kind in FAULTS or line.problem or line.unanswered]
    assert [line.name for line in answers(lines)] == ["help_text", "selector"][: 1 + bool(guard)]


def test_a_number_beyond_all_bounds_is_malformed() -> None:
    lines = answers(talk("b\r", b"b," + b"9" * 400 + b" (67%)\r\n", "S\r", b"s\r\n"))
    assert [line.kind for line in lines] == [Kind.MALFORMED, Kind.ANSWER]


# -- one direction alone -----------------------------------------------------------------------------------------------


def test_the_robots_half_alone_is_cut_into_lines_and_no_name_is_guessed() -> None:
    alone = [b"n,1,2,3,4,5,6,7,8\r\n", b"b\r\n", bytes(range(16, 32)), b"c,3\r\n", b"\x00" * 4]
    lines = talk(*alone)
    assert [line.data for line in lines] == alone
    assert {(line.kind, line.name, line.value, line.problem) for line in lines} == {(Kind.BYTES, "", None, "")}


def test_the_robots_half_alone_tells_that_the_robot_has_started() -> None:
    lines = talk(b"\xff\xfe" + b"Selector pos 3\r\n" + BANNER)
    assert [line.kind for line in lines] == [Kind.BYTES, Kind.GREETING, Kind.GREETING]


def test_a_capture_that_begins_with_an_answer_has_no_fault_and_is_decoded_from_its_first_request_on() -> None:
    decoder = Decoder()
    assert [line.kind for line in decoder.feed("to host", None, b"q,1,2\r\n")] == [Kind.BYTES]
    assert decoder.lacks_requests
    decoder.feed("to robot", None, b"Q\r")
    assert [line.name for line in answers(decoder.feed("to host", None, b"q,1,2\r\n"))] == ["encoders"]
    assert not decoder.lacks_requests


# -- properties --------------------------------------------------------------------------------------------------------

WORDS: list[Piece] = [
    *(
        ("to robot", text.encode("latin-1"))
        for text in "N\r|D,1,2\r\n|\xb2\0C\r|\xb7\0|V\r|K\r|R\r|\0\0\0\r|Z\rC\r|b\r|?".split("|")
    ),
    ("to robot", b"\xab\0"),
    *(
        ("to host", data)
        for data in (
            b"n,1,2,3,4,5,6,7,8\r\n",
            bytes(range(16)),
            b"c,3\r\n",
            bytes((0, 5, 4)) + bytes(range(20)),
            BANNER,
            b"Selector pos 3\r\n",
            b"v,Version 1.2.2 August 2008 GCtronic\r\n",
            b"HW version: FFF7\r\n",
            b"v,Version 2.0.0 January 2008\r\n",
            b"k, Starting calibration - Remove any object in sensors range\r\n",
            b"k, Calibration finished\r\n",
            b"b,2400 (67%)\r\n",
            b"z,Command not found\r\n",
            b"192: 3\r\n",
            b"d\r\n",
            b"r\r",
            b"\n",
            b"\xff" * 600,
        )
    ),
]
PIECES = st.one_of(
    st.sampled_from(WORDS),
    st.tuples(st.sampled_from(("to robot", "to host")), st.binary(max_size=40)),
)


def whole(pieces: Iterable[Piece], cuts: Iterator[int]) -> tuple[list[Line], str]:
    """Decode pieces, each cut into parts of the lengths given."""
    decoder = Decoder()
    lines: list[Line] = []
    for time, (direction, data) in enumerate(pieces):
        start = 0
        while start < len(data):
            end = start + next(cuts)
            lines += decoder.feed(direction, float(time), data[start:end])
            start = end
    return lines + decoder.flush(), decoder.firmware


@few_and_many(100, 200)
def test_any_cutting_gives_the_same_lines_and_every_byte_is_in_one(examples: int) -> None:
    @settings(max_examples=examples)
    @given(st.lists(PIECES, max_size=25), st.lists(st.integers(1, 50), min_size=1, max_size=10))
    def holds(pieces: list[Piece], cuts: list[int]) -> None:
        at_once = whole(pieces, itertools.repeat(10_000))
        assert repr(whole(pieces, itertools.cycle(cuts))) == repr(at_once)
        assert repr(whole(pieces, itertools.repeat(1))) == repr(at_once)
        for direction in ("to robot", "to host"):
            lines = [line for line in at_once[0] if line.direction == direction]
            data = b"".join(data for way, data in pieces if way == direction)
            assert b"".join(line.data for line in lines) == data
            ends = list(itertools.accumulate(len(line.data) for line in lines))
            assert [line.offset for line in lines] == [0, *ends][: len(lines)]

    holds()


@pytest.mark.parametrize("direction", ["to robot", "to host"])
def test_garbage_is_decoded_in_bounded_memory(direction: Direction) -> None:
    decoder = Decoder()
    count = 0
    for start in range(200):
        data = bytes((start * 7 + at * at) % 255 + 1 for at in range(1000))
        lines = decoder.feed(direction, None, data.replace(b"\n", b"x").replace(b"\r", b"x"))
        assert all(len(line.data) <= 10_000 for line in lines)
        count += sum(len(line.data) for line in lines)
    assert count > 180_000
    assert count + sum(len(line.data) for line in decoder.flush()) == 200_000


# -- real traffic ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("firmware", PROFILES)
def test_every_recorded_byte_of_the_real_firmware_is_understood(firmware: str) -> None:
    lines: list[Line] = []
    decoder = Decoder(firmware)
    is_over = False
    for record in recorded(firmware):
        if record.get("fresh"):
            lines += decoder.flush()
            decoder, is_over = Decoder(firmware), False
        # Hung and dead robots, and pictures larger than their memory, prove nothing (golden/README.md).
        is_over = is_over or bool(record.keys() & {"hang", "crash", "undefined_on_robot"})
        if str(record["send"]).upper().startswith("'X") and firmware == "btcom-2.0":
            continue  # it sends what its receive buffer still held
        if not is_over:
            lines += decoder.feed("to robot", None, bytes.fromhex(str(record["send_hex"])))
            lines += decoder.feed("to host", None, bytes.fromhex(str(record["recv_hex"])))
    came = answers(lines + decoder.flush())
    assert len(came) > 1000
    assert not [line for line in came if line.kind in FAULTS or line.kind is Kind.FILLER]
    # V sent together with R is eaten by the bootloader; nothing else is without an answer.
    assert {request for line in came for request in line.unanswered} <= {"version()"}


def recorded(firmware: str) -> Iterator[dict[str, object]]:
    with gzip.open(GOLDEN / f"{firmware}.jsonl.gz", "rt") as file:
        for line in file:
            yield json.loads(line)


@pytest.mark.parametrize("firmware", PROFILES)
def test_what_a_session_says_decodes_to_the_calls_that_were_made(firmware: str) -> None:
    wire: list[tuple[float, TraceEvent]] = []

    async def main(robot: elib.Epuck) -> None:
        robot.session.hooks.append(lambda time, event: wire.append((time, event)))
        await robot.version()  # the question of the opening was before the hook
        await robot.set_speed(0.25, -0.5)
        await robot.proximity()
        await robot.encoders()
        await robot.set_camera(20, 10, 8, "grey")
        await robot.image()
        await robot.sensors()
        await robot.attitude()
        await robot.stop()

    run_on(f"sim://?speed=max&firmware={firmware}", main)
    decoder = Decoder()
    lines: list[Line] = []
    for time, event in wire:
        if isinstance(event, Wrote):
            lines += decoder.feed("to robot", time, event.data)
        elif isinstance(event, Received):
            lines += decoder.feed("to host", time, event.data)
    lines += decoder.flush()
    assert not [line for line in lines if line.kind in FAULTS or line.problem or line.unanswered]
    said = " ".join(calls(lines))
    made = [
        "version()",
        "set_speed(left=0.25 rev/s, right=-0.5 rev/s)",
        "proximity()",
        "encoders()",
        "set_camera(",
        "image()",
    ]
    places = [said.index(call) for call in [*made, "stop()"]]
    assert places == sorted(places)
    picture = next(line.value for line in lines if isinstance(line.value, Image))
    assert (picture.width, picture.height) == (20, 10)
    assert any(isinstance(line.value, v.Attitude) for line in lines)


def test_requests_and_answers_are_decoded_although_the_firmware_is_not_named() -> None:
    bench = EmulatedRobot("epuck2")
    decoder = Decoder()
    lines = decoder.feed("to host", None, bench.boot)
    for request in (b"V\r", b"\xf8\xf5\0C\r", b"M\r", b"\xb3\0", b"H\r"):
        lines += decoder.feed("to robot", None, request)
        lines += decoder.feed("to host", None, bench.send(request))
    assert decoder.firmware == "epuck2"
    assert not [line for line in lines if line.kind in FAULTS]
    assert [line.name for line in answers(lines)[2:]] == [
        "sensors",
        "button",
        "selector",
        "ground",
        "ground",
        "help_text",
    ]
