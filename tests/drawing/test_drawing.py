"""Drawings: complete, legible, the same in both formats, and never in the way of the world."""

import xml.etree.ElementTree as ElementTree
from base64 import b64decode
from io import BytesIO

import pytest
from PIL import Image

from elib.base.errors import ArgumentError
from elib.base.zone import Zone
from elib.simulator.drawing import draw, draw_svg
from elib.simulator.drawing.fittings import LAMP, TONE
from elib.simulator.drawing.floor import PIT
from elib.simulator.drawing.png import render
from elib.simulator.drawing.robot import BODY_LIGHT, FRONT_LIGHT
from elib.simulator.drawing.shapes import Area, Circle, Drawing, Stroke, Text
from elib.simulator.drawing.top import FLOOR, PAPER, TRAIL_HUES, top_view
from elib.simulator.physics import Box, Colour, Cylinder, Lamps, Polygon, Pose, Scene, Wall, World
from elib.simulator.physics.fittings import Light, Patch, Sound, Stripe

SVG = "{http://www.w3.org/2000/svg}"
BLUE = Colour(20, 60, 200)


@pytest.fixture
def world():
    scene = Scene(
        1,
        0.5,
        walls=(Wall(0.1, 0.4, 0.3, 0.4),),
        boxes=(Box(0.7, 0.3, 0.1, 0.1, colour=BLUE),),
        cylinders=(Cylinder(0.5, 0.1, 0.05, colour=Colour(200, 120, 0)),),
        starts=(Pose(0.2, 0.2, 0.5),),
        name="test <room>",
    )
    return World(scene)


def test_the_svg_is_well_formed_and_shows_every_thing_in_its_colour(world):
    root = ElementTree.fromstring(draw_svg(world.snapshot()))
    fills = [element.get("fill") for element in root.iter()]
    assert str(BLUE) in fills
    assert "#c87800" in fills
    assert root.get("viewBox") == f"0 0 {root.get('width')} {root.get('height')}"
    assert len(root.findall(f"{SVG}circle")) > 10


def test_the_caption_names_the_world_and_its_time_and_is_escaped(world):
    world.run(64)
    texts = [element.text for element in ElementTree.fromstring(draw_svg(world.snapshot())).iter(f"{SVG}text")]
    assert "test <room> · 1.0 s" in texts
    assert "20 cm" in texts


def test_an_own_caption_replaces_it(world):
    assert "my own line" in draw_svg(world.snapshot(), caption="my own line")


def test_the_scale_bar_is_as_long_as_it_says(world):
    drawing = top_view(world.snapshot(), (), None, 900)
    label = next(i for i, shape in enumerate(drawing.shapes) if isinstance(shape, Text) and "cm" in shape.text)
    bar = drawing.shapes[label - 3]
    assert isinstance(bar, Stroke)
    assert bar.points[1][0] - bar.points[0][0] == pytest.approx(0.2 * 900)


def test_the_png_has_the_size_of_the_svg_and_the_same_colours_in_the_same_places(world, tmp_path):
    path = tmp_path / "world.png"
    draw(world.snapshot(), path, size=500)
    root = ElementTree.fromstring(draw_svg(world.snapshot(), size=500))
    with Image.open(path) as image:
        assert image.size == (int(root.get("width")), int(root.get("height")))
        margin = round(500 * 0.045)
        assert image.getpixel((margin + 350, margin + 100)) == tuple(BLUE)
        assert image.getpixel((2, 2)) == tuple(PAPER)


def trail():
    return [Pose(0.1 + k / 250, 0.25) for k in range(200)]


def test_a_trail_grows_darker_with_time_and_marks_its_start(world):
    drawing = top_view(world.snapshot(), [trail()], None, 900)
    strokes = [shape for shape in drawing.shapes if isinstance(shape, Stroke) and len(shape.points) > 2]
    light = [sum(shape.colour) for shape in strokes if shape.points[0][1] == strokes[0].points[0][1]]
    assert light == sorted(light, reverse=True)
    assert light[0] > light[-1] + 200
    assert strokes[-2].colour == TRAIL_HUES[0] or strokes[-1].colour == TRAIL_HUES[0]
    assert "start" in [shape.text for shape in drawing.shapes if isinstance(shape, Text)]
    assert any("0.80 m driven" in shape.text for shape in drawing.shapes if isinstance(shape, Text))


@pytest.mark.parametrize("points", [0, 1, 2])
def test_a_trail_of_hardly_any_points_is_drawn_all_the_same(world, points, tmp_path):
    path = tmp_path / "short.png"
    draw(world.snapshot(), path, trails=[trail()[:points]], size=200)
    assert path.stat().st_size > 500


def test_long_trails_are_thinned_to_what_can_be_seen(world):
    few = draw_svg(world.snapshot(), trails=[trail()])
    many = draw_svg(world.snapshot(), trails=[[pose for pose in trail() for _ in range(50)]])
    assert len(many) < 1.1 * len(few)


def test_a_robot_shows_where_it_looks_and_what_it_shines(world):
    dark = render(top_view(world.snapshot(), (), None, 400))
    world.show(0, Lamps(ring=(Colour(255, 0, 0),) + (Colour(0, 0, 0),) * 7, body=True, front=True))
    lit = render(top_view(world.snapshot(), (), None, 400))
    colours = {colour for _, colour in lit.getcolors(1 << 20)} - {colour for _, colour in dark.getcolors(1 << 20)}
    assert tuple(BODY_LIGHT) in colours
    assert any(abs(r - FRONT_LIGHT.red) + abs(g - FRONT_LIGHT.green) < 40 for r, g, _ in colours)
    assert any(r > 200 and g < 90 and b < 90 for r, g, b in colours)


def test_sensor_rays_are_drawn_when_the_snapshot_has_them(world):
    without, with_beams = draw_svg(world.snapshot()), draw_svg(world.snapshot(beams=True))
    assert with_beams.count("<polyline") == without.count("<polyline") + 8


@pytest.mark.parametrize("size", [10, 100_000])
def test_a_size_nobody_can_use_is_refused(world, size):
    with pytest.raises(ArgumentError, match=f"size is {size}"):
        draw_svg(world.snapshot(), size=size)


def test_drawing_does_not_touch_the_world(world):
    before = world.hash()
    draw_svg(world.snapshot(beams=True), trails=[trail()])
    assert world.hash() == before


@pytest.fixture
def furnished():
    scene = Scene(
        1,
        0.5,
        boxes=(Box(0.7, 0.3, 0.1, 0.1, colour=BLUE, is_pushable=True), Box(0.3, 0.1, 0.1, 0.1, colour=BLUE)),
        cylinders=(Cylinder(0.5, 0.1, 0.05, is_pushable=True),),
        lights=(Light(0.2, 0.4, intensity=1), Light(0.9, 0.1, intensity=0)),
        sounds=(Sound(0.5, 0.4),),
    )
    return World(scene)


def fills(world):
    return [element.get("fill") for element in ElementTree.fromstring(draw(world.snapshot())).iter()]


def test_lights_shine_and_sounds_sound_and_what_is_off_is_grey(furnished):
    shown = fills(furnished)
    assert shown.count(str(LAMP)) == 1
    assert shown.count(str(TONE)) == 1
    furnished.set_light(0, Light(0.2, 0.4, intensity=0))
    furnished.set_sound(0, Sound(0.5, 0.4, volume=0))
    dark = fills(furnished)
    assert str(LAMP) not in dark
    assert str(TONE) not in dark
    assert len(dark) < len(shown)


def test_where_two_lights_shine_the_floor_is_no_darker_than_where_one_does(furnished):
    lit = render(top_view(furnished.snapshot(), (), None, 900))
    furnished.set_light(1, Light(0.6, 0.4, intensity=2))
    both = render(top_view(furnished.snapshot(), (), None, 900))
    places = [(40 + 20 * k, 60 + 20 * i) for k in range(40) for i in range(15)]
    blues = [(lit.getpixel(place)[2], both.getpixel(place)[2]) for place in places]
    assert all(second <= first for first, second in blues)
    assert any(second < first for first, second in blues)


def test_what_can_be_pushed_has_a_second_outline(furnished):
    drawing = top_view(furnished.snapshot(), (), None, 900)
    blocks = [shape for shape in drawing.shapes if isinstance(shape, Area) and shape.fill == BLUE]
    assert [shape.outline is not None and sum(shape.outline) > 500 for shape in blocks] == [False, True, False]
    rings = [shape for shape in drawing.shapes if isinstance(shape, Circle) and shape.fill is None]
    assert pytest.approx(min(abs(ring.radius) for ring in rings if ring.radius > 20)) == 0.62 * 0.05 * 900


def test_a_block_of_any_outline_is_filled():
    outline = ((0.2, 0.1), (0.8, 0.1), (0.8, 0.2), (0.3, 0.2), (0.3, 0.4), (0.2, 0.4))
    world = World(Scene(1, 0.5, polygons=(Polygon(outline, colour=BLUE),)))
    drawn = render(top_view(world.snapshot(), (), None, 500))
    margin = round(500 * 0.045)
    for x, y, colour in ((0.25, 0.33, BLUE), (0.65, 0.15, BLUE), (0.65, 0.33, FLOOR)):
        assert drawn.getpixel((margin + round(x * 500), margin + round((0.5 - y) * 500))) == tuple(colour), (x, y)


def test_a_ring_is_open_in_both_formats():
    ring = Drawing(60, 60, PAPER, (Circle((30, 30), 20, None, BLUE, 4),))
    image = render(ring)
    assert image.getpixel((30, 30)) == tuple(PAPER)
    assert image.getpixel((50, 30)) == tuple(BLUE)


def test_a_painted_floor_is_drawn_where_it_lies_in_both_formats():
    red = Colour(255, 0, 0)
    world = World(
        Scene(1, 0.5, paint=(Stripe(((0.0, 0.1), (1.0, 0.1)), width=0.04, colour=red), Patch(0.8, 0.3, 0.1, 0.1)))
    )
    document = draw(world.snapshot(), size=500)
    image = next(ElementTree.fromstring(document).iter(f"{SVG}image"))
    kind, _, data = image.get("href").partition(",")
    assert kind == "data:image/png;base64"
    inner = Image.open(BytesIO(b64decode(data))).convert("RGB")
    drawn = render(top_view(world.snapshot(), (), None, 500))
    margin = round(500 * 0.045)
    for x, y, colour in ((0.5, 0.1, red), (0.5, 0.4, FLOOR), (0.85, 0.35, PIT)):
        assert inner.getpixel((int(x * inner.width), int((1 - y / 0.5) * inner.height))) == tuple(colour)
        assert drawn.getpixel((margin + int(500 * x), margin + int(500 * (0.5 - y)))) == tuple(colour)
    assert float(image.get("width")) == pytest.approx(500, abs=2)


def test_a_floor_of_one_colour_has_it_and_shadows_are_darker(furnished):
    world = World(Scene(1, 0.5, floor=Colour(40, 90, 50), cylinders=(Cylinder(0.5, 0.25, 0.05),)))
    drawing = top_view(world.snapshot(), (), None, 500)
    assert drawing.shapes[0].fill == Colour(40, 90, 50)
    shadow = next(shape for shape in drawing.shapes if isinstance(shape, Circle))
    assert sum(shadow.fill) < sum(drawing.shapes[0].fill)


def test_one_function_draws_every_kind_of_file(world, tmp_path):
    seen = world.snapshot()
    assert draw(seen, tmp_path / "a.SVG") is None
    assert draw(seen, str(tmp_path / "a.png"), size=300) is None
    assert (tmp_path / "a.SVG").read_text() == draw(seen) == draw_svg(seen)
    with Image.open(tmp_path / "a.png") as image:
        assert image.format == "PNG"


@pytest.mark.parametrize("name", ["a.jpg", "a", ".png", ""])
def test_a_file_of_another_kind_is_refused_with_the_kinds_there_are(world, tmp_path, name):
    with pytest.raises(ArgumentError, match=r"must end in \.svg or \.png"):
        draw(world.snapshot(), name)


@pytest.mark.parametrize("size", [360, 900])
@pytest.mark.parametrize("top", [0.5, 0.49, 0.4])
def test_the_name_of_a_zone_does_not_stand_on_the_wall(size: int, top: float) -> None:
    zone = Zone("stop-here", 0.5, 0.25, width=0.1, depth=2 * top - 0.5)
    drawing = top_view(World(Scene(1.0, 0.5)).snapshot(), [], "", size, [zone])
    [name] = [each for each in drawing.shapes if isinstance(each, Text) and each.text == zone.name]
    wall = [each for each in drawing.shapes if isinstance(each, Stroke) and len(each.points) == 5][-1]
    middle = min(y for _, y in wall.points)
    highest, lowest = name.place[1] - 0.75 * name.size, name.place[1] + 0.2 * name.size
    assert highest > 0
    assert lowest < middle - wall.width / 2 or highest > middle + wall.width / 2
