"""Impossible worlds: each is refused with what is wrong and where, and nothing crashes or hangs."""

import json
import math
import os
import struct
import sys
import zlib
from importlib.resources import files

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from world_rig import IDEAL

from elib.base.errors import ArgumentError, LinkNotFound, SimulationError
from elib.base.files import WORLDS
from elib.base.rules import Choice, Flag, Number, Several, Text
from elib.base.tables import MAX_FILE, MAX_PARTS
from elib.simulator.physics import Box, Cylinder, Scene, Wall, World
from elib.simulator.physics.geometry import MAX_POINTS, ColourRule, CourseRule
from elib.simulator.physics.placement import MAX_ROBOTS, _Ground, places
from elib.simulator.physics.scene import MAX_THINGS
from elib.simulator.worlds.files import gallery, parse
from elib.simulator.worlds.tables import TABLES, TOP
from lanes import few_and_many

ARENA = b"[arena]\nsize = [2, 1]\n"


def refused(content):
    with pytest.raises(SimulationError) as caught:
        parse(content, "bad.toml")
    return caught.value


# Robots.


def robot(x, y):
    return f"[[robot]]\nposition = [{x}, {y}]\n".encode()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (robot(0.5, 0.5) + robot(0.55, 0.5), "bad.toml:6: robot[1].position stands on another one: robot[0]"),
        (robot(0.5, 0.5) + robot(0.5, 0.5), "bad.toml:6: robot[1].position stands on another one: robot[0]"),
        (robot(3, 0.5), "bad.toml:4: robot[0].position stands outside the arena"),
        (robot(-0.1, 0.5), "bad.toml:4: robot[0].position stands outside the arena"),
        (robot(1.98, 0.5), "bad.toml:4: robot[0].position stands in a wall or an obstacle: the arena's wall"),
        (
            robot(0.5, 0.5) + b"[[box]]\nposition = [0.5, 0.5]\nsize = [0.4, 0.4]\n",
            "bad.toml:4: robot[0].position stands in a wall or an obstacle: box[0]",
        ),
        (
            robot(0.5, 0.5) + b"[[box]]\nposition = [0.55, 0.5]\nsize = [0.1, 0.1]\npushable = true\n",
            "bad.toml:4: robot[0].position stands in a wall or an obstacle: box[0]",
        ),
        (
            robot(0.5, 0.5) + b"[[cylinder]]\nposition = [0.5, 0.58]\nradius = 0.05\npushable = true\n",
            "bad.toml:4: robot[0].position stands in a wall or an obstacle: cylinder[0]",
        ),
        (
            robot(0.5, 0.5) + b"[[wall]]\nfrom = [0, 0.52]\nto = [2, 0.52]\n",
            "bad.toml:4: robot[0].position stands in a wall or an obstacle: wall[0]",
        ),
        (robot("nan", 0.5), "bad.toml:4: robot[0].position is [nan, 0.5]"),
        (robot("1e999", 0.5), "bad.toml:4: robot[0].position is [inf, 0.5]"),
    ],
)
def test_a_start_that_is_not_free_is_named_with_its_line_and_what_is_in_the_way(content, said):
    assert refused(ARENA + content).message.startswith(said)


def test_robots_that_touch_each_other_and_the_wall_do_not_overlap():
    content = ARENA + robot(0.037, 0.037) + robot(0.111, 0.037) + robot(0.185, 0.037)
    assert World(parse(content, "tight.toml")).robots == 3


def test_more_robots_than_any_world_holds_are_refused_at_once():
    with pytest.raises(SimulationError, match="no room for 1000000000 robots"):
        places(Scene(1000, 1000, model=IDEAL), 10**9, 1)
    assert refused(b"[arena]\ndensity = 1\nrobots = 1000000000").message.startswith("bad.toml:3: arena.robots is")
    with pytest.raises(SimulationError, match="world's width is"):
        parse(b"[arena]\ndensity = 0.001", "bad.toml", robots=MAX_ROBOTS)


def test_a_file_that_asks_for_more_robots_than_fit_is_refused_with_its_line():
    error = refused(b"[arena]\ndensity = 100\nrobots = 20\n")
    assert error.message.startswith("bad.toml:3: arena.robots is 20: world 'bad' has no room for 20 robots; ")
    assert error.hint == "ask for fewer robots, or choose a larger world"


def test_no_number_of_robots_breaks_a_world_that_grows_with_them():
    assert Scene.load("crowd", robots=-5).width == Scene.load("crowd", robots=0).width > 0


def test_robots_are_placed_beside_everything_that_stands_there():
    scene = Scene(
        1.0,
        1.0,
        walls=(Wall(0.0, 0.5, 1.0, 0.5),),
        boxes=(Box(0.25, 0.25, 0.4, 0.3, 0.5, is_pushable=True),),
        cylinders=(Cylinder(0.7, 0.75, 0.2, is_pushable=True),),
        model=IDEAL,
    )
    poses = places(scene, 25, 3)
    ground = _Ground(scene)
    for i, pose in enumerate(poses):
        assert ground.in_the_way(pose.x, pose.y, 0.037) is None
        u, v = turned(pose.x - 0.25, pose.y - 0.25, -0.5)
        assert abs(pose.y - 0.5) >= 0.047
        assert abs(u) > 0.247 or abs(v) > 0.197 or math.hypot(max(abs(u) - 0.2, 0), max(abs(v) - 0.15, 0)) >= 0.047
        assert math.hypot(pose.x - 0.7, pose.y - 0.75) >= 0.247
        assert all(math.hypot(pose.x - other.x, pose.y - other.y) >= 0.084 for other in poses[:i])


def turned(x, y, angle):
    return x * math.cos(angle) - y * math.sin(angle), x * math.sin(angle) + y * math.cos(angle)


def test_a_thing_of_any_size_is_in_the_way_all_over_it():
    far = (Wall(-1000, -1000, 1000, 1000), Wall(0.0, 999.0, 999.0, 999.0))
    ground = _Ground(Scene(1000, 1000, walls=far, boxes=(Box(700, 200, 400, 300),), model=IDEAL))
    assert ground.in_the_way(500.02, 500.0, 0.037) == "wall[0]"
    assert ground.in_the_way(31.0, 999.03, 0.037) == "wall[1]"
    assert ground.in_the_way(650.0, 130.0, 0.037) == "box[0]"
    assert ground.in_the_way(700.0, 351.0, 0.037) is None


def test_ten_thousand_robots_find_their_places():
    scene = Scene.load("crowd", robots=10_000)
    poses = places(scene, 10_000, 1)
    assert len(poses) == 10_000
    assert poses[:5] == places(scene, 5, 1)


def test_walls_without_a_gap_leave_no_room():
    walls = tuple(Wall(0, k / 1000, 100, k / 1000) for k in range(1, 100_000, 20))
    with pytest.raises(SimulationError, match="no room for 1 robots; 0 were placed"):
        places(Scene(100, 100, walls=walls, model=IDEAL), 1, 1)


# Files.


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "bad.toml: arena is missing"),
        (b"\n\n# nothing\n", "bad.toml: arena is missing"),
        (bytes(range(256)), "bad.toml:2: this is not text in UTF-8"),
        (b"\x00" * 1000, "bad.toml:1: this is not TOML"),
        (b"\x89PNG\r\n\x1a\n" + b"\x00" * 100, "bad.toml:1: this is not text in UTF-8"),
        (ARENA + b"size = [1, 1]\n", "bad.toml:3: this is not TOML"),
        (ARENA + b"[arena]", "bad.toml:3: this is not TOML"),
        (b"x = " + b"[" * 5000, "bad.toml is nested too deeply"),
        (b"x = " + b"{x = " * 5000, "bad.toml is nested too deeply"),
        (b"x = " + b"[" * 200 + b"]" * 200, "bad.toml:1: x is not a key"),
        (b".".join([b"a"] * 1_000_000) + b" = 1", "bad.toml is nested too deeply"),
        (b"[" + b" . ".join([b'"."'] * 100_000) + b"]", "bad.toml is nested too deeply"),
        (b".".join([b"a"] * MAX_PARTS) + b" = 1", "bad.toml:1: a is not a key"),
        (b"x = " + b"9" * 5000, "bad.toml has a number that is too long"),
        (ARENA + b"robots = 0x" + b"f" * 5000, "bad.toml:3: arena.robots is a number of 20000 bits"),
        (b"[arena]\nsize = [1, 0x" + b"f" * 5000 + b"]", "bad.toml:2: arena.size is [1, a number of 20000 bits]"),
        (ARENA + b"[[box]]\nposition = 1979-05-27\nsize = [1, 1]", "bad.toml:4: box[0].position is datetime.date"),
        (ARENA + b'[[light]]\nposition = [1, 1]\nname = ""', "bad.toml:5: light[0].name is ''"),
        (ARENA + b'[[light]]\nposition = [1, 1]\nname = "a\\u001b[31m"', "bad.toml:5: light[0].name is "),
        (ARENA + b'["\\u001b[31m"]', "bad.toml:3: '\\x1b[31m' is not a key"),
        (ARENA + b"[[box]]\nposition = [1, 1]\nsize = [-0.1, 1]", "bad.toml:5: box[0].size is [-0.1, 1]"),
        (ARENA + b"[[box]]\nposition = [5, 1]\nsize = [1, 1]", "bad.toml:4: box[0].position is [5, 1], outside"),
        (
            ARENA + b"[[cylinder]]\nposition = [1, -1]\nradius = 1",
            "bad.toml:4: cylinder[0].position is [1, -1], outside",
        ),
        (
            ARENA + b"[[wall]]\nfrom = [1, 1]\nto = [1, 1.0]",
            "bad.toml:3: wall[0]: the wall at (1.0, 1.0) has no length",
        ),
        (ARENA + b"[[[box]]]", "bad.toml:3: this is not TOML"),
        (ARENA + b"wall = [1, 2]", "bad.toml:3: arena.wall is not a key"),
        (b"wall = [1, 2]\n" + ARENA, "bad.toml:1: wall must be an array of tables"),
        (b"wall = [" + b"{}," * (MAX_THINGS + 1) + b"]\n" + ARENA, f"bad.toml:1: wall[{MAX_THINGS}] is one too many"),
        (ARENA + b"[[patch]]\n" * 1001, "bad.toml:1003: patch[1000] is one too many"),
        (ARENA + b"[[stripe]]\npoints = [" + b"[1, 1]," * (MAX_POINTS + 1) + b"]", "bad.toml:4: stripe[0].points is"),
    ],
    ids=range(30),
)
def test_a_file_that_is_not_a_world_is_refused(content, said):
    assert refused(content).message.startswith(said)


def test_a_million_walls_are_refused_before_they_are_read():
    content = ARENA + b"[[wall]]\nfrom = [0, 0]\nto = [1, 1]\n" * 1_000_000
    assert refused(content).message == f"bad.toml is larger than {MAX_FILE // 1_000_000} MB, which is the limit"


def test_what_is_shown_of_a_wrong_value_fits_a_line():
    message = refused(ARENA + b"[[stripe]]\npoints = " + b"[" + b"[0, 0, 0]," * 1000 + b"]").message
    assert len(message) < 200
    assert len(refused(ARENA + b"x" * 10_000 + b" = 1").message) < 200


def test_a_path_that_is_not_a_file_is_refused(tmp_path):
    folder = tmp_path / "folder.toml"
    folder.mkdir()
    for path in (str(folder), str(tmp_path / "none.toml"), "nul\0.toml"):
        with pytest.raises(LinkNotFound, match="cannot be read"):
            Scene.load(path)


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="needs a file without an end")
def test_a_file_without_an_end_is_refused():
    with pytest.raises(LinkNotFound, match="it is not a regular file"):
        Scene.load("/dev/zero")


# Pictures.


def world_with_picture(folder, name, size="[1, 1]"):
    path = folder / "pictured.toml"
    path.write_bytes(ARENA + f"[[picture]]\nfile = {json.dumps(name)}\ncorner = [0, 0]\nsize = {size}\n".encode())
    return str(path)


def png(width, height):
    """Return the head of a picture that is too large to be read."""
    head = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    first = struct.pack(">I", 13) + head + struct.pack(">I", zlib.crc32(head))
    return b"\x89PNG\r\n\x1a\n" + first + struct.pack(">I", 1000) + b"IDAT" + bytes(100)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("none.png", None, 'picture[0].file is "none.png": there is no such file'),
        (".", None, 'picture[0].file is ".": there is no such file'),
        ("text.png", b"no picture", 'picture[0].file is "text.png": it is not a PNG or JPEG picture'),
        ("empty.png", b"", 'picture[0].file is "empty.png": it is not a PNG or JPEG picture'),
        ("vector.eps", b"%!PS-Adobe-3.0 EPSF-3.0\n", 'file is "vector.eps": it is not a PNG or JPEG picture'),
        ("big.png", png(12_000, 12_000), "it has more than 64 million pixels"),
        ("vast.png", png(100_000, 100_000), "it has more than 64 million pixels"),
    ],
)
def test_a_picture_that_cannot_lie_on_a_floor_is_refused_unread(tmp_path, name, content, said):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    path = world_with_picture(tmp_path, name)
    with pytest.raises(SimulationError) as caught:
        Scene.load(path)
    assert caught.value.message.startswith(f"{path}:4: ")
    assert said in caught.value.message


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pipe with a name")
def test_a_pipe_is_refused_as_a_picture(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")
    with pytest.raises(SimulationError, match="there is no such file"):
        Scene.load(world_with_picture(tmp_path, "pipe.png"))


def test_a_picture_larger_than_its_floor_is_refused(tmp_path):
    Image.new("RGB", (4, 4)).save(tmp_path / "small.png")
    with pytest.raises(SimulationError, match=r":6: picture\[0\].size is \[900, 1\]: too large"):
        Scene.load(world_with_picture(tmp_path, "small.png", "[900, 1]"))


def test_a_picture_that_breaks_off_is_refused_when_the_floor_is_painted(tmp_path):
    Image.effect_noise((64, 64), 50).save(tmp_path / "half.png")
    whole = (tmp_path / "half.png").read_bytes()
    (tmp_path / "half.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ArgumentError, match="cannot be read"):
        World(Scene.load(world_with_picture(tmp_path, "half.png")))


# Anything.

SCALARS = st.one_of(
    st.floats(-2, 2),
    st.floats(),
    st.integers(-3, 3),
    st.integers(-(2**70), 2**70),
    st.booleans(),
    st.text(st.characters(min_codepoint=32, exclude_categories=["C"]), max_size=8),
)
ODD = (37, 73)  # Hypothesis likes the ends of a range, and would make most documents bad.
ANYTHING = st.recursive(SCALARS, lambda inner: st.lists(inner, max_size=3), max_leaves=6)


def good(key):
    """Values that the key alone accepts, most of them small, so that whole worlds come about."""
    match key.rule:
        case CourseRule(fewest=fewest):
            return st.lists(st.lists(st.floats(0, 1), min_size=2, max_size=2), min_size=fewest, max_size=4)
        case Several(Number(low)):
            return st.lists(st.floats(max(low, 0.1), 1.0), min_size=2, max_size=2)
        case Number(low, high):
            low, high = max(low, -360), min(high, 5000)
            return st.integers(math.ceil(low), math.floor(high)) if high >= 1 else st.floats(low, high)
        case Choice(among):
            return st.sampled_from(among)
        case Flag():
            return st.booleans()
        case ColourRule():
            return st.sampled_from(["#000000", "#d02020", "#FFFFFF"])
        case Text():
            return st.sampled_from(["a", "b", "a name", "ü", "x.png", "#"])
    raise AssertionError(key)


@st.composite
def tables(draw, section):
    table = {}
    for key in section.keys:
        if draw(st.integers(0, 9)) < (10 if key.is_needed else 2):
            table[key.name] = draw(ANYTHING if draw(st.integers(0, 99)) in ODD else good(key))
    if section.name == "patch" and draw(st.booleans()):
        table = {"corner": [0, 0], "size": [1, 1], "hole": True}
    if draw(st.integers(0, 99)) in ODD:
        table[draw(st.sampled_from(["nonsense", "siez", "", "a b"]))] = draw(ANYTHING)
    return table


@st.composite
def documents(draw):
    lines = []
    if draw(st.booleans()):
        lines.append(f"about = {toml(draw(good(TOP.keys[0])))}")
    for section in TABLES:
        if section.name == "picture" and draw(st.integers(0, 99)) not in ODD:
            continue  # It would name a file, and there is none.
        if section.is_array:
            found = draw(st.lists(tables(section), max_size=2))
        else:
            found = [draw(tables(section))] if section.is_required or draw(st.booleans()) else []
        if section.name == "arena" and found and draw(st.integers(0, 99)) not in ODD:
            found = [{"size": draw(st.lists(st.floats(1, 1.3), min_size=2, max_size=2))}]
        for table in found:
            lines.append(f"[[{section.name}]]" if section.is_array else f"[{section.name}]")
            lines += [f"{json.dumps(name)} = {toml(value)}" for name, value in table.items()]
    return "\n".join(lines)


def toml(value):
    match value:
        case bool():
            return "true" if value else "false"
        case float() if not math.isfinite(value):
            return {math.inf: "inf", -math.inf: "-inf"}.get(value, "nan")
        case list():
            return f"[{', '.join(toml(part) for part in value)}]"
        case str():
            return json.dumps(value, ensure_ascii=False)
    return repr(value)


def outcome(content, filename):
    """The scene that *content* describes, or the error that refuses it; anything else is a crash."""
    try:
        return parse(content, filename)
    except SimulationError as error:
        return error


@few_and_many(25, 50)
def test_a_random_document_is_a_world_that_runs_or_is_refused(examples):
    counts = {"worlds": 0, "refused": 0}

    @settings(max_examples=examples)
    @given(documents())
    def check(text):
        found = outcome(text.encode(), "random.toml")
        if isinstance(found, SimulationError):
            counts["refused"] += 1
            assert found.message.startswith("random.toml")
            assert "\n" not in found.message
        else:
            counts["worlds"] += 1
            world = World(found)
            world.step()
            assert all(math.isfinite(pose.x + pose.y + pose.heading) for pose in world.poses)

    check()
    if examples >= 80:  # of fewer, all may be worlds by chance
        assert min(counts.values()) >= examples / 10, counts


TEXTS = [files("elib").joinpath(WORLDS, f"{name}.toml").read_bytes() for name in gallery()]
SCRAPS = (b"[", b'"', b"\n", b"=", b"]]", b"-", b"1e9", b"'''", b"#")


@st.composite
def damaged(draw):
    content = bytearray(draw(st.sampled_from(TEXTS)))
    for _ in range(draw(st.integers(1, 4))):
        place, length = draw(st.integers(0, len(content))), draw(st.integers(1, 40))
        part = content[place : place + length]
        match draw(st.sampled_from(["lose", "double", "turn", "insert"])):
            case "lose":
                del content[place : place + length]
            case "double":
                content[place:place] = part
            case "turn":
                content[place : place + length] = part[::-1]
            case _:
                content[place:place] = draw(st.sampled_from(SCRAPS))
    return bytes(content)


@few_and_many(60, 120)
def test_a_damaged_world_is_a_world_or_refused(examples):
    counts = {Scene: 0, SimulationError: 0}

    @settings(max_examples=examples)
    @given(damaged())
    def check(content):
        found = outcome(content, "broken.toml")
        counts[type(found)] += 1
        if isinstance(found, SimulationError):
            assert found.message.startswith("broken.toml")

    check()
    if examples >= 200:
        assert min(counts.values()) >= examples / 14, counts
