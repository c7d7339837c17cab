"""The samples that are machines of states: how they are run, and how their picture is read from their text."""

from __future__ import annotations

from importlib.resources import files
from itertools import pairwise

import pytest

from elib.behaviours import RunContext, behaviour, find, play, states
from elib.robot.blocking import BlockingEpuck
from elib.tools.states.text import MachineText

ARROWS = {
    "bull": {
        "waking": {"searching"},
        "searching": {"charging", "wandering"},
        "charging": {"searching", "backing"},
        "backing": {"avoiding"},
        "wandering": {"searching", "avoiding", "stuck"},
        "avoiding": {"wandering"},
        "stuck": {"wandering"},
    },
    "go_to_light": {
        "seeking": {"passing", "wandering", "avoiding"},
        "wandering": {"seeking", "avoiding"},
        "passing": {"seeking", "arriving"},
        "arriving": {"seeking", "arrived"},
        "arrived": {"end"},
        "avoiding": {"seeking"},
    },
}


def read(sample: str) -> MachineText:
    return MachineText((files("elib.behaviours") / f"{sample}.py").read_text(encoding="utf-8"))


@pytest.mark.parametrize("sample", ARROWS)
def test_every_arrow_of_a_sample_is_read_from_the_methods_of_its_class(sample: str) -> None:
    program = read(sample)
    found = [(each.source, each.target) for each in program.arrows]
    assert sorted(found) == sorted((one, other) for one, others in ARROWS[sample].items() for other in others)
    assert list(program.states) == list(ARROWS[sample])
    assert program.problems == []


@pytest.mark.parametrize(("sample", "seconds"), [("bull", 60), ("go_to_light", 30)])
def test_a_sample_goes_only_the_ways_that_its_picture_shows(sample: str, seconds: float) -> None:
    outcome = play(find(sample), "sim://?speed=max", seconds=seconds)
    gone = set(pairwise(name for _, name in outcome.states))
    assert len(gone) >= 3
    assert gone <= {(each.source, each.target) for each in read(sample).arrows}


def test_an_arrow_without_a_condition_behind_code_that_may_return_is_not_always_taken() -> None:
    words = {(each.source, each.target): each.words for each in read("bull").arrows}
    assert words["wandering", "avoiding"] == "otherwise"
    assert words["avoiding", "wandering"] == "always"


def test_a_plain_behaviour_calls_a_machine_of_methods_and_goes_on_when_it_has_ended() -> None:
    class Turner:
        def __init__(self, turns: int) -> None:
            self.turns = turns

        def turning(self, robot: BlockingEpuck, run: RunContext) -> str | None:
            robot.turn(1.0)
            self.turns -= 1
            return "resting" if self.turns == 0 else None

        def resting(self, robot: BlockingEpuck) -> str:
            return "end"

    @behaviour(world="square")
    def turn_thrice(robot: BlockingEpuck, run: RunContext) -> None:
        turner = Turner(3)
        machine = states(turner.turning, turner.resting)
        machine(robot, run)
        run.say(f"{turner.turns} turns are left")

    outcome = play(turn_thrice, "sim://?speed=max", seconds=60)
    assert [name for _, name in outcome.states] == ["turning", "resting"]
    assert outcome.messages == ("0 turns are left",)
    assert outcome.reason == "done"


def test_a_state_in_which_no_step_would_be_done_is_not_entered() -> None:
    def driving(robot: BlockingEpuck, run: RunContext) -> str:
        run.wait_for(robot.begin.drive(0.1))
        return "standing"

    def standing(robot: BlockingEpuck) -> None:
        robot.stop()

    outcome = play(states(driving, standing), "sim://square?speed=max", seconds=0.5)
    assert [name for _, name in outcome.states] == ["driving"]
    assert outcome.reason == "time"
