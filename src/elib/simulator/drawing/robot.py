"""An e-puck from above: body, wheels, ring of LEDs, and a nose to see where it looks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from elib.simulator.drawing.shapes import Area, Circle, Point, Shape, blend
from elib.simulator.physics import Colour, RobotView

BODY = Colour(66, 73, 82)
OUTLINE = Colour(32, 36, 43)
RING = Colour(178, 214, 168)
BOARD = Colour(44, 98, 66)
TYRE = Colour(28, 30, 34)
NOSE = Colour(250, 250, 246)
UNLIT = Colour(140, 172, 132)
BODY_LIGHT = Colour(120, 236, 110)
FRONT_LIGHT = Colour(255, 140, 40)

LED_ANGLES = (0.0, -48.65, -90.0, -143.3, 180.0, 143.3, 90.0, 48.65)
"""Where the ring LEDs sit, degrees from straight ahead, positive to the left (Webots)."""


def robot_shapes(robot: RobotView, at: Callable[[float, float], Point], scale: float) -> Iterator[Shape]:
    """Return the shapes of one robot.

    Args:
        robot: What to draw.
        at: From a place in the world, m, to a pixel.
        scale: Pixels a metre.
    """
    pose = robot.pose
    cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
    size = robot.radius

    def place(ahead: float, left: float) -> Point:
        """Return the pixel of a point in units of the radius in the robot's frame."""
        u, v = ahead * size, left * size
        return at(pose.x + cosine * u - sine * v, pose.y + sine * u + cosine * v)

    centre = at(pose.x, pose.y)
    radius = size * scale
    yield Circle(centre, radius, BODY, OUTLINE, max(1.0, 0.05 * radius))
    for side in (-1, 1):
        corners = tuple(place(u, side * v) for u, v in ((-0.34, 0.66), (0.34, 0.66), (0.34, 0.84), (-0.34, 0.84)))
        yield Area(corners, TYRE)
    yield Circle(centre, 0.66 * radius, BODY_LIGHT if robot.lamps.body else RING)
    yield Circle(centre, 0.5 * radius, BOARD if not robot.lamps.body else blend(BOARD, BODY_LIGHT, 0.35))
    yield Area((place(0.46, 0.0), place(-0.22, 0.28), place(-0.1, 0.0), place(-0.22, -0.28)), NOSE)
    for angle, colour in zip(LED_ANGLES, robot.lamps.ring, strict=True):
        spot = place(0.86 * math.cos(math.radians(angle)), 0.86 * math.sin(math.radians(angle)))
        if any(colour):
            yield Circle(spot, 0.17 * radius, blend(colour, BODY, 0.35))
            yield Circle(spot, 0.1 * radius, blend(colour, NOSE, 0.25))
        else:
            yield Circle(spot, 0.055 * radius, UNLIT)
    if robot.lamps.front:
        yield Circle(place(0.93, -0.34), 0.1 * radius, FRONT_LIGHT)
