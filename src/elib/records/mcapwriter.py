"""A writer of MCAP files (format: https://mcap.dev/spec) that writes each chunk in one system call.

The writer of the package mcap (1.6) names a channel in one chunk only, so that a damaged chunk costs all later messages
of its channels, and has no public way to name it again. It also takes 6 us for a message; this one takes 1 us. So only
the records of the package serve here, and messages and their indexes are packed by hand.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, BinaryIO, Final

if TYPE_CHECKING:
    from mcap.records import McapRecord

MAGIC: Final = b"\x89MCAP0\r\n"
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(2, 9)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX = range(9, 14)
CHUNK_SIZE = 1 << 20
"""Size of a full chunk, bytes before compression."""
LEVEL = 1
"""Level of zstd: it takes half the time of the usual level and makes a tenth more bytes."""
MAX_PACKED = 100
"""Largest ratio of compression of a chunk; a chunk that would exceed it is written uncompressed. Measured: 11 to 24. So
the reader can refuse a few bytes that unpack to gigabytes."""
_pack_message = struct.Struct("<BQHIQQ").pack


class McapWriter:
    """Writes an MCAP file into an empty stream: chunks of messages, then an index.

    Attributes:
        size: Number of bytes that were written.
        pending: Size of the unfinished chunk, bytes before compression.
    """

    def __init__(self, stream: BinaryIO, library: str) -> None:
        import zstandard
        from mcap.records import Header

        self._stream = stream
        self._compress = zstandard.ZstdCompressor(LEVEL).compress
        self.size = self.pending = 0
        self._unwritten: dict[int, bytes] = {}
        self._counts: dict[int, int] = {}
        self._span: tuple[int, int] | None = None
        # The index at the end, by the kinds of its records, in their order.
        self._index: dict[int, list[bytes]] = {
            kind: [] for kind in (SCHEMA, CHANNEL, STATISTICS, CHUNK_INDEX, ATTACHMENT_INDEX, METADATA_INDEX)
        }
        self.count = 0  # number of messages so far
        self._begin_chunk()
        self._write(MAGIC + _packed(Header("", library)))

    def add_metadata(self, name: str, entries: Mapping[str, str]) -> None:
        """Write a metadata record of names and values."""
        from mcap.records import Metadata, MetadataIndex

        record = _packed(Metadata(_text(name), {_text(key): _text(value) for key, value in entries.items()}))
        self._index[METADATA_INDEX].append(_packed(MetadataIndex(self.size, len(record), _text(name))))
        self._write(record)

    def add_attachment(self, time: int, name: str, media_type: str, data: bytes) -> None:
        """Attach a file; *time* in ns."""
        from mcap.records import Attachment, AttachmentIndex

        record = _packed(Attachment(time, time, _text(name), _text(media_type), data))
        index = AttachmentIndex(self.size, len(record), time, time, len(data), _text(name), _text(media_type))
        self._index[ATTACHMENT_INDEX].append(_packed(index))
        self._write(record)

    def register(self, topic: str, schema_name: str, schema: bytes) -> int:
        """Return the number of a new channel of JSON messages with a JSON schema."""
        from mcap.records import Channel, Schema

        number = len(self._index[CHANNEL]) + 1
        self._unwritten[number] = _packed(Schema(number, schema, "jsonschema", _text(schema_name)))
        self._index[SCHEMA].append(self._unwritten[number])
        self._index[CHANNEL].append(_packed(Channel(number, _text(topic), "json", {}, number)))
        self._counts[number] = 0
        return number

    def add_message(self, channel: int, time: int, data: bytes) -> None:
        """Add a message to the chunk; *time* in ns."""
        places = self._places.get(channel)
        if places is None:
            places = self._places[channel] = []
            # Every chunk repeats its channels, so that it can be read even if the chunks before it are lost.
            about = self._unwritten.pop(channel, b"") + self._index[CHANNEL][channel - 1]
            self._parts.append(about)
            self.pending += len(about)
        self.count = count = self.count + 1
        length = len(data)
        place = self.pending
        places += (time, place)
        self._parts += (_pack_message(MESSAGE, 22 + length, channel, count & 0xFFFFFFFF, time, time), data)
        self.pending = place = place + 31 + length
        if place >= CHUNK_SIZE:
            self.flush()

    def flush(self) -> None:
        """Write the chunk, if it has any messages."""
        from mcap.records import Chunk, ChunkIndex

        if not self._places:
            return
        records = b"".join(self._parts)
        packed, method = self._compress(records), "zstd"
        if len(records) > MAX_PACKED * len(packed):
            packed, method = records, ""
        times = [time for places in self._places.values() for time in places[::2]]
        first, last = min(times), max(times)
        chunk = _packed(Chunk(method, packed, last, first, zlib.crc32(records), len(records)))
        begin = place = self.size + len(chunk)
        offsets: dict[int, int] = {}
        indexes: list[bytes] = []
        for channel, places in self._places.items():
            self._counts[channel] += len(places) // 2
            offsets[channel] = place
            head = struct.pack("<BQHI", MESSAGE_INDEX, 6 + 8 * len(places), channel, 8 * len(places))
            indexes.append(head + struct.pack(f"<{len(places)}Q", *places))
            place += len(indexes[-1])
        sizes = len(packed), last, place - begin, offsets, first, len(records)
        self._index[CHUNK_INDEX].append(_packed(ChunkIndex(len(chunk), self.size, method, *sizes)))
        self._span = (first, last) if self._span is None else (min(first, self._span[0]), max(last, self._span[1]))
        self._begin_chunk()
        self._write(b"".join((chunk, *indexes)))

    def finish(self) -> None:
        """Write the last chunk and the index."""
        from mcap.records import DataEnd, Footer, Statistics, SummaryOffset

        self.flush()
        self._write(_packed(DataEnd(0)))
        count = {kind: len(records) for kind, records in self._index.items()}
        first, last = self._span or (0, 0)
        chunks, others, schemas = count[CHUNK_INDEX], count[METADATA_INDEX], count[SCHEMA]
        told = count[ATTACHMENT_INDEX], count[CHANNEL], self._counts, chunks, self.count, last, first, others, schemas
        self._index[STATISTICS] = [_packed(Statistics(*told))]
        start = self.size
        summary, offsets = b"", b""
        for kind, records in self._index.items():
            group = b"".join(records)
            if group:
                offsets += _packed(SummaryOffset(kind, start + len(summary), len(group)))
                summary += group
        end = summary + offsets + _packed(Footer(start, start + len(summary), 0))[:-4]
        self._write(end + struct.pack("<I", zlib.crc32(end)) + MAGIC)

    def _begin_chunk(self) -> None:
        self._parts: list[bytes] = []
        self.pending = 0
        self._places: dict[int, list[int]] = {}  # of each channel the time of each message and where it begins, in turn

    def _write(self, data: bytes) -> None:
        rest = memoryview(data)
        while rest:
            rest = rest[self._stream.write(rest) :]
        self.size += len(data)


def _packed(record: McapRecord) -> bytes:
    from mcap.data_stream import RecordBuilder

    builder = RecordBuilder()
    record.write(builder)
    return builder.end()  # type: ignore[no-any-return, no-untyped-call]  # half of the package has types


def _text(text: str) -> str:
    """Return a text with escapes for what no UTF-8 can hold."""
    return text.encode("utf-8", "backslashreplace").decode()
