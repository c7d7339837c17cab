"""The records of many worlds in one memory, so that one compiled call can run them all.

Interpreted, there is a list of worlds instead. On either engine :func:`world_at` returns the records of one world, and
:func:`restore` makes a world as its scene was laid out.
"""

from __future__ import annotations

import copy
from collections import namedtuple
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from elib.simulator.physics.engine import Engine, compiled_as, kernel
from elib.simulator.physics.records import Records, SensorView

(SETTING, TABLES, ROBOTS, VIEWS, WALLS, DISCS, THINGS, LAMPS, TONES, FANS, RESPONSE, FLOOR) = range(12)
(CELLS, HEADS, LISTINGS, LISTS, VISIBLE_WALLS, VISIBLE_DISCS, SCRATCH) = range(12, 19)
(ZONES, STATES) = range(19, len(Records._fields))
"""The kinds of records, by the order of the fields of Records."""

SHARED: Final = ("tables", "cells", "lamps", "tones", "fans", "response", "floor")
"""Records that nothing changes while a world runs: the worlds of one scene share them."""

UNPUSHED: Final = ("walls", "discs")
"""Records that nothing changes in a world without pushable things: the worlds of one scene share these too."""

TEMPORARY: Final = ("visible_walls", "visible_discs", "scratch")
"""Records that hold nothing from one robot to the next: the worlds of one thread share them, so they stay in its cache.
"""


if TYPE_CHECKING:
    Packed: TypeAlias = Any
else:
    Packed = namedtuple("Packed", (*Records._fields, "first", "end", "is_shared"))  # noqa: PYI024  # its fields follow
"""The records of many worlds, each kind in one array, and where those of each world are.

``first`` and ``end`` have a row for each world and a column for each kind, in the order of the fields of Records: where
those of a world begin and end. ``is_shared`` tells of each kind whether the worlds of one scene share those.
"""


class Listed(list[Records]):
    """The records of many worlds, interpreted."""

    @property
    def views(self) -> list[SensorView]:
        """The views of all worlds."""
        return [view for world in self for view in world.views]


@kernel
def packed_world(worlds: Packed, w: int) -> Records:
    """Return the records of world *w*: parts of the arrays of all worlds."""
    a = worlds.first[w]
    b = worlds.end[w]
    return Records(
        worlds.setting[a[SETTING] : b[SETTING]],
        worlds.tables[a[TABLES] : b[TABLES]],
        worlds.robots[a[ROBOTS] : b[ROBOTS]],
        worlds.views[a[VIEWS] : b[VIEWS]],
        worlds.walls[a[WALLS] : b[WALLS]],
        worlds.discs[a[DISCS] : b[DISCS]],
        worlds.things[a[THINGS] : b[THINGS]],
        worlds.lamps[a[LAMPS] : b[LAMPS]],
        worlds.tones[a[TONES] : b[TONES]],
        worlds.fans[a[FANS] : b[FANS]],
        worlds.response[a[RESPONSE] : b[RESPONSE]],
        worlds.floor[a[FLOOR] : b[FLOOR]],
        worlds.cells[a[CELLS] : b[CELLS]],
        worlds.heads[a[HEADS] : b[HEADS]],
        worlds.listings[a[LISTINGS] : b[LISTINGS]],
        worlds.lists[a[LISTS] : b[LISTS]],
        worlds.visible_walls[a[VISIBLE_WALLS] : b[VISIBLE_WALLS]],
        worlds.visible_discs[a[VISIBLE_DISCS] : b[VISIBLE_DISCS]],
        worlds.scratch[a[SCRATCH] : b[SCRATCH]],
        worlds.zones[a[ZONES] : b[ZONES]],
        worlds.states[a[STATES] : b[STATES]],
    )


@kernel
def copied(target: Any, at: int, source: Any, first: int, end: int) -> None:
    """Copy ``source[first:end]`` to ``target[at:]``."""
    for k in range(end - first):
        target[at + k] = source[first + k]


@kernel
def packed_restore(worlds: Packed, originals: Packed, w: int, scene: int) -> None:
    """Make world *w* as its scene was laid out: its own parts are copied, the others are those of the scene."""
    at = worlds.first[w]
    a = originals.first[scene]
    b = originals.end[scene]
    copied(worlds.setting, at[SETTING], originals.setting, a[SETTING], b[SETTING])
    copied(worlds.robots, at[ROBOTS], originals.robots, a[ROBOTS], b[ROBOTS])
    copied(worlds.views, at[VIEWS], originals.views, a[VIEWS], b[VIEWS])
    if not worlds.is_shared[WALLS]:
        copied(worlds.walls, at[WALLS], originals.walls, a[WALLS], b[WALLS])
        copied(worlds.discs, at[DISCS], originals.discs, a[DISCS], b[DISCS])
    copied(worlds.things, at[THINGS], originals.things, a[THINGS], b[THINGS])
    copied(worlds.heads, at[HEADS], originals.heads, a[HEADS], b[HEADS])
    copied(worlds.listings, at[LISTINGS], originals.listings, a[LISTINGS], b[LISTINGS])
    copied(worlds.lists, at[LISTS], originals.lists, a[LISTS], b[LISTS])
    copied(worlds.zones, at[ZONES], originals.zones, a[ZONES], b[ZONES])
    copied(worlds.states, at[STATES], originals.states, a[STATES], b[STATES])
    for k in range(len(at)):
        if worlds.is_shared[k]:
            worlds.first[w][k] = a[k]
        worlds.end[w][k] = worlds.first[w][k] + b[k] - a[k]


@compiled_as(packed_world)
def world_at(worlds: Any, w: int) -> Records:
    """Return the records of world *w*."""
    found: Records = worlds[w] if isinstance(worlds, Listed) else packed_world(worlds, w)
    return found


@compiled_as(packed_restore)
def restore(worlds: Listed, originals: Listed, w: int, scene: int) -> None:
    """Make world *w* as its scene was laid out."""
    original = originals[scene]
    own = {name: copy.deepcopy(part) for name, part in original._asdict().items() if name not in SHARED}
    worlds[w] = original._replace(**own)


def laid_out(engine: Engine, models: Sequence[Records]) -> Packed | Listed:
    """Return the worlds of all scenes as they were laid out; compiled, parts that are the same array are there once."""
    if engine.name != "compiled":
        return Listed(models)
    import numpy as np

    kinds = len(Records._fields)
    first, end = np.zeros((len(models), kinds), dtype=np.int64), np.zeros((len(models), kinds), dtype=np.int64)
    columns: list[Any] = []
    for k, name in enumerate(Records._fields):
        parts: list[Any] = []
        places_of: dict[int, int] = {}
        length = 0
        for w, model in enumerate(models):
            part = getattr(model, name)
            if id(part) not in places_of:
                places_of[id(part)] = length
                parts.append(np.asarray(part))
                length += len(part)
            first[w, k] = places_of[id(part)]
            end[w, k] = first[w, k] + len(part)
        column: Any = np.concatenate(parts)
        # An array of records is another type for the compiler.
        columns.append(column.view(np.recarray) if isinstance(models[0][k], np.recarray) else column)
    return Packed._make([*columns, first, end, np.zeros(kinds, dtype=np.bool_)])


def room_for(originals: Packed | Listed, parts: Sequence[tuple[int, int]]) -> Packed | Listed:
    """Return room for worlds, each of which :func:`restore` can make that of any scene.

    Args:
        originals: The worlds of all scenes.
        parts: The first and the last + 1 of the worlds of each thread.
    """
    count = parts[-1][1]
    if isinstance(originals, Listed):
        return Listed([originals[0]] * count)
    import numpy as np

    shared = SHARED if len(originals.things) else SHARED + UNPUSHED
    is_shared = np.array([name in shared for name in Records._fields])
    columns: list[Any] = []
    threads = np.repeat(np.arange(len(parts)), [end - first for first, end in parts])
    first = np.zeros((count, len(Records._fields)), dtype=np.int64)
    for k, name in enumerate(Records._fields):
        column = originals[k]
        if not is_shared[k]:
            room = int((originals.end[:, k] - originals.first[:, k]).max())
            place = threads if name in TEMPORARY else np.arange(count)
            first[:, k] = place * room
            column = np.zeros_like(column, shape=(int(place[-1]) + 1) * room)
        columns.append(column)
    return Packed._make([*columns, first, first.copy(), is_shared])
