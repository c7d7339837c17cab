"""The page of maps, and of a robot's place on one."""

from __future__ import annotations

import elib
from elib.behaviours.find_place import find_place
from elib.maps.localiser import Estimate
from generator.markdown import docstring, joined
from generator.simulator import own

INTRODUCTION = """# Maps and places

What `elib.Grid` and `elib.Localiser` have for programs. [Maps, places and ways](../guides/maps.md) shows how to use
them, and says how well they work. `robot.go_to(x, y, map=grid)` is a [command](commands.md), `explore` and `bug` are
[behaviours](../guides/behaviours.md).
"""
FOUND = f"## elib.behaviours.find_place.find_place(robot, map, limit=120.0)\n\n{docstring(find_place.__doc__)}"


def page() -> str:
    """Return the page."""
    return joined([INTRODUCTION, own(elib.Grid), own(elib.Localiser), own(Estimate, "elib.maps.localiser"), FOUND])
