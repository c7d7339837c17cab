"""Letting ``elib find`` know of a running simulation."""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from elib.transport.beacons import PATTERN, Beacon, folder, is_ours
from elib.transport.simulation import SimulationSettings


@contextlib.contextmanager
def announced(robots: Iterable[tuple[str, str]], settings: SimulationSettings) -> Iterator[None]:
    """Keep a record of the robots a simulation offers until the block is left.

    A simulation that cannot leave one goes on all the same: it is only harder to find.

    Args:
        robots: Name and URL of each way to a robot; a robot may have several.
        settings: What they were built from.
    """
    ways: dict[str, list[str]] = {}
    for name, url in robots:
        ways.setdefault(name, []).append(url)
    beacons = [Beacon(os.getpid(), name, tuple(urls), settings.firmware, settings.world) for name, urls in ways.items()]
    record = _write(beacons) if beacons else None
    try:
        yield
    finally:
        if record is not None:
            with contextlib.suppress(OSError):
                record.unlink()


def _write(beacons: list[Beacon]) -> Path | None:
    place = folder()
    before, after = PATTERN.split("*")
    with contextlib.suppress(OSError):
        place.mkdir(mode=0o700, exist_ok=True)
        if not is_ours(place):
            return None
        handle, draft = tempfile.mkstemp(prefix=f"{before}{os.getpid()}-", suffix=".draft", dir=place)
        with open(handle, "w", encoding="utf-8") as file:
            json.dump([beacon.to_json() for beacon in beacons], file)
        record = Path(draft).with_suffix(after)
        Path(draft).replace(record)  # whoever looks now finds all of it or nothing
        return record
    return None
