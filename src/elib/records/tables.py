"""The messages of a recording as tables: which columns they have, and their rows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias, get_type_hints

from elib.link.protocol.values import READING_TYPES, FieldInfo, Reading, Role, describe
from elib.records.encoding import MAX_FIELDS
from elib.records.topics import CALLS, MEASURED, NOTES, ODOMETRY, OUTCOMES, READINGS, WORLD

if TYPE_CHECKING:
    from numpy.typing import NDArray

Kind = Literal["text", "whole", "number", "truth"]
Cell: TypeAlias = str | int | float | None
Row: TypeAlias = tuple[Cell, ...]
Columns: TypeAlias = Mapping[str, Kind]
"""The columns of a table, in order, and what they hold."""
Table: TypeAlias = "dict[str, NDArray[Any]]"
"""A table by its columns: ``pandas.DataFrame`` takes it as it is."""

ROWS = 10_000
"""Rows that are gathered before they are passed on: some 10 MB."""
MAX_OPEN = 10_000
"""Calls without an outcome that are waited for; a robot has a handful."""
MAX_PADDING = 1 << 24
"""Characters, of 4 bytes, that the texts of a column may be padded with: NumPy makes all as wide as the longest one."""
MAX_NAME = 64
MAX_TABLES, MAX_KEYS = 64, 64
"""Readings of a recording, and fields of one: elib has some twenty of either. A damaged file may hold anything."""
_KINDS: Mapping[object, Kind] = {int: "whole", float: "number", bool: "truth", str: "text"}
_TYPES: Mapping[Kind, frozenset[type]] = {
    "whole": frozenset({int, type(None)}),
    "number": frozenset({int, float, type(None)}),
    "truth": frozenset({bool, type(None)}),
    "text": frozenset({str, type(None)}),
}
"""What a cell of a column may be: a damaged or foreign message may hold anything."""
_END: Columns = {"robot": "text", "origin": "text"}
_POSE: Columns = {"time": "number", "x": "number", "y": "number", "heading": "number", **_END}
FIXED: Final[Mapping[str, Columns]] = {
    "calls": {
        "time": "number",
        "call": "whole",
        "command": "text",
        "arguments": "text",
        "ok": "truth",
        "error": "text",
        "seconds": "number",
        "round_trip": "number",
        **_END,
    },
    "notes": {"time": "number", "kind": "text", "event": "text", "level": "whole", "text": "text", **_END},
    "odometry": _POSE,
    "measured": _POSE,
    "world": {
        "time": "number",
        "thing": "text",
        "number": "whole",
        "x": "number",
        "y": "number",
        "heading": "number",
        **_END,
    },
}
"""The tables that are not of readings."""
_SOURCES: Mapping[str, tuple[str, ...]] = {
    "calls": (CALLS.name, OUTCOMES.name),
    "notes": (NOTES.name,),
    "odometry": (ODOMETRY.name,),
    "measured": (MEASURED.name,),
    "world": (WORLD.name,),
}
"""The topics of each of them."""
_TABLES = {topic: name for name, topics in _SOURCES.items() for topic in topics}
_LISTS = {"robot": "robots", "box": "boxes", "cylinder": "cylinders"}
"""The things of a world, and the lists of ``/world`` that hold them."""


@dataclass(slots=True)
class _Layout:
    """How the rows of a reading are made."""

    columns: Columns
    # for each number its column's kind, its field, and its place if the field holds several
    cells: list[tuple[Kind, str, int | None]]

    @classmethod
    def of(cls, name: str, data: Mapping[str, Any]) -> _Layout:
        """Return the layout of a reading, given its first message."""
        kind = READING_TYPES.get(name, Reading)
        hints = get_type_hints(kind)
        known = {info.name: info for info in describe(kind)}
        columns: dict[str, Kind] = {}
        cells: list[tuple[Kind, str, int | None]] = []
        for key, value in islice(data.items(), MAX_KEYS):
            info = known.get(key) or FieldInfo(name=key)
            if info.role in (Role.STAMP, Role.CONSTANT) or isinstance(value, dict) or not key.isidentifier():
                continue
            places = range(len(value)) if isinstance(value, list) else (None,)
            if len(places) > MAX_FIELDS:
                continue  # samples of sound
            for place in places:
                holds = _kind_of(hints.get(key), info, value if place is None else value[place])
                columns[column_name(name, info, place)] = holds
                cells.append((holds, key, place))
        return cls({"time": "number", **columns, **_END}, cells)

    def row(self, data: Mapping[str, Any], robot: str) -> Row | None:
        """Return the row of a message; None if its fields are not those of the first message."""
        cells = []
        for kind, key, place in self.cells:
            cell = data.get(key)
            if place is not None:
                cell = cell[place] if isinstance(cell, list) and place < len(cell) else None
            if type(cell) not in _TYPES[kind]:
                return None
            cells.append(cell)
        return (data["time"], *cells, robot, str(data.get("origin", "")))


def column_name(reading: str, info: FieldInfo, place: int | None = None) -> str:
    """Return the name of a number in all tables: ``proximity_front_right``, ``ground_left``, ``accelerometer_g_x``."""
    if place is None:
        return f"{reading}_{info.name}"
    number = info.names[place] if place < len(info.names) else str(place)
    # The counts of a reading stand for themselves; the same numbers in another unit need its name.
    return f"{reading}_{number}" if info.names and info.role is Role.NUMBER else f"{reading}_{info.name}_{number}"


def _kind_of(hint: object, info: FieldInfo, value: object) -> Kind:
    """Return what a column holds, as the class of the reading says it; of an unknown one, as its first value does."""
    if hint in _KINDS:
        return _KINDS[hint]
    if info.names and info.role is Role.NUMBER:
        return "whole"
    return "text" if isinstance(value, str) else "truth" if isinstance(value, bool) else "number"


class Tabulator:
    """Makes the rows of tables from the messages of a recording, in order."""

    def __init__(self, about: Mapping[str, str]) -> None:
        self.columns: dict[str, Columns] = {}  # the columns of each table that has rows
        # number of readings that are left out: they have other fields than the first one of their kind, or a name that
        # no table can have
        self.misfits = 0
        self._robot = about.get("robot", "")
        self._end = (self._robot, about.get("origin", ""))
        self._layouts: dict[str, _Layout] = {}
        self._open: dict[int, list[Cell]] = {}

    def batches(self, messages: Iterable[tuple[str, Mapping[str, Any]]]) -> Iterator[tuple[str, list[Row]]]:
        """Yield the rows of all tables, many of one table at a time; the rows of a table come in their order.

        Args:
            messages: For each message its topic, and its fields, which the reader has checked.
        """
        gathered: dict[str, list[Row]] = {}
        for topic, data in messages:
            for name, row in self._rows(topic, data):
                rows = gathered.setdefault(name, [])
                rows.append(row)
                if len(rows) == ROWS:
                    yield name, gathered.pop(name)
        if self._open:  # the recording ended before these calls did
            gathered.setdefault("calls", []).extend(map(tuple, self._open.values()))
            self._open.clear()
            self.columns.setdefault("calls", FIXED["calls"])
        yield from gathered.items()

    def _rows(self, topic: str, data: Mapping[str, Any]) -> Iterator[tuple[str, Row]]:
        if topic.startswith(READINGS.name):
            name = topic.removeprefix(READINGS.name)
            layout = self._layouts.get(name)
            if layout is None and _is_name(name) and len(self._layouts) < MAX_TABLES:
                layout = self._layouts[name] = _Layout.of(name, data)
                self.columns[name] = layout.columns
            row = None if layout is None else layout.row(data, self._robot)
            if row is None:
                self.misfits += 1
            else:
                yield name, row
            return
        name = _TABLES.get(topic, "")
        if not name:
            return
        self.columns.setdefault(name, FIXED[name])
        for row in self._other_rows(topic, data):
            yield name, row

    def _other_rows(self, topic: str, data: Mapping[str, Any]) -> Iterator[Row]:
        time = data["time"]
        if topic == CALLS.name:
            arguments = data["text"].partition("(")[2].removesuffix(")")
            self._open[data["call"]] = [
                *(time, data["call"], data["command"], arguments),
                *(None, "", None, None),
                *self._end,
            ]
            yield from self._ended_calls()
        elif topic == OUTCOMES.name:
            # Calls that were made before the recording began have the number 0, and no message of their own.
            call = self._open.get(data["call"]) or [time - data["waited"], data["call"], data["command"], ""]
            call[4:] = [data["ok"], data["error"], data["waited"], data["round_trip"], *self._end]
            if data["call"] not in self._open:
                yield tuple(call)
            yield from self._ended_calls()
        elif topic == NOTES.name:
            yield (time, data["name"], data["event"], data["level"], data["message"], *self._end)
        elif topic == WORLD.name:
            for thing in ("robot", "box", "cylinder"):
                for number, (x, y, *heading) in enumerate(data[_LISTS[thing]]):
                    yield (time, thing, number, x, y, heading[0] if heading else None, *self._end)
        else:
            place = data["pose"]["position"]
            yield (time, place["x"], place["y"], data["heading"], *self._end)

    def _ended_calls(self) -> Iterator[Row]:
        """Yield the oldest calls as far as they have ended: a call that ended early waits for those before it."""
        while self._open:
            number, call = next(iter(self._open.items()))
            if call[4] is None and len(self._open) <= MAX_OPEN:
                return
            del self._open[number]
            yield tuple(call)


def _is_name(name: str) -> bool:
    """Return whether a table may have a name that stands in a recording: it becomes that of a file."""
    return name.isidentifier() and name.isascii() and len(name) <= MAX_NAME and name not in FIXED


def topics_of(tables: Iterable[str]) -> list[str]:
    """Return the topics that tables are made of."""
    return [topic for name in tables for topic in _SOURCES.get(name, (READINGS.name + name,))]


def names_of(topics: Iterable[str]) -> list[str]:
    """Return the tables that have rows if these topics have messages."""
    readings = sorted(topic.removeprefix(READINGS.name) for topic in topics if topic.startswith(READINGS.name))
    return [*readings, *(name for name, sources in _SOURCES.items() if {*sources} & {*topics})]


def arrays(columns: Columns, batches: Sequence[Sequence[Row]]) -> Table:
    """Return the rows of a table as an array for each column."""
    parts = [list(zip(*rows, strict=True)) for rows in batches] or [[()] * len(columns)]
    return {
        name: _array(kind, [cell for part in parts for cell in part[place]])
        for place, (name, kind) in enumerate(columns.items())
    }


def _array(kind: Kind, cells: Sequence[Cell]) -> NDArray[Any]:
    import numpy as np  # programs that only write recordings start faster without it

    has_gaps = None in cells
    match kind:
        case "text":
            texts = [str(cell or "") for cell in cells]
            width = max(map(len, texts), default=0)
            return np.array(texts, object if width * len(texts) - sum(map(len, texts)) > MAX_PADDING else str)
        case "truth":
            return np.array(cells, object if has_gaps else bool)
        case "whole" if not has_gaps:
            return np.array(cells, np.int64)
        case _:
            return np.array([np.nan if cell is None else cell for cell in cells], np.float64)
