"""The panel's colours can be read: text has 4.5 to 1 against what it stands on, controls 3 to 1 (WCAG 2.2, AA)."""

from __future__ import annotations

import re
from dataclasses import astuple
from pathlib import Path

import pytest

from elib.panel.server.pictures import DARK, LIGHT
from elib.simulator.drawing.top import Tones

TOKENS = (Path(__file__).parents[2] / "page" / "src" / "look" / "tokens.css").read_text(encoding="utf-8")
TEXT = [("ink", "page"), ("ink", "card"), ("faint", "page"), ("faint", "card"), ("accent", "card"), ("bad", "card")]
TEXT += [("good", "card"), ("warn", "card"), ("on-accent", "accent"), ("bad", "bad-tint"), ("accent", "tint")]
TEXT += [("on-stop", "stop")]
CONTROLS = [("control", "card"), ("control", "page"), ("accent", "page"), ("wall", "floor"), ("stop", "card")]
SCHEMES = ["light", "dark"]


def colours_of(scheme: str) -> dict[str, tuple[int, int, int]]:
    """Return the colours of a scheme by name."""
    both = re.findall(r"--([\w-]+): light-dark\(#([0-9a-f]{6}), #([0-9a-f]{6})\);", TOKENS)
    both += [(name, value, value) for name, value in re.findall(r"--([\w-]+): #([0-9a-f]{6});", TOKENS)]
    which = SCHEMES.index(scheme)
    return {name: tuple(bytes.fromhex(pair[which])) for name, *pair in both}  # type: ignore[misc]


def luminance(colour: tuple[int, int, int]) -> float:
    """Return the relative luminance of a colour (WCAG 2.2)."""
    linear = [(c / 255 / 12.92) if c / 255 <= 0.04045 else ((c / 255 + 0.055) / 1.055) ** 2.4 for c in colour]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: tuple[int, int, int], other: tuple[int, int, int]) -> float:
    """Return the contrast of two colours, 1 to 21."""
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_text_can_be_read_and_controls_can_be_seen(scheme: str) -> None:
    colours = colours_of(scheme)
    for least, pairs in ((4.5, TEXT), (3, CONTROLS)):
        for ink, ground in pairs:
            assert contrast(colours[ink], colours[ground]) >= least, (ink, ground)


def test_black_on_white_has_the_greatest_contrast() -> None:
    assert contrast((0, 0, 0), (255, 255, 255)) == pytest.approx(21)


@pytest.mark.parametrize(("scheme", "tones"), [("light", LIGHT), ("dark", DARK)])
def test_the_pictures_of_the_worlds_have_the_colours_of_the_worlds_on_the_page(scheme: str, tones: Tones) -> None:
    colours = colours_of(scheme)
    for name, colour in zip(("room", "floor", "grid", "wall"), astuple(tones), strict=True):
        assert colour == colours[name], name
