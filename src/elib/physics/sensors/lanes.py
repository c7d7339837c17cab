"""All rays of a robot's eight infrared sensors at once: what the compiled engine runs instead of asking one by one.

The laws are those of :mod:`elib.physics.sensors.rays`, operation by operation, so that both engines agree to the last
bit. Here every sensor takes part, whether or not it looks that way, and a choice of values stands where a branch would:
such loops become vector instructions, and working a ray out in vain costs less than a branch that is foreseen wrongly.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from elib.physics.engine import inner_kernel, kernel
from elib.physics.layout import (
    AGE,
    AXIS_X,
    AXIS_Y,
    CLEAR,
    IR_REACH,
    LAST,
    LENGTH,
    PLACE_X,
    PLACE_Y,
    RAY,
    RAY_COUNT,
    RAYS,
    RESPONSE,
    SENSORS,
    SPREAD,
    TANGENT_X,
    TANGENT_Y,
    WALL_ABSORBS,
    WALL_TOP,
    WIDEST,
    Floats,
    Ints,
)
from elib.physics.sensors.rays import ABSORBS, DEVIATION, HITS, NOTHING, POSE, PRESSED, REFLECTED, SENSOR_HEIGHT

NEVER: Final = 1e300
"""A gap that no ray crosses."""


@kernel
def clear(sensors: int, rays: int, reach: float, scratch: Floats) -> None:
    """Let all rays meet nothing."""
    for i in range(sensors):
        scratch[HITS + i] = 1.0
    for k in range(sensors * rays):
        scratch[k] = reach
        scratch[ABSORBS + k] = NOTHING


@kernel
def see_wall(
    w: int, offset: float, start: float, horizon: float, fixed: Floats, walls: Floats, numbers: Ints, scratch: Floats
) -> None:
    """Look at a wall whose line is *offset* to the left of the robot and which begins at *start* along it, m."""
    end = start + walls[w + LENGTH]
    if start > horizon or end < -horizon or walls[w + WALL_TOP] < SENSOR_HEIGHT:
        return
    sensors = numbers[SENSORS]  # Eight; were that told to the compiler, it would write the loops out one by one.
    rays = numbers[RAY_COUNT]
    reach = fixed[IR_REACH]
    if scratch[HITS] == 0.0:
        clear(sensors, rays, reach, scratch)
    tangent_x = walls[w + TANGENT_X]
    tangent_y = walls[w + TANGENT_Y]
    absorbs = walls[w + WALL_ABSORBS]
    heading_x = scratch[POSE]
    heading_y = scratch[POSE + 1]
    turn_x = scratch[POSE + 2]
    turn_y = scratch[POSE + 3]
    sideways = tangent_x * scratch[POSE + 4] + tangent_y * scratch[POSE + 5]
    nearer = tangent_x * scratch[POSE + 5] - tangent_y * scratch[POSE + 4]
    share = scratch[POSE + 6]
    widest = fixed[WIDEST]
    spread = fixed[SPREAD]
    cosine = fixed[RAYS + RAY]
    sine = fixed[RAYS + RAY + 1]
    wide = fixed[RAYS + 3 * RAY]
    wide_y = fixed[RAYS + 3 * RAY + 1]
    if rays > 3:
        for i in range(sensors):
            _see_wall_with(
                i,
                True,
                offset,
                start,
                end,
                absorbs,
                heading_x,
                heading_y,
                turn_x,
                turn_y,
                tangent_x,
                tangent_y,
                sideways,
                nearer,
                share,
                reach,
                widest,
                spread,
                cosine,
                sine,
                wide,
                wide_y,
                fixed,
                scratch,
            )
    else:  # The side rays of a sensor that has none meet nothing: their directions are (0, 0).
        for i in range(sensors):
            _see_wall_with(
                i,
                False,
                offset,
                start,
                end,
                absorbs,
                heading_x,
                heading_y,
                turn_x,
                turn_y,
                tangent_x,
                tangent_y,
                sideways,
                nearer,
                share,
                reach,
                widest,
                spread,
                cosine,
                sine,
                wide,
                wide_y,
                fixed,
                scratch,
            )


@inner_kernel
def _see_wall_with(
    i: int,
    is_wide: bool,
    offset: float,
    start: float,
    end: float,
    absorbs: float,
    heading_x: float,
    heading_y: float,
    turn_x: float,
    turn_y: float,
    tangent_x: float,
    tangent_y: float,
    sideways: float,
    nearer: float,
    share: float,
    reach: float,
    widest: float,
    spread: float,
    cosine: float,
    sine: float,
    wide: float,
    wide_y: float,
    fixed: Floats,
    scratch: Floats,
) -> None:
    """Look at the wall with sensor *i*."""
    age = share * fixed[AGE + i]
    then_x = heading_x - age * turn_x
    then_y = heading_y - age * turn_y
    normal_x = tangent_x * then_y - tangent_y * then_x
    normal_y = tangent_x * then_x + tangent_y * then_y
    away = offset + age * nearer
    back = age * sideways
    axis_x = fixed[AXIS_X + i]
    axis_y = fixed[AXIS_Y + i]
    place_x = fixed[PLACE_X + i]
    place_y = fixed[PLACE_Y + i]
    across = normal_x * axis_x + normal_y * axis_y
    sliding = normal_y * axis_x - normal_x * axis_y
    gap = away - normal_x * place_x - normal_y * place_y
    side = 1.0 if away >= 0.0 else -1.0
    gap = gap * side
    side = side if gap > -PRESSED else -side
    gap = abs(gap) if gap > 0.0 or gap <= -PRESSED else 0.0
    closing = across * side
    turning = sliding * side
    fastest = closing * widest + abs(turning) * spread
    fastest = fastest if closing < widest else 1.0
    gap = gap if gap < reach * fastest else NEVER
    along = normal_y * place_x - normal_x * place_y
    first = start + back
    last = end + back
    _cross(i, 0, 1.0, 0.0, gap, closing, turning, along, sliding, across, first, last, absorbs, scratch)
    _cross(i, 8, cosine, sine, gap, closing, turning, along, sliding, across, first, last, absorbs, scratch)
    _cross(i, 16, cosine, -sine, gap, closing, turning, along, sliding, across, first, last, absorbs, scratch)
    if is_wide:
        _cross(i, 24, wide, wide_y, gap, closing, turning, along, sliding, across, first, last, absorbs, scratch)
        _cross(i, 32, wide, -wide_y, gap, closing, turning, along, sliding, across, first, last, absorbs, scratch)


@inner_kernel
def _cross(
    i: int,
    at: int,
    cosine: float,
    sine: float,
    gap: float,
    closing: float,
    turning: float,
    place: float,
    sliding: float,
    across: float,
    start: float,
    end: float,
    absorbs: float,
    scratch: Floats,
) -> None:
    """Shorten the ray of sensor *i* whose length stands at *at* + i if it meets the wall."""
    nearest = scratch[at + i]
    absorbing = scratch[ABSORBS + at + i]
    speed = closing * cosine + turning * sine
    length = gap / speed
    along = place + length * (sliding * cosine - across * sine)
    is_met = (gap < nearest * speed) & (start <= along) & (along <= end)
    scratch[at + i] = length if is_met else nearest
    scratch[ABSORBS + at + i] = absorbs if is_met else absorbing


@kernel
def see_disc(
    dx: float, dy: float, radius: float, absorbs: float, fixed: Floats, numbers: Ints, scratch: Floats
) -> None:
    """Look at a disc whose centre is (dx, dy) away from the robot's, m."""
    sensors = numbers[SENSORS]
    rays = numbers[RAY_COUNT]
    reach = fixed[IR_REACH]
    if scratch[HITS] == 0.0:
        clear(sensors, rays, reach, scratch)
    heading_x = scratch[POSE]
    heading_y = scratch[POSE + 1]
    turn_x = scratch[POSE + 2]
    turn_y = scratch[POSE + 3]
    step_x = scratch[POSE + 4]
    step_y = scratch[POSE + 5]
    share = scratch[POSE + 6]
    widest = fixed[WIDEST]
    spread = fixed[SPREAD]
    cosine = fixed[RAYS + RAY]
    sine = fixed[RAYS + RAY + 1]
    wide = fixed[RAYS + 3 * RAY]
    wide_y = fixed[RAYS + 3 * RAY + 1]
    if rays > 3:
        for i in range(sensors):
            _see_disc_with(
                i,
                True,
                dx,
                dy,
                radius,
                absorbs,
                heading_x,
                heading_y,
                turn_x,
                turn_y,
                step_x,
                step_y,
                share,
                reach,
                widest,
                spread,
                cosine,
                sine,
                wide,
                wide_y,
                fixed,
                scratch,
            )
    else:  # The side rays of a sensor that has none meet nothing: their directions are (0, 0).
        for i in range(sensors):
            _see_disc_with(
                i,
                False,
                dx,
                dy,
                radius,
                absorbs,
                heading_x,
                heading_y,
                turn_x,
                turn_y,
                step_x,
                step_y,
                share,
                reach,
                widest,
                spread,
                cosine,
                sine,
                wide,
                wide_y,
                fixed,
                scratch,
            )


@inner_kernel
def _see_disc_with(
    i: int,
    is_wide: bool,
    dx: float,
    dy: float,
    radius: float,
    absorbs: float,
    heading_x: float,
    heading_y: float,
    turn_x: float,
    turn_y: float,
    step_x: float,
    step_y: float,
    share: float,
    reach: float,
    widest: float,
    spread: float,
    cosine: float,
    sine: float,
    wide: float,
    wide_y: float,
    fixed: Floats,
    scratch: Floats,
) -> None:
    """Look at the disc with sensor *i*."""
    limit = (reach + radius) * (reach + radius)
    age = share * fixed[AGE + i]
    then_x = heading_x - age * turn_x
    then_y = heading_y - age * turn_y
    back_x = dx + age * step_x
    back_y = dy + age * step_y
    centre_x = back_x * then_x + back_y * then_y - fixed[PLACE_X + i]
    centre_y = back_y * then_x - back_x * then_y - fixed[PLACE_Y + i]
    axis_x = fixed[AXIS_X + i]
    axis_y = fixed[AXIS_Y + i]
    square = centre_x * centre_x + centre_y * centre_y
    ahead = centre_x * axis_x + centre_y * axis_y
    aside = centre_y * axis_x - centre_x * axis_y
    is_near = (square < limit) & (abs(aside) * widest - ahead * spread <= radius) & (ahead >= -radius)
    outside = square - radius * radius if is_near else NEVER
    _meet(i, 0, 1.0, 0.0, outside, ahead, aside, absorbs, scratch)
    _meet(i, 8, cosine, sine, outside, ahead, aside, absorbs, scratch)
    _meet(i, 16, cosine, -sine, outside, ahead, aside, absorbs, scratch)
    if is_wide:
        _meet(i, 24, wide, wide_y, outside, ahead, aside, absorbs, scratch)
        _meet(i, 32, wide, -wide_y, outside, ahead, aside, absorbs, scratch)


@inner_kernel
def _meet(
    i: int,
    at: int,
    cosine: float,
    sine: float,
    outside: float,
    ahead: float,
    aside: float,
    absorbs: float,
    scratch: Floats,
) -> None:
    """Shorten the ray of sensor *i* whose length stands at *at* + i if it meets the disc."""
    nearest = scratch[at + i]
    absorbing = scratch[ABSORBS + at + i]
    closing = ahead * cosine + aside * sine
    under = closing * closing - outside
    root = closing - sqrt(under if under >= 0.0 else 0.0)
    length = root if root > 0.0 else 0.0
    is_met = (closing > 0.0) & (under >= 0.0) & (length < nearest)
    scratch[at + i] = length if is_met else nearest
    scratch[ABSORBS + at + i] = absorbs if is_met else absorbing


@kernel
def reflect(fixed: Floats, numbers: Ints, scratch: Floats) -> None:
    """Find how much light each sensor gets back, counts, and the deviation of its noise there."""
    sensors = numbers[SENSORS]
    last = numbers[LAST]
    if scratch[HITS] == 0.0:
        for i in range(sensors):
            scratch[REFLECTED + i] = fixed[CLEAR]
            scratch[DEVIATION + i] = fixed[RESPONSE + last + 1 + last]
    elif numbers[RAY_COUNT] > 3:
        for i in range(sensors):
            _reflect_with(i, True, last, fixed, scratch)
    else:
        for i in range(sensors):
            _reflect_with(i, False, last, fixed, scratch)


@inner_kernel
def _reflect_with(i: int, is_wide: bool, last: int, fixed: Floats, scratch: Floats) -> None:
    place = scratch[i] * fixed[RAYS + 2] * scratch[ABSORBS + i]
    place = place if place < last else last
    scratch[DEVIATION + i] = fixed[RESPONSE + last + 1 + int(place)]
    light = 0.0 + fixed[RAYS + 3] * _response(place, fixed)
    light += _share(i + 8, RAYS + RAY, last, fixed, scratch)
    light += _share(i + 16, RAYS + 2 * RAY, last, fixed, scratch)
    if is_wide:
        light += _share(i + 24, RAYS + 3 * RAY, last, fixed, scratch)
        light += _share(i + 32, RAYS + 4 * RAY, last, fixed, scratch)
    scratch[REFLECTED + i] = light


@inner_kernel
def _share(k: int, ray: int, last: int, fixed: Floats, scratch: Floats) -> float:
    place = scratch[k] * fixed[ray + 2] * scratch[ABSORBS + k]
    return fixed[ray + 3] * _response(place if place < last else last, fixed)


@inner_kernel
def _response(place: float, fixed: Floats) -> float:
    below = int(place)
    response = fixed[RESPONSE + below]
    return response + (place - below) * (fixed[RESPONSE + below + 1] - response)
