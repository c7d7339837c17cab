"""Recordings read back: to the last whole chunk of a file that was cut, and without harm from one that is damaged."""

from __future__ import annotations

import asyncio
import json
import math
import os
import random
import struct
import zlib
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import read, recorded

import elib
from elib.base.errors import ArgumentError, Unsupported
from elib.records import mcapfile
from elib.records.mcapfile import part_of
from elib.records.mcapreader import Health
from elib.records.mcapwriter import CHUNK, MAGIC, MESSAGE_INDEX, METADATA, McapWriter
from elib.records.reader import Entry, Recording, read_recording, summary_of
from elib.records.recorder import Recorder
from elib.records.repair import repair, repaired_name
from elib.records.state import state_at
from elib.records.timeline import timeline
from elib.records.topics import ABOUT, FORMAT, TOPICS
from elib.studies.comparison import run_of
from lanes import few_and_many

CALLS = 30
EXAMPLES = few_and_many(40, 80)
DAMAGE = st.lists(st.tuples(st.integers(0, 1 << 20), st.integers(0, 255)), min_size=1, max_size=8)


def damaged(content: bytes, damage: list[tuple[int, int]]) -> bytes:
    """Return *content* with other bytes at some places."""
    broken = bytearray(content)
    for place, value in damage:
        broken[place % len(broken)] = value
    return bytes(broken)


async def work(robot: elib.Epuck, recorder: Recorder) -> None:
    """Leave several chunks behind: one for each time that the thread is hurried."""
    for number in range(CALLS):
        await robot.proximity()
        if number % 5 == 4:
            recorder.note(f"{number}")
            recorder._work.hurry()
            written = recorder.size
            while recorder.size == written:  # noqa: ASYNC110  # the thread that writes tells nobody
                await asyncio.sleep(0)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recording") / "run.mcap"
    recorded(path, work)
    return path


@pytest.fixture(scope="module")
def content(whole: Path) -> bytes:
    return whole.read_bytes()


def records(content: bytes) -> list[tuple[int, int, int]]:
    """Return kind, beginning and end of every record of a file."""
    place, found = len(MAGIC), []
    while place < len(content) - len(MAGIC):
        kind, length = struct.unpack_from("<BQ", content, place)
        found.append((kind, place, place + 9 + length))
        place += 9 + length
    return found


def entries(path: Path) -> tuple[list[Entry], Health]:
    health = Health()
    return list(read_recording(path).entries(health=health)), health


# -- whole files -----------------------------------------------------------------------------------------------------


def test_what_was_written_is_read(whole: Path) -> None:
    found, health = entries(whole)
    assert [(each.topic, each.data) for each in found] == [(each.topic, each.data) for each in read(whole)]
    assert health == Health(is_complete=True, damaged=0, messages=len(found), ends_at=whole.stat().st_size)


def test_topics_are_chosen_by_name_and_readings_together(whole: Path) -> None:
    recording = read_recording(whole)
    assert {each.topic for each in recording.entries("/notes", "/calls")} == {"/notes", "/calls"}
    assert {each.topic for each in recording.entries("/readings/")} == {"/readings/proximity"}
    assert list(recording.entries("/note")) == []


def test_every_topic_stands_once_in_the_table_of_topics() -> None:
    assert len({topic.name for topic in TOPICS}) == len(TOPICS)


def test_a_summary_counts_messages_notes_and_time(whole: Path) -> None:
    summary = summary_of(read_recording(whole))
    assert summary.is_complete
    assert summary.messages["/calls"] == summary.messages["/readings/proximity"] == CALLS
    assert summary.rate("/calls") == pytest.approx(CALLS / summary.duration)
    assert [each.data["message"] for each in summary.notes] == ["4", "9", "14", "19", "24", "29"]
    assert summary.rate("/nothing") == 0
    assert summary.first < float(summary.about["began"])  # the opening was before


# -- files that are not recordings -----------------------------------------------------------------------------------


def written(path: Path, *about: dict[str, str]) -> Path:
    with path.open("xb") as stream:
        writer = McapWriter(stream, "test")
        for each in about:
            writer.add_metadata(ABOUT, each)
        writer.finish()
    return path


def test_a_file_that_is_not_a_recording_is_refused_in_words(tmp_path: Path) -> None:
    (tmp_path / "text.mcap").write_text("hello, this is not a recording")
    for path, message in (
        (tmp_path / "none.mcap", "cannot be read: No such file"),
        (tmp_path, "cannot be read: Is a directory"),
        (Path("a\0b"), "cannot be read"),
        (tmp_path / "text.mcap", "is not an MCAP file"),
        (written(tmp_path / "empty.mcap"), "is not a recording of elib"),
        (written(tmp_path / "new.mcap", {"format": "99", "began": "0"}), f"has format '99'; .* reads {FORMAT}"),
        (written(tmp_path / "bad.mcap", {"format": FORMAT, "began": "soon"}), "does not say when it began"),
        (written(tmp_path / "worse.mcap", {"format": FORMAT}), "does not say when it began"),
        (written(tmp_path / "odd.mcap", {"format": FORMAT, "began": "nan"}), "does not say when it began"),
        (written(tmp_path / "whose.mcap", {"format": FORMAT, "began": "0"}), "does not say which robot it was"),
        (
            written(tmp_path / "which.mcap", {"format": FORMAT, "began": "0", "robot": "x", "seed": "y"}),
            "does not say which seed its world has",
        ),
        (
            written(tmp_path / "many.mcap", {"format": FORMAT, "began": "0", "robot": "x", "robots": "two"}),
            "does not say how many robots its world has",
        ),
        (Path("."), "is a folder, not a recording"),
        (Path(""), "is a folder, not a recording"),
    ):
        with pytest.raises(ArgumentError, match=message):
            read_recording(path)


def test_a_pipe_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.mcap")
    with pytest.raises(ArgumentError, match="it is not a regular file"):
        read_recording(tmp_path / "pipe.mcap")


# -- messages that are not what they should be ------------------------------------------------------------------------

CALL = {"time": 1.0, "call": 1, "command": "stop", "text": "stop()", "arguments": [1, 2]}


@pytest.mark.parametrize(
    "wrong",
    [
        b"null",
        b"[" * 100_000,
        b'{"time": 1.0}',
        *(json.dumps({name: each for name, each in CALL.items() if name != left_out}).encode() for left_out in CALL),
        json.dumps({**CALL, "time": "soon"}).encode(),
        json.dumps({**CALL, "time": math.nan}).encode(),
        json.dumps({**CALL, "time": 1e16}).encode(),
        json.dumps({**CALL, "time": True}).encode(),
        json.dumps({**CALL, "call": 10**400}).encode(),
        json.dumps({**CALL, "call": 1.5}).encode(),
        json.dumps({**CALL, "arguments": [1, "2"]}).encode(),
        json.dumps({**CALL, "text": "\ud800"}).encode(),
        b'{"time": 1e999}',
        json.dumps(CALL).encode().replace(b"stop()", b"\xff"),
    ],
    ids=range(18),
)
def test_a_message_that_is_not_as_its_topic_says_is_damaged(wrong: bytes, tmp_path: Path) -> None:
    path = tmp_path / "odd.mcap"
    with path.open("xb") as stream:
        writer = McapWriter(stream, "test")
        writer.add_metadata(ABOUT, {"format": FORMAT, "began": "0", "robot": "x", "firmware": "epuck2"})
        channel = writer.register("/calls", "elib.Call", b"{}")
        for content in (json.dumps(CALL).encode(), wrong, json.dumps(CALL).encode()):
            writer.add_message(channel, 0, content)
        writer.finish()
    found, health = entries(path)
    assert [each.data for each in found] == [CALL, CALL]
    assert (health.damaged, health.is_complete) == (1, True)


@pytest.mark.parametrize("command", ["set_speed", "set_led", "set_encoders", "stop"])
def test_an_outcome_whose_call_is_lost_or_damaged_is_still_shown(command: str, tmp_path: Path) -> None:
    ended = {"time": 2.0, "call": 1, "command": command, "ok": True, "error": "", "waited": 0.1, "round_trip": 0.1}
    for number, arguments in enumerate((None, [], [1], [1, 2, 3], [10**14, 0])):
        path = tmp_path / f"odd{number}.mcap"
        with path.open("xb") as stream:
            writer = McapWriter(stream, "test")
            writer.add_metadata(ABOUT, {"format": FORMAT, "began": "0", "robot": "x", "firmware": "epuck2"})
            if arguments is not None:
                call = {**CALL, "command": command, "text": f"{command}(..)", "arguments": arguments}
                writer.add_message(writer.register("/calls", "elib.Call", b"{}"), 0, json.dumps(call).encode())
            writer.add_message(writer.register("/outcomes", "elib.Outcome", b"{}"), 0, json.dumps(ended).encode())
            writer.finish()
        (moment,) = timeline(read_recording(path))
        assert moment.text.startswith(command), arguments
        assert state_at(read_recording(path), 2.0).memory.lamps == [0] * 10, arguments


# -- chunks ----------------------------------------------------------------------------------------------------------


def chunk_of(claimed: int, inside: bytes, method: str, packed: bytes) -> bytes:
    head = struct.pack("<QQQI", 0, 0, claimed, zlib.crc32(inside))
    body = head + struct.pack("<I", len(method)) + method.encode() + struct.pack("<Q", len(packed)) + packed
    return struct.pack("<BQ", CHUNK, len(body)) + body


@pytest.mark.parametrize("method", ["", "zstd", "lz4", "none"])
def test_a_chunk_is_read_only_if_it_is_as_large_as_it_says(method: str, content: bytes, tmp_path: Path) -> None:
    beginning = next(begin for kind, begin, _ in records(content) if kind == CHUNK)
    chance = random.Random(1)
    message = b'{"time":1.0,"level":2,"message":"%d","name":"note","event":""}'
    inside = b"\x04" + struct.pack("<QHHI", 22, 1, 0, 6) + b"/notes" + struct.pack("<I", 4) + b"json" + bytes(4)
    inside = inside[:1] + struct.pack("<Q", len(inside) - 9) + inside[9:]
    for _ in range(5000):
        data = message % chance.randrange(10**9)
        inside += b"\x05" + struct.pack("<QHIQQ", 22 + len(data), 1, 0, 0, 0) + data
    pack = {"": bytes, "none": bytes, "zstd": zstandard.compress, "lz4": lz4.frame.compress}[method]
    path = tmp_path / "run.mcap"
    for claimed in (len(inside), len(inside) - 1, len(inside) + 1, 0, 1 << 40, (1 << 64) - 1):
        path.write_bytes(content[:beginning] + chunk_of(claimed, inside, method, pack(inside)) + b"\0" * 9)
        found, health = entries(path)
        is_read = claimed == len(inside) and method != "none"
        assert (len(found), health.damaged) == ((5000, 0) if is_read else (0, 1))


def test_a_note_that_packs_very_well_is_not_taken_for_a_bomb(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"

    async def main(robot: elib.Epuck, recorder: Recorder) -> None:
        recorder.note("x" * 500_000)

    recorded(path, main)
    found, health = entries(path)
    assert max(len(str(each.data.get("message"))) for each in found) == 500_000
    assert health.damaged == 0


def test_without_the_package_mcap_the_hint_says_how_to_install_it(whole: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mcapfile.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(Unsupported, match=r"pip install .*\[record\]"):
        read_recording(whole)


# -- files that were cut ---------------------------------------------------------------------------------------------


def test_a_file_cut_anywhere_is_read_to_its_last_whole_chunk(whole: Path, content: bytes, tmp_path: Path) -> None:
    path, everything = tmp_path / "cut.mcap", entries(whole)[0]
    places = records(content)
    chunks = [end for kind, _, end in places if kind == CHUNK]
    beginning = next(end for kind, _, end in places if kind == METADATA)
    assert len(chunks) >= 6
    # Just before and on every border, and within every record.
    cuts = {place for _, begin, end in places for place in (begin - 1, begin, (begin + end) // 2)} | {len(content) - 1}
    counts = set()
    for cut in sorted(each for each in cuts if 0 <= each < len(content)):
        path.write_bytes(content[:cut])
        if cut < beginning:
            with pytest.raises(ArgumentError):
                read_recording(path)
            continue
        found, health = entries(path)
        assert found == everything[: len(found)]
        assert not health.is_complete
        assert health.damaged == 0
        counts.add(len(found))
        assert len(found) == health.messages
        assert (len(found) == len(everything)) == (cut >= chunks[-1])
    assert len(counts) == len(chunks) + 1, "each chunk that is whole is read"


@EXAMPLES
def test_a_file_cut_at_any_byte_raises_nothing_but_argument_errors(
    examples: int, content: bytes, tmp_path: Path
) -> None:
    path = tmp_path / "cut.mcap"

    @settings(max_examples=examples)
    @given(cut=st.integers(0, 1 << 20))
    def holds(cut: int) -> None:
        path.write_bytes(content[: cut % len(content)])
        try:
            found, _ = entries(path)
        except ArgumentError:
            return
        assert len(found) <= len(content)

    holds()


@pytest.mark.parametrize("cut", [1, 2, 3])
def test_a_recording_of_parts_is_whole_only_if_every_part_is(cut: int, content: bytes, tmp_path: Path) -> None:
    for number in (1, 2, 3):
        end = len(content) // 2 if number == cut else len(content)
        part_of(tmp_path / "run.mcap", number).write_bytes(content[:end])
    assert not entries(tmp_path / "run.mcap")[1].is_complete
    assert not run_of(read_recording(tmp_path / "run.mcap")).is_whole
    part_of(tmp_path / "run.mcap", cut).write_bytes(content)
    assert entries(tmp_path / "run.mcap")[1].is_complete


def test_every_chunk_can_be_read_without_those_before_it(content: bytes, tmp_path: Path) -> None:
    path, broken = tmp_path / "run.mcap", bytearray(content)
    _, begin, end = next(each for each in records(content) if each[0] == CHUNK)
    broken[(begin + end) // 2] ^= 0xFF
    path.write_bytes(broken)
    found, health = entries(path)
    assert (health.damaged, health.is_complete) == (1, True)
    assert {each.topic for each in found} >= {"/calls", "/outcomes", "/bytes", "/readings/proximity", "/notes"}
    assert sum(each.topic == "/calls" for each in found) >= CALLS - 10


@pytest.mark.parametrize("kind", [CHUNK, MESSAGE_INDEX])
@pytest.mark.parametrize("bits", [0x3, 0x600, 1 << 20, 1 << 40])
def test_a_damaged_length_costs_at_most_its_own_chunk(kind: int, bits: int, content: bytes, tmp_path: Path) -> None:
    path, broken = tmp_path / "run.mcap", bytearray(content)
    path.write_bytes(content)
    everything = entries(path)[0]
    _, begin, _ = [each for each in records(content) if each[0] == kind][2]
    broken[begin + 1 : begin + 9] = struct.pack("<Q", struct.unpack_from("<Q", content, begin + 1)[0] ^ bits)
    path.write_bytes(broken)
    found, health = entries(path)
    assert health.is_complete
    calls = [sum(each.topic == "/calls" for each in some) for some in (everything, found)]
    assert calls[0] - calls[1] <= (5 if kind == CHUNK else 0)
    assert (found == everything) or kind == CHUNK
    assert all(each in everything for each in found)


def test_a_length_beyond_the_end_is_not_read(content: bytes, tmp_path: Path) -> None:
    path, broken = tmp_path / "run.mcap", bytearray(content)
    _, begin, _ = [each for each in records(content) if each[0] == MESSAGE_INDEX][-1]
    broken[begin + 3] ^= 0xFF
    path.write_bytes(broken)
    done = repair(path)
    assert (done.health.damaged, done.lost) == (0, len(content) - begin)
    assert done.messages == len(entries(path)[0]) > 0


def test_reading_goes_on_behind_damage_a_limited_number_of_times(
    content: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.mcap"
    beginning = next(begin for kind, begin, _ in records(content) if kind == CHUNK)
    too_long = struct.pack("<BQ", METADATA, 1 << 62)
    path.write_bytes(content[:beginning] + (chunk_of(1, b"", "", b"x") + too_long) * 50)
    assert entries(path)[1].damaged == 99
    monkeypatch.setattr("elib.records.mcapreader.MAX_GAPS", 10)
    assert entries(path)[1].damaged == 20


@EXAMPLES
def test_a_damaged_file_raises_nothing_but_argument_errors(
    examples: int, whole: Path, content: bytes, tmp_path: Path
) -> None:
    path = tmp_path / "damaged.mcap"
    everything = {(each.time, each.topic, str(each.data)) for each in entries(whole)[0]}

    @settings(max_examples=examples)
    @given(damage=DAMAGE)
    def holds(damage: list[tuple[int, int]]) -> None:
        path.write_bytes(damaged(content, damage))
        try:
            recording = read_recording(path)
            found = list(recording.entries())
            recording.exchange()
            recording.path(measured=True)
            summary_of(recording)
        except ArgumentError:
            return
        # Chunks have a checksum, and name their topics: what is read was written so.
        assert {(each.time, each.topic, str(each.data)) for each in found} <= everything

    holds()


@EXAMPLES
def test_rubbish_behind_the_beginning_raises_nothing(examples: int, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "rubbish.mcap"
    beginning = next(begin for kind, begin, _ in records(content) if kind == CHUNK)

    @settings(max_examples=examples)
    @given(tail=st.binary(max_size=300))
    def holds(tail: bytes) -> None:
        path.write_bytes(content[:beginning] + tail)
        assert entries(path)[0] == []

    holds()


def test_a_claimed_length_fills_no_memory(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "long.mcap"
    beginning = next(begin for kind, begin, _ in records(content) if kind == CHUNK)
    path.write_bytes(content[:beginning] + struct.pack("<BQ", CHUNK, 1 << 62) + b"x" * 100)
    assert entries(path)[0] == []


def test_a_chunk_without_a_checksum_is_not_believed(content: bytes, tmp_path: Path) -> None:
    path, broken = tmp_path / "run.mcap", bytearray(content)
    _, begin, _ = next(each for each in records(content) if each[0] == CHUNK)
    broken[begin + 9 + 24 : begin + 9 + 28] = bytes(4)
    path.write_bytes(broken)
    assert entries(path)[1].damaged == 1


# -- repair ----------------------------------------------------------------------------------------------------------


def test_a_cut_file_is_repaired_beside_the_old_one(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(content[: len(content) // 2])
    before = path.read_bytes()
    found, _ = entries(path)
    done = repair(path)
    assert done.path == repaired_name(path) == tmp_path / "cut.repaired.mcap"
    assert path.read_bytes() == before
    assert done.messages == len(found) > 0
    assert done.lost == len(before) - done.health.ends_at > 0
    again, health = entries(done.path)
    assert again == found
    assert health.is_complete
    assert [(each.topic, each.data) for each in read(done.path)] == [(each.topic, each.data) for each in found]
    assert read_recording(done.path).about["repaired"] == "cut.mcap"
    assert read_recording(done.path).scene == read_recording(path).scene != ""


def test_a_damaged_file_is_repaired_without_what_is_damaged(content: bytes, tmp_path: Path) -> None:
    path, broken = tmp_path / "run.mcap", bytearray(content)
    _, begin, end = [each for each in records(content) if each[0] == CHUNK][2]
    broken[(begin + end) // 2] ^= 0xFF
    path.write_bytes(broken)
    done = repair(path, tmp_path / "new.mcap")
    assert done.health.damaged == 1
    assert entries(done.path) == (entries(path)[0], Health(True, 0, done.messages, done.path.stat().st_size))


def test_a_repair_replaces_nothing_and_leaves_no_half_file(whole: Path, tmp_path: Path) -> None:
    (tmp_path / "there.mcap").touch()
    with pytest.raises(ArgumentError, match="exists"):
        repair(whole, tmp_path / "there.mcap")
    with pytest.raises(ArgumentError, match="exists"):
        repair(whole, whole)
    with pytest.raises(ArgumentError, match=r"must end in \.mcap"):
        repair(whole, tmp_path / "new.txt")
    with pytest.raises(ArgumentError, match="cannot be read"):
        repair(tmp_path / "none.mcap")
    assert [each.name for each in tmp_path.iterdir()] == ["there.mcap"]


@EXAMPLES
def test_whatever_is_repaired_is_whole_afterwards(examples: int, content: bytes, tmp_path: Path) -> None:
    path, new = tmp_path / "run.mcap", tmp_path / "new.mcap"

    @settings(max_examples=examples)
    @given(damage=DAMAGE)
    def holds(damage: list[tuple[int, int]]) -> None:
        path.write_bytes(damaged(content, damage))
        new.unlink(missing_ok=True)
        try:
            done = repair(path, new)
            repaired: Recording = read_recording(done.path)
        except ArgumentError:
            return
        assert summary_of(repaired).is_complete
        assert len(read(done.path)) == done.messages

    holds()
