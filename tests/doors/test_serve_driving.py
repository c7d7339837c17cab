"""Who drives a robot of ``elib serve``, and what stops it."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

import pytest
from local_network import LocalLoop
from serve_rig import Program, Rig, serving

from shared import needs_page

pytestmark = needs_page

# clock: simulated
LOOP = LocalLoop
STOPPED_WITHIN = 0.5
"""s from the last word of a driver until the wheels stand."""


@contextlib.asynccontextmanager
async def beating(program: Program) -> AsyncIterator[None]:
    """Let a program say that it is there while the block lasts."""
    beats = asyncio.create_task(program.drive_on())
    try:
        yield
    finally:
        beats.cancel()
        await asyncio.wait([beats])


async def drive(rig: Rig, program: Program, key: str = "1") -> None:
    await program.ask("set_speed", robot=key, left=0.5, right=0.5)
    await rig.until_it_moves(key)


async def test_a_robot_drives_while_its_driver_beats_and_stands_half_a_second_after_it_fell_silent() -> None:
    async with serving() as rig, rig.program() as program:
        await drive(rig, program)
        async with beating(program):
            await asyncio.sleep(2)
            assert all(rig.wheels())
        assert await rig.until_it_stands() < STOPPED_WITHIN
        assert rig.slot().drive.driver == ""
        async with beating(program):
            await asyncio.sleep(1)
            assert rig.wheels() == (0, 0)  # it only beats


async def test_a_connection_that_is_closed_stops_the_robot_at_once() -> None:
    async with serving() as rig, rig.program() as program:
        await drive(rig, program)
        program.socket.transport.abort()
        assert await rig.until_it_stands() < 0.1


async def test_a_driver_that_falls_silent_is_told_that_its_robot_was_stopped() -> None:
    async with serving() as rig, rig.program() as program:
        await drive(rig, program)
        error = await program.until_told("error")
        assert error["robot"] == "1"
        assert error["error"]["kind"] == "MotionInterrupted"
        assert "no message came" in error["error"]["message"]
        await rig.until_it_stands()
        await drive(rig, program)  # nobody drives, so it may go on


async def test_a_driver_that_has_stopped_its_robot_may_be_silent() -> None:
    async with serving() as rig, rig.program() as program:
        await drive(rig, program)
        await program.ask("stop")
        await asyncio.sleep(0.6)
        await program.ask("hello")
        assert program.told == []
        await drive(rig, program)


async def test_one_program_drives_and_the_others_are_refused_until_one_takes_over() -> None:
    async with serving() as rig, rig.program() as one, rig.program() as other:
        await drive(rig, one)
        async with beating(one):
            error = await other.refused("set_speed", left=0.1, right=0.1)
            assert (error["kind"], "another one drives" in error["message"]) == ("ArgumentError", True)
            assert (await other.refused("drive"))["hint"] == '{"do": "drive", "force": true} takes over'
            assert (await other.ask("hello"))["robots"][0]["driver"] == "another"
            assert len(await other.ask("proximity")) == 9  # everybody may read
            assert all(rig.wheels())
            await other.ask("drive", force=True)
            await rig.until_it_stands()
            assert (await other.ask("beat")) == {"drives": ["1"]}
            told = await one.until_told("error")
            assert told["error"]["message"] == "another one drives sim://square now"
            await other.ask("drive")
            assert "another one" in (await one.refused("set_speed", left=0.5, right=0.5))["message"]
        await other.ask("leave")
        await drive(rig, one)


async def test_everybody_may_stop_and_the_driver_goes_on_only_when_it_asks_to_drive() -> None:
    async with serving() as rig, rig.program() as one, rig.program() as other:
        await drive(rig, one)
        async with beating(one):
            await other.ask("stop")
            await rig.until_it_stands()
            assert (await one.until_told("error"))["error"]["message"] == "somebody has stopped sim://square"
            error = await one.refused("set_speed", left=0.5, right=0.5)
            assert "somebody has stopped" in error["message"]
            assert rig.wheels() == (0, 0)
            await one.ask("drive")
            await drive(rig, one)
            rig.slot().stop()  # a person presses Stop on the page
            await rig.until_it_stands()
            assert "somebody has stopped" in (await one.refused("set_speed", left=0.5, right=0.5))["message"]


@pytest.mark.parametrize("silence", [0.1, 0.6], ids=["beating", "between two slow messages"])
async def test_a_stop_holds_until_the_driver_asks_to_drive_however_rarely_it_speaks(silence: float) -> None:
    async with serving() as rig, rig.program() as program:
        await drive(rig, program)
        rig.slot().stop()  # a person presses Stop on the page
        await asyncio.sleep(silence)
        error = await program.refused("set_speed", left=0.5, right=0.5)
        assert "somebody has stopped" in error["message"]
        await rig.until_it_stands()


async def test_a_program_that_leaves_the_wheel_stops_its_robot() -> None:
    async with serving() as rig, rig.program() as program:
        await drive(rig, program)
        await program.ask("leave")
        await rig.until_it_stands()
        assert await program.ask("beat") == {"drives": []}


async def test_robots_are_driven_apart_and_one_stop_stops_them_all() -> None:
    async with serving("sim://arena?robots=3") as rig, rig.program() as one, rig.program() as other:
        assert [robot["robot"] for robot in (await one.ask("hello"))["robots"]] == ["1", "2", "3"]
        assert (await one.refused("proximity"))["hint"] == 'add "robot", one of "1", "2", "3"'
        assert "no robot '4'" in (await one.refused("proximity", robot="4"))["message"]
        async with beating(one), beating(other):
            await drive(rig, one, "1")
            await drive(rig, other, "2")
            await one.ask("stop", robot="1")
            assert rig.wheels("1") == (0, 0)
            assert all(rig.wheels("2"))
            await one.ask("stop")
            assert [rig.wheels(key) for key in "123"] == [(0, 0)] * 3


async def test_a_link_that_is_lost_while_a_program_drives_is_told_and_answered() -> None:
    async with serving() as rig, rig.program() as program:
        await drive(rig, program)
        async with beating(program):
            await program.ask("watch", readings=["proximity"])
            await program.ask_often("image")
            await asyncio.sleep(0.1)
            await rig.slot().disconnect()
            assert {each["error"]["kind"] for each in await program.answers() if not each["ok"]} == {"LinkClosed"}
            first = await program.until_told("error")
            assert first["robot"] == "1"
            await program.until_told("error", lambda message: message is not first)  # the watch has ended, too
            assert (await program.refused("proximity"))["kind"] == "LinkClosed"
            assert (await program.refused("set_speed", left=1, right=1))["kind"] == "LinkClosed"
            assert (await program.ask("hello"))["robots"][0]["state"] == "disconnected"
            assert await rig.slot().connect()
            await drive(rig, program)


async def test_the_end_of_the_door_answers_what_waits_and_stops_the_robot() -> None:
    door = serving()
    rig = await door.__aenter__()
    async with rig.program() as program:
        await drive(rig, program)
        await program.ask_often("image")
        await asyncio.sleep(0.1)
        slot = rig.slot()
        ending = asyncio.ensure_future(door.__aexit__(None, None, None))
        assert {each["error"]["kind"] for each in await program.answers() if not each["ok"]} == {"LinkClosed"}
        await ending
    assert not slot.drive.may_move
