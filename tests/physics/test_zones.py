"""What has a state in a world: zones, energy, doors, pucks, switches and pens."""

from dataclasses import replace

import pytest
from world_rig import IDEAL

from elib.base.errors import ArgumentError, SimulationError
from elib.simulator.emulator.battery import volts_at
from elib.simulator.emulator.simulated_hardware import SimulatedHardware
from elib.simulator.emulator.simulation import as_scene
from elib.simulator.physics import Box, Colour, Cylinder, Episodes, EpuckModel, Light, Pose, Scene, Sound, Task, World
from elib.simulator.physics.fittings import Energy, Zone
from elib.simulator.physics.geometry import Polygon
from elib.simulator.worlds.files import parse
from elib.simulator.worlds.writer import written_scene

ROOM = Scene(1.0, 0.6, starts=(Pose(0.2, 0.3),), model=replace(IDEAL, ground_module=True))
PLATE = Zone("plate", 0.4, 0.3, 0.05)
DOOR = Box(0.6, 0.3, 0.02, 0.2, name="door", switch="plate", slide=(0.0, 0.2), takes=0.5)
DISC = Cylinder(0.3, 0.3, 0.02, name="disc", is_pushable=True, mass=0.02)


def happened(world, *kinds):
    return [(each.kind, each.what, each.robot) for each in world.events if not kinds or each.kind in kinds]


def driven(scene, seconds, speed=0.1, engine="interpreted", world=None):
    world = world or World(scene, engine=engine)
    for robot in range(world.robots):
        world.set_wheel_speeds(robot, speed, speed)
    world.run(round(seconds / world.scene.step))
    return world


@pytest.mark.parametrize(
    "zone",
    [
        PLATE,
        Zone("plate", 0.4, 0.3, width=0.1, depth=0.1),
        Zone("plate", points=((0.35, 0.2), (0.45, 0.2), (0.45, 0.4), (0.35, 0.4))),
        Zone("plate", points=((0.4, 0.1), (0.4, 0.5)), band=0.1),
    ],
)
def test_a_robot_enters_and_leaves_a_zone_of_any_shape_where_it_begins_and_ends(zone, engine):
    world = driven(replace(ROOM, zones=(replace(zone, score=2, rate=3),)), 3, engine=engine)
    assert happened(world) == [
        ("enter", "plate", 0),
        ("on", "plate", None),
        ("leave", "plate", 0),
        ("off", "plate", None),
    ]
    assert [each.time for each in world.events] == pytest.approx([1.5, 1.5, 2.5, 2.5], abs=0.04)
    assert world.score() == world.score(0) == pytest.approx(2 + 3, abs=0.1)
    assert world.zones_of(0) == ()
    assert world.poses[0].x == pytest.approx(0.5, abs=0.005)


def test_the_dark_parts_of_a_picture_are_a_zone(tmp_path):
    from PIL import Image

    picture = Image.new("RGBA", (10, 10), (0, 0, 0, 0))  # what is transparent is light
    picture.paste((20, 20, 20, 255), (5, 0, 10, 10))
    picture.save(tmp_path / "half.png")
    zone = Zone("half", 0.4, 0.3, width=0.2, depth=0.2, file=str(tmp_path / "half.png"))
    events = driven(replace(ROOM, zones=(zone,)), 4).events
    assert [each.time for each in events if each.robot == 0] == pytest.approx([2.0, 3.0], abs=0.05)


def test_a_robot_without_energy_stands_and_a_charger_gives_until_its_store_is_empty(engine):
    charger = Zone("charger", 0.9, 0.3, 0.2, energy=1.0, store=0.3, refill=0.05)
    scene = replace(ROOM, energy=Energy(0.0, start=0.3, driving=1.0), zones=(charger,))
    world = driven(scene, 4, engine=engine)
    assert happened(world, "empty") == [("empty", "", 0)]
    assert world.energy(0) == 0.0
    assert world.pose(0).x == pytest.approx(0.5, abs=0.005)
    assert world.encoders(0)[0] > 0
    world.move_robot(0, Pose(0.9, 0.3, 1.57))
    world.set_wheel_speeds(0, 0.0, 0.0)
    world.run(64)
    assert world.energy(0) == pytest.approx(0.35, abs=0.01)  # what it had, and what came back meanwhile
    assert world.zones[0].store == pytest.approx(0.0, abs=0.01)
    world.reset()
    assert (world.energy(0), world.zones, world.events) == (0.3, scene.zones, ())


def test_a_door_opens_for_a_robot_on_a_plate_and_waits_for_one_in_its_way(engine):
    scene = replace(ROOM, zones=(replace(PLATE, stays=True),), boxes=(DOOR,))
    world = driven(scene, 5, engine=engine)
    assert happened(world, "open", "closed") == [("open", "door", None)]
    assert world.snapshot().boxes[0].y == pytest.approx(0.5)
    assert world.pose(0).x == pytest.approx(0.7, abs=0.01)  # it came through
    world.move_robot(0, Pose(0.6, 0.3))
    world.set_wheel_speeds(0, 0.0, 0.0)
    world.switch("plate", False)
    world.run(128)
    assert happened(world, "open", "closed") == [("open", "door", None)]
    assert world.pose(0) == Pose(0.6, 0.3)
    world.move_robot(0, Pose(0.8, 0.3))
    world.run(64)
    assert happened(world, "closed") == [("closed", "door", None)]


def test_a_closed_door_stops_a_robot_and_a_key_opens_it_that_is_pushed_into_its_zone():
    lock = replace(PLATE, by="disc", stays=True)
    shut = driven(replace(ROOM, zones=(replace(PLATE, y=0.1),), boxes=(DOOR,)), 5)
    assert shut.pose(0).x == pytest.approx(0.59 - 0.037, abs=0.002)
    world = driven(replace(ROOM, zones=(lock,), boxes=(replace(DOOR, slide=(0, 0), swing=-1.5),), cylinders=(DISC,)), 3)
    assert happened(world, "on", "open") == [("on", "plate", None), ("open", "door", None)]


@pytest.mark.parametrize("way", [{"slide": (5e-324, 0.0)}, {"slide": (0.0, 0.0), "swing": 5e-324}])
def test_a_door_may_open_by_next_to_nothing(way):
    world = World(replace(ROOM, zones=(replace(PLATE, x=0.2),), boxes=(replace(DOOR, **way),)))
    world.run(64)
    assert happened(world, "open") == [("open", "door", None)]


def test_a_puck_that_comes_into_a_nest_earns_points_and_comes_back_in_its_field(engine):
    nest, field = Zone("nest", 0.6, 0.3, 0.05), Zone("field", 0.2, 0.1, width=0.2, depth=0.1)
    puck = replace(DISC, collect="nest", score=5, respawn="field", after=0.5)
    world = driven(replace(ROOM, zones=(nest, field), cylinders=(puck,), seed=4), 4.5, engine=engine)
    (collected,) = [each for each in world.events if each.kind == "collect"]
    (back,) = [each for each in world.events if each.kind == "respawn"]
    assert (collected.what, collected.robot, world.score()) == ("disc", 0, 5)
    assert back.time == pytest.approx(collected.time + 0.5, abs=0.05)
    found = world.snapshot().cylinders[0]
    assert 0.1 < found.x < 0.3
    assert 0.05 < found.y < 0.15


BLOCK = Box(0.7, 0.3, 0.2, 0.2)
FIELD = Zone("field", 0.7, 0.3, width=0.1, depth=0.1)
FOOD = replace(DISC, collect="robots")
BACK = replace(FOOD, respawn="field")


@pytest.mark.parametrize("block", [{"boxes": (BLOCK,)}, {"polygons": (Polygon(BLOCK.corners),)}])
def test_a_puck_does_not_come_back_inside_of_a_fixed_block(block):
    world = driven(replace(ROOM, zones=(FIELD,), cylinders=(BACK,), **block), 1.5)
    assert happened(world, "collect", "respawn") == [("collect", "disc", 0)]


def test_a_puck_comes_back_where_a_fixed_block_stood_before():
    world = driven(replace(ROOM, zones=(FIELD,), cylinders=(BACK,), boxes=(BLOCK,)), 1.5)
    world.move_box(0, Pose(0.7, 0.5))
    world.run(1)
    assert happened(world, "collect", "respawn") == [("collect", "disc", 0), ("respawn", "disc", None)]


def test_food_is_eaten_by_touch_and_gone_for_good():
    scene = replace(ROOM, cylinders=(replace(FOOD, energy=0.25),), energy=Energy(0.0, start=0.5))
    world = driven(scene, 4)
    assert happened(world) == [("collect", "disc", 0)]
    assert world.energy(0) == 0.75
    assert not world.touching(0)
    assert as_scene(world).cylinders == ()


def test_events_name_what_they_were_about_whatever_comes_and_goes_after_them():
    world = driven(replace(ROOM, zones=(replace(PLATE, x=0.2),), boxes=(DOOR,), cylinders=(FOOD,)), 1.5)
    then, before = world.moment(), world.events
    assert {each.what for each in before} == {"plate", "door", "disc"}
    world.add_box(Box(0.9, 0.1, 0.1, 0.1, is_pushable=True, name="crate"))
    world.remove_box(0)
    assert world.events == before
    world.go_back(then)
    world.run(1)
    assert world.events[: len(before)] == before
    world.reset()
    assert world.events == ()


def test_lamps_and_sounds_follow_their_zone():
    lit = {"lights": (Light(0.4, 0.4, switch="plate"),), "sounds": (Sound(0.4, 0.4, switch="plate"),)}
    world = World(replace(ROOM, zones=(Zone("plate"),), **lit))

    def now():
        heard, seen = world.microphones(0)[3], world.ambient_light(0)[1:]
        return heard, min(seen), world.snapshot().lights[0].intensity, world.snapshot().sounds[0].volume

    dark = now()
    world.switch("plate", True)
    world.run(1)
    lit_now = now()
    assert dark[2:] == (0.0, 0.0)
    assert lit_now[2:] == (1.0, 1000.0)
    assert lit_now[0] > dark[0] + 100
    assert lit_now[1] < dark[1] - 100
    with pytest.raises(ArgumentError, match="no zone 'plat'"):
        world.switch("plat", True)


def test_ground_sensors_see_what_a_pen_drew_until_it_is_lifted():
    scene = replace(ROOM, pens=(Colour(0, 0, 0),), floor=Colour(255, 255, 255))
    world = driven(scene, 1)
    assert world.ground(0)[1] > 900
    world.move_robot(0, Pose(0.2 - 0.030 + 0.05, 0.3))
    assert world.ground(0)[1] < 400
    world.set_pen(0, None)
    driven(scene, 1, world=world)
    drawn = world._state.inked()
    assert drawn.pixels[120 * drawn.columns + 110] == 0
    assert drawn.pixels[120 * drawn.columns + 150] == 0xFFFFFF
    with pytest.raises(ArgumentError, match="no robot of this world has a pen"):
        World(ROOM).set_pen(0, None)


def test_a_world_goes_back_to_what_zones_doors_and_energies_were_and_is_saved_as_it_is():
    scene = replace(ROOM, zones=(replace(PLATE, stays=True),), boxes=(DOOR,), energy=Energy(0.0, driving=0.5))
    world = driven(scene, 1)
    before, then = world.hash(), world.moment()
    driven(scene, 2, world=world)
    saved = as_scene(world)
    assert (saved.zones[0].is_on, saved.boxes, saved.energies) == (True, scene.boxes, (world.energy(0),))
    assert loaded(world).snapshot().boxes[0].y == pytest.approx(world.snapshot().boxes[0].y)
    world.go_back(then)
    assert (world.zones[0].is_on, world.snapshot().boxes[0].y) == (False, 0.3)
    assert world.energy(0) == pytest.approx(1 - 0.05, abs=0.002)
    world.reset()
    assert driven(scene, 1, world=world).hash() == before


def loaded(world):
    """Return a world that begins with what is saved of one."""
    return World(parse(written_scene(as_scene(world)).encode(), "world.toml"))


def test_a_world_is_saved_while_a_robot_stands_in_an_open_doorway():
    scene = replace(ROOM, zones=(replace(PLATE, is_on=True, stays=True),), boxes=(DOOR,))
    world = World(replace(scene, starts=(Pose(0.6, 0.3),)))
    assert loaded(world).snapshot() == world.snapshot()


def test_a_world_is_saved_while_a_door_waits_for_a_robot_in_its_way():
    world = World(replace(ROOM, zones=(replace(PLATE, x=0.2),), boxes=(DOOR,)))
    world.run(64)
    world.move_robot(0, Pose(0.6, 0.3))
    world.run(64)
    again = loaded(world)
    for each in (world, again):
        each.run(64)
    assert again.snapshot().zones == world.snapshot().zones == (replace(PLATE, x=0.2),)
    assert again.snapshot().boxes == world.snapshot().boxes != (DOOR,)
    assert again.pose(0) == world.pose(0) == Pose(0.6, 0.3)


def test_a_puck_that_is_away_is_saved_in_its_field_while_robots_stand_where_it_began():
    scene = replace(
        ROOM, zones=(FIELD,), cylinders=(replace(BACK, after=60.0), replace(BACK, y=0.25, name="", after=60))
    )
    world = driven(scene, 1)
    first, second = loaded(world).snapshot().cylinders
    assert all(FIELD.x - 0.05 <= puck.x <= FIELD.x + 0.05 for puck in (first, second))
    assert first.distance(second.x, second.y) > second.radius
    world.move_robot(0, Pose(0.9, 0.5))
    assert loaded(world).snapshot().cylinders == scene.cylinders


def test_a_world_is_saved_whose_key_was_collected_for_good():
    world = driven(replace(ROOM, zones=(replace(PLATE, by="disc"),), cylinders=(FOOD,)), 2)
    again = loaded(world)
    again.run(1)
    assert (again.snapshot().cylinders, again.zones) == ((), (replace(PLATE, by=""),))
    assert again.zones_of(0) == ("plate",)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[[zone]]\nname = "a"', None),
        ('[[zone]]\nname = "a"\n[[zone]]\nname = "a"', r"x.toml:6: zone\[1\].name is \"a\""),
        (
            '[[zone]]\nname = "a"\nposition = [0.1, 0.1]',
            r'x.toml:4: zone\[0\].name is "a": the zone has a position, but no radius and no size',
        ),
        ('[[zone]]\nname = "a"\nradius = 0.1', "the zone has a radius or size, but no position"),
        (
            '[[zone]]\nname = "a"\nposition = [1.3, 0.5]\nradius = 0.2',
            r"x.toml:5: zone\[0\].position puts all of the zone outside the arena of 1 x 1 m",
        ),
        (
            '[[zone]]\nname = "a"\npoints = [[0, -1], [1, -1], [1, -0.1]]',
            r"x.toml:5: zone\[0\].points puts all of the zone outside the arena",
        ),
        ('[[zone]]\nname = "a"\npoints = [[0, 0], [1, 1]]', r"x.toml:5: zone\[0\].points has too few corners"),
        ('[[zone]]\nname = "a"\nband = 0.1', r"x.toml:5: zone\[0\].band is of a stripe"),
        (
            '[[zone]]\nname = "a"\nby = "key"',
            r"x.toml:5: zone\[0\].by is \"key\", which is no thing that can",
        ),
        ('[[light]]\nposition = [0.1, 0.1]\nswitch = "a"', r"x.toml:5: light\[0\].switch is \"a\", which is no zone"),
        (
            '[[box]]\nposition = [0.1, 0.1]\nsize = [0.1, 0.1]\nswitch = "a"',
            r"x.toml:6: box\[0\].switch makes it a",
        ),
        ('[[cylinder]]\nposition = [0.1, 0.1]\nradius = 0.1\ncollect = "robots"', r"x.toml:6: .* makes it a puck"),
        (
            "[[sound]]\nposition = [0.1, 0.1]\nevery = 1e-320",
            r"x.toml:5: sound\[0\].every is 1e-320 s; it must be 0, or",
        ),
        ("[energy]\nstart = 1", "x.toml:3: energy.idle is missing"),
        ("[[robot]]\nposition = [0.3, 0.3]\nenergy = 50", r"x.toml:5: robot\[0\].energy is 50"),
    ],
)
def test_a_mistake_in_a_file_is_named_with_its_line(text, said):
    content = f"[arena]\nsize = [1.0, 1.0]\n{text}".encode()
    if said is None:
        parse(content, "x.toml")
        return
    with pytest.raises(SimulationError, match=said):
        parse(content, "x.toml")


def test_the_battery_of_a_virtual_robot_follows_its_energy():
    world = World(replace(ROOM, energy=Energy(0.1)))
    hardware = SimulatedHardware(world)
    full = hardware.voltage
    world.run(8 * 64)
    assert (full, hardware.voltage) == (4.2, volts_at(world.energy(0)))
    assert world.energy(0) == pytest.approx(0.2, abs=0.01)


def earned(world, i):
    robot = world.robots[i]
    return robot.score + robot.energy + robot.zones


@pytest.mark.long
def test_episodes_leave_nothing_of_their_states_to_the_next_on_either_engine():
    scene = replace(
        ROOM,
        zones=(replace(PLATE, score=2, stays=True), Zone("field", 0.7, 0.3, 0.1)),
        boxes=(DOOR,),
        cylinders=(replace(DISC, collect="robots", respawn="field"),),
        energy=Energy(0.01, driving=0.2),
        model=EpuckModel(ground_module=True),
        pens=(Colour(0, 0, 0),),
    )
    task = Task("states", "Earn points.", (scene,), earned, sensors=("ground",), period=6 / 64)
    found = []
    for engine in ("interpreted", "compiled"):
        episodes = Episodes(task, engine=engine)
        for seed in (5, 9, 5):
            episodes.reset(seed)
            found.append([float(episodes.step([[[0.1, 0.1]]])[0, 0]) for _ in range(30)])
    assert found[0] == found[2] == found[3] == found[5]
    assert found[1] == found[4] != found[0]
