"""The wheels: what the firmware makes of a speed, what its encoders count, and how far that takes the robot."""

import math

import pytest
from world_rig import IDEAL

from elib.base.body import METRES_PER_STEP, step_rate
from elib.base.errors import ArgumentError
from elib.simulator.emulator.motors import MicrostepMotor, PowerSavingMotor
from elib.simulator.physics import EpuckModel, Pose, Scene, World
from elib.simulator.physics.motion import rim_speed

MOTORS = {1: PowerSavingMotor, 2: MicrostepMotor}


def room(*, size=4.0, step=1 / 64, **model):
    start = Pose(size / 2, size / 2)
    return World(Scene(size, size, starts=(start,), step=step, model=EpuckModel(**{"quality": "ideal"} | model)))


@pytest.mark.parametrize("generation", [1, 2])
def test_every_speed_becomes_the_rate_that_the_emulated_motor_makes_of_it(generation):
    motor = MOTORS[generation]()
    for speed in range(-1300, 1301):
        motor.set_speed(speed)
        assert step_rate(float(speed), generation) == pytest.approx(motor.rate, rel=1e-12), speed


@pytest.mark.parametrize(
    ("generation", "asked", "made"),
    [
        (1, 600, 625),
        (1, 700, 714.3),
        (1, 800, 833.3),
        (1, 850, 909.1),
        (1, 950, 1000),
        (1, 1500, 1000),
        (2, 700, 704.2),
        (2, 800, 806.5),
        (2, 950, 961.5),
        (2, 1100, 1111.1),
        (2, 2000, 1111.1),
    ],
)
def test_the_published_speeds_come_out(generation, asked, made):
    # e-puck.md, 1; the e-puck1's timer is 0.03 % slow.
    assert step_rate(asked, generation) == pytest.approx(made, rel=4e-4)
    assert step_rate(-asked, generation) == -step_rate(asked, generation)


def test_a_thousand_steps_move_128_8_mm():
    world = room()
    world.set_step_rates(0, 1000, 1000)
    while world.encoders(0)[0] < 1000:
        world.step()
    counted = world.encoders(0)[0]
    assert (world.pose(0).x - 2) / counted * 1000 == pytest.approx(0.1288, abs=1e-4)
    assert pytest.approx(0.1288, abs=5e-5) == METRES_PER_STEP * 1000


def test_a_full_turn_in_place_takes_the_steps_that_the_axle_asks_for():
    world = room()
    world.set_step_rates(0, -500, 500)
    turned, before = 0.0, 0.0
    while turned < math.tau:
        world.step()
        now = world.pose(0).heading
        turned += math.remainder(now - before, math.tau)
        before = now
    steps = world.encoders(0)[1] * math.tau / turned
    assert steps == pytest.approx(math.pi * 0.053 / METRES_PER_STEP, rel=2e-3)  # 1293; the firmware's demo takes 1300.


def test_encoders_count_issued_steps_while_the_robot_is_blocked():
    world = World(Scene(1, 1, starts=(Pose(0.95, 0.5),), model=IDEAL))
    world.set_step_rates(0, 500, 500)
    world.run(640)
    assert world.pose(0).x < 1 - 0.0369
    assert world.encoders(0) == pytest.approx((4999, 4999), abs=2)


def test_encoders_know_nothing_of_noise_and_of_the_spread_of_wheels():
    plain, spread = room(), room(motor_noise=0.2, wheel_spread=0.05, axle_spread=0.05)
    for world in (plain, spread):
        world.set_step_rates(0, 300, 500)
        world.run(300)
    assert plain.encoders(0) == spread.encoders(0)
    assert plain.pose(0) != spread.pose(0)


def test_a_control_function_that_asks_for_what_is_not_a_number_gets_standing_wheels():
    tables = room()._state.world.tables[0]
    assert rim_speed(tables, math.nan) == rim_speed(tables, 0.9) == 0.0
    assert rim_speed(tables, -math.inf) == -rim_speed(tables, 1e300) == rim_speed(tables, -1000.0)


@pytest.mark.parametrize("speed", [math.nan, math.inf])
def test_a_speed_that_is_not_a_number_is_refused_with_its_side(speed):
    with pytest.raises(ArgumentError, match=f"right is {speed}"):
        room().set_step_rates(0, 100, speed)


def test_half_the_step_gives_nearly_the_same_path():
    ends = []
    for step in (1 / 64, 1 / 128, 1 / 256):
        scene = Scene(1, 1, starts=(Pose(0.3, 0.3, 0.4), Pose(0.6, 0.42, 2.0)), step=step, model=IDEAL)
        world = World(scene)
        world.set_wheel_speeds(0, 0.08, 0.09)
        world.set_wheel_speeds(1, 0.1, 0.07)
        world.run_to(6.0)
        ends.append(world.poses)
    for finer in ends[1:]:
        for a, b in zip(ends[0], finer, strict=True):
            assert math.hypot(a.x - b.x, a.y - b.y) < 0.004  # They touch on the way.
