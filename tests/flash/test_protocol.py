"""The host's side of the bootloader's protocol, without a robot: bytes, times, and what it does after failures."""

from __future__ import annotations

from itertools import pairwise

import pytest

from elib.tools.flash.protocol import (
    ANSWER_LIMIT,
    CALL,
    CALL_LIMIT,
    END,
    MAX_FAILURES,
    PARKING,
    QUIET,
    SETTLING,
    Phase,
    Upload,
    packet,
)

ROWS = [(0, b"\x01" * 96), (0x100, b"\x02" * 96), (0x17F00, b"\x03" * 96)]
PACKETS = [packet(*row) for row in ROWS]


def sent_until(upload: Upload, time: float) -> list[tuple[float, bytes]]:
    """Return what is sent up to *time*, with its times."""
    sent = []
    while upload.due <= time and upload.phase not in (Phase.DONE, Phase.FAILED):
        now = upload.due
        data = upload.send(now)
        if data:
            sent.append((now, data))
    return sent


def begun(time: float = 0.0) -> Upload:
    """Return an upload whose first packet has been sent."""
    upload = Upload(ROWS, time)
    assert upload.send(time) == CALL
    upload.receive(b"qK", time)
    assert upload.send(time) == PARKING
    return upload


def test_packets_are_those_of_the_reference() -> None:
    row_0 = bytes.fromhex("407F04010000") + b"\xff" * 90
    assert packet(0, row_0) == bytes.fromhex("00000060") + row_0 + b"\x36"
    row_17f00 = b"\xff" * 81 + bytes.fromhex("D20400000104000000") + b"\xff" * 6
    assert packet(0x17F00, row_17f00) == bytes.fromhex("007F0160") + row_17f00 + b"\x9c"
    assert bytes.fromhex("950000FF") == END
    assert CALL == b"\xc1"


def test_the_first_packet_lets_the_bootloader_leave_to_itself() -> None:
    assert bytes.fromhex("007F0160") + b"\xff" * 84 + bytes.fromhex("407F04010000") + b"\xff" * 6 == PARKING[:-1]
    assert sum(PARKING) % 256 == 0


def test_the_first_packet_is_never_correct_behind_calls_that_came_late() -> None:
    for calls in range(1, 101):
        assert sum(CALL * calls + PARKING[:-calls]) % 256 != 0, f"{calls} calls"


def test_a_packet_sent_twice_is_correct_and_wrong_if_the_robot_counts_differently() -> None:
    # This is why a packet is not sent again before the bootloader has given up.
    for more in range(1, 101):
        heard = (b"\x00" * more + PACKETS[0] + PACKETS[0])[101:202]
        assert sum(heard) % 256 == 0, f"{more} bytes"
        assert heard != PACKETS[0], f"{more} bytes"


def test_the_robot_is_called_every_100_ms_for_30_s() -> None:
    upload = Upload(ROWS, 5.0)
    sent = sent_until(upload, 100.0)
    assert {data for _, data in sent} == {CALL}
    assert [time for time, _ in sent] == pytest.approx([5.0 + number / 10 for number in range(300)], abs=1e-6)
    assert upload.phase is Phase.FAILED
    assert upload.failures == ["no bootloader answered for 30 s"]
    assert not upload.has_begun


@pytest.mark.parametrize("pieces", [[b"qK"], [b"q", b"K"], [b"WELCOME to", b" the q", b"K"], [b"q", b"qqK"]])
def test_the_pair_is_found_behind_old_bytes_and_in_pieces(pieces: list[bytes]) -> None:
    upload = Upload(ROWS, 0.0)
    upload.send(0.0)
    for piece in pieces:
        assert upload.phase is Phase.CALLING
        upload.receive(piece, 0.05)
    assert upload.send(0.05) == PARKING


def test_rows_are_sent_one_at_a_time_and_then_the_end() -> None:
    upload = begun()
    for number, data in enumerate(PACKETS):
        assert upload.written == max(0, number - 1)
        upload.receive(b"K", 0.01 * number)
        assert sent_until(upload, 0.01 * number) == [(0.01 * number, data)]
    upload.receive(b"K", 1.0)
    assert sent_until(upload, 1.0 + SETTLING) == [(1.0 + SETTLING, END)]
    assert (upload.phase, upload.written, upload.failures) == (Phase.DONE, 3, [])


@pytest.mark.parametrize("answer", [b"N", b"KK", b"x", b"KN", b"qK", None])
def test_after_any_other_answer_it_keeps_quiet_and_goes_on_one_row_before(answer: bytes | None) -> None:
    upload = begun()
    upload.receive(b"K", 0.0)
    upload.send(0.0)
    upload.receive(b"K", 0.0)
    assert upload.send(0.0) == PACKETS[1]
    failed = 0.5
    if answer is None:
        failed = ANSWER_LIMIT
        assert sent_until(upload, failed) == []
    else:
        upload.receive(answer, failed)
    assert sent_until(upload, failed + QUIET - 0.001) == []
    assert sent_until(upload, failed + QUIET) == [(failed + QUIET, CALL)]
    upload.receive(b"qK", 3.0)
    assert sent_until(upload, 3.0) == [(3.0, PARKING)]
    upload.receive(b"K", 3.0)
    assert sent_until(upload, 3.0) == [(3.0, PACKETS[0])]
    assert upload.is_parked
    assert len(upload.failures) == 1


def test_a_byte_too_many_behind_the_last_row_shows_before_the_end_is_sent() -> None:
    upload = begun()
    for _ in range(4):
        upload.receive(b"K", 0.0)
        upload.send(0.0)
    assert upload.phase is Phase.SETTLING
    upload.receive(b"K", 0.05)
    assert upload.phase is Phase.CALLING
    assert upload.failures == ["row 3: it answered b'K'"]


def test_once_rows_are_written_calls_and_silences_take_turns() -> None:
    upload = begun()
    upload.receive(b"K", 0.0)
    upload.send(0.0)
    upload.receive(b"N", 0.0)
    times = [time for time, _ in sent_until(upload, 100.0)]
    gaps = [after - before for before, after in pairwise(times)]
    assert max(gaps) == pytest.approx(QUIET, abs=0.11)
    assert times[-1] <= QUIET + CALL_LIMIT
    assert upload.phase is Phase.FAILED


def test_a_first_packet_that_is_refused_makes_the_calls_rarer() -> None:
    upload = begun()
    upload.receive(b"N", 0.0)
    assert not upload.is_parked
    upload.call_again(10.0)
    assert [time for time, _ in sent_until(upload, 10.55)] == pytest.approx([10.0, 10.2, 10.4])


def test_the_same_failure_five_times_in_a_row_ends_the_upload() -> None:
    upload = begun()
    for number in range(MAX_FAILURES):
        assert upload.phase is not Phase.FAILED
        upload.receive(b"N", 10.0 * number)
        if number < MAX_FAILURES - 1:
            sent_until(upload, 10.0 * number + QUIET)
            upload.receive(b"qK", 10.0 * number + 5)
            upload.send(10.0 * number + 5)
    assert upload.phase is Phase.FAILED
    assert len(upload.failures) == MAX_FAILURES


def test_a_hundred_failures_end_the_upload_wherever_they_are() -> None:
    upload = Upload([(0x40 * number, bytes(96)) for number in range(300)], 0.0)
    time = 0.0
    while upload.phase is not Phase.FAILED:
        upload.send(time)
        upload.receive(b"qK", time)
        for answer in (b"K", b"K", b"K", b"K", b"N"):
            upload.send(time)
            upload.receive(answer, time)
        time += 10.0
    assert len(upload.failures) == 100
    assert upload.written == 201


def test_a_last_row_without_an_answer_may_have_been_written() -> None:
    upload = begun()
    for _ in range(3):
        upload.receive(b"K", 0.0)
        upload.send(0.0)
    assert not upload.is_parked
    upload.receive(b"N", 0.1)
    assert upload.is_parked, "refused, so the robot still waits in its bootloader"
