"""A drawn share of the campaign: every behaviour, over each kind of bad link, with one of the firmwares."""

from __future__ import annotations

from pathlib import Path

import pytest
from campaign import FAULTS, WRONG, Case, judge
from story_rig import drawn

from elib.behaviours import behaviours

CASES = [
    pytest.param(
        Case(name, fault, drawn(1, f"{name} {fault}")[0]),
        id=f"{name}-{fault}",
        marks=() if index % len(FAULTS) == place else pytest.mark.long,  # the faults take turns
    )
    for index, name in enumerate(behaviours())
    for place, fault in enumerate(FAULTS)
]


@pytest.mark.parametrize("case", CASES)
def test_over_a_bad_link_a_behaviour_goes_on_or_ends_with_a_reason_that_is_true(
    case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # some of them leave files
    verdict = judge(case)
    assert verdict.kind != WRONG, verdict.words
