"""The honesty suite over Wi-Fi: whatever happens to the stream, each call ends once, in time, and rightly."""

import asyncio
import os
import struct
from collections.abc import Sequence
from typing import cast

import pytest
from honest_rig import Call, HonestRig, Outcome
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from test_honesty import MIN_SILENCE, gaps, timeouts

from elib.base.errors import LinkError, LinkLost, LinkNotFound, ReplyTimeout
from elib.link.session import Session
from elib.robot.reconnect import Policy, Reconnector
from elib.testing import simulated
from shared import inside
from wifi_robot import Air, Fault, WifiRig, WifiRobot, wifi_pair, wifi_rig

SCHEDULES = int(os.environ.get("ELIB_SCHEDULES", "100"))
"""Schedules a test tries; set ELIB_SCHEDULES for a long run."""

rows = st.sampled_from(
    ["ambient_light"] * 4
    + ["set_speed", "set_speed", "stop", "set_body_led", "set_front_led", "distance", "image", "image"]
    + ["set_encoders", "play_sound", "encoders"]
)
delays = st.sampled_from([0.0, 0.001, 0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 1.5])
shares = st.lists(st.floats(0, 1), max_size=3).map(tuple)
faults = st.one_of(
    st.just(Fault()), st.builds(lambda delay: Fault(delay), delays), st.builds(Fault, delays, shares, delays)
)
"""TCP loses, doubles and reorders nothing: what happens to it is that it is late, in pieces, or ends."""


@st.composite
def calls(draw: st.DrawFn) -> Call:
    name = draw(rows)
    args: tuple[object, ...] = ()
    if name == "set_speed":
        args = (draw(st.integers(-1000, 1000)) / 1000, draw(st.integers(-1000, 1000)) / 1000)
    elif name in ("set_body_led", "set_front_led"):
        args = (draw(st.integers(0, 1)),)
    elif name == "set_encoders":
        args = (draw(st.integers(-32768, 32767)), draw(st.integers(-32768, 32767)))
    elif name == "play_sound":
        args = (draw(st.integers(0, 6)),)
    return name, args, draw(timeouts), draw(gaps), draw(st.booleans())


schedule = settings(
    max_examples=SCHEDULES, deadline=None, derandomize=SCHEDULES <= 1000, suppress_health_check=list(HealthCheck)
)


SOUNDS = {0: 0x20, 1: 1, 2: 2, 3: 4, 4: 8, 5: 0x10, 6: 0x20}


def check(rig: WifiRig, honest: HonestRig, script: Sequence[Call]) -> None:
    """Compare every outcome with what the robot really did, and when."""
    assert len(honest.outcomes) == len(script)
    for outcome in honest.outcomes:
        honest.check(outcome)
        if outcome.error is None and outcome.name in ("set_speed", "set_encoders", "play_sound", "encoders"):
            check_act(rig, honest, outcome)
    # The robot repeats its newest command, so a torn pair acts until its other half comes; no command was sent twice.
    for name, is_so in (("set_encoders", lambda command: command[2] & 4), ("play_sound", lambda command: command[20])):
        asked = sum(outcome.name == name for outcome in honest.outcomes)
        adopted = sum(bool(is_so(command)) for command in rig.robot.adopted)
        assert adopted <= asked, f"{name} was sent more often than asked"
    assert rig.robot.wrong == []
    assert rig.robot.discarded == 0


def steps(args: Sequence[object]) -> list[int]:
    """Return speeds in rev/s as steps/s."""
    return [round(1000 * float(cast("float", arg))) for arg in args]


def check_act(rig: WifiRig, honest: HonestRig, outcome: Outcome) -> None:
    began, ended = outcome.called - honest.origin - 1e-9, outcome.ended - honest.origin + 1e-9
    acts = [(kind, what) for time, kind, what in rig.robot.acts if began <= time <= ended]
    match outcome.name:
        case "set_speed":
            # A newer speed, or a stop, may have taken its place: all of them get the outcome of the newest.
            later = [o for o in honest.outcomes if o.called >= outcome.called and o.name in ("set_speed", "stop")]
            speeds = [tuple(steps(o.args)) or (0, 0) for o in later]
            assert any(("drive", speed) in acts for speed in speeds), f"{outcome}: nothing was driven"
        case "set_encoders":
            assert ("steps", outcome.args) in acts, outcome
        case "play_sound":
            assert ("sound", SOUNDS[cast("int", outcome.args[0])]) in acts, outcome
        case "encoders":
            known = [(0, 0), *(w for _, kind, w in rig.robot.acts if kind == "steps")]
            assert tuple(cast("Sequence[int]", outcome.value)) in known


async def play(rig: WifiRig, script: list[Call], blocks: Sequence[tuple[float, float]] = ()) -> HonestRig:
    """Make the calls, some one after the other and some at once."""
    loop = asyncio.get_running_loop()
    honest = HonestRig(rig.session, rig.robot, rig.air, loop.time() - rig.robot.clock)  # type: ignore[arg-type]
    await honest.play(script, blocks)
    return honest


blocks = st.lists(st.tuples(st.sampled_from([0.0, 0.05, 0.1, 0.3, 0.6]), delays), max_size=2)


@schedule
@given(
    st.lists(calls(), min_size=1, max_size=8),
    st.lists(faults, max_size=10),
    st.lists(faults, max_size=10),
    st.sampled_from([0.0, 0.002, 0.01, 0.06]),
    blocks,
)
@simulated
async def test_any_schedule_of_stalls_and_torn_writes_gives_the_right_value_or_an_error(
    script: list[Call], up: list[Fault], down: list[Fault], latency: float, blocks: list[tuple[float, float]]
) -> None:
    async with wifi_rig(latency=latency, up=up, down=down) as rig:
        check(rig, await play(rig, script, blocks), script)
        stalls = sum(f.delay + f.pause * len(f.tears) for f in (*up, *down)) + sum(s for _, s in blocks)
        assert rig.session.error is None or stalls >= MIN_SILENCE, rig.session.error


@schedule
@given(
    st.lists(calls(), min_size=1, max_size=6),
    st.lists(faults, max_size=4),
    st.one_of(st.integers(0, 200), st.integers(0, 40000)),
    st.booleans(),
)
@simulated
async def test_a_link_cut_at_any_byte_ends_every_call_once(
    script: list[Call], faults: list[Fault], at: int, toward_robot: bool
) -> None:
    async with wifi_rig(latency=0.005, up=faults, down=faults) as rig:
        if toward_robot:
            rig.air.cut_up = at % 300
        else:
            rig.air.cut_down = at
        check(rig, await play(rig, script), script)


@pytest.mark.parametrize("row", ["ambient_light", "set_speed"])
def test_a_sensor_packet_cut_at_any_byte_ends_in_an_error_and_hangs_nobody(row: str) -> None:
    @simulated
    async def story(at: int) -> None:
        async with wifi_rig() as rig:
            rig.air.cut_down = at
            args = (0.5, 0.5) if row == "set_speed" else ()
            honest = await play(rig, [(row, args, 2.0, 0.0, True), ("selector", (), 2.0, 0.0, True)])
            for outcome in honest.outcomes:
                honest.check(outcome)
            assert isinstance(honest.outcomes[1].error, LinkError)

    for at in range(1, 212):  # for each call an empty packet and one of the sensors, 106 bytes
        story(at)


def test_a_picture_cut_at_any_byte_of_its_ends_and_some_in_between_ends_in_an_error() -> None:
    @simulated
    async def story(at: int) -> None:
        async with wifi_rig() as rig:
            rig.air.cut_down = at
            honest = await play(rig, [("image", (), 2.0, 0.0, True)])
            honest.check(honest.outcomes[0])
            assert isinstance(honest.outcomes[0].error, LinkError), at

    # The empty packet and the picture are 38,402 bytes.
    for at in (*range(1, 130), *range(130, 38380, 997), *range(38380, 38402)):
        story(at)


def test_a_command_cut_at_any_byte_ends_in_an_error_and_hangs_nobody() -> None:
    @simulated
    async def story(at: int) -> None:
        async with wifi_rig() as rig:
            rig.air.cut_up = at
            honest = await play(rig, [("set_speed", (0.123, -0.456), 2.0, 0.0, True)])
            honest.check(honest.outcomes[0])
            assert isinstance(honest.outcomes[0].error, LinkError), at

    for at in range(1, 42):
        story(at)


@inside(wifi_rig)
async def test_a_robot_that_falls_silent_ends_every_call_in_time_and_the_session_once(rig: WifiRig) -> None:
    rig.robot.is_silent = True
    script = [("ambient_light", (), within, 0.0, False) for within in (0.1, 0.5, 2.0, 60.0, 60.0)]
    honest = await play(rig, script)
    for outcome in honest.outcomes:
        honest.check(outcome)
    assert [type(o.error) for o in honest.outcomes] == [ReplyTimeout] * 3 + [LinkLost] * 2


@inside(wifi_rig)
async def test_a_robot_that_is_silent_for_a_while_is_found_again(rig: WifiRig) -> None:
    rig.robot.is_silent = True
    honest = await play(rig, [("ambient_light", (), 0.1, 0.0, True)])
    assert isinstance(honest.outcomes[0].error, ReplyTimeout)
    await asyncio.sleep(30)
    rig.robot.is_silent = False
    honest = await play(rig, [("ambient_light", (), 2.0, 0.0, True)])
    honest.check(honest.outcomes[0])
    assert honest.outcomes[0].error is None


# -- a robot that comes back -------------------------------------------------------------------------------------------

breaks = st.lists(
    st.tuples(st.sampled_from([0.01, 0.02, 0.05, 0.3, 1.0, 2.0]), st.sampled_from(["cut", "clear", "noise"])),
    max_size=6,
)
"""What happens to the link: a pause, s, and the event after it."""


@schedule
@given(
    st.lists(calls(), min_size=1, max_size=8),
    st.lists(faults, max_size=6),
    breaks,
    st.sampled_from(["wait", "fail"]),
)
@simulated
async def test_a_link_that_breaks_and_comes_back_gives_the_right_value_or_an_error(
    script: list[Call], faults: list[Fault], plan: list[tuple[float, str]], during_gap: str
) -> None:
    robot = WifiRobot()
    airs: list[Air] = []
    opened: list[float] = []
    is_clear = True

    async def start() -> Session:
        if not is_clear:
            raise LinkNotFound("out of range")
        near, far = wifi_pair()
        airs.append(Air(robot, far, 0.005))
        opened.append(robot.clock)
        return await Session.open(near)

    async def break_link() -> None:
        nonlocal is_clear
        for pause, what in plan:
            await asyncio.sleep(pause)
            if what == "noise":
                airs[-1].down(b"\x00")
            else:
                is_clear = what == "clear"
                if not is_clear:
                    airs[-1].cut()
        is_clear = True

    policy = Policy(during_gap=during_gap, give_up_after=20.0)  # type: ignore[arg-type]
    channel = await Reconnector("wifi://robot", start, policy).open()
    airs[0].up_faults.extend(faults)
    airs[0].down_faults.extend(faults)
    rig = WifiRig(robot, airs[0], channel)  # type: ignore[arg-type]
    breaking = asyncio.ensure_future(break_link())
    try:
        honest = await play(rig, script)
    finally:
        breaking.cancel()
        await asyncio.gather(breaking, return_exceptions=True)
        await channel.close()
        for air in airs:
            air.cut()
        await robot.close()
    assert len(honest.outcomes) == len(script)
    for outcome in honest.outcomes:
        honest.check(outcome)
    for time, command in zip(robot.adopted_at, robot.adopted, strict=True):
        speed = struct.unpack_from("<2h", command, 3)
        if speed != (0, 0) and not command[2] & 4:
            link = max(began for began in opened if began <= time)
            assert any(
                outcome.ended - honest.origin >= link
                for outcome in honest.outcomes
                if outcome.name == "set_speed" and speed == tuple(steps(outcome.args))
            ), f"told to drive at {speed} on a link on which no call asked for it"
    assert robot.wrong == []
    assert len(asyncio.all_tasks()) == 1, asyncio.all_tasks()
