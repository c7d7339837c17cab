"""The world drawn from above as SVG and PNG, from immutable snapshots only."""

from elib.view.drawing import draw
from elib.view.png import draw_png
from elib.view.svg import draw_svg

__all__ = ["draw", "draw_png", "draw_svg"]
