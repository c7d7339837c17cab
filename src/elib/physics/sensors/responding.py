"""What the infrared sensors make of the light they get back: gain, offset, noise and the ambient cap."""

from __future__ import annotations

from typing import Final

from elib.physics.engine import inner_kernel, kernel
from elib.physics.layout import (
    DIGEST,
    GAIN,
    HEAD,
    KEY,
    LIGHTS,
    NOW,
    NUMBER,
    OFFSET,
    QUANTILES,
    READINGS,
    ROOM,
    SEEN,
    SENSOR_NOISE,
    TICK,
    TRAITS,
    UNEVEN,
    Floats,
    Ints,
)
from elib.physics.noise import MASK, PROXIMITY, mix, tick_key
from elib.physics.noise import STRIDE as NEXT_CHANNEL
from elib.physics.sensors.light import AMBIENT_DEVIATION, ROOMS, darkness, lamplight

COUNT: Final = 8
"""Infrared sensors."""

AMBIENT_MARGIN: Final = 4 * AMBIENT_DEVIATION  # Beyond any noise: below it the cap need not be looked up.


@kernel
def respond(
    robot: int,
    lights_at: int,
    deviations_at: int,
    fixed: Floats,
    robots: Floats,
    walls: Floats,
    discs: Floats,
    numbers: Ints,
    lights: Floats,
    scratch: Floats,
) -> None:
    """Turn the light that a robot's sensors get back into its readings, unless it has them already.

    light = gain * what came back + offset + noise, cut at what the sensor reads with its emitter off, since the
    firmware sends the difference of the two.

    Args:
        robot: Whose.
        lights_at: Where in *scratch* that light begins, one a sensor, counts.
        deviations_at: Where the deviations of its noise begin.
        fixed: Settings.
        robots: All robots.
        walls: All walls, for the shadows.
        discs: All cylinders.
        numbers: Out: the readings, and the digest of all so far.
        lights: All lamps.
        scratch: Room for the lamps' light.
    """
    n = HEAD + robot * NUMBER
    if numbers[n + SEEN] == numbers[TICK]:
        return
    noise = fixed[SENSOR_NOISE]
    room = fixed[ROOM]
    margin = AMBIENT_MARGIN * noise
    limit = room - margin
    is_lit = numbers[LIGHTS] > 0
    is_shaded = False
    is_uneven = numbers[UNEVEN] > 0
    if is_lit:
        lamplight(robot, fixed, robots, walls, discs, lights, numbers, False, scratch)
    key = tick_key(numbers[n + KEY], numbers[TICK])
    numbers[n + NOW] = key
    gains = numbers[UNEVEN] + robot * TRAITS + GAIN
    offsets = gains + OFFSET - GAIN
    out = n + READINGS
    for first in range(0, COUNT, 3):
        word = 0
        if noise > 0.0:  # Three sensors share a word, ten bits each.
            word = mix((key + (PROXIMITY + first) * NEXT_CHANNEL) & MASK)
        for i in range(first, min(first + 3, COUNT)):
            light = scratch[lights_at + i]
            if is_uneven:
                light = light * fixed[gains + i] + fixed[offsets + i]
            if noise > 0.0:
                light += scratch[deviations_at + i] * noise * fixed[QUANTILES + (word & 1023)]
                word >>= 10
            if is_lit:
                room = scratch[ROOMS + i]
                limit = room - margin
                if light > limit and not is_shaded:  # Only then do shadows matter, which cost a lot.
                    is_shaded = True
                    lamplight(robot, fixed, robots, walls, discs, lights, numbers, True, scratch)
                    room = scratch[ROOMS + i]
                    limit = room - margin
            if light > limit:
                light = min(light, darkness(key, i, noise, room))
            numbers[out + i] = int((light if light > 0.0 else 0.0) + 0.5)
    note(n, numbers)


@inner_kernel
def note(n: int, numbers: Ints) -> None:
    """Note that the readings of the robot whose numbers begin at *n* are those of this tick, and digest them."""
    numbers[n + SEEN] = numbers[TICK]
    m = n + READINGS
    digest = numbers[n + DIGEST]
    front = numbers[m] | numbers[m + 1] << 12 | numbers[m + 2] << 24 | numbers[m + 3] << 36
    rear = numbers[m + 4] | numbers[m + 5] << 12 | numbers[m + 6] << 24 | numbers[m + 7] << 36
    digest = ((digest ^ front) * 0x735A2D97) & 0xFFFFFFFFFFFF
    digest = (((digest ^ (digest >> 23)) ^ rear) * 0x21F0AAAD) & 0xFFFFFFFFFFFF
    numbers[n + DIGEST] = digest ^ (digest >> 23)
