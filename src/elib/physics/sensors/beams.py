"""All rays of eight infrared sensors at once, cast at what is in sight: a part of :mod:`elib.physics.sensors.sweep`."""

from __future__ import annotations

from elib.physics import vector
from elib.physics.engine import inner_kernel, kernel
from elib.physics.layout import (
    AXIS_X,
    AXIS_Y,
    LENGTH,
    PLACE_X,
    PLACE_Y,
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
    AGES,
    ASIDE_X,
    ASIDE_Y,
    BEAM,
    BEAMS,
    DISC_SEER,
    OFFSETS,
    PALENESS,
    POSED,
    POSES,
    SEEING,
    SIZES,
    STARTS,
    STEP_X,
    STEP_Y,
    THEN_X,
    THEN_Y,
    WALL_SEEN,
    WALL_SEER,
)
from elib.physics.sensors.rays import ABSORBS, PRESSED
from elib.physics.sensors.responding import COUNT
from elib.physics.vector import choose, load, root, spread, store


@kernel
def cast_at_walls(count: int, fixed: Floats, walls: Floats, numbers: Ints, scratch: Floats) -> None:
    """Cast the rays of those who see them at the walls on the list."""
    axis_x = load(fixed, AXIS_X)
    axis_y = load(fixed, AXIS_Y)
    place_x = load(fixed, PLACE_X)
    place_y = load(fixed, PLACE_Y)
    rays = numbers[RAY_COUNT]
    slate = numbers[SLATE_AT]
    for n in range(count):
        w = numbers[slate + WALL_SEEN + n]
        b = numbers[slate + WALL_SEER + n]
        pose = POSES + b * POSED
        scratch[pose + SEEING] = 1.0
        then_x = load(scratch, pose + THEN_X)
        then_y = load(scratch, pose + THEN_Y)
        age = load(scratch, pose + AGES)
        step_x = scratch[pose + STEP_X]
        step_y = scratch[pose + STEP_Y]
        tangent_x = walls[w + TANGENT_X]
        tangent_y = walls[w + TANGENT_Y]
        absorbs = walls[w + WALL_ABSORBS]
        normal_x = tangent_x * then_y - tangent_y * then_x
        normal_y = tangent_x * then_x + tangent_y * then_y
        away = scratch[OFFSETS + n] + age * (tangent_x * step_y - tangent_y * step_x)
        back = age * (tangent_x * step_x + tangent_y * step_y)
        across = normal_x * axis_x + normal_y * axis_y
        sliding = normal_y * axis_x - normal_x * axis_y
        gap = away - normal_x * place_x - normal_y * place_y
        side = choose(away >= 0.0, spread(1.0), spread(-1.0))
        gap = gap * side
        is_behind = gap <= -PRESSED
        side = choose(is_behind, 0.0 - side, side)
        gap = choose(is_behind, 0.0 - gap, gap)
        gap = choose(gap > 0.0, gap, 0.0)
        closing = across * side
        turning = sliding * side
        start = scratch[STARTS + n] + back
        end = scratch[STARTS + n] + walls[w + LENGTH] + back
        along = normal_y * place_x - normal_x * place_y
        at = BEAMS + b * BEAM
        _cross(at, closing, gap, along, sliding, start, end, absorbs, scratch)
        for ray in range(1, rays, 2):
            cosine = fixed[RAYS + ray * RAY]
            sine = fixed[RAYS + ray * RAY + 1]
            straight = closing * cosine
            tilted = turning * sine
            ahead = sliding * cosine
            aside = across * sine
            at += COUNT
            _cross(at, straight + tilted, gap, along, ahead - aside, start, end, absorbs, scratch)
            at += COUNT
            _cross(at, straight - tilted, gap, along, ahead + aside, start, end, absorbs, scratch)


@inner_kernel
def _cross(
    at: int,
    speed: vector.Reals,
    gap: vector.Reals,
    along: vector.Reals,
    sliding: vector.Reals,
    start: vector.Reals,
    end: vector.Reals,
    absorbs: float,
    scratch: Floats,
) -> None:
    """Shorten the rays whose lengths stand at *at* if they meet the wall."""
    nearest = load(scratch, at)
    absorbing = load(scratch, ABSORBS + at)
    length = gap / speed
    place = along + length * sliding
    is_met = (speed > 0.0) & (start <= place) & (place <= end)
    is_met = is_met & (length < nearest)
    store(scratch, at, choose(is_met, length, nearest))
    store(scratch, ABSORBS + at, choose(is_met, absorbs, absorbing))


@kernel
def cast_at_discs(count: int, fixed: Floats, numbers: Ints, scratch: Floats) -> None:
    """Cast the rays of those who see them at the discs on the list."""
    axis_x = load(fixed, AXIS_X)
    axis_y = load(fixed, AXIS_Y)
    place_x = load(fixed, PLACE_X)
    place_y = load(fixed, PLACE_Y)
    rays = numbers[RAY_COUNT]
    slate = numbers[SLATE_AT]
    for n in range(count):
        b = numbers[slate + DISC_SEER + n]
        pose = POSES + b * POSED
        scratch[pose + SEEING] = 1.0
        then_x = load(scratch, pose + THEN_X)
        then_y = load(scratch, pose + THEN_Y)
        age = load(scratch, pose + AGES)
        radius = scratch[SIZES + n]
        absorbs = scratch[PALENESS + n]
        back_x = scratch[ASIDE_X + n] + age * scratch[pose + STEP_X]
        back_y = scratch[ASIDE_Y + n] + age * scratch[pose + STEP_Y]
        centre_x = back_x * then_x + back_y * then_y - place_x
        centre_y = back_y * then_x - back_x * then_y - place_y
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
