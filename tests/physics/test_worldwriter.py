"""A scene written as a world file opens again equal."""

import math
from dataclasses import replace

import pytest
from random_worlds import random_states, random_worlds
from world_rig import IDEAL

from elib.base.errors import SimulationError
from elib.simulator.physics import Box, Cylinder, Pose, Scene, World
from elib.simulator.physics.fittings import Checkers, Patch, Print, Stripe
from elib.simulator.physics.placement import cleared
from elib.simulator.worlds.files import gallery, load_file, parse
from elib.simulator.worlds.writer import written_scene

PAINTS = [Checkers, Print, Patch, Stripe]
"""A file has what is painted in this order."""


def same(one: Scene, other: Scene) -> bool:
    """Tell whether two scenes are equal but for the last bits of angles."""
    turns = [[*(box.angle for box in each.boxes), *(pose.heading for pose in each.starts)] for each in (one, other)]
    assert all(math.isclose(a, b, rel_tol=1e-12, abs_tol=1e-12) for a, b in zip(*turns, strict=True))
    bare = [
        replace(
            each,
            boxes=tuple(replace(box, angle=0.0) for box in each.boxes),
            starts=tuple(replace(pose, heading=0.0) for pose in each.starts),
            paint=tuple(sorted(each.paint, key=lambda paint: PAINTS.index(type(paint)))),
            firmware=tuple(name for name in each.firmware if name),
        )
        for each in (one, other)
    ]
    return bare[0] == bare[1]


@pytest.mark.parametrize("name", gallery())
def test_every_world_that_comes_with_elib_opens_again_equal(name):
    file = load_file(name)
    text = written_scene(file.scene, file.about)
    assert same(parse(text.encode(), f"{name}.toml"), file.scene)
    assert f'about = "{file.about}"' in text


@pytest.mark.parametrize("scene", [scene for scene, _ in random_worlds(20)])
def test_random_worlds_open_again_equal(scene):
    inside = {
        kind: tuple(each for each in getattr(scene, kind) if 0 <= each.x <= scene.width and 0 <= each.y <= scene.depth)
        for kind in ("boxes", "cylinders")
    }
    scene = replace(scene, name="world", **inside)
    assert same(parse(written_scene(scene).encode(), "world.toml"), scene)


@pytest.mark.parametrize("scene", [replace(scene, name="world") for scene, _ in random_states(20)])
def test_random_worlds_with_states_open_again_equal(scene):
    swings = [each.swing for each in parse(written_scene(scene).encode(), "world.toml").boxes]
    assert swings == pytest.approx([box.swing for box in scene.boxes], rel=1e-12)
    scene = replace(
        scene, boxes=tuple(replace(box, swing=round(box.swing) or 0.0) for box in scene.boxes if not box.swing)
    )
    assert same(parse(written_scene(scene).encode(), "world.toml"), scene)


def test_a_world_that_was_written_and_read_is_written_the_same_again():
    text = written_scene(load_file("maze").scene)
    assert written_scene(parse(text.encode(), "maze.toml")) == text


def test_an_angle_of_many_turns_and_odd_names_are_written_so_that_they_can_be_read():
    scene = Scene(
        1,
        1,
        boxes=(Box(0.5, 0.5, 0.1, 0.1, angle=1000.0, name='say "hi" \\ ü'),),
        starts=(Pose(0.2, 0.2, 7.0),),
        model=IDEAL,
    )
    found = parse(written_scene(scene).encode(), "odd.toml")
    assert found.boxes[0].name == scene.boxes[0].name
    assert math.remainder(found.boxes[0].angle - 1000.0, math.tau) == pytest.approx(0, abs=1e-12)
    assert found.starts[0].heading == pytest.approx(7.0 - math.tau)


def test_a_robot_that_presses_against_something_starts_beside_it():
    world = World(Scene(1, 1, cylinders=(Cylinder(0.5, 0.5, 0.05),), starts=(Pose(0.4, 0.5),), model=IDEAL))
    world.set_wheel_speeds(0, 0.1, 0.1)
    world.run(100)
    starts = cleared(world.scene, world.poses)
    assert starts[0].x == pytest.approx(0.413, abs=0.002)
    World(parse(written_scene(replace(world.scene, starts=starts)).encode(), "x.toml"))
    with pytest.raises(SimulationError, match="robot 0 stands in something"):
        cleared(world.scene, [Pose(0.5, 0.5)])
