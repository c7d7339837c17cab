"""The set-up of a behaviour is repeated after a lost answer, like its loop."""

from __future__ import annotations

import pytest

from elib.behaviours import RunContext, find, play
from elib.link.protocol.profiles import PROFILES
from elib.link.session.statistics import LinkStats
from elib.robot.aio import Epuck
from elib.testing import link_of
from lanes import short


def statistics_with_lost_answers(name: str, url: str, lost: int) -> LinkStats:
    """Return the statistics of the links in a run in which each robot's first answers were lost."""

    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        for robot in robots:
            for _ in range(lost):
                link_of(robot).lose_next_reply()

    outcome = play(find(name), url, seconds=15, watch=watch)
    assert outcome.reason == "time"
    assert outcome.statistics is not None
    return outcome.statistics


BULL, BALL, CROWD = RUNS = (
    ("bull", "red-boxes", 1),
    ("follow-ball", "soccer", 1),
    ("aggregation", "crowd?robots=3", 3),
)
QUICK = [(*BULL, 1, "btcom-1.1.3"), (*BALL, 3, "btcom-2.0"), (*CROWD, 1, "asercom-1.2.2"), (*BULL, 3, "epuck2")]
"""Each behaviour, firmware and number of lost answers once."""


@pytest.mark.parametrize(
    ("name", "world", "robots", "lost", "firmware"),
    short([(*run, lost, firmware) for run in RUNS for lost in (1, 3) for firmware in PROFILES], *QUICK),
)
def test_a_camera_gets_its_settings_again_if_their_answer_is_lost(
    name: str, world: str, robots: int, lost: int, firmware: str
) -> None:
    joint = "&" if "?" in world else "?"
    statistics = statistics_with_lost_answers(name, f"sim://{world}{joint}speed=max&firmware={firmware}", lost)
    assert statistics.lost >= robots
    assert statistics.count > 20 * robots
