"""The page of ``elib.Grid`` and ``elib.Localiser``: a map, and a robot's place on it."""

from __future__ import annotations

import elib
from elib.maps.localiser import Estimate
from generator.markdown import joined
from generator.simulator import own

INTRODUCTION = """# Maps and places

What `elib.Grid` and `elib.Localiser` have for programs. [Maps, places and ways](../guides/maps.md) shows how to use
them, and says how well they work. `robot.go_to(x, y, map=grid)` is a [command](commands.md), `explore` and `bug` are
[behaviours](../guides/behaviours.md).
"""


def page() -> str:
    """Return the page."""
    return joined([INTRODUCTION, own(elib.Grid), own(elib.Localiser), own(Estimate, "elib.maps.localiser")])
