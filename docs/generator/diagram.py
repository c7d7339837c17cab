"""The drawing of the page about the architecture: the parts of elib, and which one talks to which."""

from __future__ import annotations

from typing import NamedTuple

from .drawings import AXIS, INK, PAPER, QUIET, SOUND, Picture, Point

HEIGHT = 46.0
"""Pixels of a box."""


class Box(NamedTuple):
    """A part: the middle of its box, the width, its name and what it does."""

    x: float
    y: float
    width: float
    name: str
    words: str
    colour: str = AXIS

    def above(self) -> Point:
        """Return the middle of the upper edge."""
        return Point(self.x, self.y - HEIGHT / 2)

    def below(self) -> Point:
        """Return the middle of the lower edge."""
        return Point(self.x, self.y + HEIGHT / 2)


PROGRAM = Box(250, 45, 420, "your program", "a behaviour, elib run, the web page", INK)
ROBOT = Box(250, 125, 420, "robot", "API styles, motion, telemetry, reconnecting")
SESSION = Box(250, 205, 420, "session", "one queue, one writer, deadlines, resync")
PROTOCOL = Box(675, 205, 350, "protocol", "requests to bytes, bytes to values")
TRANSPORT = Box(250, 285, 420, "transport", "bytes by URL")
REAL = Box(145, 400, 210, "a real e-puck", "", INK)
FIRMWARE = Box(590, 400, 420, "emulator: firmware", "the other end of the line", SOUND)
HARDWARE = Box(590, 480, 420, "emulator: hardware", "counts and steps", SOUND)
PHYSICS = Box(590, 560, 420, "physics", "a world in two dimensions, in SI units", SOUND)

DOWN = ((PROGRAM, ROBOT), (ROBOT, SESSION), (SESSION, TRANSPORT), (FIRMWARE, HARDWARE), (HARDWARE, PHYSICS))
"""Boxes that stand below each other, with an arrow between them."""


def parts() -> str:
    """Return the picture of the parts."""
    picture = Picture(880, 605, "The parts of elib: from your program down to a real or a simulated robot")
    for box in (PROGRAM, ROBOT, SESSION, PROTOCOL, TRANSPORT, REAL, FIRMWARE, HARDWARE, PHYSICS):
        _draw(picture, box)
    for upper, lower in DOWN:
        picture.arrow([upper.below(), Point(upper.x, lower.above().y)], QUIET, 2)
    picture.line([Point(460, 205), Point(500, 205)], QUIET, 2)
    picture.arrow([Point(145, TRANSPORT.below().y), REAL.above()], QUIET, 2)
    picture.text(Point(155, 348), "serial, rfcomm, tcp, wifi", size=14, colour=QUIET)
    picture.arrow([Point(430, TRANSPORT.below().y), Point(430, FIRMWARE.above().y)], QUIET, 2)
    picture.text(Point(440, 348), "sim", size=14, colour=QUIET)
    return picture.svg()


def _draw(picture: Picture, box: Box) -> None:
    left, right = box.x - box.width / 2, box.x + box.width / 2
    top, bottom = box.above().y, box.below().y
    corners = [Point(left, top), Point(right, top), Point(right, bottom), Point(left, bottom)]
    picture.area(corners, PAPER)
    picture.line([*corners, corners[0]], box.colour, 2)
    words = Point(box.x, box.y + (5 if not box.words else -3))
    picture.text(words, box.name, colour=box.colour, anchor="middle", is_bold=True)
    if box.words:
        picture.text(Point(box.x, box.y + 16), box.words, size=14, anchor="middle")
