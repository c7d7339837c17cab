"""A robot's hardware in a world: steps become distance, light becomes counts, pictures stand upright after the turn."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from elib.base.body import METRES_PER_STEP
from elib.base.errors import ArgumentError
from elib.link.protocol.camera import CameraWindow
from elib.link.protocol.colours import Hue, coloured
from elib.link.protocol.image import Mounting
from elib.simulator.emulator.build import EPUCK1, EPUCK1_HW13, EPUCK2
from elib.simulator.emulator.hardware import Hardware, Lights
from elib.simulator.emulator.simulated_hardware import SimulatedHardware
from elib.simulator.physics import Box, Colour, EpuckModel, Pose, Scene, World

WINDOW = CameraWindow(mode=1, width=40, height=40, zoom=8, x=160, y=80)
RED, BLUE = Colour(255, 0, 0), Colour(0, 0, 255)
IDEAL = EpuckModel(quality="ideal")
PACES = st.tuples(st.floats(0.0001, 0.05), st.floats(-1000, 1000))


def room(size=4.0, robots=1, **model):
    starts = tuple(Pose(size / 2, size / 4 + k * size / 16) for k in range(robots))
    return World(Scene(size, size, starts=starts, model=EpuckModel(**{"quality": "ideal"} | model)))


def hardware(**options) -> Hardware:
    return SimulatedHardware(room(), **options)  # Typed as the protocol: mypy holds it to every name.


def test_a_step_is_0_1288_mm():
    assert pytest.approx(0.1288e-3, rel=1e-3) == METRES_PER_STEP


@settings(max_examples=60)
@given(st.lists(PACES, max_size=40))
def test_the_way_is_the_steps_issued_however_the_rate_changes_within_ticks(paces):
    world = room()
    robot = SimulatedHardware(world)
    now, steps = 0.0, 0.0
    for seconds, rate in paces:
        robot.advance(now)
        robot.drive(rate, rate)
        now += seconds
        steps += rate * seconds
    robot.advance(now)
    robot.drive(0, 0)
    robot.advance(now + 0.1)
    assert world.pose(0).x - 2 == pytest.approx(steps * METRES_PER_STEP, abs=1e-11)
    assert world.pose(0).heading == 0


@settings(max_examples=60)
@given(st.lists(st.tuples(st.floats(0.0001, 0.05), st.floats(-1000, 1000), st.floats(-1000, 1000)), max_size=40))
def test_the_turn_is_the_difference_of_the_steps_issued(paces):
    world = room()
    robot = SimulatedHardware(world)
    now, difference = 0.0, 0.0
    for seconds, left, right in paces:
        robot.advance(now)
        robot.drive(left, right)
        now += seconds
        difference += (right - left) * seconds
    robot.advance(now)
    robot.drive(0, 0)
    robot.advance(now + 0.1)
    expected = difference * METRES_PER_STEP / 0.053
    assert math.remainder(world.pose(0).heading - expected, math.tau) == pytest.approx(0, abs=1e-9)


@settings(max_examples=30)
@given(st.lists(st.floats(0.0001, 0.3), max_size=30))
def test_how_often_the_world_is_advanced_changes_nothing(pauses):
    often, once = room(), room()
    now = 0.0
    for world in (often, once):
        robot = SimulatedHardware(world)
        robot.drive(300, 500)
    robot = SimulatedHardware(often)
    for pause in pauses:
        now += pause
        robot.advance(now)
    once.run_to(now)
    assert often.hash() == once.hash()


def test_two_robots_share_a_world_that_never_goes_back():
    world = room(robots=2)
    first, second = SimulatedHardware(world, 0), SimulatedHardware(world, 1)
    first.drive(1000, 1000)
    second.drive(500, 500)
    first.advance(2.0)
    assert world.tick == 128
    second.advance(1.0)
    assert world.tick == 128
    second.drive(0, 0)  # Too late for second 1: it acts where the world is.
    first.advance(3.0)
    assert world.pose(0).x - 2 == pytest.approx(3000 * METRES_PER_STEP)
    assert world.pose(1).x - 2 == pytest.approx(1000 * METRES_PER_STEP)


def test_a_robot_switched_on_later_counts_its_own_time():
    world = room(robots=2)
    first = SimulatedHardware(world, 0)
    first.advance(5.0)
    late = SimulatedHardware(world, 1, switched_on=5.0)
    late.advance(0.0)
    late.drive(1000, 1000)
    late.advance(1.0)
    assert world.time == 6.0
    assert world.pose(1).x - 2 == pytest.approx(1000 * METRES_PER_STEP)


def test_a_blocked_robot_stays_and_its_hardware_does_not_mind():
    world = World(Scene(1, 1, starts=(Pose(0.9, 0.5),), model=IDEAL))
    robot = SimulatedHardware(world)
    robot.drive(1000, 1000)
    robot.advance(5.0)
    assert world.pose(0).x == pytest.approx(1 - 0.037)


def test_infrared_counts_come_from_the_world():
    world = World(Scene(1, 1, starts=(Pose(0.94, 0.5),), model=IDEAL))
    robot = SimulatedHardware(world)
    near, dark = robot.reflected_light(), robot.ambient_light()
    assert len(near) == len(dark) == 8
    assert near[0] > 200 < near[7]
    assert max(near[2:6]) < 60
    assert all(3500 < value <= 4095 for value in dark)
    assert all(isinstance(value, int) for value in (*near, *dark))


def test_the_other_readings_are_those_of_a_quiet_lit_room():
    robot = hardware(build=EPUCK1_HW13)
    assert robot.hw13
    assert robot.selector() == 3
    assert len(robot.microphones()) == 4
    assert all(volume < 50 for _, volume in robot.microphones())
    assert len(robot.ground()) == len(robot.ground_ambient()) == 5
    assert not robot.battery_is_low()
    assert not robot.button_is_pressed()
    assert not robot.has_sd_card()
    assert robot.temperature() == 25
    assert (robot.camera_chip, robot.eeprom & 3) == (0x3030, 3)


def test_the_ground_module_is_there_only_if_the_world_says_so():
    assert not SimulatedHardware(room()).floor_present
    assert SimulatedHardware(room(ground_module=True)).floor_present


def test_the_microphone_ring_turns_with_time():
    robot = hardware()
    robot.advance(1.5 / 16384)
    assert robot.microphone_index() == 1
    robot.advance(1.0)
    assert robot.microphone_index() == 84
    robot.advance(0.5)
    assert robot.microphone_index() == 84  # Time never goes back.


@pytest.mark.parametrize(("true", "read"), [(0.1, 118), (0.4, 425), (1.0, 1030)])
def test_the_time_of_flight_sensor_has_the_bias_that_was_measured(true, read):
    world = World(Scene(2, 2, starts=(Pose(2 - 0.034 - true, 1),), model=EpuckModel(quality="ideal", sensor_noise=0)))
    assert SimulatedHardware(world, build=EPUCK2).distance() == read
    assert SimulatedHardware(world, build=EPUCK1).distance() == 0


@pytest.mark.parametrize(("build", "slot"), [(EPUCK1, 1 / 256), (EPUCK1_HW13, 1 / 256), (EPUCK2, 0.0025)])
def test_the_infrared_pairs_take_turns_as_in_the_build(build, slot, monkeypatch):
    slots = {}
    monkeypatch.setattr(World, "set_slot", lambda world, robot, seconds: slots.update({robot: seconds}))
    SimulatedHardware(room(robots=2), 1, build=build)
    assert slots == {1: slot}


def test_lamps_are_shown_to_the_world():
    world = room()
    lights = Lights(ring=[1, 0, 0, 1, 0, 0, 0, 0], rgb=[0, 0, 100, 0, 0, 0, 0, 0, 0, 0, 50, 0], body=1, front=0)
    SimulatedHardware(world).show(lights)
    lamps = world.snapshot().robots[0].lamps
    assert lamps.body
    assert not lamps.front
    assert [any(colour) for colour in lamps.ring] == [True, True, False, True, False, False, False, True]
    assert lamps.ring[1] == BLUE
    assert lamps.ring[7] == Colour(0, 128, 0)


def test_a_missing_robot_and_an_unknown_mounting_are_refused():
    with pytest.raises(ArgumentError, match="no robot 1") as caught:
        SimulatedHardware(room(), 1)
    assert "robots=N" in caught.value.hint
    with pytest.raises(ArgumentError, match="sideways"):
        SimulatedHardware(room(), mounting="sideways")


def decoded(raw, width, height):
    """Return RGB565 bytes as the chip's rows and columns of red, green, blue."""
    words = np.frombuffer(raw, ">u2").reshape(height, width)
    return np.stack(((words >> 8) & 0xF8, (words >> 3) & 0xFC, (words << 3) & 0xF8), axis=2).astype(int)


def turned_by_the_host(picture, mounting):
    """Turn counter-clockwise: destination x = source row, y = width - 1 - source column, for a quarter."""
    turns = {Mounting.UPRIGHT: 0, Mounting.QUARTER_LEFT: 1, Mounting.HALF: 2, Mounting.QUARTER_RIGHT: 3}[mounting]
    for _ in range(turns):
        height, width = picture.shape[:2]
        upright = np.empty((width, height, 3), dtype=int)
        for row in range(height):
            for column in range(width):
                upright[width - 1 - column, row] = picture[row, column]
        picture = upright
    return picture


def scene_with_a_red_box_on_the_left():
    left = Box(1.4, 1.07, 0.1, 0.1, height=0.06, colour=RED)
    right = Box(1.4, 0.93, 0.1, 0.1, height=0.06, colour=BLUE)
    return World(
        Scene(2, 2, boxes=(left, right), starts=(Pose(1, 1),), model=EpuckModel(quality="ideal", sensor_noise=0.0))
    )


@pytest.mark.parametrize("mounting", [Mounting.UPRIGHT, Mounting.QUARTER_LEFT, Mounting.HALF, Mounting.QUARTER_RIGHT])
@pytest.mark.parametrize("size", [(40, 40), (52, 39), (20, 60)])
def test_a_red_box_on_the_left_is_on_the_left_and_below_the_sky_after_the_hosts_turn(mounting, size):
    robot = SimulatedHardware(scene_with_a_red_box_on_the_left(), mounting=mounting)
    width, height = size
    window = CameraWindow(1, width, height, 8, (640 - 8 * width) // 2, (480 - 8 * height) // 2)
    raw = robot.picture(window)
    assert len(raw) == 2 * width * height
    upright = turned_by_the_host(decoded(raw, width, height), mounting)
    rows, columns, _ = upright.shape
    is_red, is_blue = coloured(upright, Hue.RED), coloured(upright, Hue.BLUE)
    assert is_red.any()
    assert is_blue.any()
    assert np.nonzero(is_red)[1].max() < columns / 2 <= np.nonzero(is_blue)[1].min()
    assert upright[0].sum() > upright[-1].sum()  # Sky above, floor below.
    assert np.nonzero(is_red)[0].max() > rows / 2 > np.nonzero(is_red)[0].min()


def test_the_usual_mounting_follows_the_build():
    assert SimulatedHardware(room()).mounting == Mounting.QUARTER_LEFT
    assert SimulatedHardware(room(), build=EPUCK2).mounting == Mounting.UPRIGHT


def test_the_window_and_the_zoom_pick_their_part_of_the_chip():
    robot = SimulatedHardware(scene_with_a_red_box_on_the_left(), mounting=Mounting.UPRIGHT)
    whole = decoded(robot.picture(CameraWindow(1, 640, 480, 1, 0, 0)), 640, 480)
    part = decoded(robot.picture(CameraWindow(1, 50, 40, 1, 130, 200)), 50, 40)
    assert (part == whole[200:240, 130:180]).all()
    coarse = decoded(robot.picture(CameraWindow(1, 40, 40, 9, 140, 60)), 40, 40)
    assert (coarse == whole[64:424:9, 144:504:9]).all()


def test_grey_is_one_luminance_byte_a_pixel():
    robot = SimulatedHardware(scene_with_a_red_box_on_the_left(), mounting=Mounting.UPRIGHT)
    colour = decoded(robot.picture(WINDOW), 40, 40)
    grey = np.frombuffer(robot.picture(CameraWindow(0, 40, 40, 8, 160, 80)), np.uint8).reshape(40, 40)
    expected = colour @ (0.299, 0.587, 0.114)
    assert np.abs(grey - expected).max() < 10  # RGB565 cut up to 7 off.


def test_the_third_mode_carries_the_same_luminance_and_the_colour_beside_it():
    robot = SimulatedHardware(scene_with_a_red_box_on_the_left(), mounting=Mounting.UPRIGHT)
    raw = np.frombuffer(robot.picture(CameraWindow(2, 40, 40, 8, 160, 80)), np.uint8).reshape(40, 40, 2)
    grey = np.frombuffer(robot.picture(CameraWindow(0, 40, 40, 8, 160, 80)), np.uint8).reshape(40, 40)
    assert (raw[:, :, 0] == grey).all()
    colour = decoded(robot.picture(WINDOW), 40, 40)
    is_red = coloured(colour, Hue.RED)
    assert is_red.any()
    assert raw[:, 1::2, 1][is_red[:, 1::2]].min() > 145  # Odd pixels: red difference.
    assert raw[:, 0::2, 1][is_red[:, 0::2]].max() < 128  # Even pixels: blue difference.
