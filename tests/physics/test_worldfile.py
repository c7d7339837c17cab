"""World files: what they say, and how their mistakes are named."""

import math

import pytest

from elib.errors import LinkNotFound, SimulationError
from elib.physics import Box, Colour, Cylinder, Pose, Wall, World
from elib.physics.worldfile import gallery, load, parse

WHOLE = b"""
[arena]
size = [1.5, 2]
[simulation]
step = 0.01
seed = 7
[epuck]
profile = "webots"
motor_noise = 0.01
ground_module = true
[[wall]]
from = [0.1, 0.2]
to = [0.3, 0.4]
height = 0.03
[[box]]
position = [0.5, 0.6]
size = [0.1, 0.2]
angle = 90
colour = "#102030"
[[cylinder]]
position = [0.8, 0.9]
radius = 0.05
[[robot]]
position = [1.0, 1.5]
heading = -90
[[robot]]
position = [0.5, 1.5]
"""


def test_every_key_arrives_in_si():
    scene = parse(WHOLE, "whole.toml")
    assert (scene.name, scene.width, scene.depth, scene.step, scene.seed) == ("whole", 1.5, 2.0, 0.01, 7)
    assert scene.walls == (Wall(0.1, 0.2, 0.3, 0.4, height=0.03),)
    assert scene.boxes == (Box(0.5, 0.6, 0.1, 0.2, math.pi / 2, colour=Colour(16, 32, 48)),)
    assert scene.cylinders == (Cylinder(0.8, 0.9, 0.05),)
    assert scene.starts == (Pose(1.0, 1.5, -math.pi / 2), Pose(0.5, 1.5, 0.0))
    assert (scene.model.profile, scene.model.motor_noise, scene.model.ground_module) == ("webots", 0.01, True)


def test_the_arenas_size_is_all_that_must_be_said():
    scene = parse(b"[arena]\nsize = [1, 1]", "small.toml")
    assert scene.step == 1 / 64
    assert scene.walls == scene.boxes == scene.cylinders == scene.starts == ()


@pytest.mark.parametrize("name", gallery())
def test_every_world_of_the_gallery_can_be_set_up_with_several_robots(name):
    assert World.load(name, robots=5).robots == 5


def replaced(old, new):
    assert old in WHOLE
    return WHOLE.replace(old, new)


@pytest.mark.parametrize(
    ("content", "key", "cure"),
    [
        (b"", "arena is missing", "a table"),
        (b"[arena]", "arena.size is missing", "two numbers"),
        (b"arena = 3", "arena must be a table", "[arena]"),
        (b"[arena]\nsize = [1, 1, 1]", "arena.size is [1, 1, 1]", "size = [0.5, 0.5]"),
        (b"[arena]\nsize = [1, true]", "arena.size", "size = [0.5, 0.5]"),
        (b"[arena]\nsize = [0.01, 1]", "arena: the arena's width", ""),
        (b"[arena]\nsize = [nan, 1]", "arena: the arena's width", ""),
        (replaced(b"step = 0.01", b"step = 5"), "simulation: the step is 5.0", "0.015625"),
        (replaced(b"step = 0.01", b'step = "fast"'), "simulation.step is 'fast'", "step = 0.5"),
        (replaced(b"seed = 7", b"seed = 7.5"), "simulation.seed is 7.5", "seed = 1"),
        (replaced(b"seed = 7", b"seed = true"), "simulation.seed", "seed = 1"),
        (replaced(b'"webots"', b'"wobots"'), "epuck: there is no infrared profile", "enki"),
        (replaced(b"motor_noise = 0.01", b"motor_noise = -1"), "epuck: motor_noise is -1", ""),
        (replaced(b"ground_module = true", b"ground_module = 1"), "epuck.ground_module is 1", "true"),
        (replaced(b"to = [0.3, 0.4]", b"to = [0.1, 0.2]"), "wall[0]: the wall", "two different ends"),
        (replaced(b"radius = 0.05", b""), "cylinder[0].radius is missing", "a number"),
        (replaced(b"radius = 0.05", b"radius = 0"), "cylinder[0]: the cylinder's radius is 0", ""),
        (replaced(b'"#102030"', b'"red"'), "box[0]: 'red' is no colour", "#rrggbb"),
        (replaced(b'"#102030"', b"5"), "box[0].colour is 5", "quotes"),
        (replaced(b"colour =", b"color ="), "box[0].color is not a key", "did you mean colour?"),
        (
            replaced(b"[[robot]]\nposition = [0.5", b"[[robot]]\nplace = 1\nposition = [0.5"),
            "robot[1].place",
            "position, heading",
        ),
        (b"[[robots]]\n" + WHOLE, "robots is not a key", "did you mean robot?"),
        (b"[arena]\nsize=[1,1]\n[box]\nposition=[0,0]", "box must be an array", "[[box]]"),
        (b"[arena\n", "no TOML", "toml.io"),
        (b"[arena]\nsize = [1, 1] # \xff", "UTF-8", "UTF-8"),
    ],
)
def test_a_mistake_is_named_with_its_file_its_key_and_a_cure(content, key, cure):
    with pytest.raises(SimulationError) as caught:
        parse(content, "mine.toml")
    assert caught.value.message.startswith("mine.toml")
    assert key in caught.value.message
    assert cure in caught.value.hint


def test_a_file_is_loaded_by_its_path(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_bytes(WHOLE)
    assert load(str(path)).name == "mine"
    assert World.load(str(path)).robots == 2


def test_a_missing_file_is_no_world(tmp_path):
    with pytest.raises(LinkNotFound, match="No such file"):
        load(str(tmp_path / "none.toml"))
