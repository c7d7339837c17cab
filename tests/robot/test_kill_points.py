"""Whatever ends, suspends or freezes a program that drives: its robot stands."""

import os
import random
import sys

import pytest

if sys.platform != "linux":
    pytest.skip("signals and ptys as Linux has them", allow_module_level=True)

from kill_points import Draw, draw, kill, pairs

KILLS = int(os.environ.get("ELIB_KILLS", "14"))
"""How many killings; more of them by hand."""


def drawn() -> list[Draw]:
    """Return killings of all programs, by all that may end them."""
    chance = random.Random(KILLS)
    todo = pairs()
    chance.shuffle(todo)
    return [draw(chance, *todo[index % len(todo)]) for index in range(KILLS)]


@pytest.mark.long
@pytest.mark.parametrize("each", drawn(), ids=lambda each: f"{each.program} {' '.join(each.numbers)}")
def test_whatever_ends_a_program_its_robot_stands(each: Draw) -> None:
    ended = kill(each)
    assert ended.is_right(each), (each, ended)
