"""The records of many worlds in one memory, so that one compiled call can run them all.

Interpreted, there is a list of worlds instead. On either engine there is a function that returns the records of one
world, and one that makes a world as its scene was laid out.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from elib.simulator.physics.engine import kernel
from elib.simulator.physics.records import Records

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

SHARED: Final = ("tables", "cells", "lamps", "tones", "fans", "response", "floor")
"""Records that nothing changes while a world runs: the worlds of one scene share them."""

UNPUSHED: Final = ("walls", "discs")
"""Records that nothing changes in a world without pushable things: the worlds of one scene share these too."""

TEMPORARY: Final = ("visible_walls", "visible_discs", "scratch")
"""Records that hold nothing from one robot to the next: the worlds of one thread share them, so they stay in its cache.
"""


class Packed(NamedTuple):
    """The records of many worlds, each kind in one array, and where those of each world are."""

    setting: Any
    tables: Any
    robots: Any
    views: Any
    walls: Any
    discs: Any
    things: Any
    lamps: Any
    tones: Any
    fans: Any
    response: Any
    floor: Any
    cells: Any
    heads: Any
    listings: Any
    lists: Any
    visible_walls: Any
    visible_discs: Any
    scratch: Any
    first: Any  # (worlds, kinds): where those of a world begin, in the order of the fields of Records.
    end: Any  # (worlds, kinds): where they end.
    is_shared: Any  # (kinds,): whether the worlds of one scene share those of this kind.


def listed_world(worlds: Sequence[Records], w: int) -> Records:
    """Return the records of world *w* from a list."""
    return worlds[w]


def listed_restore(worlds: list[Records], originals: Sequence[Records], w: int, scene: int) -> None:
    """Make world *w* of a list as its scene was laid out."""
    original = originals[scene]
    own = {name: copy.deepcopy(part) for name, part in original._asdict().items() if name not in SHARED}
    worlds[w] = original._replace(**own)


@kernel
def packed_world(worlds: Packed, w: int) -> Records:
    """Return the records of world *w*: parts of the arrays of all worlds."""
    a = worlds.first[w]
    b = worlds.end[w]
    return Records(
        worlds.setting[a[0] : b[0]],
        worlds.tables[a[1] : b[1]],
        worlds.robots[a[2] : b[2]],
        worlds.views[a[3] : b[3]],
        worlds.walls[a[4] : b[4]],
        worlds.discs[a[5] : b[5]],
        worlds.things[a[6] : b[6]],
        worlds.lamps[a[7] : b[7]],
        worlds.tones[a[8] : b[8]],
        worlds.fans[a[9] : b[9]],
        worlds.response[a[10] : b[10]],
        worlds.floor[a[11] : b[11]],
        worlds.cells[a[12] : b[12]],
        worlds.heads[a[13] : b[13]],
        worlds.listings[a[14] : b[14]],
        worlds.lists[a[15] : b[15]],
        worlds.visible_walls[a[16] : b[16]],
        worlds.visible_discs[a[17] : b[17]],
        worlds.scratch[a[18] : b[18]],
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
    copied(worlds.setting, at[0], originals.setting, a[0], b[0])
    copied(worlds.robots, at[2], originals.robots, a[2], b[2])
    copied(worlds.views, at[3], originals.views, a[3], b[3])
    if not worlds.is_shared[4]:
        copied(worlds.walls, at[4], originals.walls, a[4], b[4])
        copied(worlds.discs, at[5], originals.discs, a[5], b[5])
    copied(worlds.things, at[6], originals.things, a[6], b[6])
    copied(worlds.heads, at[13], originals.heads, a[13], b[13])
    copied(worlds.listings, at[14], originals.listings, a[14], b[14])
    copied(worlds.lists, at[15], originals.lists, a[15], b[15])
    for k in range(len(at)):
        if worlds.is_shared[k]:
            worlds.first[w][k] = a[k]
        worlds.end[w][k] = worlds.first[w][k] + b[k] - a[k]


def packed(models: Sequence[Records]) -> Packed:
    """Put the records of several worlds behind each other; parts that are the same array are put there once."""
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
        columns.append(_recorded(np.concatenate(parts), models[0][k]))
    return Packed._make([*columns, first, end, np.zeros(kinds, dtype=np.bool_)])


def packed_copies(models: Sequence[Records], parts: Sequence[tuple[int, int]]) -> Packed:
    """Make room for worlds, each of which can be that of any model.

    Args:
        models: The worlds of all scenes.
        parts: The first and the last + 1 of the worlds of each thread.
    """
    import numpy as np

    originals = packed(models)
    is_shared = _is_shared(models)
    columns: list[Any] = []
    count = parts[-1][1]
    threads = np.repeat(np.arange(len(parts)), [end - first for first, end in parts])
    first = np.zeros((count, len(Records._fields)), dtype=np.int64)
    for k, name in enumerate(Records._fields):
        column = originals[k]
        if not is_shared[k]:
            room = max(len(model[k]) for model in models)
            place = threads if name in TEMPORARY else np.arange(count)
            first[:, k] = place * room
            made = np.zeros((int(place[-1]) + 1) * room, dtype=np.asarray(column).dtype)
            column = _recorded(made, models[0][k])
        columns.append(column)
    return Packed._make([*columns, first, first.copy(), is_shared])


def _is_shared(models: Sequence[Records]) -> NDArray[np.bool_]:
    """Return for each kind of record whether the worlds of one scene share those."""
    import numpy as np

    names = SHARED if any(len(model.things) for model in models) else SHARED + UNPUSHED
    return np.array([name in names for name in Records._fields])


def _recorded(array: Any, like: Any) -> Any:
    """Return *array* as an array of records, if *like* is one: that is another type for the compiler."""
    import numpy as np

    return array.view(np.recarray) if isinstance(like, np.recarray) else array
