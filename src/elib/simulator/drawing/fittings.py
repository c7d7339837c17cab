"""Lights, sounds and what can be pushed, as shapes of the top view."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

from elib.simulator.drawing.shapes import Area, Circle, Point, Shape, Stroke, blend
from elib.simulator.physics import Box, Colour, Cylinder
from elib.simulator.physics.fittings import Light, Sound

AMBER = Colour(255, 205, 70)
LAMP = Colour(255, 210, 60)
LAMP_EDGE = Colour(170, 112, 0)
TONE = Colour(122, 92, 192)
OFF = Colour(150, 152, 156)
WHITE = Colour(255, 255, 255)

GLOW_STEPS = 12
GLOW = 0.4  # How much of the light's own colour its middle has.
FURTHEST = 3.0  # m. A stronger light would only make the whole floor yellow.
MARK = 0.62  # Of the size of a thing: the outline that says it can be pushed.


def glow_shapes(
    lights: Sequence[Light], at: Callable[[float, float], Point], scale: float, floor: Colour
) -> Iterator[Shape]:
    """Return the shine of lamps on a floor of one colour, as far as where their light has fallen to 1/e.

    Args:
        lights: The lamps.
        at: From a place in the world, m, to a pixel.
        scale: Pixels a metre.
        floor: The colour they shine on.
    """
    for step in range(GLOW_STEPS):  # the pale rims of all of them first: where two shine, the brighter one is seen
        colour = blend(floor, AMBER, GLOW * ((step + 1) / GLOW_STEPS) ** 2)
        for light in lights:
            reach = min(0.5 * light.intensity, FURTHEST) * scale
            if reach > 1:
                yield Circle(at(light.x, light.y), reach * (1 - step / GLOW_STEPS), colour)


def lamp_shapes(light: Light, centre: Point, size: float) -> Iterator[Shape]:
    """Return a lamp, *size* pixels high: a sun, or a grey disc if it is switched off."""
    x, y = centre
    is_on = light.intensity > 0
    edge = LAMP_EDGE if is_on else OFF
    for k in range(8 if is_on else 0):
        cosine, sine = math.cos(k * math.pi / 4), math.sin(k * math.pi / 4)
        ends = tuple((x + far * size * cosine, y + far * size * sine) for far in (0.66, 0.92))
        yield Stroke(ends, edge, 0.11 * size)
    yield Circle(centre, 0.46 * size, LAMP if is_on else WHITE, edge, 0.11 * size)


def sound_shapes(sound: Sound, centre: Point, size: float) -> Iterator[Shape]:
    """Return a source of sound, *size* pixels high: a dot with up to three rings, or a grey one if it is silent."""
    is_on = sound.volume > 0
    rings = 1 + round(min(2.0, sound.volume / 1000)) if is_on else 0
    for ring in range(rings, 0, -1):
        yield Circle(centre, (0.3 + 0.3 * ring) * size, None, blend(TONE, WHITE, 0.22 * ring), 0.1 * size)
    yield Circle(centre, 0.3 * size, TONE if is_on else OFF)


def push_shapes(thing: Box | Cylinder, at: Callable[[float, float], Point], width: float) -> Iterator[Shape]:
    """Return the light outline within a thing that gives way to a robot.

    Args:
        thing: Any; of one that stands fast nothing is returned.
        at: From a place in the world, m, to a pixel.
        width: Width of the line, pixels.
    """
    if not thing.is_pushable:
        return
    pale = blend(thing.colour, WHITE, 0.7)
    if isinstance(thing, Cylinder):
        centre, rim = at(thing.x, thing.y), at(thing.x + thing.radius, thing.y)
        yield Circle(centre, MARK * (rim[0] - centre[0]), None, pale, width)
        return
    corners = tuple(at(thing.x + MARK * (x - thing.x), thing.y + MARK * (y - thing.y)) for x, y in thing.corners)
    yield Area(corners, thing.colour, pale, width)
