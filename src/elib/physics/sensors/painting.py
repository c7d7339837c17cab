"""Kernels of the camera: from what stands in each column to pixels."""

from __future__ import annotations

from elib.physics.engine import kernel
from elib.physics.layout import (
    DISC,
    DISC_COLOUR,
    TANGENT_X,
    WALL,
    WALL_COLOUR,
    Floats,
    Ints,
)
from elib.physics.sensors.backdrop import paint_floor
from elib.physics.sensors.casting import FACING, HIT, MARKS, RISE, SKYLINE
from elib.physics.sensors.optics import (
    ABOVE,
    ACROSS,
    COLUMNS,
    DISC_COUNT,
    DOWN,
    FIRST_ROW,
    HORIZON,
    LIGHT_COUNT,
    ORIGIN,
    PAINT_COLUMNS,
    PER_RISE,
    ROWS,
    SHOWING,
    VIEW,
    WALL_COUNT,
    fade,
    lamp_light,
    led_light,
)
from elib.physics.sensors.shining import (
    BODY_COLOUR,
    RING_HIGH,
    RING_INNER,
    RING_LOW,
    RING_OUTER,
    fill,
    paint_robot,
    shine,
)


@kernel
def paint_columns(
    eye_x: float,
    eye_y: float,
    heading_x: float,
    heading_y: float,
    room: float,
    gain: float,
    led: float,
    robots: Floats,
    walls: Floats,
    discs: Floats,
    lamps: Ints,
    lights: Floats,
    paint: Ints,
    view: Floats,
    plan: Ints,
    hits: Floats,
    marks: Ints,
    pixels: Ints,
) -> None:
    """Paint every column from its lowest row up: floor and things by turns, from near to far."""
    columns = plan[COLUMNS]
    rows = plan[ROWS]
    across = plan[ACROSS]
    down = plan[DOWN]
    first_row = view[FIRST_ROW]
    per_rise = view[PER_RISE]
    foot_rise = ABOVE * per_rise
    ring_high = (RING_HIGH - ABOVE) * per_rise
    ring_low = (RING_LOW - ABOVE) * per_rise
    level = room * gain
    is_plain = led == 0.0 and plan[LIGHT_COUNT] == 0
    has_pattern = plan[PAINT_COLUMNS] > 0 or not is_plain
    is_showing = plan[SHOWING] > 0
    walls_end = plan[WALL_COUNT]
    discs_end = walls_end + plan[DISC_COUNT]
    before = -1  # The thing of which colour and shade are known.
    colour = outer = inner = 0
    base = 0.0
    cell = plan[ORIGIN] - across
    for column in range(columns):
        cell += across
        below = rows  # From here on down everything is painted.
        hit = column * SKYLINE - HIT
        mark = column * MARKS
        for k in range(mark + 1, mark + 1 + marks[mark]):
            hit += HIT
            near = hits[hit]
            place = first_row - hits[hit + RISE] * per_rise
            start = 0
            if place >= below:
                start = below
            elif place > 0.0:
                start = int(place) + 1
            place = first_row + near * foot_rise
            stop = below
            if place < below - 1:
                stop = 0 if place < 0.0 else int(place) + 1
                if has_pattern and stop < below:
                    tangent = view[VIEW + column]
                    forward_x = heading_x + tangent * heading_y
                    forward_y = heading_y - tangent * heading_x
                    paint_floor(
                        eye_x,
                        eye_y,
                        forward_x,
                        forward_y,
                        tangent,
                        room,
                        gain,
                        led,
                        lights,
                        paint,
                        view,
                        plan,
                        cell,
                        stop,
                        below,
                        pixels,
                    )
            if start < stop:
                thing = marks[k]
                if thing != before:
                    before = thing
                    base = 0.6
                    colour = BODY_COLOUR
                    if thing < walls_end:
                        tangent_x = walls[thing * WALL + TANGENT_X]
                        base = 0.78 + 0.2 * tangent_x * tangent_x
                        colour = int(walls[thing * WALL + WALL_COLOUR])
                    elif thing < discs_end:
                        colour = int(discs[(thing - walls_end) * DISC + DISC_COLOUR])
                    outer = colour & 0xFF00FF
                    inner = colour & 0x00FF00
                dimmed = base
                if thing >= walls_end:
                    dimmed += 0.4 * hits[hit + FACING]
                white = dimmed * level * (0.82 + 0.18 * near / (near + 2.0))  # optics.fade, without a call
                if is_plain and white <= 1.0 and (thing < discs_end or not is_showing):  # shine, without a call
                    part = int(white * 256.0)
                    seen = (outer * part >> 8 & 0xFF00FF) | (inner * part >> 8 & 0x00FF00)
                    fill(pixels, cell + start * down, stop - start, down, seen)
                    if thing >= discs_end:
                        high = start
                        place = first_row - near * ring_high
                        if place > start:
                            high = int(place) + 1
                        low = stop
                        place = first_row - near * ring_low
                        if place < stop:
                            low = 0 if place < 0.0 else int(place) + 1
                        if high < low:
                            seen = (RING_OUTER * part >> 8 & 0xFF00FF) | (RING_INNER * part >> 8 & 0x00FF00)
                            fill(pixels, cell + high * down, low - high, down, seen)
                else:
                    _paint_lit(
                        thing,
                        colour,
                        white,
                        eye_x,
                        eye_y,
                        heading_x,
                        heading_y,
                        view[VIEW + column],
                        near,
                        dimmed,
                        gain,
                        led,
                        robots,
                        lamps,
                        lights,
                        view,
                        plan,
                        start,
                        stop,
                        cell,
                        pixels,
                    )
            if start < below:
                below = start
        if has_pattern and plan[HORIZON] < below:
            tangent = view[VIEW + column]
            forward_x = heading_x + tangent * heading_y
            forward_y = heading_y - tangent * heading_x
            paint_floor(
                eye_x,
                eye_y,
                forward_x,
                forward_y,
                tangent,
                room,
                gain,
                led,
                lights,
                paint,
                view,
                plan,
                cell,
                plan[HORIZON],
                below,
                pixels,
            )


@kernel
def _paint_lit(
    thing: int,
    colour: int,
    white: float,
    eye_x: float,
    eye_y: float,
    heading_x: float,
    heading_y: float,
    tangent: float,
    near: float,
    dimmed: float,
    gain: float,
    led: float,
    robots: Floats,
    lamps: Ints,
    lights: Floats,
    view: Floats,
    plan: Ints,
    start: int,
    stop: int,
    cell: int,
    pixels: Ints,
) -> None:
    """Paint rows *start* to *stop* of one column where a robot is, or where more than the room's light falls."""
    depth = 1.0 / near
    forward_x = heading_x + tangent * heading_y
    forward_y = heading_y - tangent * heading_x
    dimmed *= fade(near) * gain
    warm = 0.0
    if led > 0.0:
        warm = dimmed * led_light(depth, depth * tangent)
    if plan[LIGHT_COUNT] > 0:
        white += dimmed * lamp_light(eye_x + depth * forward_x, eye_y + depth * forward_y, ABOVE, lights, plan)
    first = plan[WALL_COUNT] + plan[DISC_COUNT]
    if thing >= first:
        paint_robot(
            thing - first,
            eye_x,
            eye_y,
            forward_x,
            forward_y,
            near,
            white,
            warm,
            gain,
            robots,
            lamps,
            plan,
            view[FIRST_ROW],
            near * view[PER_RISE],
            start,
            stop,
            cell,
            plan[DOWN],
            pixels,
        )
    else:
        fill(pixels, cell + start * plan[DOWN], stop - start, plan[DOWN], shine(colour, white, warm))
