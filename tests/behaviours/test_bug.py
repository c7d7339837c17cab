"""Coming to a place without a map: straight on, along what is in the way, and on from where the line is met again."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from played import Played, played
from readings import NOTHING, near

from elib.base.pose import Pose
from elib.behaviours.bug import SPIN, Way

WALL = near(front_left=600, front_right=600)


def off(run: Played, x: float, y: float) -> float:
    """Return how far a run ended from a place that is seen from its start, m."""
    cosine, sine = math.cos(run.before.heading), math.sin(run.before.heading)
    goal = run.before.x + cosine * x - sine * y, run.before.y + sine * x + cosine * y
    return math.dist(goal, (run.after.x, run.after.y))


def test_with_nothing_in_the_way_it_turns_to_the_place_and_drives_there() -> None:
    way = Way(0.0, 0.5)
    assert way(Pose(0, 0), NOTHING, 0.4) == (-SPIN, SPIN)
    assert way(Pose(0, 0, math.pi / 2), NOTHING, 0.4) == pytest.approx((0.4, 0.4))
    assert way(Pose(0, 0.495, math.pi / 2), NOTHING, 0.4) == (0, 0)
    assert way.state == "there"


def test_at_a_wall_it_turns_left_and_follows_it_until_it_is_on_the_line_and_nearer() -> None:
    way = Way(1.0, 0.0)
    way(Pose(0, 0), NOTHING, 0.4)
    wheels = way(Pose(0.3, 0), WALL, 0.4)
    assert way.state == "along"
    assert wheels.left < 0 < wheels.right
    for place, state in (
        ((0.3, 0.1), "along"),
        ((0.5, 0.1), "along"),
        ((0.325, 0.0), "along"),
        ((0.5, 0.01), "straight"),
    ):
        way(Pose(*place), near(right=220, diagonal_right=200), 0.4)
        assert way.state == state, place


def test_back_where_it_met_the_wall_it_gives_up() -> None:
    way = Way(1.0, 0.0)
    way(Pose(0, 0), NOTHING, 0.4)
    for place in ((0.3, 0.0), (0.3, 0.3), (0.6, 0.3), (0.3, 0.0)):
        way(Pose(*place), WALL, 0.4)
    assert way.state == "enclosed"


def test_a_drawn_robot_comes_round_a_wall_to_the_place(tmp_path: Path) -> None:
    world = tmp_path / "wall.toml"
    world.write_text("""
[arena]
size = [0.8, 0.6]

[[wall]]
from = [0.4, 0.15]
to = [0.4, 0.4]

[[robot]]
position = [0.2, 0.3]
""")
    run = played("bug", f"sim://{world}?speed=max&quality=typical&seed=1", seconds=60, x=0.4, y=0.0)
    assert run.outcome.reason == "done"
    assert run.names == ["calibrating", "straight", "along", "straight", "there"]
    assert off(run, 0.4, 0.0) < 0.1
