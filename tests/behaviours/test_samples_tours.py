"""The samples on raw bytes and in the callback style."""

from __future__ import annotations

import asyncio
from itertools import pairwise

import pytest

from elib.behaviours import RunContext, RunResult, find, play, run_behaviour
from elib.behaviours._run.tours import line, summarize, timeout_for
from elib.behaviours.asynchronous_sensors import questions
from elib.behaviours.port_turn_around import PERIOD, STAND, TURN, timetable
from elib.link.protocol.image import Image
from elib.link.protocol.profiles import PROFILES
from elib.link.protocol.quantities import CameraMode
from elib.link.protocol.values import Selector, Steps, Version, Wheels
from elib.link.session import Called, Ended, TraceEvent
from elib.link.transport import open_transport
from elib.link.transport.memory import memory_pair
from elib.robot.aio import Epuck
from elib.simulator.emulator.sim_transport import SimTransport
from elib.testing import link_of, simulated

SIM = "sim://square?speed=max"
TOURS = ["actuators-tour", "sensors-tour", "asynchronous-sensors"]


class Witness:
    """Records every call of a run and how it ended, with the time in s since the run began."""

    def __init__(self) -> None:
        self.events: list[tuple[float, TraceEvent]] = []

    def __call__(self, run: RunContext, robots: tuple[Epuck, ...]) -> None:
        robots[0].trace(lambda time, event: self.events.append((run.time, event)))

    @property
    def called(self) -> list[tuple[float, str]]:
        return [(time, str(event.request)) for time, event in self.events if isinstance(event, Called)]

    def ended(self, name: str) -> float:
        return next(time for time, event in self.events if isinstance(event, Ended) and event.request.name == name)


def is_call_of(command: str, event: TraceEvent) -> bool:
    return isinstance(event, Called) and event.request.name == command


def outcomes(outcome: RunResult) -> list[tuple[float, str, str]]:
    """Return what was said about each command: the time, OK, KO or --, and its name."""
    told = [text.split() for text in outcome.messages]
    return [(float(words[0]), words[2], words[3].rstrip(":")) for words in told if words[2] in ("OK", "KO", "--")]


# -- raw bytes ---------------------------------------------------------------------------------------------------------


def test_the_timetable_turns_for_a_second_and_stands_for_three() -> None:
    times, commands = zip(*timetable(), strict=True)
    assert commands == (TURN,) * 10 + (STAND,) * 30
    assert times == pytest.approx([number / 10 for number in range(40)])


@simulated
async def test_every_line_is_written_at_its_time_though_nobody_answers() -> None:
    near, far = memory_pair()
    heard: list[tuple[float, bytes]] = []

    async def listen() -> None:
        while True:
            data = await far.read()
            heard.append((asyncio.get_running_loop().time(), data))

    listener = asyncio.create_task(listen())
    outcome = await run_behaviour(find("port-turn-around"), near)
    await asyncio.sleep(0)
    listener.cancel()
    assert heard[:-1] == [(pytest.approx(time), command) for time, command in timetable()]
    assert outcome.states == ((0.0, "turning"), (pytest.approx(1.0), "standing"))
    assert outcome.duration == pytest.approx(40 * PERIOD)


@simulated
async def test_the_robot_turns_left_by_what_its_wheels_rolled_and_then_stands() -> None:
    transport = await open_transport(SIM)
    assert isinstance(transport, SimTransport)
    world = transport.simulation.world
    assert world is not None
    before = world.pose(0)
    await run_behaviour(find("port-turn-around"), transport)
    transport.simulation.catch_up()
    after = world.pose(0)
    await asyncio.sleep(1)
    transport.simulation.catch_up()
    assert world.pose(0) == after
    await transport.close()
    # Both wheels roll 12.9 mm in the second, 53 mm apart (e-puck.md, 1): 0.49 rad.
    assert after.heading - before.heading == pytest.approx(0.486, rel=0.05)
    assert (after.x, after.y) == pytest.approx((before.x, before.y), abs=0.002)


# -- what is told ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (None, ""),
        ("first\nsecond", "2 lines"),
        (Steps(12, -7), "12, -7"),
        (Wheels(0.25, -1.0), "0.25, -1"),
        (Selector(position=11), "11"),
        (Version(text="Version\n1.1.3", firmware="btcom-1.1.3", hardware=""), "Version 1.1.3"),
        (Image(CameraMode.COLOUR, 40, 30, b""), "40 x 30 pixels, colour"),
        (3.5, "3.5"),
    ],
)
def test_an_answer_is_told_in_a_few_words(value: object, words: str) -> None:
    assert summarize(value) == words


def test_a_line_has_the_time_the_outcome_and_the_words() -> None:
    assert line(1.5, "OK", "encoders", "1, 2") == "   1.500 s  OK  encoders: 1, 2"
    assert line(12.25, "OK", "stop", "") == "  12.250 s  OK  stop"


def test_a_slow_command_keeps_its_own_timeout_and_a_quick_one_has_that_of_the_tour() -> None:
    assert timeout_for("proximity", 0.2) == 0.2
    assert timeout_for("proximity", 3.0) == 3.0
    assert timeout_for("reset", 0.2) == 6.0
    assert timeout_for("reset", 9.0) == 9.0


# -- the tours ---------------------------------------------------------------------------------------------------------


def test_the_actuators_are_called_one_after_the_other_in_the_order_of_2011() -> None:
    witness = Witness()
    outcome = play(find("actuators-tour"), SIM, watch=witness)
    called = witness.called[: len(outcomes(outcome))]
    assert [text for _, text in called] == [
        "reset()",
        "set_body_led(TOGGLE)",
        "calibrate_proximity()",
        "set_front_led(TOGGLE)",
        "set_led(8, TOGGLE)",
        "set_speed(1.0, -1.0)",
        "play_sound(3)",
        "set_camera(40, 40, 8, GREY)",
        "set_encoders(3001, -3000)",
        "stop()",
    ]
    times = {text.partition("(")[0]: time for time, text in called}
    for earlier, later in pairwise(times):
        assert times[later] >= witness.ended(earlier)
    assert times["set_body_led"] - witness.ended("reset") >= 1.5
    assert times["set_front_led"] - witness.ended("calibrate_proximity") >= 1.0


@pytest.mark.parametrize("name", TOURS)
def test_every_answer_is_told_once_in_order_with_its_time(name: str) -> None:
    witness = Witness()
    outcome = play(find(name), SIM, watch=witness)
    told = outcomes(outcome)
    assert [word for _, word, _ in told] == ["OK"] * len(told)
    assert [command for _, _, command in told] == [text.partition("(")[0] for _, text in witness.called[: len(told)]]
    assert all(time == pytest.approx(witness.ended(command), abs=0.001) for time, _, command in told)


def test_each_step_of_a_tour_is_a_state() -> None:
    outcome = play(find("actuators-tour"), SIM)
    assert [state for _, state in outcome.states] == [command.replace("_", "-") for _, _, command in outcomes(outcome)]


def test_the_sensors_tour_tells_the_values() -> None:
    lines = play(find("sensors-tour"), "sim://square?speed=max&firmware=btcom-2.0").messages
    assert len(lines) == 12
    assert any(text.endswith("OK  encoders: 0, 0") for text in lines)
    assert any(text.endswith("OK  camera: 1, 40, 40, 8, 3200") for text in lines)
    assert any(text.endswith("OK  image: 40 x 40 pixels, colour") for text in lines)
    proximity = next(text for text in lines if "proximity" in text)
    assert proximity.count(",") == 7


@pytest.mark.parametrize("firmware", PROFILES)
@pytest.mark.parametrize("name", TOURS)
def test_a_tour_ends_on_every_firmware_and_tells_what_the_firmware_does_not_have(name: str, firmware: str) -> None:
    outcome = play(find(name), f"{SIM}&firmware={firmware}")
    told = outcomes(outcome)
    absent = {command for _, word, command in told if word == "--"}
    assert absent == {command for _, _, command in told} & set(PROFILES[firmware].absent)
    assert all(word == "OK" for _, word, command in told if command not in absent)
    assert outcome.reason == "done"


@pytest.mark.parametrize(("name", "command"), [("actuators-tour", "set_front_led"), ("sensors-tour", "encoders")])
def test_a_lost_answer_is_told_and_the_tour_goes_on(name: str, command: str) -> None:
    def watch(run: RunContext, robots: tuple[Epuck, ...]) -> None:
        link = link_of(robots[0])
        robots[0].trace(lambda time, event: link.lose_next_reply() if is_call_of(command, event) else None)

    outcome = play(find(name), SIM, watch=watch)
    assert {command: word for _, word, command in outcomes(outcome) if word != "OK"} == {command: "KO"}
    assert any(f"KO  {command}: {command}(" in text and "did not end within 1 s" in text for text in outcome.messages)


def test_a_tour_ends_when_its_time_is_over() -> None:
    outcome = play(find("actuators-tour"), SIM, seconds=2.0)
    assert outcome.reason == "time"
    assert outcome.duration < 4.0
    assert len(outcomes(outcome)) < 4


@pytest.mark.parametrize("timeout", [0.0, 0.05])
def test_with_no_time_at_all_everything_quick_fails_and_is_told(timeout: float) -> None:
    outcome = play(find("sensors-tour"), f"{SIM}&latency=0.1", options={"timeout": timeout})
    assert {command for _, word, command in outcomes(outcome) if word == "OK"} == {"image"}


# -- eleven questions at once ------------------------------------------------------------------------------------------


def test_a_question_never_has_less_time_than_the_one_before_it() -> None:
    shares = [share for _, share in questions()]
    assert len(shares) == 11
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (1, 10)


def test_all_is_asked_before_anything_is_answered_and_the_gap_is_shown() -> None:
    witness = Witness()
    outcome = play(find("asynchronous-sensors"), SIM, watch=witness)
    asked = witness.called[:11]
    first_end = min(time for time, event in witness.events if isinstance(event, Ended))
    assert max(time for time, _ in asked) < first_end
    assert outcome.messages[0].endswith("11 questions asked in 0.000 s")
    assert outcome.messages[-1].endswith("s after the last question")
    assert float(outcome.messages[-1].split()[0]) == pytest.approx(outcome.duration, abs=0.01)
    assert [state for _, state in outcome.states] == ["asking", "listening"]


def test_asking_ends_when_the_time_is_over_though_answers_are_missing() -> None:
    outcome = play(find("asynchronous-sensors"), f"{SIM}&latency=0.2", seconds=0.5, options={"timeout": 5.0})
    assert outcome.reason == "time"
    assert outcome.duration < 2.5


# -- link faults -------------------------------------------------------------------------------------------------------
