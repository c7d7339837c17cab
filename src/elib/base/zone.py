"""A part of the floor with a name: a goal of a lab is about it, and drawings show it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Zone:
    """A part of the floor with a name.

    Attributes:
        name: Its name.
        x: Its middle, m.
        y: Its middle, m.
        radius: Of a circle, m; 0 for a rectangle.
        width: Of a rectangle, along x, m.
        depth: Of a rectangle, along y, m.
    """

    name: str
    x: float
    y: float
    radius: float = 0.0
    width: float = 0.0
    depth: float = 0.0
