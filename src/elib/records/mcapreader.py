"""Reads MCAP files record by record; a file that was cut off or damaged is read as far as it is whole."""

from __future__ import annotations

import io
import os
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, cast

from elib.base.errors import ArgumentError
from elib.base.files import open_file, reason_of
from elib.records.mcapwriter import CHANNEL, MAGIC, MAX_PACKED, MESSAGE, SCHEMA

if TYPE_CHECKING:
    from mcap.records import Chunk, McapRecord

MAX_CHUNK = 1 << 24
"""Bytes of an unpacked chunk. A larger one is damaged: chunks of elib have 1 MiB, those of other tools 4 MiB."""
MAX_RECORD = MAX_CHUNK + (1 << 16)
"""Bytes of any other record. A longer one is damaged, too."""


@dataclass(slots=True)
class Health:
    """The state of a file."""

    is_complete: bool = False  # whether the file was closed properly, with its index
    damaged: int = 0  # number of chunks and messages that could not be read
    messages: int = 0  # number of messages that could be read
    ends_at: int = 0  # number of bytes of the file that could be read


def records_of(path: Path, health: Health, *, only_header: bool = False) -> Iterator[McapRecord]:
    """Yield the records of an MCAP file, also those inside chunks, as far as they are whole.

    The state of the file is noted in *health*. With *only_header* it stops at the first chunk.
    """
    from mcap.exceptions import McapError
    from mcap.records import Chunk, Message
    from mcap.stream_reader import StreamReader

    try:
        stream = open_file(path)
    except (OSError, ValueError) as error:
        raise ArgumentError(f"{os.fspath(path)!r} cannot be read: {reason_of(error)}") from None
    with stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise ArgumentError(
                f"{os.fspath(path)!r} is not an MCAP file", hint="robot.record(FILE) and elib record FILE write them"
            )
        stream.seek(0)
        size = os.fstat(stream.fileno()).st_size
        reader = StreamReader(cast("Any", _Bounded(stream, size)), emit_chunks=True, record_size_limit=MAX_RECORD)
        try:
            for record in reader.records:
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
                        health.damaged += stream.tell() < size  # the last chunk is cut off, not damaged
                        continue
                health.ends_at = stream.tell()
            health.is_complete, health.ends_at = True, stream.tell()
        except (McapError, EOFError, struct.error, ValueError, UnicodeDecodeError):
            return  # the file is cut off here; all whole records were yielded


class _Damaged(Exception):
    """A chunk cannot be read."""


class _Bounded:
    """A file that never returns more than it has: a damaged length must not make the reader fill the memory."""

    def __init__(self, stream: BinaryIO, size: int) -> None:
        self._stream, self._size = stream, size

    def read(self, length: int) -> bytes:
        """Return *length* bytes, or what is left; never more than a record may have."""
        return self._stream.read(max(0, min(length, MAX_RECORD, self._size - self._stream.tell())))


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
    from mcap.data_stream import ReadDataStream
    from mcap.exceptions import McapError
    from mcap.records import Channel, Message, Schema

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
            elif kind in (CHANNEL, SCHEMA):
                form = Channel if kind == CHANNEL else Schema
                yield form.read(ReadDataStream(io.BytesIO(data[begin:place])))
    except (struct.error, UnicodeDecodeError, McapError):
        raise _Damaged from None


_HEAD, _MESSAGE = struct.Struct("<BQ"), struct.Struct("<HIQQ")
