"""Kernels folded into one function: the same to the last bit as the kernels that call each other."""

import traceback
from contextlib import contextmanager
from math import sqrt
from types import FunctionType

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from elib.physics import Box, Controller, Cylinder, EpuckModel, Light, Pose, Scene, Wall, World, engine, kernels
from elib.physics import layout as at
from elib.physics.folding import Program
from elib.physics.settled import literals, settled_in
from elib.physics.syntax import CannotFold

WEIGHT = 0.1
LAW = Controller.braitenberg()
RAM = Controller.braitenberg((0.3, 0.2, 0, 0, 0, 0, 0, 0), (0, 0, 0, 0, 0, 0, 0.2, 0.3), base=700)
"""Drives at whatever it sees."""


@contextmanager
def folding_after(steps):
    """Let kernels be folded after so many steps."""
    before, engine.WARM = engine.WARM, steps
    try:
        yield
    finally:
        engine.WARM = before


def clamped(value, least):
    if value < least:
        return least
    if value > 9.0:
        return 9.0
    return value


def split(value):
    whole = int(value)
    return whole, value - whole


def note(values, k, value):
    if value < 0.0:
        return
    values[k] = max(value, WEIGHT)


def first_above(values, count, limit):
    for k in range(count):
        if values[k] > limit:
            return k
    return -1


def mean(values, numbers):
    total = 0.0
    for k in range(numbers[0]):
        whole, part = split(clamped(values[k + 1 + 1], 0.5))
        total += WEIGHT * whole + part * part
        note(values, k, total - 1.0)
    if numbers[1] > 0 and total > 2.0:
        total = -total
    return sqrt(abs(total)) + clamped(total, 0.25) * clamped(total * 2.0, 0.75) + first_above(values, 3, 2.0)


def law_of_steps(near, first, parameters, wheels):
    wheels[0] = parameters[0] - near[first]
    wheels[1] = parameters[0] - near[first + 7]


def failing(near, first, parameters, wheels):
    if near[first] + near[first + 1] > 0:
        wheels[0] = 1.0 / parameters[0]


ALL = {clamped, split, note, first_above, mean}


def folded(function, settled, inner=frozenset(ALL)):
    return Program(settled, set(ALL), set(inner)).function(function, {})


@settings(max_examples=100)
@given(st.lists(st.floats(-20, 20), min_size=6, max_size=6), st.integers(0, 4), st.booleans(), st.booleans())
def test_a_folded_function_does_what_the_function_does(values, count, is_negated, is_taken):
    settled = {("numbers", 0): count, ("numbers", 1): int(is_negated)}
    here, there = list(values), list(values)
    numbers = [count, int(is_negated)]
    inner = ALL if is_taken else ()
    assert folded(mean, settled, inner)(here, numbers) == mean(there, numbers)
    assert here == there


def test_what_is_settled_and_what_is_constant_are_literals_and_calls_are_gone():
    code = folded(mean, {("numbers", 0): 2, ("numbers", 1): 0}).__code__
    assert WEIGHT in code.co_consts
    assert not {"WEIGHT", "clamped", "split", "note"} & {name.partition("__")[0] for name in code.co_names}
    assert "first_above" in {name.partition("__")[0] for name in code.co_names}  # It returns from within a loop.


def chosen(values, numbers):
    if values[0] > 0.0 or numbers[0] > 0:
        return 1
    if values[1] > 0.0 and numbers[0] == 0:
        return 2
    return 3


def test_a_condition_keeps_no_literal_that_decides_nothing():
    function = folded(chosen, {("numbers", 0): 0})
    assert [function(values, [0]) for values in ([1.0, 1.0], [0.0, 1.0], [0.0, 0.0])] == [1, 2, 3]
    assert not {True, False} & {const for const in function.__code__.co_consts if isinstance(const, bool)}
    always = folded(chosen, {("numbers", 0): 1})
    assert [always(values, [1]) for values in ([1.0, 1.0], [0.0, 0.0])] == [1, 1]


def starred(*values):
    return values


def with_default(value=1):
    return value


def with_text(value):
    return f"{value}"


def with_raise(value):
    raise ValueError(value)


def with_change(numbers):
    numbers[0] = 1


@pytest.mark.parametrize("function", [starred, with_default, with_text, with_raise, with_change, lambda value: value])
def test_what_folding_does_not_know_is_refused(function):
    with pytest.raises(CannotFold):
        Program({("numbers", 0): 1}, set(), set()).function(function, {})


def outer(values, numbers):
    return other(values, numbers) + other(values, values)


def other(values, numbers):
    return values[0] + numbers[0]


def test_a_kernel_that_gets_another_sequence_under_a_settled_name_is_not_folded_by_itself():
    with pytest.raises(CannotFold, match="gets other numbers"):
        Program({("numbers", 0): 1}, {outer, other}, set()).function(outer, {})


def through(values):
    return with_text(values[0])


def test_a_kernel_that_cannot_be_folded_is_called_as_it_stands():
    assert Program({}, {through, with_text}, {with_text}).function(through, {})([2.5]) == "2.5"


def test_a_program_knows_when_a_module_got_another_kernel(monkeypatch):
    program = Program({}, set(ALL), set(ALL))
    program.function(mean, {})
    assert program.is_current()
    monkeypatch.setitem(globals(), "clamped", lambda value, least: value)
    assert not program.is_current()


def record(world):
    return [*world._state.robots, *world._state.bodies, *world._state.numbers]


def told(scene, law, robots, ticks, warm):
    with folding_after(warm):
        world = World(scene, robots=robots, seed=3)
        world.run(ticks, law)
        world.set_ambient(700.0)
        world.run(ticks, law)
        turn = world.stepper()
        near = [turn(300.0, -200.0) for _ in range(3)]
        world.run(5)
        return record(world), near, world.hash("proximity"), world.snapshot(beams=True).robots


@settings(max_examples=12)
@given(
    rays=st.sampled_from([1, 3, 5]),
    profile=st.sampled_from(["enki", "webots", "gctronic"]),
    robots=st.integers(1, 5),
    noise=st.sampled_from([0.0, 1.0]),
    spread=st.sampled_from([0.0, 0.1]),
    things=st.sampled_from(["none", "walls", "lamps", "pushables", "all"]),
    law=st.sampled_from([LAW, RAM, Controller(law_of_steps, (400.0,))]),
)
def test_a_folded_run_is_the_plain_run_to_the_last_bit(rays, profile, robots, noise, spread, things, law):
    def having(kind, *made):
        return made if things in (kind, "all") else ()

    pushables = having("pushables", Box(0.2, 0.45, 0.08, 0.06, 0.3, is_pushable=True))
    round_ones = having("pushables", Cylinder(0.45, 0.2, 0.03, is_pushable=True), Cylinder(0.5, 0.5, 0.02))
    scene = Scene(
        0.6,
        0.6,
        having("walls", Wall(0.3, 0.05, 0.3, 0.2), Wall(0.1, 0.5, 0.25, 0.55)),
        pushables,
        round_ones,
        lights=having("lamps", Light(0.1, 0.3)),
        model=EpuckModel(
            rays=rays,
            profile=profile,
            sensor_noise=noise,
            motor_noise=0.05 * noise,
            gain_spread=spread,
            offset_spread=50 * spread,
        ),
    )
    assert told(scene, law, robots, 25, warm=0) == told(scene, law, robots, 25, warm=10**9)


def test_readings_are_those_of_the_rays_that_a_drawing_shows():
    model = EpuckModel(rays=1, sensor_noise=0)
    world = World(Scene(0.3, 0.3, starts=(Pose(0.1, 0.12, 0.4),), model=model))
    world.run(20, LAW)
    beams = world.snapshot(beams=True).robots[0].beams
    for beam, reading in zip(beams, world.proximity(0), strict=True):
        assert beam.strength * 4095 == pytest.approx(reading, rel=0.05, abs=2)


def test_a_short_run_folds_nothing_and_a_long_one_does():
    scene = Scene(0.3, 0.3)
    runner = engine.Interpreted()
    world = World(scene, robots=1)
    run = runner.bare(kernels.advance)
    run(10, *world._state.solid, world._state.scratch)
    assert not runner._programs
    run(engine.WARM, *world._state.solid, world._state.scratch)
    assert len(runner._programs) == 1
    assert world.tick == engine.WARM + 10


def test_a_run_after_a_setting_was_changed_takes_the_new_one():
    def end(warm):
        with folding_after(warm):
            world = World(Scene(0.5, 0.5, model=EpuckModel(motor_noise=0.05)), robots=1)
            world.run(10, LAW)
            world._state.fixed[at.MOTOR_NOISE] = 0.0
            world.run(10, LAW)
            world._state.fixed[at.STEP] = 1 / 64
            world.run(10, LAW)
            return record(world)

    assert end(0) == end(10**9)


def test_an_error_in_a_law_names_the_law_and_the_run():
    with folding_after(0), pytest.raises(ZeroDivisionError) as caught:
        World(Scene(0.2, 0.2), robots=1).run(5, Controller(failing, (0.0,)))
    frames = traceback.extract_tb(caught.value.__traceback__)
    assert frames[-1].name == "failing"
    assert frames[-2].name == "steer"
    assert "law(" in frames[-2].line


def test_every_kernel_of_the_run_can_be_folded():
    program = Program({}, engine._kernels, engine._inner)
    for kernel in (kernels.advance, kernels.turn, kernels.steer):
        assert isinstance(program.function(kernel, {}), FunctionType)


def test_in_the_run_of_one_robot_nothing_that_happens_in_every_tick_is_called():
    state = World(Scene(1, 1), robots=1)._state
    program = Program(literals(settled_in(state.fixed, state.numbers)), engine._kernels, engine._inner)
    called = program.function(kernels.steer, {"law": kernels.braitenberg}).__code__.co_names
    assert not {
        "sense",
        "glance",
        "_face",
        "measure",
        "respond",
        "braitenberg",
        "travel",
        "arrive",
        "collide",
        "_wake",
    } & {name.partition("__")[0] for name in called}
