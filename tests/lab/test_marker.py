"""The marker believes nothing that a program sends, and hangs nowhere."""

from __future__ import annotations

import random
import socket
import struct
from collections.abc import Callable
from pathlib import Path

import pytest
from labs_for_tests import SURVIVES, TOP, Talker, lab_in, run_program

from elib.lab import Lab, VariantResult, run_variant, running
from elib.lab.lockstep import CLOSE, GO, HEAR, HELLO, LETTER, MAX_MESSAGE, OPEN, ROBOT, SAY, TIME, VERSION, WRITE
from lanes import short


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    counted = '[[goal]]\nname = "asks"\nkind = "requests"\nleast = 1\n'
    return lab_in(tmp_path_factory.mktemp("lab"), SURVIVES + counted, top=TOP.replace("20", "1"))


def talk(lab: Lab, *frames: bytes, wall: float = 20.0) -> VariantResult:
    return speak(lab, lambda link: link.sendall(b"".join(frames)), wall=wall)


def speak(lab: Lab, speech: Callable[[socket.socket], object], *, wall: float = 20.0) -> VariantResult:
    return run_variant(lab, lab.variants[0], lambda link: Talker(link, speech), wall=wall)


def frame(letter: int, body: bytes = b"") -> bytes:
    return LETTER.pack(1 + len(body), letter) + body


HI = frame(HELLO, bytes((VERSION,)))
OPENED = frame(OPEN, ROBOT.pack(0))


@pytest.mark.parametrize(
    ("frames", "why"),
    [
        ([frame(HELLO, b"\x07")], "a hello that is wrong"),
        ([HI, HI], "a second one"),
        ([OPENED], "before its hello"),
        ([frame(GO, TIME.pack(1))], "a time that has passed"),
        ([HI, frame(ord("?"))], "the unknown letter b'?'"),
        ([LETTER.pack(0, HELLO)], "a frame of 0 bytes"),
        ([LETTER.pack(MAX_MESSAGE + 1, WRITE)], f"a frame of {MAX_MESSAGE + 1} bytes"),
        ([LETTER.pack(2**32 - 1, WRITE)], "a frame of 4294967295 bytes"),
        ([HI, frame(OPEN, ROBOT.pack(1))], "robot 2, which does not exist"),
        ([HI, OPENED, OPENED], "is open already"),
        ([HI, frame(OPEN)], "0 bytes in the place of 2"),
        ([HI, frame(OPEN, b"\0\0\0")], "too long"),
        ([HI, frame(WRITE, ROBOT.pack(0) + b"x")], "robot 1, which is not open"),
        ([HI, frame(CLOSE, ROBOT.pack(0))], "robot 1, which is not open"),
        ([HI, OPENED, frame(CLOSE, ROBOT.pack(0)), frame(HEAR, ROBOT.pack(0))], "robot 1, which is not open"),
        ([HI, OPENED, frame(WRITE, ROBOT.pack(0))], "no bytes"),
        ([HI, OPENED, frame(SAY, ROBOT.pack(0) + b"12345")], "a message that cannot be"),
        ([HI, frame(GO, TIME.pack(float("nan")))], "is not a time: nan"),
        ([HI, frame(GO, TIME.pack(-1.0))], "a time that has passed"),
        ([HI, frame(GO, TIME.pack(0.5)), frame(GO, TIME.pack(0.25))], "a time that has passed"),
        ([HI, frame(GO, b"1")], "1 bytes in the place of 8"),
    ],
)
def test_what_elib_never_sends_ends_the_run(lab: Lab, frames: list[bytes], why: str) -> None:
    result = talk(lab, *frames)
    assert result.ending == "broke"
    assert why in result.why
    assert not any(each.holds for each in result.goals)


@pytest.mark.parametrize("count", range(1, len(HI + OPENED)))
def test_an_end_within_a_frame_is_the_end_of_the_program(lab: Lab, count: int) -> None:
    assert talk(lab, (HI + OPENED)[:count]).ending == "ended"


def random_bytes(rng: random.Random) -> bytes:
    return rng.randbytes(rng.choice((1, 3, 20, 300)))


def random_frames(rng: random.Random) -> bytes:
    bodies = (b"", ROBOT.pack(0), ROBOT.pack(0) + rng.randbytes(rng.randrange(40)), TIME.pack(rng.uniform(0, 1.2)))
    frames = [frame(rng.choice(b"HOCWGSN"), rng.choice(bodies)) for _ in range(rng.randrange(20))]
    return HI + OPENED * rng.randrange(2) + b"".join(frames)


def damaged_session(rng: random.Random) -> bytes:
    times = sorted(rng.uniform(0, 0.9) for _ in range(6))
    whole = bytearray(
        HI
        + OPENED
        + b"".join(frame(WRITE, ROBOT.pack(0) + b"D,300,100\rN\r") + frame(GO, TIME.pack(at)) for at in times)
        + frame(CLOSE, ROBOT.pack(0))
    )
    for _ in range(rng.randrange(3)):
        whole[rng.randrange(len(whole))] = rng.randrange(256)
    return bytes(whole)


@pytest.mark.parametrize("cases", short([20, 330], 20))
@pytest.mark.parametrize("kind", [random_bytes, random_frames, damaged_session])
def test_no_bytes_hang_the_marker_or_break_it(lab: Lab, kind: Callable[[random.Random], bytes], cases: int) -> None:
    endings = set()
    for seed in range(cases):
        data = kind(random.Random(f"{kind.__name__} {seed}"))
        result = talk(lab, data)
        endings.add(result.ending)
        assert result.ending in ("broke", "ended", "time"), (seed, result)
    assert endings >= ({"broke", "ended"} if cases > 20 else {"broke"})


def test_a_program_that_never_reads_is_ended_by_the_wall_clock(lab: Lab) -> None:
    def babble(link: socket.socket) -> None:
        link.sendall(HI)
        while True:
            link.sendall(frame(GO, TIME.pack(0.0)) * 1000)

    result = speak(lab, babble, wall=0.5)
    assert (result.ending, result.exit_code) == ("wall", None)
    assert not any(each.holds for each in result.goals)


def test_a_program_that_says_nothing_is_ended_by_the_wall_clock(lab: Lab) -> None:
    result = speak(lab, lambda link: link.recv(1), wall=0.5)
    assert result.ending == "wall"


def test_more_than_a_link_can_keep_breaks_the_rules(lab: Lab) -> None:
    piece = frame(WRITE, ROBOT.pack(0) + b"\r" * (MAX_MESSAGE - 3))

    def flood(link: socket.socket) -> None:
        link.sendall(HI + OPENED)
        for _ in range(40):
            link.sendall(piece)
            link.recv(100)

    assert "more than a robot's link can keep" in speak(lab, flood).why


class Clock:
    """A wall clock that stands until a file is there, and then is far ahead."""

    def __init__(self, file: Path) -> None:
        self._file = file

    def monotonic(self) -> float:
        return 1e6 if self._file.exists() else 0.0


def test_a_program_that_spins_is_ended_by_the_wall_clock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "time", Clock(tmp_path / "spins"))
    spinning = (
        "import elib\nwith elib.connect() as robot:\n    robot.set_speed(0.1, 0.1)\n    open('spins', 'w').close()\n"
        "    while True: pass\n"
    )
    result = run_program(lab_in(tmp_path), spinning)
    assert result.ending == "wall"
    assert result.time < 1.0  # the robot's time stood still


def test_time_goes_no_further_than_the_lab_allows(lab: Lab) -> None:
    answers = []

    def wait(link: socket.socket) -> None:
        link.sendall(HI + frame(GO, TIME.pack(float("inf"))))
        while piece := link.recv(1000):
            answers.append(piece)

    result = speak(lab, wait)
    assert result.ending == "time"
    assert result.time == 1.0
    assert b"the lab's time of 1 s is over" in b"".join(answers)


def test_the_program_cannot_ask_for_anything_but_bytes() -> None:
    assert sorted(b"HOCWGSN") == sorted((HELLO, OPEN, CLOSE, WRITE, GO, SAY, HEAR))
    assert struct.calcsize("<IB") == LETTER.size
