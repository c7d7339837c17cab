"""The picture of a lab for its instructions: the world of its first variant, and its zones."""

from __future__ import annotations

from elib.lab.labfile import Lab
from elib.simulator.drawing import draw_svg
from elib.simulator.physics import World

PICTURE = "world.svg"
"""In the folder of the lab; its README.md shows it."""

SIZE = 360
"""Pixels of the picture's longer side."""


def draw_lab(lab: Lab) -> str:
    """Return the picture as SVG."""
    variant = lab.variants[0]
    world = World.load(variant.world, robots=variant.robots, seed=variant.seed)
    zones = tuple(lab.zones_of(variant).values())
    return draw_svg(world.snapshot(), caption="", size=SIZE, zones=zones)
