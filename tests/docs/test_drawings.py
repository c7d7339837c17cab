"""The drawings of the page about the e-puck are readable and show what the code calls things."""

import dataclasses
import xml.etree.ElementTree as ElementTree
from itertools import combinations
from pathlib import Path

import pytest
from pages import ROOT

from elib.link.protocol.values import Proximity

DRAWINGS = sorted((ROOT / "docs/images").glob("e-puck-*.svg"))
SVG = "{http://www.w3.org/2000/svg}"


def texts(path: Path) -> list[ElementTree.Element]:
    return list(ElementTree.parse(path).getroot().iter(f"{SVG}text"))


def box(text: ElementTree.Element) -> tuple[float, float, float, float]:
    """Return about the left, upper, right and lower edge of a text: letters are at most 0.6 of their size wide."""
    x, y, size = (float(text.attrib[name]) for name in ("x", "y", "font-size"))
    width = 0.6 * size * len(text.text or "")
    left = x - {"start": 0.0, "middle": 0.5, "end": 1.0}[text.attrib["text-anchor"]] * width
    return left, y - 0.8 * size, left + width, y + 0.2 * size


def test_there_are_five_drawings_of_the_robot() -> None:
    names = ["e-puck-infrared", "e-puck-leds", "e-puck-overview", "e-puck-response", "e-puck-sensors"]
    assert [path.stem for path in DRAWINGS] == names


def test_no_text_leaves_its_drawing_or_covers_another() -> None:
    for path in DRAWINGS:
        size = ElementTree.parse(path).getroot().attrib
        boxes = {text.text: box(text) for text in texts(path)}
        for words, (left, top, right, bottom) in boxes.items():
            assert min(left, top) >= 0, (path.stem, words)
            assert right <= float(size["width"]), (path.stem, words)
            assert bottom <= float(size["height"]), (path.stem, words)
        for (one, a), (other, b) in combinations(boxes.items(), 2):
            is_apart = a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
            assert is_apart, f"{path.stem}: {one!r} covers {other!r}"


@pytest.mark.parametrize("name", ["infrared", "overview"])
def test_the_infrared_sensors_have_the_names_of_the_reading(name: str) -> None:
    shown = {text.text for text in texts(ROOT / f"docs/images/e-puck-{name}.svg")}
    assert {field.name for field in dataclasses.fields(Proximity) if not field.kw_only} <= shown


@pytest.mark.parametrize("name", ["infrared", "overview"])
def test_the_sensors_on_the_left_stand_on_the_left(name: str) -> None:
    path = ROOT / f"docs/images/e-puck-{name}.svg"
    middle = float(ElementTree.parse(path).getroot().attrib["width"]) / 2
    names = {text.text: float(text.attrib["x"]) for text in texts(path) if "_" in (text.text or "").split()[0]}
    assert all((x < middle) == name.endswith("left") for name, x in names.items() if name)
    assert len(names) == 6
