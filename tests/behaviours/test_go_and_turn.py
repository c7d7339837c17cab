"""The square of 15 cm."""

from __future__ import annotations

import pytest
from played import in_weather, played

BLUETOOTH = "sim://arena?speed=max&latency=0.03&jitter=0.015"


@pytest.mark.parametrize("seed", range(5))
def test_the_square_closes_within_two_millimetres_and_a_degree_over_bluetooth(seed):
    square = played("go-and-turn", f"{BLUETOOTH}&seed={seed}")
    assert square.way < 0.002
    assert abs(square.rotation) < 1.0
    assert square.names == [f"{what}-{corner}" for corner in (1, 2, 3, 4) for what in ("side", "turn")]


def test_the_same_square_is_the_same_trajectory():
    assert played("go-and-turn", BLUETOOTH).hash == played("go-and-turn", BLUETOOTH).hash


@pytest.mark.parametrize("link", ["loss=0.05&latency=0.03", "latency=0.2"])
def test_it_closes_over_bad_links_too(link):
    square = played("go-and-turn", f"sim://arena?speed=max&{link}")
    assert square.way < 0.002
    assert abs(square.rotation) < 1.0


def test_the_side_is_an_option():
    assert played("go-and-turn", BLUETOOTH, seconds=6, side=0.2).way == pytest.approx(0.2, abs=0.001)


def test_a_time_that_is_over_ends_it_in_the_middle_of_a_side():
    square = played("go-and-turn", BLUETOOTH, seconds=2)
    assert square.names == ["side-1"]
    assert square.outcome.duration < 2.5
    assert 0.05 < square.way < 0.13


def test_a_link_that_is_cut_ends_it_with_a_warning_that_the_robot_may_still_be_moving(tmp_path):
    from elib.errors import LinkLost

    with pytest.raises(LinkLost, match="may still be moving"):
        played("go-and-turn", in_weather(tmp_path, 'kind = "cut"\nat = 2\nfor = 3', BLUETOOTH))
