"""The rays of one infrared sensor and the light that comes back: a part of :mod:`elib.physics.sensors.glance`.

All that is on the sensor's list is looked at before the next sensor. So the lengths of its rays are local names, which
cost a third of elements of a sequence.
"""

from __future__ import annotations

from math import sqrt
from typing import Final, TypeAlias

from elib.physics.engine import interpreted_kernel
from elib.physics.layout import (
    IR_REACH,
    RAY,
    RAYS,
    RESPONSE,
    SPREAD,
    WIDEST,
    Floats,
)
from elib.physics.sensors.rays import DEVIATION, FARTHER, NOTHING, PRESSED, REFLECTED

OUTER: Final = RAYS + RAY
OUTERMOST: Final = RAYS + 3 * RAY
"""Where the left rays of the first and of the second pair stand; the right ones are their mirror images."""

Sight: TypeAlias = tuple[float, ...]
"""A wall: tangent x, y; offset of its line; where it begins and ends along its tangent; 1 / reflectance. A disc: its
centre seen from the robot's, radius, 1 / reflectance. All in m."""


@interpreted_kernel
def measure(
    sensor: int,
    axis_x: float,
    axis_y: float,
    from_x: float,
    from_y: float,
    is_drawn: bool,
    faced: list[Sight],
    is_round: bool,
    passed: list[list[Sight]],
    rays: int,
    last: int,
    fixed: Floats,
    scratch: Floats,
) -> None:
    """Cast the rays of a sensor that was at *from*, seen from the robot's centre now, and looked along *axis*.

    What no ray can meet is left out early, unless the axis may be longer than 1 (*is_drawn*).
    """
    reach = fixed[IR_REACH]
    farthest = fixed[IR_REACH] * FARTHER
    widest = fixed[WIDEST]
    spread = fixed[SPREAD]
    # Of the wall that each ray meets 1 / length and 1 / reflectance.
    nothing = 1.0 / reach
    ahead = left = right = far_left = far_right = nothing
    pale = pale_left = pale_right = pale_far_left = pale_far_right = NOTHING
    for tangent_x, tangent_y, offset, start, end, absorbs in faced:
        across = tangent_x * axis_y - tangent_y * axis_x
        sliding = tangent_x * axis_x + tangent_y * axis_y
        gap = offset - (tangent_x * from_y - tangent_y * from_x)
        closing = across
        turning = sliding
        if gap <= PRESSED:  # Astride or behind it, or pressed into it.
            if gap < -PRESSED or offset < 0.0:
                closing = -across
                turning = -sliding
            gap = max(-gap, PRESSED)
        # The ray that closes fastest: the outermost one on that side, unless the wall's foot lies between the rays.
        aside = turning if turning >= 0.0 else -turning
        if gap >= (farthest * (closing * widest + aside * spread) if closing < widest else farthest) and not is_drawn:
            continue
        along = tangent_x * from_x + tangent_y * from_y
        start -= along
        end -= along
        inverse = 1.0 / gap
        closing *= inverse
        turning *= inverse
        ahead, pale = _cross(ahead, pale, closing, sliding, start, end, absorbs)
        if rays > 1:
            straight, tilted, slide, drift = _rotated(closing, turning, sliding, across, OUTER, fixed)
            left, pale_left = _cross(left, pale_left, straight + tilted, slide - drift, start, end, absorbs)
            right, pale_right = _cross(right, pale_right, straight - tilted, slide + drift, start, end, absorbs)
        if rays > 3:
            straight, tilted, slide, drift = _rotated(closing, turning, sliding, across, OUTERMOST, fixed)
            far_left, pale_far_left = _cross(
                far_left, pale_far_left, straight + tilted, slide - drift, start, end, absorbs
            )
            far_right, pale_far_right = _cross(
                far_right, pale_far_right, straight - tilted, slide + drift, start, end, absorbs
            )
    # From here on lengths: a disc may be nearer.
    ahead = 1.0 / ahead
    if rays > 1:
        left = 1.0 / left
        right = 1.0 / right
    if rays > 3:
        far_left = 1.0 / far_left
        far_right = 1.0 / far_right
    if is_round:
        for dx, dy, radius, absorbs in passed[sensor]:
            centre_x = dx - from_x
            centre_y = dy - from_y
            square = centre_x * centre_x + centre_y * centre_y
            limit = farthest + radius
            if square >= limit * limit and not is_drawn:
                continue
            closing = centre_x * axis_x + centre_y * axis_y
            aside = centre_y * axis_x - centre_x * axis_y
            if (abs(aside) * widest - closing * spread > radius * FARTHER or closing < -radius) and not is_drawn:
                continue  # Beyond the outermost ray, or behind.
            outside = square - radius * radius
            ahead, pale = _meet(ahead, pale, closing, outside, absorbs)
            if rays > 1:
                straight = closing * fixed[OUTER]
                tilted = aside * fixed[OUTER + 1]
                left, pale_left = _meet(left, pale_left, straight + tilted, outside, absorbs)
                right, pale_right = _meet(right, pale_right, straight - tilted, outside, absorbs)
            if rays > 3:
                straight = closing * fixed[OUTERMOST]
                tilted = aside * fixed[OUTERMOST + 1]
                far_left, pale_far_left = _meet(far_left, pale_far_left, straight + tilted, outside, absorbs)
                far_right, pale_far_right = _meet(far_right, pale_far_right, straight - tilted, outside, absorbs)
    response, below = _response(ahead * fixed[RAYS + 2] * pale, last, fixed)
    light = fixed[RAYS + 3] * response
    scratch[DEVIATION + sensor] = fixed[RESPONSE + last + 1 + below]
    if rays > 1:
        light = _lit(light, OUTER, left, pale_left, last, fixed)
        light = _lit(light, OUTER + RAY, right, pale_right, last, fixed)
    if rays > 3:
        light = _lit(light, OUTERMOST, far_left, pale_far_left, last, fixed)
        light = _lit(light, OUTERMOST + RAY, far_right, pale_far_right, last, fixed)
    scratch[REFLECTED + sensor] = light


@interpreted_kernel
def _rotated(
    closing: float, turning: float, sliding: float, across: float, ray: int, fixed: Floats
) -> tuple[float, float, float, float]:
    """Return the parts of which a left ray's speed towards a wall and along it are made, and its mirror image's."""
    cosine = fixed[ray]
    sine = fixed[ray + 1]
    return closing * cosine, turning * sine, sliding * cosine, across * sine


@interpreted_kernel
def _cross(
    nearest: float, pale: float, near: float, sliding: float, start: float, end: float, absorbs: float
) -> tuple[float, float]:
    """Return 1 / length and 1 / reflectance of what a ray meets now that there is a wall too.

    The ray comes 1 nearer to the wall in 1 / *near*, and slides along it by *sliding* in 1.
    """
    if near > nearest and start * near <= sliding <= end * near:
        return near, absorbs
    return nearest, pale


@interpreted_kernel
def _meet(nearest: float, pale: float, closing: float, outside: float, absorbs: float) -> tuple[float, float]:
    """Return length and 1 / reflectance of what a ray meets now that there is a disc too."""
    if closing > 0.0:
        under = closing * closing - outside
        if under >= 0.0:
            # A sensor that is pressed into its neighbour by the tolerance of the contact sees it at 0.
            length = max(closing - sqrt(under), 0.0)
            if length < nearest:
                return length, absorbs
    return nearest, pale


@interpreted_kernel
def _lit(light: float, ray: int, length: float, pale: float, last: int, fixed: Floats) -> float:
    """Return *light* with what comes back along a ray."""
    response, _ = _response(length * fixed[ray + 2] * pale, last, fixed)
    return light + fixed[ray + 3] * response


@interpreted_kernel
def _response(place: float, last: int, fixed: Floats) -> tuple[float, int]:
    """Return the counts at a place of the response table, and the entry before it."""
    if place < float(last):
        below = int(place)
        response = fixed[RESPONSE + below]
        return response + (place - below) * (fixed[RESPONSE + 1 + below] - response), below
    return fixed[RESPONSE + last], last
