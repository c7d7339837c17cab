"""A recording in the panel: held, continued, and played from any moment of it; in simulated time."""

from __future__ import annotations

import asyncio
import math
from pathlib import Path

import pytest

from elib.base.errors import ArgumentError
from elib.base.timebase import SimulatedLoop
from elib.panel.slot import Phase, Slot

# clock: simulated
LOOP = SimulatedLoop
SIM = "sim://square?speed=max"


async def recorded(path: Path) -> None:
    """Record three seconds: an LED is lit after one, and put out after two."""
    slot = Slot(SIM)
    await slot.connect()
    slot.watch_camera(None)
    slot.records.recording.start(str(path))
    for action in (1, 0):
        await asyncio.sleep(1)
        await slot.command("set_led", 3, action)
    await asyncio.sleep(1)
    await slot.disconnect()


async def playing(path: Path) -> Slot:
    """Play a recording, and wait until its length is known."""
    slot = Slot(f"replay://{path}")
    assert await slot.connect()
    while not slot.playback.length:  # noqa: ASYNC110  # in simulated time
        await asyncio.sleep(0.01)
    return slot


def led(slot: Slot) -> int:
    assert slot.context is not None
    return slot.context.last_set.lamps[3]


async def test_what_a_played_robot_came_near_to_is_near(tmp_path: Path) -> None:
    slot = Slot(SIM)
    await slot.connect()
    slot.records.recording.start(str(tmp_path / "run.mcap"))
    await asyncio.sleep(1)
    assert slot.control is not None
    assert min(slot.watcher.distances) == math.inf
    slot.control.move_robot(0, 0.05, 0.5, math.pi)
    await asyncio.sleep(2)
    assert min(slot.watcher.distances) < 0.03, "it stands before a wall"
    await slot.disconnect()
    played = await playing(tmp_path / "run.mcap")
    assert min(played.watcher.distances) == math.inf
    played.playback.seek(2)
    await asyncio.sleep(0.4)
    assert min(played.watcher.distances) < 0.03
    await played.disconnect()


async def test_a_recording_that_is_held_stands_still_and_then_goes_on(tmp_path: Path) -> None:
    await recorded(tmp_path / "run.mcap")
    slot = await playing(tmp_path / "run.mcap")
    await asyncio.sleep(0.5)
    slot.playback.pause(on=True)
    await asyncio.sleep(0.2)
    held = slot.playback.at
    await asyncio.sleep(5)
    assert (slot.playback.at, slot.playback.is_paused, led(slot)) == (held, True, 0)
    slot.playback.pause(on=False)
    await asyncio.sleep(1)
    assert slot.playback.at == pytest.approx(held + 1, abs=0.3)
    assert led(slot) == 1
    await slot.disconnect()


async def test_a_recording_can_be_played_from_any_moment_forwards_and_backwards(tmp_path: Path) -> None:
    await recorded(tmp_path / "run.mcap")
    slot = await playing(tmp_path / "run.mcap")
    assert slot.playback.length == pytest.approx(3, abs=0.5)
    for seconds, lit in ((1.5, 1), (2.5, 0), (0.5, 0), (1.6, 1)):
        slot.playback.seek(seconds)
        await asyncio.sleep(0.1)
        assert slot.playback.at == pytest.approx(seconds + 0.1, abs=0.2)
        assert led(slot) == lit
        assert not slot.is_stale("proximity")
    slot.playback.seek(1e9)
    await asyncio.sleep(0.5)
    assert slot.phase is Phase.DISCONNECTED
    with pytest.raises(ArgumentError, match="not a recording that is being played"):
        slot.playback.seek(0)
    await slot.disconnect()


async def test_a_recording_that_is_held_can_be_moved_to_another_moment(tmp_path: Path) -> None:
    await recorded(tmp_path / "run.mcap")
    slot = await playing(tmp_path / "run.mcap")
    slot.playback.pause(on=True)
    slot.playback.seek(1.5)
    await asyncio.sleep(1)
    assert slot.playback.at == pytest.approx(1.5, abs=0.2)
    assert led(slot) == 1
    await slot.disconnect()
