"""World files: what they say, and how their mistakes are named."""

import dataclasses
import math
import re
import tomllib

import pytest
from PIL import Image

from elib.base.errors import LinkNotFound, SimulationError
from elib.base.rules import MAX_NUMBER, Degrees, Mistake, Number, Several, fields_of
from elib.base.tables import line_of
from elib.simulator.physics import Box, Colour, Cylinder, EpuckModel, Pose, Scene, Wall, World
from elib.simulator.physics.fittings import Checkers, Energy, Light, Patch, Print, Sound, Stripe, Zone
from elib.simulator.worlds.files import gallery, load_file, parse, parse_file
from elib.simulator.worlds.tables import TABLES

WHOLE = b"""about = "All there is."
[arena]
size = [1.5, 2]
[simulation]
step = 0.01
seed = 7
[epuck]
profile = "webots"
rays = 5
motor_noise = 0.01
ground_module = true
[[wall]]
from = [0.1, 0.2]
to = [0.3, 0.4]
height = 0.03
reflectance = 0.5
[[box]]
position = [0.5, 0.6]
size = [0.1, 0.2]
angle = 90
colour = "#102030"
[[box]]
position = [1.2, 0.6]
size = [0.1, 0.1]
pushable = true
mass = 0.2
name = "crate"
[[cylinder]]
position = [0.8, 0.9]
radius = 0.05
[[light]]
position = [1, 1]
intensity = 2
name = "lamp"
[[sound]]
position = [1.4, 1.9]
frequency = 880
[floor]
colour = "#ffffff"
[[stripe]]
points = [[0, 0], [1, 1], [1, 2]]
width = 0.02
[[patch]]
corner = [0, 0]
size = [0.1, 0.2]
hole = true
[[patch]]
corner = [1, 0]
size = [0.1, 0.2]
colour = "#00ff00"
[checkers]
square = 0.1
[[robot]]
position = [1.0, 1.5]
heading = -90
firmware = "epuck2"
[[robot]]
position = [0.5, 1.5]
"""


def test_every_key_arrives_in_si():
    scene = parse(WHOLE, "whole.toml")
    assert (scene.name, scene.width, scene.depth, scene.step, scene.seed) == ("whole", 1.5, 2.0, 0.01, 7)
    assert scene.walls == (Wall(0.1, 0.2, 0.3, 0.4, height=0.03, reflectance=0.5),)
    assert scene.boxes == (
        Box(0.5, 0.6, 0.1, 0.2, math.pi / 2, colour=Colour(16, 32, 48)),
        Box(1.2, 0.6, 0.1, 0.1, is_pushable=True, mass=0.2, name="crate"),
    )
    assert scene.cylinders == (Cylinder(0.8, 0.9, 0.05),)
    assert scene.lights == (Light(1.0, 1.0, intensity=2.0, name="lamp"),)
    assert scene.sounds == (Sound(1.4, 1.9, frequency=880.0),)
    assert scene.starts == (Pose(1.0, 1.5, -math.pi / 2), Pose(0.5, 1.5, 0.0))
    assert scene.firmware == ("epuck2", "")
    assert scene.model == EpuckModel(profile="webots", rays=5, motor_noise=0.01, ground_module=True)
    assert scene.floor == Colour(255, 255, 255)


def test_stripes_lie_on_patches_and_patches_on_checkers_whatever_their_order_in_the_file():
    assert parse(WHOLE, "whole.toml").paint == (
        Checkers(0.1),
        Patch(0.0, 0.0, 0.1, 0.2, None),
        Patch(1.0, 0.0, 0.1, 0.2, Colour(0, 255, 0)),
        Stripe(((0.0, 0.0), (1.0, 1.0), (1.0, 2.0)), 0.02),
    )


def test_the_arenas_size_is_all_that_must_be_said():
    file = parse_file(b"[arena]\nsize = [1, 1]", "small.toml")
    scene = file.scene
    assert file.about == ""
    assert scene.step == 1 / 64
    assert scene.model == EpuckModel()
    assert scene.walls == scene.boxes == scene.cylinders == scene.starts == scene.lights == scene.paint == ()


def test_what_the_file_says_about_itself_is_kept():
    assert parse_file(WHOLE, "whole.toml").about == "All there is."


def test_every_field_of_the_robots_model_has_its_key():
    keys = {key.name for table in TABLES if table.name == "epuck" for key in table.keys}
    assert keys == {field.name for field in dataclasses.fields(EpuckModel)}


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.name)
def test_the_example_of_every_key_holds(table):
    for key in table.keys:
        assert key.is_needed or key.default
        assert set(key.read(parse_value(key.example))) == set(key.fills)


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.name)
def test_what_a_table_makes_accepts_both_ends_of_every_range_and_nothing_beyond(table):
    needed = {key.name: parse_value(key.example) for key in table.keys if key.is_needed}
    if table.name in ("arena", "patch"):
        needed |= {"arena": {"size": [1, 1]}, "patch": {"hole": True}}[table.name]
    shapes = {"position": {"radius": 0.1}, "radius": {"position": [0, 0]}, "size": {"position": [0, 0]}}
    shapes["band"] = {"points": [[0, 0], [1, 0], [1, 1]]}  # of a polygon, too, whose band is 0
    for key in table.keys:
        more = needed | (shapes.get(key.name, {}) if table.name == "zone" else {})
        number = key.rule.rule if isinstance(key.rule, Several) else key.rule
        if not isinstance(number, Number) or key.name in ("density", "colour"):
            continue
        for end, beyond in ((number.low, -math.inf), (number.high, math.inf)):
            good, bad = ([end, 0.5], [beyond, 0.5]) if isinstance(key.rule, Several) else (end, beyond)
            assert table.read({**more, key.name: good}, "a world") is not None
            with pytest.raises(Mistake, match="it must be"):
                table.read({**more, key.name: bad}, "a world")


SHOWN = [Wall, Box, Cylinder, Light, Sound, Zone, Energy, Stripe, Checkers, Print, Patch, EpuckModel]


@pytest.mark.parametrize("kind", SHOWN)
def test_the_documentation_of_a_class_gives_the_ranges_that_it_checks(kind):
    for field in fields_of(kind):
        if isinstance(field.rule, Number) and field.rule.high < MAX_NUMBER:
            text = re.search(rf"^ +{field.name}:(.*(?:\n {{12}}.*)*)", kind.__doc__, re.MULTILINE)[1]
            assert f"{field.rule.low:g}..{field.rule.high:g}" in text
            assert field.rule.unit in text


def parse_value(text):
    return tomllib.loads(f"value = {text}")["value"]


def test_an_arena_with_a_density_is_as_large_as_its_robots_need():
    content = b"[arena]\ndensity = 10\nrobots = 40\n"
    assert parse(content, "crowd.toml").width == pytest.approx(2.0)
    for robots in (10, 1000):
        scene = parse(content, "crowd.toml", robots=robots)
        assert robots / (scene.width * scene.depth) == pytest.approx(10)
    assert parse(content, "crowd.toml", robots=0).width == pytest.approx(4 * 0.037)


def test_robots_that_the_file_counts_stand_where_there_is_room():
    content = b"[arena]\nsize = [1, 1]\nrobots = 5\n[[robot]]\nposition = [0.5, 0.5]\n"
    world = World(parse(content, "five.toml"))
    assert world.robots == 5
    assert (world.pose(0).x, world.pose(0).y) == (0.5, 0.5)
    assert World(parse(content, "five.toml", robots=3), robots=3).poses == world.poses[:3]


def replaced(old, new):
    assert WHOLE.count(old) == 1
    return WHOLE.replace(old, new)


MISTAKES = {
    "empty": (b"", "mine.toml: arena is missing", "size = [1.0, 1.0]"),
    "no size": (b"\n[arena]", "mine.toml:2: arena.size is missing", "size = [1.0, 1.0]"),
    "no table": (b"arena = 3", "mine.toml:1: arena is 3; it must be a table", "[arena]"),
    "three": (b"[arena]\nsize = [1, 1, 1]", "mine.toml:2: arena.size is [1, 1, 1]", "size = [1.0, 1.0]"),
    "truth": (b"[arena]\nsize = [1, true]", "mine.toml:2: arena.size is [1, true]", "size = [1.0, 1.0]"),
    "small": (b"[arena]\nsize = [0.01, 1]", "mine.toml:2: arena.size is [0.01, 1]", "size = [1.0, 1.0]"),
    "nan": (b"[arena]\nsize = [nan, 1]", "mine.toml:2: arena.size is [nan, 1]", "size = [1.0, 1.0]"),
    "infinite": (b"[arena]\nsize = [1, inf]", "mine.toml:2: arena.size is [1, inf]", "size = [1.0, 1.0]"),
    "both": (b"[arena]\nsize = [1, 1]\ndensity = 1", "mine.toml:3: arena.density contradicts size", "leave one"),
    "vast": (b"[arena]\ndensity = 0.001\nrobots = 2000", "mine.toml: the world's width is 1414", ""),
    "step": (replaced(b"step = 0.01", b"step = 5"), "mine.toml:5: simulation.step is 5 s; it must be", "0.015625"),
    "text": (replaced(b"step = 0.01", b'step = "fast"'), "mine.toml:5: simulation.step is 'fast'", "0.015625"),
    "fraction": (replaced(b"seed = 7", b"seed = 7.5"), "mine.toml:6: simulation.seed is 7.5", "seed = 1"),
    "flag": (replaced(b"seed = 7", b"seed = true"), "mine.toml:6: simulation.seed is true", "seed = 1"),
    "profile": (
        replaced(b'"webots"', b'"wobots"'),
        "mine.toml:8: epuck.profile is 'wobots'; it must be \"measured\" or ",
        "did you mean webots?",
    ),
    "rays": (replaced(b"rays = 5", b"rays = 2"), "mine.toml:9: epuck.rays is 2; it must be 1 or 3 or 5", "rays = 3"),
    "noise": (replaced(b"motor_noise = 0.01", b"motor_noise = -1"), "mine.toml:10: epuck.motor_noise is -1", "0.01"),
    "module": (
        replaced(b"ground_module = true", b"ground_module = 1"),
        "mine.toml:11: epuck.ground_module is 1; it must be true or false",
        "true",
    ),
    "length": (
        replaced(b"to = [0.3, 0.4]", b"to = [0.1, 0.2]"),
        "mine.toml:12: wall[0]: the wall",
        "two different ends",
    ),
    "missing": (replaced(b"radius = 0.05", b""), "mine.toml:28: cylinder[0].radius is missing", "radius = 0.05"),
    "radius": (
        replaced(b"radius = 0.05", b"radius = 0"),
        "mine.toml:30: cylinder[0].radius is 0 m; it must be a number from 0.001 to 1000 m",
        "radius = 0.05",
    ),
    "colour": (replaced(b'"#102030"', b'"red"'), "mine.toml:21: box[0].colour is 'red'; it must be", "#d04030"),
    "number": (replaced(b'"#102030"', b"5"), "mine.toml:21: box[0].colour is 5", '"#d04030"'),
    "spelling": (
        replaced(b'colour = "#102030"', b'color = "#102030"'),
        "mine.toml:21: box[0].color is not a key",
        "did you mean colour?",
    ),
    "mass": (replaced(b"mass = 0.2", b"mass = 0"), "mine.toml:26: box[1].mass is 0", "mass = 0.1"),
    "stranger": (
        replaced(b"[[robot]]\nposition = [0.5", b"[[robot]]\nplace = 1\nposition = [0.5"),
        "mine.toml:58: robot[1].place is not a key",
        "position, heading",
    ),
    "plural": (b"[[robots]]\n" + WHOLE[WHOLE.index(b"[arena]") :], "mine.toml:1: robots is not a key", "mean robot?"),
    "one": (b"[arena]\nsize=[1,1]\n[box]\nposition=[0,0]", "mine.toml:3: box must be an array", "[[box]]"),
    "point": (replaced(b"[1, 1], [1, 2]]", b"[1, 1], [1]]"), "mine.toml:41: stripe[0].points[2] is [1]", "points = [["),
    "points": (replaced(b"[[0, 0], [1, 1], [1, 2]]", b"[[0, 0]]"), "mine.toml:41: stripe[0].points is [[0, 0]]", "[["),
    "holes": (replaced(b"hole = true", b""), "mine.toml:43: patch[0]: needs a colour", "hole = true"),
    "painted hole": (
        replaced(b"hole = true", b'hole = true\ncolour = "#000000"'),
        "mine.toml:43: patch[0]: is a hole",
        "one of them",
    ),
    "names": (
        replaced(b'name = "lamp"', b'name = "crate"'),
        'mine.toml:34: light[0].name is "crate", as that of box[1]',
        "another name",
    ),
    "about": (b"about = 1\n[arena]\nsize=[1,1]", "mine.toml:1: about is 1; it must be a text", "about ="),
    "squares": (replaced(b"square = 0.1", b"square = 0.001"), "mine.toml:52: checkers.square is 0.001", "larger"),
    "brackets": (b"[arena\n", "mine.toml:1: this is not TOML", "toml.io"),
    "end": (b'[arena]\nsize = "', "mine.toml: this is not TOML", "toml.io"),
    "bytes": (b"[arena]\nsize = [1, 1] # \xff", "mine.toml:2: this is not text in UTF-8", "UTF-8"),
}


@pytest.mark.parametrize(("content", "said", "cure"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_named_with_its_file_its_line_its_key_and_a_cure(content, said, cure):
    with pytest.raises(SimulationError) as caught:
        parse(content, "mine.toml")
    assert caught.value.message.startswith(said)
    assert cure in caught.value.hint


LAYOUTS = """# [arena]
about = "[box]"
"arena" = {size = 1}  # in one line
  [ simulation ] # step = 2
step = [ # one
  [1, "]"],
]
'seed' = 1
[[box]]
a = 1
[[ "box" ]]
a = 'x] # y'
[box.sub]
b = 1
["\\u001b[31m"]
"""


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("about",), 2),
        (("arena", "size"), 3),
        (("simulation",), 4),
        (("simulation", "step", 0, 1), 5),
        (("simulation", "seed"), 8),
        (("simulation", "missing"), 4),
        (("box",), 9),
        (("box", 0, "a"), 10),
        (("box", 1), 11),
        (("box", 1, "a"), 12),
        (("box", 1, "b"), 11),
        (("\x1b[31m",), 15),
        (("missing",), None),
        ((), None),
    ],
)
def test_the_line_of_a_table_or_a_key_is_found(path, line):
    tomllib.loads(LAYOUTS)
    assert line_of(LAYOUTS, path) == line
    assert line_of(LAYOUTS.replace("\n", "\r\n"), path) == line


def test_a_file_is_loaded_by_its_path(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_bytes(WHOLE)
    assert Scene.load(str(path)).name == "mine"
    assert World.load(str(path)).robots == 2


def test_a_file_that_begins_with_the_mark_of_windows_editors_is_read():
    assert parse(b"\xef\xbb\xbf" + WHOLE.replace(b"\n", b"\r\n"), "mine.toml") == parse(WHOLE, "mine.toml")


def test_a_missing_world_file_is_refused(tmp_path):
    with pytest.raises(LinkNotFound, match="No such file"):
        Scene.load(str(tmp_path / "none.toml"))


def test_an_unknown_name_lists_the_gallery():
    with pytest.raises(LinkNotFound, match="'nowhere'") as caught:
        Scene.load("nowhere")
    assert ", ".join(gallery()) in caught.value.hint


def test_a_picture_is_found_beside_the_worlds_file(tmp_path):
    Image.new("RGB", (4, 4), (255, 0, 0)).save(tmp_path / "floor.png")
    path = tmp_path / "mine.toml"
    path.write_text('[arena]\nsize = [1, 1]\n[[picture]]\nfile = "floor.png"\ncorner = [0, 0]\nsize = [1, 1]\n')
    file = load_file(str(path))
    assert file.scene.paint == (Print(str(tmp_path / "floor.png"), 0.0, 0.0, 1.0, 1.0),)


def test_defaults_are_written_as_a_file_would_write_them():
    found = {(table.name, key.name): key.default for table in TABLES for key in table.keys if not key.is_needed}
    assert found["box", "colour"] == '"#ece8de"'
    assert found["box", "pushable"] == "false"
    assert found["robot", "heading"] == "0"
    assert found["cylinder", "mass"] == "0.1"
    assert found["wall", "reflectance"] == "from the red in its colour"
    assert Degrees().written(math.pi) == "180"
