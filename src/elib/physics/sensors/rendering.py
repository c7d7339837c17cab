"""The camera's kernel: one picture from start to end, 65536 red + 256 green + blue for each pixel."""

from __future__ import annotations

from typing import Final

from elib.physics.engine import kernel
from elib.physics.layout import HEADING_X, HEADING_Y, INTENSITY, LIGHT, LIGHT_TOP, ROBOT, Floats, Ints, X, Y
from elib.physics.sensors.backdrop import paint_backdrop
from elib.physics.sensors.casting import MARKS, NEAREST, meet_discs, meet_robots, meet_walls
from elib.physics.sensors.optics import (
    ABOVE,
    COLUMNS,
    DISC_COUNT,
    FORWARD,
    LEVEL,
    LIGHT_COUNT,
    ROBOT_COUNT,
    SHOWING,
    exposure,
    lamp_light,
    room_light,
)
from elib.physics.sensors.painting import paint_columns
from elib.physics.sensors.shining import LAMPS, LAMPS_FRONT, paint_lamp

WEIGHT: Final = 40503  # 65536 / golden ratio: neighbours weigh differently.


@kernel
def render(
    robot: int,
    ambient: float,
    robots: Floats,
    walls: Floats,
    discs: Floats,
    lamps: Ints,
    lights: Floats,
    paint: Ints,
    hits: Floats,
    marks: Ints,
    view: Floats,
    plan: Ints,
    blank: Ints,
    pixels: Ints,
) -> None:
    """Take a picture.

    Args:
        robot: Index of the robot that looks.
        ambient: What infrared sensors read in the room's light, counts, higher is darker.
        robots: All robots.
        walls: All walls, the sides of boxes among them.
        discs: All cylinders.
        lamps: What each robot shows, :data:`LAMPS` integers: eight colours of its ring, body 0 or 1, front 0 or 1;
            empty if none shows anything.
        lights: All lamps of the world.
        paint: The floor's picture.
        hits: Scratch: :data:`~elib.physics.sensors.casting.SKYLINE` floats a column.
        marks: Scratch: :data:`~elib.physics.sensors.casting.MARKS` integers a column.
        view: The window's tables (:mod:`elib.physics.sensors.optics`).
        plan: The window's numbers.
        blank: Kept from picture to picture: floor and background alone.
        pixels: In: a copy of *blank*. Out: the picture.
    """
    here = robot * ROBOT
    heading_x = robots[here + HEADING_X]
    heading_y = robots[here + HEADING_Y]
    eye_x = robots[here + X] + FORWARD * heading_x
    eye_y = robots[here + Y] + FORWARD * heading_y
    for mark in range(0, plan[COLUMNS] * MARKS, MARKS):
        marks[mark] = 0
    meet_walls(eye_x, eye_y, heading_x, heading_y, walls, view, plan, hits, marks)
    if plan[DISC_COUNT] > 0:
        meet_discs(eye_x, eye_y, heading_x, heading_y, discs, view, plan, hits, marks)
    if plan[ROBOT_COUNT] > 1:
        meet_robots(robot, eye_x, eye_y, heading_x, heading_y, robots, view, plan, hits, marks)
    room = room_light(ambient)
    light = room
    if plan[LIGHT_COUNT] > 0:
        light += lamp_light(eye_x, eye_y, ABOVE, lights, plan)
    gain = exposure(light)
    led = 0.0
    if plan[SHOWING] > 0 and lamps[robot * LAMPS + LAMPS_FRONT] != 0:
        led = gain
    if view[LEVEL] != room * gain:
        paint_backdrop(room * gain, view, plan, blank, pixels)
    paint_columns(
        eye_x,
        eye_y,
        heading_x,
        heading_y,
        room,
        gain,
        led,
        robots,
        walls,
        discs,
        lamps,
        lights,
        paint,
        view,
        plan,
        hits,
        marks,
        pixels,
    )
    for k in range(0, plan[LIGHT_COUNT] * LIGHT, LIGHT):
        if lights[k + INTENSITY] > 0.0:
            dx = lights[k] - eye_x
            dy = lights[k + 1] - eye_y
            depth = dx * heading_x + dy * heading_y
            if depth > NEAREST:
                aside = dx * heading_y - dy * heading_x
                paint_lamp(1.0 / depth, aside / depth, lights[k + LIGHT_TOP], view, plan, hits, marks, pixels)


@kernel
def render_spread(
    robot: int,
    ambient: float,
    robots: Floats,
    walls: Floats,
    discs: Floats,
    lamps: Ints,
    lights: Floats,
    paint: Ints,
    hits: Floats,
    marks: Ints,
    view: Floats,
    plan: Ints,
    blank: Ints,
    pixels: Ints,
    size: int,
    counts: Ints,
) -> int:
    """Take a picture of *size* pixels, and write red, green and blue of each side by side into *counts*, bytes.

    Returns:
        The sum of all pixels, each times a number of its place, 32 bits: what tells two pictures apart.
    """
    for k in range(size):
        pixels[k] = blank[k]
    render(robot, ambient, robots, walls, discs, lamps, lights, paint, hits, marks, view, plan, blank, pixels)
    at = 0
    digest = 0
    for k in range(size):
        colour = pixels[k]
        counts[at] = colour >> 16
        counts[at + 1] = colour >> 8 & 255
        counts[at + 2] = colour & 255
        at += 3
        digest += colour * ((k * WEIGHT & 0xFFFF) | 1)
    return digest & 0xFFFFFFFF
