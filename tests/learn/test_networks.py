"""Networks: what they compute, on both engines, and the laws of users."""

import math
import pickle
import re
from dataclasses import fields, replace

import numpy as np
import pytest

from elib.base.body import METRES_PER_STEP
from elib.base.errors import ArgumentError
from elib.learn import Task, encoders
from elib.learn.envs import TaskEnv
from elib.learn.networks import INPUTS, KINDS, Network, find_controller
from elib.simulator.physics import Box, Controller, EpuckModel, Light, Scene, Sound, World
from elib.simulator.physics.body import GRAVITY
from elib.simulator.physics.records import SENSORS, SIZE, SensorView

SCENE = Scene(
    0.6,
    0.6,
    boxes=(Box(0.3, 0.3, 0.1, 0.08),),
    lights=(Light(0.1, 0.5),),
    sounds=(Sound(0.1, 0.1, 500),),
    model=EpuckModel(motor_noise=0.05, ground_module=True),
)
TOP = 0.1 / METRES_PER_STEP
NEAR = [4095, 0, 2000, 0, 0, 0, 100, 4095]

LAW = """
from elib.learn.networks import Law

def keep_off(robot, parameters, memory):
    memory[0] += 1.0
    robot.left = parameters[0] * robot.proximity[0]
    robot.right = -robot.left

FAST = Law(keep_off, size=1, memory=1)
"""


def decide(each, parameters, readings=NEAR, memory=None):
    """Return the speeds that a network sets, and its memory."""
    view, memory = SensorView(proximity=readings), memory or [0.0] * each.memory
    each.function(view, parameters, memory)
    return [view.left, view.right], memory


def layer(parameters, inputs):
    """Compute a layer as textbooks write it: one row a neuron, the bias first."""
    return parameters.reshape(-1, 1 + len(inputs)) @ [1.0, *inputs]


def drawn(size):
    return np.random.default_rng(4).normal(0, 1, size)


def test_a_braitenberg_vehicle_adds_weighted_readings_and_keeps_within_the_top_speed():
    vehicle = Network("braitenberg", ["proximity"])
    assert vehicle.size == 18
    speeds, _ = decide(vehicle, [0.5, *[0.0] * 7, -0.25, 0.5, 9.0, *[0.0] * 7])
    assert speeds == pytest.approx([0.25 * TOP, TOP])


def test_a_perceptron_is_tanh_of_the_weighted_readings():
    network = Network("feedforward", ["proximity"])
    parameters = drawn(network.size)
    speeds, _ = decide(network, parameters.tolist())
    assert speeds == pytest.approx(TOP * np.tanh(layer(parameters, np.divide(NEAR, 4095))))


def test_hidden_neurons_stand_between_the_readings_and_the_wheels():
    network = Network("feedforward", ["proximity"], hidden=3, top_speed=0.05)
    parameters = drawn(network.size)
    speeds, _ = decide(network, parameters.tolist())
    hidden = np.tanh(layer(parameters[:27], np.divide(NEAR, 4095)))
    assert speeds == pytest.approx(TOP / 2 * np.tanh(layer(parameters[27:], hidden)))


@pytest.mark.parametrize("hidden", [0, 3])
def test_the_first_layer_of_a_recurrent_network_is_fed_by_its_own_last_outputs(hidden):
    network = Network("recurrent", ["proximity"], hidden)
    parameters, memory, last = drawn(network.size), None, np.zeros(hidden or 2)
    own = (hidden or 2) * (1 + 8 + (hidden or 2))
    for near in (NEAR, NEAR[::-1], [0] * 8):
        speeds, memory = decide(network, parameters.tolist(), near, memory)
        last = np.tanh(layer(parameters[:own], [*np.divide(near, 4095), *last]))
        expected = np.tanh(layer(parameters[own:], last)) if hidden else last
        assert speeds == pytest.approx(TOP * expected)


def test_the_network_of_floreano_and_mondada_has_22_parameters():
    assert Network("recurrent", ["proximity"]).size == 22


def test_every_sensor_has_as_many_inputs_as_readings_that_every_firmware_sends():
    sizes = {entry.name: entry.metadata.get(SIZE, 1) for entry in fields(SensorView)}
    assert list(INPUTS) == list(SENSORS)
    expected = {sensor: sizes[sensor] for sensor in SENSORS} | {"ground": 3, "microphones": 3}
    assert {sensor: each.count for sensor, each in INPUTS.items()} == expected


def test_inputs_lie_between_minus_1_and_1_whatever_is_read():
    network = Network("feedforward", SENSORS)
    robot = SensorView(ambient_light=[4095, 0, *[9999] * 6], distance=0.5, acceleration=[-99.0, 99.0, GRAVITY])
    memory = [0.0] * network.memory
    network.function(robot, [0.0] * network.size, memory)
    assert memory[8:16] == [0.0, 1.0, *[-1.0] * 6]
    assert memory[22:27] == [0.75, -1.0, 1.0, 0.5, 0.0]


@pytest.mark.long
@pytest.mark.parametrize(
    "network", [Network("braitenberg", ["proximity"]), Network("recurrent", SENSORS, hidden=3)], ids=str
)
def test_both_engines_drive_the_same_run_to_the_last_bit(network):
    ends = []
    for engine in ("interpreted", "compiled"):
        world = World(SCENE, robots=3, seed=2, engine=engine)
        world.run(60, network.controller(drawn((3, network.size))))
        ends.append((world.hash(*SENSORS), world.memory.tolist()))
    assert ends[0] == ends[1]
    assert len(set(map(tuple, ends[0][1]))) == 3


def test_equal_networks_have_one_function_so_that_it_is_compiled_once():
    assert Network("feedforward", ["ground"]).function is Network("feedforward", ("ground",)).function


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("perceptron", ["ground"]), "the kind of network is 'perceptron'"),
        (("recurrent", []), "a network needs a sensor"),
        (("recurrent", "ground"), "it must be a list of names"),
        (("recurrent", ["grund"]), "there is no sensor 'grund'"),
        (("recurrent", ["ground", "ground"]), "a sensor stands twice"),
        (("recurrent", ["ground"], 101), "hidden is 101"),
        (("recurrent", ["ground"], 1.5), "hidden is 1.5"),
        (("braitenberg", ["ground"], 1), "a Braitenberg vehicle has no hidden neurons"),
        (("recurrent", ["ground"], 0, 0.2), "top_speed is 0.2"),
    ],
)
def test_what_no_network_can_be_is_refused(arguments, message):
    with pytest.raises(ArgumentError, match=message):
        Network(*arguments)


@pytest.mark.parametrize("count", [0, 21, 23])
def test_a_wrong_number_of_parameters_is_refused(count):
    with pytest.raises(ArgumentError, match=f"there are {count} parameters; the controller has 22"):
        Network("recurrent", ["proximity"]).controller([0.0] * count)


@pytest.mark.parametrize("kind", KINDS)
def test_networks_are_found_by_their_kind_and_can_be_sent_to_another_process(kind):
    network = find_controller(kind, ["ground"], top_speed=0.07)
    assert network == Network(kind, ("ground",), 0, 0.07) == pickle.loads(pickle.dumps(network))


def test_a_law_of_a_file_keeps_to_the_sensors_and_the_top_speed_of_the_task(tmp_path):
    file = tmp_path / "my_law.py"
    file.write_text(LAW)
    law = find_controller(f"{file}:FAST", ["proximity", "ground"], top_speed=0.05)
    assert (law.size, law.memory, law.sensors) == (1, 1, ("proximity", "ground"))
    assert decide(law, [0.01]) == ([pytest.approx(40.95), pytest.approx(-40.95)], [1.0])
    assert decide(law, [100.0])[0] == [TOP / 2, -TOP / 2]
    assert all(math.isnan(speed) for speed in decide(law, [math.nan])[0])  # The firmware takes it for 0.


@pytest.mark.long
def test_a_law_drives_both_engines_alike(tmp_path):
    file = tmp_path / "my_law.py"
    file.write_text(LAW)
    law = find_controller(f"{file}:FAST", ["proximity"])
    ends = []
    for engine in ("interpreted", "compiled"):
        world = World(SCENE, robots=2, seed=2, engine=engine)
        world.run(60, law.controller([0.7]))
        ends.append(world.hash())
    assert ends[0] == ends[1]
    assert isinstance(law.controller([0.7]), Controller)


@pytest.mark.parametrize(
    ("name", "message", "hint"),
    [
        ("recurent", "there is no controller 'recurent'", "did you mean recurrent"),
        ("{}/my_law.py", "there is no controller", "my_law.py:LAW, LAW being the name of a Law"),
        ("{}/my_law.py:FASD", "has no 'FASD'", "did you mean FAST"),
        ("{}/no.py:FAST", "there is no file", "FILE.py:NAME"),
        ("{}/my_law.py:keep_off", "not a Law", r"keep_off = elib.learn.Law\(function, size=3\)"),
        ("{}/broken.py:LAW", "fails: NameError", "run it with Python"),
    ],
)
def test_a_name_of_nothing_is_refused_with_a_cure(tmp_path, name, message, hint):
    (tmp_path / "my_law.py").write_text(LAW)
    (tmp_path / "broken.py").write_text("Law(keep_off)")
    with pytest.raises(ArgumentError, match=message) as caught:
        find_controller(name.format(tmp_path), ["proximity"])
    assert re.search(hint, caught.value.hint)


@pytest.mark.parametrize("sensors", [("proximity", "ground", "rotation"), tuple(INPUTS)])
def test_observations_of_an_environment_are_scaled_to_the_inputs_of_a_network(sensors):
    network = Network("feedforward", sensors)
    scenes = (replace(SCENE, step=1 / 40),)
    task = Task("seen", "See.", scenes, lambda world, i: 0.0, sensors=sensors, observe=(encoders(),))
    env = TaskEnv(task, engine="interpreted")
    seen, _ = env.reset(seed=2)
    for _ in range(5):
        seen, *_ = env.step([0.05, -0.02])
    memory = [0.0] * network.memory
    network.function(env._episodes.world(0)._state.world.views[0], [0.0] * network.size, memory)
    assert network.scale([seen, seen]) == pytest.approx(np.tile(memory[: network.inputs], (2, 1)), abs=1e-6)
    assert np.any(network.scale(seen) != 0.0)
