"""Both engines compute the same in random worlds, to the last bit.

Here in a few of them; ``python tests/physics/random_worlds.py --worlds 2000`` compares them in many.
"""

import pytest
from random_worlds import engines_disagree, random_states, random_worlds

BLOCK = 10


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 20, BLOCK))
def test_interpreted_and_compiled_agree_in_random_worlds_with_one_thread_and_with_two(first):
    found = []
    for scene, robots in random_worlds(BLOCK, first=first):
        found += engines_disagree(scene, robots)
    assert not found, "\n".join([f"{len(found)} differences", *found[:20]])


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 120, 60))
def test_interpreted_and_compiled_agree_in_random_worlds_with_states(first):
    found = []
    for scene, robots in random_states(30, first=first):
        found += engines_disagree(scene, robots, ticks=120, threads=(1,))
    assert not found, "\n".join([f"{len(found)} differences", *found[:20]])
