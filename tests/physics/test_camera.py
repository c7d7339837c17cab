"""The camera: what stands where appears where it should, as large as it should."""

import dataclasses
import math
import random

import numpy as np
import pytest
from camera_rig import NOTHING, Cameras, showing, window
from world_rig import IDEAL

from elib.base.body import FOCAL, LENS, camera_view
from elib.base.errors import ArgumentError
from elib.simulator.physics import Box, Colour, Cylinder, EpuckModel, Pose, Scene, Wall, World
from elib.simulator.physics.fittings import Checkers, Light, Patch, Stripe
from elib.simulator.physics.geometry import WALL_HEIGHT
from elib.simulator.physics.optics import ABOVE, LENSES
from lanes import short

RED, BLUE, WHITE = Colour(255, 0, 0), Colour(0, 0, 255), Colour(255, 255, 255)
CHIP = window(640, 480, 1)
SMALL = window(40, 40, 8)


def red(picture):
    """Return where the picture is red, rows x columns."""
    return (picture[:, :, 0] > 100) & (picture[:, :, 1] < 40) & (picture[:, :, 2] < 40)


def scene(*things, pose=None, size=4.0, **more):
    """Return a scene of *things* with a robot at *pose*, at (1, 1) if none is given."""
    kinds = {Box: "boxes", Cylinder: "cylinders", Wall: "walls", Light: "lights", Pose: "starts"}
    parts = {name: tuple(thing for thing in things if isinstance(thing, kind)) for kind, name in kinds.items()}
    parts["starts"] = (pose or Pose(1, 1), *parts["starts"])
    return Scene(size, size, **parts, **more)


def seen(*things, at=CHIP, lamps=NOTHING, ambient=None, **more):
    return Cameras(scene(*things, **more), lamps=lamps).picture(*at, ambient=ambient)


def crowd(seed, robots=8, walls=12, size=1.5):
    """Return a room full of things of all heights and colours."""
    draw = random.Random(seed)

    def colour():
        return Colour(*(draw.randrange(40, 256) for _ in range(3)))

    def place():
        return draw.uniform(0.1, size - 0.1), draw.uniform(0.1, size - 0.1)

    segments = []
    for _ in range(walls):
        x, y = place()
        angle = draw.uniform(0, math.pi)
        end = x + 0.2 * math.cos(angle), y + 0.2 * math.sin(angle)
        segments.append(Wall(x, y, *end, draw.uniform(0.01, 0.15), colour()))
    posts = tuple(Cylinder(*place(), 0.02, draw.uniform(0.01, 0.15), colour()) for _ in range(5))
    boxes = tuple(Box(*place(), 0.08, 0.05, draw.uniform(0, 3), 0.02 + 0.02 * k, colour()) for k in range(5))
    starts = tuple(Pose(*place(), draw.uniform(-math.pi, math.pi)) for _ in range(robots))
    return Scene(size, size, walls=tuple(segments), boxes=boxes, cylinders=posts, starts=starts, model=IDEAL)


def test_the_whole_chip_sees_47_degrees_as_measured_and_webots_48_in_52_columns_of_8():
    assert math.degrees(camera_view(640, 1)) == pytest.approx(47)
    assert 2 * math.atan(52 * 8 / 2 / LENSES["webots"]) == pytest.approx(0.84)


@pytest.mark.parametrize(
    ("columns", "zoom", "degrees"),
    [(52, 8, 31.6), (40, 8, 24.5), (40, 4, 12.4), (40, 1, 3.1), (80, 8, 47.0), (160, 4, 47.0), (60, 8, 36.1)],
)
def test_a_windows_field_of_view_is_as_measured_to_a_pixel(columns, zoom, degrees):
    half, pixel = 1.5 * math.tan(math.radians(degrees) / 2), 1.5 * zoom / FOCAL
    for margin, all_red in ((0.6 * pixel, True), (-0.6 * pixel, False)):
        screen = Wall(2.53, 1 - half - margin, 2.53, 1 + half + margin, colour=RED)
        row = red(seen(screen, at=window(columns, 2, zoom)))[0]
        assert row.all() == all_red
        assert row[1:-1].all()


def test_another_lens_sees_as_much_more_as_it_says():
    post = Cylinder(1.5 + LENS, 1, 0.05, colour=RED)
    wide = Cameras(scene(post), lens="webots").picture(*CHIP)
    narrow = Cameras(scene(post)).picture(*CHIP)
    widths = [np.ptp(np.nonzero(red(picture))[1]) + 1 for picture in (wide, narrow)]
    assert widths[0] / widths[1] == pytest.approx(LENSES["webots"] / FOCAL, abs=0.02)


@pytest.mark.parametrize(("depth", "aside"), [(0.5, 0.0), (0.2, 0.04), (1.0, -0.3)])
def test_a_box_has_its_edges_where_the_pinhole_says(depth, aside):
    box = Box(1 + LENS + depth + 0.05, 1 - aside, 0.1, 0.08, height=0.08, colour=RED)
    rows, columns = np.nonzero(red(seen(box)))
    # The front face: of a box beside the axis a side may be seen, too, but only towards the axis.
    near_edge = aside + math.copysign(0.04, aside)
    ends = (columns.max(), columns.min()) if aside >= 0 else (columns.min(), columns.max())
    assert ends[0] == pytest.approx(319.5 + FOCAL * near_edge / depth, abs=1)
    inner = aside - math.copysign(0.04, aside)
    hidden = inner / (depth + 0.1 if inner * aside > 0 else depth)
    assert ends[1] == pytest.approx(319.5 + FOCAL * hidden, abs=1)
    assert rows.min() == pytest.approx(239.5 - FOCAL * (0.08 - ABOVE) / depth, abs=1)
    assert rows.max() == pytest.approx(239.5 + FOCAL * ABOVE / depth, abs=1)


@pytest.mark.parametrize("heading", [0.0, 2.0, -1.2])
def test_left_is_left_whatever_the_heading(heading):
    ahead, left = 0.4, 0.1
    x = 2 + ahead * math.cos(heading) - left * math.sin(heading)
    y = 2 + ahead * math.sin(heading) + left * math.cos(heading)
    mask = red(seen(Cylinder(x, y, 0.03, colour=RED), pose=Pose(2, 2, heading)))
    middle = 319.5 - FOCAL * left / (ahead - LENS)
    assert np.nonzero(mask)[1].mean() == pytest.approx(middle, abs=2)


def test_a_cylinder_is_as_wide_as_its_tangents():
    depth, radius = 0.3, 0.04
    columns = np.nonzero(red(seen(Cylinder(1 + LENS + depth, 1, radius, colour=RED))))[1]
    half = FOCAL * radius / math.sqrt(depth * depth - radius * radius)
    assert columns.max() == pytest.approx(319.5 + half, abs=1)
    assert columns.min() == pytest.approx(319.5 - half, abs=1)


def test_a_near_thing_hides_a_far_one_and_a_low_one_only_its_foot():
    far = Box(2.0, 1, 0.1, 0.4, height=0.3, colour=RED)
    near = Box(1.5, 1, 0.1, 0.8, height=0.1, colour=BLUE)
    both, alone = red(seen(near, far)), red(seen(far))
    assert 0 < both.sum() < alone.sum()
    assert np.nonzero(both)[0].max() == pytest.approx(239.5 - FOCAL * (0.1 - ABOVE) / 0.42, abs=1)
    high = Box(1.5, 1, 0.1, 0.8, height=0.5, colour=BLUE)
    assert not red(seen(high, far)).any()


@pytest.mark.parametrize("reverse", [False, True])
def test_the_nearest_wins_in_whatever_order_things_are_named(reverse):
    posts = [Cylinder(1.4 + 0.1 * k, 1, 0.03, 0.05, RED if k == 0 else BLUE) for k in range(5)]
    picture = seen(*(posts[::-1] if reverse else posts))
    assert red(picture)[:, 320].any()
    assert not (picture[:, 320, 2] > picture[:, 320, 0].astype(int) + 60).any()


def test_between_low_things_the_floor_is_seen_and_behind_them_the_wall():
    kerbs = [Wall(1.2 + 0.1 * k, 0.5, 1.2 + 0.1 * k, 1.5, 0.004, RED) for k in range(4)]
    column = red(seen(*kerbs))[:, 320]
    edges = np.nonzero(np.diff(column.astype(int)))[0]
    assert len(edges) == 8  # Four kerbs, each with floor below and above.
    depths = [0.2 + 0.1 * k - LENS for k in range(4)]
    assert sorted(edges[1::2], reverse=True) == pytest.approx([239.5 + FOCAL * ABOVE / d for d in depths], abs=1)


def test_of_very_many_low_things_the_nearest_are_seen():
    kerbs = [Wall(1.2 + 0.05 * k, 0.5, 1.2 + 0.05 * k, 1.5, 0.002, RED) for k in range(40)]
    both, few = red(seen(*kerbs)), red(seen(*kerbs[:4]))
    foot = int(239.5 + FOCAL * ABOVE / (0.375 - LENS))  # Between the fourth and the fifth.
    assert (both[foot:] == few[foot:]).all()
    assert few[foot:].any()


def test_what_is_behind_is_not_seen():
    assert not red(seen(Cylinder(0.5, 1, 0.1, colour=RED), Box(0.8, 1, 0.1, 3, colour=RED))).any()


def test_another_robot_is_seen_and_the_robot_itself_is_not():
    alone, pair = seen(size=2.0), seen(Pose(1.5, 1), size=2.0)
    columns = np.nonzero((alone != pair).any(axis=2))[1]
    half = FOCAL * 0.037 / math.sqrt(0.47**2 - 0.037**2)
    assert (columns.min(), columns.max()) == pytest.approx((319.5 - half, 319.5 + half), abs=1)
    assert (alone == Cameras(Scene(2, 2, starts=(Pose(1, 1),), model=IDEAL)).picture(*CHIP)).all()


def test_the_ring_of_another_robot_lies_around_41_mm():
    picture = seen(Pose(1.3, 1)).astype(int)[:, 320]
    green = np.nonzero((picture[:, 1] > picture[:, 0] + 25) & (picture[:, 1] > picture[:, 2] + 25))[0]
    depth = 0.3 - 0.037 - LENS
    assert green.min() == pytest.approx(239.5 - FOCAL * (0.046 - ABOVE) / depth, abs=1)
    assert green.max() == pytest.approx(239.5 - FOCAL * (0.036 - ABOVE) / depth, abs=1)


def test_the_floor_is_below_the_horizon_and_the_wall_stands_on_it():
    middle = seen(pose=Pose(2, 2)).astype(int)[:, 320]
    depth = 2 - LENS
    top, foot = 239.5 - FOCAL * (WALL_HEIGHT - ABOVE) / depth, 239.5 + FOCAL * ABOVE / depth
    edges = np.nonzero(np.abs(np.diff(middle.sum(axis=1))) > 20)[0]  # Sky to wall, wall to floor.
    assert edges == pytest.approx([top, foot], abs=1)


def test_walls_that_meet_in_a_corner_look_different():
    picture = seen(pose=Pose(1, 1, math.pi / 4), size=1.5).astype(int)
    left, right = picture[235, 200], picture[235, 440]
    assert abs(left.sum() - right.sum()) > 60


def test_a_stripe_on_the_floor_is_where_geometry_says():
    across = Stripe(((1.3, 0.5), (1.3, 1.5)), 0.04, RED)
    rows = np.nonzero(red(seen(paint=(across,), size=2.0))[:, 320])[0]
    near, far = 0.28 - LENS, 0.32 - LENS
    assert rows.max() == pytest.approx(239.5 + FOCAL * ABOVE / near, abs=2)
    assert rows.min() == pytest.approx(239.5 + FOCAL * ABOVE / far, abs=2)
    along = Stripe(((1.0, 0.95), (2.0, 0.95)), 0.02, RED)  # 5 cm to the right: it runs to the vanishing point.
    picture = red(seen(paint=(along,), size=2.0))
    for row in (270, 300, 330):
        depth = FOCAL * ABOVE / (row - 239.5)
        columns = np.nonzero(picture[row])[0]
        assert columns.mean() == pytest.approx(319.5 + FOCAL * 0.05 / depth, abs=FOCAL * 0.002 / depth + 1)


def test_paint_is_hidden_by_what_stands_on_it_and_seen_before_and_behind_low_things():
    paint = (Patch(0, 0, 2, 2, RED),)
    kerb = Wall(1.3, 0.5, 1.3, 1.5, 0.01, BLUE)
    column = red(seen(kerb, paint=paint, size=2.0))[:, 320]
    depth = 0.3 - LENS
    foot, top = 239.5 + FOCAL * ABOVE / depth, 239.5 + FOCAL * (ABOVE - 0.01) / depth
    assert column[math.ceil(foot) + 1 :].all()
    assert not column[math.ceil(top) + 1 : math.floor(foot) - 1].any()
    assert column[math.ceil(239.5 + FOCAL * ABOVE / (1 - LENS)) + 1 : math.floor(top) - 1].all()  # From the wall on.
    assert not column[:200].any()


def test_a_picture_agrees_with_rays_cast_pixel_by_pixel():
    for seed in range(4):
        room = crowd(seed)
        cameras = Cameras(room)
        for robot in range(4):
            near, far = cameras.picture(*SMALL, robot=robot).astype(int), traced(room, robot, *SMALL)
            differs = np.abs(near - far).max(axis=2) > 2
            assert differs.mean() < 0.004  # A pixel whose ray just grazes an edge may fall either way.


def traced(room, robot, right, up):
    """Return a picture found the slow way: every ray against every surface."""
    pose = room.starts[robot]
    cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
    eye = pose.x + LENS * cosine, pose.y + LENS * sine
    picture = np.zeros((len(up), len(right), 3))
    for c, across in enumerate(right):
        ray = cosine + across / FOCAL * sine, sine - across / FOCAL * cosine
        hits = []  # depth, lowest, highest, colour, shade
        for wall in (*room.edge, *room.surfaces):
            span = wall.x2 - wall.x1, wall.y2 - wall.y1
            crossing = ray[0] * span[1] - ray[1] * span[0]
            to_x, to_y = wall.x1 - eye[0], wall.y1 - eye[1]
            depth, part = (to_x * span[1] - to_y * span[0]) / crossing, (to_x * ray[1] - to_y * ray[0]) / crossing
            if depth > 0 and 0 <= part <= 1:
                hits.append((depth, 0, wall.height, wall.colour, 0.78 + 0.2 * span[0] ** 2 / math.hypot(*span) ** 2))
        rounds = [(post.x, post.y, post.radius, ((0, post.height, post.colour),)) for post in room.cylinders]
        body, ring = Colour(58, 62, 66), Colour(148, 196, 140)
        bands = ((0, 0.036, body), (0.036, 0.046, ring), (0.046, 0.050, body))
        rounds += [(other.x, other.y, 0.037, bands) for k, other in enumerate(room.starts) if k != robot]
        for x, y, radius, parts in rounds:
            a, b = ray[0] ** 2 + ray[1] ** 2, (x - eye[0]) * ray[0] + (y - eye[1]) * ray[1]
            under = b * b - a * ((x - eye[0]) ** 2 + (y - eye[1]) ** 2 - radius**2)
            if under > 0 and b > math.sqrt(under):
                shade = 0.6 + 0.4 * math.sqrt(under / a) / radius
                hits += [((b - math.sqrt(under)) / a, *part, shade) for part in parts]
        for r, slope in enumerate(offset / FOCAL for offset in up):
            seen = [hit for hit in hits if hit[1] <= ABOVE + slope * hit[0] <= hit[2]]
            depth, *_, colour, shade = min(seen, default=(math.inf, None, 1.0))
            if slope < 0 and -ABOVE / slope < depth:
                depth, colour, shade = -ABOVE / slope, room.floor, 1.0
            fade = 0.82 + 0.18 / (1 + 2 * depth)
            if colour is None:
                colour, fade = Colour(214, 222, 230), min(1.0, max(0.6, 1 - slope / 2))
            picture[r, c] = [shade * fade * count for count in colour]
    return picture


@pytest.mark.parametrize("seed", short(range(3), 0))
def test_a_mirrored_world_gives_mirrored_pictures(seed):
    room = crowd(seed)
    size = room.depth
    room = dataclasses.replace(room, lights=(Light(0.3, 0.4, 0.05, 0.6),))
    mirrored = dataclasses.replace(
        room,
        walls=tuple(dataclasses.replace(wall, y1=size - wall.y1, y2=size - wall.y2) for wall in room.walls),
        boxes=tuple(dataclasses.replace(box, y=size - box.y, angle=-box.angle) for box in room.boxes),
        cylinders=tuple(dataclasses.replace(post, y=size - post.y) for post in room.cylinders),
        starts=tuple(Pose(pose.x, size - pose.y, -pose.heading) for pose in room.starts),
        lights=tuple(dataclasses.replace(lamp, y=size - lamp.y) for lamp in room.lights),
    )
    ring = {robot: {robot % 8: 0xFF2000, (robot + 3) % 8: 0x00FF00} for robot in range(8)}
    other = {robot: {(8 - led) % 8: colour for led, colour in lit.items()} for robot, lit in ring.items()}
    here, there = Cameras(room, lamps=showing(8, ring)), Cameras(mirrored, lamps=showing(8, other))
    for robot in range(8):
        near, far = (cameras.picture(*SMALL, robot=robot).astype(int) for cameras in (here, there))
        assert (np.abs(near - far[:, ::-1]).max(axis=2) > 1).mean() < 0.002


@pytest.mark.parametrize("heading", [k * math.tau / 16 for k in range(16)])
def test_a_robot_pressed_against_a_wall_or_its_neighbour_sees_only_that(heading):
    for depth in (0.037, 0.0301, 0.03):  # The last: its lens touches the wall.
        pose = Pose(1 - depth, 0.5, heading)
        picture = seen(Pose(1 - depth - 0.07, 0.5), pose=pose, size=1.0, at=SMALL)
        assert picture.shape == (40, 40, 3)
        if heading == 0.0 and depth > 0.03:
            assert (picture[:, 20] == picture[0, 20]).all()


def test_a_lens_within_a_thing_sees_beyond_it():
    inside = seen(Cylinder(1 + LENS, 1, 0.05, colour=RED), Box(1.5, 1, 0.1, 0.1, colour=BLUE))
    assert not red(inside).any()
    assert inside[240, 320, 2] > 150


def test_windows_partly_or_wholly_beside_the_chip_go_on_as_the_pinhole_does():
    across = tuple(range(-900, 900, 10))
    wide = Cameras(scene(Box(1.5, 1, 0.1, 0.3, colour=RED))).picture(across, CHIP[1])
    middle = Cameras(scene(Box(1.5, 1, 0.1, 0.3, colour=RED))).picture(across[60:120], CHIP[1])
    assert (wide[:, 60:120] == middle).all()
    assert Cameras(scene()).picture((5000.0, 6000.0), (4000.0,)).shape == (1, 2, 3)


def test_pictures_of_no_width_or_a_single_pixel_are_taken_too():
    cameras = Cameras(scene(Box(1.5, 1, 0.1, 0.3, colour=RED)))
    assert cameras.picture((), (1.0, 0.0)).shape == (2, 0, 3)
    assert cameras.picture((1.0,), ()).shape == (0, 1, 3)
    assert red(cameras.picture((0.0,), (0.0,))).all()


def test_rows_and_columns_come_in_the_order_asked():
    cameras = Cameras(crowd(5), lamps=showing(8, {2: {9: 1}}))
    right, up = window(30, 20, 8)
    for robot in (0, 2):
        picture = cameras.picture(right, up, robot=robot)
        assert (cameras.picture(right[::-1], up, robot=robot) == picture[:, ::-1]).all()
        assert (cameras.picture(right, up[::-1], robot=robot) == picture[::-1]).all()
        assert (cameras.picture(right[::-1], up[::-1], robot=robot) == picture[::-1, ::-1]).all()


def test_offsets_that_are_uneven_or_no_numbers_are_refused():
    cameras = Cameras(scene())
    with pytest.raises(ArgumentError, match=r"right\[1\] is 1; .* evenly spaced"):
        cameras.picture((0, 1, 5), (0.0,))
    with pytest.raises(ArgumentError, match=r"up.*evenly spaced"):
        cameras.picture((0.0,), (1.0, 1.0))
    with pytest.raises(ArgumentError, match="right holds an offset that is not a finite number"):
        cameras.picture((math.nan,), (0.0,))


def test_a_list_of_offsets_may_change_between_pictures():
    cameras = Cameras(scene(Box(1.5, 1, 0.1, 0.3, colour=RED)))
    right, up = list(SMALL[0]), list(SMALL[1])
    first = cameras.picture(right, up)
    right[:] = [offset + 40 for offset in right]
    assert (cameras.picture(right, up) == cameras.picture(tuple(right), tuple(up))).all()
    assert (cameras.picture(*SMALL) == first).all()


def test_more_windows_than_are_kept_give_the_same_pictures_again():
    cameras = Cameras(crowd(1))
    windows = [window(4 + k, 6, 8) for k in range(20)]
    first = [cameras.picture(*each) for each in windows]
    assert all((cameras.picture(*each) == one).all() for each, one in zip(windows, first, strict=True))


@pytest.mark.usefixtures("compiled_worlds")
@pytest.mark.parametrize("seed", short(range(3), 2))
@pytest.mark.parametrize(
    "at",
    [
        pytest.param(SMALL, id="40x40", marks=pytest.mark.long),
        pytest.param(window(52, 39, 8), id="52x39", marks=pytest.mark.long),
        pytest.param(window(31, 17, 3), id="31x17"),
    ],
)
def test_interpreted_and_compiled_pictures_are_equal_to_the_last_pixel(seed, at):
    room = crowd(seed)
    if seed:
        paint = (Checkers(0.04), Stripe(((0.2, 0.2), (1.0, 1.2)), 0.03, RED), Patch(0.5, 0.5, 0.3, 0.3))
        room = dataclasses.replace(room, paint=paint)
    if seed == 2:
        room = dataclasses.replace(room, lights=(Light(0.3, 0.4, 0.05, 0.6), Light(1.2, 0.7, 0.02, 2.0)))
        room = dataclasses.replace(room, boxes=tuple(dataclasses.replace(box, face="tag:7") for box in room.boxes))
    draw = random.Random(seed)
    lamps = np.array([[draw.randrange(1 << 24 if k < 8 else 2) for k in range(10)] for _ in range(8)])
    slow, fast = Cameras(room, lamps=lamps), Cameras(room, engine="compiled", lamps=lamps)
    for robot in range(8):
        for ambient in (3750.0, 4040.0, 4095.0, 0.0):
            one, two = (cameras.picture(*at, robot=robot, ambient=ambient) for cameras in (slow, fast))
            assert (one == two).all()


@pytest.mark.usefixtures("compiled_worlds")
def test_a_pictures_digest_tells_pictures_apart_and_is_the_same_on_both_engines():
    slow, fast = Cameras(crowd(6)), Cameras(crowd(6), engine="compiled")
    digests = []
    for robot in range(8):
        for cameras in (slow, fast):
            cameras.senses.forget()
            cameras.picture(*SMALL, robot=robot)
        assert slow.senses.told(("picture",)) == fast.senses.told(("picture",))
        digests.append(slow.senses.told(("picture",)))
    assert len(set(digests)) == 8


def test_a_worlds_lens_is_one_of_the_published_ones_and_sets_the_size_of_things():
    def height(lens):
        box = Box(0.5, 0.5, 0.05, 0.05, height=0.05, colour=RED)
        world = World(Scene(1, 1, boxes=(box,), starts=(Pose(0.2, 0.5),), model=EpuckModel(lens=lens, quality="ideal")))
        picture = world.picture(0, *CHIP)
        return int((picture[:, :, 0] > 2 * picture[:, :, 1]).any(axis=1).sum())

    assert height("epucklib") / height("webots") == pytest.approx(601.8 / 465.6, rel=0.03)
    assert height("measured") / height("webots") == pytest.approx(735.9 / 465.6, rel=0.03)
    with pytest.raises(ArgumentError, match="no lens 'fisheye'"):
        World(Scene(1, 1, model=EpuckModel(lens="fisheye", quality="ideal")))
