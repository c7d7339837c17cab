"""Whether there is room for a thing on the floor: outlines and the gap between two of them.

Plain geometry in m, without the physics: it is asked once when somebody moves a thing by hand, not in a step.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise

Point = tuple[float, float]

SLACK = 0.0005
"""m. Things that overlap less than this touch: the next steps of the physics part them by themselves."""


@dataclass(frozen=True, slots=True)
class Outline:
    """What a thing covers of the floor.

    Attributes:
        name: What to call it in a message.
        points: One for a disc's centre, two for the ends of a wall, more for the corners of a convex shape,
            counter-clockwise.
        radius: How far it reaches beyond them, m, 0 or more.
    """

    name: str
    points: tuple[Point, ...]
    radius: float = 0.0

    @property
    def sides(self) -> list[tuple[Point, Point]]:
        """Its straight edges; a single point is one without length."""
        if len(self.points) < 3:
            return [(self.points[0], self.points[-1])]
        return list(pairwise((*self.points, self.points[0])))


def blocker(thing: Outline, others: Iterable[Outline], width: float, depth: float) -> str | None:
    """Return the name of what is in the way of *thing*, or None where it has room.

    Args:
        thing: Where it is to stand.
        others: What stands there already.
        width: Of the arena, m; x runs from 0 to it.
        depth: Of the arena, m; y runs from 0 to it.
    """
    low = thing.radius - SLACK
    for x, y in thing.points:
        if not (low <= x <= width - low and low <= y <= depth - low):
            return "the edge of the arena"
    x, y = _centre(thing)
    reach = max(math.dist((x, y), point) for point in thing.points) + thing.radius
    for other in others:
        (left, low_y), radius = other.points[0], other.radius
        # Far things first: a world may have a hundred thousand walls.
        span = max(math.dist(point, other.points[0]) for point in other.points) + radius
        if math.hypot(left - x, low_y - y) > span + reach:
            continue
        if gap(thing, other) < -SLACK:
            return other.name
    return None


def gap(one: Outline, other: Outline) -> float:
    """Return how far two outlines are apart, m; where they overlap, minus how far one must move to be clear."""
    reach = one.radius + other.radius
    # Two convex shapes are apart if and only if a side of one of them has the whole of the other before it.
    before = max((*_before(one, other), *_before(other, one)), default=0.0)
    if before < 0:
        return before - reach
    return min(_between(*a, *b) for a in one.sides for b in other.sides) - reach


def _before(shape: Outline, other: Outline) -> Iterator[float]:
    """Yield for each side of *shape* how far before it the nearest point of *other* lies, m."""
    for a, b in shape.sides:
        length = math.dist(a, b)
        if length == 0:
            continue
        heights = [((b[1] - a[1]) * (x - a[0]) - (b[0] - a[0]) * (y - a[1])) / length for x, y in other.points]
        yield min(heights)
        if len(shape.points) == 2:  # a wall has two faces
            yield -max(heights)


def _centre(thing: Outline) -> Point:
    count = len(thing.points)
    return sum(x for x, _ in thing.points) / count, sum(y for _, y in thing.points) / count


def _between(a: Point, b: Point, c: Point, d: Point) -> float:
    """Return the distance between the segments *ab* and *cd*, which do not cross."""
    return min(_to(a, c, d), _to(b, c, d), _to(c, a, b), _to(d, a, b))


def _to(point: Point, a: Point, b: Point) -> float:
    """Return the distance of *point* from the segment *ab*."""
    along, across = b[0] - a[0], b[1] - a[1]
    square = along * along + across * across
    share = 0.0
    if square > 0:
        share = min(1.0, max(0.0, ((point[0] - a[0]) * along + (point[1] - a[1]) * across) / square))
    return math.dist(point, (a[0] + share * along, a[1] + share * across))
