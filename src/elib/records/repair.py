"""Repair of a recording that was cut off or damaged: a new file with all that is whole, and an index."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from elib.base.errors import ArgumentError, ElibError
from elib.records.mcapfile import exists
from elib.records.mcapreader import Health, records_of
from elib.records.mcapwriter import McapWriter
from elib.records.reader import Recording
from elib.records.topics import ABOUT


@dataclass(frozen=True, slots=True)
class Repaired:
    """Result of a repair."""

    path: Path
    health: Health  # state of the old file
    lost: int  # number of bytes at the end of the old file that could not be read
    messages: int  # number of messages in the new file


def repaired_name(path: Path) -> Path:
    """Return the default name of the repaired file, such as ``run.repaired.mcap``."""
    return path.with_name(f"{path.stem}.repaired{path.suffix}")


def repair(path: str | os.PathLike[str], target: str | os.PathLike[str] | None = None) -> Repaired:
    """Write a complete file with all that can be read of one file of a recording; the old file does not change."""
    path = Path(path)
    target = repaired_name(path) if target is None else Path(target)
    Recording(path)  # raises an error if the file is not a recording
    if target.suffix.lower() != ".mcap":
        raise ArgumentError(f"a recording cannot be called {os.fspath(target)!r}; its name must end in .mcap")
    health = Health()
    try:
        stream = open(target, "xb", buffering=0)  # noqa: SIM115  # closed below
    except FileExistsError:
        raise exists(target) from None
    except OSError as error:
        raise ArgumentError(
            f"{os.fspath(target)!r} cannot be written: {error.strerror}", hint="does its folder exist, and is it yours?"
        ) from None
    try:
        with stream:
            writer = McapWriter(stream, "elib")
            _copy(path, health, writer)
            writer.finish()
    except BaseException as error:
        target.unlink()  # half a file would need a repair again
        if isinstance(error, OSError):
            raise ElibError(
                f"{os.fspath(target)!r} cannot be written: {error.strerror}", hint="is there room on the disk?"
            ) from error
        raise
    return Repaired(target, health, max(0, path.stat().st_size - health.ends_at), writer.count)


def _copy(path: Path, health: Health, writer: McapWriter) -> None:
    from mcap.records import Attachment, Channel, Message, Metadata, Schema

    schemas: dict[int, tuple[str, bytes]] = {}
    numbers: dict[int, int] = {}
    for record in records_of(path, health):
        match record:
            case Metadata():
                more = {"repaired": path.name} if record.name == ABOUT else {}
                writer.add_metadata(record.name, {**record.metadata, **more})
            case Attachment():
                writer.add_attachment(record.log_time, record.name, record.media_type, record.data)
            case Schema():
                schemas[record.id] = record.name, record.data
            case Channel():
                # The chunk with the schema may be lost.
                if record.id not in numbers:
                    numbers[record.id] = writer.register(record.topic, *schemas.get(record.schema_id, ("", b"{}")))
            case Message():
                if record.channel_id in numbers:
                    writer.add_message(numbers[record.channel_id], record.log_time, record.data)
