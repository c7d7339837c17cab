"""An agent without a model finds the red box, wherever it is, by the tools of ``elib agent`` alone."""

import importlib.util
import math
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("mcp")

from mcp_types import CallToolRequestParams
from red_box_worlds import RED, gap, random_placement, written_placement
from test_agent import door_of, speeds, tools_on, world_of

from elib.doors.agent.limits import Limits
from elib.testing import simulated
from lanes import short
from shared import PATIENCE

SCRIPT = Path(__file__).parents[2] / "examples" / "agent" / "find_the_red_box.py"
LIMITS = Limits(fence=2.0, speed=0.1, calls=500, seconds=600.0)
RADIUS = 0.037
"""m, of an e-puck."""
NEAR = 0.04
"""m between the robot and the box, as in the lab "Find the red box"."""


def program():
    """Import the example without running it."""
    spec = importlib.util.spec_from_file_location("find_the_red_box", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("seed", short([5, 15, 17], 15))
@simulated
async def test_it_finds_the_red_box_wherever_it_is(seed, tmp_path):
    path = tmp_path / "placement.toml"
    path.write_text(written_placement(seed))
    async with tools_on(f"sim://{path}", LIMITS) as tools:
        door, world = door_of(tools), world_of(tools)

        def call_tool(name, arguments):
            return door._call(SimpleNamespace(request=None), CallToolRequestParams(name=name, arguments=arguments))

        assert await program().Agent(SimpleNamespace(call_tool=call_tool)).find_red_box()
        assert speeds(tools) == (0, 0)
        there, boxes = world.pose(0), {box.name: box for box in world.snapshot().boxes}
        for before in random_placement(seed).boxes:
            assert math.dist((boxes[before.name].x, boxes[before.name].y), (before.x, before.y)) < 0.01, "it was pushed"
        box = next(each for each in random_placement(seed).boxes if each.name == RED)
        assert gap(box, there.x, there.y) - RADIUS < NEAR
        off = math.remainder(math.atan2(box.y - there.y, box.x - there.x) - there.heading, math.tau)
        assert abs(math.degrees(off)) < 20, "it looks at the box"


@pytest.mark.long
def test_the_example_starts_a_door_of_its_own():
    command = [sys.executable, SCRIPT, "sim://red-boxes?speed=2"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=5 * PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("found with ")
