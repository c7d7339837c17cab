"""Controllers: sensors, parameters and memory, on both engines and in several threads."""

import copy
import math
import os
import pickle
import threading

import numpy as np
import pytest
from world_rig import BUSY, ENGINES, IDEAL, everything, vehicle

from elib.base.errors import ArgumentError, SimulationError
from elib.simulator.physics import Batch, Box, Controller, Lamps, Light, Pose, Scene, Sound, World
from elib.simulator.physics.records import SENSORS
from lanes import short

ROBOTS = 4


def attentive(robot, parameters, memory):
    """Let everything that there is to read turn the wheels."""
    memory[0] = 0.9 * memory[0] + parameters[0] * (robot.proximity[0] - robot.proximity[7]) / 1000
    memory[1] += math.sin(robot.time) + math.exp(-robot.distance) + math.sqrt(robot.acceleration[2])
    robot.left = 500 + 200 * memory[0] + robot.ground[1] / 10 + robot.number * parameters[1]
    robot.right = 500 - 200 * memory[0] + robot.microphones[0] / 50 + robot.ambient_light[0] / 100 + robot.rotation
    robot.fitness += (robot.left + robot.right) / 1000 * (1 - max(robot.proximity[0], robot.proximity[7]) / 4095)


def still(robot, parameters, memory):
    pass


def controller(parameters=(0.8, 4.0)):
    return Controller(attentive, parameters, sensors=SENSORS, memory=2)


def vehicles(shape):
    """Return a vehicle whose last two parameters differ from robot to robot, or from world to world."""
    own = np.linspace(0.1, 4.0, math.prod(shape)).reshape(shape)
    same = np.broadcast_to(vehicle().parameters[:18], (*shape[:-1], 18))
    return Controller(vehicle().function, np.concatenate([same, own], axis=-1), memory=2)


def world_of(engine="interpreted", robots=ROBOTS, scene=BUSY, **more):
    return World(scene, robots=robots, seed=3, engine=engine, **more)


def state_of(world):
    return world.hash(*SENSORS), everything(world), world.poses, world.fitness.tolist(), world.memory.tolist()


KINDS = pytest.mark.parametrize(
    ("engine", "threads", "scene", "drive"),
    [
        pytest.param("interpreted", 1, BUSY, controller(), id="interpreted"),
        pytest.param("compiled", 1, BUSY, controller(), id="1"),
        pytest.param("compiled", 2, BUSY, controller(), id="2", marks=pytest.mark.long),
    ],
)
AGAIN = {"copy": copy.copy, "deepcopy": copy.deepcopy, "pickle": lambda each: pickle.loads(pickle.dumps(each))}


@pytest.mark.usefixtures("compiled_worlds")
@pytest.mark.parametrize("shape", [(2,), (1, 2), (ROBOTS, 2), (1, 1, 2), (1, ROBOTS, 2)])
def test_every_robot_gets_its_own_parameters_and_its_memory_on_both_engines(shape):
    worlds = [world_of(engine) for engine in ENGINES]
    for world in worlds:
        world.run(60, vehicles(shape))
    assert state_of(worlds[0]) == state_of(worlds[1])
    assert np.all(worlds[0].memory != 0)
    assert len(set(worlds[0].fitness)) == ROBOTS


@pytest.mark.long
def test_every_robot_gets_all_sensors_on_both_engines_and_in_two_threads():
    parameters = np.linspace(0.1, 4.0, 2 * ROBOTS).reshape(ROBOTS, 2)
    worlds = [world_of(), world_of("compiled"), world_of("compiled", threads=2)]
    for world in worlds:
        world.run(60, controller(parameters))
    assert state_of(worlds[0]) == state_of(worlds[1]) == state_of(worlds[2])
    assert np.all(worlds[0].memory != 0)
    assert len(set(worlds[0].fitness)) == ROBOTS


@pytest.mark.usefixtures("compiled_worlds")
@pytest.mark.parametrize("shape", [(3, ROBOTS, 2), (3, 1, 2), (1, ROBOTS, 2)])
def test_every_world_of_a_batch_gets_its_own_parameters(shape):
    drive = vehicles(shape)
    tables = np.broadcast_to(drive.parameters, (3, ROBOTS, 20))
    expected = [World(BUSY, robots=ROBOTS, seed=9 + k) for k in range(3)]
    for world, table in zip(expected, tables, strict=True):
        world.run(20, Controller(drive.function, table, memory=2))
    for engine, threads in (("interpreted", 1), ("compiled", 1), ("compiled", 2)):
        batch = Batch(BUSY, 3, robots=ROBOTS, seed=np.int64(9), engine=engine, threads=threads)
        batch.run(20, drive)
        assert [state_of(world) for world in batch] == [state_of(world) for world in expected]


@pytest.mark.parametrize(
    "parameters",
    [5, math.nan, [math.inf], [True], ["1"], [1j], [None], None, [10**400], [[1, 2], [3]], np.zeros((1, 1, 1, 1))],
)
def test_parameters_that_are_not_a_table_of_finite_numbers_are_refused(parameters):
    with pytest.raises(ArgumentError, match="parameter"):
        Controller(still, parameters)


@pytest.mark.parametrize("shape", [(3, 2), (2, 4, 2), (0, 2), (2, 1, 2)])
def test_parameters_of_another_number_of_robots_or_worlds_are_refused(shape):
    with pytest.raises(ArgumentError, match=r"parameters of shape .* do not fit 1 worlds of 4 robots"):
        world_of().run(1, Controller(still, np.zeros(shape)))


@pytest.mark.parametrize("sensors", ["ground", None, 5, ["sonar"], [None], [["ground"]], ["picture"]])
def test_sensors_that_are_not_a_list_of_names_are_refused(sensors):
    with pytest.raises(ArgumentError, match="sensor"):
        Controller(still, sensors=sensors)


def test_a_control_function_needs_neither_parameters_nor_sensors_nor_memory():
    def turn(robot, parameters, memory):
        robot.left = 100 * robot.number + 100 * robot.time

    world = world_of()
    world.run(64, Controller(turn, sensors=()))
    assert world.encoders(1)[0] > 90
    assert world.memory.shape == (ROBOTS, 0)


def test_a_control_function_that_reads_a_sensor_it_did_not_ask_for_is_an_error():
    def follow(robot, parameters, memory):
        robot.left = robot.ground[0]

    with pytest.raises(ArgumentError, match=r"'follow' fails on readings of 0: AttributeError.*'ground'") as caught:
        world_of().run(1, Controller(follow))
    assert "the sensors that the controller asks for, here proximity" in caught.value.hint


def test_what_a_control_function_gets_wrong_later_is_an_error_of_its_own():
    def late(robot, parameters, memory):
        if robot.time > 0.1:
            memory[3] = 1.0

    with pytest.raises(IndexError):
        world_of().run(10, Controller(late, memory=1))


@pytest.mark.usefixtures("compiled_worlds")
def test_a_control_function_that_cannot_be_compiled_is_named_with_the_reason_and_the_line():
    def listing(robot, parameters, memory):
        robot.left = np.zeros(3)[0]

    def endless(x):
        return x if x < 1 else endless(x - 1)

    def recursing(robot, parameters, memory):
        robot.left = endless(3.0)

    def mistyped(robot, parameters, memory):
        if robot.time > 0:
            robot.left = robot.proximty[0]

    class Method:
        def control(self, robot, parameters, memory):
            robot.left = 100

    world = world_of("compiled")
    reason = r"'listing' cannot be compiled: No implementation .*zeros.*\(test_controllers.py, line \d+\)"
    with pytest.raises(SimulationError, match=reason) as refused:
        world.run(1, Controller(listing))
    assert len(str(refused.value)) < 400
    for _ in range(2):
        with pytest.raises(SimulationError, match=r"'.*endless' calls itself, which cannot be compiled"):
            world.run(1, Controller(recursing))
    with pytest.raises(SimulationError, match=r"'mistyped' cannot be compiled: .*proximty"):
        world.run(1, Controller(mistyped))
    with pytest.raises(SimulationError, match=r"Method.control .* cannot be compiled: it is not a plain function"):
        world.run(1, Controller(Method().control))
    world_of().run(1, Controller(Method().control))
    world.run(5, vehicle())  # The world is as good as before.
    assert world.tick == 5


@pytest.mark.parametrize(
    ("engine", "sensors", "scene", "drive"),
    [
        pytest.param("interpreted", SENSORS, BUSY, controller(), id="interpreted"),
        pytest.param("compiled", SENSORS, BUSY, controller(), id="compiled"),
    ],
)
@pytest.mark.parametrize("robots", [0, 1, ROBOTS])
def test_arrays_have_a_row_a_robot_hold_what_its_own_methods_say_and_are_copies(engine, sensors, scene, drive, robots):
    world = world_of(engine, robots, scene)
    world.run(30, drive)
    arrays = {sensor: world.readings(sensor) for sensor in sensors}
    arrays |= {"pose": world.poses_array, "encoders": world.encoders_array, "near": world.proximity_array}
    widths = {"proximity": 8, "ambient_light": 8, "ground": 5, "microphones": 4, "acceleration": 3}
    widths |= {"pose": 3, "encoders": 2, "near": 8}
    whole = {"proximity", "ambient_light", "ground", "microphones", "encoders", "near"}
    for name, array in arrays.items():
        assert array.shape == ((robots, widths[name]) if name in widths else (robots,))
        assert array.dtype == (np.int64 if name in whole else np.float64)
    assert (world.memory.shape, world.memory.dtype) == ((robots, 2), np.float64)
    assert (world.fitness.shape, world.fitness.dtype) == ((robots,), np.float64)
    for robot in range(robots):
        assert world.pose(robot) == Pose(*arrays["pose"][robot])
        assert [*world.encoders(robot)] == [*arrays["encoders"][robot]]
        assert world.proximity(robot) == [*arrays["near"][robot]]
        for sensor in sensors:
            single = getattr(world, sensor)(robot)
            assert (single if sensor in widths else [single]) == np.ravel(arrays[sensor][robot]).tolist()
    before = [world.fitness, world.memory, *arrays.values()]
    kept = [array.tolist() for array in before]
    world.run(30, drive)
    [world.readings(sensor) for sensor in sensors]
    assert [array.tolist() for array in before] == kept


def shake(world, drive):
    """Do all that changes a world."""
    world.run(30, drive)
    world.move_robot(0, Pose(0.9, 0.9, 1.0))
    world.move_box(0, Pose(0.8, 0.2, 0.1))
    world.move_box(1, Pose(0.2, 0.2, 0.1))
    world.move_cylinder(1, 0.6, 0.9)
    if world.scene.lights:
        world.set_light(0, Light(0.5, 0.5, intensity=0.3))
    world.set_sound(0, Sound(0.9, 0.9, 50))
    world.set_ambient(2000)
    world.show(0, Lamps(body=True))
    world.set_slot(1, 0.05)
    world.play(1, 900.0)
    world.set_wheel_speeds(0, 0.1, 0.1, at=world.time + 0.005)
    world.settle(2, 0.001, 0.001, at=world.time)
    world.run(40, Controller(drive.function, 0.9 * drive.parameters, sensors=drive.sensors, memory=2))
    world.picture(0, (0.0, 8.0), (0.0, 8.0))


@KINDS
def test_after_a_reset_everything_is_as_in_a_new_world_with_that_seed(engine, threads, scene, drive):
    world = world_of(engine, threads=threads, scene=scene)
    for seed in (5, 6):  # Fixed things moved, and then only pushable ones.
        if seed == 5:
            shake(world, drive)
        else:
            world.run(100, drive)
        world.reset(np.int64(seed))
        new = World(scene, robots=ROBOTS, seed=seed)
        assert (world.hash(*SENSORS), world.poses) == (new.hash(*SENSORS), new.poses)
        assert world.fitness.tolist() == new.fitness.tolist()
        assert (world.snapshot(beams=True), world.ambient) == (new.snapshot(beams=True), new.ambient)
        for each in (world, new):
            each.set_step_rates(0, 300, 400)
            each.run(20)
            each.run(60, drive)
            [getattr(each, sensor)(1) for sensor in SENSORS]
        assert state_of(world)[2:] == state_of(new)[2:]
        assert world.hash(*SENSORS) == new.hash(*SENSORS)
        assert world.snapshot() == new.snapshot()


@KINDS
@pytest.mark.parametrize("again", short(["pickle", "copy", "deepcopy"], "pickle"))
def test_a_copy_of_a_world_goes_on_as_the_world_does_and_by_itself(engine, threads, scene, drive, again):
    world = world_of(engine, threads=threads, scene=scene)
    shake(world, drive)
    other, before = AGAIN[again](world), state_of(world)
    for each in (other, world):
        assert state_of(each) == before
        shake(each, drive)
    assert state_of(other) == state_of(world) != before


@pytest.mark.parametrize("again", AGAIN)
def test_batches_and_controllers_can_be_copied(again):
    batch = Batch(BUSY, 2, robots=2, engine="interpreted")
    batch.run(10, controller())
    other, before = AGAIN[again](batch), batch.hash(*SENSORS)
    other.run(10, AGAIN[again](controller()))
    assert batch.hash(*SENSORS) == before
    batch.run(10, controller())
    assert other.hash(*SENSORS) == batch.hash(*SENSORS) != before


def test_numbers_of_numpy_do_what_the_same_numbers_of_python_do():
    one = np.float32(0.3)
    scenes = [
        Scene(
            number(1), number(1), boxes=(Box(number(0.7), 0.7, 0.1, 0.1, number(0.3), is_pushable=True),), model=IDEAL
        )
        for number in (np.float32, float)
    ]
    worlds = [
        World(scenes[0], robots=np.int64(2), seed=np.uint64(2**64 - 1), threads=np.int8(1)),
        World(scenes[1], robots=2, seed=2**64 - 1),
    ]
    for world, number in zip(worlds, (np.float32, lambda x: float(np.float32(x))), strict=True):
        world.move_robot(np.int16(0), Pose(number(one), number(0.4), number(0.5)))
        world.move_box(0, Pose(number(0.6), number(0.6), number(0.2)))
        world.set_wheel_speeds(0, number(0.1), number(0.05), at=number(0.3))
        world.set_step_rates(1, number(300.5), number(200))
        world.play(0, number(500), until=number(1))
        world.set_ambient(number(3000))
        world.run(np.int32(30))
    assert worlds[0].hash() == worlds[1].hash()
    assert worlds[0].poses == worlds[1].poses


@pytest.mark.parametrize("speed", ["a", None, 1j, math.nan, math.inf, True, 10**400])
def test_a_speed_that_is_not_a_finite_number_is_refused(speed):
    for command in (World.set_step_rates, World.set_wheel_speeds):
        with pytest.raises(ArgumentError, match="right is"):
            command(world_of(), 0, 1.0 if command is World.set_step_rates else 0.01, speed)


def in_a_fork(check):
    """Return whether *check* is true in a process that this one forked."""
    child = os.fork()
    if child == 0:  # GNU OpenMP ends a forked process that uses it.
        os._exit(0 if check() else 1)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def side_by_side(act, worlds):
    threads = [threading.Thread(target=act, args=(world,)) for world in worlds]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


@pytest.mark.usefixtures("compiled_worlds", "compiled_threads")
def test_all_robots_are_read_alike_in_two_threads_in_worlds_side_by_side_and_in_a_forked_process():
    def read(world):
        found.append(world.readings("proximity").tolist())

    found = []
    worlds = [world_of(engine) for engine in ENGINES]
    worlds += [world_of("compiled", threads=2) for _ in range(3)]
    for world in worlds:
        world.set_step_rates(0, 500, 600)
        world.run(40)
    for world in worlds[:2]:
        read(world)
    side_by_side(read, worlds[2:])
    assert found == [found[0]] * 5
    if hasattr(os, "fork"):
        other = world_of("compiled", threads=2)
        other.set_step_rates(0, 500, 600)
        other.run(40)
        assert in_a_fork(lambda: other.readings("proximity").tolist() == found[0])


@pytest.mark.long
def test_worlds_with_threads_run_side_by_side_and_in_a_forked_process():
    reference = world_of()
    reference.run(100, controller())
    worlds = [world_of("compiled", threads=2) for _ in range(3)]
    side_by_side(lambda world: world.run(100, controller()), worlds)
    assert [state_of(world) for world in worlds] == [state_of(reference)] * 3
    if hasattr(os, "fork"):
        worlds[0].reset()

        def runs_alike():
            worlds[0].run(100, controller())
            return state_of(worlds[0]) == state_of(reference)

        assert in_a_fork(runs_alike)
