"""The world drawn from above: SVG and PNG, from immutable snapshots only."""

from elib.view.png import draw_png
from elib.view.svg import draw_svg

__all__ = ["draw_png", "draw_svg"]
