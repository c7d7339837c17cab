"""The drawings of the page about the e-puck, as SVG, made from the numbers that the simulator uses.

They have a light background of their own, so that they are readable on a dark page too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from html import escape
from typing import NamedTuple

from elib.base.body import AXLE, LENS, SENSOR_DIRECTIONS, WHEEL_DIAMETER, camera_view
from elib.base.infrared import SPACING
from elib.link.protocol.values import Proximity
from elib.simulator.drawing.svg import document, element
from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.profiles import APERTURE, FULL_SCALE, PLACES, PROFILES
from elib.simulator.physics.sensors import brightness, distance
from generator.epuck import MICROPHONES, ON_THE_FLOOR

INK = "#24272c"
QUIET = "#6b7078"
PAPER = "#fcfcfa"
RIM = "#d9dbd6"
BODY = "#eceeea"
RUBBER = "#3c4046"
INFRARED = "#b3261e"
AXIS = "#1f5fbf"
RED = "#c0392b"
COLOURED = "#7b3fa0"
SOUND = "#2e7d4f"
FLOOR = "#9a6a00"
FRONT = "#b86400"
CURVES = ("#1a1a1a", "#1f5fbf", "#b3261e", "#2e7d4f")

SCALE = 4200.0
"""Pixels a metre of the two drawings of the robot."""

TYRE = 0.005
"""Width of a wheel in the drawing, m."""

OUTSIDE = 1.13
"""How much further out than they are the infrared sensors stand in the overview: at their places stand the LEDs."""

VIEW = camera_view(40, 8) / 2
"""Half of the angle that the camera sees at 40 x 40 and zoom 8, rad."""


class Point(NamedTuple):
    """A place in a drawing, pixels from its upper left corner."""

    x: float
    y: float


def _number(value: float) -> str:
    """Return one decimal, without a sign for zero: the same text on every machine."""
    text = f"{value:.1f}"
    return "0.0" if text == "-0.0" else text


class Picture:
    """An SVG document that grows element by element.

    Args:
        width: Pixels.
        height: Pixels.
        title: What the picture shows, for those who cannot see it.
    """

    def __init__(self, width: int, height: int, title: str) -> None:
        self.width, self.height = width, height
        frame = element("rect", x=1, y=1, width=width - 2, height=height - 2, rx=10, fill=PAPER, stroke=RIM)
        self._elements = [element("title", escape(title)), frame]

    def _add(self, name: str, content: str | None = None, **attributes: object) -> None:
        self._elements.append(element(name, content, **attributes))

    def text(
        self,
        place: Point,
        words: str,
        *,
        size: int = 15,
        colour: str = INK,
        anchor: str = "start",
        is_code: bool = False,
        is_bold: bool = False,
    ) -> None:
        """Write one line; *anchor* is the part of it that stands at *place*: start, middle or end."""
        family, weight = "Menlo, Consolas, monospace" if is_code else None, "bold" if is_bold else None
        look = {"fill": colour, "text_anchor": anchor, "font_family": family, "font_weight": weight}
        self._add("text", escape(words), x=_number(place.x), y=_number(place.y), font_size=size, **look)

    def line(self, points: Sequence[Point], colour: str, width: float = 1.5, *, is_dashed: bool = False) -> None:
        """Draw a line through *points*."""
        look = {"stroke": colour, "stroke_width": width, "stroke_dasharray": "5 5" if is_dashed else None}
        self._add("polyline", points=_path(points), fill="none", **look)

    def area(self, points: Sequence[Point], fill: str, *, opacity: float = 1.0) -> None:
        """Fill a polygon."""
        self._add("polygon", points=_path(points), fill=fill, fill_opacity=opacity)

    def disc(self, centre: Point, radius: float, fill: str, outline: str = "none", width: float = 1.5) -> None:
        """Draw a circle."""
        place = {"cx": _number(centre.x), "cy": _number(centre.y), "r": _number(radius)}
        self._add("circle", **place, fill=fill, stroke=outline, stroke_width=width)

    def arrow(self, points: Sequence[Point], colour: str, width: float = 3.0) -> None:
        """Draw a line with a head at its end."""
        (x1, y1), tip = points[-2:]
        turn = math.atan2(tip.y - y1, tip.x - x1)
        head = [Point(tip.x - 13 * math.cos(turn + a), tip.y - 13 * math.sin(turn + a)) for a in (-0.42, 0.42)]
        self.line([*points[:-1], Point((head[0].x + head[1].x) / 2, (head[0].y + head[1].y) / 2)], colour, width)
        self.area([tip, *head], colour)

    def svg(self) -> str:
        """Return the document."""
        family = "Helvetica, Arial, sans-serif"
        return document(self.width, self.height, self._elements, role="img", font_family=family)


def _path(points: Sequence[Point]) -> str:
    return " ".join(f"{_number(point.x)},{_number(point.y)}" for point in points)


class Robot:
    """The body seen from above, its front upwards.

    Args:
        picture: What it is drawn on.
        centre: Where the middle of its axle is.
    """

    def __init__(self, picture: Picture, centre: Point) -> None:
        self.picture = picture
        self.centre = centre
        picture.disc(centre, RADIUS * SCALE, BODY, QUIET, 2)
        for side in (-1, 1):
            tyre = [
                self.at(ahead * WHEEL_DIAMETER / 2, side * AXLE / 2 + across * TYRE / 2)
                for ahead, across in ((1, 1), (1, -1), (-1, -1), (-1, 1))
            ]
            picture.area(tyre, RUBBER)

    def at(self, ahead: float, left: float) -> Point:
        """Return where a place in the robot's frame is, m ahead of its middle and to its left."""
        return Point(self.centre.x - left * SCALE, self.centre.y - ahead * SCALE)

    def around(self, angle: float, radius: float) -> Point:
        """Return where a bearing, rad, positive to the left, meets a circle around the middle, m."""
        return self.at(radius * math.cos(angle), radius * math.sin(angle))


def infrared() -> str:
    """Return the picture of the infrared sensors, with their names and the axes."""
    picture = Picture(820, 560, "The e-puck from above: eight infrared sensors, their names and directions, the axes")
    robot = Robot(picture, Point(410, 305))
    _eyes(picture, robot, 11, reach=66, is_numbered=True)
    _axes(picture, robot)
    picture.text(Point(410, 34), "front", colour=QUIET, anchor="middle")
    return picture.svg()


def _eyes(
    picture: Picture, robot: Robot, radius: float, *, reach: float, outside: float = 1.0, is_numbered: bool = False
) -> None:
    """Draw the infrared sensors with their beams and names; *outside* is how much further out they stand."""
    names = [field.name for field in fields(Proximity) if not field.kw_only]
    for number, (name, (x, y), angle) in enumerate(zip(names, PLACES, SENSOR_DIRECTIONS, strict=True)):
        place = outside * x, outside * y
        eye = robot.at(*place)
        ends = [angle + share * math.radians(APERTURE) for share in (-1.0, -0.5, 0.0, 0.5, 1.0)]
        beam = [eye, *(Point(eye.x - reach * math.sin(end), eye.y - reach * math.cos(end)) for end in ends)]
        picture.area(beam, INFRARED, opacity=0.18)
        picture.disc(eye, radius, INFRARED)
        if is_numbered:
            _numbered(picture, eye, number)
        _sensor_label(picture, robot, name, place, angle)


def _ring(picture: Picture, robot: Robot, radius: float, colours: tuple[str, str]) -> Point:
    """Draw the LEDs of the ring, those with even and odd numbers in their colours; return where the front LED is."""
    *ring, front = (robot.at(x / 1000, y / 1000) for x, y in brightness.LED_PLACES)
    for number, spot in enumerate(ring):
        picture.disc(spot, radius, colours[number % 2], PAPER)
        _numbered(picture, spot, number)
    return front


def _numbered(picture: Picture, spot: Point, number: int) -> None:
    picture.text(Point(spot.x, spot.y + 5), str(number), colour="#ffffff", anchor="middle", is_bold=True)


def _sensor_label(picture: Picture, robot: Robot, name: str, place: tuple[float, float], angle: float) -> None:
    degrees = math.degrees(angle)
    spot = robot.at(place[0] + 0.0205 * math.cos(angle), place[1] + 0.0205 * math.sin(angle))
    is_left = degrees > 0
    x = spot.x + (-8 if is_left else 8)
    anchor = "end" if is_left else "start"
    picture.text(Point(x, spot.y), name, colour=INFRARED, anchor=anchor, is_code=True, is_bold=True)
    picture.text(Point(x, spot.y + 18), f"{degrees:+.1f}°", colour=QUIET, size=14, anchor=anchor)


def _axes(picture: Picture, robot: Robot, ahead: float = 0.0215) -> None:
    picture.arrow([robot.centre, robot.at(0.0262, 0)], AXIS)
    picture.arrow([robot.centre, robot.at(0, 0.0212)], AXIS)
    picture.text(robot.at(ahead, -0.0022), "x forward", colour=AXIS, is_bold=True)
    picture.text(robot.at(-0.0052, 0.0213), "y left", colour=AXIS, is_bold=True)
    turn = [robot.around(math.radians(angle), 0.0118) for angle in range(8, 80, 4)]
    picture.arrow(turn, AXIS, 2)
    picture.text(robot.at(0.0118, 0.0222), "heading +", colour=AXIS, size=13)
    picture.disc(robot.centre, 4, AXIS)


def overview() -> str:
    """Return the picture for beginners: sensors with names, LEDs with numbers, wheels, camera, axes and signs."""
    picture = Picture(860, 700, "The e-puck from above: infrared sensors, LEDs, wheels, camera and axes")
    robot = Robot(picture, Point(430, 330))
    lens, reach = robot.at(LENS, 0), 0.042
    edges = [robot.at(LENS + reach, side * reach * math.tan(VIEW)) for side in (1, -1)]
    picture.area([lens, *edges], AXIS, opacity=0.13)
    picture.text(Point(430, 46), "what the camera sees", colour=AXIS, anchor="middle")
    _eyes(picture, robot, 7, reach=62, outside=OUTSIDE)
    front = _ring(picture, robot, 12, (RED, RED))
    picture.disc(front, 7, FRONT, PAPER)
    picture.text(Point(front.x, front.y + 24), "front LED", colour=FRONT, size=13, anchor="middle")
    picture.text(robot.at(-0.022, 0), "body LED: the whole body", colour=SOUND, size=13, anchor="middle")
    picture.text(robot.at(-0.014, 0.0225), "left wheel", size=13)
    picture.text(robot.at(-0.014, -0.0225), "right wheel", size=13, anchor="end")
    _axes(picture, robot, ahead=0.0135)
    for row, (colour, words) in enumerate(
        (
            (INFRARED, "infrared sensors: their names in robot.proximity(), their directions"),
            (RED, "lamps (LEDs), with the numbers for robot.set_led()"),
            (AXIS, "axes: x is forward, y to the left; angles are positive to the left"),
        )
    ):
        picture.disc(Point(70, 616 + 28 * row), 12 if colour == RED else 7, colour)
        picture.text(Point(92, 621 + 28 * row), words)
    _numbered(picture, Point(70, 644), 0)
    return picture.svg()


class Label(NamedTuple):
    """A label beside the robot, and the place that it names."""

    place: Point
    words: str
    colour: str


def sensors() -> str:
    """Return the picture of the wheels and of all sensors but the infrared ones and the camera."""
    picture = Picture(900, 420, "The e-puck from above: wheels, microphones, ground sensors, distance sensor")
    robot = Robot(picture, Point(450, 215))
    left = [Label(robot.at(0, AXLE / 2), "left wheel", RUBBER)]
    right = [Label(robot.at(0, -AXLE / 2), "right wheel", RUBBER)]
    for words, x, y in ON_THE_FLOOR:
        spot = robot.at(x, y)
        picture.area([Point(spot.x + u, spot.y + v) for u, v in ((-6, -6), (6, -6), (6, 6), (-6, 6))], FLOOR)
        if y == 0.0:  # A line to the side would cross the others.
            picture.text(Point(spot.x, spot.y + 24), words, colour=FLOOR, anchor="middle")
        else:
            (left if y > 0.0 else right).append(Label(spot, words, FLOOR))
    for words, x, y in MICROPHONES:
        spot = robot.at(x, y)
        picture.disc(spot, 8, SOUND, PAPER)
        (left if y > 0 or words.endswith("rear") else right).append(Label(spot, words, SOUND))
    eye = robot.at(*distance.PLACE)
    picture.area([Point(eye.x + u, eye.y + v) for u, v in ((0, -9), (9, 7), (-9, 7))], AXIS)
    right.append(Label(eye, "distance sensor (e-puck2)", AXIS))
    _column(picture, left, 238, is_left=True)
    _column(picture, right, 662, is_left=False)
    return picture.svg()


def _column(picture: Picture, labels: Sequence[Label], x: float, *, is_left: bool) -> None:
    """Write labels below each other, each with a line to its place; neither words nor lines cross."""
    outward = 1 if is_left else -1
    ordered = sorted(labels, key=lambda label: (round(label.place.y), outward * label.place.x))
    y = 66.0
    for label in ordered:
        picture.line([Point(x + 6 * outward, y - 5), label.place], label.colour, 1)
        picture.text(Point(x, y), label.words, colour=label.colour, anchor="end" if is_left else "start")
        y += 48


def leds() -> str:
    """Return the picture of the LEDs and of what the camera sees."""
    picture = Picture(820, 560, "The e-puck from above: its LEDs with their numbers, and what the camera sees")
    robot = Robot(picture, Point(410, 310))
    _view(picture, robot)
    front = _ring(picture, robot, 13, (RED, COLOURED))
    picture.disc(front, 9, FRONT, PAPER)
    picture.line([Point(front.x + 9, front.y - 4), Point(front.x + 92, front.y - 40)], FRONT, 1)
    picture.text(Point(front.x + 98, front.y - 40), "front LED", colour=FRONT)
    picture.text(robot.at(-0.001, 0), "body LED", colour=SOUND, anchor="middle", is_bold=True)
    picture.text(robot.at(-0.0055, 0), "lights the whole body", colour=SOUND, size=13, anchor="middle")
    picture.disc(Point(96, 527), 10, RED)
    picture.text(Point(114, 532), "ring LED 0, 2, 4, 6: red", size=14)
    picture.disc(Point(312, 527), 10, COLOURED)
    picture.text(Point(330, 532), "ring LED 1, 3, 5, 7: red; on the e-puck2 in all colours", size=14)
    return picture.svg()


def _view(picture: Picture, robot: Robot) -> None:
    lens = robot.at(LENS, 0)
    edges = [robot.at(LENS + 0.033, 0.033 * math.tan(turn)) for turn in (VIEW, -VIEW)]
    picture.area([lens, *edges], AXIS, opacity=0.13)
    for edge in edges:
        picture.line([lens, edge], AXIS, 1, is_dashed=True)
    picture.disc(lens, 6, AXIS)
    words = f"camera: {math.degrees(2 * VIEW):.0f}° at 40 x 40, zoom 8"
    picture.text(Point(robot.centre.x, 30), words, colour=AXIS, anchor="middle")


def responses() -> str:
    """Return the picture of the published response curves of an infrared sensor."""
    left, right, top, bottom, reach = 78.0, 700.0, 40.0, 340.0, 0.07
    picture = Picture(
        740, 410, "Counts of a proximity sensor over the distance to a white wall: measured, and three published curves"
    )

    def at(metres: float, counts: float) -> Point:
        return Point(left + (right - left) * metres / reach, bottom - (bottom - top) * counts / FULL_SCALE)

    for counts in range(0, 4001, 1000):
        picture.line([at(0, counts), at(reach, counts)], RIM, 1)
        picture.text(Point(left - 10, at(0, counts).y + 5), str(counts), size=14, colour=QUIET, anchor="end")
    for centimetres in range(8):
        spot = at(centimetres / 100, 0)
        picture.line([spot, Point(spot.x, spot.y + 6)], QUIET, 1)
        picture.text(Point(spot.x, spot.y + 24), str(centimetres), size=14, colour=QUIET, anchor="middle")
    picture.text(Point((left + right) / 2, bottom + 50), "distance to a white wall, cm", anchor="middle")
    picture.text(Point(left - 10, 24), "counts", colour=INK)
    for place, (profile, colour) in enumerate(zip(PROFILES.values(), CURVES, strict=True)):
        curve = [at(k * SPACING, counts) for k, counts in enumerate(profile.counts) if k * SPACING <= reach + 1e-9]
        picture.line(curve, colour, 2.5)
        y = top + 30 + 28 * place
        picture.line([Point(500, y - 5), Point(540, y - 5)], colour, 2.5)
        picture.text(Point(552, y), profile.name, colour=colour, is_code=True, is_bold=True)
    return picture.svg()
