"""Worlds of other simulators: what is flat stands in its place, what is not is named with its line."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from elib.base.errors import ArgumentError, SimulationError
from elib.simulator.physics import Colour, Scene, World
from elib.simulator.worlds.files import parse
from elib.simulator.worlds.importing import READERS, read_world
from elib.simulator.worlds.importing.plan import MAX_PARTS
from elib.simulator.worlds.writer import written_scene
from lanes import few_and_many

WEBOTS = """#VRML_SIM R2023b utf8
EXTERNPROTO "webots://E-puck.proto"
WorldInfo { title "A room" }
RectangleArena { translation 1 2 0 floorSize 2 1 }
DEF BLOCK Solid {
  translation 1.5 2.2 0.05 rotation 0 0 1 0.5
  children [ Shape { appearance PBRAppearance { baseColor 1 0 0 } geometry DEF SHAPE Box { size 0.2 0.1 0.1 } } ]
  name "block" boundingObject USE SHAPE physics Physics { mass 0.3 }
}
Transform { translation 0.5 2 0 children [
  Solid { translation 0 0 0.1 boundingObject Cylinder { radius 0.05 height 0.2 }
    children [ PointLight { location 0 0 0.3 } ] }
] }
Solid { rotation 1 0 0 0.7 name "leaning" boundingObject Box { size 0.1 0.1 0.1 } }
Solid { children [ HingeJoint { } ] }
Solid { translation 0 0 -0.05 boundingObject Box { size 9 9 0.1 } }
E-puck { translation 1.2 1.8 0 rotation 0 0 1 1.5708 }
"""

OLDER = """#VRML_SIM R2019a utf8
RectangleArena { floorSize 2 1 }
Solid { translation 0.5 0.05 0.2 rotation 0 1 0 0.5 boundingObject Box { size 0.2 0.1 0.3 } }
E-puck { translation -0.5 0 0.1 }
"""

PLAYGROUND = """<!DOCTYPE aseba-playground>
<aseba-playground>
  <description>A
    room.</description>
  <color name="sky" r="0" g="0.5" b="1"/>
  <world w="100" h="80" groundTexture="floor.png"/>
  <wall x="50" y="40" l1="20" l2="2" h="10" angle="1.5" color="sky" mass="200"/>
  <cylinder x="20" y="20" r="3" h="5"/>
  <door closedX="80" closedY="40" openedX="80" openedY="60" l1="2" l2="10" h="10" name="gate"/>
  <feeder x="10" y="10"/>
  <robot type="e-puck" x="30" y="60" angle="0.5"/>
  <robot type="thymio2" x="70" y="60" name="Tim"/>
</aseba-playground>
"""

ARGOS = """<?xml version="1.0" ?>
<argos-configuration>
  <framework><experiment random_seed="5"/></framework>
  <loop_functions library="x"/>
  <arena size="4, 2, 1" center="1,0,0.5">
    <box id="wall" size="1,0.1,0.5" movable="false"><body position="1,0.5,0" orientation="90,0,0"/></box>
    <cylinder id="can" radius="0.1" height="0.2" movable="true" mass="2">
      <body position="2,-0.5,0" orientation="0,0,0"/></cylinder>
    <box id="tilted" size="1,1,1"><body position="0,0,0" orientation="0,30,0"/></box>
    <light id="lamp" position="0,0,0.4" intensity="3"/>
    <floor source="loop_functions"/>
    <distribute>
      <position method="uniform" min="-1,-1,0" max="0,1,0"/>
      <orientation method="uniform" min="0,0,0" max="360,0,0"/>
      <entity quantity="6" max_trials="100"><foot-bot id="fb"><controller config="c"/></foot-bot></entity>
    </distribute>
    <distribute>
      <position method="grid" center="0,0,0"/>
      <orientation method="constant" values="0,0,0"/>
      <entity quantity="3"><box id="b" size="0.1,0.1,0.1"/></entity>
    </distribute>
  </arena>
</argos-configuration>
"""

STAGE = """include "robots.inc"
include "missing.inc"
define floorplan model ( boundary 1 color "gray30" )
floorplan ( name "map" size [4 2 0.5] pose [0 0 0 0] bitmap "cave.png" )
define block3 model ( size [1 0.5 0.4]
  block ( points 3 point[0] [0 0] point[1] [2 0] point[2] [0 1] z [0 1] ) )
block3 ( pose [1 0 0 90] color "red" )
model ( pose [-1 0 0] size [0.2 0.4] color_rgba [0 0 1 1] )
puck ( pose [-1 0.5 0] size [0.1 0.1] )
model ( name "ghost" obstacle_return 0 )
pioneer ( name "r0" pose [0 -0.5 0 45] laser() )
laser ( pose [0 0 0] )
"""


def imported(folder: Path, name: str, text: str) -> tuple[Scene, dict[int, str]]:
    """Return the world of a file as its world file opens, and the remarks by their line."""
    path = folder / name
    path.write_text(text)
    plan = read_world(path)
    scene = parse(written_scene(plan.scene(folder), plan.about).encode(), str(folder / "world.toml"))
    return scene, dict(plan.remarks)


def test_solids_lights_and_robots_of_webots_stand_where_they_stood(tmp_path):
    scene, remarks = imported(tmp_path, "room.wbt", WEBOTS)
    assert (scene.width, scene.depth) == (2, 1)
    (box,) = scene.boxes
    assert (box.x, box.y, box.width, box.depth, box.height) == pytest.approx((1.5, 0.7, 0.2, 0.1, 0.1))
    assert box.angle == pytest.approx(0.5)
    assert (box.colour, box.is_pushable, box.mass, box.name) == (Colour(255, 0, 0), True, 0.3, "block")
    (post,), (lamp,), (start,) = scene.cylinders, scene.lights, scene.starts
    assert (post.x, post.y, post.radius, post.height) == pytest.approx((0.5, 0.5, 0.05, 0.2))
    assert (lamp.x, lamp.y, lamp.height) == pytest.approx((0.5, 0.5, 0.4))
    assert (start.x, start.y, start.heading) == pytest.approx((1.2, 0.3, math.pi / 2), abs=1e-4)
    assert remarks == {
        14: 'Solid "leaning" is left out: its Box is tilted',
        15: "HingeJoint is left out",
    }


def test_before_r2022a_up_is_y_and_robots_look_along_minus_z(tmp_path):
    scene, remarks = imported(tmp_path, "old.wbt", OLDER)
    assert (scene.width, scene.depth, remarks) == (2, 1, {})
    (box,), (start,) = scene.boxes, scene.starts
    assert (box.x, box.y, box.width, box.depth, box.height) == pytest.approx((1.5, 0.3, 0.2, 0.3, 0.1))
    assert box.angle == pytest.approx(0.5)
    assert (start.x, start.y, start.heading) == pytest.approx((0.5, 0.4, math.pi / 2))


def test_a_turn_of_a_world_that_webots_converted_keeps_boxes_upright(tmp_path):
    solid = (
        "Solid { translation 0 0 0.1 rotation 0.57735 0.57735 0.57735 2.0944 boundingObject Box { size 0.3 0.2 0.1 } }"
    )
    scene, remarks = imported(
        tmp_path, "w.wbt", f"#VRML_SIM R2022a utf8\nRectangleArena {{ }}\nE-puck {{ translation 0.3 0 0 }}\n{solid}"
    )
    (box,) = scene.boxes
    # x became y, y became z, z became x
    assert (box.width, box.depth, box.height) == pytest.approx((0.3, 0.1, 0.2), abs=1e-4)
    assert abs(box.angle) == pytest.approx(math.pi / 2, abs=1e-4)
    assert not remarks


def test_an_upright_block_of_faces_becomes_a_polygon_and_other_faces_are_named(tmp_path):
    points = "0 0 0, 0.4 0 0, 0 0.2 0, 0 0 0.1, 0.4 0 0.1, 0 0.2 0.1"
    faces = "2 1 0 -1 3 4 5 -1 0 1 4 3 -1 1 2 5 4 -1 2 0 3 5 -1"
    shape = f"IndexedFaceSet {{ coord Coordinate {{ point [ {points} ] }} coordIndex [ FACES ] }}"
    block = f'Solid {{ name "wedge" boundingObject {shape} }}\n'
    good, bad = (block.replace("FACES", each) for each in (faces, "0 1 4 -1 0 2 5"))
    scene, remarks = imported(
        tmp_path,
        "w.wbt",
        f"#VRML_SIM R2023b utf8\nFloor {{ size 2 2 }} E-puck {{ translation 0.9 0.9 0 }}\n{good}{bad}",
    )
    (polygon,) = scene.polygons
    assert np.array(sorted(polygon.points)) == pytest.approx(np.array([(1, 1), (1, 1.2), (1.4, 1)]))
    assert polygon.height == pytest.approx(0.1)
    assert remarks == {4: 'Solid "wedge" is left out: its IndexedFaceSet is no upright block with one outline'}


def test_floors_of_webots_are_painted_the_lowest_first_and_a_round_arena_is_walled(tmp_path):
    Image.new("RGB", (8, 8), (200, 0, 0)).save(tmp_path / "red.png")
    text = """#VRML_SIM R2023b utf8
CircleArena { radius 0.5 }
Solid { translation 0 0 0.001
  children [ Shape { appearance PBRAppearance { baseColor 0 1 0 } geometry Plane { size 0.2 0.4 } } ] }
Solid { children [
  Shape { appearance Appearance { texture ImageTexture { url "red.png" } } geometry Plane { size 1 1 } } ] }
Solid { children [
  Shape { appearance Appearance { texture ImageTexture { url "https://x/y.png" } } geometry Plane { } } ] }
"""
    scene, remarks = imported(tmp_path, "w.wbt", text)
    world = World(scene)
    assert len(scene.walls) == 64
    assert min(wall.distance(0.5, 0.5) for wall in scene.walls) == pytest.approx(0.5, abs=0.001)
    picture, patch = scene.paint
    assert picture.file == str((tmp_path / "red.png").resolve())
    assert (patch.x, patch.y, patch.width, patch.depth) == pytest.approx((0.4, 0.3, 0.2, 0.4))
    assert world.robots == 1
    assert list(remarks) == [8, 0]


def test_a_playground_is_taken_from_centimetres_and_grams(tmp_path):
    Image.new("RGB", (4, 4)).save(tmp_path / "floor.png")
    scene, remarks = imported(tmp_path, "room.playground", PLAYGROUND)
    assert (scene.width, scene.depth) == (1, 0.8)
    wall, door = scene.boxes
    assert (wall.x, wall.y, wall.width, wall.depth, wall.height) == pytest.approx((0.5, 0.4, 0.2, 0.02, 0.1))
    assert (wall.angle, wall.mass, wall.colour) == (1.5, 0.2, Colour(0, 128, 255))
    assert (door.x, door.y, door.is_pushable) == (0.8, 0.4, False)
    assert [(post.x, post.radius) for post in scene.cylinders] == [(0.2, 0.03)]
    assert [(pose.x, pose.y, pose.heading) for pose in scene.starts] == [(0.3, 0.6, 0.5), (pytest.approx(0.7), 0.6, 0)]
    assert len(scene.paint) == 1
    assert remarks == {
        9: 'door "gate" stays closed',
        10: "feeder is left out",
        12: 'thymio2 "Tim" becomes an e-puck',
    }


def test_an_experiment_of_argos_is_moved_to_its_corner_and_draws_what_it_distributes(tmp_path):
    scene, remarks = imported(tmp_path, "run.argos", ARGOS)
    assert (scene.width, scene.depth) == (4, 2)
    (wall,), (can,), (lamp,) = scene.boxes, scene.cylinders, scene.lights
    assert (wall.x, wall.y, wall.angle) == pytest.approx((2, 1.5, math.pi / 2))
    assert can.name == "can"
    assert (can.x, can.y, can.mass, lamp.intensity) == (3, 0.5, 2, 3)
    assert len(scene.starts) == 6
    assert all(pose.x <= 1 for pose in scene.starts)
    assert scene == imported(tmp_path, "run.argos", ARGOS)[0]
    assert remarks == {
        4: "what loop_functions do is left out: they are a program",
        9: 'box "tilted" is left out: it is tilted',
        11: "the floor is left out: a program paints it",
        15: "6 of 6 x foot-bot are placed at random, not where ARGoS places them",
        20: "3 x box are left out: their distribution is not known",
    }


def test_models_of_stage_are_stretched_turned_and_coloured(tmp_path):
    (tmp_path / "robots.inc").write_text("define pioneer position ( size [0.4 0.3] )\n")
    scene, remarks = imported(tmp_path, "cave.world", STAGE)
    assert (scene.width, scene.depth) == (4, 2)
    (polygon,), (box,), (start,) = scene.polygons, scene.boxes, scene.starts
    assert np.array(polygon.points) == pytest.approx(np.array([(3.25, 0.5), (3.25, 1.5), (2.75, 0.5)]))
    assert (polygon.height, polygon.colour) == (pytest.approx(0.4), Colour(255, 0, 0))
    assert (box.x, box.y, box.width, box.depth, box.colour) == (1, 1, 0.2, 0.4, Colour(0, 0, 255))
    assert (start.x, start.y, start.heading) == pytest.approx((2, 0.5, math.pi / 4))
    missing = "No such file or directory"
    assert remarks == {
        2: f'include "missing.inc" is left out: the world {tmp_path}/missing.inc cannot be read: {missing}',
        4: 'model "map" is left out: elib takes no walls from a picture, "cave.png"',
        9: "puck is left out",
        10: 'model "ghost" is left out: robots drive through it',
        11: 'position "r0" becomes an e-puck',
        12: "laser is left out",
    }


def test_blocks_of_stage_2_are_read_too(tmp_path):
    corners = "block[0].point[0] [0 0] block[0].point[2] [0 1] block[0].point[1] [1 0]"
    text = f"size [2 2] model ( blocks 1 block[0].points 3 {corners} block[0].z [0 0.2] pose [0.5 0 0] )"
    scene, _ = imported(tmp_path, "w.world", text)
    assert np.array(scene.polygons[0].points) == pytest.approx(np.array([(1, 0.5), (2, 0.5), (1, 1.5)]))


def test_what_elib_cannot_place_is_named_and_the_rest_stays(tmp_path):
    text = """<aseba-playground><world w="50" h="50"/>
<robot type="e-puck" x="25" y="25"/>
<robot type="e-puck" x="26" y="25"/>
<robot type="e-puck" x="10" y="10"/>
<cylinder x="70" y="25" r="3" h="5"/>
<cylinder x="40" y="25" r="0" h="5"/>
<cylinder x="40" y="40" r="3" h="0.05"/>
</aseba-playground>"""
    scene, remarks = imported(tmp_path, "w.playground", text)
    assert len(scene.starts) == 2
    assert not scene.cylinders
    assert remarks[3] == "a robot is left out: it stands on another one: robot[0]"
    assert remarks[5] == "a cylinder at (0.7, 0.25) is left out: it is not on the floor"
    assert remarks[6].startswith("cylinder is left out: the cylinder's radius is 0.0")
    assert remarks[7] == "cylinder is left out: robots drive over it"


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("w.wbt", "Solid { }", "w.wbt:1: it does not begin with #VRML_SIM"),
        ("w.wbt", "#VRML_SIM R2023b utf8\nSolid {\n name 'x'", "w.wbt:3: unexpected 'x'"),
        ("w.wbt", "#VRML_SIM R2023b utf8\nSolid {\n children [", "w.wbt:3: the file ends in the midst of a node"),
        ("w.wbt", '#VRML_SIM R2023b utf8\nSolid {\n name "x', "w.wbt:3: a text in quotes does not end"),
        ("w.wbt", "#VRML_SIM R2023b utf8\nUSE NOTHING", "w.wbt:2: unexpected USE"),
        ("w.wbt", "#VRML_SIM R2023b utf8\nA { b 1e300 }", 'w.wbt:2: "1e300" is not a number'),
        (
            "w.wbt",
            "#VRML_SIM R2023b utf8\n" + "Group { children [ " * 60,
            "w.wbt:2: the world is nested more than 50 deep",
        ),
        ("w.wbt", "#VRML_SIM R2023b utf8\n", "w.wbt: there is nothing in it that elib can take"),
        ("w.playground", "<aseba-playground>", "w.playground:1: this is not XML: no element found"),
        ("w.playground", "PK\x03\x04", "w.playground:1: this is not XML: not well-formed"),
        ("w.playground", "<html/>", "w.playground:1: it begins with <html>"),
        ("w.playground", "<aseba-playground/>", "w.playground:1: it has no <world>"),
        (
            "w.playground",
            '<aseba-playground><world w="x" h="1"/></aseba-playground>',
            'w.playground:1: "x" is not a number',
        ),
        (
            "w.playground",
            '<aseba-playground><world w="5" h="5"/></aseba-playground>',
            "w.playground: the world's width is 0.05",
        ),
        ("w.argos", "<argos-configuration/>", "w.argos:1: it has no <arena>"),
        (
            "w.argos",
            '<argos-configuration>\n<arena size="1,2"/></argos-configuration>',
            "w.argos:2: size of arena has 2 numbers",
        ),
        ("w.world", "model (", "w.world:1: model has no closing bracket"),
        ("w.world", "model ( ) )", "w.world:1: unexpected )"),
        ("w.world", 'include "w.world"', "w.world:1: the world is nested more than 50 deep"),
        ("w.txt", "", "is no world of a simulator that elib can read"),
    ],
)
def test_what_cannot_be_read_is_one_error_with_file_and_line(tmp_path, name, text, message):
    with pytest.raises((SimulationError, ArgumentError)) as caught:
        imported(tmp_path, name, text)
    assert message in str(caught.value)


def test_entities_are_refused_before_they_grow(tmp_path):
    bomb = '<!DOCTYPE a [\n<!ENTITY a "aaaaaaaaaa">\n<!ENTITY b "&a;&a;&a;&a;&a;">]>\n<a>&b;</a>'
    with pytest.raises(SimulationError, match=r"w\.playground:2: it declares entities"):
        imported(tmp_path, "w.playground", bomb)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (
            "w.wbt",
            "#VRML_SIM R2023b utf8\nDEF A0 Group { }\n"
            + "".join(f"DEF A{n} Group {{ children [ {f'USE A{n - 1} ' * 10}] }}\n" for n in range(1, 12)),
        ),
        ("w.world", f"define m model ( {' '.join(f'k{n} 1' for n in range(5000))} )\n" + "m()\n" * 5000),
        ("w.playground", "<aseba-playground>" + "<a/>" * (MAX_PARTS + 1)),
    ],
)
def test_what_grows_when_it_is_repeated_ends_at_a_limit(tmp_path, name, text):
    with pytest.raises(SimulationError, match=f"made of more than {MAX_PARTS} parts"):
        imported(tmp_path, name, text)


def test_a_crowded_distribution_ends(tmp_path):
    crowded = ARGOS.replace('quantity="6"', 'quantity="100000"').replace('max="0,1,0"', 'max="-0.9,-0.9,0"')
    scene, remarks = imported(tmp_path, "w.argos", crowded)
    assert len(scene.starts) < 10
    assert "of 100000 x foot-bot" in remarks[15]


WORDS = {
    ".wbt": [
        *WEBOTS.split(),
        *OLDER.split(),
        "IndexedFaceSet { coord Coordinate { point [ 0 0 0 ] } coordIndex [ 0 1 ] }",
    ],
    ".playground": PLAYGROUND.split("<"),
    ".argos": ARGOS.split("<"),
    ".world": STAGE.split(),
}
WHOLE = {".wbt": WEBOTS, ".playground": PLAYGROUND, ".argos": ARGOS, ".world": STAGE}
ODD = st.sampled_from(
    ["-1", "0", "1e9", "nan", "1e-7", "{", "}", "[", "]", "(", ")", '"', "<", "/>", "DEF A", "USE SHAPE", "NULL"]
)


@st.composite
def files(draw):
    """A file of one of the formats in which words are lost, doubled, moved, or odd ones stand."""
    ending = draw(st.sampled_from(sorted(READERS)))
    if draw(st.integers(0, 3)) == 0:
        return ending, draw(st.text(max_size=200))
    gap = "<" if ending in (".playground", ".argos") else " "
    words = WHOLE[ending].replace("\n", " \n ").split(gap)
    for _ in range(draw(st.integers(1, 6))):
        at = draw(st.integers(0, len(words) - 1))
        match draw(st.integers(0, 3)):
            case 0:
                del words[at : at + draw(st.integers(1, 3))]
            case 1:
                words.insert(at, draw(ODD))
            case 2:
                words.insert(at, draw(st.sampled_from(WORDS[ending])))
            case _:
                words[at] = words[at].replace(draw(st.sampled_from("0123456789.")), draw(ODD))
        words = words or [""]
    return ending, gap.join(words)


@few_and_many(150, 1500)
def test_any_text_gives_a_world_that_opens_or_one_error(tmp_path, examples):
    @settings(max_examples=examples, deadline=None)
    @given(files())
    def check(file):
        ending, text = file
        path = tmp_path / f"any{ending}"
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        try:
            plan = read_world(path)
            scene = plan.scene(tmp_path)
        except (SimulationError, ArgumentError):
            return
        parse(written_scene(scene, plan.about).encode(), str(tmp_path / "any.toml"))

    check()
