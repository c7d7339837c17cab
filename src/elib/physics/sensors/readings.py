"""Eight infrared readings at once from what the rays met: a part of :mod:`elib.physics.sensors.sweep`."""

from __future__ import annotations

from elib.physics.engine import inner_kernel
from elib.physics.layout import (
    CHANNELS,
    CLEAR,
    GAIN,
    HEAD,
    KEY,
    LAST,
    NOW,
    NUMBER,
    OFFSET,
    QUANTILES,
    RAY,
    RAYS,
    READINGS,
    RESPONSE,
    ROOM,
    SEEN,
    SENSOR_NOISE,
    SHIFTS,
    SLATE_AT,
    TICK,
    TRAITS,
    UNEVEN,
    Floats,
    Ints,
)
from elib.physics.noise import MASK, mix, tick_key
from elib.physics.room import (
    BEAM,
    BEAMS,
    DARK,
    LIGHT,
    LIT,
    NOISES,
    PLACE,
    PLACES,
    POSED,
    POSES,
    SEEING,
)
from elib.physics.sensors.light import darkness
from elib.physics.sensors.rays import ABSORBS
from elib.physics.sensors.responding import AMBIENT_MARGIN, COUNT
from elib.physics.vector import after, choose, load, mask, pick, pick_two, real, spread, store, whole


@inner_kernel
def look_up_noise(robot: int, b: int, numbers: Ints) -> None:
    """Find where the noise of each of a robot's sensors stands among the quantiles."""
    n = HEAD + robot * NUMBER
    key = tick_key(numbers[n + KEY], numbers[TICK])
    numbers[n + NOW] = key
    word = (mix((load(numbers, CHANNELS) + key) & MASK) >> load(numbers, SHIFTS)) & 1023
    store(numbers, numbers[SLATE_AT] + NOISES + b * COUNT, word + QUANTILES)


@inner_kernel
def look_up_light(b: int, rays: int, fixed: Floats, numbers: Ints, scratch: Floats) -> None:
    """Find where each ray of a robot stands in the table of responses."""
    last = numbers[LAST]
    out = numbers[SLATE_AT] + PLACES + b * PLACE
    at = BEAMS + b * BEAM
    for ray in range(rays):
        place = load(scratch, at) * fixed[RAYS + ray * RAY + 2] * load(scratch, at + ABSORBS)
        place = choose(place < last, place, real(spread(last)))
        below = whole(place)
        store(scratch, at, place - real(below))
        store(numbers, out, below + RESPONSE)
        at += COUNT
        out += COUNT


@inner_kernel
def reflect(b: int, rays: int, fixed: Floats, numbers: Ints, scratch: Floats) -> None:
    """Find how much light each sensor of a robot gets back, counts, and the deviation of its noise there."""
    last = numbers[LAST]
    out = LIGHT + b * LIT
    if scratch[POSES + b * POSED + SEEING] == 0.0:
        store(scratch, out, spread(fixed[CLEAR]))
        store(scratch, out + DARK, spread(fixed[RESPONSE + last + 1 + last]))
        return
    place = numbers[SLATE_AT] + PLACES + b * PLACE
    store(scratch, out + DARK, pick(after(fixed, last + 1), numbers, place))
    light = spread(0.0)
    for ray in range(rays):
        response, following = pick_two(fixed, numbers, place + ray * COUNT)
        part = load(scratch, BEAMS + b * BEAM + ray * COUNT)
        light = light + fixed[RAYS + ray * RAY + 3] * (response + part * (following - response))
    store(scratch, out, light)


@inner_kernel
def respond_unlit(robot: int, b: int, fixed: Floats, numbers: Ints, scratch: Floats) -> None:
    """Turn the light that a robot's sensors get back into its readings, where no lamp shines."""
    n = HEAD + robot * NUMBER
    if numbers[n + SEEN] == numbers[TICK]:
        return
    noise = fixed[SENSOR_NOISE]
    room = fixed[ROOM]
    at = LIGHT + b * LIT
    light = load(scratch, at)
    if numbers[UNEVEN] > 0:
        traits = numbers[UNEVEN] + robot * TRAITS
        light = light * load(fixed, traits + GAIN) + load(fixed, traits + OFFSET)
    if noise > 0.0:
        quantile = pick(fixed, numbers, numbers[SLATE_AT] + NOISES + b * COUNT)
        light = light + load(scratch, at + DARK) * noise * quantile
    if mask(light > room - AMBIENT_MARGIN * noise) != 0:
        store(scratch, at, light)
        key = numbers[n + NOW]
        for i in range(COUNT):
            if scratch[at + i] > room - AMBIENT_MARGIN * noise:
                scratch[at + i] = min(scratch[at + i], darkness(key, i, noise, room))
        light = load(scratch, at)
    store(numbers, n + READINGS, whole(choose(light > 0.0, light, 0.0) + 0.5))
