"""What a robot of a world feels and hears, and what is set by hand, in the counts of its firmware."""

import itertools
import math
import statistics

import pytest

from elib.base.body import METRES_PER_STEP
from elib.base.errors import ArgumentError
from elib.base.infrared import ROOM_READING
from elib.simulator.emulator.build import EPUCK1, EPUCK1_HW13, EPUCK2
from elib.simulator.emulator.emulator import Emulator
from elib.simulator.emulator.hardware import Lights
from elib.simulator.emulator.simulated_hardware import SimulatedHardware
from elib.simulator.physics import Box, Colour, EpuckModel, Pose, Scene, World
from elib.simulator.physics.fittings import Light, Sound, Stripe
from elib.simulator.physics.sensors import ground
from lanes import short

QUIET = EpuckModel(quality="ideal", sensor_noise=0, ground_module=True)
FIRMWARES = [("btcom-2.0", EPUCK1), ("asercom-1.2.2", EPUCK1_HW13), ("epuck2", EPUCK2)]


def world(*starts, **things):
    return World(Scene(4, 4, starts=starts or (Pose(2, 2),), **{"model": QUIET, **things}))


def robot(*starts, build=EPUCK1, index=0, **things):
    return SimulatedHardware(world(*starts, **things), index, build=build)


def brake(body):
    """Drive, and stop in the last tick."""
    body.drive(400, 400)
    body.advance(0.5)
    body.drive(0, 0)
    body.advance(0.5 + 1 / 64)
    return body


def curve_left(body):
    body.drive(600, 1000)
    body.advance(1.0)
    return body


# Acceleration and rotation.


def test_a_level_robot_reads_one_g_upwards_in_each_of_its_chips():
    assert robot().acceleration() == (2048, 2048, 2848)
    assert robot(build=EPUCK1_HW13).inertial_acceleration() == (0, 0, 16384)
    assert robot(build=EPUCK2).inertial_acceleration() == (0, 0, -16384)


def test_braking_is_felt_like_a_robot_with_its_front_down():
    felt = 400 * METRES_PER_STEP * 64 / 9.81
    x, y, z = brake(robot(build=EPUCK1)).acceleration()
    assert (x, z) == (2048, 2848)
    assert y == pytest.approx(2048 - 800 * felt, abs=1)
    assert brake(robot(build=EPUCK1_HW13)).inertial_acceleration()[0] == pytest.approx(-16384 * felt, abs=1)
    assert brake(robot(build=EPUCK2)).inertial_acceleration()[1] == pytest.approx(-16384 * felt, abs=1)


def test_a_left_curve_is_felt_to_the_left():
    speed, turn = 800 * METRES_PER_STEP, 400 * METRES_PER_STEP / 0.053
    felt = speed * turn / 9.81
    x, y, _ = curve_left(robot(build=EPUCK1)).acceleration()
    assert x == pytest.approx(2048 + 800 * felt, abs=1)
    assert y == pytest.approx(2048, abs=1)
    assert curve_left(robot(build=EPUCK1_HW13)).inertial_acceleration()[1] == pytest.approx(16384 * felt, rel=0.01)
    assert curve_left(robot(build=EPUCK2)).inertial_acceleration()[0] == pytest.approx(-16384 * felt, rel=0.01)


@pytest.mark.parametrize(("firmware", "build"), FIRMWARES)
@pytest.mark.parametrize(("act", "orientation"), [(brake, 0), (curve_left, 270)])
def test_every_firmware_makes_the_same_axes_of_its_chip(firmware, build, act, orientation):
    body = robot(build=build)
    program = Emulator(firmware, body, baud=0, booted=True).firmware
    level = program.zeroed()
    act(body)
    x, y, z = (after - before for after, before in zip(program.zeroed(), level, strict=True))
    # The firmware's own law: 0 is front down, 270 right down.
    assert math.remainder(math.degrees(math.atan2(x, y)) + 180 - orientation, 360) == pytest.approx(0, abs=3)
    assert math.hypot(x, y) > 5
    assert z == 0


def test_a_bump_into_a_wall_is_felt_and_the_chip_has_an_end():
    body = robot(Pose(3.9, 2))
    body.drive(1000, 1000)
    lowest = highest = 2048
    for tick in range(1, 64):
        body.advance(tick / 64)
        lowest, highest = min(lowest, body.acceleration()[1]), max(highest, body.acceleration()[1])
    assert lowest < 2048 - 400
    assert highest > 2048 + 400
    assert lowest >= 2048 - 1600
    assert highest <= 2048 + 1600


@pytest.mark.parametrize(("build", "scale"), [(EPUCK1_HW13, 1000 / 8.75), (EPUCK2, 131)])
def test_the_gyroscope_turns_positive_to_the_left(build, scale):
    body = robot(build=build)
    assert tuple(body.rotation()) == (0, 0, 0)
    body.drive(-200, 200)
    body.advance(0.5)
    degrees = math.degrees(400 * METRES_PER_STEP / 0.053)
    assert tuple(body.rotation()) == (0, 0, pytest.approx(scale * degrees, abs=1))
    body.drive(200, -200)
    body.advance(1.0)
    assert body.rotation()[2] == pytest.approx(-scale * degrees, abs=1)


def test_the_gyroscope_ends_where_its_chip_does():
    body = robot(build=EPUCK2)
    body.drive(-1000, 1000)
    body.advance(0.5)
    assert body.rotation()[2] == 32767  # 250 degrees/s; the robot turns at 278.


@pytest.mark.parametrize(("firmware", "build"), FIRMWARES[1:])
def test_a_typical_robot_sends_its_tilt_and_the_offsets_of_three_axes_though_its_firmware_calibrates(firmware, build):
    body = robot(build=build, model=EpuckModel(sensor_noise=0, quality="typical"))
    program = Emulator(firmware, body, baud=0, booted=True).firmware
    forward, leftward, up = body.world.acceleration(0)
    read = [axis - zero for axis, zero in zip(program.raw_acceleration(), (2048, 2048, 2048), strict=True)]
    assert [axis / 768 * 9.81 for axis in read] == pytest.approx([leftward, forward, up], abs=0.02)
    assert math.hypot(forward, leftward) > 0.1
    if firmware == "epuck2":
        assert program.zeroed() == pytest.approx(read, abs=1)
    rates = *body.world.rocking(0), body.world.rotation(0)
    counts = [abs(math.degrees(axis)) * build.counts_per_degree for axis in rates]
    assert [abs(axis) for axis in program.rotation()] == pytest.approx(counts, abs=1)
    assert min(counts) > 10


# The magnetic field.


@pytest.mark.parametrize("heading", [0, 1, math.pi / 2, -2.5])
def test_the_magnetic_field_points_north_whichever_way_the_robot_looks(heading):
    forward, left, up = robot(Pose(2, 2, heading)).magnetic_field()
    assert up == pytest.approx(-44, abs=0.1)
    assert math.hypot(forward, left) == pytest.approx(20, abs=0.2)
    north = heading + math.atan2(left, forward)
    assert math.remainder(north - math.pi / 2, math.tau) == pytest.approx(0, abs=0.01)


def test_a_typical_robot_has_magnets_of_its_own_which_turn_with_it_and_noise():
    model = EpuckModel(quality="typical")
    there = [robot(Pose(2, 2, heading), model=model).magnetic_field() for heading in (0, math.pi)]
    # In two opposite directions the earth's field cancels out.
    own = [(one + other) / 2 for one, other in zip(*there, strict=True)]
    assert math.hypot(*own[:2]) > 3
    assert abs(own[2] + 44) > 3
    body = robot(model=model)
    read = []
    for tick in range(300):
        body.advance(tick / 64)
        read.append(body.magnetic_field()[0])
    assert statistics.stdev(read) == pytest.approx(0.7, rel=0.1)


# Light, ground, distance.


def test_a_lamp_is_seen_by_the_sensors_that_face_it():
    lit = robot(Pose(2, 2), lights=(Light(2.0, 2.4, height=0.05),)).ambient_light()
    assert lit[5] < lit[6] < ROOM_READING
    assert lit[2] == ROOM_READING
    assert all(isinstance(value, int) for value in lit)


def test_a_line_is_seen_by_the_ground_sensor_above_it():
    line = Stripe(((0.2, 2.0), (3.8, 2.0)), width=0.012)
    left, centre, right, cliff_left, cliff_right = robot(paint=(line,), floor=Colour(255, 255, 255)).ground()
    assert centre == pytest.approx(ground.BLACK + 0.05 * (ground.WHITE - ground.BLACK), abs=5)  # Painted in 16, 16, 16.
    assert left == right == cliff_left == cliff_right == ground.WHITE


def test_the_distance_sensor_does_not_see_what_is_lower_than_itself():
    low, high = (robot(build=EPUCK2, boxes=(Box(2.5, 2, 0.1, 0.1, height=h),)).distance() for h in (0.03, 0.04))
    assert low > 1500
    assert high == pytest.approx(1000 * (0.45 - 0.034) * 1.06, rel=0.03)


def test_the_distance_sensor_has_a_new_value_as_often_as_a_real_one():
    body = SimulatedHardware(World(Scene(4, 4, starts=(Pose(3, 2),))), build=EPUCK2)
    read = []
    for tick in range(1000):
        body.advance(tick / 100)
        read.append(body.distance())
    changes = [k for k in range(1, 1000) if read[k] != read[k - 1]]
    assert {10, 11} <= {b - a for a, b in itertools.pairwise(changes)}  # in 1/100 s; more where two values are the same
    assert min(b - a for a, b in itertools.pairwise(changes)) == 10
    assert 80 < len(changes) <= 10 / 0.106


# Sound.


def test_the_microphone_that_faces_a_sound_is_the_loudest():
    microphones = robot(sounds=(Sound(2, 2.3),)).microphones()
    assert [base for base, _ in microphones] == [2048] * 4
    volumes = [volume for _, volume in microphones]
    assert volumes.index(max(volumes)) == 1


def test_a_robot_that_plays_is_heard_by_its_neighbour_until_the_sound_ends():
    shared = world(Pose(2, 2), Pose(2.2, 2))
    player, listener = SimulatedHardware(shared, 0), SimulatedHardware(shared, 1)
    silence = listener.microphones()
    player.play_sound(2)  # 0.244 s.
    loud = listener.microphones()
    assert loud[2][1] > 300 > silence[2][1]
    assert player.sound == 2
    listener.advance(0.2)
    assert listener.microphones() == loud
    # It ends though nobody but the listener lets time pass.
    listener.advance(0.3)
    assert listener.microphones() == silence
    player.advance(0.3)
    assert player.sound == 0


@pytest.mark.parametrize("engine", short(["interpreted", "compiled"], "interpreted"))
def test_what_a_robot_of_a_world_plays_ends_when_it_was_told_to(engine):
    both = World(Scene(4, 4, starts=(Pose(2, 2), Pose(2.2, 2)), model=QUIET), engine=engine)
    silence = both.microphones(1)
    both.play(0, 2000.0, until=0.25)
    both.run_to(0.24)
    assert both.microphones(1)[2] > 300
    both.run_to(0.25)
    assert both.microphones(1) == silence
    both.play(0, 2000.0)
    both.run_to(10.0)
    assert both.microphones(1)[2] > 300
    with pytest.raises(ArgumentError, match="until is nan"):
        both.play(0, 1.0, until=math.nan)


def test_a_sound_that_is_stopped_or_started_again_ends_when_it_should():
    body = robot()
    body.play_sound(1)  # 0.293 s.
    body.advance(0.2)
    body.play_sound(1)
    body.advance(0.4)
    assert body.sound == 1
    assert body.microphones()[0][1] > 300
    body.play_sound(0)
    assert body.sound == 0
    assert body.microphones()[0][1] < 50
    body.advance(1.0)
    assert body.microphones()[0][1] < 50


def test_a_tone_of_the_epuck2_goes_on_until_it_is_stopped():
    body = robot(build=EPUCK2)
    body.play_sound(4)
    body.advance(60)
    assert body.sound == 4
    assert body.microphones()[0][1] > 300


# What is done by hand.


def test_the_selector_stands_where_it_was_turned_to():
    body = robot()
    assert body.selector() == 3
    body.turn_selector(10)
    assert body.selector() == 10
    with pytest.raises(ArgumentError, match="from 0 to 15"):
        body.turn_selector(16)


def test_the_button_is_down_while_it_is_held():
    body = robot(build=EPUCK2)
    assert not body.button_is_pressed()
    body.press_button()
    assert body.button_is_pressed()
    body.release_button()
    assert not body.button_is_pressed()


@pytest.mark.parametrize(("build", "before"), [(EPUCK1, 2), (EPUCK2, 0)])
def test_each_press_on_the_remote_control_turns_the_check_bit_over(build, before):
    body = robot(build=build)
    assert body.infrared() == (before, 0, 0)
    body.receive(0, 5)
    assert body.infrared() == (1, 0, 5)
    body.receive(0, 5)
    assert body.infrared() == (0, 0, 5)
    body.receive(8, 2)
    assert body.infrared() == (1, 8, 2)


def test_a_code_that_no_remote_control_sends_is_refused():
    for address, data in ((32, 0), (-1, 0), (0, 64), (0, -1)):
        with pytest.raises(ArgumentError):
            robot().receive(address, data)
    extended = robot(build=EPUCK2)
    extended.receive(31, 127)
    with pytest.raises(ArgumentError, match="data is 128"):
        extended.receive(0, 128)


def test_a_key_of_the_remote_control_drives_the_robot():
    for firmware, build in FIRMWARES:
        body = robot(build=build)
        emulator = Emulator(firmware, body, baud=0, booted=True)
        emulator.advance(0.1)
        body.receive(0, 2)
        emulator.advance(0.2)
        emulator.advance(1.2)
        body.advance(1.2)
        assert body.world.pose(0).x > 2.05, firmware


# The battery.


@pytest.mark.parametrize(("build", "full"), [(EPUCK1, 2560), (EPUCK1_HW13, 2560), (EPUCK2, 3440)])
def test_a_full_battery_reads_as_its_firmware_expects(build, full):
    assert robot(build=build).battery() == full
    assert not robot(build=build).battery_is_low()


def test_a_few_minutes_change_it_only_a_little():
    body = robot(build=EPUCK2)
    body.drive(500, -500)
    body.advance(180.0)
    assert 3440 - 40 <= body.battery() < 3440


def test_a_battery_can_start_anywhere():
    def half():
        return SimulatedHardware(world(), charge=0.5)

    assert half().voltage == pytest.approx(3.79)
    assert half().battery() == pytest.approx(2070 + 490 * 0.39 / 0.8, abs=1)
    assert SimulatedHardware(world(), charge=0.02).battery_is_low()
    assert SimulatedHardware(world()).voltage == 4.2
    for charge in (1.1, -0.1):
        with pytest.raises(ArgumentError, match="from 0 to 1"):
            SimulatedHardware(world(), charge=charge)


def test_motors_and_leds_run_it_down_faster():
    idle, driving, shining = (SimulatedHardware(world(Pose(2, 2)), charge=0.5) for _ in range(3))
    driving.drive(1000, -1000)
    shining.show(Lights(ring=[1] * 8, rgb=[100] * 12, body=1, front=1))
    for body in (idle, driving, shining):
        body.advance(100)
    assert shining.voltage < driving.voltage < idle.voltage < 3.79


def test_the_battery_of_a_fault_script_goes_before_the_robots_own():
    body = SimulatedHardware(world(), build=EPUCK2)
    assert body.battery() == 3440
    body.volts = lambda: 3.3
    assert body.battery() == round(2785 - 655 / 8)
    assert body.battery_is_low()
    body.volts = lambda: None
    assert body.battery() == 3440
    assert not body.battery_is_low()


# All of it.


def readings(body):
    return (
        body.reflected_light(),
        body.ambient_light(),
        body.acceleration(),
        body.rotation(),
        body.ground(),
        body.microphones(),
        body.battery(),
        body.distance(),
    )


def test_the_same_run_gives_the_same_readings_and_no_sensor_disturbs_another():
    def run(ask_all):
        shared = World(Scene(4, 4, starts=(Pose(2, 2), Pose(2.2, 2.1)), sounds=(Sound(1, 1),)), seed=7)
        body = SimulatedHardware(shared, build=EPUCK2)
        body.drive(300, 700)
        for tick in range(1, 100):
            body.advance(tick / 64)
            if ask_all:
                readings(body)
        return readings(body)

    assert run(True) == run(True) == run(False)
