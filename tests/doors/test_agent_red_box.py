"""An agent without a model finds the red box, wherever it is, by the tools of ``elib agent`` alone."""

import importlib.util
import math
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from mcp_types import CallToolRequestParams
from red_box_worlds import RED, gap, random_placement, written_placement
from test_agent import door_of, speeds, tools_on, world_of

from elib.doors.agent.limits import Limits
from elib.testing import simulated
from lanes import short
from shared import PATIENCE, now

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


async def search(seed, folder):
    """Let the example search in a placement, in simulated time; return what it says, and what the world says."""
    path = folder / f"placement-{seed}.toml"
    path.write_text(written_placement(seed))
    async with tools_on(f"sim://{path}", LIMITS) as tools:
        door, world = door_of(tools), world_of(tools)

        def call_tool(name, arguments):
            return door._call(SimpleNamespace(request=None), CallToolRequestParams(name=name, arguments=arguments))

        began = now()
        says_found = await program().Agent(SimpleNamespace(call_tool=call_tool)).find_red_box()
        took, there = now() - began, world.pose(0)
        after = {box.name: box for box in world.snapshot().boxes}
        before = {box.name: box for box in random_placement(seed).boxes}
        box = before[RED]
        off = math.remainder(math.atan2(box.y - there.y, box.x - there.x) - there.heading, math.tau)
        return {
            "says_found": says_found,
            "speeds": speeds(tools),
            "time": took,
            "gap": gap(box, there.x, there.y) - RADIUS,
            "off": abs(math.degrees(off)),
            "pushed": max(math.dist((after[k].x, after[k].y), (each.x, each.y)) for k, each in before.items()),
        }


def is_found(said):
    """Return whether the robot stands before the box, by what the world says, looks at it, and has pushed nothing."""
    is_there = said["gap"] < NEAR and said["off"] < 20 and said["pushed"] < 0.01
    return said["says_found"] and is_there and said["speeds"] == (0, 0)


@pytest.mark.parametrize("seed", short([5, 15, 17], 15))
@simulated
async def test_it_finds_the_red_box_wherever_it_is(seed, tmp_path):
    said = await search(seed, tmp_path)
    assert is_found(said), said


@pytest.mark.long
def test_the_example_starts_a_door_of_its_own():
    command = [sys.executable, SCRIPT, "sim://red-boxes?speed=2"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=5 * PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("found with ")
