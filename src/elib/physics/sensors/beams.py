"""All rays of eight infrared sensors at once, cast at what is in sight: a part of :mod:`elib.physics.sensors.sweep`.

Walls are compared by 1 / length: for all rays of a sensor that takes one division a wall, and one a ray at the end,
where lengths would take one for each wall and ray.
"""

from __future__ import annotations

from elib.physics import vector
from elib.physics.engine import inner_kernel, kernel
from elib.physics.layout import (
    LENGTH,
    RAY,
    RAY_COUNT,
    RAYS,
    SLATE_AT,
    TANGENT_X,
    TANGENT_Y,
    WALL_ABSORBS,
    Floats,
    Ints,
)
from elib.physics.room import (
    AHEAD_X,
    AHEAD_Y,
    ASIDE_X,
    ASIDE_Y,
    BEAM,
    BEAMS,
    DISC_SEER,
    FROM_X,
    FROM_Y,
    OFFSETS,
    PALENESS,
    POSED,
    POSES,
    SEEING,
    SIZES,
    STARTS,
    WALL_SEEN,
    WALL_SEER,
)
from elib.physics.sensors.rays import ABSORBS, PRESSED
from elib.physics.sensors.responding import COUNT
from elib.physics.vector import choose, load, root, size, spread, store


@kernel
def cast_at_walls(count: int, fixed: Floats, walls: Floats, numbers: Ints, scratch: Floats) -> None:
    """Cast the rays of those who see them at the walls on the list."""
    rays = numbers[RAY_COUNT]
    slate = numbers[SLATE_AT]
    for n in range(count):
        w = numbers[slate + WALL_SEEN + n]
        b = numbers[slate + WALL_SEER + n]
        pose = POSES + b * POSED
        scratch[pose + SEEING] = 1.0
        axis_x = load(scratch, pose + AHEAD_X)
        axis_y = load(scratch, pose + AHEAD_Y)
        from_x = load(scratch, pose + FROM_X)
        from_y = load(scratch, pose + FROM_Y)
        tangent_x = walls[w + TANGENT_X]
        tangent_y = walls[w + TANGENT_Y]
        absorbs = walls[w + WALL_ABSORBS]
        offset = scratch[OFFSETS + n]
        across = tangent_x * axis_y - tangent_y * axis_x
        sliding = tangent_x * axis_x + tangent_y * axis_y
        gap = offset - (tangent_x * from_y - tangent_y * from_x)
        along = tangent_x * from_x + tangent_y * from_y
        start = scratch[STARTS + n] - along
        end = (scratch[STARTS + n] + walls[w + LENGTH]) - along
        is_pressed = size(gap) <= PRESSED
        is_back = choose(is_pressed, offset, gap) < 0.0
        inverse = 1.0 / choose(is_pressed, PRESSED, size(gap))
        closing = choose(is_back, 0.0 - across, across) * inverse
        turning = choose(is_back, 0.0 - sliding, sliding) * inverse
        at = BEAMS + b * BEAM
        _cross(at, closing, sliding, start, end, absorbs, scratch)
        for ray in range(1, rays, 2):
            cosine = fixed[RAYS + ray * RAY]
            sine = fixed[RAYS + ray * RAY + 1]
            straight = closing * cosine
            tilted = turning * sine
            ahead = sliding * cosine
            aside = across * sine
            at += COUNT
            _cross(at, straight + tilted, ahead - aside, start, end, absorbs, scratch)
            at += COUNT
            _cross(at, straight - tilted, ahead + aside, start, end, absorbs, scratch)


@inner_kernel
def _cross(
    at: int,
    near: vector.Reals,
    sliding: vector.Reals,
    start: vector.Reals,
    end: vector.Reals,
    absorbs: float,
    scratch: Floats,
) -> None:
    """Shorten the rays whose 1 / lengths stand at *at* if they meet the wall.

    A ray comes 1 nearer to the wall in 1 / *near*, and slides along it by *sliding* in 1.
    """
    nearest = load(scratch, at)
    absorbing = load(scratch, ABSORBS + at)
    is_met = (near > nearest) & (start * near <= sliding) & (sliding <= end * near)
    store(scratch, at, choose(is_met, near, nearest))
    store(scratch, ABSORBS + at, choose(is_met, absorbs, absorbing))


@inner_kernel
def measure(b: int, rays: int, nothing: float, scratch: Floats) -> None:
    """Turn the 1 / lengths of a robot's rays into lengths; *nothing* is that of a ray that meets no wall."""
    at = BEAMS + b * BEAM
    if scratch[POSES + b * POSED + SEEING] == 0.0:  # No wall in sight, as for most of a crowd in the open.
        for k in range(at, at + rays * COUNT, COUNT):
            store(scratch, k, spread(1.0 / nothing))
        return
    for k in range(at, at + rays * COUNT, COUNT):
        store(scratch, k, 1.0 / load(scratch, k))


@kernel
def cast_at_discs(count: int, fixed: Floats, numbers: Ints, scratch: Floats) -> None:
    """Cast the rays of those who see them at the discs on the list."""
    rays = numbers[RAY_COUNT]
    slate = numbers[SLATE_AT]
    for n in range(count):
        b = numbers[slate + DISC_SEER + n]
        pose = POSES + b * POSED
        scratch[pose + SEEING] = 1.0
        axis_x = load(scratch, pose + AHEAD_X)
        axis_y = load(scratch, pose + AHEAD_Y)
        radius = scratch[SIZES + n]
        absorbs = scratch[PALENESS + n]
        centre_x = scratch[ASIDE_X + n] - load(scratch, pose + FROM_X)
        centre_y = scratch[ASIDE_Y + n] - load(scratch, pose + FROM_Y)
        square = centre_x * centre_x + centre_y * centre_y
        ahead = centre_x * axis_x + centre_y * axis_y
        aside = centre_y * axis_x - centre_x * axis_y
        outside = square - radius * radius
        at = BEAMS + b * BEAM
        _meet(at, ahead, outside, absorbs, scratch)
        for ray in range(1, rays, 2):
            straight = ahead * fixed[RAYS + ray * RAY]
            tilted = aside * fixed[RAYS + ray * RAY + 1]
            at += COUNT
            _meet(at, straight + tilted, outside, absorbs, scratch)
            at += COUNT
            _meet(at, straight - tilted, outside, absorbs, scratch)


@inner_kernel
def _meet(at: int, closing: vector.Reals, outside: vector.Reals, absorbs: float, scratch: Floats) -> None:
    """Shorten the rays whose lengths stand at *at* if they meet the disc."""
    nearest = load(scratch, at)
    absorbing = load(scratch, ABSORBS + at)
    under = closing * closing - outside
    is_met = (closing > 0.0) & (under >= 0.0)
    length = closing - root(choose(under >= 0.0, under, 0.0))
    length = choose(length > 0.0, length, 0.0)
    is_met = is_met & (length < nearest)
    store(scratch, at, choose(is_met, length, nearest))
    store(scratch, ABSORBS + at, choose(is_met, absorbs, absorbing))
