"""Whatever happens on the line, each call ends exactly once, in time, with its own value or an error."""

import asyncio
import os
from collections.abc import Sequence

import pytest
from honest_rig import Call, HonestRig, honest_rig
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from elib.base.errors import LinkError, LinkLost, ReplyTimeout
from elib.link.protocol.profiles import PROFILES
from elib.simulator.emulator.faults import Fault
from elib.testing import simulated
from shared import inside

SCHEDULES = int(os.environ.get("ELIB_SCHEDULES", "150"))
"""Schedules a test tries; set ELIB_SCHEDULES for a long run."""

seconds = st.sampled_from([0.0, 0.005, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0, 1.1, 2.5])
text_faults = st.one_of(
    st.just(Fault()),
    st.just(Fault(lose=True)),
    st.builds(lambda delay: Fault(delay=delay), seconds),
    st.just(Fault(halve=True)),
    st.builds(lambda delay: Fault(halve=True, delay=delay), seconds),
    st.just(Fault(copy_after=0.0)),
    st.builds(lambda delay: Fault(delay=delay, copy_after=0.0), seconds),
    st.builds(lambda at: Fault(corrupt=at), st.integers(0, 20)),
)
"""The line has no checksum: only a corruption that leaves no well-shaped answer can be seen, so a text byte gets its
high bit turned over. A copy comes at once: one that comes after the next request of its shape looks like its answer."""
timeouts = st.sampled_from([0.02, 0.05, 0.1, 0.2, 0.4, 1.0, 3.0])
gaps = st.sampled_from([0.0, 0.0, 0.0, 0.01, 0.1, 0.5, 2.0])
text_rows = st.sampled_from(
    ["ambient_light"] * 4 + ["set_speed", "stop", "set_body_led", "set_front_led", "speed", "encoders", "selector"]
)
blocks = st.lists(st.tuples(st.sampled_from([0.0, 0.05, 0.1, 0.3, 0.6, 1.0]), seconds), max_size=3)
"""When, s after the one before, the program blocks the event loop, and for how long: what is due meanwhile, answers and
timeouts alike, is due on the same turn of the loop afterwards."""
speeds = st.integers(-1000, 1000).map(lambda steps: steps / 1000)


@st.composite
def calls(draw: st.DrawFn, rows: st.SearchStrategy[str]) -> Call:
    name = draw(rows)
    args: tuple[object, ...] = ()
    if name == "set_speed":
        args = (draw(speeds), draw(speeds))
    elif name in ("set_body_led", "set_front_led"):
        args = (draw(st.integers(0, 1)),)
    return name, args, draw(timeouts), draw(gaps), draw(st.booleans())


schedule = settings(
    max_examples=SCHEDULES, deadline=None, derandomize=SCHEDULES <= 1000, suppress_health_check=list(HealthCheck)
)


STARTUP = 4.1
"""s that a robot is silent at most when it starts: the e-puck2."""
MIN_SILENCE = 3.0
"""s without an answer after which the session may give the robot up."""


def silence(faults: Sequence[Fault], blocks: Sequence[tuple[float, float]]) -> float:
    """Return for how long these faults and blocks could keep the session without an answer at most, s."""
    whole = Fault()
    return sum(1 + fault.delay for fault in faults if fault != whole) + sum(1 + seconds for _, seconds in blocks)


async def play(rig: HonestRig, script: list[Call], blocks: Sequence[tuple[float, float]] = ()) -> None:
    """Make the calls, some one after the other and some at once, and compare every outcome with what the robot did."""
    might_be_silent = silence(tuple(rig.link.faults), blocks) + sum(rig.silences)
    await rig.play(script, blocks)
    assert len(rig.outcomes) == len(script)
    for outcome in rig.outcomes:
        rig.check(outcome)
    error = rig.session.error
    is_cut = "no longer answers" not in str(error) and "never becomes quiet" not in str(error)
    assert error is None or is_cut or might_be_silent >= MIN_SILENCE, f"the session ended without a cause: {error}"


@schedule
@given(
    st.sampled_from(sorted(PROFILES)),
    st.lists(text_faults, max_size=8),
    st.lists(calls(text_rows), min_size=1, max_size=8),
    st.sampled_from([0.0, 0.01, 0.06]),
    blocks,
)
@simulated
async def test_any_schedule_of_bad_text_answers_gives_the_right_value_or_an_error(
    firmware: str, faults: list[Fault], script: list[Call], latency: float, blocks: list[tuple[float, float]]
) -> None:
    async with honest_rig(firmware, latency=latency, faults=faults) as rig:
        await play(rig, script, blocks)


binary_rows = {
    "btcom-1.1.3": ["attitude", "image", "ambient_light", "stop"],
    "btcom-2.0": ["attitude", "image", "ambient_light", "stop"],
    "asercom-1.2.2": ["attitude", "gyroscope", "temperature", "image", "ambient_light", "stop"],
    "epuck2": [
        "distance",
        "distance",
        "distance",
        "microphones",
        "accelerometer",
        "button",
        "image",
        "ambient_light",
        "set_rgb_led",
        "stop",
    ],
}
binary_faults = st.one_of(
    st.just(Fault()),
    st.just(Fault(lose=True)),
    st.builds(lambda delay: Fault(delay=delay), seconds),
    st.just(Fault(halve=True)),
    st.builds(lambda delay: Fault(halve=True, delay=delay), seconds),
    st.just(Fault(copy_after=0.0)),
)


@schedule
@given(
    st.sampled_from(sorted(PROFILES)),
    st.lists(binary_faults, max_size=8),
    st.data(),
    st.sampled_from([0.0, 0.01, 0.06]),
    blocks,
)
@simulated
async def test_any_schedule_of_bad_binary_answers_and_pictures_gives_the_right_value_or_an_error(
    firmware: str, faults: list[Fault], data: st.DataObject, latency: float, blocks: list[tuple[float, float]]
) -> None:
    script = data.draw(st.lists(calls(st.sampled_from(binary_rows[firmware])), min_size=1, max_size=6))
    script = [(name, (3, 0.1, 0.2, 0.3) if name == "set_rgb_led" else args, *rest) for name, args, *rest in script]
    async with honest_rig(firmware, latency=latency, faults=faults) as rig:
        await play(rig, script, blocks)


@schedule
@given(
    st.sampled_from(sorted(PROFILES)),
    st.lists(binary_faults, max_size=4),
    st.data(),
    st.lists(st.floats(0.0, 3.0), min_size=1, max_size=3),
)
@simulated
async def test_any_schedule_of_restarts_gives_the_right_value_or_an_error(
    firmware: str, faults: list[Fault], data: st.DataObject, restarts: list[float]
) -> None:
    rows = [*binary_rows[firmware], "set_speed", "set_body_led", "encoders"]
    script = data.draw(st.lists(calls(st.sampled_from(rows)), min_size=1, max_size=6))
    script = [(name, (3, 0.1, 0.2, 0.3) if name == "set_rgb_led" else args, *rest) for name, args, *rest in script]
    async with honest_rig(firmware, latency=0.01, faults=faults) as rig:
        loop = asyncio.get_running_loop()
        for at in restarts:
            loop.call_later(at, rig.restart)
        rig.silences += [STARTUP] * len(restarts)
        await play(rig, script)


@schedule
@given(
    st.sampled_from(sorted(PROFILES)),
    st.lists(text_faults, max_size=4),
    st.lists(calls(text_rows), min_size=1, max_size=6),
    st.integers(0, 60),
    st.booleans(),
)
@simulated
async def test_a_link_cut_at_any_byte_ends_every_call_once(
    firmware: str, faults: list[Fault], script: list[Call], at: int, toward_robot: bool
) -> None:
    async with honest_rig(firmware, latency=0.01, faults=faults) as rig:
        if toward_robot:
            rig.link.cut_after(to_robot=at)
        else:
            rig.link.cut_after(to_host=at)
        await play(rig, script)


@pytest.mark.parametrize("firmware", sorted(PROFILES))
def test_a_picture_cut_at_any_byte_ends_in_an_error_and_hangs_nobody(firmware: str) -> None:
    @simulated
    async def story(at: int) -> None:
        async with honest_rig(firmware, latency=0.01) as rig:
            await rig.call("set_camera", 8, 6, 8, 0, within=2)
            rig.link.cut_after(to_host=at)
            outcome = await rig.call("image", within=2)
            rig.check(outcome)
            assert isinstance(outcome.error, LinkError), outcome
            assert isinstance((await rig.call("selector", within=2)).error, LinkError)

    for at in range(51):
        story(at)


@pytest.mark.parametrize("firmware", sorted(PROFILES))
def test_a_command_cut_at_any_byte_ends_in_an_error_and_hangs_nobody(firmware: str) -> None:
    @simulated
    async def story(at: int) -> None:
        async with honest_rig(firmware, latency=0.01) as rig:
            rig.link.cut_after(to_robot=at)
            outcome = await rig.call("set_speed", 0.123, -0.456, within=2)
            rig.check(outcome)
            assert isinstance(outcome.error, LinkError), outcome

    for at in range(len(b"D,123,-456\r")):
        story(at)


@inside(honest_rig, "btcom-2.0")
async def test_a_robot_that_falls_silent_ends_every_call_in_time_and_the_session_once(rig: HonestRig) -> None:
    rig.link.silence()
    outcomes = await asyncio.gather(*(rig.call("ambient_light", within=w) for w in (0.1, 0.5, 2.0, 60.0, 60.0)))
    for outcome in outcomes:
        rig.check(outcome)
    assert [type(o.error) for o in outcomes] == [ReplyTimeout] * 3 + [LinkLost] * 2


@inside(honest_rig, "btcom-2.0")
async def test_a_robot_that_is_silent_for_a_while_is_found_again(rig: HonestRig) -> None:
    rig.link.silence()
    assert isinstance((await rig.call("ambient_light", within=0.1)).error, ReplyTimeout)
    await asyncio.sleep(30)
    rig.link.end_silence()
    outcome = await rig.call("ambient_light", within=2)
    rig.check(outcome)
    assert outcome.error is None


@inside(honest_rig, "btcom-1.1.3")
async def test_a_calibration_given_up_on_does_not_lose_the_link(rig: HonestRig) -> None:
    assert isinstance((await rig.call("calibrate_proximity", within=0.5)).error, ReplyTimeout)
    outcome = await rig.call("ambient_light", within=6)
    rig.check(outcome)
    assert outcome.error is None


# -- late copies -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("firmware", sorted(PROFILES))
def test_a_late_copy_of_another_answer_is_never_taken_for_a_binary_one(firmware: str) -> None:
    @simulated
    async def story(late: float) -> None:
        async with honest_rig(firmware, latency=0.005) as rig:
            gravity = (await rig.call("attitude", within=1)).value
            for row in ("ambient_light", "selector", "encoders", "speed"):
                rig.link.faults.append(Fault(copy_after=late))
                rig.check(await rig.call(row, within=1))
                for _ in range(3):
                    outcome = await rig.call("attitude", within=1)
                    rig.check(outcome)
                    assert outcome.error is not None or outcome.value == gravity, f"{late} s late"
                outcome = await rig.call("image", within=2)
                rig.check(outcome)

    for late in (0.001, 0.0105, 0.012, 0.02, 0.05, 0.2):
        story(late)


@pytest.mark.parametrize("firmware", ["btcom-2.0", "asercom-1.2.2"])
@simulated
async def test_a_byte_lost_or_added_in_a_binary_answer_is_an_error(firmware: str) -> None:
    """Without the guard the missing byte would be made up by the next answer's first."""
    async with honest_rig(firmware) as rig:
        for _ in range(4):
            rig.link.faults.append(Fault(halve=True))
            outcome = await rig.call("attitude", within=0.3)
            assert outcome.error is not None
            outcome = await rig.call("ambient_light", within=2)
            rig.check(outcome)
            assert outcome.error is None
