"""The picture of a machine can be read: an arrow keeps away from the states that it passes."""

from __future__ import annotations

import random
import re
from xml.etree import ElementTree

from elib.tools.states.drawing import SAMPLES, draw, layout
from elib.tools.states.text import MachineText

SVG = "{http://www.w3.org/2000/svg}"
ROUND_TRIP = [("drive", "back_up"), ("back_up", "turn"), ("turn", "drive")]


def machine(arrows: list[tuple[str, str]]) -> MachineText:
    names = list(dict.fromkeys(name for pair in arrows for name in pair))
    lines = ["import elib"]
    for name in names:
        lines.append(f"def {name}(robot, run):")
        ways = [other for one, other in arrows if one == name]
        for number, other in enumerate(ways):
            lines += [f"    if run.time_in_state > {number}:", f"        return '{other}'"]
        lines += ["    pass"]
    return MachineText("\n".join([*lines, f"elib.states({', '.join(names)})"]))


def places(path: str) -> list[tuple[float, float]]:
    """Return points of the curve of an arrow."""
    x0, y0, x1, y1, x2, y2 = map(float, re.findall(r"-?[\d.]+", path))
    shares = [place / SAMPLES for place in range(SAMPLES + 1)]
    return [
        ((1 - t) ** 2 * x0 + 2 * t * (1 - t) * x1 + t * t * x2, (1 - t) ** 2 * y0 + 2 * t * (1 - t) * y1 + t * t * y2)
        for t in shares
    ]


def run_through(program: MachineText) -> list[tuple[str, str, str]]:
    """Return the arrows that run through a state which they neither leave nor lead to, and that state."""
    root, boxes = ElementTree.fromstring(draw(program)), layout(program)
    x, y, width, height = map(float, root.attrib["viewBox"].split())
    found = []
    for arrow in root.iter(f"{SVG}g"):
        if "data-arrow" in arrow.attrib:
            ends = (arrow.attrib["data-source"], arrow.attrib["data-target"])
            points = places(arrow.findall(f"{SVG}path")[0].attrib["d"])
            assert all(x <= at[0] <= x + width and y <= at[1] <= y + height for at in points), "out of the picture"
            others = [(name, box) for name, box in boxes.items() if name not in ends]
            met = [name for name, box in others if any(box.meets(each) for each in points)]
            found += [(*ends, name) for name in met]
    return found


def test_the_way_back_of_three_states_does_not_run_through_the_second() -> None:
    assert run_through(machine(ROUND_TRIP)) == []


def test_no_arrow_of_drawn_machines_runs_through_a_state() -> None:
    draw = random.Random(1)
    for _ in range(200):
        names = [f"state_{number}" for number in range(draw.randint(2, 6))]
        pairs = dict.fromkeys((draw.choice(names), draw.choice(names)) for _ in range(draw.randint(2, 9)))
        assert run_through(machine(list(pairs))) == []
