"""State machines: which state runs when, how they end, and what their errors say."""

from __future__ import annotations

import asyncio
import logging
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

import elib
from elib.behaviours import RunContext, RunResult, StateChanged, behaviour
from elib.link.protocol.profiles import PROFILES
from shared import with_fault

SIM = "sim://square?speed=max"


def done(*functions: object, url: str = SIM, seconds: float = 30, **how: object) -> RunResult:
    return elib.play(elib.states(*functions, **how), url, seconds=seconds)  # type: ignore[arg-type]


def names(result: RunResult) -> list[str]:
    return [name for _, name in result.states]


async def drive(robot: elib.Epuck, run: RunContext) -> str | None:
    if run.entered:
        await robot.set_speed(0.4, 0.4)
    return "turn" if (await robot.distances()).ahead < 0.04 else None


async def turn(robot: elib.Epuck) -> str:
    await robot.turn(1.6)
    return "drive"


async def stay(robot: elib.Epuck) -> None: ...


def drive_on(robot: elib.BlockingEpuck, run: RunContext) -> str | None:
    if run.entered:
        robot.set_speed(0.4, 0.4)
    return "turn_away" if robot.distances().ahead < 0.04 else None


def turn_away(robot: elib.BlockingEpuck) -> str:
    robot.turn(1.6)
    return "drive_on"


@pytest.mark.parametrize("firmware", list(PROFILES))
def test_a_machine_drives_and_turns_in_both_styles_on_every_firmware(firmware: str) -> None:
    url = f"sim://square?speed=max&firmware={firmware}"
    result, other = done(drive, turn, url=url), done(drive_on, turn_away, url=url)
    assert result.reason == other.reason == "time"
    assert names(result)[:3] == ["drive", "turn", "drive"]
    assert names(other)[:3] == ["drive_on", "turn_away", "drive_on"]
    assert [at for at, _ in result.states[:3]] == pytest.approx([at for at, _ in other.states[:3]], abs=0.2)


def test_a_state_is_entered_once_until_it_is_left_and_knows_how_long_it_lasts() -> None:
    seen: list[tuple[str, bool, float]] = []

    async def one(robot: elib.Epuck, run: RunContext) -> str | None:
        seen.append(("one", run.entered, run.time_in_state))
        return "two" if run.time_in_state > 0.2 else None

    async def two(robot: elib.Epuck, run: RunContext) -> str:
        seen.append(("two", run.entered, run.time_in_state))
        assert run.previous_state == "one"
        return "end"

    result = done(one, two)
    assert result.reason == "done"
    assert names(result) == ["one", "two"]
    assert [entered for _, entered, _ in seen] == [True, *[False] * (len(seen) - 2), True]
    times = [time for name, _, time in seen if name == "one"]
    assert times[0] == 0
    assert all(later - earlier == pytest.approx(0.05, abs=0.01) for earlier, later in pairwise(times))


def test_a_state_that_names_itself_is_entered_anew() -> None:
    async def again(robot: elib.Epuck, run: RunContext) -> str:
        return "end" if len(run.states) == 3 else "again"

    assert names(done(again)) == ["again"] * 3


def test_a_machine_begins_where_it_is_told_and_does_what_is_to_be_done_when_a_state_is_left() -> None:
    told: list[str] = []

    async def one(robot: elib.Epuck) -> str:
        return "end"

    async def two(robot: elib.Epuck) -> str:
        return "one"

    async def leave(robot: elib.Epuck) -> None:
        told.append("left")
        await robot.set_led(0, "on")

    result = done(one, two, start=two, exits={two: leave})
    assert names(result) == ["two", "one"]
    assert told == ["left"]


def test_a_machine_is_a_state_of_another_and_is_left_by_a_name_that_it_does_not_have() -> None:
    left: list[str] = []

    async def walk(robot: elib.Epuck, run: RunContext) -> str:
        return "look"

    async def look(robot: elib.Epuck, run: RunContext) -> str:
        return "rest" if len(run.states) > 3 else "walk"

    async def rest(robot: elib.Epuck, run: RunContext) -> str:
        return "end" if len(run.states) > 6 else "roam"

    async def leave_look(robot: elib.Epuck) -> None:
        left.append("look")

    async def leave_roam(robot: elib.Epuck) -> None:
        left.append("roam")

    roam = elib.states(walk, look, name="roam", exits={look: leave_look})
    result = done(roam, rest, exits={roam: leave_roam})
    assert names(result) == [
        "roam.walk",
        "roam.look",
        "roam.walk",
        "roam.look",
        "rest",
        "roam.walk",
        "roam.look",
        "rest",
    ]
    assert left == ["look", "look", "roam", "look", "roam"]


def test_a_machine_within_two_others_leaves_only_what_it_leaves() -> None:
    left: list[str] = []

    async def one(robot: elib.Epuck) -> str:
        return "two"

    async def two(robot: elib.Epuck) -> str:
        return "end"

    def leaving(name: str) -> object:
        async def leave(robot: elib.Epuck) -> None:
            left.append(name)

        return leave

    inner = elib.states(one, two, name="inner", exits={one: leaving("one")})  # type: ignore[dict-item]
    middle = elib.states(inner, name="middle", exits={inner: leaving("inner")})  # type: ignore[dict-item]
    result = done(middle, exits={middle: leaving("middle")})
    assert names(result) == ["middle.inner.one", "middle.inner.two"]
    assert left == ["one", "inner", "middle"]


def test_a_step_whose_answer_is_lost_is_done_again_as_the_first_one(tmp_path: Path) -> None:
    entered: list[bool] = []

    async def wait(robot: elib.Epuck, run: RunContext) -> str | None:
        return "go" if run.time > 2 else None

    async def go(robot: elib.Epuck, run: RunContext) -> str | None:
        entered.append(run.entered)
        if run.entered:
            await robot.set_speed(0.3, 0.3)
        return "end" if run.time_in_state > 2 else None

    result = done(wait, go, url=with_fault(tmp_path, 'kind = "loss"\nprobability = 1.0\nfrom = 1.5\nuntil = 2.6', SIM))
    assert result.reason == "done"
    assert result.statistics is not None
    assert result.statistics.lost > 0
    assert entered[:2] == [True, True]
    assert not any(entered[entered.index(False) :])
    assert names(result) == ["wait", "go"]


def test_a_state_begins_again_where_a_later_answer_is_lost_because_the_robot_stands_since(tmp_path: Path) -> None:
    entered: list[bool] = []

    async def go(robot: elib.Epuck, run: RunContext) -> str | None:
        entered.append(run.entered)
        if run.entered:
            await robot.set_speed(0.3, 0.3)
        speed = await robot.speed()
        return "end" if run.time > 4 and speed.left > 0.2 else None

    result = done(go, url=with_fault(tmp_path, 'kind = "loss"\nprobability = 1.0\nfrom = 1.5\nuntil = 2.6', SIM))
    assert result.reason == "done"
    assert entered[:2] == [True, False]
    assert any(entered[2:])
    assert not entered[-1]
    assert names(result) == ["go"]


def test_states_are_events_of_the_robot_with_run_play_and_within_a_behaviour() -> None:
    async def short(robot: elib.Epuck) -> str:
        return "end"

    machine = elib.states(short)

    async def main(robot: elib.Epuck) -> list[str]:
        await machine(robot)
        return [each.state for each in robot.events.recent if isinstance(each, StateChanged)]

    assert elib.run(main, robot=SIM) == ["short"]
    assert elib.run(machine, robot=SIM) is None

    @behaviour
    async def whole(robot: elib.Epuck, run: RunContext) -> None:
        run.say("before")
        await machine(robot, run)

    assert elib.play(whole, SIM).states[0][1] == "short"


def test_a_machine_that_ends_stops_its_robot_wherever_it_was_called_but_not_as_a_state_of_another() -> None:
    async def rolls(robot: elib.Epuck) -> bool:
        before = (await robot.encoders()).left
        await robot.sleep(0.5)
        return (await robot.encoders()).left > before + 100

    async def go(robot: elib.Epuck, run: RunContext) -> str | None:
        if run.entered:
            await robot.set_speed(0.3, 0.3)
        return "after" if run.time_in_state > 0.5 else None

    async def after(robot: elib.Epuck, run: RunContext) -> str:
        told.append(await rolls(robot))
        return "end"

    def roll(robot: elib.BlockingEpuck, run: RunContext) -> str | None:
        robot.set_speed(0.3, 0.3)
        return "end" if run.time_in_state > 0.5 else None

    told: list[bool] = []

    async def main(robot: elib.Epuck) -> None:
        await elib.states(elib.states(go, name="inner"), after)(robot)
        told.append(await rolls(robot))

    elib.run(main, robot=SIM)
    assert told == [True, False]
    with elib.connect(SIM) as blocking:
        elib.states(roll)(blocking)
        before = blocking.encoders().left
        blocking.sleep(0.5)
        assert blocking.encoders().left < before + 100


def test_a_swarm_runs_a_machine_for_each_robot() -> None:
    async def step(robot: elib.Epuck, run: RunContext) -> str | None:
        await robot.set_speed(0.2, 0.2)
        return "end" if run.time_in_state > 1 else None

    async def main(robots: elib.Swarm) -> list[int]:
        machine = elib.states(step)
        await asyncio.gather(*(machine(robot) for robot in robots))
        return [(await robot.encoders()).left for robot in robots]

    assert all(steps > 150 for steps in elib.swarm("sim://crowd?robots=3&speed=max").run(main))


PROGRAM = """
import elib

def go(robot, run):
    return "end" if run.time_in_state > 1 else None

machine = elib.states(go, name="walk")
"""


def test_elib_run_runs_the_machine_that_a_file_defines(tmp_path: Path) -> None:
    file = tmp_path / "program.py"
    file.write_text(PROGRAM)
    command = [sys.executable, "-m", "elib", "run", str(file), "--robot", SIM]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    assert "states      go 1.0 s" in ended.stderr


def test_a_name_of_no_state_is_refused_before_anything_is_opened() -> None:
    async def lost(robot: elib.Epuck) -> str | None:
        if robot.time < 0:
            return "stai"
        return None

    with pytest.raises(
        elib.ArgumentError, match=r"line \d+: state lost returns 'stai', but no state has this name"
    ) as error:
        elib.play(elib.states(lost, stay), "tcp://127.0.0.1:1")
    assert error.value.hint == 'did you mean "stay"?'


@pytest.mark.parametrize(
    ("answer", "hint"),
    [("stai", 'did you mean "stay"?'), (stay, 'did you mean "stay"?'), (3, "the states are: computed, stay")],
)
def test_what_a_state_returns_is_checked_as_it_runs(answer: object, hint: str) -> None:
    async def computed(robot: elib.Epuck) -> object:
        return answer

    with pytest.raises(elib.ArgumentError, match="state computed returns") as error:
        done(computed, stay)
    assert error.value.hint == hint


def test_a_state_that_nothing_leads_to_is_told_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    async def alone(robot: elib.Epuck) -> str:
        return "end"

    with caplog.at_level(logging.WARNING):
        done(alone, stay)
    assert "state stay is never reached: no state returns 'stay'" in caplog.text


def test_a_machine_runs_whose_text_is_not_what_its_file_has() -> None:
    names_of: dict[str, object] = {"__name__": __name__}  # its file is this one, which has other lines there
    exec(compile("async def go(robot):\n    return 'end'", "go.py", "exec"), names_of)
    assert done(names_of["go"]).reason == "done"


def test_wrong_machines_are_refused_with_what_to_do() -> None:
    def end(robot: elib.BlockingEpuck) -> None: ...

    def alone() -> None: ...

    for make, words in (
        (lambda: elib.states(), "at least one state"),
        (lambda: elib.states(drive, drive), "'drive' is the name of two states"),
        (lambda: elib.states(end), "'end' is what a state returns to end the machine"),
        (lambda: elib.states(drive, turn_away), "turn_away is a plain function, and others are not"),
        (lambda: elib.states(drive, start=turn), "'turn' is no state of this machine"),
        (lambda: elib.states(drive, exits={turn: turn}), "'turn' is no state of this machine"),
        (lambda: elib.states(lambda robot: None), "is no state"),
        (lambda: elib.states(alone), "alone does not take a robot"),
        (lambda: elib.states("drive"), "'drive' is no state"),  # type: ignore[arg-type]
        (lambda: elib.states(drive, period=0), "must be a number from 0.001"),
    ):
        with pytest.raises(elib.ArgumentError, match=words) as error:
            make()
        assert error.value.hint or "must be" in words
