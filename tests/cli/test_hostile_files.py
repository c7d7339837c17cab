"""Files of strangers: whatever stands in them, no command ends in a traceback, hangs, or fills the memory."""

from __future__ import annotations

import copy
import json
import os
import random
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import zstandard
from mcap.reader import make_reader

import elib
from elib.records.mcapwriter import CHANNEL, CHUNK, MESSAGE, McapWriter
from elib.records.recorder import Recorder
from elib.records.topics import ABOUT, WORLD_FILE
from elib.robot.runner import run_on

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="no bound on the memory of a process")
HARNESS = Path(__file__).with_name("hostile_files.py")
DEEP = "[" * 100_000
LONG = int("9" * 400)
JUNK: tuple[Any, ...] = (
    None, True, -1, 0, 1e300, LONG, "", "x" * 5000, "\x1b[31m", "$\\frac$", "../..", "nan", [], [[]], {}, {"x": 1},
    [1, "a", None], 2**63, -0.0, "\ud800", [0.5] * 40,
)  # fmt: skip

Message = tuple[str, Any]
Book = tuple[dict[str, str], str, list[Message]]
"""What a recording says of itself, its world, and its messages."""


def _record(kind: int, *fields: bytes) -> bytes:
    body = b"".join(fields)
    return struct.pack("<BQ", kind, len(body)) + body


def _long(data: bytes) -> bytes:
    return struct.pack("<Q", len(data)) + data


def _text(text: str) -> bytes:
    return struct.pack("<I", len(text)) + text.encode()


async def drive(robot: elib.Epuck, recorder: Recorder) -> None:
    await robot.set_speed(0.5, 0.4)
    for number in range(6):
        await robot.encoders()
        await robot.proximity()
        recorder.note(f"{number}", kind="state")
    recorder.measured(0.5, 0.5, 0.1)
    await robot.sensors()
    await robot.image()
    await robot.stop()


@pytest.fixture(scope="module")
def book(tmp_path_factory: pytest.TempPathFactory) -> Book:
    path = tmp_path_factory.mktemp("hostile") / "run.mcap"

    async def program(robot: elib.Epuck) -> None:
        with robot.record(path) as recorder:
            await drive(robot, recorder)

    run_on("sim://soccer?speed=max&seed=5", program)
    with path.open("rb") as stream:
        reader = make_reader(stream)
        about = next(each.metadata for each in reader.iter_metadata() if each.name == ABOUT)
        scene = next(each.data.decode() for each in reader.iter_attachments() if each.name == WORLD_FILE)
        messages = [
            (channel.topic, json.loads(message.data))
            for _, channel, message in reader.iter_messages(log_time_order=False)
        ]
    return about, scene, messages


def write(path: Path, book: Book) -> Path:
    """Write a recording with these messages; bytes go into it as they are."""
    about, scene, messages = book
    with path.open("xb") as stream:
        writer = McapWriter(stream, "test")
        writer.add_metadata(ABOUT, about)
        writer.add_attachment(0, WORLD_FILE, "application/toml", scene.encode())
        numbers: dict[str, int] = {}
        for topic, data in messages:
            if topic not in numbers:
                numbers[topic] = writer.register(topic, "x", b"{}")
            content = data if isinstance(data, bytes) else json.dumps(data).encode()
            writer.add_message(numbers[topic], 0, content)
        writer.finish()
    return path


def mutated(book: Book, chance: random.Random) -> Book:
    """Return a recording that differs in some places."""
    about, scene, messages = dict(book[0]), book[1], copy.deepcopy(book[2])
    for _ in range(chance.choice((1, 1, 3, 10))):
        place = chance.randrange(len(messages))
        topic, data = messages[place]
        match chance.randrange(8):
            case 0:
                messages[place] = topic, chance.choice(JUNK)
            case 1:
                messages[place] = chance.choice(messages)[0], data
            case 2:
                messages[place] = topic, DEEP.encode()
            case 3:
                del messages[place]
            case 4 if about:
                key = chance.choice(list(about))
                about[key] = chance.choice(("", "nan", "-1", "1e999", "x\x1b[2J", "9" * 5000, "sim://", "sim://x?a=b"))
            case 5 if about:
                del about[chance.choice(list(about))]
            case _:
                inside = [each for each in _containers(data) if each]
                if inside:
                    box = chance.choice(inside)
                    key = chance.choice(list(box) if isinstance(box, dict) else range(len(box)))
                    if chance.random() < 0.3:
                        del box[key]
                    else:
                        box[key] = chance.choice(JUNK)
    if chance.random() < 0.1:
        scene = scene.replace(chance.choice(scene.split()), chance.choice(("", "[[[", "1e400", "'")), 1)
    return about, scene, messages


def _containers(value: Any) -> Iterator[Any]:
    if isinstance(value, dict | list):
        yield value
        for each in value.values() if isinstance(value, dict) else value:
            yield from _containers(each)


def bomb(path: Path, size: int, method: str, about: dict[str, str]) -> Path:
    """Write a recording whose only chunk unpacks to *size* zeros."""
    zeros = bytes(1 << 20)
    if method == "zstd":
        packer = zstandard.ZstdCompressor(1).compressobj(size=size)
        packed = b"".join(packer.compress(zeros) for _ in range(size >> 20)) + packer.flush()
    else:
        import lz4.frame

        frame = lz4.frame.LZ4FrameCompressor(block_size=lz4.frame.BLOCKSIZE_MAX4MB)
        packed = frame.begin() + b"".join(frame.compress(zeros) for _ in range(size >> 20)) + frame.flush()
    with path.open("xb") as stream:
        McapWriter(stream, "test").add_metadata(ABOUT, about)
        head = struct.pack("<QQQI", 0, 0, size, 1)
        stream.write(_record(CHUNK, head, _text(method), _long(packed)))
    return path


def many(path: Path, book: Book, topic: str, message: bytes, chunks: int = 12) -> Path:
    """Write a small recording in which millions of messages lie packed, with whole checksums."""
    with path.open("xb") as stream:
        writer = McapWriter(stream, "test")
        writer.add_metadata(ABOUT, book[0])
        channel = struct.pack("<HH", 1, 0) + _text(topic) + _text("json") + _long(b"")[:4]
        inside = _record(CHANNEL, channel)
        one = _record(MESSAGE, struct.pack("<HIQQ", 1, 0, 0, 0), message)
        inside += one * (((15 << 20) - len(inside)) // len(one))
        head = struct.pack("<QQQI", 0, 0, len(inside), zlib.crc32(inside))
        chunk = _record(CHUNK, head, _text("zstd"), _long(zstandard.compress(inside, 3)))
        stream.write(chunk * chunks)
    assert path.stat().st_size < 200_000
    return path


def judged(folder: Path, lines: list[list[str]]) -> dict[str, Any]:
    """Run command lines in a process with little memory; fail if one ends in a traceback."""
    asked = folder / "lines.json"
    asked.write_text(json.dumps(lines))
    quiet = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "agg", "PYTHONFAULTHANDLER": "1"}
    done = subprocess.run(
        [sys.executable, str(HARNESS), str(asked)],
        capture_output=True, text=True, timeout=900, cwd=folder, env=quiet, stdin=subprocess.DEVNULL, check=False,
    )  # fmt: skip
    said = [json.loads(line) for line in done.stdout.splitlines()]
    found = [f"elib {' '.join(each['words'])}\n{each['found']}" for each in said if "words" in each]
    assert not found, f"{len(found)} of {len(lines)}:\n" + "\n".join(found[:20])
    assert done.returncode == 0, done.stderr[-3000:]
    last: dict[str, Any] = said[-1]
    assert last["count"] == len(lines)
    return last


Lines = list[list[str]]
Writer = Callable[[Path, Book], Lines]
"""Writes files into a folder and returns the command lines that read them."""


def recordings(folder: Path, book: Book) -> Lines:
    chance = random.Random(13)
    readers: list[Callable[[str], list[str]]] = [
        lambda file: ["record", "info", file],
        lambda file: ["record", "info", file, "--json"],
        lambda file: ["record", "repair", file],
        lambda file: ["replay", file],
        lambda file: ["replay", file, "--json"],
        lambda file: ["decode", file],
        lambda file: ["compare", file, "whole.mcap"],
        lambda file: ["compare", "whole.mcap", file, "--json"],
        lambda file: ["send", "proximity", "--robot", f"replay://{file}"],
        lambda file: ["send", "proximity", "--robot", f"replay://{file}?fork=0.1&speed=max"],
    ]
    write(folder / "whole.mcap", book)
    lines = []
    for number in range(24):
        file = write(folder / f"{number}.mcap", mutated(book, chance)).name
        lines += [read(file) for read in chance.sample(readers, 2)]
    for number in range(24, 26):
        file = write(folder / f"{number}.mcap", mutated(book, chance)).name
        lines += [["compare", file], ["fit", file], ["replay", file, "--plot", f"{number}.png"]]
    return lines


def bombs(folder: Path, book: Book) -> Lines:
    about = book[0]
    note = json.dumps(next(data for topic, data in book[2] if topic == "/notes")).encode()
    files = [
        bomb(folder / "zstd.mcap", 1 << 30, "zstd", about),
        bomb(folder / "lz4.mcap", 1 << 29, "lz4", about),
        many(folder / "empty.mcap", book, "/notes", b"{}"),
        many(folder / "notes.mcap", book, "/notes", note),
        many(folder / "readings.mcap", book, "/readings/proximity", b'{"time":1.0,"left":1}'),
    ]
    lines = [["record", "info", file.name] for file in files]
    for file in files[-2:]:
        lines += [[*words, file.name] for words in (["replay", "--json"], ["record", "repair"], ["decode"], ["fit"])]
    return lines


TOML = (
    b"a" + b".a" * 50_000 + b" = 1",
    b"x = " + b"[" * 100_000,
    b"x = " + b"{x = " * 100_000,
    b"x = " + b"9" * 5000,
    b"seed = 0x" + b"f" * 5000,
    b"[" + b"a." * 50_000 + b"a]",
    b"description = '\x1b[2J'\nx = 1",
    b"description = 1e400",
    b"\xff\xfe\x00",
    b'description = ""\n[[fault]]\nkind = "loss"\nprobability = 0x' + b"f" * 5000,
    b'description = ""\n' + b"[[fault]]\n" * 50_000,
    b"",
)
STATES = (
    DEEP.encode(),
    b'{"a":' * 50_000,
    b'{"selector": ' + b"9" * 5000 + b"}",
    b'{"selector": ' + b"9" * 4000 + b"}",
    b'{"selector": NaN}',
    b'{"mag": [1e999, 0, 0]}',
    b'{"prox": [' + b"0," * 100_000 + b"0]}",
    b'{"\\u001b[2J": 1}',
    b'{"motor_time": "' + b"\\ud800" * 1000 + b'"}',
    b'{"camera": 12336.5, "tof": true}',
    b"\xff",
    b"",
    b" " * 2_000_000,
)


def texts(folder: Path, book: Book) -> Lines:
    chance = random.Random(14)
    os.mkfifo(folder / "pipe.toml")
    special = ["pipe.toml", "/dev/zero", ".", "none.toml"]
    tomls = list(special)
    good = b'description = "x"\nseed = 1\n[[fault]]\nkind = "delay"\nfrom = 1\nuntil = 3\ndelay = [0.0, 0.4]\n'
    for number, content in enumerate([*TOML, *(_spoilt(good, chance) for _ in range(6))]):
        (folder / f"{number}.toml").write_bytes(content)
        tomls.append(f"{number}.toml")
    lines = []
    for name in tomls:
        path = name if name.startswith("/") else f"./{name}"
        readers = [
            ["send", "version", "--robot", f"sim://?speed=max&fault={path}"],
            ["send", "version", "--robot", f"sim://?speed=max&profile={path}"],
            ["world", "check", path],
        ]
        lines += readers if name in special else chance.sample(readers, 1 + (chance.random() < 0.5))
    states = list(special)
    for number, content in enumerate([*STATES, *(_spoilt(b'{"selector": 3, "tof": 12}', chance) for _ in range(6))]):
        (folder / f"{number}.json").write_bytes(content)
        states.append(f"{number}.json")
    lines += [["send", "selector", "--robot", f"sim://?speed=max&hardware={name}"] for name in states]
    return lines + [[*words, name] for name in special[:3] for words in (["record", "info"], ["replay"], ["fit"])]


def captures(folder: Path, book: Book) -> Lines:
    chance = random.Random(15)
    good = b"> 44 0d\n< 64 0d 0a\n> 56 0d\n< 76 2c 56 65 72 73 69 6f 6e 20 31 0d 0a\n"
    contents = [
        chance.randbytes(20_000),
        b"\x1b[2J" * 2000,
        b"v,Version 1.1.3 \x1b[2J\r\n" * 50,
        b"> " * 100_000,
        DEEP.encode(),
    ]
    contents += [_spoilt(good, chance) for _ in range(10)]
    lines = []
    for number, content in enumerate(contents):
        (folder / f"{number}.bin").write_bytes(content)
        lines.append(["decode", f"{number}.bin", *chance.choice(([], ["--as", "hex"], ["--as", "raw"], ["--json"]))])
    return lines


def _spoilt(content: bytes, chance: random.Random) -> bytes:
    """Return content of which some bytes are others, are missing, or stand twice."""
    spoilt = bytearray(content)
    for _ in range(chance.randrange(1, 6)):
        place = chance.randrange(len(spoilt))
        match chance.randrange(3):
            case 0:
                spoilt[place] = chance.randrange(256)
            case 1:
                del spoilt[place : place + chance.randrange(1, 8)]
            case _:
                spoilt[place:place] = spoilt[place : place + chance.randrange(1, 30)]
        spoilt = spoilt or bytearray(content)
    return bytes(spoilt)


@LINUX
@pytest.mark.long
@pytest.mark.parametrize("files", [recordings, bombs, texts, captures])
def test_no_file_of_a_stranger_ends_a_command_in_a_traceback_or_fills_the_memory(
    files: Writer, book: Book, tmp_path: Path
) -> None:
    judged(tmp_path, files(tmp_path, book))


@LINUX
def test_some_files_of_strangers_of_every_kind_end_no_command_in_a_traceback(book: Book, tmp_path: Path) -> None:
    lines = [["record", "info", bomb(tmp_path / "bomb.mcap", 1 << 29, "zstd", book[0]).name]]
    for files in (recordings, texts, captures):
        lines += files(tmp_path, book)[::10]
    judged(tmp_path, lines)
