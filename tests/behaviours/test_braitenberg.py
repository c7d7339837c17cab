"""Braitenberg's vehicles: what their wiring makes of light from any side, and of a wall."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
import readings
from readings import DARK, NOTHING

from elib.base.errors import ArgumentError
from elib.behaviours import find
from elib.behaviours.avoid import SPIN
from elib.behaviours.braitenberg import CREEP, LOVELY, Stimuli, Vehicle, add_avoidance, steer, stimuli
from elib.link.protocol.values import AmbientLight, Proximity, Wheels

CRUISE = 0.6
STANDING = Wheels(0.0, 0.0)


def lamp_at(direction: float, distance: float = 0.3) -> Stimuli:
    """Return how bright it is with a lamp in that direction, degrees to the left, and distance, m."""
    return stimuli(readings.lamp_at(direction, distance), DARK)


def test_in_the_dark_there_is_no_stimulus_however_dark_the_room_is() -> None:
    for dark in (1, 800, DARK):
        assert stimuli(AmbientLight(*[dark] * 8), dark) == (0, 0)
    assert stimuli(AmbientLight(*[0] * 8), 0) == (0, 0)


def test_full_light_on_all_sides_is_one_on_both() -> None:
    assert stimuli(AmbientLight(*[0] * 8), DARK) == (1, 1)


@pytest.mark.parametrize("direction", [10, 40, 90, 140, 170])
def test_a_lamp_on_the_left_is_brighter_on_the_left_wherever_it_is(direction: float) -> None:
    here, there = lamp_at(direction), lamp_at(-direction)
    assert here.left > here.right + 0.02
    assert there == pytest.approx((here.right, here.left), abs=0.02)


def test_the_nearer_the_lamp_the_stronger_the_stimulus() -> None:
    levels = [lamp_at(0, distance).left for distance in (0.3, 0.4, 0.5)]
    assert all(near > far for near, far in pairwise(levels))


@pytest.mark.parametrize(
    ("vehicle", "turn"),
    [(Vehicle.FEAR, -1), (Vehicle.AGGRESSION, 1), (Vehicle.LOVE, 1), (Vehicle.EXPLORER, -1)],
)
@pytest.mark.parametrize("direction", [15, 90])
def test_fear_and_explorer_turn_away_from_a_lamp_on_the_left_and_the_others_towards_it(
    vehicle: Vehicle, turn: int, direction: float
) -> None:
    wheels = steer(lamp_at(direction), vehicle)
    assert math.copysign(1, wheels.right - wheels.left) == turn
    mirrored = steer(lamp_at(-direction), vehicle)
    assert math.copysign(1, mirrored.right - mirrored.left) == -turn


def test_light_hurries_fear_and_aggression_and_slows_love_and_explorer() -> None:
    for vehicle in Vehicle:
        speeds = [sum(steer(Stimuli(level, level), vehicle)) for level in (0.2, 0.4, 0.6)]
        is_hurried = vehicle in (Vehicle.FEAR, Vehicle.AGGRESSION)
        assert all((more > less) == is_hurried for less, more in pairwise(speeds))


def test_love_alone_comes_to_rest_and_does_so_in_bright_light() -> None:
    bright = Stimuli(LOVELY + 0.1, LOVELY + 0.1)
    assert steer(bright, Vehicle.LOVE) == (0, 0)
    for vehicle in set(Vehicle) - {Vehicle.LOVE}:
        for stimulus in (bright, Stimuli(0.0, 0.0)):
            assert min(steer(stimulus, vehicle, cruise=CRUISE)) >= CRUISE * CREEP


def test_no_vehicle_asks_for_more_than_the_cruising_speed() -> None:
    for vehicle in Vehicle:
        for left in (0.0, 0.5, 1.0):
            for right in (0.0, 0.5, 1.0):
                assert all(0 <= wheel <= CRUISE for wheel in steer(Stimuli(left, right), vehicle, cruise=CRUISE))


def test_on_free_ground_the_light_alone_steers() -> None:
    assert add_avoidance(Wheels(0.5, 0.3), NOTHING, STANDING) == (0.5, 0.3)


def test_a_wall_on_the_left_slows_the_right_wheel_and_one_in_front_is_turned_from_whatever_the_light() -> None:
    left, right = add_avoidance(Wheels(0.4, 0.4), Proximity(0, 0, 0, 0, 0, 0, 400, 0), STANDING)
    assert left == 0.4 > right > 0
    assert add_avoidance(STANDING, Proximity(0, 0, 0, 0, 0, 0, 0, 2000), STANDING) == (SPIN, -SPIN)


def test_the_vehicle_is_chosen_by_its_name() -> None:
    assert find("braitenberg").check({"vehicle": "love"}) == {"vehicle": Vehicle.LOVE}
    with pytest.raises(ArgumentError, match="FEAR"):
        find("braitenberg").check({"vehicle": "hate"})
