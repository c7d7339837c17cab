"""Reads MCAP files record by record; a file that was cut off or damaged is read as far as it is whole."""

from __future__ import annotations

import io
import os
import re
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from elib.base.errors import ArgumentError
from elib.base.files import open_file, reason_of
from elib.records.mcapwriter import (
    ATTACHMENT,
    CHANNEL,
    CHUNK,
    CHUNK_SIZE,
    FOOTER,
    MAGIC,
    MAX_PACKED,
    MESSAGE,
    METADATA,
    SCHEMA,
)

if TYPE_CHECKING:
    from mcap.records import Chunk, McapRecord

MAX_CHUNK = 1 << 24
"""Bytes of an unpacked chunk. A larger one is damaged: chunks of elib have 1 MiB, those of other tools 4 MiB."""
MAX_RECORD = MAX_CHUNK + (1 << 16)
"""Bytes of any other record. A longer one is damaged, too."""
MAX_GAPS = 1000
"""Times that reading begins: a crafted file could have a long record read again behind each damaged one."""


@dataclass(slots=True)
class Health:
    """The state of a file."""

    is_complete: bool = False  # whether the file was closed properly, with its index
    damaged: int = 0  # number of chunks and messages that could not be read
    messages: int = 0  # number of messages that could be read
    ends_at: int = 0  # number of bytes of the file that could be read

    @property
    def is_whole(self) -> bool:
        """Whether the file was closed properly and is not damaged."""
        return self.is_complete and not self.damaged


def records_of(path: Path, health: Health, *, only_header: bool = False) -> Iterator[McapRecord]:
    """Yield the records of an MCAP file, also those inside chunks, as far as they are whole.

    The state of the file is noted in *health*. With *only_header* it stops at the first chunk.
    """
    from mcap.records import Chunk, Message

    try:
        stream = open_file(path)
    except (OSError, ValueError) as error:
        raise ArgumentError(f"{os.fspath(path)!r} cannot be read: {reason_of(error)}") from None
    with stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise ArgumentError(
                f"{os.fspath(path)!r} is not an MCAP file", hint="robot.record(FILE) and elib record FILE write them"
            )
        for record in _records_in(stream, health):
            if not isinstance(record, Chunk):
                yield record
            elif only_header:
                return
            else:
                try:
                    for part in _parts_in(_unpacked(record)):
                        health.messages += isinstance(part, Message)
                        yield part
                except _Damaged:
                    health.damaged += 1
                    continue
            health.ends_at = stream.tell()


def _records_in(stream: BinaryIO, health: Health) -> Iterator[McapRecord]:
    """Yield the whole records of a file, and chunks as they are. What stands between two of them is damaged."""
    from mcap.exceptions import McapError

    size = os.fstat(stream.fileno()).st_size
    begin, last = stream.tell(), 0  # where the record begins, and the last chunk
    for _ in range(MAX_GAPS):
        try:
            kind = 0
            while kind != FOOTER:
                kind, length = _HEAD.unpack(stream.read(_HEAD.size))
                if length > min(MAX_RECORD, size - stream.tell()):
                    raise EOFError  # it must neither fill the memory nor pass for a record
                record = _record(kind, stream.read(length))
                if kind == CHUNK:
                    last = begin
                begin = stream.tell()
                if record:
                    yield record
                else:
                    health.ends_at = begin
            if stream.read(len(MAGIC)) != MAGIC:
                raise EOFError
            health.is_complete, health.ends_at = True, stream.tell()
            return
        except (McapError, EOFError, struct.error, ValueError, UnicodeDecodeError):
            # What was read since the last chunk may hold others: perhaps the length of a record is damaged.
            found = _next_chunk(stream, last + 1, size)
        if found is None:
            return  # the file is cut off here; all whole records were yielded
        health.damaged += 1
        begin = stream.seek(found)


def _next_chunk(stream: BinaryIO, place: int, size: int) -> int | None:
    """Return where the next whole chunk begins, from *place* on; the two lengths in its head fit each other."""
    while place < size:
        stream.seek(place)
        for head in _CHUNK_HEAD.finditer(stream.read(CHUNK_SIZE)):
            length, packed = (int.from_bytes(head[each], "little") for each in (1, 3))
            begin = place + head.start()
            if length == 36 + len(head[2]) + packed and begin + _HEAD.size + length <= size:
                return begin
        place += CHUNK_SIZE - 64  # a head is shorter
    return None


class _Damaged(Exception):
    """A chunk cannot be read."""


def _record(kind: int, data: bytes) -> McapRecord | None:
    """Return a record; None for one that only helps to find others: to read the indexes takes a third of all time."""
    from mcap import records
    from mcap.data_stream import ReadDataStream

    if kind == MESSAGE:
        channel, sequence, logged, published = _MESSAGE.unpack_from(data)
        return records.Message(channel, logged, data[_MESSAGE.size :], published, sequence)
    forms: Mapping[int, Any] = {
        SCHEMA: records.Schema,
        CHANNEL: records.Channel,
        CHUNK: records.Chunk,
        ATTACHMENT: records.Attachment,
        METADATA: records.Metadata,
    }
    return forms[kind].read(ReadDataStream(io.BytesIO(data))) if kind in forms else None


def _unpacked(chunk: Chunk) -> bytes:
    """Return the unpacked records of a chunk.

    Raises:
        _Damaged: The data do not match the chunk's header, or would unpack to far more: a few bytes can claim to be
            gigabytes.
    """
    size = chunk.uncompressed_size
    if size > MAX_CHUNK or (chunk.compression and size > MAX_PACKED * len(chunk.data)):
        raise _Damaged
    try:
        data = _DECOMPRESSORS[chunk.compression](chunk.data, size)
    except Exception:  # damaged data can raise anything in a decompressor
        raise _Damaged from None
    # A chunk without a checksum has 0 there; it is refused.
    if len(data) != size or zlib.crc32(data) != chunk.uncompressed_crc or not chunk.uncompressed_crc:
        raise _Damaged
    return data


def _unpack_zstd(data: bytes, size: int) -> bytes:
    import zstandard

    if zstandard.frame_content_size(data) > size:  # zstandard would allocate that much
        raise _Damaged
    return zstandard.ZstdDecompressor(max_window_size=MAX_CHUNK).decompress(data, max_output_size=size)


def _unpack_lz4(data: bytes, size: int) -> bytes:
    import lz4.frame

    found: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    return found


_DECOMPRESSORS: Mapping[str, Callable[[bytes, int], bytes]] = {
    "": lambda data, size: data,
    "zstd": _unpack_zstd,
    "lz4": _unpack_lz4,
}


def _parts_in(data: bytes) -> Iterator[McapRecord]:
    """Yield the schemas, channels and messages of a chunk one by one: there may be half a million.

    Raises:
        _Damaged: A record is not whole.
    """
    from mcap.exceptions import McapError
    from mcap.records import Message

    place = 0
    try:
        while place < len(data):
            kind, length = _HEAD.unpack_from(data, place)
            begin, place = place + _HEAD.size, place + _HEAD.size + length
            if place > len(data):
                raise _Damaged
            if kind == MESSAGE:
                channel, sequence, logged, published = _MESSAGE.unpack_from(data, begin)
                yield Message(channel, logged, data[begin + _MESSAGE.size : place], published, sequence)
            elif kind in (CHANNEL, SCHEMA) and (record := _record(kind, data[begin:place])):
                yield record
    except (struct.error, UnicodeDecodeError, McapError):
        raise _Damaged from None


_CHUNK_HEAD = re.compile(rb"\x06(?=(.{8}).{28}(\0{4}|\x04\0{3}zstd|\x03\0{3}lz4)(.{8}))", re.DOTALL)
"""The beginning of a chunk: its length, the name of its compression, and the length of what is packed."""
_HEAD, _MESSAGE = struct.Struct("<BQ"), struct.Struct("<HIQQ")
