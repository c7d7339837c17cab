"""Bull, billiard and go-to-light from random places.

Places are the world's, not what the robot believes. Times are simulated.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from story_rig import Run, drawn, red_at_rest, run

from elib.base.files import WORLDS as FOLDER
from lanes import short

STARTS = drawn(10, "starts")
"""Seeds that draw where the robot starts, and the noise of its sensors."""
BLUETOOTH = "latency=0.03"
"""The keys of a link like that of 2011, on which a reading took 60 ms (wire-protocol.md, 5.13)."""


def without(name: str, *things: str) -> str:
    """Return a world of the gallery as a file, less the things whose tables contain one of these words."""
    head, *tables = (files("elib") / FOLDER / f"{name}.toml").read_text(encoding="utf-8").split("\n[[")
    return "\n[[".join([head, *(table for table in tables if not any(thing in table for thing in things))])


ONE_RED_BOX = without("red-boxes", "robot]]", '"red 2"', '"red 3"')
"""One red box to find, among boxes of other colours that hide it; without a start, so that the seed draws one."""
LIGHT = without("light", "robot]]")
"""The gallery's two lamps, screen and post."""
TABLE = without("billiard", "robot]]")


FEW_OR_ALL = [
    pytest.param(STARTS[:2], id="two"),
    pytest.param(STARTS, id="ten", marks=pytest.mark.long),
]


Played = Callable[..., Run]


@pytest.fixture
def played(tmp_path: Path) -> Played:
    """Run a behaviour in a world, from the place that a seed draws."""

    def play(name: str, world: str, seed: int, **how: Any) -> Run:
        path = tmp_path / "world.toml"
        path.write_text(world, encoding="utf-8")
        return run(name, f"{path}?robots=1&{BLUETOOTH}", seed, **how)

    return play


@pytest.mark.parametrize("starts", FEW_OR_ALL)
def test_the_bull_finds_and_hits_the_red_box_from_random_starts(played: Played, starts: list[int]) -> None:
    times = []
    for seed in starts:
        found = played("bull", ONE_RED_BOX, seed, seconds=300, look=red_at_rest, until=0.5)
        assert found.outcome is not None
        assert found.outcome.reason == "there", f"seed {seed}: {found.outcome.states}"
        assert found.states[-1] == "charging"
        times.append(found.outcome.duration)
    assert sorted(times)[len(times) // 2] < 31, "half of them see it in their first look around"


@pytest.mark.parametrize("minutes", short([1, 10], 1))
def test_billiard_runs_for_minutes_without_a_touch_of_more_than_a_second(played: Played, minutes: int) -> None:
    found = played("billiard", TABLE, 1, seconds=60 * minutes)
    assert found.longest_touch < 1
    assert found.path > 1.5 * minutes
    assert found.states.count("rebounding") > 1.5 * minutes
    assert found.outcome is not None
    assert found.outcome.reason == "time"
    assert found.stands()


def from_lamps(found: Run) -> dict[str, float]:
    """Return how far the robot is from each lamp, m."""
    pose = found.world.pose(0)
    return {lamp.name: math.dist((pose.x, pose.y), (lamp.x, lamp.y)) for lamp in found.world.snapshot().lights}


@pytest.mark.parametrize("starts", FEW_OR_ALL)
def test_go_to_light_ends_within_five_centimetres_of_the_bright_lamp_from_random_starts(
    played: Played, starts: list[int]
) -> None:
    for seed in starts:
        found = played("go-to-light", LIGHT, seed, seconds=120)
        assert found.outcome is not None
        assert from_lamps(found)["bright"] < 0.05, f"seed {seed} from {found.poses[0]}: {found.outcome.states}"
        assert found.states[-1] == "arrived"
        assert found.outcome.reason == "done"
        assert found.stands()


@pytest.mark.parametrize("seeds", [[123], pytest.param(drawn(10, "overhead"), marks=pytest.mark.long)], ids=len)
def test_go_to_light_says_that_a_light_is_overhead_only_where_one_is(played: Played, seeds: list[int]) -> None:
    for seed in seeds:  # 123 once stopped beside the dim lamp
        found = played("go-to-light", LIGHT, seed, seconds=120)
        assert found.outcome is not None
        nearest = min(from_lamps(found).values())
        assert ("the light is overhead" in found.outcome.messages) == (found.outcome.reason == "done")
        assert found.outcome.reason != "done" or nearest < 0.05, f"seed {seed}: {nearest:.3f} m beside it"
