"""One run, whatever computes it: both engines, any number of threads, any other robots and readings."""

import threading
from dataclasses import replace

import pytest
from world_rig import BUSY, ENGINES, IDEAL, everything, segments, vehicle

from elib.base.errors import ArgumentError, SimulationError
from elib.base.extras import install
from elib.simulator.physics import Batch, Controller, EpuckModel, Pose, Scene, Stripe, Wall, World, engine
from elib.simulator.physics.course import sense_robots
from elib.simulator.physics.engine import Compiled
from elib.simulator.physics.noise import mix
from elib.simulator.physics.senses import SENSORS
from lanes import few_and_many
from shared import PATIENCE, run_python

PAINT = (Stripe(((0.1, 0.1), (0.9, 0.9))),)
RAM_WEIGHTS = (0.3, 0.2, 0, 0, 0, 0, 0, 0), (0, 0, 0, 0, 0, 0, 0.2, 0.3)
RAM = vehicle(*RAM_WEIGHTS, base=700)
"""Drives at whatever it sees."""
CONTROLLER = vehicle(share=1.0)


def keep_off(robot, parameters, memory):
    robot.left = robot.right = parameters[0]
    if robot.proximity[0] + robot.proximity[1] > parameters[1]:
        robot.left = -parameters[0]


@pytest.mark.usefixtures("compiled_worlds")
@pytest.mark.parametrize(
    ("rays", "controller"),
    [
        (1, Controller.braitenberg(*RAM_WEIGHTS, base=700)),
        (3, Controller(keep_off, (500.0, 150.0))),
        (5, RAM),
        (5, vehicle(*RAM_WEIGHTS, base=700, share=1.0)),
    ],
    ids=["linear", "own", "ram", "general"],
)
def test_interpreted_and_compiled_are_one_run_to_the_last_bit(rays, controller):
    """Eight robots do the same on both engines, and touch something on their ways."""
    model = EpuckModel(rays=rays, motor_noise=0.05, gain_spread=0.05, offset_spread=5.0, quality="ideal")
    worlds = [World(replace(BUSY, model=model), robots=8, seed=11, engine=engine) for engine in ENGINES]
    contacts = 0
    for _ in range(20):
        for world in worlds:
            world.run(20, controller)
        contacts += sum(worlds[0].touching(robot) for robot in range(8))
        assert worlds[0].hash("proximity") == worlds[1].hash("proximity")
    assert contacts > 0
    assert everything(worlds[0]) == everything(worlds[1])
    assert worlds[0].poses == worlds[1].poses
    assert worlds[0].snapshot().boxes == worlds[1].snapshot().boxes
    assert worlds[0].memory.tolist() == worlds[1].memory.tolist()


@pytest.mark.parametrize(
    ("step", "slot", "speeds", "robots"),
    [
        (1 / 128, None, (0.128, 0.04), 12),
        (1 / 512, None, (0.128, -0.1), 12),
        (1 / 64, 0.05, (0.128, 0.03), 3),
        (1 / 64, 0.05, (0.128, 0.03), 1),
        (1 / 64, None, (1.28, 1.2), 2),
        (1 / 64, None, (0.5, 0.45), 12),
        (0.1, None, (0.19, -0.19), 2),
    ],
)
@pytest.mark.parametrize("seeds", [range(1), pytest.param(range(1, 8), marks=pytest.mark.long)], ids=["one", "more"])
@pytest.mark.usefixtures("compiled_worlds")
def test_both_engines_agree_on_sensors_that_were_sampled_long_ago_or_far_away(step, slot, speeds, robots, seeds):
    for seed in seeds:
        walls = segments(20 if robots < 12 else 5, 1, seed, length=0.05, margin=0.1)
        scene = Scene(1, 1, walls, step=step, model=EpuckModel(sensor_noise=0, quality="ideal"))
        worlds = [World(scene, robots=robots, seed=seed, engine=engine) for engine in ENGINES]
        for world in worlds:
            for robot in range(robots):
                world.set_wheel_speeds(robot, *(speeds if robot % 2 else speeds[::-1]))
                if slot is not None:
                    world.set_slot(robot, slot)
        for _ in range(60):
            for world in worlds:
                world.step()
            for robot in range(robots):
                assert worlds[0].proximity(robot) == worlds[1].proximity(robot)


@pytest.mark.usefixtures("compiled_worlds")
def test_every_sensor_says_the_same_on_both_engines():
    columns = tuple(8.0 * k - 156 for k in range(40))
    worlds = [World(replace(BUSY, paint=PAINT), robots=5, seed=2, engine=engine) for engine in ENGINES]
    for world in worlds:
        world.play(1, 800.0)
        for robot in range(5):
            world.set_step_rates(robot, 100 * robot, 500)
        for _ in range(10):
            world.run(7)
            for robot in range(5):
                for sensor in SENSORS:
                    if sensor == "picture":
                        world.picture(robot, columns, columns)
                    else:
                        getattr(world, sensor)(robot)
    assert worlds[0].hash(*SENSORS) == worlds[1].hash(*SENSORS)


def test_the_same_seed_gives_the_same_run_and_another_seed_another(engine):
    def run(seed):
        world = World(BUSY, robots=4, seed=seed, engine=engine)
        world.run(150, CONTROLLER)
        return world.hash("proximity")

    assert run(1) == run(1)
    assert run(1) != run(2)


def test_a_run_in_one_piece_is_the_run_tick_by_tick(engine):
    whole, pieces = (World(BUSY, robots=3, seed=4, engine=engine) for _ in range(2))
    whole.run(60, CONTROLLER)
    for _ in range(60):
        pieces.run(1, CONTROLLER)
    assert whole.hash("proximity") == pieces.hash("proximity")


def test_reading_other_sensors_changes_nothing(engine):
    alone, watched = (World(BUSY, robots=3, seed=4, engine=engine) for _ in range(2))
    for _ in range(20):
        alone.run(5, CONTROLLER)
        watched.run(5, CONTROLLER)
        for robot in range(3):
            watched.distance(robot)
            watched.ambient_light(robot)
            watched.microphones(robot)
            watched.acceleration(robot)
        watched.snapshot(beams=True)
    assert alone.hash() == watched.hash()
    assert alone.hash("proximity") == watched.hash("proximity")
    assert alone.hash("distance") != watched.hash("distance")


@few_and_many(20, 40)
def test_robots_elsewhere_in_the_world_change_nothing(engine, examples):
    near = (Pose(0.2, 0.2, 0.3), Pose(0.32, 0.22, 2.5), Pose(0.22, 0.33, -1.0))
    far = tuple(Pose(3.5 + 0.2 * (k % 5), 3.3 + 0.2 * (k // 5)) for k in range(15))
    model = EpuckModel(motor_noise=0.05, quality="ideal")
    walls = (Wall(0.6, 0.0, 0.6, 0.6), Wall(0.0, 0.6, 0.6, 0.6))  # A pen, so that the three stay together.
    few = World(Scene(5, 5, walls, starts=near, model=model), seed=9, engine=engine)
    many = World(Scene(5, 5, walls, starts=near + far, model=model), seed=9, engine=engine)
    touched = 0
    for _ in range(examples):
        few.run(10, RAM)
        many.run(10, RAM)
        touched += few.touching(0)
        assert few.poses == many.poses[:3]
        assert [few.proximity(k) for k in range(3)] == [many.proximity(k) for k in range(3)]
    assert touched > 0


def test_the_stepper_does_what_reading_steering_and_a_tick_do(engine):
    quick, slow = (World(BUSY, robots=2, seed=6, engine=engine) for _ in range(2))
    turn = quick.stepper()
    near = [0] * 8
    for _ in range(50):
        left, right = 400 - near[0], 400 - near[7]
        near = turn(left, right)
        slow.set_step_rates(0, left, right)
        slow.step()
        assert list(near) == slow.proximity(0)
    assert quick.hash("proximity") == slow.hash("proximity")


@pytest.mark.usefixtures("compiled_worlds")
def test_a_batch_gives_the_same_with_one_thread_and_with_two():
    batches = [Batch(BUSY, 6, robots=4, seed=3, threads=threads) for threads in (1, 2)]
    for batch in batches:
        batch.run(100, CONTROLLER)
    assert batches[0].hash("proximity") == batches[1].hash("proximity")
    interpreted = Batch(BUSY, 2, robots=4, seed=3, engine="interpreted")
    interpreted.run(100, CONTROLLER)
    assert [world.hash("proximity") for world in interpreted] == [world.hash("proximity") for world in batches[0][:2]]


def test_the_worlds_of_a_batch_have_seeds_of_their_own():
    batch = Batch.load("arena", 3, robots=2, seed=(1 << 64) - 2, engine="interpreted")
    assert [world.seed for world in batch] == [(1 << 64) - 2, (1 << 64) - 1, 0]
    batch.run(30, CONTROLLER)
    assert len({world.hash() for world in batch}) == len(batch) == 3


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"worlds": 0}, "worlds is 0"),
        ({"worlds": 1, "threads": 0}, "threads is 0"),
        ({"worlds": 1, "seed": -1}, "seed is -1"),
        ({"worlds": 1, "seed": 1 << 64}, "seed is 18446744073709551616"),
    ],
)
def test_a_batch_out_of_range_is_refused(arguments, match):
    with pytest.raises(ArgumentError, match=match):
        Batch(BUSY, engine="interpreted", **arguments)


@pytest.mark.usefixtures("compiled_worlds")
def test_a_robot_of_a_large_compiled_world_takes_less_than_2000_bytes():

    def size(robots):
        side = (robots / 10) ** 0.5
        state = World(Scene(side, side, model=IDEAL), robots=robots, engine="compiled")._state
        return sum(part.nbytes for part in state.world)

    assert (size(800) - size(200)) / 600 < 2000


def test_an_unknown_engine_and_a_controller_without_weights_are_refused():
    with pytest.raises(SimulationError, match="no engine 'gpu'"):
        World(BUSY, engine="gpu")
    with pytest.raises(ArgumentError, match="left has 3 weights"):
        Controller.braitenberg((1, 2, 3))
    with pytest.raises(ArgumentError, match="parameter 0 of the controller is nan"):
        Controller.braitenberg(base=float("nan"))


def test_without_numba_the_compiled_engine_says_what_to_install():
    code = """
import sys
sys.modules["numba"] = None
import importlib.util
real = importlib.util.find_spec
importlib.util.find_spec = lambda name, *rest: None if name == "numba" else real(name, *rest)
from elib import World
print(World.load("square").run(1))
try:
    World.load("square", engine="compiled")
except Exception as error:
    print(type(error).__name__, error)
"""
    done = run_python(code, check=True)
    assert done.stdout.startswith("None\nSimulationError the compiled engine needs Numba")
    assert install("compiled") in done.stdout


@pytest.mark.usefixtures("own_kernel")
def test_a_compilation_is_announced_and_code_that_is_found_is_not(tmp_path, monkeypatch, capsys):
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.setenv(name, str(tmp_path))
    said = []
    for _ in range(2):
        monkeypatch.setattr(engine, "_is_announced", False)
        assert Compiled().ready(mix)(12345) == mix(12345)
        said.append(capsys.readouterr())
    assert [each.out for each in said] == ["", ""]
    assert "compiling the simulator, once for this machine" in said[0].err
    assert said[1].err == ""


def test_kernels_never_read_beyond_their_sequences():
    # Interpreted, an index beyond the end is an error; this world has one of everything, at every edge.
    world = World(replace(BUSY, paint=PAINT), robots=6, seed=8)
    assert type(world._state.world.robots) is list
    for robot in range(6):
        world.set_step_rates(robot, 1000, 900 - 100 * robot)
    for _ in range(30):
        world.run(20)
        for robot in range(6):
            world.proximity(robot)


def test_two_threads_that_need_a_kernel_at_once_compile_it_once():
    engine, found, barrier = Compiled(), [], threading.Barrier(2)

    def work():
        barrier.wait(PATIENCE)
        found.append(engine.ready(sense_robots))

    both = [threading.Thread(target=work) for _ in range(2)]
    for each in both:
        each.start()
    for each in both:
        each.join()
    assert found[0] is found[1]
