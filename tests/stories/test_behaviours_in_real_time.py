"""The same behaviour over a pty in real time and in simulated time: the same named states, the same outcome."""

from __future__ import annotations

import math
import sys

import pytest
from elib_process import started

from elib.base.pose import Pose
from elib.behaviours import RunContext, RunResult, find, play
from elib.robot.aio import Epuck

SIMULATED = "sim://square?speed=max&latency=0.01"

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(sys.platform == "win32", reason="ptys are POSIX"),
]


def played(name: str, url: str, **options: object) -> tuple[RunResult, Pose]:
    """Play it; return how it went, and where odometry says that the robot stands."""
    robots: list[Epuck] = []

    def watch(run: RunContext, there: tuple[Epuck, ...]) -> None:
        robots.extend(there)

    outcome = play(find(name), url, seconds=60, options=options, watch=watch)
    return outcome, robots[0].motion.odometry.pose


@pytest.mark.parametrize(
    ("name", "options"),
    [("go-x-cm", {"cm": 4.0}), ("sensors-tour", {})],
)
def test_over_a_pty_in_real_time_it_passes_the_same_states_and_ends_the_same(
    name: str, options: dict[str, object]
) -> None:
    expected, there = played(name, SIMULATED, **options)
    with started("simulate", "square", "--pty", "--latency", "0.01") as server:
        url = server.out.line().split()[1]
        outcome, here = played(name, url, **options)
        assert server.end() == 0
    names = [[state for _, state in each.states] for each in (outcome, expected)]
    assert set(names[0]) - {"returning", "braking"} == set(names[1]) - {"returning", "braking"}
    assert names[0][0] == names[1][0]
    assert names[0][-1:] == names[1][-1:]
    assert outcome.reason == expected.reason == "done"
    assert math.dist((here.x, here.y), (there.x, there.y)) < 0.001
    assert math.remainder(here.heading - there.heading, math.tau) == pytest.approx(0, abs=math.radians(0.6))
