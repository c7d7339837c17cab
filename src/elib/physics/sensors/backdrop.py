"""Kernels of the camera: the floor, bare or painted, and what is behind everything."""

from __future__ import annotations

from elib.physics.engine import kernel
from elib.physics.layout import Floats, Ints
from elib.physics.sensors.optics import (
    ACROSS,
    BACKGROUND,
    COLUMNS,
    DOWN,
    FLOOR,
    HORIZON,
    LEVEL,
    LIGHT_COUNT,
    ORIGIN,
    PAINT_COLUMNS,
    PAINT_ROWS,
    PAINT_SCALE,
    ROWS,
    VIEW,
    lamp_light,
    led_light,
)
from elib.physics.sensors.shining import shine


@kernel
def paint_backdrop(level: float, view: Floats, plan: Ints, blank: Ints, pixels: Ints) -> None:
    """Paint the bare floor and the background in a room's light, both into *blank* and *pixels*."""
    columns = plan[COLUMNS]
    shades = VIEW + 3 * columns + plan[ROWS]
    horizon = plan[HORIZON]
    for row in range(plan[ROWS]):
        colour = shine(plan[BACKGROUND] if row < horizon else plan[FLOOR], level * view[shades + row], 0.0)
        start = plan[ORIGIN] + row * plan[DOWN]
        for cell in range(start, start + columns * plan[ACROSS], plan[ACROSS]):
            blank[cell] = colour
            pixels[cell] = colour
    view[LEVEL] = level


@kernel
def paint_floor(
    eye_x: float,
    eye_y: float,
    forward_x: float,
    forward_y: float,
    tangent: float,
    room: float,
    gain: float,
    led: float,
    lights: Floats,
    paint: Ints,
    view: Floats,
    plan: Ints,
    cell: int,
    start: int,
    stop: int,
    pixels: Ints,
) -> None:
    """Paint the floor in rows *start* to *stop* of one column, whose ray goes (forward_x, forward_y) for each metre."""
    down = plan[DOWN]
    columns = plan[PAINT_COLUMNS]
    rows = plan[PAINT_ROWS]
    scale = view[PAINT_SCALE]
    depths = VIEW + 3 * plan[COLUMNS]
    shades = depths + plan[ROWS]
    level = room * gain
    is_lit = plan[LIGHT_COUNT] > 0
    pixel = cell + start * down
    for row in range(start, stop):
        depth = view[depths + row]
        x = eye_x + depth * forward_x
        y = eye_y + depth * forward_y
        colour = plan[FLOOR]
        if x >= 0.0 and y >= 0.0:
            u = x * scale
            v = y * scale
            if u < columns and v < rows:
                colour = paint[int(v) * columns + int(u)] & 0xFFFFFF
        shade = view[shades + row]
        white = shade * level
        warm = 0.0
        if is_lit:
            white += shade * gain * lamp_light(x, y, 0.0, lights, plan)
        if led > 0.0:
            warm = shade * led * led_light(depth, depth * tangent)
        pixels[pixel] = shine(colour, white, warm)
        pixel += down
