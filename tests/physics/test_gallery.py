"""The worlds that come with elib: each is what it says it is for."""

import math
from collections import deque
from dataclasses import replace

import pytest
from world_rig import IDEAL

from elib.simulator.physics import Colour, Pose, Scene, World
from elib.simulator.physics.body import RADIUS
from elib.simulator.physics.fittings import Patch, Stripe
from elib.simulator.physics.floor import floor_of
from elib.simulator.worlds.files import gallery, load_file

WORLDS = "arena beeper billiard charger claps corridor crowd foraging light line maze red-boxes soccer square".split()
CELL = 0.05
RED = Colour(0xD0, 0x20, 0x20)


def test_the_gallery_has_these_worlds():
    assert gallery() == WORLDS


@pytest.mark.parametrize("name", WORLDS)
def test_every_world_says_in_a_sentence_what_it_is_for(name):
    about = load_file(name).about
    assert 30 < len(about) < 90
    assert about.endswith(".")


@pytest.mark.parametrize("name", WORLDS)
def test_every_world_runs_with_its_own_robots_and_with_a_dozen(name):
    scene = Scene.load(name)
    assert World(scene).robots == len(scene.starts) >= 1
    world = World.load(name, robots=12)
    assert world.robots == 12
    world.run(2)


@pytest.mark.parametrize("name", [name for name in WORLDS if name != "crowd"])
def test_robots_start_with_room_to_turn_and_to_see(name):
    scene = Scene.load(name)
    world = World(scene)
    for i, start in enumerate(scene.starts):
        assert wall_distance(scene, start.x, start.y) > RADIUS + 0.05
        assert max(world.proximity(i)) < 1000


def wall_distance(scene, x, y):
    """From a place to the nearest wall, m."""
    nearest = min(x, y, scene.width - x, scene.depth - y)
    for wall in scene.surfaces:
        dx, dy = wall.x2 - wall.x1, wall.y2 - wall.y1
        share = min(1.0, max(0.0, ((x - wall.x1) * dx + (y - wall.y1) * dy) / (dx * dx + dy * dy)))
        nearest = min(nearest, math.hypot(x - wall.x1 - share * dx, y - wall.y1 - share * dy))
    return nearest


def way(scene, goal, room):
    """The shortest way from the first robot to *goal* that keeps *room* to the walls: places 5 cm apart."""
    start = (round(scene.starts[0].x / CELL * 2), round(scene.starts[0].y / CELL * 2))
    end = (round(goal[0] / CELL * 2), round(goal[1] / CELL * 2))
    came, left = {start: start}, deque([start])
    while left:
        here = left.popleft()
        if here == end:
            break
        for step in ((2, 0), (-2, 0), (0, 2), (0, -2)):
            there = (here[0] + step[0], here[1] + step[1])
            if there not in came and wall_distance(scene, there[0] * CELL / 2, there[1] * CELL / 2) >= room:
                came[there] = here
                left.append(there)
    assert end in came, "there is no way"
    found = [end]
    while found[-1] != start:
        found.append(came[found[-1]])
    return [(x * CELL / 2, y * CELL / 2) for x, y in reversed(found)]


@pytest.mark.parametrize(("name", "goal", "shortest"), [("maze", (1.3, 1.3), 3.0), ("corridor", (1.475, 0.625), 3.0)])
def test_a_robot_drives_through_without_touching_a_wall(name, goal, shortest):
    scene = Scene.load(name)
    places = way(scene, goal, 2 * RADIUS)  # Everywhere there is room for two robots side by side.
    assert (len(places) - 1) * CELL > shortest
    world = World(scene)
    for x, y in places[1:]:
        pose = world.pose(0)
        turn = math.remainder(math.atan2(y - pose.y, x - pose.x) - pose.heading, math.tau)
        spin(world, turn)
        world.set_wheel_speeds(0, 0.1, 0.1)
        while math.hypot(x - world.pose(0).x, y - world.pose(0).y) > 0.005:
            world.step()
            assert not world.touching(0)
    assert math.dist((world.pose(0).x, world.pose(0).y), goal) < 0.01
    assert any(
        isinstance(paint, Patch) and 0 < goal[0] - paint.x < paint.width and 0 < goal[1] - paint.y < paint.depth
        for paint in scene.paint
    )


def test_the_ground_sensors_see_the_rim_of_the_golden_square_whichever_way_the_robot_comes():
    world = World.load("maze")
    world.move_robot(0, Pose(1.1, 1.1, 0.0))
    pale = min(min(world.ground(0)[:3]) for _ in range(50) if world.run(1) is None)
    for pose in (Pose(1.185, 1.3, 0.0), Pose(1.3, 1.185, math.pi / 2)):
        world.move_robot(0, pose)
        assert max(max(world.ground(0)[:3]) for _ in range(50) if world.run(1) is None) < pale - 100


def spin(world, turn):
    heading = world.pose(0).heading + turn
    while abs(error := math.remainder(heading - world.pose(0).heading, math.tau)) > 1e-3:
        rim = error * 0.0265 / world.scene.step
        speed = min(0.1, abs(rim)) * math.copysign(1, rim)
        world.set_wheel_speeds(0, -speed, speed)
        world.step()


def test_three_boxes_are_red_and_give_way_and_nothing_else_is_red():
    scene = Scene.load("red-boxes")
    red = [box for box in scene.boxes if box.colour == RED]
    assert len(red) == 3
    assert all(box.is_pushable and box.mass < 0.15 for box in red)
    others = [thing for thing in (*scene.boxes, *scene.cylinders) if thing.colour != RED]
    assert len(others) >= 3
    for thing in others:
        assert thing.colour.red < 2 * max(thing.colour.green, thing.colour.blue)


def test_a_robot_pushes_a_red_box():
    world = World.load("red-boxes")
    box = world.scene.boxes[0]
    world.move_robot(0, Pose(box.x - 0.12, box.y, 0.0))
    world.set_wheel_speeds(0, 0.1, 0.1)
    world.run(128)
    moved = world.snapshot().boxes[0]
    assert moved.x > box.x + 0.05
    assert world.pose(0).x > box.x - 0.07


def test_the_line_is_closed_wide_enough_for_the_ground_sensors_and_gentle():
    scene = Scene.load("line")
    assert scene.model.ground_module
    (stripe,) = scene.paint
    assert isinstance(stripe, Stripe)
    assert stripe.points[0] == stripe.points[-1]
    for x, y in stripe.points:
        assert wall_distance(scene, x, y) > 0.08
    corners = [*stripe.points, stripe.points[1]]
    for before, here, after in zip(corners, corners[1:], corners[2:], strict=False):
        assert bend(before, here, after) > 0.1


def bend(a, b, c):
    """Radius of the circle through three places, m."""
    area = abs((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])) / 2
    return math.dist(a, b) * math.dist(b, c) * math.dist(c, a) / (4 * area) if area else math.inf


def test_the_robot_starts_on_the_line_and_looks_along_it():
    scene = Scene.load("line")
    floor = floor_of(scene)
    start = scene.starts[0]
    for ahead in (-0.03, 0.0, 0.03):
        x, y = start.x + ahead * math.cos(start.heading), start.y + ahead * math.sin(start.heading)
        pixel = floor.pixels[int(y * floor.scale) * floor.columns + int(x * floor.scale)]
        assert pixel == 0x101010
    aside = floor.pixels[int(start.y * floor.scale) * floor.columns + int((start.x + 0.05) * floor.scale)]
    assert aside == floor.colour


def test_the_crowd_always_has_as_much_room():
    for robots in (None, 1, 7, 500):
        world = World.load("crowd", robots=robots)
        area = world.scene.width * world.scene.depth
        assert world.robots / area == pytest.approx(10)
    assert World.load("crowd").robots == 20


def test_both_sides_of_the_soccer_field_are_the_same():
    scene = Scene.load("soccer")

    def across(x, y):
        return pytest.approx((scene.width - x, scene.depth - y))

    for one, other in ((0, 2), (1, 3)):
        a, b = scene.starts[one], scene.starts[other]
        assert (a.x, a.y) == across(b.x, b.y)
        assert abs(math.remainder(a.heading - b.heading, math.tau)) == pytest.approx(math.pi)
    for box in scene.boxes:
        assert any((box.x, box.y) == across(other.x, other.y) for other in scene.boxes)
    (ball,) = scene.cylinders
    assert (ball.x, ball.y) == across(ball.x, ball.y)
    assert ball.is_pushable
    assert {box.name for box in scene.boxes} == {"", "blue goal", "yellow goal"}


def test_a_robot_shoots_a_goal():
    world = World(replace(Scene.load("soccer"), model=IDEAL))
    world.move_robot(0, Pose(0.7, 0.5, 0.0))
    world.move_robot(2, Pose(1.4, 0.9, 0.0))
    world.set_wheel_speeds(0, 0.12, 0.12)
    world.run(int(13 / world.scene.step))
    assert world.snapshot().cylinders[0].x > 1.6


def test_the_lamps_are_seen_and_the_screen_throws_a_shadow():
    world = World.load("light")
    screen = world.scene.boxes[0]
    bright, dim = world.scene.lights
    assert bright.intensity > dim.intensity
    dark = 4 * RADIUS
    dx, dy = bright.x - screen.x, bright.y - screen.y
    length = math.hypot(dx, dy)
    behind = Pose(screen.x - dx / length * dark, screen.y - dy / length * dark, math.atan2(dy, dx))
    world.move_robot(0, behind)
    shaded = min(world.ambient_light(0))
    world.move_robot(0, Pose(screen.x + dx / length * dark, screen.y + dy / length * dark, math.atan2(dy, dx)))
    assert min(world.ambient_light(0)) < shaded - 500  # Less is brighter.
