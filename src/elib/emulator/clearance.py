"""Whether there is room for a thing on the floor; asked once when somebody moves a thing by hand, not in a step."""

from __future__ import annotations

from collections.abc import Iterable

from elib.physics.geometry import Solid, extent, gap

SLACK = 0.0005
"""m. Things that overlap less than this touch: the next steps of the physics part them by themselves."""


def blocker(thing: Solid, others: Iterable[tuple[str, Solid]], width: float, depth: float) -> str | None:
    """Return the name of what is in the way of *thing*, or None where it has room.

    Args:
        thing: Where it is to stand.
        others: What stands there already, by the names that messages use.
        width: Of the arena, m; x runs from 0 to it.
        depth: Of the arena, m; y runs from 0 to it.
    """
    left, right, low, high = extent(thing)
    if min(left, width - right, low, depth - high) < -SLACK:
        return "the edge of the arena"
    for name, other in others:
        other_left, other_right, other_low, other_high = extent(other)
        # Far things first: a world may have a hundred thousand walls.
        if other_left > right or other_right < left or other_low > high or other_high < low:
            continue
        if gap(thing, other) < -SLACK:
            return name
    return None
