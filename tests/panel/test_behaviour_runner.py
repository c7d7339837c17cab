"""Behaviours in the panel: they drive the robot that is connected anyhow, and give way to people."""

from __future__ import annotations

import asyncio
import math

import msgspec
import pytest
from event_lines import lines_of

import shared
from elib.base.errors import ArgumentError, LinkClosed
from elib.base.timebase import SimulatedLoop
from elib.panel.behaviours import BehaviourAbout, Play, RunPhase, catalogue, runner_state, source_of
from elib.panel.slot import Phase, Slot
from elib.testing.inside import transport_of

# clock: simulated
LOOP = SimulatedLoop
SQUARE = pytest.mark.parametrize("url", ["sim://square?speed=max"])


@pytest.fixture
def url() -> str:
    return "sim://arena?speed=max"


@pytest.fixture
def slot(slot: Slot) -> Slot:
    slot.join("page")
    return slot


def place(slot: Slot) -> tuple[float, float, float]:
    control = slot.control
    assert control is not None
    pose = control.world.pose(0)
    return pose.x, pose.y, pose.heading


def gone(before: tuple[float, float, float], after: tuple[float, float, float]) -> float:
    return math.hypot(after[0] - before[0], after[1] - before[1])


async def stands(slot: Slot) -> bool:
    """Whether the robot has come to a stand and stays so."""
    await asyncio.sleep(0.3)
    stood = place(slot)
    await asyncio.sleep(2)
    return place(slot) == stood


async def until(slot: Slot, phase: RunPhase) -> None:
    await shared.until(lambda: slot.runner.phase is phase)


async def test_a_behaviour_drives_and_tells_its_state(slot: Slot) -> None:
    start = place(slot)
    slot.runner.start("avoid", {"cruise": 0.5})
    await asyncio.sleep(2)
    assert gone(start, place(slot)) > 0.05
    assert (slot.runner.phase, slot.runner.state) == (RunPhase.RUNNING, "roaming")
    assert slot.drive.may_move
    assert slot.watcher.age("proximity") < 0.3
    assert [line.text for line in lines_of(slot.log.lines, ["state"])] == ["avoid begins", "roaming"]
    await slot.runner.stop()
    assert slot.runner.phase is RunPhase.STOPPED


async def test_a_stopped_behaviour_moves_nothing_any_more(slot: Slot) -> None:
    slot.runner.start("avoid")
    await asyncio.sleep(2)
    await slot.runner.stop()
    assert await stands(slot)
    assert not slot.drive.may_move


async def test_a_paused_robot_stands_and_goes_on_as_it_was(slot: Slot) -> None:
    slot.runner.start("avoid")
    await asyncio.sleep(1)
    slot.runner.pause()
    await asyncio.sleep(0.3)
    stood = place(slot)
    await asyncio.sleep(5)
    assert place(slot) == stood
    assert slot.runner.phase is RunPhase.PAUSED
    assert not slot.is_stale("proximity")
    slot.runner.resume()
    await asyncio.sleep(1)
    assert gone(stood, place(slot)) > 0.03
    assert slot.runner.phase is RunPhase.RUNNING


@pytest.mark.parametrize("url", ["sim://arena?speed=max&latency=0.15"])
async def test_a_pause_while_the_old_speed_is_on_its_way_stops_the_robot_too(slot: Slot) -> None:
    slot.runner.start("avoid")
    await asyncio.sleep(2)
    slot.runner.pause()
    await asyncio.sleep(1.5)
    slot.runner.resume()
    await asyncio.sleep(0.1)
    slot.runner.pause()
    slot.runner.resume()
    slot.runner.pause()
    await asyncio.sleep(1)
    assert await stands(slot)
    assert (slot.runner.phase, slot.drive.may_move) == (RunPhase.PAUSED, False)
    slot.runner.resume()
    await until(slot, RunPhase.RUNNING)


@SQUARE
async def test_a_blocking_behaviour_closes_its_square_in_spite_of_a_pause_on_every_side(slot: Slot) -> None:
    start = place(slot)
    slot.runner.start("go-and-turn", {"side": 0.1})
    for _ in range(4):
        await asyncio.sleep(1.2)
        slot.runner.pause()
        await asyncio.sleep(2)
        slot.runner.resume()
    await until(slot, RunPhase.ENDED)
    assert gone(start, place(slot)) < 0.01
    assert abs(math.remainder(place(slot)[2] - start[2], math.tau)) < 0.05
    assert "closes within" in slot.runner.lines[-1][1]
    assert slot.runner.line_count == 5
    assert not slot.drive.may_move


@SQUARE
async def test_a_blocking_behaviour_with_callbacks_can_be_paused_and_stopped(slot: Slot) -> None:
    start = place(slot)
    slot.runner.start("go-x-cm", {"cm": 40})
    await asyncio.sleep(3)
    slot.runner.pause()
    await asyncio.sleep(2)
    paused = place(slot)
    slot.runner.resume()
    await asyncio.sleep(3)
    assert gone(start, paused) < gone(start, place(slot))
    await slot.runner.stop()
    assert await stands(slot)
    assert gone(start, place(slot)) < 0.3


async def test_a_tour_over_the_callback_style_comes_to_its_end(slot: Slot) -> None:
    slot.runner.start("sensors-tour")
    await until(slot, RunPhase.ENDED)
    texts = [text for _, text in slot.runner.lines]
    assert len(texts) == 12
    assert all("OK" in text for text in texts)


async def test_who_touches_the_stick_pauses_the_behaviour_and_has_the_robot(slot: Slot) -> None:
    slot.runner.start("avoid")
    await asyncio.sleep(1)
    for _ in range(10):
        slot.drive.steer("page", -0.2, 0.2)
        await asyncio.sleep(0.1)
    assert slot.runner.phase is RunPhase.PAUSED
    assert "a person drives" in slot.runner.reason
    assert slot.readings["speed"] == (pytest.approx(-0.1), pytest.approx(0.1))
    with pytest.raises(ArgumentError, match="a person drives"):
        slot.runner.resume()
    slot.drive.leave("page")
    assert await stands(slot)
    assert slot.runner.phase is RunPhase.PAUSED
    slot.runner.resume()
    await asyncio.sleep(1)
    assert slot.runner.phase is RunPhase.RUNNING


async def test_a_behaviour_begins_and_goes_on_as_soon_as_the_hand_is_off_the_stick(slot: Slot) -> None:

    async def hold(share: float, seconds: float) -> None:
        for _ in range(round(seconds / 0.1)):
            slot.drive.steer("other", share, share)
            await asyncio.sleep(0.1)

    await hold(0.2, 0.5)
    with pytest.raises(ArgumentError, match="a person drives"):
        slot.runner.start("avoid")
    await hold(0, 0.1)  # a page that drove says for a while that it is there
    slot.runner.start("avoid")
    start = place(slot)
    assert not slot.drive.driver
    for _ in range(10):
        assert not slot.drive.beat("other")
        await asyncio.sleep(0.1)
    assert gone(start, place(slot)) > 0.03, "that page's silence stops it no more"
    await asyncio.sleep(1)
    assert slot.runner.phase is RunPhase.RUNNING
    await hold(0.2, 0.5)
    assert slot.runner.phase is RunPhase.PAUSED
    await hold(0, 0.1)
    paused = place(slot)
    slot.runner.resume()
    await asyncio.sleep(1)
    assert slot.runner.phase is RunPhase.RUNNING
    assert gone(paused, place(slot)) > 0.03


async def test_stop_ends_the_behaviour_whoever_presses_it(slot: Slot) -> None:
    slot.runner.start("avoid")
    await asyncio.sleep(1)
    slot.stop()
    assert await stands(slot)
    assert slot.runner.phase is RunPhase.STOPPED


async def test_stop_ends_a_paused_blocking_behaviour(slot: Slot) -> None:
    slot.runner.start("go-and-turn")
    await asyncio.sleep(1)
    slot.runner.pause()
    await asyncio.sleep(1)
    await slot.runner.stop()
    assert slot.runner.phase is RunPhase.STOPPED
    slot.runner.start("avoid")
    await asyncio.sleep(1)
    assert slot.runner.phase is RunPhase.RUNNING


async def test_with_the_last_page_the_behaviour_ends_and_not_before(slot: Slot) -> None:
    slot.join("other")
    slot.runner.start("avoid")
    await asyncio.sleep(0.5)
    slot.leave("page")
    assert slot.runner.phase is RunPhase.RUNNING
    slot.leave("other")
    assert slot.runner.phase is RunPhase.STOPPED
    assert await stands(slot)


async def test_disconnecting_ends_the_behaviour_first(slot: Slot) -> None:
    slot.runner.start("go-and-turn")
    await asyncio.sleep(1)
    await slot.disconnect()
    assert slot.runner.phase is RunPhase.STOPPED
    assert (slot.phase, slot.drive.may_move) == (Phase.DISCONNECTED, False)
    assert not lines_of(slot.log.lines, ["link"], "may still be moving")


@pytest.mark.parametrize(
    ("name", "act"),
    [("avoid", RunPhase.RUNNING), ("go-and-turn", RunPhase.RUNNING), ("calibration-drive", RunPhase.FAILED)],
)
async def test_a_behaviour_lives_through_a_gap_if_it_is_made_for_that_and_ends_if_not(
    slot: Slot, name: str, act: RunPhase
) -> None:
    slot.runner.start(name)
    await asyncio.sleep(1)
    transport_of(slot.robot).lose("pulled")
    await asyncio.sleep(4)
    assert slot.phase is Phase.CONNECTED
    assert slot.runner.phase is act, slot.runner.error


async def test_what_cannot_run_is_refused_with_the_reason() -> None:
    slot = Slot("sim://arena?speed=max")
    with pytest.raises(LinkClosed, match="not connected"):
        slot.runner.start("avoid")
    await slot.connect()
    with pytest.raises(ArgumentError, match="several robots"):
        slot.runner.start("aggregation")
    with pytest.raises(ArgumentError, match="opens the line itself"):
        slot.runner.start("port-turn-around")
    with pytest.raises(ArgumentError, match="no behaviour"):
        slot.runner.start("../avoid")
    with pytest.raises(ArgumentError, match="cruise is 7"):
        slot.runner.start("avoid", {"cruise": 7})
    with pytest.raises(ArgumentError, match="no option"):
        slot.runner.start("avoid", {"robot": 1})
    slot.runner.start("avoid")
    with pytest.raises(ArgumentError, match="still running"):
        slot.runner.start("avoid")
    await slot.disconnect()


@pytest.mark.parametrize("firmware", ["btcom-2.0"])
async def test_a_behaviour_that_fails_says_why_and_the_robot_stands(slot: Slot) -> None:
    slot.runner.start("go-and-turn", {"side": 0.02})
    await until(slot, RunPhase.ENDED)
    slot.runner.start("calibration-drive")
    await asyncio.sleep(1)

    async def broken(*_: object) -> None:
        raise ZeroDivisionError("a defect")

    slot.runner._interlock.execute = broken  # type: ignore[union-attr, method-assign, assignment]
    await until(slot, RunPhase.FAILED)
    assert "a defect" in slot.runner.error
    assert await stands(slot)


@SQUARE
async def test_how_it_stands_is_json_and_only_news_come(slot: Slot) -> None:
    assert runner_state(slot.runner).phase == "idle"
    slot.runner.start("go-and-turn", {"side": 0.02})
    await until(slot, RunPhase.ENDED)
    shown = runner_state(slot.runner)
    assert msgspec.json.decode(msgspec.json.encode(shown), type=Play) == shown
    assert (shown.name, shown.phase, shown.phase_text) == ("go-and-turn", "ended", "came to its end")
    assert len(shown.lines) == shown.count == 5
    assert runner_state(slot.runner, 5).lines == []
    assert len(runner_state(slot.runner, 4).lines) == 1


def test_the_catalogue_has_every_behaviour_with_options_and_source() -> None:
    there = {each.name: each for each in catalogue()}
    assert there["aggregation"].elsewhere
    assert not there["avoid"].elsewhere
    (cruise,) = there["avoid"].options
    assert (cruise.name, cruise.unit, cruise.low, cruise.default) == ("cruise", "rev/s", 0.05, 0.6)
    assert msgspec.json.decode(msgspec.json.encode(there), type=dict[str, BehaviourAbout]) == there
    assert "async def wander(" in source_of("avoid")
    with pytest.raises(ArgumentError, match="no behaviour"):
        source_of("/etc/passwd")
