"""Behaviours in the panel: they drive the robot that is connected anyhow, and give way to people."""

from __future__ import annotations

import asyncio
import json
import math

import pytest

from elib.errors import ArgumentError, LinkClosed
from elib.joystick.behaving import Act, catalogue, performance, source_of
from elib.joystick.pilot import Phase, Pilot, lines_of
from elib.testing import simulated

ARENA = "sim://arena?speed=max"


async def connected(url: str = ARENA) -> Pilot:
    pilot = Pilot(url)
    assert await pilot.connect()
    pilot.join("page")
    return pilot


def place(pilot: Pilot) -> tuple[float, float, float]:
    control = pilot.control
    assert control is not None
    pose = control.world.pose(0)
    return pose.x, pose.y, pose.heading


def gone(before: tuple[float, float, float], after: tuple[float, float, float]) -> float:
    return math.hypot(after[0] - before[0], after[1] - before[1])


async def stands(pilot: Pilot) -> bool:
    """Whether the robot has come to a stand and stays so."""
    await asyncio.sleep(0.3)
    stood = place(pilot)
    await asyncio.sleep(2)
    return place(pilot) == stood


async def until(pilot: Pilot, act: Act, seconds: float = 60) -> None:
    for _ in range(round(seconds / 0.1)):
        if pilot.performer.act is act:
            return
        await asyncio.sleep(0.1)
    raise AssertionError(f"{pilot.performer.name} is {pilot.performer.act}: {pilot.performer.error}")


@simulated
async def test_a_behaviour_drives_and_tells_its_state() -> None:
    pilot = await connected()
    start = place(pilot)
    pilot.performer.start("avoid", {"cruise": 0.5})
    await asyncio.sleep(2)
    assert gone(start, place(pilot)) > 0.05
    assert (pilot.performer.act, pilot.performer.state) == (Act.RUNNING, "roaming")
    assert pilot.helm.may_move
    assert pilot.age("proximity") < 0.3
    assert [line.text for line in lines_of(pilot.lines, ["state"])] == ["avoid begins", "avoid: roaming"]
    await pilot.performer.stop()
    assert pilot.performer.act is Act.STOPPED
    await pilot.disconnect()


@simulated
async def test_a_stopped_behaviour_moves_nothing_any_more() -> None:
    pilot = await connected()
    pilot.performer.start("avoid")
    await asyncio.sleep(2)
    await pilot.performer.stop()
    assert await stands(pilot)
    assert not pilot.helm.may_move
    await pilot.disconnect()


@simulated
async def test_a_paused_robot_stands_and_goes_on_as_it_was() -> None:
    pilot = await connected()
    pilot.performer.start("avoid")
    await asyncio.sleep(1)
    pilot.performer.pause()
    await asyncio.sleep(0.3)
    stood = place(pilot)
    await asyncio.sleep(5)
    assert place(pilot) == stood
    assert pilot.performer.act is Act.PAUSED
    assert not pilot.is_stale("proximity")
    pilot.performer.resume()
    await asyncio.sleep(1)
    assert gone(stood, place(pilot)) > 0.03
    assert pilot.performer.act is Act.RUNNING
    await pilot.disconnect()


@simulated
async def test_a_blocking_behaviour_closes_its_square_in_spite_of_a_pause_on_every_side() -> None:
    pilot = await connected("sim://square?speed=max")
    start = place(pilot)
    pilot.performer.start("go-and-turn", {"side": 0.1})
    for _ in range(4):
        await asyncio.sleep(1.2)
        pilot.performer.pause()
        await asyncio.sleep(2)
        pilot.performer.resume()
    await until(pilot, Act.ENDED)
    assert gone(start, place(pilot)) < 0.01
    assert abs(math.remainder(place(pilot)[2] - start[2], math.tau)) < 0.05
    assert "closes within" in pilot.performer.lines[-1][1]
    assert pilot.performer.line_count == 5
    assert not pilot.helm.may_move
    await pilot.disconnect()


@simulated
async def test_a_blocking_behaviour_with_callbacks_can_be_paused_and_stopped() -> None:
    pilot = await connected("sim://square?speed=max")
    start = place(pilot)
    pilot.performer.start("go-x-cm", {"cm": 40})
    await asyncio.sleep(3)
    pilot.performer.pause()
    await asyncio.sleep(2)
    paused = place(pilot)
    pilot.performer.resume()
    await asyncio.sleep(3)
    assert gone(start, paused) < gone(start, place(pilot))
    await pilot.performer.stop()
    assert await stands(pilot)
    assert gone(start, place(pilot)) < 0.3
    await pilot.disconnect()


@simulated
async def test_a_tour_over_the_callback_style_comes_to_its_end() -> None:
    pilot = await connected()
    pilot.performer.start("sensors-tour")
    await until(pilot, Act.ENDED)
    texts = [text for _, text in pilot.performer.lines]
    assert len(texts) == 12
    assert all("OK" in text for text in texts)
    await pilot.disconnect()


@simulated
async def test_who_touches_the_stick_pauses_the_behaviour_and_has_the_robot() -> None:
    pilot = await connected()
    pilot.performer.start("avoid")
    await asyncio.sleep(1)
    for _ in range(10):
        pilot.helm.steer("page", -0.2, 0.2)
        await asyncio.sleep(0.1)
    assert pilot.performer.act is Act.PAUSED
    assert "by hand" in pilot.performer.reason
    assert pilot.readings["speed"] == (pytest.approx(-0.1), pytest.approx(0.1))
    with pytest.raises(ArgumentError, match="by hand"):
        pilot.performer.resume()
    pilot.helm.leave("page")
    assert await stands(pilot)
    assert pilot.performer.act is Act.PAUSED
    pilot.performer.resume()
    await asyncio.sleep(1)
    assert pilot.performer.act is Act.RUNNING
    await pilot.disconnect()


@simulated
async def test_a_behaviour_begins_and_goes_on_as_soon_as_the_hand_is_off_the_stick() -> None:
    pilot = await connected()

    async def hold(share: float, seconds: float) -> None:
        for _ in range(round(seconds / 0.1)):
            pilot.helm.steer("other", share, share)
            await asyncio.sleep(0.1)

    await hold(0.2, 0.5)
    with pytest.raises(ArgumentError, match="by hand"):
        pilot.performer.start("avoid")
    await hold(0, 0.1)  # a page that drove says for a while that it is there
    pilot.performer.start("avoid")
    start = place(pilot)
    assert not pilot.helm.captain
    for _ in range(10):
        assert not pilot.helm.beat("other")
        await asyncio.sleep(0.1)
    assert gone(start, place(pilot)) > 0.03, "that page's silence stops it no more"
    await asyncio.sleep(1)
    assert pilot.performer.act is Act.RUNNING
    await hold(0.2, 0.5)
    assert pilot.performer.act is Act.PAUSED
    await hold(0, 0.1)
    paused = place(pilot)
    pilot.performer.resume()
    await asyncio.sleep(1)
    assert pilot.performer.act is Act.RUNNING
    assert gone(paused, place(pilot)) > 0.03
    await pilot.disconnect()


@simulated
async def test_stop_ends_the_behaviour_whoever_presses_it() -> None:
    pilot = await connected()
    pilot.performer.start("avoid")
    await asyncio.sleep(1)
    pilot.stop()
    assert await stands(pilot)
    assert pilot.performer.act is Act.STOPPED
    await pilot.disconnect()


@simulated
async def test_stop_ends_a_paused_blocking_behaviour() -> None:
    pilot = await connected()
    pilot.performer.start("go-and-turn")
    await asyncio.sleep(1)
    pilot.performer.pause()
    await asyncio.sleep(1)
    await pilot.performer.stop()
    assert pilot.performer.act is Act.STOPPED
    pilot.performer.start("avoid")
    await asyncio.sleep(1)
    assert pilot.performer.act is Act.RUNNING
    await pilot.disconnect()


@simulated
async def test_with_the_last_page_the_behaviour_ends_and_not_before() -> None:
    pilot = await connected()
    pilot.join("other")
    pilot.performer.start("avoid")
    await asyncio.sleep(0.5)
    pilot.leave("page")
    assert pilot.performer.act is Act.RUNNING
    pilot.leave("other")
    assert pilot.performer.act is Act.STOPPED
    assert await stands(pilot)
    await pilot.disconnect()


@simulated
async def test_disconnecting_ends_the_behaviour_first() -> None:
    pilot = await connected()
    pilot.performer.start("go-and-turn")
    await asyncio.sleep(1)
    await pilot.disconnect()
    assert pilot.performer.act is Act.STOPPED
    assert (pilot.phase, pilot.helm.may_move) == (Phase.DISCONNECTED, False)
    assert not lines_of(pilot.lines, ["link"], "may still be moving")


@simulated
async def test_a_behaviour_lives_through_a_gap_if_it_is_made_for_that_and_ends_if_not() -> None:
    for name, act in (("avoid", Act.RUNNING), ("go-and-turn", Act.RUNNING), ("calibration-drive", Act.FAILED)):
        pilot = await connected()
        pilot.performer.start(name)
        await asyncio.sleep(1)
        transport = pilot.robot.session.transport
        transport.lose("pulled")  # type: ignore[attr-defined]
        await asyncio.sleep(4)
        assert pilot.phase is Phase.CONNECTED
        assert (name, pilot.performer.act) == (name, act), pilot.performer.error
        await pilot.disconnect()


@simulated
async def test_what_cannot_run_is_refused_with_the_reason() -> None:
    pilot = Pilot(ARENA)
    with pytest.raises(LinkClosed, match="not connected"):
        pilot.performer.start("avoid")
    await pilot.connect()
    with pytest.raises(ArgumentError, match="several robots"):
        pilot.performer.start("aggregation")
    with pytest.raises(ArgumentError, match="opens the line itself"):
        pilot.performer.start("port-turn-around")
    with pytest.raises(ArgumentError, match="no behaviour"):
        pilot.performer.start("../avoid")
    with pytest.raises(ArgumentError, match="cruise is 7"):
        pilot.performer.start("avoid", {"cruise": 7})
    with pytest.raises(ArgumentError, match="no option"):
        pilot.performer.start("avoid", {"robot": 1})
    for name in (None, 7, "a" * 1000):
        with pytest.raises(ArgumentError, match="short text"):
            pilot.performer.start(name)  # type: ignore[arg-type]
    pilot.performer.start("avoid")
    with pytest.raises(ArgumentError, match="still running"):
        pilot.performer.start("avoid")
    await pilot.disconnect()


@simulated
async def test_a_behaviour_that_fails_says_why_and_the_robot_stands() -> None:
    pilot = await connected("sim://arena?speed=max&firmware=btcom-2.0")
    pilot.performer.start("go-and-turn", {"side": 0.02})
    await until(pilot, Act.ENDED)
    pilot.performer.start("calibration-drive")
    await asyncio.sleep(1)

    async def broken(*_: object) -> None:
        raise ZeroDivisionError("a defect")

    pilot.performer._gate.execute = broken  # type: ignore[union-attr, method-assign, assignment]
    await until(pilot, Act.FAILED)
    assert "a defect" in pilot.performer.error
    assert await stands(pilot)
    await pilot.disconnect()


@simulated
async def test_how_it_stands_is_json_and_only_news_come() -> None:
    pilot = await connected("sim://square?speed=max")
    assert performance(pilot.performer)["act"] == "idle"
    pilot.performer.start("go-and-turn", {"side": 0.02})
    await until(pilot, Act.ENDED)
    shown = performance(pilot.performer)
    assert json.loads(json.dumps(shown, allow_nan=False)) == shown
    assert (shown["name"], shown["act"], shown["act_text"]) == ("go-and-turn", "ended", "came to its end")
    assert len(shown["lines"]) == shown["count"] == 5  # type: ignore[arg-type]
    assert performance(pilot.performer, 5)["lines"] == []
    assert len(performance(pilot.performer, 4)["lines"]) == 1  # type: ignore[arg-type]
    await pilot.disconnect()


def test_the_catalogue_has_every_behaviour_with_options_and_source() -> None:
    there = {each["name"]: each for each in catalogue()}
    assert there["aggregation"]["elsewhere"]
    assert not there["avoid"]["elsewhere"]
    (cruise,) = there["avoid"]["options"]  # type: ignore[misc, union-attr]
    assert (cruise["name"], cruise["unit"], cruise["low"], cruise["default"]) == ("cruise", "rev/s", 0.05, 0.6)  # type: ignore[index, call-overload]
    json.dumps(list(there.values()), allow_nan=False)
    assert "async def wander(" in source_of("avoid")
    with pytest.raises(ArgumentError, match="no behaviour"):
        source_of("/etc/passwd")
