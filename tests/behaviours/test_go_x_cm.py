"""Driving a number of centimetres, whatever happens to the link."""

from __future__ import annotations

import pytest
from played import played

from elib.behaviours import find, play
from elib.robot.motion import pace
from lanes import short
from shared import with_fault

LINK = "sim://arena?speed=max&latency=0.03&jitter=0.015"


def test_ten_centimetres_are_ten_centimetres_within_a_millimetre_and_the_same_every_time():
    journey = played("go-x-cm", LINK, cm=10)
    assert journey.way == pytest.approx(0.10, abs=0.001)
    assert journey.names[0] == "driving"
    assert journey.names[-1] == "arrived"
    assert journey.outcome.reason == "done"
    assert played("go-x-cm", LINK, cm=10).hash == journey.hash


@pytest.mark.parametrize(
    "link", ["loss=0.05&latency=0.03", "latency=0.2", "firmware=epuck2", "jitter=0.05&latency=0.1"]
)
def test_ten_centimetres_are_ten_centimetres_over_bad_links_too(link):
    assert played("go-x-cm", f"sim://arena?speed=max&{link}", cm=10).way == pytest.approx(0.10, abs=0.001)


@pytest.mark.parametrize("tenth", short(range(1, 11), 1, 5, 10))
def test_it_ends_within_two_millimetres_of_its_goal_after_a_cut_at_any_tenth_of_the_way(tenth, tmp_path):
    moment = 0.3 + 4.3 * (tenth - 1) / 9  # it takes 4.6 s
    journey = played("go-x-cm", with_fault(tmp_path, f'kind = "cut"\nat = {moment:.2f}\nfor = 3', LINK), cm=10)
    assert journey.way == pytest.approx(0.10, abs=0.002)
    assert journey.outcome.reason == "done"


def test_a_robot_that_went_too_far_while_the_link_was_gone_is_driven_back(tmp_path):
    journey = played("go-x-cm", with_fault(tmp_path, 'kind = "cut"\nat = 2.5\nfor = 3', LINK), cm=10)
    assert "returning" in journey.names
    assert "lost" in journey.names


def test_a_reset_on_the_way_costs_no_more_than_what_was_driven_since_the_last_answer(tmp_path):
    journey = played("go-x-cm", with_fault(tmp_path, 'kind = "reset"\nat = 2.5', LINK), cm=10)
    assert journey.way == pytest.approx(0.10, abs=0.006)
    assert journey.names[-1] == "arrived"


def test_backwards_is_negative():
    journey = played("go-x-cm", LINK, cm=-5)
    assert journey.way == pytest.approx(0.05, abs=0.001)


def test_a_time_that_is_over_ends_it_on_the_way_and_the_robot_stands():
    journey = played("go-x-cm", LINK, seconds=2, cm=50)
    assert journey.outcome.reason == "time"
    assert 0.01 < journey.way < 0.1


def test_the_pace_is_0_at_the_goal_and_the_fastest_far_from_it():
    assert pace(0, 300, 500, 0.1) == 0
    assert pace(5000, 500, 500, 0.1) == 500
    assert pace(-5000, 0, 500, 0.1) == -500


def test_the_pace_shrinks_with_the_way_that_is_left_when_the_command_takes_effect():
    assert pace(100, 0, 500, 0.1) > pace(100, 200, 500, 0.1) > pace(50, 200, 500, 0.1)
    assert pace(10, 200, 500, 0.1) == 0  # in 0.1 s it is 10 steps beyond: stop now


def test_at_the_end_a_wheel_makes_no_second_step_while_an_answer_is_on_its_way():
    for trip in (0.02, 0.06, 0.1, 0.4, 1.0):
        assert 1 <= pace(1, 0, 500, trip) <= max(1, 0.5 / trip)


def test_backwards_is_driving_and_not_returning():
    assert played("go-x-cm", LINK, cm=-5).names[0] == "driving"


def test_an_error_in_a_callback_ends_it_at_once():
    def watch(run, robots):
        def fail(event):
            raise ZeroDivisionError("in a listener")

        run.listeners.append(fail)

    with pytest.raises(ZeroDivisionError, match="in a listener"):
        play(find("go-x-cm"), LINK, seconds=5, watch=watch)


def test_a_lost_answer_while_the_counters_are_restored_after_a_reset_does_not_move_the_goal(tmp_path):
    fault = 'kind = "reset"\nat = 2.5\n[[fault]]\nkind = "loss"\nprobability = 0.3\nfrom = 2.5\nuntil = 9'
    journey = played("go-x-cm", with_fault(tmp_path, fault, LINK), cm=10)
    assert journey.way == pytest.approx(0.10, abs=0.01)
