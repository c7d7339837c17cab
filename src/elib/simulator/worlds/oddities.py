"""What in a world breaks no rule, but is probably a mistake."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from elib.simulator.physics import Scene, Wall
from elib.simulator.physics.fittings import Light, Sound
from elib.simulator.physics.geometry import Solid, extent, gap

MAX_COMPARED = 2000
"""Largest number of things that are checked for overlaps: all pairs of more would take too long."""

TOUCH = 0.001
"""m; things that overlap less than this only touch."""


def oddities(scene: Scene) -> Iterable[str]:
    """Yield what breaks no rule, but is probably a mistake."""
    things: dict[str, Sequence[Light | Sound]] = {"light": scene.lights, "sound": scene.sounds}
    for kind, found in things.items():
        for index, each in enumerate(found):
            if not (0 <= each.x <= scene.width and 0 <= each.y <= scene.depth):
                yield f"{kind}[{index}] stands outside the arena, at ({each.x:g}, {each.y:g})"
    for index, wall in enumerate(scene.walls):
        xs, ys = (wall.x1, wall.x2), (wall.y1, wall.y2)
        if max(xs) < 0 or min(xs) > scene.width or max(ys) < 0 or min(ys) > scene.depth:
            yield f"wall[{index}] stands outside the arena"
    yield from _overlaps(scene)


def _overlaps(scene: Scene) -> Iterable[str]:
    """Yield which boxes and cylinders stand in a wall, and which pushable ones stand in another thing."""
    solids: list[tuple[str, Solid]] = [
        *((f"box[{index}]", box) for index, box in enumerate(scene.boxes)),
        *((f"cylinder[{index}]", cylinder) for index, cylinder in enumerate(scene.cylinders)),
        *((f"wall[{index}]", wall) for index, wall in enumerate(scene.walls)),
        *((f"polygon[{index}]", side) for index, polygon in enumerate(scene.polygons) for side in polygon.sides),
        *(("the arena's wall", wall) for wall in scene.edge),
    ]
    if len(solids) > MAX_COMPARED:
        return
    # From left to right: each is compared only with those that begin before it ends.
    placed = sorted((extent(solid), index) for index, (_, solid) in enumerate(solids))
    for position, ((_, right, low, high), one) in enumerate(placed):
        for (left, _, other_low, other_high), other in placed[position + 1 :]:
            if left > right:
                break
            if other_low > high or other_high < low:
                continue
            (name, first), (second_name, second) = (solids[index] for index in sorted((one, other)))
            if _must_be_apart(first, second) and gap(first, second) < -TOUCH:
                yield f"{name} stands in {second_name}"


def _must_be_apart(one: Solid, other: Solid) -> bool:
    """Return whether an overlap is probably a mistake: fixed things of one kind may form one shape."""
    return isinstance(one, Wall) != isinstance(other, Wall) or any(
        not isinstance(each, Wall) and each.is_pushable for each in (one, other)
    )
