"""The world drawn from above as SVG and PNG, from immutable snapshots only."""

from elib.simulator.drawing.drawing import draw
from elib.simulator.drawing.svg import draw_svg

__all__ = ["draw", "draw_svg"]
