"""The square of 15 cm."""

from __future__ import annotations

import random

import pytest
from played import played

from elib.base.errors import LinkLost
from elib.link.protocol.profiles import PROFILES
from lanes import each_once, short
from shared import with_fault

BLUETOOTH = "sim://arena?speed=max&quality=ideal&latency=0.03&jitter=0.015"


@pytest.mark.parametrize("seed", short(range(3), 0))
def test_the_square_closes_within_two_millimetres_and_a_degree_over_bluetooth(seed):
    square = played("go-and-turn", f"{BLUETOOTH}&seed={seed}")
    assert square.way < 0.002
    assert abs(square.rotation) < 1.0
    assert square.names == [f"{what}-{corner}" for corner in (1, 2, 3, 4) for what in ("side", "turn")]


def test_the_same_square_is_the_same_trajectory():
    assert played("go-and-turn", BLUETOOTH).hash == played("go-and-turn", BLUETOOTH).hash


@pytest.fixture
def field(tmp_path):
    """A world with room to overrun while the link is gone: in the arena the robot would slip along a wall."""
    path = tmp_path / "field.toml"
    path.write_text("""about = "Room and nothing else."

[arena]
size = [3.0, 3.0]

[[robot]]
position = [1.5, 1.5]
heading = 35
""")
    return f"sim://{path}?speed=max&quality=ideal"


LINKS = ("loss=0.05", "latency=0.2", "latency=0.1&jitter=0.05", "latency=0.03&jitter=0.015")


@pytest.mark.parametrize(
    ("firmware", "link"),
    each_once(PROFILES, LINKS),
)
def test_it_closes_within_a_millimetre_over_bad_links_on_every_firmware(firmware, link, field):
    for seed in random.Random(f"{firmware} {link}").sample(range(10**6), 2):
        square = played("go-and-turn", f"{field}&firmware={firmware}&{link}&seed={seed}")
        assert square.way < 0.001, seed
        assert abs(square.rotation) < 0.3, seed


def test_the_side_is_an_option():
    assert played("go-and-turn", BLUETOOTH, seconds=6, side=0.2).way == pytest.approx(0.2, abs=0.001)


def test_a_time_that_is_over_ends_it_in_the_middle_of_a_side():
    square = played("go-and-turn", BLUETOOTH, seconds=2)
    assert square.names == ["side-1"]
    assert square.outcome.duration < 2.5
    assert 0.05 < square.way < 0.13


def test_a_link_that_is_cut_ends_it_with_a_warning_that_the_robot_may_still_be_moving(tmp_path):
    with pytest.raises(LinkLost, match="may still be moving"):
        played("go-and-turn", with_fault(tmp_path, 'kind = "cut"\nat = 2\nfor = 3', BLUETOOTH))
