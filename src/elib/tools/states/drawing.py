"""A state machine as a picture: the same for the page, the command line and reports."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Mapping
from html import escape
from typing import NamedTuple

from elib.base.errors import ArgumentError
from elib.behaviours._run.states import END
from elib.simulator.drawing.shapes import Point
from elib.simulator.drawing.svg import document, element
from elib.tools.states.text import Arrow, MachineText

Places = Mapping[str, Point]
Curve = tuple[Point, Point, Point]
"""Where an arrow begins, what it bends towards, and where it ends."""

GAP, ROW, LOWER, MARGIN = 190, 130, 40, 44
"""Distance of two columns and of two states in one, how much lower each second column is, and what is left around all,
pixels."""
HEIGHT, LETTER, ROUND = 46, 7.6, 14
"""Height of a state, mean width of a letter of its name, and radius of the end, pixels."""
MAX_TEXT, MAX_PARTS = 100_000, 150
"""Characters of a stranger's program that is drawn, and its states and its arrows: that takes two seconds at most."""
INK = "#55606e"
"""Colour of arrows and of the end."""
BEND, MORE = 34, 30
"""How far an arrow bends to its left, and each further one between the same states, pixels."""
LOOP = 16
"""Half the width of an arrow to its own state, pixels."""
NEAR = 8
"""What an arrow keeps away from the states that it passes, pixels."""
FARTHER, TRIES, SAMPLES = 30, 12, 24
"""How much farther an arrow bends that would run through another state, pixels, how often that is tried, and at how
many places of it that is seen."""
WIDEST, MOST_LINES = 22, 3
"""Letters of a line of a condition, and lines of it that are drawn; the whole stands in the title."""

PLACES = (0.5, 0.42, 0.58, 0.34, 0.66)
"""Shares of an arrow beside which its condition may stand, the best first."""
APART, COVERS = 4, 40
"""Between an arrow and its condition, pixels, and how bad it is to cover a place of an arrow, as so many pixels."""


class Rectangle(NamedTuple):
    """A state in the picture: its middle, and half its width and height, pixels."""

    x: float
    y: float
    width: float
    height: float

    def edge(self, towards: Point) -> Point:
        """Return where a line from its middle leaves it."""
        dx, dy = towards[0] - self.x, towards[1] - self.y
        share = min(
            self.width / abs(dx) if dx else math.inf,
            self.height / abs(dy) if dy else math.inf,
        )
        return (self.x + dx * share, self.y + dy * share) if math.isfinite(share) else (self.x, self.y)

    def shared(self, other: Rectangle) -> float:
        """Return the area that it shares with another."""
        wide = min(self.x + self.width, other.x + other.width) - max(self.x - self.width, other.x - other.width)
        high = min(self.y + self.height, other.y + other.height) - max(self.y - self.height, other.y - other.height)
        return max(0.0, wide) * max(0.0, high)

    def meets(self, place: Point, near: float = 0) -> bool:
        """Return whether a place is in it, or nearer than *near* to it."""
        return abs(place[0] - self.x) < self.width + near and abs(place[1] - self.y) < self.height + near


def layout(program: MachineText, places: Places | None = None) -> dict[str, Rectangle]:
    """Return the states of a program as boxes: in columns, each one arrow further from the start than the one before.

    Args:
        program: The program.
        places: Where a hand has put the middle of a state; the others are placed.
    """
    column = _columns(program)
    most = max(map(len, column))
    found, x = {}, MARGIN + 30.0
    for number, names in enumerate(column):
        widths = {name: max(54.0, LETTER * len(name) / 2 + 16) if name != END else ROUND for name in names}
        x += max(widths.values())
        # An odd column stands a little lower, so that an arrow past it does not run through its states.
        y = MARGIN + ROW * (most - len(names)) / 2 + HEIGHT / 2 + LOWER * (number % 2) * (len(column) > 2)
        for place, name in enumerate(names):
            height = ROUND if name == END else HEIGHT / 2
            found[name] = Rectangle(*(places or {}).get(name, (x, y + ROW * place)), widths[name], height)
        x += max(widths.values()) + GAP
    return found


def _columns(program: MachineText) -> list[list[str]]:
    """Return the states, and the end if an arrow leads to it, breadth first; what no arrow leads to stands below them.

    So a new state is seen at once where the picture is wider than its place.
    """
    found, seen = [[program.start]], {program.start}
    while True:
        ways = [(each.source, each.target) for each in program.arrows if each.target in (*program.states, END)]
        more = dict.fromkeys(target for name in found[-1] for source, target in ways if source == name)
        names = [name for name in more if name not in seen]
        if not names:
            for number, name in enumerate(name for name in program.states if name not in seen):
                found[number % len(found)].append(name)
            return found
        found.append(names)
        seen.update(names)


def draw(program: MachineText, places: Places | None = None) -> str:
    """Return the picture of a program's machine as an SVG document.

    The elements carry what they show as ``data-state`` and ``data-arrow``, and classes, so that a page can light them.
    *places* are as for :func:`layout`.
    """
    boxes = layout(program, places)
    tip = element("path", d="M0,0 L9,4 L0,8 Z", fill="context-stroke")
    marker = element(
        "marker", tip, id="tip", viewBox="0 0 9 8", refX=8, refY=4, markerWidth=9, markerHeight=8,
        orient="auto-start-reverse", markerUnits="userSpaceOnUse",
    )  # fmt: skip
    seen: dict[tuple[str, str], int] = {}
    curves: dict[int, Curve] = {}
    for number, arrow in enumerate(program.arrows):
        if arrow.target in boxes:
            pair = (arrow.source, arrow.target)
            seen[pair] = seen.get(pair, -1) + 1
            curves[number] = _curve(arrow, boxes, seen[pair])
    taken = [*boxes.values()]
    ways = [_at(curve, place / SAMPLES) for curve in curves.values() for place in range(SAMPLES + 1)]
    arrows = [_arrow(number, program.arrows[number], curve, taken, ways) for number, curve in curves.items()]
    corners = [(box.x + side * box.width, box.y + side * box.height) for box in taken for side in (-1, 1)]
    width = max(x for x, _ in (*corners, *ways)) + MARGIN
    top = min(0.0, min(y for _, y in (*corners, *ways)) - MARGIN / 2)
    height = max(y for _, y in (*corners, *ways)) + MARGIN - top
    begin = boxes[program.start]
    start = element("path", d=f"M{begin.x - begin.width - 30:.1f},{begin.y:.1f} h24", **_line(), class_="start")
    dot = element("circle", cx=f"{begin.x - begin.width - 34:.1f}", cy=f"{begin.y:.1f}", r=5, fill=INK)
    states = [_state(program, name, box) for name, box in boxes.items()]
    parts = [element("defs", marker), *arrows, dot, start, *states]
    return document(round(width), round(height), parts, font_family="sans-serif", top=round(top))


def picture_of(text: str) -> str:
    """Return the picture of a program that may be anything; empty without states, or with too many for a picture."""
    try:
        program = MachineText(text[: MAX_TEXT + 1])
        parts = max(len(program.states), len(program.arrows))
        return draw(program) if len(text) <= MAX_TEXT and parts <= MAX_PARTS else ""
    except ArgumentError:
        return ""


def _line() -> dict[str, object]:
    return {"fill": "none", "stroke": INK, "stroke_width": 1.6, "marker_end": "url(#tip)"}


def _state(program: MachineText, name: str, box: Rectangle) -> str:
    about = {"data_state": name, "class_": "state", "tabindex": 0, "role": "button"}
    if name == END:
        rings = [(ROUND, "none"), (8, INK)]
        circles = [
            element("circle", cx=f"{box.x:.1f}", cy=f"{box.y:.1f}", r=r, fill=fill, stroke=INK, stroke_width=1.6)
            for r, fill in rings
        ]
        return element("g", "".join([element("title", "the end"), *circles]), **about, aria_label="the end")
    state = program.states[name]
    rect = element(
        "rect", x=f"{box.x - box.width:.1f}", y=f"{box.y - box.height:.1f}", width=f"{2 * box.width:.1f}",
        height=f"{2 * box.height:.1f}", rx=12, fill="#eef3fb", stroke="#3b6fd0",
        stroke_width=1.6 if state.node is not None else 4,
    )  # fmt: skip
    text = element(
        "text", escape(name), x=f"{box.x:.1f}", y=f"{box.y + 5:.1f}", text_anchor="middle", font_size=14,
        font_weight=600, fill="#1c2430",
    )  # fmt: skip
    return element("g", rect + text, **about, aria_label=f"state {name}")


def _curve(arrow: Arrow, boxes: Mapping[str, Rectangle], nth: int) -> Curve:
    """Return the way of an arrow, the *nth* between its states: past others, if it does not have to bend too far."""
    one, other = boxes[arrow.source], boxes[arrow.target]
    if arrow.source == arrow.target:
        x, y = one.x, one.y - one.height
        return (x - LOOP, y), (x, y - 4 * LOOP - MORE * nth), (x + LOOP, y)
    dx, dy = other.x - one.x, other.y - one.y
    length = math.hypot(dx, dy) or 1.0
    bend = BEND + MORE * nth + 0.12 * max(0.0, length - 2 * GAP)

    def bent(by: float) -> Curve:
        control = ((one.x + other.x) / 2 + dy / length * by, (one.y + other.y) / 2 - dx / length * by)
        return one.edge(control), control, other.edge(control)

    others = [box for name, box in boxes.items() if name not in (arrow.source, arrow.target)]
    tried = [bent(bend + FARTHER * more) for more in range(TRIES)]
    for curve in tried:
        if not any(box.meets(_at(curve, place / SAMPLES), NEAR) for place in range(SAMPLES + 1) for box in others):
            return curve
    return tried[0]


def _at(curve: Curve, share: float) -> Point:
    """Return the place at a share of a curve."""
    (x0, y0), (x1, y1), (x2, y2) = curve
    a, b, c = (1 - share) ** 2, 2 * share * (1 - share), share**2
    return a * x0 + b * x1 + c * x2, a * y0 + b * y1 + c * y2


def _arrow(number: int, arrow: Arrow, curve: Curve, taken: list[Rectangle], ways: list[Point]) -> str:
    (x0, y0), (x1, y1), (x2, y2) = curve
    path = f"M{x0:.1f},{y0:.1f} Q{x1:.1f},{y1:.1f} {x2:.1f},{y2:.1f}"
    about = {"data_arrow": number, "data_source": arrow.source, "data_target": arrow.target, "class_": "arrow"}
    said = escape(f"{arrow.source} to {arrow.target}: {arrow.words}")
    wide = element("path", d=path, fill="none", stroke="#000000", stroke_opacity=0, stroke_width=16)
    parts = (element("title", said), wide, element("path", d=path, **_line()), _label(arrow.words, curve, taken, ways))
    return element("g", "".join(parts), **about, tabindex=0, role="button", aria_label=f"arrow from {said}")


def _label(words: str, curve: Curve, taken: list[Rectangle], ways: list[Point]) -> str:
    """Draw the condition beside its arrow, best outside the bend, where it covers least of *taken* and of all arrows.

    Its own box is added to *taken*.
    """
    words = re.sub(r"(?<=\d) (?=\w)", "\N{NO-BREAK SPACE}", words)  # a number and its unit stand on one line
    lines = textwrap.wrap(words, WIDEST, max_lines=MOST_LINES, placeholder=" …")
    width, height = max(map(len, lines)) * 3.1 + 3, 7.5 * len(lines)
    (x0, y0), control, (x2, y2) = curve
    out = math.atan2(control[1] - (y0 + y2) / 2, control[0] - (x0 + x2) / 2)
    apart = abs(math.cos(out)) * width + abs(math.sin(out)) * height + APART

    def covered(box: Rectangle) -> float:
        return sum(map(box.shared, taken)) + COVERS * sum(box.meets(way) for way in ways) + 1e6 * (box.x < box.width)

    could = [
        Rectangle(x + side * math.cos(out) * apart, y + side * math.sin(out) * apart, width, height)
        for side in (1, -1)
        for x, y in (_at(curve, share) for share in PLACES)
    ]
    found = min(could, key=covered)
    taken.append(found)
    top = found.y - height + 11.5
    spans = (
        element("tspan", escape(each), x=f"{found.x:.1f}", y=f"{top + 15 * i:.1f}") for i, each in enumerate(lines)
    )
    behind = element(
        "rect", x=f"{found.x - width:.1f}", y=f"{found.y - height:.1f}", width=f"{2 * width:.1f}",
        height=f"{2 * height:.1f}", rx=4, fill="#ffffff", fill_opacity=0.85,
    )  # fmt: skip
    return behind + element("text", "".join(spans), text_anchor="middle", font_size=12, fill="#39424e")
