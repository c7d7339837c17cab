"""An agent without a model finds the red box, wherever it is, by the tools of ``elib agent`` alone."""

import importlib.util
import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import TextIO

import pytest

pytest.importorskip("mcp")

from mcp import Client, StdioServerParameters, stdio_client
from red_box_worlds import RED, gap, random_placement, written_placement

HERE = Path(__file__).parent
SCRIPT = HERE.parents[1] / "examples" / "agent" / "find_the_red_box.py"
SPEED = 5
"""Times real time: a search takes half a minute of simulated time. The robot drives on while the machine is busy, so
the world must not be much faster."""
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


def nowhere() -> TextIO:
    """Open a file that keeps nothing, for the errors of a door: the test's own output has no descriptor."""
    return Path(os.devnull).open("w")


async def search(seed: int, folder: Path, speed: float = SPEED) -> dict[str, object]:
    """Let the example search in a placement; return what it says, and what the world says."""
    world, witness = folder / f"placement-{seed}.toml", folder / f"witness-{seed}.json"
    world.write_text(written_placement(seed))
    door = StdioServerParameters(
        command=sys.executable,
        args=[str(HERE / "witnessed_agent.py"), str(witness), "agent", f"sim://{world}?speed={speed:g}"],
        env={"PYTHONPATH": os.environ.get("PYTHONPATH", "")},
    )
    with nowhere() as errors:
        async with Client(stdio_client(door, errors)) as client:
            agent = program().Agent(client)
            says_found = await agent.find_red_box()
    said = json.loads(witness.read_text())
    box = next(each for each in random_placement(seed).boxes if each.name == RED)
    x, y, heading = (said["pose"][name] for name in ("x", "y", "heading"))
    said["says_found"] = says_found
    said["gap"] = gap(box, x, y) - RADIUS
    said["off"] = abs(math.degrees(math.remainder(math.atan2(box.y - y, box.x - x) - heading, math.tau)))
    return said


def is_found(said: dict[str, object]) -> bool:
    """Return whether the robot stands before the box, by what the world says, and looks at it."""
    is_there = said["gap"] < NEAR and said["off"] < 20 and max(said["pushed"].values()) < 0.01
    return bool(said["says_found"] and is_there and not said["unconfirmed"])


@pytest.mark.parametrize("seed", [5, 15, 17])
async def test_it_finds_the_red_box_wherever_it_is(seed: int, tmp_path: Path) -> None:
    said = await search(seed, tmp_path)
    assert is_found(said), said


def test_the_example_starts_a_door_of_its_own() -> None:
    done = subprocess.run(
        [sys.executable, SCRIPT, "sim://red-boxes?speed=5"], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("found with ")
