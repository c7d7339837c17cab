"""The panel's colours can be read: text has 4.5 to 1 against what it stands on, controls 3 to 1 (WCAG 2.2, AA)."""

from __future__ import annotations

import re
from dataclasses import astuple
from importlib.resources import files
from pathlib import Path

import pytest

from elib.panel.server.pictures import DARK, LIGHT
from elib.simulator.physics import Colour
from elib.simulator.physics.floor import packed

STYLE = files("elib.panel").joinpath("static", "base.css").read_text(encoding="utf-8")
TEXT = [("ink", "page"), ("ink", "card"), ("faint", "page"), ("faint", "card"), ("accent", "card"), ("bad", "card")]
TEXT += [("good", "card"), ("warn", "card"), ("on-accent", "accent")]
CONTROLS = [("control", "card"), ("control", "page"), ("accent", "page"), ("edge", "card"), ("stop", "card")]


def theme(selector: str) -> dict[str, tuple[int, int, int]]:
    """Return the colours of a theme by name."""
    block = STYLE.partition(selector)[2].partition("}")[0]
    return {
        name: tuple(int(value[place : place + 2], 16) for place in (0, 2, 4))  # type: ignore[misc]
        for name, value in re.findall(r"--([\w-]+): #([0-9a-f]{6});", block)
    }


def luminance(colour: tuple[int, int, int]) -> float:
    """Return the relative luminance of a colour (WCAG 2.2)."""
    linear = [(c / 255 / 12.92) if c / 255 <= 0.04045 else ((c / 255 + 0.055) / 1.055) ** 2.4 for c in colour]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: tuple[int, int, int], other: tuple[int, int, int]) -> float:
    """Return the contrast of two colours, 1 to 21."""
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


THEMES = {"light": theme(":root"), "dark": theme(':root[data-theme="dark"]')}


@pytest.mark.parametrize("name", THEMES)
def test_text_can_be_read_and_controls_can_be_seen(name: str) -> None:
    colours = THEMES[name]
    for least, pairs in ((4.5, TEXT), (3, CONTROLS)):
        for ink, ground in pairs:
            assert contrast(colours[ink], colours[ground]) >= least, (ink, ground)
    assert contrast((255, 255, 255), colours["stop"]) >= 4.5, "the word on the stop button"


def test_black_on_white_has_the_greatest_contrast() -> None:
    assert contrast((0, 0, 0), (255, 255, 255)) == pytest.approx(21)


@pytest.mark.parametrize("is_dark", [False, True])
def test_the_pictures_of_the_worlds_have_the_colours_of_the_worlds_on_the_page(is_dark: bool) -> None:
    tokens = (Path(__file__).parents[2] / "page" / "src" / "look" / "tokens.css").read_text(encoding="utf-8")
    for name, colour in zip(("room", "floor", "grid", "wall"), astuple(DARK if is_dark else LIGHT), strict=True):
        pair = re.search(rf"--{name}: light-dark\(#(\w+), #(\w+)\)", tokens)
        assert pair is not None
        assert f"{packed(Colour(*colour)):06x}" == pair[1 + is_dark], name
