"""A recording in the panel: held, continued, and played from any moment of it; in simulated time."""

from __future__ import annotations

import asyncio
import math
import runpy
from pathlib import Path

import pytest

import elib
from elib.base.errors import ArgumentError
from elib.base.timebase import SimulatedLoop
from elib.behaviours import run_behaviour_blocking
from elib.panel.server.instruments import tick
from elib.panel.slot import Phase, Slot
from elib.records.reader import Recording
from elib.records.timeline import timeline

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


# -- the states of a program --


def machine_of_a_file(folder: Path) -> tuple[elib.Behaviour, str]:
    text = (
        "import elib\n\n\n"
        "def drive(robot, run):\n"
        "    if run.entered:\n"
        "        robot.set_speed(0.3, 0.3)\n"
        "    if run.time_in_state > 1:\n"
        '        return "turn"\n\n\n'
        "def turn(robot):\n"
        "    robot.turn(1.6)\n"
        '    return "drive"\n\n\n'
        'machine = elib.states(drive, turn, name="walk")\n'
    )
    (folder / "walk.py").write_text(text)
    return runpy.run_path(str(folder / "walk.py"))["machine"], text


def recorded_machine(folder: Path) -> tuple[Path, str]:
    """Let a machine drive for eight seconds, in a program that records and logs its robot itself."""
    machine, text = machine_of_a_file(folder)
    with elib.connect(SIM) as robot:
        robot.record(folder / "walk.mcap")
        robot.log(str(folder / "walk.log"))
        run_behaviour_blocking(machine, robot, seconds=8)
    return folder / "walk.mcap", text


def test_a_recorded_machine_leaves_its_states_and_its_program_in_recording_and_log(tmp_path: Path) -> None:
    path, text = recorded_machine(tmp_path)
    states = [moment.text for moment in timeline(Recording(path), ["state"])]
    assert states[:3] == ["drive", "turn", "drive"]
    assert [entry.data["program"] for entry in Recording(path).entries("/program")] == [text]
    lines = (tmp_path / "walk.log").read_text().splitlines()
    assert [line.rpartition("state: ")[2] for line in lines if "state: " in line][:3] == states[:3]


async def test_a_recording_that_is_played_shows_its_machine_and_the_state_of_each_moment(tmp_path: Path) -> None:
    path, text = await asyncio.to_thread(recorded_machine, tmp_path)
    slot = await playing(path)
    seen = []
    while slot.is_playing:
        found = tick(slot).machine
        if found is not None and (not seen or seen[-1] != (found.state, found.previous_state)):
            seen.append((found.state, found.previous_state))
        await asyncio.sleep(0.01)
    assert slot.machine.program == text
    assert [pair for pair in seen if pair[0]][:3] == [("drive", ""), ("turn", "drive"), ("drive", "turn")]
    over = tick(slot).machine
    assert over is not None
    assert over.state == "", "nothing is lit when it is over"
    await slot.disconnect()


async def test_the_panel_shows_a_behaviour_of_states_and_forgets_it_for_one_without(tmp_path: Path) -> None:
    slot = Slot("sim://red-boxes?speed=max")
    await slot.connect()
    slot.records.recording.start(str(tmp_path / "run.mcap"))
    slot.runner.start("bull")
    await asyncio.sleep(5)
    found = tick(slot).machine
    assert found is not None
    assert found.state == slot.runner.state != ""
    assert "def charging" in slot.machine.program
    slot.runner.halt()
    await asyncio.sleep(3)
    slot.runner.start("avoid")
    await asyncio.sleep(3)
    assert tick(slot).machine is None
    await slot.disconnect()
    kinds = [moment.text for moment in timeline(Recording(tmp_path / "run.mcap"), ["state"])]
    assert "searching" in kinds, "the panel's own recording keeps the states, too"
