"""A part of the floor with a name: a goal of a lab is about it, and drawings show it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Zone:
    """A part of the floor with a name."""

    name: str
    x: float  # its middle, m
    y: float  # its middle, m
    radius: float = 0.0  # of a circle, m; 0 for a rectangle
    width: float = 0.0  # of a rectangle, along x, m
    depth: float = 0.0  # of a rectangle, along y, m
