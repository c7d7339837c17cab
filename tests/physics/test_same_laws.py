"""The physics obeys the same laws as that of commit ccb7641, in a third of 300 random worlds without pushable things.

Poses agree within a micrometre over one second, encoders and contacts are equal, and other readings agree within
rounding. Counts of sensors are equal or one apart, and at most 1 % of them are not equal. Of a picture's pixels at
most 1 % may differ by more than one count in a channel: a ray that meets an edge may fall to either side of it. The
docstring of ``record_laws.py`` says how the worlds were recorded, and which were left out.
"""

import pytest
import record_laws

from lanes import short

BLOCK = 30


@pytest.fixture(scope="module")
def recorded():
    return record_laws.load()


@pytest.mark.parametrize("first", short([0, *range(BLOCK, record_laws.WORLDS, 3 * BLOCK)], 0))
def test_robots_in_random_worlds_do_and_read_what_they_did_by_the_earlier_physics(recorded, first):
    found, pairs = [], []
    for seed, before in recorded[first : first + BLOCK]:
        now = record_laws.play(seed)
        found += record_laws.differences(before, now, seed)
        if now["counts"].shape == before["counts"].shape:
            pairs.append((before, now))
    if pairs:
        found += record_laws.shifted(pairs)
    assert not found, "\n".join([f"{len(found)} differences", *found[:20]])
