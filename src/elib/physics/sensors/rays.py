"""Rays to the nearest surface, one sensor and one surface at a time.

This is what the time-of-flight sensor measures, and how long the infrared beams are that are drawn. The infrared
readings come from the same laws in two faster forms.

All rays of a sensor leave its place at fixed angles from its axis. A surface is first put into the frame of the robot,
or of the sensor, so that each ray costs a rotation by its own angle and one division.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from elib.physics.engine import inner_kernel
from elib.physics.layout import AXIS_X, AXIS_Y, PLACE_X, PLACE_Y, RAY, RAYS, SPREAD, WIDEST, Floats

HITS: Final = 80
"""Where in the scratch the sensors' marks begin: 0 until a surface may have met one of its rays."""

STRIDE: Final = 8
"""Between two rays of a sensor in the scratch, up to five of them, the middle one first: the rays of eight sensors lie
side by side."""

ABSORBS: Final = 40
"""Where in the scratch 1 / reflectance of what each ray meets begins; its length stands at 0."""

POSE: Final = 88
"""Where in the scratch that begins which an infrared look knows of its robot: heading x, y; turn and step of its last
tick x, y; how much of that tick a slot is."""

CALM: Final = 95
"""Where in the scratch stands whether the robot moved so little while its sensors were read that the lists of those
that look in a direction hold: 1, or 0 where a contact has thrown it about."""

SENSOR_HEIGHT: Final = 0.033
"""Of the infrared sensors above the floor, m (Webots). What is lower is not seen."""

REFLECTED: Final = 112
"""Where in the scratch the light that the infrared sensors get back begins, one a sensor, counts."""

DEVIATION: Final = 120
"""Where in the scratch the deviations of its noise begin."""

NOTHING: Final = 4.0
"""What stands there for a ray that meets nothing: it then ends beyond every table of responses."""

FARTHER: Final = 1.0 + 1e-9
"""What no ray can reach is left out early, but for so little that rounding cannot leave out what one can."""

PRESSED: Final = 1e-6
"""m. A sensor that rounding or the tolerance of contacts has put so far behind a surface still sees it, right there."""


@inner_kernel
def meet_wall(
    sensor: int,
    rays: int,
    normal_x: float,
    normal_y: float,
    offset: float,
    start: float,
    end: float,
    absorbs: float,
    reach: float,
    fixed: Floats,
    scratch: Floats,
) -> None:
    """Shorten the rays of one sensor that meet a wall.

    Args:
        sensor: Its index in *fixed*.
        rays: How many it has.
        normal_x: Unit normal of the wall in the robot's frame, so that the wall is where normal . p == offset.
        normal_y: Its other part; the tangent is (normal_y, -normal_x).
        offset: Distance of the wall's line from the robot, m.
        start: Where the wall begins along its tangent, from the foot of the robot's centre, m.
        end: Where it ends, m.
        absorbs: 1 / its reflectance.
        reach: How far a ray goes, m.
        fixed: The rays, and the places of the sensors.
        scratch: In and out: length and 1 / reflectance of what each ray of each sensor meets; from :data:`HITS` on
            whether those of a sensor hold.
    """
    axis_x = fixed[AXIS_X + sensor]
    axis_y = fixed[AXIS_Y + sensor]
    across = normal_x * axis_x + normal_y * axis_y
    sliding = normal_y * axis_x - normal_x * axis_y
    place_x = fixed[PLACE_X + sensor]
    place_y = fixed[PLACE_Y + sensor]
    gap = offset - normal_x * place_x - normal_y * place_y
    closing = across
    turning = sliding
    if offset < 0.0:  # Seen from the robot's side of it.
        gap = -gap
        closing = -closing
        turning = -turning
    if gap < 0.0:
        if gap > -PRESSED:
            gap = 0.0
        else:  # The sensor is beyond the line and looks back at it.
            gap = -gap
            closing = -closing
            turning = -turning
    # The ray that closes fastest: the outermost one on that side, unless the wall's foot lies between the rays.
    fastest = 1.0
    if closing < fixed[WIDEST]:
        fastest = closing * fixed[WIDEST] + abs(turning) * fixed[SPREAD]
    if gap >= reach * FARTHER * fastest:
        return
    along = normal_y * place_x - normal_x * place_y
    at = sensor
    if scratch[HITS + sensor] == 0.0:
        scratch[HITS + sensor] = 1.0
        for k in range(at, at + STRIDE * rays, STRIDE):
            scratch[k] = reach
            scratch[ABSORBS + k] = NOTHING
    if closing > 0.0:
        length = gap / closing
        if length < scratch[at] and start <= along + length * sliding <= end:
            scratch[at] = length
            scratch[ABSORBS + at] = absorbs
    for k in range(RAYS + RAY, RAYS + rays * RAY, 2 * RAY):
        cosine = fixed[k]
        sine = fixed[k + 1]
        straight = closing * cosine
        tilted = turning * sine
        at += STRIDE
        speed = straight + tilted
        if speed > 0.0:
            length = gap / speed
            if length < scratch[at] and start <= along + length * (sliding * cosine - across * sine) <= end:
                scratch[at] = length
                scratch[ABSORBS + at] = absorbs
        at += STRIDE
        speed = straight - tilted
        if speed > 0.0:
            length = gap / speed
            if length < scratch[at] and start <= along + length * (sliding * cosine + across * sine) <= end:
                scratch[at] = length
                scratch[ABSORBS + at] = absorbs


@inner_kernel
def meet_disc(
    sensor: int,
    rays: int,
    centre_x: float,
    centre_y: float,
    radius: float,
    absorbs: float,
    reach: float,
    fixed: Floats,
    scratch: Floats,
) -> None:
    """Shorten the rays of one sensor that meet a disc with this centre in the robot's frame, m."""
    axis_x = fixed[AXIS_X + sensor]
    axis_y = fixed[AXIS_Y + sensor]
    dx = centre_x - fixed[PLACE_X + sensor]
    dy = centre_y - fixed[PLACE_Y + sensor]
    square = dx * dx + dy * dy
    limit = reach * FARTHER + radius
    if square >= limit * limit:
        return
    ahead = dx * axis_x + dy * axis_y
    aside = dy * axis_x - dx * axis_y
    if abs(aside) * fixed[WIDEST] - ahead * fixed[SPREAD] > radius * FARTHER or ahead < -radius:
        return  # Beyond the outermost ray, or behind.
    outside = square - radius * radius
    at = sensor
    if scratch[HITS + sensor] == 0.0:
        scratch[HITS + sensor] = 1.0
        for k in range(at, at + STRIDE * rays, STRIDE):
            scratch[k] = reach
            scratch[ABSORBS + k] = NOTHING
    for k in range(RAYS, RAYS + rays * RAY, RAY):
        closing = ahead * fixed[k] + aside * fixed[k + 1]
        under = closing * closing - outside
        if closing > 0.0 and under >= 0.0:
            # A sensor that is pressed into its neighbour by the tolerance of the contact sees it at 0.
            length = max(closing - sqrt(under), 0.0)
            if length < scratch[at]:
                scratch[at] = length
                scratch[ABSORBS + at] = absorbs
        at += STRIDE
