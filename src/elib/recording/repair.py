"""A recording that was cut or damaged, written anew: everything that is whole, with an index behind it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from elib.errors import ArgumentError, ElibError
from elib.recording.mcapfile import exists
from elib.recording.mcapwriter import McapWriter
from elib.recording.reading import Health, Recording, records_of
from elib.recording.topics import ABOUT


@dataclass(frozen=True, slots=True)
class Repaired:
    """What became of a file.

    Attributes:
        path: Of the new file.
        health: In what state the old one was found.
        lost: Bytes at its end that could not be read.
        messages: That the new file has.
    """

    path: Path
    health: Health
    lost: int
    messages: int


def repaired_name(path: Path) -> Path:
    """Return what the repaired file is called unless somebody names it: ``run.repaired.mcap``."""
    return path.with_name(f"{path.stem}.repaired{path.suffix}")


def repair(path: str | os.PathLike[str], target: str | os.PathLike[str] | None = None) -> Repaired:
    """Write a complete file with all that can be read of one file of a recording, which stays as it is.

    Args:
        path: Of the file, or of one part.
        target: Of the new file; next to the old one if None.

    Returns:
        What was found and written.

    Raises:
        ArgumentError: It is no recording, or the new file exists, or there can be none there.
        ElibError: The new file could not be written: the disk is full.
    """
    path = Path(path)
    target = repaired_name(path) if target is None else Path(target)
    Recording(path)  # says so if it is none
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
        target.unlink()  # half of it would be one more to be repaired
        if isinstance(error, OSError):
            raise ElibError(
                f"{os.fspath(target)!r} cannot be written: {error.strerror}", hint="is there room on the disk?"
            ) from error
        raise
    return Repaired(target, health, max(0, path.stat().st_size - health.ends_at), writer.count)


def _copy(path: Path, health: Health, writer: McapWriter) -> None:
    schemas: dict[int, tuple[str, bytes]] = {}
    numbers: dict[int, int] = {}
    for record in records_of(path, health):
        match type(record).__name__:
            case "Metadata":
                more = {"repaired": path.name} if record.name == ABOUT else {}
                writer.add_metadata(record.name, {**record.metadata, **more})
            case "Attachment":
                writer.add_attachment(record.log_time, record.name, record.media_type, record.data)
            case "Schema":
                schemas[record.id] = record.name, record.data
            case "Channel":
                # The chunk that had the schema may be lost.
                if record.id not in numbers:
                    numbers[record.id] = writer.register(record.topic, *schemas.get(record.schema_id, ("", b"{}")))
            case "Message":
                if record.channel_id in numbers:
                    writer.add_message(numbers[record.channel_id], record.log_time, record.data)


__all__ = ["Repaired", "repair", "repaired_name"]
