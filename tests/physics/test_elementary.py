"""Functions made of + - * / and sqrt alone: near the C library's, and the same in both engines."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from elib.simulator.physics.elementary import angle, arc_cosine, exponential
from elib.simulator.physics.engine import engine_named

COORDINATES = st.floats(-1e6, 1e6, allow_subnormal=False)
POINTS = [(math.cos(k / 7), math.sin(k / 7)) for k in range(-22, 23)]


@settings(max_examples=300)
@given(st.floats(-690, 690))
def test_the_exponential_is_within_a_few_last_bits(x):
    assert exponential(x) == pytest.approx(math.exp(x), rel=1e-15, abs=0)


def test_the_exponential_has_its_exact_values_and_ends():
    assert exponential(0.0) == 1.0
    assert exponential(1.0) == pytest.approx(math.e, rel=1e-15)
    assert exponential(-701.0) == exponential(-math.inf) == 0.0
    assert exponential(800.0) == exponential(math.inf) == exponential(700.0) < math.inf


@settings(max_examples=300)
@given(COORDINATES, COORDINATES)
def test_the_angle_of_a_vector_is_within_a_few_last_bits(x, y):
    if math.hypot(x, y) < 1e-100:  # Its square is too small for a float.
        x = 1.0
    y += 0.0  # Zero has no sign here.
    assert angle(x, y) == pytest.approx(math.atan2(y, x), rel=2e-15, abs=1e-300)


def test_the_angles_of_the_axes_are_exact_and_mirrored():
    assert [angle(1.0, 0.0), angle(-1.0, 0.0), angle(0.0, 0.0)] == [0.0, math.pi, 0.0]
    assert angle(0.0, 2.0) == pytest.approx(math.pi / 2, rel=2e-16)
    assert all(angle(x, -y) == -angle(x, y) for x, y in POINTS)


@settings(max_examples=300)
@given(st.floats(-1, 1))
def test_the_arc_cosine_is_within_a_few_last_bits(x):
    assert arc_cosine(x) == pytest.approx(math.acos(x), rel=2e-15)


def test_the_arc_cosine_of_rounding_errors_beyond_one_is_that_of_one():
    assert arc_cosine(1.0000000000000002) == 0.0
    assert arc_cosine(-1.0000000000000002) == math.pi


@pytest.mark.usefixtures("own_kernel")
def test_compiled_they_agree_to_the_last_bit():
    ready = engine_named("compiled").ready
    powers = [k / 3 for k in range(-2200, 2200)]
    assert [ready(exponential)(x) for x in powers] == [exponential(x) for x in powers]
    assert [ready(angle)(x, y) for x, y in POINTS] == [angle(x, y) for x, y in POINTS]
    assert [ready(arc_cosine)(x) for x, _ in POINTS] == [arc_cosine(x) for x, _ in POINTS]
